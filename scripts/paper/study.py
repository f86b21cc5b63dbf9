"""The paper's case study, planned with the paper's own gait, and sampled.

Everything here is kinematic, as in the paper, and seen in the world frame W.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.gait.workspace import PAPER_WORKSPACE, Workspace
from drake_quad.planning.body_reference import level_pose, robot_stance
from drake_quad.planning.contact_plan import Phase, Step
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance, pose_robot
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.task import plan_task
from drake_quad.robot.legs import Leg
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import course_of, mission_of, plan_settings, robot_of
from drake_quad.scenario.load import load_scenario
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course

# ------------------------------------------------------------------------------------------------
# The paper's case study, planned with the paper's own gait: what its section III shows.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# The case study at many times: its margins, and when they are zero.
# ------------------------------------------------------------------------------------------------


SAMPLE_PERIOD = 0.05  # [s]
ZERO = 1e-6  # [m]: a margin this small is on the support polygon's border


@dataclass(frozen=True, eq=False)
class Samples:
    """A plan at many times, phase by phase, both ends of each phase included.

    At a switch the same time is there twice: with the feet that stood, and with those that then
    stand.

    Attributes:
        times: (N,) since the start of the mission [s].
        body: (N, 5) x, y, z, pitch, yaw of the body.
        feet: (N, 4, 3) foot sphere centres [m].
        standing: (N, 4) who stands.
        margin: (N,) static margin of the body's centre: massless legs, as in the paper [m].
        margin_robot: (N,) static margin of the whole robot's centre of mass [m].
        reach_excess: (N,) by how much the worst foot is out of its leg's reach [m].
    """

    times: FloatArray
    body: FloatArray
    feet: FloatArray
    standing: BoolArray
    margin: FloatArray
    margin_robot: FloatArray
    reach_excess: FloatArray


def sample_plan(
    study: CaseStudy, index: int, *, start: float = 0.0, end: float = np.inf
) -> Samples:
    """Samples plan `index` from `start` to `end`, in the plan's own time [s]."""
    plan, offset = study.plans[index], study.starts[index]
    rows = [
        _sample_phase(plan, phase, max(phase.start, start), min(phase.end, end))
        for phase in plan.contacts.phases
        if phase.start < end - ZERO and phase.end > start + ZERO
    ]
    times, body, feet, standing = (np.concatenate(column) for column in zip(*rows, strict=True))
    _, excess, com = pose_robot(study.robot, body, feet)
    return Samples(
        times=offset + times,
        body=body,
        feet=feet,
        standing=standing,
        margin=stability_margins(body[:, :2], feet[..., :2], standing),
        margin_robot=stability_margins(com[:, :2], feet[..., :2], standing),
        reach_excess=excess.max(axis=1),
    )


def sample_study(study: CaseStudy) -> Samples:
    """Samples the whole mission."""
    parts = [vars(sample_plan(study, index)) for index in range(len(study.plans))]
    return Samples(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def _sample_phase(
    plan: MotionPlan, phase: Phase, start: float, end: float
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Returns times, body, feet and standing feet of a phase, its own feet at both of its ends."""
    count = max(int(np.ceil((end - start) / SAMPLE_PERIOD - ZERO)), 1) + 1
    times = np.linspace(start, end, count)
    feet = np.tile(phase.feet, (count, 1, 1))
    if phase.step is not None:
        feet[:, phase.step.leg.row] = phase.step.swing.positions(times - phase.start)
    return times, plan.body.samples(times)[:, 0], feet, np.tile(phase.standing, (count, 1))


@dataclass(frozen=True)
class Zero:
    """A time at which the margin is zero.

    Attributes:
        kind: `transition` or `wave` (or whatever the segment is).
        start: When it begins [s].
        end: When it ends [s]; the same at a switch.
        legs: Who is in the air: one leg in a transition's step, two at a switch between legs.
    """

    kind: str
    start: float
    end: float
    legs: tuple[Leg, ...]


def find_zeros(study: CaseStudy, samples: Samples) -> tuple[Zero, ...]:
    """Returns when the massless-leg robot's margin is zero, in time order.

    Neighbouring samples on the border are one zero: a step of a transition, or a switch.
    """
    zeros: list[Zero] = []
    rows = np.flatnonzero(samples.margin < ZERO)
    for group in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        if not len(group):
            continue
        start, end = float(samples.times[group[0]]), float(samples.times[group[-1]])
        middle = (start + end) / 2.0
        kind = next(s.kind for s in study.segments if s.start - ZERO <= middle <= s.end + ZERO)
        legs: dict[Leg, None] = {}
        for row in group:
            legs.update(dict.fromkeys(leg for leg in Leg if not samples.standing[row, leg.row]))
        zeros.append(Zero(kind, start, end, tuple(legs)))
    return tuple(zeros)


def cycle_margins(study: CaseStudy, index: int, cycle: int) -> FloatArray:
    """Returns the margins through one cycle of plan `index` [m], legs massless."""
    start = wave_cycles(study.plans[index])[cycle][0].lift_off
    return sample_plan(study, index, start=start, end=start + TABLE_I.T).margin
