"""Kinematics of the abduction-hip-knee leg, for any number of poses of all four legs at once.

A leg hangs from its hip H in B: a rotation about B's x (abduction), an offset `d` along y to the
leg's plane and, of robots whose two hip axes do not meet, a height `raised` along z; then two
rotations about y (hip pitch and knee) with the thigh and the shank along -z. Angles are in the
order (abduction, hip pitch, knee) and zero with the leg straight down.
"""

from dataclasses import dataclass, field

import numpy as np

from drake_quad.gait.legs import FloatArray


@dataclass(frozen=True)
class LegGeometry:
    """Lengths of all four legs, one row a leg (FL, FR, RL, RR).

    Attributes:
        p_BH: Hip (abduction axis) in B, (4, 3) [m].
        offset: Signed distance from the hip to the leg's plane along y, (4,) [m].
        thigh: Hip pitch axis to knee, (4,) [m].
        shank: Knee to the foot sphere's centre, (4,) [m].
        knee_sign: -1 for a knee that points backward, +1 for one that points forward, (4,).
        raised: How far the hip pitch axis passes above the abduction axis, (4,) [m]; mostly 0.
    """

    p_BH: FloatArray
    offset: FloatArray
    thigh: FloatArray
    shank: FloatArray
    knee_sign: FloatArray
    raised: FloatArray = field(default_factory=lambda: np.zeros(4))

    @property
    def p_HP(self) -> FloatArray:
        """The hip pitch axis, in the leg's plane, from the hip as long as abduction is 0 (4, 3)."""
        return np.stack([np.zeros(len(self.offset)), self.offset, self.raised], axis=-1)

    @property
    def reach(self) -> FloatArray:
        """Length of each leg stretched out, (4,) [m]."""
        return self.thigh + self.shank


def calc_feet(geometry: LegGeometry, q: FloatArray) -> FloatArray:
    """Returns the foot centres p_BF, (..., 4, 3) [m], for joint angles `q` (..., 4, 3)."""
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    x = -geometry.thigh * np.sin(hip) - geometry.shank * np.sin(knee)
    z = -geometry.thigh * np.cos(hip) - geometry.shank * np.cos(knee) + geometry.raised
    y = geometry.offset
    ca, sa = np.cos(a), np.sin(a)
    return geometry.p_BH + np.stack([x, ca * y - sa * z, sa * y + ca * z], axis=-1)


def calc_knees(geometry: LegGeometry, q: FloatArray) -> FloatArray:
    """Returns the knees p_BK, (..., 4, 3) [m], for joint angles `q` (..., 4, 3)."""
    a, hip = q[..., 0], q[..., 1]
    x, z = -geometry.thigh * np.sin(hip), -geometry.thigh * np.cos(hip) + geometry.raised
    y = geometry.offset
    ca, sa = np.cos(a), np.sin(a)
    return geometry.p_BH + np.stack([x, ca * y - sa * z, sa * y + ca * z], axis=-1)


def solve_legs(geometry: LegGeometry, p_BF: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse kinematics of all four legs, on the knee's own branch.

    Out of reach, the angles of the nearest stretched (or folded) leg are returned, so that the
    result stays continuous; `excess` says by how much.

    Args:
        geometry: The legs.
        p_BF: Foot centres in B, (..., 4, 3) [m].

    Returns:
        `q` (..., 4, 3) [rad] and `excess` (..., 4) [m]: how far the foot is beyond (or inside)
        what the leg can reach; 0 where it is reachable.
    """
    v = p_BF - geometry.p_BH
    d, l1, l2 = geometry.offset, geometry.thigh, geometry.shank
    across = np.maximum(v[..., 1] ** 2 + v[..., 2] ** 2, d**2 + 1e-12)
    z = -np.sqrt(across - d**2)
    a = np.arctan2(v[..., 2], v[..., 1]) - np.arctan2(z, d)
    a = (a + np.pi) % (2 * np.pi) - np.pi
    x, z = v[..., 0], z - geometry.raised
    distance = np.sqrt(x**2 + z**2)
    clipped = np.clip(distance, np.abs(l1 - l2) + 1e-6, l1 + l2 - 1e-6)
    cos_knee = (clipped**2 - l1**2 - l2**2) / (2 * l1 * l2)
    knee = geometry.knee_sign * np.arccos(np.clip(cos_knee, -1.0, 1.0))
    hip = np.arctan2(-x, -z) - np.arctan2(l2 * np.sin(knee), l1 + l2 * np.cos(knee))
    return np.stack([a, hip, knee], axis=-1), np.abs(distance - clipped) * (
        np.abs(distance - clipped) > 2e-6
    )


def calc_jacobians(geometry: LegGeometry, q: FloatArray) -> FloatArray:
    """Returns J with v_BF = J q_dot for each leg, (..., 4, 3, 3) [m/rad]."""
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    sa, ca = np.sin(a), np.cos(a)
    x_hip, z_hip = -geometry.thigh * np.sin(hip), -geometry.thigh * np.cos(hip)
    x_knee, z_knee = -geometry.shank * np.sin(knee), -geometry.shank * np.cos(knee)
    y, z = np.broadcast_to(geometry.offset, a.shape), z_hip + z_knee + geometry.raised
    jacobian = np.empty((*q.shape, 3))
    jacobian[..., 0, 0] = 0.0
    jacobian[..., 1, 0] = -sa * y - ca * z
    jacobian[..., 2, 0] = ca * y - sa * z
    # d(x, z)/dt of a point under a rotation about +y is (z, -x).
    for column, (dx, dz) in enumerate(
        ((z_hip + z_knee, -(x_hip + x_knee)), (z_knee, -x_knee)), start=1
    ):
        jacobian[..., 0, column] = dx
        jacobian[..., 1, column] = -sa * dz
        jacobian[..., 2, column] = ca * dz
    return jacobian
