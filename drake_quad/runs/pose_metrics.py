"""The base in a log: its pose, how far off its plan it was, and how far off its estimates were."""

from typing import Any

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.math.rotations import angle_between, quaternion_of
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.schema import Columns

SETTLED = 0.1  # [s] after which the tilt is the filter's own, not the first reading's
LEAST_WAY = 0.1  # [m] below which nothing is told per way
LEAST_LOAD = 5.0  # [N] below which a load has no place: the arm would be noise


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


def estimate_figures(c: Columns) -> dict[str, Any] | None:
    """The estimated state against the truth; None where nothing was estimated.

    Returns:
        `drift` [m] of the base's place at the end, `way` [m] that the base went, `drift_ratio` of
        the two; `position_error_max` [m]; `yaw_error_max_deg` and `attitude_error_max_deg` (of the
        whole orientation) from SETTLED on; `place_error_sigmas` and `yaw_error_sigmas`, root mean
        square of the errors along the ground and of the heading over their stated deviations, from
        SETTLED on: 1 of deviations that are right; `landmarks_seen`, how many sightings of flights
        corrected it, None if none could; `slips_flagged`, how often a foot came to be
        taken for slipping; `samples_unhealthy`.
    """
    if "base_estimated_x" not in c:
        return None
    estimated = np.stack([c[f"base_estimated_{k}"] for k in "xyz"], axis=-1)
    error = np.linalg.norm(estimated - base_place(c), axis=1)
    rpy = [c[f"base_estimated_{k}"] for k in ("roll", "pitch", "yaw")]
    attitude = angle_between(base_quaternion(c), quaternion_of(*rpy))
    settled = c["t"] >= SETTLED
    way = distance_walked(c)
    flags = np.stack([c[f"{leg}_slip_estimated"] for leg in SHORT_NAMES], axis=-1)
    return {
        "drift": float(error[-1]),
        "way": way,
        "drift_ratio": float(error[-1]) / way if way > LEAST_WAY else None,
        "position_error_max": float(np.max(error)),
        "yaw_error_max_deg": _greatest_deg(yaw_error(c)[settled]),
        "attitude_error_max_deg": _greatest_deg(attitude[settled]),
        "place_error_sigmas": _root_mean_square(
            np.stack(
                [
                    (estimated - base_place(c))[settled, k] / c[f"deviation_base_{axis}"][settled]
                    for k, axis in enumerate("xy")
                ]
            )
        ),
        "yaw_error_sigmas": _root_mean_square(
            yaw_error(c)[settled] / c["deviation_turn_z"][settled]
        ),
        "landmarks_seen": int(c["landmarks_seen"][-1]) if "landmarks_seen" in c else None,
        "slips_flagged": int(np.sum(np.diff(flags.astype(int), axis=0, prepend=0) > 0)),
        "samples_unhealthy": int(np.sum(~c["estimator_healthy"].astype(bool))),
    }


def yaw_error(c: Columns) -> FloatArray:
    """Estimated less true heading, (N,) [rad] in [-π, π)."""
    w, x, y, z = base_quaternion(c).T
    yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return np.asarray(np.remainder(c["base_estimated_yaw"] - yaw + np.pi, 2.0 * np.pi) - np.pi)


def distance_walked(c: Columns) -> float:
    """How far the base went over ground [m]: each task from its beginning straight to its end.

    Tasks go from rest to rest along a lane or on the spot, so that swaying is left out.
    """
    place, task = base_place(c)[:, :2], c["task"]
    starts = np.flatnonzero(np.diff(task)) + 1
    rows = np.concatenate([[0], starts, [len(task) - 1]])
    return float(np.sum(np.hypot(*np.diff(place[rows], axis=0).T)))


def payload_figures(c: Columns) -> dict[str, Any] | None:
    """The unknown load as learned by the end; None where nothing learns of it.

    Returns:
        `mass` [kg]; `ahead` and `left` [m], where from the base's origin it acts, None where there
        is next to no load; `moment_x`, `moment_y` [Nm] about the heading's x and y.
    """
    if "carried_force" not in c:
        return None
    force, x, y = (float(c[f"carried_{k}"][-1]) for k in ("force", "moment_x", "moment_y"))
    placed = abs(force) >= LEAST_LOAD
    return {
        "mass": force / GRAVITY,
        # What lies ahead needs a moment that tips the base back, -y; to the left, one about +x.
        "ahead": -y / force if placed else None,
        "left": x / force if placed else None,
        "moment_x": x,
        "moment_y": y,
    }


def least_friction(c: Columns) -> float | None:
    """The least friction coefficient that any foot was trusted with; None where none is learned."""
    names = [f"{leg}_friction_estimated" for leg in SHORT_NAMES]
    return float(min(np.min(c[name]) for name in names)) if names[0] in c else None


def _root_mean_square(values: FloatArray) -> float | None:
    """The root of the mean square of values of any shape; None of none."""
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def _greatest_deg(angle: FloatArray) -> float | None:
    """The greatest size of angles (N,) [rad], in degrees; None of none."""
    return float(np.degrees(np.max(np.abs(angle)))) if len(angle) else None
