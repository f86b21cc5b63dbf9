"""What a proof of infeasibility needs to know of a robot: a few bounds on its legs and its mass.

All bounds hold for every joint position within the limits, whatever the trunk's orientation:

- *Reach.* The foot's centre is at most `reach` from its hip (the abduction axis at the hip's x).
  The leg's plane is offset by d, and in it the foot is at most as far from the hip pitch axis as
  the straightest knee allows: reach² = d² + (l_max + |raised|)².
- *Height.* In B the foot's centre is at most `rise` above its hip. This holds for legs that hang:
  in the leg's plane the foot is not above the abduction axis, as in all plans of this program.
- *Centre of mass.* That of the whole robot lies in a box in B: the masses of trunk and hips, and
  the range of the moment of each thigh and shank (sinusoids of the link angles).
- *Trunk.* A line under the trunk, at the middle of its width, must not be inside the stairs.
"""

from dataclasses import dataclass
from math import ceil, cos, floor, hypot, pi
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.model import RobotModel, leg_lengths

TRUNK_POINTS = 13  # points of the line under the trunk


@dataclass(frozen=True)
class RobotBounds:
    """The constants of a robot that a proof uses, as its file holds them.

    Attributes:
        hips: Hips (abduction axes) in B (4, 3) [m].
        reach: Greatest distance from hip to foot centre (4,) [m].
        rise: Greatest height of the foot centre over the hip along B's z (4,) [m].
        com_lower: Least coordinates of the centre of mass in B (3,) [m].
        com_upper: Greatest coordinates of the centre of mass in B (3,) [m].
        trunk: Points on the line under the trunk in B (TRUNK_POINTS, 3) [m].
        foot_radius: Radius of the feet [m].
    """

    hips: FloatArray
    reach: FloatArray
    rise: FloatArray
    com_lower: FloatArray
    com_upper: FloatArray
    trunk: FloatArray
    foot_radius: float

    def as_dict(self) -> dict[str, Any]:
        """The bounds as plain values."""
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}


def bounds_of(robot: RobotModel) -> RobotBounds:
    """The bounds of a robot's model."""
    g = robot.geometry
    lower, upper = np.reshape(robot.q_lower, (4, 3)), np.reshape(robot.q_upper, (4, 3))
    reach, rise, low, high = np.zeros(4), np.zeros(4), np.zeros(3), np.zeros(3)
    low += robot.trunk_mass * robot.trunk_com
    high += robot.trunk_mass * robot.trunk_com
    longest = leg_lengths(robot)
    for k in range(4):
        d, raised = float(g.offset[k]), float(g.raised[k])
        reach[k] = hypot(d, float(longest[k]) + abs(raised))
        # d sin(a) + z cos(a), z <= 0 in the plane, and cos(a) >= 0 within a quarter turn.
        quarter = max(abs(lower[k, 0]), abs(upper[k, 0])) <= 0.5 * pi
        rise[k] = _sinusoid(0.0, d, lower[k, 0], upper[k, 0])[1] if quarter else reach[k]
        leg_low, leg_high = _leg_moment(robot, k, lower[k], upper[k])
        low += leg_low
        high += leg_high
    (x_low, _, z_low), (x_high, _, _) = robot.trunk_box
    line = np.zeros((TRUNK_POINTS, 3))
    line[:, 0], line[:, 2] = np.linspace(x_low, x_high, TRUNK_POINTS), z_low
    return RobotBounds(
        hips=np.array(g.p_BH, dtype=float),
        reach=reach,
        rise=rise,
        com_lower=low / robot.mass,
        com_upper=high / robot.mass,
        trunk=line,
        foot_radius=float(robot.foot_radius),
    )


def _sinusoid(c: float, s: float, lower: float, upper: float) -> tuple[float, float]:
    """Least and greatest value of c cos(t) + s sin(t) for t in [lower, upper]."""
    size, phase = hypot(c, s), float(np.arctan2(s, c))  # size cos(t - phase)
    ends = (size * cos(lower - phase), size * cos(upper - phase))
    turns = (lower - phase) / (2 * pi), (upper - phase) / (2 * pi)
    top = floor(turns[1]) >= ceil(turns[0])
    bottom = floor(turns[1] - 0.5) >= ceil(turns[0] - 0.5)
    return (-size if bottom else min(ends)), (size if top else max(ends))


def _leg_moment(
    robot: RobotModel, k: int, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Bounds of leg k's mass times the position of its centre in B (3,), (3,) [kg m].

    See `drake_quad.robot.kinematics.leg_moment` for the sum.
    """
    g, m, c = robot.geometry, robot.link_mass[k], robot.link_com[k]
    hip = (float(lower[1]), float(upper[1]))
    both = (float(lower[1] + lower[2]), float(upper[1] + upper[2]))
    # Under a rotation about y by t: x' = x cos t + z sin t, z' = z cos t - x sin t. The thigh's
    # moment has the mass of the shank at the knee, (0, -thigh).
    thigh_x = m[1] * c[1, 0]
    thigh_z = m[1] * c[1, 2] - m[2] * g.thigh[k]
    shank_x, shank_z = m[2] * c[2, 0], m[2] * c[2, 2]
    x = np.array(_sinusoid(thigh_x, thigh_z, *hip)) + _sinusoid(shank_x, shank_z, *both)
    z = np.array(_sinusoid(thigh_z, -thigh_x, *hip)) + _sinusoid(shank_z, -shank_x, *both)
    x += m[0] * c[0, 0]
    z += m[0] * c[0, 2] + (m[1] + m[2]) * g.raised[k]
    y = m[0] * c[0, 1] + m[1] * (g.offset[k] + c[1, 1]) + m[2] * (g.offset[k] + c[2, 1])
    # Abduction by a: (y cos a - z sin a, y sin a + z cos a), linear in z: extreme at its ends.
    across = [_sinusoid(y, -each, lower[0], upper[0]) for each in z]
    up = [_sinusoid(each, y, lower[0], upper[0]) for each in z]
    whole = float(m.sum()) * g.p_BH[k]
    least = [x.min(), min(a[0] for a in across), min(u[0] for u in up)]
    most = [x.max(), max(a[1] for a in across), max(u[1] for u in up)]
    return whole + np.array(least), whole + np.array(most)
