"""How the robot took each push, from its run's log."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.summary_pose import base_error
from drake_quad.systems.disturbances import Push

CALM = 0.03  # [m] of the base from its plan, after a push that is over
CALM_TILT = 0.05  # [rad] the same of its attitude
CALM_TIME = 0.5  # [s]


def push_figures(table: pa.Table, pushes: Sequence[Push], *, failed: bool) -> list[dict[str, Any]]:
    """Of each push, in their order in time: when, how hard, and how the robot took it.

    A push is recovered from when the base is back at its plan, within CALM and CALM_TILT, and
    stays there for at least CALM_TIME until the next push begins or the run ends; and the run did
    not end, by then, with a fall or a stop of its own.

    Args:
        table: The run's log.
        pushes: As given.
        failed: Whether the run ended with a fall, or stopped of its own.

    Returns:
        For each `time`, `duration` [s], `speed` [m/s], `force` [N] (its size), `base_error_max`
        [m], `recovered`, and `recovery_time` [s] from the push's end until the base was back;
        the last three None of a push that the run did not reach.
    """
    if not pushes:
        return []
    c = {name: table.column(name).to_numpy(zero_copy_only=False) for name in table.column_names}
    t = c["t"]
    pushes = sorted(pushes, key=lambda push: push.time)
    ends = [push.time for push in pushes[1:]] + [float("inf")]
    place, tilt = base_error(c) if len(t) else (np.zeros(0), np.zeros(0))
    figures = []
    for push, end in zip(pushes, ends, strict=True):
        window = (t >= push.time) & (t < end)
        worst: float | None = None
        recovered: bool | None = None
        recovery_time: float | None = None
        if np.any(window):
            worst = float(np.max(place[window]))
            off = t[window][(place[window] > CALM) | (tilt[window] > CALM_TILT)]
            seen = float(t[window][-1])
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
