"""Where the base is in a log's rows, and how far it is from where it should be."""

import numpy as np

from drake_quad.gait.legs import FloatArray

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


def quaternion_of(roll: FloatArray, pitch: FloatArray, yaw: FloatArray) -> FloatArray:
    """Orientations (N, 4), w, x, y, z, of yaw about z, then pitch, then roll, (N,) [rad] each."""
    cr, cp, cy = np.cos(0.5 * roll), np.cos(0.5 * pitch), np.cos(0.5 * yaw)
    sr, sp, sy = np.sin(0.5 * roll), np.sin(0.5 * pitch), np.sin(0.5 * yaw)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def angle_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """The angle from one orientation to the other, (N,) [rad], of quaternions (N, 4).

    By the sine and the cosine of half of it: the cosine alone would be worth 1e-8 near zero.
    """
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    same = np.where(np.einsum("ij,ij->i", a, b) < 0.0, -1.0, 1.0)[:, None]
    half = np.arctan2(np.linalg.norm(a - same * b, axis=1), np.linalg.norm(a + same * b, axis=1))
    return np.asarray(4.0 * half)


def _base_name(c: Columns) -> str:
    """What the names of the base's columns begin with, before `qw` and `x`."""
    return next(k for k in c if k.startswith("q_") and k.endswith("_qw"))[:-2]
