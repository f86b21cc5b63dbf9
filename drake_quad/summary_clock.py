"""What the gait clock waited for, and how pushes interrupted it, from a run's log."""

from typing import Any

import numpy as np

from drake_quad.gait.legs import SHORT_NAMES, BoolArray, FloatArray
from drake_quad.summary_pose import Columns


def recovery_figures(c: Columns) -> list[dict[str, Any]]:
    """Of each time that the plan was left and found again, in order.

    Returns:
        For each `time` at which the clock stopped [s], `legs` that were put down to catch the
        robot, in order (none if it caught itself standing), and `duration` [s] until the clock
        ran again; None if the run ended before.
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
    """Whether the clock, if it waits, waits for a swing leg's touchdown, (N,).

    It waits at the end of a swing or of a stance on all four. Where the next leg is to lift off
    at the very touchdown of the last, it waits for the foot until that bears.
    """
    swing = c["swing_leg"]
    before = np.concatenate([swing[:1], swing[:-1]])
    # A sample whose clock runs has left the phase at whose end it waited.
    leg = np.where(c["gait_rate"] > 0.0, before, swing)
    bearing = np.stack([c[f"{name}_bearing"] for name in SHORT_NAMES], axis=-1)
    bears = bearing[np.arange(len(leg)), np.maximum(leg - 1, 0)].astype(bool)
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
