"""Figures of a run's events: waits of the gait clock, recoveries, pushes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.ports import is_swinging
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.log import columns_of
from drake_quad.runs.pose_metrics import base_error
from drake_quad.runs.schema import Columns
from drake_quad.systems.disturbances import Push


def recovery_figures(c: Columns) -> list[dict[str, Any]]:
    """The times that the plan was left and found again, in order.

    Returns:
        For each, the `time` at which the clock stopped [s], the `legs` that were put down to catch
        the robot, in order (none if it caught itself standing), and the `duration` [s] until the
        clock ran again, None if the run ended before.
    """
    t, mode, leg = c["t"], c["gait_mode"], c["catch_leg"]
    off = mode != "run"
    # Straight from the plan's making into the next fall: two recoveries, if nobody saw it run.
    again = np.zeros(len(t), dtype=bool)
    again[1:] = (mode[:-1] == "replan") & off[1:] & (mode[1:] != "replan")
    begun = off & (again | ~np.concatenate([[False], off[:-1]]))
    found = []
    for first in np.flatnonzero(begun):
        over = np.flatnonzero((~off | again)[first + 1 :])
        past = first + 1 + int(over[0]) if len(over) else len(t)
        found.append(
            {
                "time": float(t[first]),
                "legs": [SHORT_NAMES[k - 1] for k in _steps(leg[first:past])],
                "duration": float(t[past] - t[first]) if past < len(t) else None,
            }
        )
    return found


def wait_figures(c: Columns) -> dict[str, float]:
    """How long the clock waited for what [s]: `touchdown`, `lift_off`, `recovery`.

    Their sum is all that the clock waited; where one follows another within a sample, that sample
    counts for one of them.
    """
    waited = np.diff(c["gait_waited"], prepend=0.0)
    off = c["gait_mode"] != "run"
    recovery = off | np.concatenate([[False], off[:-1]])
    landing = _waits_for_landing(c)
    return {
        "touchdown": float(np.sum(waited[~recovery & landing])),
        "lift_off": float(np.sum(waited[~recovery & ~landing])),
        "recovery": float(np.sum(waited[recovery])),
    }


def _waits_for_landing(c: Columns) -> BoolArray:
    """Whether the clock, if it waits, waits for the touchdown of swing legs, (N,).

    It waits at the end of a swing or of a stance on all four. Where the next leg is to lift off
    at the very touchdown of the last, it waits for the foot until that bears.
    """
    swing = c["swing_leg"]
    before = np.concatenate([swing[:1], swing[:-1]])
    # A sample whose clock runs has left the phase at whose end it waited.
    leg = np.where(c["gait_rate"] > 0.0, before, swing)
    bears = np.ones(len(leg), dtype=bool)
    for number, name in enumerate(SHORT_NAMES, start=1):
        bears &= c[f"{name}_bearing"].astype(bool) | ~is_swinging(leg, number)
    return np.asarray((leg > 0) & ((_next_leg(swing, leg) == 0) | ~bears))


def _next_leg(swing: np.ndarray, leg: np.ndarray) -> FloatArray:
    """Which leg swings after `leg` in each row, (N,): 0 for none, nan where the log ends before."""
    found = np.full(len(swing), np.nan)
    for k in range(len(swing) - 1, -1, -1):
        if swing[k] != leg[k]:
            found[k] = swing[k]
        elif k + 1 < len(swing):
            found[k] = swing[k + 1] if swing[k + 1] != leg[k] else found[k + 1]
    return found


def _steps(leg: np.ndarray) -> list[int]:
    """The legs of (N,) rows in the order in which they came, 0 left out."""
    new = np.concatenate([[True], leg[1:] != leg[:-1]])
    return [int(k) for k in leg[new] if k > 0]


CALM = 0.03  # [m] of the base from its plan, after a push that is over
CALM_TILT = 0.05  # [rad] the same of its attitude
CALM_TIME = 0.5  # [s]


def push_figures(table: pa.Table, pushes: Sequence[Push], *, failed: bool) -> list[dict[str, Any]]:
    """When each push was, how hard, and how the robot took it, in order of time.

    A push is recovered from when the base is back at its plan, within CALM and CALM_TILT, and
    stays there for at least CALM_TIME until a later push begins or the run ends; and the run did
    not end, by then, with a fall or a stop of its own. Pushes within one sample are judged alike.

    Args:
        table: Log of the run.
        pushes: The pushes, in any order.
        failed: Whether the run ended with a fall, or stopped of its own.

    Returns:
        For each `time`, `duration` [s], `speed` [m/s], `force` [N] (its size), `base_error_max`
        [m], `recovered`, and `recovery_time` [s] from the push's end until the base was back;
        the last three None of a push that the run did not reach.
    """
    if not pushes:
        return []
    c = columns_of(table)
    t = c["t"]
    pushes = sorted(pushes, key=lambda push: push.time)
    begins = np.searchsorted(t, [push.time for push in pushes])
    # Those at one moment, or between two samples, have no samples of their own before the next.
    ends = [int(min(begins[begins > begin], default=len(t))) for begin in begins]
    place, tilt = base_error(c) if len(t) else (np.zeros(0), np.zeros(0))
    figures = []
    for push, begin, end in zip(pushes, begins.tolist(), ends, strict=True):
        window = slice(begin, end)
        worst: float | None = None
        recovered: bool | None = None
        recovery_time: float | None = None
        if begin < len(t):
            worst = float(np.max(place[window]))
            off = t[window][(place[window] > CALM) | (tilt[window] > CALM_TILT)]
            seen = float(t[end - 1])
            over = failed and seen == t[-1]
            recovered = not over and (len(off) == 0 or float(off[-1]) <= seen - CALM_TIME)
            if recovered:
                last = float(off[-1]) if len(off) else push.time
                recovery_time = max(0.0, last - push.time - push.duration)
        figures.append(
            {
                "time": push.time,
                "duration": push.duration,
                "speed": push.speed,
                "force": float(np.linalg.norm(push.force_H)),
                "base_error_max": worst,
                "recovered": recovered,
                "recovery_time": recovery_time,
            }
        )
    return figures
