"""Columns of a log that some controllers have: what they estimate, how their program does."""

from collections.abc import Mapping

import numpy as np

from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.robot.robot_state import StateLayout

Columns = dict[str, np.ndarray]
AXES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")


def estimate_columns(logs: Mapping[str, FloatArray], layout: StateLayout) -> Columns:
    """The base as estimated and what the filter believes of it; none where nothing estimates.

    Args:
        logs: By the name of the log: (N, size) each.
        layout: Where the base is in the estimated state.
    """
    if "state_estimated" not in logs:
        return {}
    state = logs["state_estimated"]
    base, velocity = layout.q_base, layout.v_base + 3
    rpy = roll_pitch_yaw(state[:, base : base + 4])
    columns: Columns = {}
    for k, axis in enumerate(AXES):
        columns[f"base_estimated_{axis}"] = state[:, base + 4 + k]
    for k, turn in enumerate(TURNS):
        columns[f"base_estimated_{turn}"] = rpy[:, k]
    for k, axis in enumerate(AXES):
        columns[f"v_estimated_{axis}"] = state[:, velocity + k]
    for part, name in enumerate(("turn", "v", "base")):
        for k, axis in enumerate(AXES):
            columns[f"deviation_{name}_{axis}"] = logs["deviation"][:, 3 * part + k]
    for row, leg in enumerate(SHORT_NAMES):
        columns[f"{leg}_slip_estimated"] = logs["slip_estimated"][:, row] > 0.5
    columns["estimator_healthy"] = logs["healthy"][:, 0] > 0.5
    return columns


def program_columns(logs: Mapping[str, FloatArray]) -> Columns:
    """What the whole-body controller counts and learns; none of another controller.

    Args:
        logs: By the name of the log: (N, size) each.
    """
    if "qp_state" not in logs:
        return {}
    force, moment_x, moment_y = logs["carried"].T
    friction = zip(SHORT_NAMES, logs["friction"].T, strict=True)
    return {
        "qp_unsolved": logs["qp_state"][:, 0].astype(np.int64),
        "carried_force": force,
        "carried_moment_x": moment_x,
        "carried_moment_y": moment_y,
        **{f"{leg}_friction_estimated": values for leg, values in friction},
    }


def roll_pitch_yaw(quaternion: FloatArray) -> FloatArray:
    """Roll, pitch, yaw (N, 3) [rad] of orientations (w, x, y, z) (N, 4): yaw first, about z."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    return np.stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ],
        axis=-1,
    )
