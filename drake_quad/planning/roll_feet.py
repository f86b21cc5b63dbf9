"""How far standing feet roll: they are balls, and the shank above turns as the body goes on.

A ball of radius r on level ground moves by r (ω × z) while it turns by ω; it turns with the shank,
whose direction u from foot to knee changes by du: ω = u × du, if nothing turns about u itself. So
it moves by r (du (u · z) - u (du · z)), some millimetres in the course of a stance: forward, as the
knee goes forward. The controller lets feet roll, and sets each down where the plan has it.
"""

from math import cos, sin

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.body_spline import BodySpline
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.foot_roll import FootRoll
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.robot_model import RobotModel

LET_GO = 1.5  # a swing foot is back on its planned way at 1 / LET_GO of its swing


def roll_feet(
    robot: RobotModel,
    times: FloatArray,
    body: FloatArray,
    q: FloatArray,
    standing: BoolArray,
    begin: FloatArray,
) -> FootRoll:
    """Follows the feet through a sampled plan.

    Args:
        robot: The robot.
        times: Sampled times (N,), every lift-off and touchdown among them [s].
        body: (N, 5) poses in W.
        q: (N, 4, 3) joint angles [rad].
        standing: (N, 4), from each time to the next.
        begin: How far they have rolled before (4, 2) [m].
    """
    offset = np.empty((len(times), 4, 2))
    _roll(robot.foot_radius, times, body, q, standing, begin, offset)
    return FootRoll(times, offset)


@compiled
def _roll(
    radius: float,
    times: FloatArray,
    body: FloatArray,
    q: FloatArray,
    standing: BoolArray,
    begin: FloatArray,
    offset: FloatArray,
) -> None:
    """The arithmetic of `roll_feet`, into `offset`."""
    size = len(times)
    for k in range(4):
        x, y, lifted, since = begin[k, 0], begin[k, 1], 0, False
        u0, u1, u2 = _shank(body[0], q[0, k])
        offset[0, k, 0], offset[0, k, 1] = x, y
        for n in range(1, size):
            v0, v1, v2 = _shank(body[n], q[n, k])
            if standing[n - 1, k]:
                d0, d1, d2 = v0 - u0, v1 - u1, v2 - u2
                m0, m1, m2 = 0.5 * (u0 + v0), 0.5 * (u1 + v1), 0.5 * (u2 + v2)
                x += radius * (d0 * m2 - m0 * d2)
                y += radius * (d1 * m2 - m1 * d2)
            elif not since:
                lifted, since = n - 1, True
            if since and (standing[n, k] or n == size - 1):  # it lands here
                for i in range(lifted, n):
                    s = (times[i] - times[lifted]) / (times[n] - times[lifted])
                    r = min(LET_GO * s, 1.0)
                    rest = 1.0 - r * r * (3.0 - 2.0 * r)
                    offset[i, k, 0], offset[i, k, 1] = rest * x, rest * y
                x, y, since = 0.0, 0.0, False
            offset[n, k, 0], offset[n, k, 1] = x, y
            u0, u1, u2 = v0, v1, v2


@compiled
def _shank(body: FloatArray, q: FloatArray) -> tuple[float, float, float]:
    """Unit vector from a foot to its knee in W, for a body pose (5,) and a leg's angles (3,)."""
    both = q[1] + q[2]
    x, up = sin(both), cos(both)
    y, z = -sin(q[0]) * up, cos(q[0]) * up
    cp, sp, cy, sy = cos(body[3]), sin(body[3]), cos(body[4]), sin(body[4])
    ahead = cp * x + sp * z
    return cy * ahead - sy * y, sy * ahead + cy * y, -sp * x + cp * z


def roll_along(
    robot: RobotModel,
    contacts: ContactPlan,
    path: BodySpline,
    times: FloatArray,
    begin: FloatArray,
) -> ContactPlan:
    """The contacts, with feet that roll as they do along a path.

    Args:
        robot: The robot.
        contacts: Who stands where, when; how its feet rolled along another path is a beginning.
        path: Of the body.
        times: At which it is followed, every lift-off and touchdown among them (N,) [s].
        begin: How far they have rolled before (4, 2) [m].
    """
    body = path.samples(times)[:, 0]
    feet, standing = contacts.feet_at(times)
    q, _, _ = pose_robot(robot, body, feet)
    roll = roll_feet(robot, times, body, q, standing, begin)
    fewer = sample_times(contacts, path.knot)  # a certificate's pieces end at each
    return contacts.rolled(FootRoll(fewer, roll.at(fewer)))
