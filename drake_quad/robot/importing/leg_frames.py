"""Where a leg's joints are in normal form, and by how much each turns to get there.

In normal form a leg hangs straight down: its hip joint turns about x, hip pitch and knee about y,
and hip, knee and foot are in one plane across y. The axes stay where they are on the robot; the
points on them that are called hip, thigh and knee are chosen so that offsets along an axis vanish
or add up: the hip at the x of the hip pitch axis, thigh and knee in the foot's plane.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.gait.legs import FloatArray


@dataclass(frozen=True)
class LegFrames:
    """One leg in normal form, told in B (whose axes are forward, left, up).

    Attributes:
        sign: +1 or -1 of each joint: angle in the file = sign * (angle here + turn), (3,).
        turn: See `sign`, (3,) [rad].
        axis: Of each joint as it turns here, (3, 3), a row a joint; x, y, y or very nearly.
        origin: Hip, thigh and knee, (3, 3) [m].
        foot: The foot's centre, (3,) [m].
        X: What moves each of the three links from the file's zero to this one, in B.
    """

    sign: FloatArray
    turn: FloatArray
    axis: FloatArray
    origin: FloatArray
    foot: FloatArray
    X: tuple[RigidTransform, RigidTransform, RigidTransform]

    @property
    def raised(self) -> float:
        """How far the hip pitch axis passes above the hip's [m]."""
        return float(self.origin[1, 2] - self.origin[0, 2])


def straighten(axes: FloatArray, points: FloatArray, foot: FloatArray) -> LegFrames:
    """Turns a leg's joints until it hangs straight down.

    Args:
        axes: Unit vectors of abduction, hip pitch and knee at the file's zero, (3, 3) in B.
        points: A point of each axis, (3, 3) in B [m].
        foot: The foot's centre, (3,) in B [m].
    """
    sign = np.ones(3)
    sign[0] = 1.0 if axes[0, 0] > 0.0 else -1.0
    a = axes * sign[:, None]
    turn = np.zeros(3)
    # The hip pitch axis into the horizontal, by the shorter way.
    turn[0] = -np.arctan2(a[1, 2], a[1, 1])
    turn[0] = (turn[0] + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    hip_X = about(a[0], points[0], turn[0])
    a[1:] = (hip_X.rotation().matrix() @ a[1:].T).T
    p = np.array([points[0], hip_X @ points[1], hip_X @ points[2]])
    foot = hip_X @ foot
    for k in (1, 2):
        sign[k] = 1.0 if a[k, 1] > 0.0 else -1.0
        a[k] *= sign[k]
    thigh = along(a[1], p[1], 1, foot[1])
    # The knee below the thigh, then the foot below the knee.
    turn[1] = hang(along(a[2], p[2], 1, foot[1]) - thigh)
    thigh_X = about(a[1], thigh, turn[1])
    a[2] = thigh_X.rotation() @ a[2]
    foot = thigh_X @ foot
    knee = along(a[2], thigh_X @ p[2], 1, foot[1])
    turn[2] = hang(foot - knee)
    knee_X = about(a[2], knee, turn[2])
    return LegFrames(
        sign=sign,
        turn=turn,
        axis=a,
        origin=np.array([along(a[0], p[0], 0, thigh[0]), thigh, knee]),
        foot=knee_X @ foot,
        X=(hip_X, thigh_X @ hip_X, knee_X @ thigh_X @ hip_X),
    )


def hang(v: FloatArray) -> float:
    """The turn about +y that brings `v` (3,) to -z [rad], in (-π, π]."""
    # A turn by b takes (x, z) to (x cos b + z sin b, z cos b - x sin b).
    return float(np.arctan2(v[0], -v[2]))


def along(axis: FloatArray, point: FloatArray, coordinate: int, value: float) -> FloatArray:
    """The point of a line at which one coordinate has a value, (3,)."""
    return np.asarray(point + (value - point[coordinate]) / axis[coordinate] * axis)


def about(axis: FloatArray, point: FloatArray, angle: float) -> RigidTransform:
    """The turn by `angle` about the line through `point`."""
    from scipy.spatial.transform import Rotation  # a third of a second: see mesh_files

    R = RotationMatrix(Rotation.from_rotvec(angle * axis).as_matrix())
    return RigidTransform(R, point - R @ point)
