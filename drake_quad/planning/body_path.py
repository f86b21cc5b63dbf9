"""Plans the body's path by successive quadratic programs around the path so far.

The program is linear in the body's place; what is not (the legs' share in the centre of mass, how
far feet have rolled, legs' limits, regions that depend on the posture) is taken along the path so
far, and again along the next.
"""

from dataclasses import replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.math.curves import BodySpline, greville, join_weights, knot_spacing, most_beside
from drake_quad.planning.body_problem import FAR, BodyProblem, make_basis
from drake_quad.planning.body_qp import (
    BodyFrame,
    BodySolution,
    make_frame,
    solve_body,
    with_sides,
)
from drake_quad.planning.body_reference import ROUNDING, BodyReference, body_pitch
from drake_quad.planning.body_sides import region_sides
from drake_quad.planning.contact_plan import (
    SAMPLE_PERIOD,
    ContactPlan,
    sample_times,
    swing_times,
)
from drake_quad.planning.leg_limits import LegLimits, Shanks, find_limits, tilt_arm
from drake_quad.planning.motion_plan import MotionPlan, pose_robot, roll_along
from drake_quad.planning.problem import KNOT, PlanSettings
from drake_quad.planning.stance_margin import Footing
from drake_quad.planning.zmp import (
    ZMP_PERIOD,
    com_gain,
    com_share,
    sample_zmp,
    shift_response,
    zmp_share,
)
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margins import FALLEN_TILT
from drake_quad.stability.support_polygon import stability_margins

# Spacings for swings of at least CALMEST_SWING; for quicker ones they are as much closer.
CALMEST_SWING = 1.2  # [s]
LEAST_TEMPO = 0.2  # one very short swing is not to make a long plan's program large
ROLLED = 4e-4  # [m] by which feet may roll otherwise than along the path found
ROLLS = 3  # times at most that they are followed again
UNIFORM_KNOT = 0.02  # [s]: the paper's path starts and stops at once, which a fine spline follows
DYNAMIC_GUARD = 0.02  # [s] what `PlanSettings.guard` is for the zero-moment point alone
KEPT = 1e-4  # [m] beyond limits: as good as within them
DYNAMIC_TEMPO = 0.6  # finer still: the point crosses a diagonal in the short time on four feet
# Bounds of the body's lift, in leg lengths, and tilt [rad] where legs are at their limits. It does
# not sink as far as it rises, for the trunk's clearance is not looked at here.
MOST_SINK, MOST_LIFT, MOST_TILT = 0.04, 0.12, 0.25
STEEPEST = FALLEN_TILT - 0.10  # [rad] in all, with what the legs ask for at their limits
PER_SWING = 12  # moments of every swing at which legs' limits are looked at, besides
LEVEL = 1e-4  # [m], [rad] of lift and tilt that are none
LEAST_TILT = 0.02  # [rad] that is free all the same
TILT_BESIDE = 0.12  # [rad] that is free away from the steepest part of the way
BEND = 0.01  # [m] over which the ground's slope is taken to change as it does
BESIDE = 3  # control points to either side that have to do with the path at one


class BodyPathOptimizer:
    """Iterative optimisation of a body path: the program linearised about the path so far.

    Attributes:
        contacts: The contact plan; its feet roll as they do along the path.
        control: Control points of x, y and, if legs were at their limits, of lift and tilt [m].
        spline: The path.
        route: Control points of the route itself (n, 2) [m].
        beyond: How far the path is beyond limits near each control point (n,), as LegLimits counts
            it [m].
    """

    def __init__(
        self,
        robot: RobotModel,
        contacts: ContactPlan,
        route: BodyReference,
        settings: PlanSettings,
        footing: Footing | None,
        rolled: FloatArray,
    ) -> None:
        """Begins with the route itself, on feet that have rolled so far before (4, 2) [m]."""
        self._robot, self._route, self._settings = robot, route, settings
        self._footing, self._arm, self._rolled = footing, tilt_arm(robot), rolled
        self._tempo = _tempo(contacts) * (DYNAMIC_TEMPO if settings.dynamic else 1.0)
        most = UNIFORM_KNOT if settings.uniform_body else KNOT * self._tempo
        self._knot = knot_spacing(contacts.duration, most)
        self._times = sample_times(contacts, SAMPLE_PERIOD * self._tempo)
        self.route, self._yaw = route.at(greville(contacts.duration, self._knot))
        self.beyond = np.zeros(len(self.route))
        self._limits: LegLimits | None = None
        self._bent = False
        self._frame: BodyFrame | None = None
        self._solution: BodySolution | None = None
        self.contacts = contacts
        self.follow(self.route)
        self._response = shift_response(robot, self.spline.sample(0.0)[0], contacts.feet)
        dynamic = settings.dynamic
        self._gain = self._response[0] if dynamic else com_gain(robot, self.spline, contacts)

    def follow(self, control: FloatArray) -> None:
        """Takes a path of control points (n, 2) or (n, 4) [m]."""
        self.control = control
        self.spline = BodySpline(self._knot, self._points(control))
        self.contacts = roll_along(
            self._robot, self.contacts, self.spline, self._times, self._rolled
        )

    def follow_plan(self, plan: MotionPlan) -> bool:
        """Takes the path of another plan with the same steps, if legs were at their limits there.

        The same steps are those of the same legs in turn, at other times or from other places: its
        path is followed from phase to phase. From then on the path is held within limits.

        Args:
            plan: The other plan, with the body as high over the ground.

        Returns:
            Whether it is taken; else everything is as before.
        """
        other, contacts = plan.body, plan.contacts
        mine, others = self.contacts.phases, contacts.phases
        legs, their_legs = ([[s.leg for s in p.steps] for p in phases] for phases in (mine, others))
        if legs != their_legs:
            return False
        level = self._poses(
            other.control[:, :2], contacts.duration, other.knot, plan.joined or self._route.joined
        )
        bent = (other.control[:, 2:4] - level[:, 2:]) * [1.0, self._arm]
        bent[:3] = bent[-3:] = 0.0  # at rest
        if np.abs(bent).max() <= LEVEL:
            return False
        path = np.column_stack([other.control[:, :2], bent])
        begins, their_begins = ([p.start for p in phases] for phases in (mine, others))
        times = np.interp(
            greville(self.contacts.duration, self._knot),
            [*begins, mine[-1].end],
            [*their_begins, others[-1].end],
        )
        at = greville(contacts.duration, other.knot)
        self._bent = True
        self.follow(np.column_stack([np.interp(times, at, path[:, axis]) for axis in range(4)]))
        return True

    def settle_feet(self) -> None:
        """Lets feet roll as they do along the path, with their rolling so far, until that is so.

        How far a foot rolls depends a little on where it has rolled to: with large feet, and a
        last path far from the one before, once is not enough.
        """
        for _ in range(ROLLS):
            before = self.contacts.roll
            again = roll_along(self._robot, self.contacts, self.spline, self._times, self._rolled)
            if before is None or again.roll is None:
                return
            if np.abs(again.roll.offset - before.offset).max() <= ROLLED:
                return
            self.contacts = again

    def find_limits(self) -> float:
        """Looks where legs are beyond their limits; returns by how much in all, see LegLimits.

        It also looks between the sampled times, in swings: a limit there counts at the nearest one.
        Once limits have been met, the path is held within those that it keeps, too.
        """
        robot, settings, lane = self._robot, self._settings, self._route.lane
        shanks = Shanks(lane, settings.shank_room) if settings.shank_room > 0.0 else None
        times = self._times
        if shanks is not None:
            times = np.union1d(times, swing_times(self.contacts, PER_SWING))
        nearest = np.searchsorted(0.5 * (self._times[1:] + self._times[:-1]), times)
        body = self.spline.samples(times)[:, 0]
        rise, pitch = self._follows(body)
        path = np.zeros((len(self._times), 4))
        path[:, :2] = self.spline.samples(self._times)[:, 0, :2]
        basis = make_basis(self._times, self._knot, len(self.control))
        if self.control.shape[1] > 2:
            path[:, 2:] = basis.at(self.control)[:, 0, 2:]
        feet, _ = self.contacts.feet_at(times)
        met = self._bent or self._limits is not None
        found = find_limits(robot, body, feet, rise, path[nearest], shanks, pitch=pitch, always=met)
        self._limits = None if found is None else replace(found, sample=nearest[found.sample])
        self.beyond = np.zeros(len(self.control))
        if found is None:
            return 0.0
        first = basis.first[nearest]
        for k in range(4):  # a path's place has to do with four control points
            np.maximum.at(self.beyond, first + k, found.beyond)
        return found.short

    def _follows(self, body: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How much bodies (N, 5) rise (N, 2), and pitch (N, 2) [rad/m], by a shift along x and y.

        They follow the ground, whose slope changes where a flight begins and ends.
        """
        heading = np.stack([np.cos(body[:, 4]), np.sin(body[:, 4])], axis=-1)
        _, slope = self._route.ground(body[:, :2])
        ends = [self._route.ground(body[:, :2] + way * heading)[1] for way in (-BEND, BEND)]
        behind, ahead = (body_pitch(self._settings.pitch_along_slope, end) for end in ends)
        return slope[:, None] * heading, ((ahead - behind) / (2.0 * BEND))[:, None] * heading

    def solve(self, *, broken: float, radius: FloatArray | None = None) -> FloatArray:
        """Control points of the program's best path; rows may be broken by so much [m].

        Args:
            broken: Violation of a row that is tolerated [m].
            radius: How far each control point may move from the path so far (n,) [m]; None: as
                far as it likes.

        Raises:
            PlanningError: If there is none.
        """
        problem = self._problem()
        if radius is not None:
            problem = replace(problem, start=self.control, radius=radius)
        frame = make_frame(problem) if self._frame is None else with_sides(self._frame, problem)
        if self._footing is not None:
            body = self.spline.samples(self._times)[:, 0]
            sides = region_sides(frame.sides, self._footing, self.contacts, self._times, body)
            frame = replace(frame, sides=sides)
        self._frame = frame
        self._solution = solve_body(problem, frame=frame, start=self._solution, broken=broken)
        return self._solution.control

    @property
    def leg(self) -> float:
        """A leg's length [m]."""
        return self._arm

    @property
    def believed(self) -> float:
        """The margin of the best path, as the program has it that was solved last [m]."""
        if self._solution is None:
            return -np.inf
        return self._solution.zmp_margin if self._settings.dynamic else self._solution.margin

    @property
    def keeps_limits(self) -> bool:
        """Whether the best path keeps all limits, as the program has them that was solved last."""
        return self._solution is not None and self._solution.beyond <= KEPT

    def margin(self) -> float:
        """Smallest static margin at the sampled times, or of the zero-moment point [m]."""
        if self._settings.dynamic and not self._settings.uniform_body:
            period = ZMP_PERIOD * self._tempo
            return float(sample_zmp(self._robot, self.contacts, self.spline, period).margin.min())
        feet, standing = self.contacts.feet_at(self._times)
        body = self.spline.samples(self._times)[:, 0]
        if self._footing is not None:
            return float(self._footing.stances(body, feet, standing).margins().min())
        _, _, com = pose_robot(self._robot, body, feet)
        return float(np.min(stability_margins(com[:, :2], feet[..., :2], standing)))

    def mean_off_line(self) -> float:
        """Mean distance of the zero-moment point from the line of two feet, while two stand [m]."""
        period = ZMP_PERIOD * self._tempo
        zmp = sample_zmp(self._robot, self.contacts, self.spline, period)
        return float(zmp.off_line[np.isinf(zmp.margin)].mean())

    def _problem(self) -> BodyProblem:
        """The program around the path so far."""
        settings, times, box = self._settings, self._times, self._settings.workspace
        nominal, yaw = self._route.at(times)
        if settings.dynamic:
            period = ZMP_PERIOD * self._tempo
            zmp = sample_zmp(self._robot, self.contacts, self.spline, period)
            share = zmp_share(zmp, times, self._response)
        else:
            share = com_share(self._robot, self.contacts, self.spline, times, self._gain)
        return BodyProblem(
            contacts=self.contacts,
            times=times,
            nominal=nominal,
            heading=np.stack([np.cos(yaw), np.sin(yaw)], axis=-1),
            com_gain=self._gain,
            com_offset=share.offset,
            com_offset_acceleration=share.acceleration,
            com_height=share.height,
            reach_centres=box.centres,
            # Wide enough for staggered feet and for the spin's, which are not staggered.
            reach=0.5 * np.array([box.R_x, box.R_y + settings.stance_stagger]),
            max_shift=settings.max_shift,
            max_ahead=settings.max_ahead,
            margin_desired=settings.margin_desired,
            zmp_margin_desired=settings.zmp_margin,
            static=not settings.dynamic,
            guard=DYNAMIC_GUARD if settings.dynamic else settings.guard,
            knot=self._knot,
            limits=self._limits,
            lift_range=self._lift_range(greville(self.contacts.duration, self._knot), BESIDE),
        )

    def _lift_range(self, times: FloatArray, beside: int = 0) -> FloatArray:
        """Least and greatest lift, and tilt, at some times (2, 2, N) [m], see BodyProblem.

        A steep body does not tilt further. Away from the steepest part of its way it may tilt by
        TILT_BESIDE: where a flight ends a foot still stands next to it as the body is level.

        Args:
            times: The times (N,) [s].
            beside: A time's range is also that of so many times before and after it.
        """
        settings, arm = self._settings, self._arm
        nominal, _ = self._route.at(self._times)
        steepest = self._pitch(nominal)
        far = max(settings.max_ahead, settings.max_shift)
        low, high = np.full(len(times), steepest.min()), np.full(len(times), steepest.max())
        if far <= FAR:  # it is somewhere near
            nominal, yaw = self._route.at(times)
            heading = far * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
            near = np.array([self._pitch(nominal + k * heading) for k in (-1, 0, 1)])
            low = -most_beside(-near.min(axis=0), beside)
            high = most_beside(near.max(axis=0), beside)

        def most(room: FloatArray, least_room: float) -> FloatArray:
            """The tilt that some room allows, and the room where the path is steepest."""
            always = min(MOST_TILT, max(least_room, LEAST_TILT))
            return np.maximum(np.minimum(room, TILT_BESIDE), always)

        back = most(STEEPEST + low, STEEPEST + float(steepest.min()))
        ahead = most(STEEPEST - high, STEEPEST - float(steepest.max()))
        same = np.ones(len(times))
        return arm * np.array([[-MOST_SINK * same, MOST_LIFT * same], [-back, ahead]])

    def _pitch(self, places: FloatArray) -> FloatArray:
        """The pitch of bodies that follow the ground at places (N, 2) [rad]."""
        return body_pitch(self._settings.pitch_along_slope, self._route.ground(places)[1])

    def _points(self, path: FloatArray) -> FloatArray:
        """Control points of all five splines (n, 5): z and pitch follow the ground under a path."""
        yaw = np.array(self._yaw)
        yaw[:3], yaw[-3:] = yaw[0], yaw[-1]  # at rest at both ends
        poses = self._poses(path, self.contacts.duration, self._knot, self._route.joined)
        return np.column_stack([poses, yaw])

    def _poses(self, path: FloatArray, duration: float, knot: float, joined: float) -> FloatArray:
        """The first four of these, (n, 4), of a path with such times [s].

        Args:
            path: Control points (n, 2) or (n, 4) [m].
            duration: How long the path lasts [s].
            knot: Knot spacing [s].
            joined: When it has come from where the task before ended to the ground's height [s].
        """
        settings, route = self._settings, self._route
        height, slope = route.ground(path[:, :2])
        pitch = body_pitch(settings.pitch_along_slope, slope)
        if path.shape[1] > 2:
            height, pitch = height + path[:, 2], pitch + path[:, 3] / self._arm
        poses = np.column_stack([path[:, :2], height + settings.body_height, pitch])
        poses[:3], poses[-3:] = poses[0], poses[-1]  # at rest at both ends
        if route.start is not None:  # the task before ended there, over whatever it took for ground
            off = route.start - poses[0]
            if np.any(np.abs(off) > ROUNDING):
                left = join_weights(duration, knot, joined)
                poses += left[:, None] * off
        return poses


def _tempo(contacts: ContactPlan) -> float:
    """How much finer than for the calmest swings the path has to be, at most 1."""
    swings = [step.swing.duration for step in contacts.steps]
    return max(LEAST_TEMPO, min(1.0, min(swings, default=CALMEST_SWING) / CALMEST_SWING))
