"""What feet touch on their way through the air: a riser, a nosing, or ground before its time."""

from typing import Any

import numpy as np

from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.summary_pose import Columns

WAY = (0.1, 0.8)  # of a swing: before it a foot leaves the ground, after it one may land


def swing_figures(c: Columns) -> dict[str, Any]:
    """Contacts of swing feet between WAY's ends.

    Returns:
        `swing_contact_samples` with any, and the greatest force in them, `swing_force_max` [N];
        None in a replay, which has no forces.
    """
    force = np.zeros(len(c["t"]))
    under_way = (c["swing_phase"] > WAY[0]) & (c["swing_phase"] < WAY[1])
    under_way &= c["gait_mode"] == "run"  # a push stops the clock where it is
    for number, leg in enumerate(SHORT_NAMES, start=1):
        mine = under_way & (c["swing_leg"] == number)
        parts = np.stack([c[f"{leg}_force_{k}"][mine] for k in "xyz"])
        force[mine] = np.linalg.norm(parts, axis=0)
    if not np.all(np.isfinite(force)):
        return {"swing_contact_samples": None, "swing_force_max": None}
    return {
        "swing_contact_samples": int(np.sum(force > 0.0)),
        "swing_force_max": float(np.max(force)),
    }
