"""The body's path over a contact plan: nominal course, sway for margin, height and pitch."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.body_problem import BodyProblem, BodySolution
from drake_quad.planning.body_qp import BROKEN, BodyFrame, make_frame, solve_body
from drake_quad.planning.body_share import com_gain, com_share, zmp_share
from drake_quad.planning.body_spline import BodySpline, greville
from drake_quad.planning.body_zmp import sample_zmp, shift_response
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.leg_limits import LegLimits, Shanks, find_limits
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Lane

# Spacings for swings of at least CALMEST_SWING; for quicker ones they are as much closer.
CALMEST_SWING = 1.2  # [s]
LEAST_TEMPO = 0.2  # one very short swing is not to make a long plan's program large
KNOT = 0.2  # [s]
SAMPLE_PERIOD = 0.1  # [s] of the program's constraints
ZMP_PERIOD = 0.05  # [s] of the differences that accelerations are taken from
UNIFORM_KNOT = 0.02  # [s]: the paper's path starts and stops at once, which a fine spline follows
GUARD = 0.15  # [s] for which three feet have to do already on either side of a swing
DYNAMIC_GUARD = 0.02  # [s] the same for the zero-moment point alone
DYNAMIC_TEMPO = 0.6  # finer still: the point crosses a diagonal in the short time on four feet
DYNAMIC_PASSES = 3
ROUGH = 1e-3  # [m] by which rows may be broken by a path that is corrected anyway
LIMIT_PASSES = 6  # besides, where legs come to their limits
DAMPED = 0.6  # of the way to the next path, in these
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
        lane: Whose ground shanks are to keep clear of; None: they are let be.
    """

    times: FloatArray
    xy: FloatArray
    yaw: FloatArray
    ground: Ground
    lane: Lane | None = None

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns places (N, 2) and yaws (N,) at `times` (N,)."""
        xy = np.stack([np.interp(times, self.times, self.xy[:, k]) for k in range(2)], axis=-1)
        return xy, np.interp(times, self.times, self.yaw)


def plan_body(
    robot: RobotModel, contacts: ContactPlan, route: Route, settings: PlanSettings
) -> tuple[BodySpline, float]:
    """Plans the body so that the whole robot's centre of mass keeps the margin.

    Or, if the settings are `dynamic`, its zero-moment point alone.

    Returns:
        The path, and the smallest static margin over the sampled times [m]; if the settings are
        `dynamic`, the smallest margin of the zero-moment point.

    Raises:
        PlanningError: If there is no such path.
    """
    tempo = _tempo(contacts) * (DYNAMIC_TEMPO if settings.dynamic else 1.0)
    knot = UNIFORM_KNOT if settings.uniform_body else KNOT * tempo
    times = sample_times(contacts, SAMPLE_PERIOD * tempo)
    places = contacts.feet_at(times)
    knots = greville(contacts.duration, knot)
    nominal, yaw = route.at(times)
    nominal_knots, yaw_knots = route.at(knots)
    if settings.uniform_body:
        spline = BodySpline(knot, _control(nominal_knots, yaw_knots, route, settings))
        return spline, _margin(robot, places, spline, times)

    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    box = settings.workspace
    # Wide enough for staggered feet and for the spin's, which are not staggered.
    reach = 0.5 * np.array([box.R_x, box.R_y + settings.stance_stagger])
    spline = BodySpline(knot, _control(nominal_knots, yaw_knots, route, settings))
    response = shift_response(robot, spline.sample(0.0)[0], contacts.feet)
    gain = response[0] if settings.dynamic else com_gain(robot, spline, contacts)
    passes = DYNAMIC_PASSES if settings.dynamic else PASSES
    limits: LegLimits | None = None
    least: tuple[float, BodySpline] | None = None
    frame: BodyFrame | None = None
    solution: BodySolution | None = None
    for k in range(passes + LIMIT_PASSES):
        if k >= passes:
            limits = _limits(robot, places[0], spline, times, route, settings)
            if limits is None:
                break
            least = min(least or (limits.short, spline), (limits.short, spline), key=_short)
        if settings.dynamic:
            zmp = sample_zmp(robot, contacts, spline, ZMP_PERIOD * tempo)
            share = zmp_share(zmp, times, response)
        else:
            share = com_share(robot, contacts, spline, times, gain)
        problem = BodyProblem(
            contacts=contacts,
            times=times,
            nominal=nominal,
            heading=heading,
            com_gain=gain,
            com_offset=share.offset,
            com_offset_acceleration=share.acceleration,
            com_height=share.height,
            reach_centres=box.centres,
            reach=reach,
            max_shift=settings.max_shift,
            max_ahead=settings.max_ahead,
            margin_desired=settings.margin_desired,
            zmp_margin_desired=settings.zmp_margin,
            static=not settings.dynamic,
            guard=DYNAMIC_GUARD if settings.dynamic else GUARD,
            knot=knot,
            limits=limits,
        )
        frame = frame or make_frame(problem)
        last = k >= passes - 1
        solution = solve_body(
            problem, frame=frame, start=solution, broken=BROKEN if last else ROUGH
        )
        xy = solution.control
        if k > passes:  # what holds here need not there: not all the way
            xy = spline.control[:, :2] + DAMPED * (xy - spline.control[:, :2])
        spline = BodySpline(knot, _control(xy, yaw_knots, route, settings))
    else:
        limits = _limits(robot, places[0], spline, times, route, settings)
    if limits is not None and least is not None and least[0] < limits.short:
        spline = least[1]  # it went to and fro
    if settings.dynamic:
        zmp = sample_zmp(robot, contacts, spline, ZMP_PERIOD * tempo)
        return spline, float(zmp.margin.min())
    return spline, _margin(robot, places, spline, times)


def _short(found: tuple[float, BodySpline]) -> float:
    return found[0]


def _limits(
    robot: RobotModel,
    feet: FloatArray,
    spline: BodySpline,
    times: FloatArray,
    route: Route,
    settings: PlanSettings,
) -> LegLimits | None:
    """What keeps legs within their limits and shanks off the stairs, if the path does not."""
    body = spline.samples(times)[:, 0]
    _, slope = route.ground(body[:, :2])
    rise = slope[:, None] * np.stack([np.cos(body[:, 4]), np.sin(body[:, 4])], axis=-1)
    shanks = None
    if route.lane is not None and settings.shank_room > 0.0:
        shanks = Shanks(route.lane, settings.shank_room)
    return find_limits(robot, body, feet, rise, shanks)


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
    pitch = -settings.pitch_along_slope * np.arctan(slope)
    control = np.column_stack([xy, height + settings.body_height, pitch, yaw])
    control[:3], control[-3:] = control[0], control[-1]  # at rest at both ends
    return control


def _tempo(contacts: ContactPlan) -> float:
    """How much finer than for the calmest swings the path has to be, at most 1."""
    swings = [step.swing.duration for step in contacts.steps]
    return max(LEAST_TEMPO, min(1.0, min(swings, default=CALMEST_SWING) / CALMEST_SWING))


def _margin(
    robot: RobotModel,
    places: tuple[FloatArray, BoolArray],
    spline: BodySpline,
    times: FloatArray,
) -> float:
    """Smallest static margin of the whole robot's centre of mass over `times` [m]."""
    feet, standing = places
    _, _, com = pose_robot(robot, spline.samples(times)[:, 0], feet)
    return float(np.min(stability_margins(com[:, :2], feet[..., :2], standing)))


def level_pose(p_xy: FloatArray, yaw: float, ground: float, settings: PlanSettings) -> FloatArray:
    """The body's pose (5,) at rest on level ground."""
    return np.array([*p_xy, ground + settings.body_height, 0.0, yaw])


__all__ = ["Ground", "Route", "level_pose", "plan_body", "robot_stance", "rotations"]
