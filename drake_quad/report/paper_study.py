"""The paper's case study, planned with the paper's own gait: what its section III shows.

Everything here is kinematic, as in the paper, and seen in the world frame W.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.gait.workspace import PAPER_WORKSPACE, Workspace
from drake_quad.planning.body_reference import level_pose, robot_stance
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.task import plan_task
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import course_of, mission_of, plan_settings, robot_of
from drake_quad.scenario.load import load_scenario
from drake_quad.terrain.course import Course

UP, DOWN = 1, 3  # the plans of the case study that climb and descend


@dataclass(frozen=True)
class TableI:
    """Table I: the gait parameters of the case study, in the paper's letters and SI units."""

    workspace: Workspace = PAPER_WORKSPACE
    beta: float = 0.75
    W: float = 0.50
    H: float = 0.13
    T: float = 8.0
    t_0: float = 0.0
    delta_h: float = 0.02

    @property
    def stride(self) -> float:
        """λ [m]: each leg advances two treads in a cycle."""
        return 2.0 * self.W

    @property
    def stroke(self) -> float:
        """R = 2Wβ [m]."""
        return self.stride * self.beta

    @property
    def swing_time(self) -> float:
        """T_sw [s]."""
        return (1.0 - self.beta) * self.T


TABLE_I = TableI()

# The paper's gait has one stride, 1 m, and the shipped scenario's level ground is whole strides
# long. Here it is not, and the stride adapts: a landing of 3 m.
OUT_OF_PHASE = (
    "start.distance=1.5",
    "course[2].length=3.0",
    "mission=[{kind: stand, duration: 1.0}, {kind: walk, distance: 7.5},"
    " {kind: spin, angle_deg: 90.0}, {kind: walk, distance: 7.1}, {kind: stand, duration: 1.0}]",
)


@dataclass(frozen=True, eq=False)
class CaseStudy:
    """The plan of a whole mission.

    Attributes:
        robot: The robot, for its legs' shape and mass; the paper's margins do not use it.
        course: The ground.
        settings: The gait's parameters.
        plans: One for each task.
        starts: When each plan begins [s].
    """

    robot: RobotModel
    course: Course
    settings: PlanSettings
    plans: tuple[MotionPlan, ...]
    starts: tuple[float, ...]

    @property
    def duration(self) -> float:
        """How long it all takes [s]."""
        return self.starts[-1] + self.plans[-1].duration

    @property
    def segments(self) -> tuple[Segment, ...]:
        """All segments, with times since the start of the mission [s]."""
        return tuple(
            Segment(s.name, s.kind, start + s.start, start + s.end, s.details)
            for plan, start in zip(self.plans, self.starts, strict=True)
            for s in plan.segments
        )


def plan_case_study(overrides: Sequence[str] = ()) -> CaseStudy:
    """Plans the shipped scenario `paper`, task by task.

    Args:
        overrides: `path=value` each, applied to the scenario.

    Raises:
        InputError: An override cannot be used.
        PlanningError: There is no plan.
    """
    scenario = load_scenario("paper", overrides)
    robot, course, settings = (
        robot_of(scenario),
        course_of(scenario),
        plan_settings(scenario),
    )
    lane, start = course.lanes[0], scenario.start.distance
    ground, feet_B = float(lane.height(start)), robot_stance(settings)
    feet = np.column_stack(
        [lane.point(start + feet_B[:, 0], feet_B[:, 1]), np.full(4, ground + robot.foot_radius)]
    )
    stance = Stance(level_pose(lane.point(start), lane.yaw, ground, settings), feet)
    plans: list[MotionPlan] = []
    for index, task in enumerate(mission_of(scenario, course)):
        plans.append(plan_task(robot, course, settings, task, stance, index=index))
        stance = plans[-1].end
    starts = np.cumsum([0.0, *(plan.duration for plan in plans[:-1])])
    return CaseStudy(robot, course, settings, tuple(plans), tuple(starts.tolist()))


def climbing_cycle(study: CaseStudy, index: int = UP) -> int:
    """Returns the first cycle of plan `index` in which every foot is on the stairs throughout."""
    plan, lane = study.plans[index], study.course.lanes[0 if index == UP else 1]
    for cycle, steps in enumerate(wave_cycles(plan)):
        ends = np.array([[step.swing.p_start, step.swing.p_end] for step in steps])
        s, _ = lane.coordinates(ends.reshape(-1, 3))
        if all(lane.kinds[k] == "tread" for k in lane.interval(s)):
            return cycle
    raise ValueError("no cycle is on the stairs with all feet")


def wave_cycles(plan: MotionPlan) -> list[tuple[Step, ...]]:
    """Returns the four steps of each cycle of a walk, in time order."""
    wave = next(s for s in plan.segments if s.kind == "wave")
    steps = [step for step in plan.contacts.steps if step.lift_off > wave.start]
    return [tuple(steps[k : k + 4]) for k in range(0, len(steps), 4)]
