"""How far standing feet roll: they are balls, and the shank above turns as the body goes on.

A ball of radius r on level ground moves by r (ω × z) while it turns by ω, and it turns with its
shank. That turns with the body's pitch about a level axis, with the leg's abduction about the
body's x axis, and with hip and knee about the leg's own y axis (yaw turns it about the ground's
normal, which moves nothing): some millimetres in the course of a stance, forward as the knee goes
forward, and to the side as the body sways, however much the shank leans. The controller lets feet
roll, and sets each down where the plan has it.
"""

from math import cos, sin

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.jit import jit
from drake_quad.math.curves import BodySpline
from drake_quad.planning.contact_plan import ContactPlan, FootRoll, sample_times
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.model import RobotModel

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
    body = np.ascontiguousarray(body)  # kernels are compiled anew for other layouts
    _roll(robot.foot_radius, times, body, q, standing, begin, offset)
    return FootRoll(times, offset)


@jit
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
        offset[0, k, 0], offset[0, k, 1] = x, y
        for n in range(1, size):
            if standing[n - 1, k]:
                on_x, on_y = _goes(body[n - 1], body[n], q[n - 1, k], q[n, k])
                x += radius * on_x
                y += radius * on_y
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


@jit
def _goes(
    body0: FloatArray, body1: FloatArray, q0: FloatArray, q1: FloatArray
) -> tuple[float, float]:
    """ω × z along x and y of W, from one body pose (5,) and a leg's angles (3,) to the next."""
    pitch, yaw = 0.5 * (body0[3] + body1[3]), 0.5 * (body0[4] + body1[4])
    out = 0.5 * (q0[0] + q1[0])
    cp, sp, cy, sy, ca, sa = cos(pitch), sin(pitch), cos(yaw), sin(yaw), cos(out), sin(out)
    tilts, abducts = body1[3] - body0[3], q1[0] - q0[0]
    bends = q1[1] + q1[2] - q0[1] - q0[2]
    # Of each axis (x, y, z) the part that moves a ball: (y, -x).
    on_x = tilts * cy + abducts * sy * cp + bends * (ca * cy + sa * sy * sp)
    on_y = tilts * sy - abducts * cy * cp + bends * (ca * sy - sa * cy * sp)
    return on_x, on_y


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
