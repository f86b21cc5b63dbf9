"""The zero-moment point of a plan: of the whole robot, with its links moving as the plan has them.

The trunk and the hips are point masses; thighs and shanks are two each, half a mass and placed
apart so that they have a uniform rod's moment of inertia. The point is where the moment of all
inertial and gravitational forces is vertical (Vukobratović and Borovac, "Zero-moment point:
thirty-five years of its life", 2004), taken at the mean height of the standing feet.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.math.curves import BodySpline
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import calc_feet_in_body, pose_robot
from drake_quad.robot.kinematics import solve_legs
from drake_quad.robot.model import RobotModel
from drake_quad.stability.support_polygon import stability_margins

ZMP_PERIOD = 0.05  # [s] of the differences that accelerations are taken from, for calm swings
ZMP_CHECK_PERIOD = 0.01  # [s] the same where a plan is judged, whose swings may be quick
# Of its length: two halves of a uniform rod's mass, this far from its middle, have its inertia.
ROD = 0.5 / np.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class ZmpSamples:
    """The zero-moment point along a plan, at even times (N,).

    Attributes:
        times: (N,) [s].
        body: (N, 3, 5) the body and its first two derivatives.
        com: (N, 2) the whole robot's centre of mass, in W [m].
        zmp: (N, 2) the zero-moment point, in W [m].
        margin: (N,) its distance to the nearest side of the support polygon, inside > 0 [m];
            infinite while two feet stand: their line has no inside.
        off_line: (N,) its distance from the line that joins two feet [m]; 0 where more stand.
    """

    times: FloatArray
    body: FloatArray
    com: FloatArray
    zmp: FloatArray
    margin: FloatArray
    off_line: FloatArray


def sample_zmp(
    robot: RobotModel, contacts: ContactPlan, spline: BodySpline, period: float
) -> ZmpSamples:
    """The zero-moment point every `period` [s] or a little less, from rest to rest."""
    count = max(int(np.ceil(contacts.duration / period)), 8)
    times = np.linspace(0.0, contacts.duration, count + 1)
    body = spline.samples(times)
    feet, standing = contacts.feet_at(times)
    p_WL, mass = link_places(robot, body[:, 0], feet)
    ground = np.sum(feet[..., 2] * standing, axis=1) / standing.sum(axis=1)
    zmp = calc_zmp(p_WL, mass, ground - robot.foot_radius, step=float(times[1]))
    com = mass @ p_WL[..., :2] / mass.sum()
    margin, off_line = zmp_margins(zmp, feet[..., :2], standing)
    return ZmpSamples(times, body, com, zmp, margin, off_line)


def zmp_margins(
    zmp: FloatArray, feet: FloatArray, standing: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """The point's margins over three or four feet, and its distances from the line of two.

    Args:
        zmp: The point (N, 2) in W [m].
        feet: The feet (N, 4, 2) in W [m].
        standing: Which stand (N, 4).

    Returns:
        Both (N,), as ZmpSamples has them [m].
    """
    margin = stability_margins(zmp, feet, standing)
    two = standing.sum(axis=1) == 2
    return np.where(two, np.inf, margin), np.where(two, -margin, 0.0)


def link_places(
    robot: RobotModel, body: FloatArray, feet: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The masses that stand for the links, for body poses (N, 5) and feet (N, 4, 3), all in W.

    Returns:
        Places p_WL (N, 21, 3) [m]: the trunk, then hip, thigh (two) and shank (two) of each leg;
        masses (21,) [kg].
    """
    R = rotations(body)
    p_BF = calc_feet_in_body(body, feet)
    q, _ = solve_legs(robot.geometry, p_BF)
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    g, c = robot.geometry, robot.link_com
    zero, plane = np.zeros(4), g.p_HP

    def pitched(angle: FloatArray, p: FloatArray) -> FloatArray:
        ca, sa = np.cos(angle), np.sin(angle)
        x, y, z = p[:, 0], np.broadcast_to(p[:, 1], angle.shape), p[:, 2]
        return np.stack([ca * x + sa * z, y, -sa * x + ca * z], axis=-1)

    knee_at = plane + pitched(hip, np.stack([zero, zero, -g.thigh], axis=-1))
    half_thigh, half_shank = (
        np.stack([zero, zero, ROD * length], axis=-1) for length in (g.thigh, g.shank)
    )
    links = np.stack(
        [
            np.broadcast_to(c[:, 0], knee_at.shape),
            plane + pitched(hip, c[:, 1] + half_thigh),
            plane + pitched(hip, c[:, 1] - half_thigh),
            knee_at + pitched(knee, c[:, 2] + half_shank),
            knee_at + pitched(knee, c[:, 2] - half_shank),
        ],
        axis=-2,
    )  # (N, 4, 5, 3), each leg's as if it were not abducted
    ca, sa = np.cos(a)[..., None], np.sin(a)[..., None]
    y, z = links[..., 1], links[..., 2]
    turned = np.stack([links[..., 0], ca * y - sa * z, sa * y + ca * z], axis=-1)
    p_BL = (turned + g.p_BH[:, None]).reshape(len(body), 20, 3)
    trunk = np.broadcast_to(robot.trunk_com, (len(body), 1, 3))
    p_BL = np.concatenate([trunk, p_BL], axis=1)
    p_WL = body[:, None, :3] + p_BL @ np.swapaxes(R, -1, -2)
    mass = robot.link_mass[:, [0, 1, 1, 2, 2]] * np.array([1.0, 0.5, 0.5, 0.5, 0.5])
    return p_WL, np.concatenate([[robot.trunk_mass], mass.ravel()])


def calc_zmp(p_WL: FloatArray, mass: FloatArray, ground: FloatArray, *, step: float) -> FloatArray:
    """The zero-moment point of moving point masses.

    Args:
        p_WL: Where they are, (N, L, 3) [m], at times `step` [s] apart; at rest at both ends.
        mass: (L,) [kg].
        ground: Height at which the point is taken, (N,) [m].
        step: [s].

    Returns:
        (N, 2) [m].
    """
    acceleration = np.zeros_like(p_WL)
    acceleration[1:-1] = (p_WL[2:] - 2.0 * p_WL[1:-1] + p_WL[:-2]) / step**2
    lift = mass * (acceleration[..., 2] + GRAVITY)  # (N, L) [N]
    height = p_WL[..., 2] - ground[:, None]
    moment = np.einsum("nl,nlk->nk", lift, p_WL[..., :2])
    moment -= np.einsum("l,nl,nlk->nk", mass, height, acceleration[..., :2])
    return np.asarray(moment / lift.sum(axis=1)[:, None])


def shift_response(
    robot: RobotModel, body: FloatArray, feet: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What a shift of the body in x and y does, the feet (4, 3) standing.

    Args:
        robot: The robot.
        body: Its pose (5,) in W.
        feet: Where its feet stand, in W [m].

    Returns:
        How much of the shift the centre of mass makes (2,), and the height (2,) [m] that, times
        the centre of mass's acceleration over gravity, the zero-moment point is shifted back by.
    """
    shift = 0.02
    poses = np.tile(body, (4, 1))
    poses[:, :2] += shift * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    p_WL, mass = link_places(robot, poses, np.tile(feet, (4, 1, 1)))
    moved = np.stack([p_WL[0, :, 0] - p_WL[1, :, 0], p_WL[2, :, 1] - p_WL[3, :, 1]], axis=-1)
    moved /= 2.0 * shift  # (21, 2)
    height = p_WL.mean(axis=0)[:, 2] - (np.mean(feet[:, 2]) - robot.foot_radius)
    gain = mass @ moved / mass.sum()
    return gain, (mass * height) @ moved / (mass.sum() * gain)


@dataclass(frozen=True, eq=False)
class Share:
    """What the body's program is given for the legs, at its sampled times (N,).

    Attributes:
        offset: The centre of mass less gain times the body's centre, (N, 2) [m].
        acceleration: Its second derivative, (N, 2) [m/s^2].
        height: Height of the centre of mass above the feet, (N,) [m].
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
        times: Sampled times of the program, (N,) [s].
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
