"""What follows from a log: base motion, touchdowns, pushes, modes of the gait clock."""

import math
from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.robot.kinematics import calc_feet
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.run_log import runs_of
from drake_quad.scenario.build import disturbances_of
from drake_quad.stability.safety import NO_SUPPORT, margin_words
from drake_quad.stability.support_polygon import stability_margins

# Directions of a push seen from above, the robot heading up: counter-clockwise from straight ahead.
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
STEEP = math.radians(60.0)  # a push that is steeper than this goes up or down
WAIT = "wait"  # the clock is in mode `run`, and waits for a touchdown or a lift-off
MODES = (WAIT, "catch", "settle", "replan")


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """The body frame B over N samples, in W.

    Attributes:
        p_WB: (N, 3) [m].
        R_WB: (N, 3, 3).
        rpy: (N, 3) roll, pitch, yaw [rad], the yaw without jumps.
    """

    p_WB: FloatArray
    R_WB: FloatArray
    rpy: FloatArray


def base_motion(run: RecordedRun) -> BaseMotion:
    """The body as measured."""
    first = run.layout.q_base
    w, x, y, z = run.positions[:, first : first + 4].T
    norm = w * w + x * x + y * y + z * z
    s = 2.0 / np.where(norm > 0.0, norm, np.nan)
    R = np.stack(
        [
            np.stack([1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)], axis=-1),
            np.stack([s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)], axis=-1),
            np.stack([s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)], axis=-1),
        ],
        axis=-2,
    )
    roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    pitch = -np.arcsin(np.clip(R[:, 2, 0], -1.0, 1.0))
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    rpy = np.stack([roll, pitch, _without_jumps(yaw)], axis=-1)
    return BaseMotion(run.positions[:, first + 4 : first + 7], R, rpy)


def calc_foot_centres(run: RecordedRun) -> FloatArray:
    """The foot spheres' centres as measured, (N, 4, 3) in W [m], by forward kinematics."""
    base = base_motion(run)
    q = run.positions[:, run.layout.q_joints].reshape(-1, 4, 3)
    p_BF = calc_feet(run.robot.geometry, q)
    return np.asarray(base.p_WB[:, None] + np.einsum("nij,nlj->nli", base.R_WB, p_BF))


def margins(run: RecordedRun, name: str = "margin") -> FloatArray:
    """A margin of the log, (N,) [m]; nan where no foot bears, because there is none then."""
    values = run.log.number(name)
    return np.asarray(np.where(values > NO_SUPPORT, values, np.nan))


def least_margins(run: RecordedRun) -> FloatArray:
    """The smallest static margin since the sample before, (N,) [m], NO_SUPPORT or less of no foot.

    That of the sample alone where the log does not have it, as in a replay of the plan.
    """
    return run.log.number("margin_least" if "margin_least" in run.log.columns else "margin")


@dataclass(frozen=True)
class LeastMargin:
    """The moment of a run's smallest static margin, as its summary has it.

    Attributes:
        sample: Its sample.
        time: Time of that [s].
        margin: The margin [m]; NO_SUPPORT or less if no foot bore.
    """

    sample: int
    time: float
    margin: float

    @property
    def words(self) -> str:
        """The margin with its unit, or that no foot bore."""
        return margin_words(self.margin)

    @property
    def sentence(self) -> str:
        """What a figure says of it."""
        name = "" if self.margin <= NO_SUPPORT else "smallest margin "
        return f"{name}{self.words} at {self.time:.1f} s"


def find_least_margin(run: RecordedRun) -> LeastMargin | None:
    """When the static margin was smallest, of all ticks of its monitor; None of no margin."""
    margin = least_margins(run)
    if not np.any(np.isfinite(margin)):
        return None
    k = int(np.nanargmin(margin))
    return LeastMargin(k, float(run.log.t[k]), float(margin[k]))


def has_massless_legs(run: RecordedRun) -> bool:
    """Whether the margin is the paper's, of a robot whose legs have no mass."""
    return run.kinematic and run.scenario.body.path == "uniform"


def whole_robot_margins(run: RecordedRun) -> FloatArray:
    """Static margin of the whole robot's centre of mass over the feet that bear, (N,) [m].

    It is the log's, but where `has_massless_legs`: there the log has that of the body's centre.
    """
    feet, bearing = run.log.feet("position")[..., :2], run.log.flags("bearing")
    return stability_margins(run.log.vector("com")[:, :2], feet, bearing)


def margin_points(run: RecordedRun) -> FloatArray:
    """The point whose margin is measured, (N, 3) in W [m].

    It is the centre of mass; for the paper's robot, whose legs have no mass, B's origin.
    """
    return base_motion(run).p_WB if has_massless_legs(run) else run.log.vector("com")


@dataclass(frozen=True)
class Touchdown:
    """A foot that came to bear.

    Attributes:
        row: The leg's row.
        sample: Index of the first sample in which it bears.
        p_WF: (3,) where the foot's contact was in the middle of its stance, in W [m].
    """

    row: int
    sample: int
    p_WF: FloatArray


def touchdowns(run: RecordedRun, *, shortest: float = 0.1) -> list[Touchdown]:
    """The footprints: every stance longer than `shortest` [s], leg by leg, in time order."""
    bearing, places, t = run.log.flags("bearing"), run.log.feet("position"), run.log.t
    found = []
    for row in range(4):
        for first, past in runs_of(bearing[:, row]):
            place = places[(first + past) // 2, row]
            if t[past - 1] - t[first] >= shortest and np.all(np.isfinite(place)):
                found.append(Touchdown(row, first, place))
    return found


def _without_jumps(angle: FloatArray) -> FloatArray:
    """The angle (N,) [rad], made continuous over its finite samples."""
    known = np.isfinite(angle)
    out = np.array(angle)
    out[known] = np.unwrap(angle[known])
    return out


@dataclass(frozen=True)
class PushEvent:
    """A push that happened before the run ended.

    Attributes:
        time: When it began [s].
        duration: How long it lasted [s].
        speed: Change of speed that it causes of the robot as its file has it [m/s].
        arrow: Its direction, seen from above with the robot heading up.
        words: Its direction in words.
    """

    time: float
    duration: float
    speed: float
    arrow: str
    words: str


@dataclass(frozen=True)
class ClockStop:
    """A stretch in which the gait clock stood still: one of MODES, from start to end [s]."""

    mode: str
    start: float
    end: float


def push_events(run: RecordedRun) -> list[PushEvent]:
    """The pushes before the run ended, in order of time; none in a kinematic replay."""
    if run.kinematic or not len(run.log):
        return []
    marks = []
    for push in disturbances_of(run.scenario, run.robot).pushes:
        if push.time <= run.log.t[-1]:
            arrow, words = _direction(*push.force_H)
            marks.append(PushEvent(push.time, push.duration, push.speed, arrow, words))
    return sorted(marks, key=lambda mark: mark.time)


def clock_stops(run: RecordedRun) -> list[ClockStop]:
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
        ClockStop(name, float(log.t[first]), float(log.t[min(past, len(log) - 1)]))
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
