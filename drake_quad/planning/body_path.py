"""The body's path over a contact plan: nominal course, sway for margin, height and pitch."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.body_qp import BodyProblem, solve_body
from drake_quad.planning.body_spline import BodySpline, greville
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel

KNOT = 0.2  # [s]
UNIFORM_KNOT = 0.02  # [s]: the paper's path starts and stops at once, which a fine spline follows
SAMPLE_PERIOD = 0.1  # [s] of the program's constraints
PASSES = 2  # the second corrects what `com_gain` leaves of the legs' share by about a millimetre


class Ground(Protocol):
    """Mean height of the ground under the body [m] and its slope, along places (N, 2) in W."""

    def __call__(self, p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns heights (N,) [m] and slopes (N,) (rise over run along the heading)."""
        ...


@dataclass(frozen=True, eq=False)
class Route:
    """Where the body is to be if margins did not matter: piecewise linear in time.

    Attributes:
        times: (k,) [s].
        xy: (k, 2) in W [m].
        yaw: (k,) [rad].
        ground: The ground under the body.
    """

    times: FloatArray
    xy: FloatArray
    yaw: FloatArray
    ground: Ground

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns places (N, 2) and yaws (N,) at `times` (N,)."""
        xy = np.stack([np.interp(times, self.times, self.xy[:, k]) for k in range(2)], axis=-1)
        return xy, np.interp(times, self.times, self.yaw)


def plan_body(
    robot: RobotModel, contacts: ContactPlan, route: Route, settings: PlanSettings
) -> tuple[BodySpline, float]:
    """Plans the body so that the whole robot's centre of mass keeps the margin.

    Returns:
        The path, and the smallest static margin over the sampled times [m].

    Raises:
        PlanningError: If there is no such path.
    """
    knot = UNIFORM_KNOT if settings.uniform_body else KNOT
    times = sample_times(contacts)
    knots = greville(contacts.duration, knot)
    nominal, yaw = route.at(times)
    nominal_knots, yaw_knots = route.at(knots)
    if settings.uniform_body:
        spline = BodySpline(knot, _control(nominal_knots, yaw_knots, route, settings))
        return spline, _margin(robot, contacts, spline, times)

    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    box = settings.workspace
    # Wide enough for staggered feet and for the spin's, which are not staggered.
    reach = 0.5 * np.array([box.R_x, box.R_y + settings.stance_stagger])
    spline = BodySpline(knot, _control(nominal_knots, yaw_knots, route, settings))
    gain = _com_gain(robot, spline, contacts)
    for _ in range(PASSES):
        offset, acceleration, height = _com_offset(robot, contacts, spline, times, gain)
        solution = solve_body(
            BodyProblem(
                contacts=contacts,
                times=times,
                nominal=nominal,
                heading=heading,
                com_gain=gain,
                com_offset=offset,
                com_offset_acceleration=acceleration,
                com_height=height,
                reach_centres=box.centres,
                reach=reach,
                max_shift=settings.max_shift,
                margin_desired=settings.margin_desired,
                zmp_margin_desired=settings.zmp_margin,
                knot=knot,
            )
        )
        spline = BodySpline(knot, _control(solution.control, yaw_knots, route, settings))
    return spline, _margin(robot, contacts, spline, times)


def robot_stance(settings: PlanSettings) -> FloatArray:
    """Where the feet stand in B at rest: the workspaces' centres, staggered, (4, 2) [m]."""
    stance = np.array(settings.workspace.centres)
    half = 0.5 * settings.stance_stagger
    stance[:, 1] += np.sign(stance[:, 1]) * np.array([-half, -half, half, half])
    return stance


def sample_times(contacts: ContactPlan, period: float = SAMPLE_PERIOD) -> FloatArray:
    """An even grid and every lift-off and touchdown, sorted [s]."""
    even = np.linspace(0.0, contacts.duration, int(np.ceil(contacts.duration / period)) + 1)
    switches = [p.start for p in contacts.phases] + [contacts.duration]
    return np.unique(np.round(np.concatenate([even, switches]), 9))


def _control(xy: FloatArray, yaw: FloatArray, route: Route, settings: PlanSettings) -> FloatArray:
    """All five splines' control points (n, 5); z and pitch follow the ground under the path."""
    height, slope = route.ground(xy)
    pitch = -np.arctan(slope) if settings.pitch_along_slope else np.zeros_like(slope)
    control = np.column_stack([xy, height + settings.body_height, pitch, yaw])
    control[:3], control[-3:] = control[0], control[-1]  # at rest at both ends
    return control


def _com_offset(
    robot: RobotModel,
    contacts: ContactPlan,
    spline: BodySpline,
    times: FloatArray,
    gain: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The centre of mass less gain times body: place and acceleration (N, 2), height (N,)."""
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
    return found[:, :2], found[:, 2:4], found[:, 4]


def _com_gain(robot: RobotModel, spline: BodySpline, contacts: ContactPlan) -> FloatArray:
    """How much of a shift of the body in x and y the centre of mass makes, feet standing, (2,)."""
    shift = 0.05
    body = np.tile(spline.sample(0.0)[0], (3, 1))
    body[1, 0] += shift
    body[2, 1] += shift
    _, _, com = pose_robot(robot, body, np.tile(contacts.feet, (3, 1, 1)))
    return np.array([com[1, 0] - com[0, 0], com[2, 1] - com[0, 1]]) / shift


def _margin(
    robot: RobotModel, contacts: ContactPlan, spline: BodySpline, times: FloatArray
) -> float:
    """Smallest static margin of the whole robot's centre of mass over `times` [m]."""
    body = spline.samples(times)[:, 0]
    feet, standing = contacts.feet_at(times)
    _, _, com = pose_robot(robot, body, feet)
    return float(np.min(stability_margins(com[:, :2], feet[..., :2], standing)))


def level_pose(p_xy: FloatArray, yaw: float, ground: float, settings: PlanSettings) -> FloatArray:
    """The body's pose (5,) at rest on level ground."""
    return np.array([*p_xy, ground + settings.body_height, 0.0, yaw])


__all__ = ["Ground", "Route", "level_pose", "plan_body", "robot_stance", "rotations"]
