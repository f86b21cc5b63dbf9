"""What happened to a run from outside, and what its gait clock did about it."""

import math
from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import BoolArray
from drake_quad.report.columns import runs_of
from drake_quad.report.run_files import Run
from drake_quad.scenario import disturbances_of

# Of a push seen from above, the robot heading up; counter-clockwise from straight ahead.
ARROWS = ("↑", "↖", "←", "↙", "↓", "↘", "→", "↗")
WORDS = (
    "ahead",
    "ahead to the left",
    "to the left",
    "back to the left",
    "back",
    "back to the right",
    "to the right",
    "ahead to the right",
)
STEEP = math.radians(60.0)  # out of the level, from which on a push is one up or down
WAIT = "wait"  # of a clock in mode `run`: for a touchdown or a lift-off
MODES = (WAIT, "catch", "settle", "replan")


@dataclass(frozen=True)
class PushMark:
    """A push that the run came to.

    Attributes:
        time: When it began [s].
        duration: How long it lasted [s].
        speed: Of the whole robot that it was worth [m/s].
        arrow: Which way it went, seen from above with the robot heading up.
        words: The same in words.
    """

    time: float
    duration: float
    speed: float
    arrow: str
    words: str


@dataclass(frozen=True)
class ModeBand:
    """A stretch in which the gait clock stood still: one of MODES, from start to end [s]."""

    mode: str
    start: float
    end: float


def push_marks(run: Run) -> list[PushMark]:
    """The pushes that the run came to, in order of time; none in a kinematic replay."""
    if run.kinematic or not len(run.log):
        return []
    marks = []
    for push in disturbances_of(run.scenario, run.robot).pushes:
        if push.time <= run.log.t[-1]:
            arrow, words = _direction(*push.force_H)
            marks.append(PushMark(push.time, push.duration, push.speed, arrow, words))
    return sorted(marks, key=lambda mark: mark.time)


def mode_bands(run: Run) -> list[ModeBand]:
    """The stretches in which the clock stood still and why, in order of time."""
    log = run.log
    if len(log) < 2:
        return []
    mode = np.array(log.text("gait_mode"), dtype=object)
    off = np.isin(mode, MODES)
    # What was waited until the sample after a recovery was still the recovery's.
    recovering = off | np.concatenate([[False], off[:-1]])
    waits = ~recovering & (np.diff(log.number("gait_waited"), prepend=np.nan) > 0.0)
    found = [
        ModeBand(name, float(log.t[first]), float(log.t[min(past, len(log) - 1)]))
        for name, flags in ((WAIT, waits), *((word, mode == word) for word in MODES[1:]))
        for first, past in runs_of(_flags(flags))
    ]
    return sorted(found, key=lambda band: band.start)


def _flags(values: np.ndarray) -> BoolArray:
    return np.asarray(values, dtype=np.bool_)


def _direction(x: float, y: float, z: float) -> tuple[str, str]:
    """Arrow and words for a force: ahead, to the left, up."""
    if abs(z) > math.tan(STEEP) * math.hypot(x, y):
        return ("⊙", "up") if z > 0.0 else ("⊗", "down")
    k = round(math.atan2(y, x) / (math.pi / 4.0)) % len(ARROWS)
    return ARROWS[k], WORDS[k]
