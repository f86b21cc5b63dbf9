"""How far standing feet roll: they are balls, and the shank above turns as the body goes on.

A ball of radius r on level ground moves by r (ω × z) while it turns by ω; it turns with the shank,
whose direction u from foot to knee changes by du: ω = u × du, if nothing turns about u itself. So
it moves by r (du (u · z) - u (du · z)), some millimetres in the course of a stance: forward, as the
knee goes forward. The controller lets feet roll, and sets each down where the plan has it.
"""

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.body_spline import BodySpline
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.foot_roll import FootRoll
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.robot.leg_kinematics import calc_feet, calc_knees
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
    g = robot.geometry
    u = (calc_knees(g, q) - calc_feet(g, q)) / g.shank[:, None]
    u = np.einsum("nij,nlj->nli", rotations(body), u)
    du, middle = np.diff(u, axis=0), 0.5 * (u[1:] + u[:-1])
    step = robot.foot_radius * (du * middle[..., 2:] - middle * du[..., 2:])[..., :2]
    offset = np.zeros((len(times), 4, 2))
    for leg in range(4):
        stands = standing[:-1, leg]
        total = np.cumsum(np.where(stands[:, None], step[:, leg], 0.0), axis=0)
        offset[:, leg] = begin[leg]
        offset[1:, leg] += total
        # Where it is set down and where it lifts off; it may do so in the middle of a plan alone.
        change = np.flatnonzero(np.diff(stands.astype(np.int8))) + 1
        if len(change) % 2:  # the plan ends as it lands
            change = np.append(change, len(stands))
        for lift_off, touchdown in change.reshape(-1, 2):
            offset[touchdown:, leg] -= offset[touchdown, leg]
            s = (times[lift_off:touchdown] - times[lift_off]) / (times[touchdown] - times[lift_off])
            offset[lift_off:touchdown, leg] = offset[lift_off, leg] * _rest(s)[:, None]
    return FootRoll(times, offset)


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


def _rest(s: FloatArray) -> FloatArray:
    """How much of what it had rolled a swing foot is still off at phases `s` (n,): see tracking."""
    x = np.minimum(LET_GO * s, 1.0)
    return np.asarray(1.0 - x * x * (3.0 - 2.0 * x))
