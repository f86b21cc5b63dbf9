"""Chooses a gait's times: of a swing, and of standing on four feet, at switches and else.

A wave gait's cycle is four swings and four stretches on four feet. At two of these, the switches,
the leg that lifts next is diagonal to the one that landed, and the body has to go from one side to
the other: they are what margin costs time for. The joints' speeds say how short a swing can be.
So swings are short, those over risers as much longer as joints ask for, the two other stretches are
short, and the time at the switches is sought: as short as the margin allows that is to be kept.
Every trial is a plan by the real planner, on a short course with the same steps; what is found is
planned on the course itself, and taken if that keeps what is asked for. A short course mostly
leaves less margin than a long one: where the course has left more, a shorter time is tried, too.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, sqrt

import numpy as np

from drake_quad.errors import InputError, PlanningError
from drake_quad.gait_design.candidates import Staircase, flights_of, hip_length
from drake_quad.gait_design.pace import HALF, PER_SWING, PlanPace, joint_speeds, measure_pace
from drake_quad.gait_design.plan_candidates import Designed, plan_design
from drake_quad.planning.mission import initial_stance, join_plans, plan_tasks
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.step_builder import peak_speed
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario, StartConfig
from drake_quad.scenario.motion_config import BodyConfig, GaitConfig
from drake_quad.stability.safety import safe_margin
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

PREFER = ("margin", "balanced", "speed")
KEPT = 0.8  # of the margin of the gait that was found for margin: what `balanced` keeps
LEAST_MARGIN = 0.010  # [m] that `speed` keeps at least
LEG = 1.22  # [m] of the robot that the times below are of; times go with the root of the length
# Times of the quickest gait of the case study that reached its goal in physics (docs/margins.md).
SHORTEST_SWING, SHORTEST_GAP, USUAL_SWITCH = 0.425, 0.2, 0.9  # [s]
GUARD = 0.15  # [s] before a lift-off and after a touchdown
ANY_SPEED = 20.0  # [m/s] of a swing foot: then swings are calm, and none lasts longer
PEAK = 0.8  # of a joint's speed limit: what a trial's swings may ask for, and
MOST_PEAK = 0.9  # the plan on the course itself, where a flight begins or ends
ROOM_KEPT, TORQUE_KEPT = 0.8, 0.8  # of what today's plan leaves, where that is less than wanted
SOUGHT = 2.5  # times the margin that a slow gait's path is asked for: quick ones have to seek more
STEPS = 2  # of every flight of the short course
TRIALS = 6  # plans on the short course, at most
NEAR = 0.04  # of a time: no other is tried so near to it
CLOSE = 0.06  # of the margin that is to be kept: so near is near enough
LONGER, TRIES = 1.12, 4  # ratio of the time at switches, and plans, on the course itself
WORTH = 1.02  # ratio of speeds from which another gait is taken


@dataclass(frozen=True)
class Wish:
    """What a gait is to be good at.

    Attributes:
        prefer: One of PREFER: the most margin; the quickest that keeps KEPT of that margin; or the
            quickest that keeps the margin with which a run counts as safe.
        speed: Speed on the flights that is enough [m/s]; it then has the margin that is left.
        min_margin: Margin that the plan is to keep, instead of what `prefer` says [m].
    """

    prefer: str = "margin"
    speed: float | None = None
    min_margin: float | None = None

    @property
    def quick(self) -> bool:
        """Whether the gait's times are to be chosen at all."""
        return self.prefer != "margin" or self.speed is not None or self.min_margin is not None

    def check(self) -> None:
        """Makes sure that there can be such a wish.

        Raises:
            InputError: The error names the option, its value and what would be right.
        """
        if self.prefer not in PREFER:
            remedy = f"give {', '.join(PREFER[:-1])} or {PREFER[-1]}"
            raise InputError(source="--prefer", field="prefer", value=self.prefer, remedy=remedy)
        for option, value, unit in (
            ("speed", self.speed, "m/s"),
            ("min-margin", self.min_margin, "metres"),
        ):
            if value is not None and not (isfinite(value) and value > 0.0):
                remedy = f"give {unit}, more than 0"
                field = option.replace("-", "_")
                raise InputError(source=f"--{option}", field=field, value=value, remedy=remedy)

    def least_margin(self, robot: RobotModel, margin: float) -> float:
        """The margin that a plan is to keep [m], where the gait found for margin has `margin`."""
        if self.min_margin is not None:
            return self.min_margin
        safe = max(safe_margin(robot), LEAST_MARGIN)
        fast = self.prefer == "speed" or (self.prefer == "margin" and self.speed is not None)
        return min(safe, margin) if fast else KEPT * margin


@dataclass(frozen=True)
class Tempo:
    """The times of a wave gait.

    Attributes:
        swing: How long a swing lasts [s].
        gap: How long all four feet stand between two legs of a side [s].
        switch: How long they stand between two diagonal legs [s].
        foot_speed: `gait.swing_speed`, by which tall swings last longer [m/s]; 0: none do.
    """

    swing: float
    gap: float
    switch: float
    foot_speed: float = 0.0

    @property
    def cycle(self) -> float:
        """How long a cycle lasts if no swing lasts longer than others [s]."""
        return 4.0 * self.swing + 2.0 * self.gap + 2.0 * self.switch

    @classmethod
    def of(cls, gait: GaitConfig) -> "Tempo":
        """The times of a scenario's gait."""
        swing = (1.0 - gait.duty_factor) * gait.cycle_time
        gap = 0.25 * gait.cycle_time - swing
        return cls(swing, gap, gap + gait.switch_wait, gait.swing_speed)

    def put(self, scenario: Scenario, *, guard: float) -> Scenario:
        """The scenario with these times, and a path of the body that seeks more margin.

        Args:
            scenario: Stays as it is.
            guard: `body.guard` of the path [s].
        """
        quick = copy.deepcopy(scenario)
        cycle_time = 4.0 * (self.swing + self.gap)
        quick.gait.cycle_time = float(f"{cycle_time:.4g}")
        quick.gait.duty_factor = float(f"{1.0 - self.swing / cycle_time:.5g}")
        quick.gait.switch_wait = float(f"{max(self.switch - self.gap, 0.0):.4g}")
        quick.gait.swing_speed = float(f"{self.foot_speed:.3g}")
        quick.body.margin_desired = float(f"{SOUGHT * scenario.body.margin_desired:.4g}")
        quick.body.zmp_margin = quick.body.margin_desired
        quick.body.guard = float(f"{guard:.3g}")
        return quick


def guard_for(robot: RobotModel) -> float:
    """For how long three feet have to do already, in a quick gait of a robot of its size [s]."""
    return min(GUARD * sqrt(leg_length(robot) / LEG), BodyConfig().guard)


def tread_way(gait: GaitConfig, run: float) -> float:
    """How far a cycle takes the body on treads of a depth [m]."""
    return gait.treads / gait.places_per_tread * run


def short_course(scenario: Scenario, robot: RobotModel, flights: Sequence[Staircase]) -> Scenario:
    """The scenario on a straight course with a few of each kind of the flights' steps.

    Args:
        scenario: With its gait.
        robot: The scenario's.
        flights: The kinds of steps.
    """
    short = copy.deepcopy(scenario)
    hip, leg = hip_length(robot), leg_length(robot)
    size = max(leg, 0.5 * hip)
    deepest = max(s.run for s in flights)
    start = 0.5 * hip + 0.8 * size + 0.1
    width = 3.0 * size + 1.0
    course = [Element(kind="floor", length=round(start + 0.5 * hip + 0.9 * size, 2), width=width)]
    for k, stairs in enumerate(sorted(flights, key=lambda s: -s.rise)):
        if k:
            between = round(hip + 1.6 * size + deepest, 2)
            course.append(Element(kind="floor", length=between, width=width))
        going = "up" if stairs.rise > 0.0 else "down"
        course.append(
            Element(kind="stairs", going=going, rise=abs(stairs.rise), run=stairs.run, count=STEPS,
                    width=width)
        )  # fmt: skip
    after = round(hip + 2.5 * size + 2.0 * deepest, 2)
    course.append(Element(kind="floor", length=after, width=width))
    short.course, short.mission = course, []
    short.start = StartConfig(distance=round(start, 3))
    return short


@dataclass(frozen=True)
class TempoTrial:
    """What a plan of some times keeps.

    Attributes:
        margin: The least of its static margins and its zero-moment point's [m].
        speed: On the slowest flight [m/s].
        share: The most that a swing asks of its leg's joints' speeds, over the limit.
        foot_speed: The speed that feet must not exceed for that to be PEAK [m/s].
    """

    margin: float
    speed: float
    share: float
    foot_speed: float


NO_PLAN = TempoTrial(-inf, 0.0, 0.0, inf)


def try_tempo(scenario: Scenario, robot: RobotModel, tempo: Tempo) -> TempoTrial:
    """Plans a scenario's walks with such times; without a plan there is no margin."""
    quick = tempo.put(scenario, guard=guard_for(robot))
    course = course_of(quick, foot_radius=robot.foot_radius)
    settings = plan_settings(quick)
    tasks = [t for t in mission_of(quick, course, source="trial") if t.kind == "walk"]
    stance = initial_stance(robot, course, settings, start=quick.start.distance)
    try:
        plans = list(plan_tasks(robot, course, settings, tasks, stance))
    except PlanningError:
        return NO_PLAN
    pace = measure_pace(robot, course, tasks, join_plans(plans, 0.0))
    margin = min(pace.zmp_margin, *(p.margin for p in plans))
    share, foot_speed = 0.0, inf
    for plan in plans:
        most, least = swing_shares(robot, plan)
        share, foot_speed = max(share, most), min(foot_speed, least)
    speed = 0.0 if pace.slowest is None else pace.slowest.speed
    return TempoTrial(margin, speed, share, foot_speed)


def swing_shares(robot: RobotModel, plan: MotionPlan) -> tuple[float, float]:
    """The most that a plan's gait asks of joints in its swings, and what feet's speed would suit.

    Args:
        robot: The robot.
        plan: A walk's.

    Returns:
        The largest share of a joint's speed limit, and the least speed [m/s] that a foot of those
        swings that ask for more than PEAK would have if it asked for no more.
    """
    begin = min((s.start for s in plan.segments if s.kind == "wave"), default=inf)
    steps = [step for step in plan.contacts.steps if step.lift_off >= begin]
    if not steps:
        return 0.0, inf
    times = np.concatenate([np.linspace(s.lift_off, s.touchdown, PER_SWING) for s in steps])
    inside = np.clip(times, HALF, plan.duration - HALF)
    share = (joint_speeds(robot, plan, inside)[0] / robot.speed).reshape(len(steps), -1, 4, 3)
    own = [float(mine[:, step.leg.row].max()) for mine, step in zip(share, steps, strict=True)]
    suits = [peak_speed(s.swing) * PEAK / k for s, k in zip(steps, own, strict=True) if k > PEAK]
    return max(own), min(suits, default=inf)


def seek_switch(
    trial: Callable[[float], float],
    first: float,
    least: float,
    kept: float,
    known: dict[float, float] | None = None,
) -> float:
    """The shortest time at switches with which a margin is kept, by secants.

    Args:
        trial: The margin [m] with such a time [s]; it mostly grows with it.
        first: The time to begin with [s].
        least: The shortest that is tried [s].
        kept: The margin that is to be kept [m].
        known: Margins of times that were tried before [m]; those tried here are added.

    Returns:
        The shortest that was tried and kept it [s]; infinite if none did.
    """
    known = {} if known is None else known
    switch = max(first, least)
    for _ in range(TRIALS):
        if switch not in known:
            known[switch] = trial(switch)
        best = min((t for t, m in known.items() if m >= kept), default=inf)
        low = max((t for t, m in known.items() if m < kept and t < best), default=None)
        if best <= least or (best < inf and known[best] <= (1.0 + CLOSE) * kept):
            break
        if best == inf:
            switch = 1.4 * max(known)
        elif low is None:
            switch = max(0.75 * best, least)
        elif best - low < NEAR * best:
            break
        else:  # between them, a little to the safe side
            under, over = kept - known[low], known[best] - kept
            share = under / (under + over) if under < inf else 0.75
            switch = low + min(max(1.1 * share, 0.25), 0.85) * (best - low)
    return min((t for t, m in known.items() if m >= kept), default=inf)


def shortest_tempo(gait: GaitConfig, robot: RobotModel) -> Tempo:
    """Times as short as have been walked, by the robot's size; the switch is an ample one."""
    size, now = sqrt(leg_length(robot) / LEG), Tempo.of(gait)
    return Tempo(SHORTEST_SWING * size, min(SHORTEST_GAP * size, now.gap), USUAL_SWITCH * size)


def suit_joints(short: Scenario, robot: RobotModel, tempo: Tempo) -> tuple[Tempo, TempoTrial]:
    """The times with tall swings that last as long as joints' speeds ask for, and their trial.

    Args:
        short: The scenario on its short course.
        robot: The scenario's.
        tempo: Times with which no swing lasts longer than others.
    """
    seen = try_tempo(short, robot, tempo)
    if seen.share <= PEAK:
        return tempo, seen
    calm = try_tempo(short, robot, replace(tempo, foot_speed=ANY_SPEED))
    suited = replace(tempo, foot_speed=min(calm.foot_speed, ANY_SPEED))
    return suited, try_tempo(short, robot, suited)


def quicken(
    designed: Designed, robot: RobotModel, wish: Wish, *, source: str = "scenario"
) -> Designed:
    """The designed gait with other times, as is wished for; the same if none are better.

    Args:
        designed: A gait that was found for margin, with its plan.
        robot: The scenario's.
        wish: What it is to be good at.
        source: What an error names.
    """
    course = course_of(designed.scenario, source=source, foot_radius=robot.foot_radius)
    flights = flights_of(course, designed.scenario.gait.deep_tread)
    if not wish.quick or not flights:
        return designed
    tasks = mission_of(designed.scenario, course, source=source)
    kept = wish.least_margin(robot, designed.margin)
    gait = designed.scenario.gait
    before = measure_pace(robot, course, tasks, designed.plan)
    if before.slowest is None or (wish.speed is not None and before.slowest.speed >= wish.speed):
        return designed
    short = short_course(designed.scenario, robot, flights)
    way = tread_way(gait, min(s.run for s in flights))
    tempo = shortest_tempo(gait, robot)
    if wish.speed is not None:  # all the time that there is at that speed
        switch = 0.5 * (way / wish.speed - 4.0 * tempo.swing) - tempo.gap
        tempo = replace(tempo, switch=max(switch, tempo.gap))
    tempo, seen = suit_joints(short, robot, tempo)
    if wish.speed is not None and seen.speed > 0.0:  # longer swings leave less
        late = 0.5 * (way / seen.speed - way / wish.speed)
        if late > 0.0:
            tempo = replace(tempo, switch=max(tempo.switch - late, tempo.gap))
            seen = try_tempo(short, robot, tempo)
    known = {tempo.switch: seen.margin}

    def margin(switch: float) -> float:
        return try_tempo(short, robot, replace(tempo, switch=switch)).margin

    enough = wish.speed is not None and seen.margin >= kept
    switch = tempo.switch
    if not enough:
        switch = seek_switch(margin, switch, tempo.gap, kept, known)
    best, taken, least = designed, inf, WORTH * before.slowest.speed
    for _ in range(TRIES):
        if switch == inf:
            break
        found, pace = plan_tempo(designed, robot, course, replace(tempo, switch=switch), source)
        if pace is not None and pace.slowest is not None and pace.slowest.speed < least:
            break
        if found is None or pace is None or not keeps_enough(found, pace, designed, kept):
            switch = LONGER * switch if taken == inf else 0.5 * (switch + taken)
            if switch > (1.0 - NEAR) * taken:
                break
            continue
        first, best, taken = taken == inf, found, switch
        left = min(found.margin, pace.zmp_margin)
        if enough or not first or left <= (1.0 + 2.0 * CLOSE) * kept:
            break
        like = known[min(known, key=lambda t: abs(t - switch))]  # on the short course
        begin = tempo.gap + (switch - tempo.gap) * (0.4 + 0.6 * kept / left)
        switch = seek_switch(margin, begin, tempo.gap, kept * min(like, kept) / left, known)
        if switch > (1.0 - NEAR) * taken:
            break
    return best


def plan_tempo(
    designed: Designed, robot: RobotModel, course: Course, tempo: Tempo, source: str
) -> tuple[Designed | None, PlanPace | None]:
    """The design with such times, planned on the course itself, and its pace; None without plan.

    Args:
        designed: A gait with its plan.
        robot: The scenario's.
        course: The scenario's.
        tempo: The times.
        source: What an error names.
    """
    scenario = tempo.put(designed.scenario, guard=guard_for(robot))
    try:
        found = plan_design(
            scenario, design=designed.design, robot=robot, shape=link_outline_of(robot),
            course=course, source=source, beat=None,
        )  # fmt: skip
    except PlanningError:
        return None, None
    if found is None:
        return None, None
    tasks = mission_of(scenario, course, source=source)
    return found, measure_pace(robot, course, tasks, found.plan)


def keeps_enough(found: Designed, pace: PlanPace, before: Designed, kept: float) -> bool:
    """Whether a quick plan keeps the margin, and enough of all else that the slow one left.

    Args:
        found: The quick gait.
        pace: Its pace.
        before: The gait that was found for margin.
        kept: The margin that is to be kept [m].
    """
    wanted = before.design.wanted
    room = ROOM_KEPT * min(before.room.weighted, wanted["legs"])
    torque = TORQUE_KEPT * min(before.torque, wanted["torque"])
    least = min(found.margin, pace.zmp_margin)
    quick = pace.peak is None or pace.peak.share <= MOST_PEAK
    return least >= kept and found.room.weighted >= room and found.torque >= torque and quick
