"""The legs' share in the balance: of the centre of mass, and of the zero-moment point."""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.body_spline import BodySpline
from drake_quad.planning.body_zmp import ZmpSamples
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.robot_model import RobotModel


@dataclass(frozen=True, eq=False)
class Share:
    """What the body's program is given for the legs, at its sampled times (N,).

    Attributes:
        offset: The centre of mass less gain times the body's centre, (N, 2) [m].
        acceleration: Its second derivative, (N, 2) [m/s^2].
        height: Of the centre of mass above the feet, (N,) [m].
    """

    offset: FloatArray
    acceleration: FloatArray
    height: FloatArray


def com_share(
    robot: RobotModel,
    contacts: ContactPlan,
    spline: BodySpline,
    times: FloatArray,
    gain: FloatArray,
) -> Share:
    """The share in the centre of mass, at `times` (N,) along a path found so far."""
    even = np.linspace(0.0, contacts.duration, max(int(contacts.duration / 0.05), 8) + 1)
    body = spline.samples(even)[:, 0]
    feet, standing = contacts.feet_at(even)
    _, _, com = pose_robot(robot, body, feet)
    offset = com[:, :2] - gain * body[:, :2]
    step = even[1] - even[0]
    acceleration = np.gradient(np.gradient(offset, step, axis=0), step, axis=0)
    ground = np.sum(feet[..., 2] * standing, axis=1) / standing.sum(axis=1)
    height = com[:, 2] - ground
    columns = np.column_stack([offset, acceleration, height])
    found = np.stack([np.interp(times, even, c) for c in columns.T], axis=-1)
    return Share(found[:, :2], found[:, 2:4], found[:, 4])


def zmp_share(
    found: ZmpSamples, times: FloatArray, response: tuple[FloatArray, FloatArray]
) -> Share:
    """The share with which the program's zero-moment point is the one found along a path.

    The program's is gain (p - height/g p̈) + offset - height/g acceleration, with p the body's
    centre. What the lumped height leaves out, the legs' own heights and their vertical motion,
    goes into the acceleration.

    Args:
        found: The point along the path found so far.
        times: At which the program asks, (N,) [s].
        response: Gain (2,) and heights (2,) [m] of `shift_response`.
    """
    gain, heights = response
    height = float(heights.mean())
    place, body_acceleration = found.body[:, 0, :2], found.body[:, 2, :2]
    offset = found.com - gain * place
    rest = found.zmp - gain * (place - height / GRAVITY * body_acceleration)
    acceleration = (offset - rest) * (GRAVITY / height)
    columns = np.column_stack([offset, acceleration])
    at = np.stack([np.interp(times, found.times, c) for c in columns.T], axis=-1)
    return Share(at[:, :2], at[:, 2:], np.full(len(times), height))


def com_gain(robot: RobotModel, spline: BodySpline, contacts: ContactPlan) -> FloatArray:
    """How much of a shift of the body in x and y the centre of mass makes, feet standing, (2,)."""
    shift = 0.05
    body = np.tile(spline.sample(0.0)[0], (3, 1))
    body[1, 0] += shift
    body[2, 1] += shift
    _, _, com = pose_robot(robot, body, np.tile(contacts.feet, (3, 1, 1)))
    return np.array([com[1, 0] - com[0, 0], com[2, 1] - com[0, 1]]) / shift
