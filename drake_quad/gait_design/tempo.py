"""The times of a wave gait: of a swing, and of standing on four feet, at switches and else.

A cycle is four swings and four stretches on four feet. At two of these, the switches, the leg that
lifts next is diagonal to the one that landed, and the body has to go from one side to the other:
they are what margin costs time for. The joints' speeds say how short a swing can be: swings are
short, those over risers as much longer as joints ask for, and the two other stretches are short.
What some times keep is tried by the real planner, on the course or on one with shorter flights.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.designed import Designed, Walks, plan_design
from drake_quad.gait_design.foot_speeds import (
    ANY_SPEED,
    NO_SPEEDS,
    FootSpeeds,
    slowest,
    suited_speeds,
)
from drake_quad.gait_design.pace import PlanPace, measure_pace
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.planning.zmp import sample_zmp, zmp_margins
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.motion_config import BodyConfig, GaitConfig
from drake_quad.stability.margin_kinds import HULL

LEG = 1.22  # [m] of the robot that the times below are of; times go with the root of the length
# The shortest times with which robots have reached their goals in physics (docs/speed.md), and an
# ample one at the switches, from which the search begins.
SHORTEST_SWING, SHORTEST_GAP, USUAL_SWITCH = 0.425, 0.06, 0.9  # [s]
MOVING_SWITCH = 0.25  # [s] the same where a gait is balanced by its motion
GUARD = 0.15  # [s] before a lift-off and after a touchdown
SOUGHT = 2.5  # times the margin that a slow gait's path is asked for: quick ones have to seek more
ZMP_EVERY = 0.005  # [s] between the samples of a zero-moment point
MOST_PEAK = 0.9  # of a joint's speed limit, also where a flight begins or ends
# Of what the slow plan leaves, where that is less than wanted.
CLEARANCE_KEPT, TORQUE_KEPT = 0.6, 0.8
JUST = 1e-6  # [s] after a lift-off, and before a touchdown


@dataclass(frozen=True)
class Tempo:
    """The times of a wave gait.

    Attributes:
        swing: How long a swing lasts [s].
        gap: How long all four feet stand between two legs of a side [s].
        switch: How long they stand between two diagonal legs [s].
        speeds: Speeds of the feet, by which tall swings last longer.
    """

    swing: float
    gap: float
    switch: float
    speeds: FootSpeeds = NO_SPEEDS

    @property
    def cycle(self) -> float:
        """How long a cycle lasts if no swing lasts longer than others [s]."""
        return 4.0 * self.swing + 2.0 * self.gap + 2.0 * self.switch

    @property
    def waits(self) -> float:
        """The time at a cycle's switches, of that in its swings."""
        return self.switch / (2.0 * self.swing)

    @classmethod
    def of(cls, gait: GaitConfig) -> "Tempo":
        """The times of a scenario's gait."""
        swing = (1.0 - gait.duty_factor) * gait.cycle_time
        gap = 0.25 * gait.cycle_time - swing
        return cls(swing, gap, gap + gait.switch_wait, FootSpeeds.of(gait))

    def put(self, scenario: Scenario, *, guard: float, most: float = inf) -> Scenario:
        """The scenario with these times, and a path of the body that seeks more margin.

        Args:
            scenario: Stays as it is.
            guard: `body.guard` of the path [s].
            most: The path seeks no more margin than that [m]: it takes the body off its way.
        """
        quick = copy.deepcopy(scenario)
        cycle_time = 4.0 * (self.swing + self.gap)
        quick.gait.cycle_time = float(f"{cycle_time:.4g}")
        quick.gait.duty_factor = float(f"{1.0 - self.swing / cycle_time:.5g}")
        quick.gait.switch_wait = float(f"{max(self.switch - self.gap, 0.0):.4g}")
        self.speeds.put(quick.gait)
        sought = min(SOUGHT * scenario.body.margin_desired, most)
        quick.body.margin_desired = float(f"{sought:.4g}")
        quick.body.zmp_margin = quick.body.margin_desired
        quick.body.guard = float(f"{guard:.3g}")
        return quick


def guard_for(robot: RobotModel) -> float:
    """For how long three feet have to do already, in a quick gait of a robot of its size [s]."""
    return min(GUARD * sqrt(leg_length(robot) / LEG), BodyConfig().guard)


def balanced_by_motion(scenario: Scenario) -> Scenario:
    """The scenario with the zero-moment point over the feet, and not the centre of mass.

    A foot lifts wherever the robot could come to rest over the other three.

    Args:
        scenario: It stays as it is.
    """
    moving = copy.deepcopy(scenario)
    moving.body.balance = "dynamic"
    moving.controller.lift_off_margin = 0.0
    return moving


def tread_way(gait: GaitConfig, run: float) -> float:
    """How far a cycle takes the body on treads of a depth [m]."""
    return gait.treads / gait.places_per_tread * run


def usual_tempo(
    gait: GaitConfig, robot: RobotModel, stretch: float = 1.0, *, moving: bool = False
) -> Tempo:
    """Swings `stretch` times as long as the shortest, and ample switches, by the robot's size.

    Args:
        gait: The gait, whose time on four feet between legs of a side is not made longer.
        robot: The robot.
        stretch: Ratio of a swing's time to the shortest that has been walked.
        moving: Whether the gait is balanced by its motion.
    """
    size, now = sqrt(leg_length(robot) / LEG), Tempo.of(gait)
    swing, gap = stretch * SHORTEST_SWING * size, min(SHORTEST_GAP * size, now.gap)
    return Tempo(
        swing, gap, (MOVING_SWITCH if moving else USUAL_SWITCH) * size, FootSpeeds.all_at(ANY_SPEED)
    )


@dataclass(frozen=True, eq=False)
class TempoTrial:
    """A plan with some times.

    Attributes:
        tempo: The times.
        designed: The gait with its plan.
        pace: How fast it is, and what it asks of the joints.
        suits: The speeds of feet with which swings would ask for PEAK of the joints' speeds.
        walks: The tasks that were planned; all if None.
        from_scratch: Whether its plans are those that anyone finds; else they had warm starts, and
            may differ a little.
        cut: Whether it is of the course with its long flights cut short, see `fewer_steps`.
    """

    tempo: Tempo
    designed: Designed
    pace: PlanPace
    suits: FootSpeeds
    walks: Walks | None = None
    from_scratch: bool = True
    cut: bool = False

    @property
    def whole(self) -> bool:
        """Whether it is of all tasks, on the course itself."""
        return self.walks is None and not self.cut

    @property
    def speed(self) -> float:
        """Speed on the slowest flight [m/s]; 0 if there is none."""
        return 0.0 if self.pace.slowest is None else self.pace.slowest.speed


def try_tempo(
    scenario: Scenario,
    design: Design,
    robot: RobotModel,
    tempo: Tempo,
    *,
    most: float = inf,
    source: str = "scenario",
    walks: Walks | None = None,
    enough: Callable[[MotionPlan], bool] = lambda _: True,
    warm_starts: dict[int, MotionPlan] | None = None,
) -> TempoTrial:
    """Plans a scenario with such times.

    Args:
        scenario: With its gait.
        design: The gait.
        robot: The scenario's.
        tempo: The times.
        most: The body's path seeks no more margin than that [m].
        source: What an error names.
        walks: The tasks that are planned, in this order; all if None.
        enough: Whether a task's plan leaves enough; after one that does not, no other is planned.
        warm_starts: Plans of the same tasks with other times, see `plan_tasks`.

    Raises:
        PlanningError: If there is no plan.
    """
    from_scratch = not warm_starts
    quick = tempo.put(scenario, guard=guard_for(robot), most=most)
    course = course_of(quick, source=source, foot_radius=robot.foot_radius)
    found = plan_design(
        quick, design=design, robot=robot, shape=link_outline_of(robot), course=course,
        source=source, beat=None, walks=walks, enough=enough, warm_starts=warm_starts,
    )  # fmt: skip
    assert found is not None  # there is nothing that it would have to beat
    seen = least_zmp_margin if found.plan.dynamic else least_margin
    least = min((seen(robot, plan) for plan in found.plan.plans), default=inf)
    found = replace(found, margin=min(found.margin, least))
    tasks = mission_of(quick, course, source=source)
    pace = measure_pace(robot, course, tasks, found.plan)
    suits = [suited_speeds(robot, plan, tempo.swing) for plan in found.plan.plans]
    return TempoTrial(tempo, found, pace, slowest(suits), walks, from_scratch)


def is_calm(trial: TempoTrial) -> bool:
    """Whether no joint is asked for too much of its speed."""
    return trial.pace.peak is None or trial.pace.peak.share <= MOST_PEAK


def keeps_all_else(trial: TempoTrial, slow: Designed) -> bool:
    """Whether a quick plan keeps enough of all but margin that the slow one left.

    Args:
        trial: The quick plan.
        slow: The gait that was found for margin.
    """
    wanted, found = slow.design.wanted, trial.designed
    clearance = CLEARANCE_KEPT * min(slow.clearance.weighted, wanted["legs"])
    torque = TORQUE_KEPT * min(slow.torque, wanted["torque"])
    return found.clearance.weighted >= clearance and found.torque >= torque and is_calm(trial)


def least_margin(robot: RobotModel, plan: MotionPlan) -> float:
    """The least static margin just after each lift-off and just before each touchdown [m].

    A plan's own margin is of sampled times. As a foot lifts, or is about to land, it still counts
    there; in a quick gait the margin without it is up to 4 mm less. It is infinite without steps,
    and where the plan's margin is another than the static one.
    """
    if not plan.contacts.steps or plan.margin_kind != HULL:
        return inf
    return float(evaluate(robot, plan, switch_times(plan)).margin.min())


def static_margin(robot: RobotModel, designed: Designed) -> float:
    """The least static margin of a gait's plan [m], also of one that is balanced by its motion."""
    if not designed.plan.dynamic:
        return designed.margin
    walks = [plan for plan in designed.plan.plans if plan.contacts.steps]
    sampled = (
        float(evaluate(robot, plan, sample_times(plan.contacts)).margin.min()) for plan in walks
    )
    return min([*sampled, *(least_margin(robot, plan) for plan in walks)], default=inf)


def least_zmp_margin(robot: RobotModel, plan: MotionPlan) -> float:
    """The least margin of the zero-moment point, seen finer than a plan sees it [m].

    The point moves by up to 0.5 m/s as a foot lifts, so it is also looked at just after each
    lift-off and just before each touchdown. It is infinite without steps.
    """
    if not plan.contacts.steps:
        return inf
    seen = sample_zmp(robot, plan.contacts, plan.body, ZMP_EVERY)
    times = switch_times(plan)
    zmp = np.stack([np.interp(times, seen.times, seen.zmp[:, axis]) for axis in range(2)], axis=-1)
    feet, standing = plan.contacts.feet_at(times)
    at_switches, _ = zmp_margins(zmp, feet[..., :2], standing)
    return float(min(seen.margin.min(), at_switches.min()))


def switch_times(plan: MotionPlan) -> FloatArray:
    """Just after each lift-off and just before each touchdown, in order (N,) [s]."""
    steps = plan.contacts.steps
    times = [s.lift_off + JUST for s in steps] + [s.touchdown - JUST for s in steps]
    return np.unique(times)
