"""What a leg's drives let its foot push with: static torques of the joints in one posture."""

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.robot.kinematics import calc_jacobians
from drake_quad.robot.model import RobotModel
from drake_quad.stability.equilibrium_region import ForceLimits


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


def joint_limits(
    robot: RobotModel,
    R_WB: FloatArray,
    q: FloatArray,
    standing: ArrayLike,
    *,
    mass: float | None = None,
    effort: FloatArray | None = None,
) -> ForceLimits:
    """Limits that the joints' torques set to the forces on the standing feet.

    Static: torque = what holds the leg's links - Jᵀ f, with f the force on the foot.

    Args:
        robot: The robot.
        R_WB: (3, 3) orientation of B.
        q: (4, 3) joint angles [rad].
        standing: (4,) which feet stand.
        mass: Of the whole robot, payload included, if it is another than the model's [kg].
        effort: (12,) torque limits, if they are others than the model's [Nm].
    """
    who = np.asarray(standing, dtype=np.bool_)
    legs = leg_limits(robot, R_WB, q, mass=mass, effort=effort)
    return ForceLimits(legs.rows[who], legs.lower[who], legs.upper[who])


def leg_limits(
    robot: RobotModel,
    R_WB: FloatArray,
    q: FloatArray,
    *,
    mass: float | None = None,
    effort: FloatArray | None = None,
) -> ForceLimits:
    """The same of all four legs, for any number of poses: R_WB (..., 3, 3), q (..., 4, 3).

    Its arrays are (..., 4, 3, 3) and (..., 4, 3).
    """
    weight = GRAVITY * (robot.mass if mass is None else mass)
    most = (robot.effort if effort is None else effort).reshape(4, 3)
    hold = calc_holding(robot, q, R_WB[..., 2, :])
    rows = np.swapaxes(R_WB[..., None, :, :] @ calc_jacobians(robot.geometry, q), -1, -2)
    return ForceLimits(rows, (hold - most) / weight, (hold + most) / weight)


def _pitched(angle: FloatArray, p: FloatArray) -> FloatArray:
    """Points (..., 4, 3) turned about y by angles (..., 4)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = p[..., 0], np.broadcast_to(p[..., 1], angle.shape), p[..., 2]
    return np.stack([c * x + s * z, y, c * z - s * x], axis=-1)
