"""TransitionPlanner: plans each task from the feet as they stand when it begins."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_quad.common import FloatArray
from drake_quad.control.ports import SIZE, GaitPhase
from drake_quad.errors import DrakeQuadError
from drake_quad.perception.growing_map import describe_standing
from drake_quad.perception.sight import MapRevision
from drake_quad.perception.stair_map import describe_belief
from drake_quad.planning.known_mission import (
    Growth,
    KnownMission,
    mission_back,
    mission_on,
    on_other_map,
)
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.onward import why_not
from drake_quad.planning.plan_job import PlanJob, PlanMaker, RestJob, TaskJob
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.replan import project_to_map
from drake_quad.planning.retreat import RetreatJob
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.terrain.course import Course

AS_PLANNED = 0.01  # of a leg: by which feet may be off, and still stand as planned


class TransitionPlanner(LeafSystem):
    """Holds the motion plan of the task under way.

    On entering a task: from where the feet stand as measured (or as planned, if that is nearly the
    same), the fewest stable steps to the
    gait's desired configuration, then the gait's footholds and the body's path. When the clock
    asks for a revision, after a push: the same from the feet as they stand, for the rest of the
    task. Plans are in the map's heights: what the ground is higher, the controller adds.

    Where the map grows, the mission is known as far as the map is. When the clock comes to its end,
    and the robot has looked again, the next stretch is planned on the map as it is then. If there
    is no way on, the run ends there, on four feet, and says why; if it is told to, the robot goes
    back the way it came before that.

    Once a flight was walked up, the rest of the mission is planned on the map as feet have found
    it. If it has no plan there, the map of before stays, if feet have not disproved it.

    Input ports:
        gait_phase: See GaitPhase.
        robot_state_estimated: [q; v] of the robot.
        map_known: MapRevision, the newest (abstract), if the map grows or is revised.
    Output ports:
        motion_plan: MotionPlan (abstract), frozen.
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        course: Course,
        settings: PlanSettings,
        mission: Sequence[Task],
        period: float = 0.05,
        planned: Sequence[MotionPlan] = (),
        maker: PlanMaker | None = None,
        growth: Growth | None = None,
    ) -> None:
        """Declares ports and state.

        Args:
            robot: The robot.
            layout: Layout of its state.
            course: The map.
            settings: The planner's settings.
            mission: The tasks.
            period: Time between looks at the clock [s].
            planned: Plans made beforehand, one a task: a task that begins as on paper takes its
                own over instead of making the same anew, for which a wall clock would not wait.
            maker: Who makes plans while the robot stands and the clock goes on; without one they
                are made within the update, and time stands still. What is being made is no part of
                the Context.
            growth: How to plan on where the map grows, or is revised; None: it does not.
        """
        super().__init__()
        self.set_name("transition_planner")
        self._robot, self._layout = robot, layout
        self._planned, self._maker, self._growth = tuple(planned), maker, growth
        self._phase_port = self.DeclareVectorInputPort("gait_phase", SIZE)
        self._state_port = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        self._plan = self.DeclareAbstractState(AbstractValue.Make(object()))
        self._history = self.DeclareAbstractState(AbstractValue.Make(()))
        revise_before = None if growth is None else growth.revise_before
        known = KnownMission(
            course, settings, tuple(mission), 0,
            goes_on=growth is not None and growth.looks_again, revise_before=revise_before,
            on_paper=len(self._planned),
        )  # fmt: skip
        self._known = self.DeclareAbstractState(AbstractValue.Make(known))
        self._map_port = None
        if growth is not None:
            self._map_port = self.DeclareAbstractInputPort(
                "map_known", AbstractValue.Make(object())
            )
        self.DeclareStateOutputPort("motion_plan", self._plan)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)
        # Offset 0, as everywhere: k T and T + k T round apart, and the order of ticks would vary.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def plans(self, context: Context) -> tuple[MotionPlan, ...]:
        """The plans of all tasks begun so far, for a run's log."""
        plans: tuple[MotionPlan, ...] = context.get_abstract_state(int(self._history)).get_value()
        return plans

    def map_number(self, context: Context) -> int:
        """Number of the map's revision that the newest stretch is planned on."""
        return self._known_to(context).planned_on

    def refused(self, context: Context) -> str:
        """Why the rest was not planned on the map as feet have found it; empty if it was."""
        return self._known_to(context).refused

    def _initialize(self, context: Context, state: State) -> EventStatus:
        measured = self._layout.read(self._state_port.Eval(context))
        R = measured.R_WB
        pitch, yaw = -np.arcsin(np.clip(R[2, 0], -1, 1)), np.arctan2(R[1, 0], R[0, 0])
        body = np.array([*measured.p_WB, pitch, yaw])
        stance = Stance(body, self._feet(context))
        if self._planned and self._is_as_planned(self._planned[0], 0.0, stance.feet):
            self._keep(context, state, self._planned[0])
        else:
            known = self._known_to(context)
            self._keep(context, state, self._task_job(0, stance, known).make(), known)
        return EventStatus.Succeeded()

    def _update(self, context: Context, state: State) -> EventStatus:
        phase = self._phase_port.Eval(context)
        task, revision = int(phase[GaitPhase.TASK]), int(phase[GaitPhase.REVISION])
        plan: MotionPlan = context.get_abstract_state(int(self._plan)).get_value()
        # The body goes on from where it was desired to be, so that its desired pose never jumps.
        if plan.index != task:
            before = known = self._known_to(context)
            if task >= len(known.mission) or task == known.revise_before:
                grown = self._grow(context, known, plan)
                if not isinstance(grown, KnownMission):
                    return grown
                state.get_mutable_abstract_state(int(self._known)).set_value(grown)
                known = grown
            if (
                task < known.on_paper
                and self._is_on_paper(plan)
                and self._is_as_planned(plan, plan.duration, self._feet_on_map(context))
            ):
                self._keep(context, state, self._planned[task])
                return EventStatus.Succeeded()
            stance = on_other_map(self._stance_after(plan, context), before.course, known.course)
            job = self._task_job(task, stance, known)
            return self._make(context, state, job, known)
        if plan.revision != revision:
            feet, time = self._feet_on_map(context), float(phase[GaitPhase.TIME])
            known = self._known_to(context)
            rest = RestJob(self._robot, known.course, known.settings, plan, time, feet)
            return self._make(context, state, rest, known)
        return EventStatus.DidNothing()

    def _make(
        self, context: Context, state: State, job: PlanJob, known: KnownMission
    ) -> EventStatus:
        """Makes a plan, or asks whether it is made."""
        plan = job.make() if self._maker is None else self._maker.ask(job)
        if plan is not None:
            self._keep(context, state, plan, known)
        return EventStatus.Succeeded()

    def _task_job(self, task: int, stance: Stance, known: KnownMission) -> PlanJob:
        what = (self._robot, known.course, known.settings, known.mission[task], stance, task)
        back = task - len(known.mission) + len(known.retreat)
        if back >= 0 and known.retreat:
            return RetreatJob(*what, known.retreat[back])
        return TaskJob(*what)

    def _known_to(self, context: Context) -> KnownMission:
        """What is known of the mission."""
        known: KnownMission = context.get_abstract_state(int(self._known)).get_value()
        return known

    def _grow(
        self, context: Context, known: KnownMission, plan: MotionPlan
    ) -> KnownMission | EventStatus:
        """The mission with its next stretch; or what became of the event where there is none yet.

        Args:
            context: The system's.
            known: What is known of the mission, which has come to its end.
            plan: The plan that was followed.
        """
        assert self._growth is not None and self._map_port is not None
        revision: MapRevision = self._map_port.Eval(context)
        if known.reason:
            return self._stop(
                revision, self._stance_after(plan, context), known.reason, went_back=True
            )
        if revision.number <= known.revision:
            return EventStatus.DidNothing()  # it has not looked yet
        reason, stance = revision.reason, self._stance_after(plan, context)
        if not reason:
            try:
                return mission_on(self._robot, self._growth, known, revision, stance)
            except DrakeQuadError as problem:
                reason = why_not(problem)
        if self._growth.back_down:
            try:
                return mission_back(
                    self._robot, self._growth, known, self.plans(context), stance, reason=reason
                )
            except DrakeQuadError as problem:
                reason = f"{reason}; no way back: {why_not(problem)}"
        return self._stop(revision, stance, reason)

    def _stop(
        self, revision: MapRevision, stance: Stance, reason: str, *, went_back: bool = False
    ) -> EventStatus:
        """The end of the run, on four feet, with where it stands and why."""
        where = describe_standing(revision.map, stance.feet)
        if went_back:
            where = f"where it started, {where}, for it has gone back"
        seen = describe_belief(revision.belief)
        return EventStatus.ReachedTermination(
            self, f"stopped: stands {where}; what is seen is: {seen}; {reason}"
        )

    def _stance_after(self, plan: MotionPlan, context: Context) -> Stance:
        """The stance that a task begins in, after `plan` was carried out.

        Feet that stand as planned, but for a little, are taken to stand just so: then the task's
        plan is the one on paper, which was checked for reach, clearances and torques. From a stance
        a millimetre off, where a robot is at its limits, the path found can be quite another.
        """
        feet, end = self._feet_on_map(context), plan.end
        if self._is_as_planned(plan, plan.duration, feet):
            return end
        return Stance(end.body, feet)

    def _is_on_paper(self, plan: MotionPlan) -> bool:
        """Whether a plan, of which a Context holds a copy, is the one made beforehand."""
        if not self._planned:
            return False
        paper = self._planned[plan.index]
        return plan.revision == paper.revision and np.array_equal(
            plan.body.control, paper.body.control
        )

    def _is_as_planned(self, plan: MotionPlan, t: float, feet: FloatArray) -> bool:
        """Whether `feet` (4, 3) stand as `plan` has them at time `t` [s], but for a little."""
        planned, _ = plan.contacts.feet_at(np.array([t]))
        off = float(np.linalg.norm(feet - planned[0], axis=1).max())
        return off <= AS_PLANNED * float(self._robot.geometry.reach.min())

    def _feet(self, context: Context) -> FloatArray:
        """Where the feet stand as estimated, (4, 3) in W [m]."""
        measured = self._layout.read(self._state_port.Eval(context))
        feet = measured.p_WB + calc_feet(self._robot.geometry, measured.q) @ measured.R_WB.T
        return np.asarray(feet)

    def _feet_on_map(self, context: Context) -> FloatArray:
        """The same, had the map's ground been found where they stand."""
        course = self._known_to(context).course
        return project_to_map(course, self._feet(context), self._robot.foot_radius)

    def _keep(
        self, context: Context, state: State, plan: MotionPlan, known: KnownMission | None = None
    ) -> None:
        """Makes `plan` the one that is followed, and history."""
        known = known or self._known_to(context)
        if self._growth is not None:
            last = plan.index == len(known.mission) - 1
            plan = replace(
                plan, course=known.course, goes_on=known.goes_on or not last,
                revises_map=plan.index + 1 == known.revise_before,
            )  # fmt: skip
        state.get_mutable_abstract_state(int(self._plan)).set_value(plan)
        done: tuple[MotionPlan, ...] = context.get_abstract_state(int(self._history)).get_value()
        state.get_mutable_abstract_state(int(self._history)).set_value((*done, plan))
