"""Inverse kinematics and centre of mass of many poses: what every sampled plan is judged by.

The same as `robot.leg_kinematics.solve_legs` and `robot.robot_model.calc_com` of numpy, which
define them (a test holds the two equal), compiled: a plan is posed thousands of times.
"""

from math import acos, atan2, cos, pi, sin, sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_scalar import leg_array
from drake_quad.robot.robot_model import RobotModel

# Columns of a leg's constants: those of `leg_array`, then the masses of hip, thigh and shank [kg]
# and their centres (9) [m].
HIP, OFFSET, THIGH, SHANK, KNEE, RAISED, MASS, CENTRE, COLUMNS = 0, 3, 4, 5, 6, 7, 8, 11, 20
FOLDED = 1e-6  # [m] short of stretched or folded, where angles are still smooth


def constants(robot: RobotModel) -> tuple[FloatArray, FloatArray]:
    """A robot as `pose` takes it: its legs and its trunk."""
    lengths = leg_array(robot.geometry)
    legs = np.column_stack([lengths, robot.link_mass, robot.link_com.reshape(4, 9)])
    return legs, np.array([robot.trunk_mass, *robot.trunk_com, robot.mass])


@compiled
def pose(
    legs: FloatArray, trunk: FloatArray, body: FloatArray, feet: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Joint angles, excess of reach, and centre of mass.

    Args:
        legs: (4, COLUMNS), see above.
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
            c = legs[k]
            dx, dy, dz = (
                feet[n, k, 0] - body[n, 0],
                feet[n, k, 1] - body[n, 1],
                feet[n, k, 2] - body[n, 2],
            )
            level = cy * dx + sy * dy
            x = cp * level - sp * dz - c[HIP]
            y = cy * dy - sy * dx - c[HIP + 1]
            z = sp * level + cp * dz - c[HIP + 2]
            d, l1, l2 = c[OFFSET], c[THIGH], c[SHANK]
            across = max(y * y + z * z, d * d + 1e-12)
            down = -sqrt(across - d * d)
            a = atan2(z, y) - atan2(down, d)
            a = (a + pi) % (2.0 * pi) - pi
            down -= c[RAISED]
            distance = sqrt(x * x + down * down)
            reach = min(max(distance, abs(l1 - l2) + FOLDED), l1 + l2 - FOLDED)
            bend = (reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
            knee = c[KNEE] * acos(min(max(bend, -1.0), 1.0))
            hip = atan2(-x, -down) - atan2(l2 * sin(knee), l1 + l2 * cos(knee))
            q[n, k, 0], q[n, k, 1], q[n, k, 2] = a, hip, knee
            beyond = abs(distance - reach)
            excess[n, k] = beyond if beyond > 2.0 * FOLDED else 0.0
            # Moments of the links' masses as if the leg were not abducted, which it is then.
            ch, sh, ck, sk = cos(hip), sin(hip), cos(hip + knee), sin(hip + knee)
            m0, m1, m2 = c[MASS], c[MASS + 1], c[MASS + 2]
            p, r, s = CENTRE, CENTRE + 3, CENTRE + 6
            ux = m0 * c[p] + m1 * (ch * c[r] + sh * c[r + 2])
            ux += m2 * (-sh * l1 + ck * c[s] + sk * c[s + 2])
            uy = m0 * c[p + 1] + m1 * (d + c[r + 1]) + m2 * (d + c[s + 1])
            uz = m0 * c[p + 2] + m1 * (-sh * c[r] + ch * c[r + 2])
            uz += m2 * (-ch * l1 - sk * c[s] + ck * c[s + 2]) + (m1 + m2) * c[RAISED]
            ca, sa, m = cos(a), sin(a), m0 + m1 + m2
            mx += ux + m * c[HIP]
            my += ca * uy - sa * uz + m * c[HIP + 1]
            mz += sa * uy + ca * uz + m * c[HIP + 2]
        mx, my, mz = mx / total, my / total, mz / total
        ahead = cp * mx + sp * mz
        com[n, 0] = body[n, 0] + cy * ahead - sy * my
        com[n, 1] = body[n, 1] + sy * ahead + cy * my
        com[n, 2] = body[n, 2] - sp * mx + cp * mz
    return q, excess, com
