"""Where the base is in a log's rows, and how far it is from where it should be."""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.math.rotations import angle_between, quaternion_of

Columns = dict[str, np.ndarray]


def base_place(c: Columns) -> FloatArray:
    """The base's place as it is, (N, 3) in W [m]."""
    name = _base_name(c)
    return np.stack([c[name + k] for k in "xyz"], axis=-1)


def base_quaternion(c: Columns) -> FloatArray:
    """The base's orientation as it is, (N, 4): w, x, y, z."""
    name = _base_name(c)
    return np.stack([c[name + k] for k in ("qw", "qx", "qy", "qz")], axis=-1)


def base_error(c: Columns) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad] between the base and where it is wanted, (N,) each."""
    desired = np.stack([c[f"base_desired_{k}"] for k in "xyz"], axis=-1)
    pitch, yaw = c["base_desired_pitch"], c["base_desired_yaw"]
    wanted = quaternion_of(np.zeros_like(pitch), pitch, yaw)
    return np.linalg.norm(base_place(c) - desired, axis=1), angle_between(
        base_quaternion(c), wanted
    )


def _base_name(c: Columns) -> str:
    """What the names of the base's columns begin with, before `qw` and `x`."""
    return next(k for k in c if k.startswith("q_") and k.endswith("_qw"))[:-2]
