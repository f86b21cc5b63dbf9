"""Kinematics of the legs and the centre of mass: on arrays, as scalar kernel, as batch kernel.

A leg hangs from its hip H in B: a rotation about B's x (abduction), an offset `d` along y to the
leg's plane and, of robots whose two hip axes do not meet, a height `raised` along z; then two
rotations about y (hip pitch and knee) with the thigh and the shank along -z. Angles are in the
order (abduction, hip pitch, knee) and zero with the leg straight down.

With three numbers a leg, plain floats beat numpy's call overhead several times, and the loop runs
hundreds of times a second. The array versions define the leg; a test holds the two equal.

Plans are posed thousands of times: the batch kernel is `solve_legs` and `calc_com`, compiled.
"""

from collections.abc import Sequence
from math import acos, atan2, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.common import GRAVITY, FloatArray, Matrix, Vector
from drake_quad.jit import jit
from drake_quad.math.rotations import quaternion_rotation
from drake_quad.robot.model import LegGeometry, RobotModel


def calc_feet(geometry: LegGeometry, q: FloatArray) -> FloatArray:
    """Returns the foot centres p_BF, (..., 4, 3) [m], for joint angles `q` (..., 4, 3)."""
    hip, knee = q[..., 1], q[..., 1] + q[..., 2]
    x = -geometry.thigh * np.sin(hip) - geometry.shank * np.sin(knee)
    z = -geometry.thigh * np.cos(hip) - geometry.shank * np.cos(knee) + geometry.raised
    return _in_body(geometry, q[..., 0], x, z)


def calc_knees(geometry: LegGeometry, q: FloatArray) -> FloatArray:
    """Returns the knees p_BK, (..., 4, 3) [m], for joint angles `q` (..., 4, 3)."""
    hip = q[..., 1]
    x, z = -geometry.thigh * np.sin(hip), -geometry.thigh * np.cos(hip) + geometry.raised
    return _in_body(geometry, q[..., 0], x, z)


def _in_body(geometry: LegGeometry, a: FloatArray, x: FloatArray, z: FloatArray) -> FloatArray:
    """Points of the legs' planes in B (..., 4, 3) [m], the legs abducted by `a` (..., 4) [rad]."""
    y, ca, sa = geometry.offset, np.cos(a), np.sin(a)
    return geometry.p_BH + np.stack([x, ca * y - sa * z, sa * y + ca * z], axis=-1)


def solve_legs(geometry: LegGeometry, p_BF: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse kinematics of all four legs, on the knee's own branch.

    Out of reach, the angles of the nearest stretched (or folded) leg are returned, so that the
    result stays continuous; `excess` is how far that is.

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
    clipped = np.clip(distance, np.abs(l1 - l2) + FOLDED, l1 + l2 - FOLDED)
    cos_knee = (clipped**2 - l1**2 - l2**2) / (2 * l1 * l2)
    knee = geometry.knee_sign * np.arccos(np.clip(cos_knee, -1.0, 1.0))
    hip = np.arctan2(-x, -z) - np.arctan2(l2 * np.sin(knee), l1 + l2 * np.cos(knee))
    beyond = np.abs(distance - clipped)
    return np.stack([a, hip, knee], axis=-1), beyond * (beyond > 2.0 * FOLDED)


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


FOLDED = 1e-6  # [m] short of stretched or folded, where angles are still smooth


class LegConstants(NamedTuple):
    """One leg's lengths; see LegGeometry."""

    x: float
    y: float
    z: float
    offset: float
    thigh: float
    shank: float
    knee_sign: float
    raised: float


def leg_constants(geometry: LegGeometry) -> tuple[LegConstants, ...]:
    """The four legs' lengths as plain floats."""
    return tuple(LegConstants(*row) for row in leg_array(geometry).tolist())


def leg_array(geometry: LegGeometry) -> FloatArray:
    """The legs' lengths as (4, 8) rows in the order of LegConstants, as all kernels take them."""
    g = geometry
    lengths = [g.p_BH, g.offset, g.thigh, g.shank, g.knee_sign, g.raised]
    return np.column_stack(lengths).astype(float)


@jit
def leg_row(legs: FloatArray, k: int) -> LegConstants:
    """Row `k` of `leg_array`, or of a wider array that begins with its columns."""
    c = legs[k]
    return LegConstants(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7])


@jit
def foot_and_jacobian(c: LegConstants, a: float, hip: float, knee: float) -> tuple[Vector, Matrix]:
    """The foot's centre in B [m] and its Jacobian [m/rad] at three joint angles [rad]."""
    sa, ca = sin(a), cos(a)
    both = hip + knee
    x_hip, z_hip = -c.thigh * sin(hip), -c.thigh * cos(hip)
    x_knee, z_knee = -c.shank * sin(both), -c.shank * cos(both)
    x, z, d = x_hip + x_knee, z_hip + z_knee, c.offset
    whole = z + c.raised
    y_up, z_up = ca * d - sa * whole, sa * d + ca * whole
    return (
        (c.x + x, c.y + y_up, c.z + z_up),
        (
            (0.0, z, z_knee),
            (-z_up, sa * x, sa * x_knee),
            (y_up, -ca * x, -ca * x_knee),
        ),
    )


def normal_felt(
    leg: LegConstants,
    q: Sequence[float],
    R: Sequence[Sequence[float]],
    base: Sequence[float],
    place: Sequence[float],
) -> Vector:
    """The ground's unit normal in W where a foot's ball is pressed: from there to its centre.

    Args:
        leg: The leg's lengths.
        q: Its joint angles (3,) [rad].
        R: R_WB, in rows.
        base: p_WB [m].
        place: Where the force on the foot acts, in W [m].
    """
    foot, _ = foot_and_jacobian(leg, *q)
    turned = [r[0] * foot[0] + r[1] * foot[1] + r[2] * foot[2] for r in R]
    x, y, z = (b + t - p for b, t, p in zip(base, turned, place, strict=True))
    length = max(hypot(x, y, z), 1e-9)
    return x / length, y / length, z / length


@jit
def jacobians_in_world(legs: FloatArray, wxyz: FloatArray, q: FloatArray) -> FloatArray:
    """Each foot's Jacobian in W against its own leg's joints.

    Args:
        legs: The legs' lengths, see `leg_array`.
        wxyz: The trunk's quaternion in W (4,).
        q: Joint angles (12,) [rad].

    Returns:
        J with v_F = J q_dot, of a trunk that does not move, (4, 3, 3) [m/rad].
    """
    R = quaternion_rotation(wxyz[0], wxyz[1], wxyz[2], wxyz[3])
    found = np.empty((4, 3, 3))
    for k in range(4):
        _, J = foot_and_jacobian(leg_row(legs, k), q[3 * k], q[3 * k + 1], q[3 * k + 2])
        for i in range(3):
            for j in range(3):
                found[k, i, j] = R[i][0] * J[0][j] + R[i][1] * J[1][j] + R[i][2] * J[2][j]
    return found


@jit
def solve_leg_and_distance(
    c: LegConstants, x: float, y: float, z: float
) -> tuple[Vector, float, float]:
    """Inverse kinematics of one leg, as `solve_legs`.

    Returns:
        Joint angles [rad] that put the foot's centre at (x, y, z) in B [m], or as near as can be;
        the distance from the hip pitch axis to that place in the leg's plane [m]; and that
        distance as the angles have it, short of a stretched or folded leg.
    """
    x, y, z = x - c.x, y - c.y, z - c.z
    d, l1, l2 = c.offset, c.thigh, c.shank
    down = -sqrt(max(y * y + z * z - d * d, 1e-12))
    a = atan2(z, y) - atan2(down, d)
    a = (a + pi) % (2.0 * pi) - pi
    down -= c.raised
    distance = sqrt(x * x + down * down)
    reach = min(max(distance, abs(l1 - l2) + FOLDED), l1 + l2 - FOLDED)
    bend = (reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    knee = c.knee_sign * acos(min(max(bend, -1.0), 1.0))
    hip = atan2(-x, -down) - atan2(l2 * sin(knee), l1 + l2 * cos(knee))
    return (a, hip, knee), distance, reach


@jit
def solve_leg(c: LegConstants, x: float, y: float, z: float) -> Vector:
    """The joint angles [rad] of `solve_leg_and_distance` alone."""
    return solve_leg_and_distance(c, x, y, z)[0]


def calc_com(robot: RobotModel, q: FloatArray) -> FloatArray:
    """Returns the whole robot's centre of mass in B, (..., 3) [m], for joint angles (..., 4, 3)."""
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    g, c = robot.geometry, robot.link_com
    zero, plane = np.zeros(4), g.p_HP
    knee_at = plane + _pitched(hip, np.stack([zero, zero, -g.thigh], axis=-1))
    m = robot.link_mass
    moment = (
        m[:, 0, None] * c[:, 0]
        + m[:, 1, None] * (plane + _pitched(hip, c[:, 1]))
        + m[:, 2, None] * (knee_at + _pitched(knee, c[:, 2]))
    )
    ca, sa = np.cos(a), np.sin(a)
    x, y, z = moment[..., 0], moment[..., 1], moment[..., 2]
    turned = np.stack([x, ca * y - sa * z, sa * y + ca * z], axis=-1)
    total = robot.trunk_mass * robot.trunk_com + np.sum(
        turned + m.sum(axis=1)[:, None] * g.p_BH, axis=-2
    )
    return np.asarray(total / robot.mass)


def calc_holding(robot: RobotModel, q: FloatArray, up: FloatArray) -> FloatArray:
    """Torques that hold the legs' own links up, the feet in the air, (..., 4, 3) [Nm].

    Args:
        robot: The robot.
        q: (..., 4, 3) joint angles [rad].
        up: (..., 3) the upward unit vector in B.
    """
    g, m = robot.geometry, robot.link_mass
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    zero, plane = np.zeros(4), g.p_HP
    down = np.stack([zero, zero, -g.thigh], axis=-1)
    at_knee = _pitched(hip, down)
    # From the hip, before the abduction: of each link its centre of mass, of each joint its axis.
    hip_link = robot.link_com[:, 0]
    thigh = plane + _pitched(hip, robot.link_com[:, 1])
    shank = plane + at_knee + _pitched(knee, robot.link_com[:, 2])
    # `up` seen from there; joints turn about x, y, y.
    ca, sa = np.cos(a), np.sin(a)
    x, y, z = up[..., 0, None], up[..., 1, None], up[..., 2, None]
    ux, uy, uz = x + zero, ca * y + sa * z, ca * z - sa * y
    seen = np.stack([ux, uy, uz], axis=-1)

    def about(axis: int, arms: FloatArray, mass: FloatArray) -> FloatArray:
        return np.asarray(GRAVITY * mass * np.cross(arms, seen)[..., axis])

    first = about(0, hip_link, m[:, 0]) + about(0, thigh, m[:, 1]) + about(0, shank, m[:, 2])
    second = about(1, thigh - plane, m[:, 1]) + about(1, shank - plane, m[:, 2])
    third = about(1, shank - plane - at_knee, m[:, 2])
    return np.stack([first, second, third], axis=-1)


def _pitched(angle: FloatArray, p: FloatArray) -> FloatArray:
    """Points (..., 4, 3) turned about y by angles (..., 4)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = p[..., 0], np.broadcast_to(p[..., 1], angle.shape), p[..., 2]
    return np.stack([c * x + s * z, y, c * z - s * x], axis=-1)


# Columns of a leg's constants: those of `leg_array`, then the masses of hip, thigh and shank [kg]
# and their centres (9) [m].
MASS, CENTRE, COLUMNS = 8, 11, 20


def constants(robot: RobotModel) -> tuple[FloatArray, FloatArray]:
    """A robot as `pose` takes it: its legs and its trunk."""
    lengths = leg_array(robot.geometry)
    legs = np.column_stack([lengths, robot.link_mass, robot.link_com.reshape(4, 9)])
    return legs, np.array([robot.trunk_mass, *robot.trunk_com, robot.mass])


@jit
def leg_moment(legs: FloatArray, k: int, q: Vector) -> Vector:
    """The moment of leg k's masses: the sum of mass times centre in B [kg m]; see `calc_com`.

    Args:
        legs: The legs' constants (4, COLUMNS).
        k: Row of the leg.
        q: Joint angles [rad].
    """
    c, (a, hip, knee) = legs[k], q
    row = leg_row(legs, k)
    d, l1 = row.offset, row.thigh
    # Moments as if the leg were not abducted, which it is then.
    ch, sh, ck, sk = cos(hip), sin(hip), cos(hip + knee), sin(hip + knee)
    m0, m1, m2 = c[MASS], c[MASS + 1], c[MASS + 2]
    p, r, s = CENTRE, CENTRE + 3, CENTRE + 6
    ux = m0 * c[p] + m1 * (ch * c[r] + sh * c[r + 2])
    ux += m2 * (-sh * l1 + ck * c[s] + sk * c[s + 2])
    uy = m0 * c[p + 1] + m1 * (d + c[r + 1]) + m2 * (d + c[s + 1])
    uz = m0 * c[p + 2] + m1 * (-sh * c[r] + ch * c[r + 2])
    uz += m2 * (-ch * l1 - sk * c[s] + ck * c[s + 2]) + (m1 + m2) * row.raised
    ca, sa, m = cos(a), sin(a), m0 + m1 + m2
    return ux + m * row.x, ca * uy - sa * uz + m * row.y, sa * uy + ca * uz + m * row.z


@jit
def pose(
    legs: FloatArray, trunk: FloatArray, body: FloatArray, feet: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Joint angles, excess of reach, and centre of mass: `solve_legs` and `calc_com`, compiled.

    Args:
        legs: The legs' constants (4, COLUMNS), from `constants`.
        trunk: (5,) mass [kg], centre in B [m], and the whole robot's mass [kg].
        body: (N, 5) poses x, y, z, pitch, yaw of B in W.
        feet: (N, 4, 3) foot centres in W [m].

    Returns:
        q (N, 4, 3) [rad], excess (N, 4) [m], centre of mass in W (N, 3) [m].
    """
    size = len(body)
    q, excess, com = np.empty((size, 4, 3)), np.empty((size, 4)), np.empty((size, 3))
    total = trunk[4]
    for n in range(size):
        cp, sp, cy, sy = cos(body[n, 3]), sin(body[n, 3]), cos(body[n, 4]), sin(body[n, 4])
        mx, my, mz = trunk[0] * trunk[1], trunk[0] * trunk[2], trunk[0] * trunk[3]
        for k in range(4):
            dx, dy = feet[n, k, 0] - body[n, 0], feet[n, k, 1] - body[n, 1]
            dz = feet[n, k, 2] - body[n, 2]
            level = cy * dx + sy * dy
            x, y, z = cp * level - sp * dz, cy * dy - sy * dx, sp * level + cp * dz
            angles, distance, reach = solve_leg_and_distance(leg_row(legs, k), x, y, z)
            q[n, k, 0], q[n, k, 1], q[n, k, 2] = angles
            beyond = abs(distance - reach)
            excess[n, k] = beyond if beyond > 2.0 * FOLDED else 0.0
            ux, uy, uz = leg_moment(legs, k, angles)
            mx, my, mz = mx + ux, my + uy, mz + uz
        mx, my, mz = mx / total, my / total, mz / total
        ahead = cp * mx + sp * mz
        com[n, 0] = body[n, 0] + cy * ahead - sy * my
        com[n, 1] = body[n, 1] + sy * ahead + cy * my
        com[n, 2] = body[n, 2] - sp * mx + cp * mz
    return q, excess, com


@jit
def pose_legs(legs: FloatArray, body: FloatArray, feet: FloatArray) -> FloatArray:
    """The joint angles of `pose` alone, to the bit, of any legs (N, L, 3) [rad].

    Args:
        legs: The legs' constants (L, 8 or more), from `leg_array`.
        body: (N, 5) poses x, y, z, pitch, yaw of B in W.
        feet: (N, L, 3) foot centres in W [m].
    """
    q = np.empty((len(body), len(legs), 3))
    for n in range(len(body)):
        cp, sp, cy, sy = cos(body[n, 3]), sin(body[n, 3]), cos(body[n, 4]), sin(body[n, 4])
        for k in range(len(legs)):
            dx, dy = feet[n, k, 0] - body[n, 0], feet[n, k, 1] - body[n, 1]
            dz = feet[n, k, 2] - body[n, 2]
            level = cy * dx + sy * dy
            x, y, z = cp * level - sp * dz, cy * dy - sy * dx, sp * level + cp * dz
            q[n, k, 0], q[n, k, 1], q[n, k, 2] = solve_leg(leg_row(legs, k), x, y, z)
    return q
