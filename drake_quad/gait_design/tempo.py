"""Chooses a gait's times: of a swing, and of standing on four feet, at switches and else.

A wave gait's cycle is four swings and four stretches on four feet. At two of these, the switches,
the leg that lifts next is diagonal to the one that landed, and the body has to go from one side to
the other: they are what margin costs time for. The joints' speeds say how short a swing can be.
So the swing is as short as joints allow, the two other stretches are short, and the time at the
switches is sought: as short as the margin allows that is to be kept. Every trial is a plan by the
real planner, on a short course with the same steps; what is found is planned on the course itself,
and taken if that keeps what is asked for.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt

import numpy as np

from drake_quad.errors import InputError, PlanningError
from drake_quad.gait_design.candidates import Staircase, flights_of, hip_length
from drake_quad.gait_design.pace import HALF, PER_SWING, PlanPace, joint_speeds, measure_pace
from drake_quad.gait_design.plan_candidates import Designed, plan_design
from drake_quad.planning.contact_plan import sample_times, swing_times
from drake_quad.planning.mission import initial_stance, join_plans, plan_tasks
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario, StartConfig
from drake_quad.scenario.motion_config import GaitConfig
from drake_quad.stability.safety import safe_margin
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

PREFER = ("margin", "balanced", "speed")
KEPT = 0.8  # of the margin of the gait that was found for margin: what `balanced` keeps
LEAST_MARGIN = 0.010  # [m] that `speed` keeps at least
LEG = 1.22  # [m] of the robot that the times below are of; times go with the root of the length
# Times of the quickest gait of the case study that reached its goal in physics (docs/margins.md).
SHORTEST_SWING, SHORTEST_GAP, USUAL_SWITCH = 0.425, 0.2, 0.9  # [s]
PEAK = 0.8  # of a joint's speed limit: what a trial's swings may ask for, and
MOST_PEAK = 0.9  # the plan on the course itself, where a flight begins or ends
ROOM_KEPT, TORQUE_KEPT = 0.8, 0.8  # of what today's plan leaves, where that is less than wanted
SOUGHT = 2.5  # times the margin that a slow gait's path is asked for: quick ones have to seek more
STEPS = 2  # of every flight of the short course
TRIALS = 6  # plans on the short course, at most
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
    """

    swing: float
    gap: float
    switch: float

    @property
    def cycle(self) -> float:
        """How long a cycle lasts [s]."""
        return 4.0 * self.swing + 2.0 * self.gap + 2.0 * self.switch

    @classmethod
    def of(cls, gait: GaitConfig) -> "Tempo":
        """The times of a scenario's gait."""
        swing = (1.0 - gait.duty_factor) * gait.cycle_time
        gap = 0.25 * gait.cycle_time - swing
        return cls(swing, gap, gap + gait.switch_wait)

    def put(self, scenario: Scenario) -> Scenario:
        """The scenario with these times, and a path of the body that seeks more margin."""
        quick = copy.deepcopy(scenario)
        cycle_time = 4.0 * (self.swing + self.gap)
        quick.gait.cycle_time = float(f"{cycle_time:.4g}")
        quick.gait.duty_factor = float(f"{1.0 - self.swing / cycle_time:.5g}")
        quick.gait.switch_wait = float(f"{max(self.switch - self.gap, 0.0):.4g}")
        quick.body.margin_desired = float(f"{SOUGHT * scenario.body.margin_desired:.4g}")
        quick.body.zmp_margin = quick.body.margin_desired
        return quick


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
        tempo: The times.
        margin: The least of its static margins and its zero-moment point's [m].
    """

    tempo: Tempo
    margin: float


def try_tempo(scenario: Scenario, robot: RobotModel, tempo: Tempo) -> TempoTrial:
    """Plans a scenario's walks with such times; without a plan there is no margin."""
    quick = tempo.put(scenario)
    course = course_of(quick, foot_radius=robot.foot_radius)
    settings = plan_settings(quick)
    tasks = [t for t in mission_of(quick, course, source="trial") if t.kind == "walk"]
    stance = initial_stance(robot, course, settings, start=quick.start.distance)
    try:
        plans = list(plan_tasks(robot, course, settings, tasks, stance))
    except PlanningError:
        return TempoTrial(tempo, -inf)
    pace = measure_pace(robot, course, tasks, join_plans(plans, 0.0))
    return TempoTrial(tempo, min(pace.zmp_margin, *(p.margin for p in plans)))


def swing_share(robot: RobotModel, plans: Sequence[MotionPlan]) -> float:
    """The most that walks ask of a joint's speed in their gait's swings, over its limit."""
    most = 0.0
    for plan in plans:
        begin = min((s.start for s in plan.segments if s.kind == "wave"), default=inf)
        times = np.union1d(sample_times(plan.contacts), swing_times(plan.contacts, PER_SWING))
        times = times[(times > begin + HALF) & (times < plan.duration - HALF)]
        if len(times):
            most = max(most, float((joint_speeds(robot, plan, times)[0] / robot.speed).max()))
    return most


def seek_switch(trial: Callable[[float], float], first: float, least: float, kept: float) -> float:
    """The shortest time at switches with which a margin is kept, by secants.

    Args:
        trial: The margin [m] with such a time [s]; it mostly grows with it.
        first: The time to begin with [s].
        least: The shortest that is tried [s].
        kept: The margin that is to be kept [m].

    Returns:
        The shortest that was tried and kept it [s]; infinite if none did.
    """
    seen: dict[float, float] = {}
    best, switch = inf, max(first, least)
    for _ in range(TRIALS):
        seen[switch] = trial(switch) - kept
        if seen[switch] >= 0.0:
            best = min(best, switch)
        low = max((t for t, over in seen.items() if over < 0.0 and t < best), default=None)
        if best <= least or (best < inf and seen[best] <= CLOSE * kept):
            break
        if best == inf:
            switch *= 1.4
        elif low is None:
            switch = max(0.75 * best, least)
        else:  # between them, a little to the safe side
            share = 0.0 if seen[low] == -inf else -seen[low] / (seen[best] - seen[low])
            switch = low + min(max(1.1 * share, 0.25), 0.85) * (best - low)
            if best - low < 0.05 * best:
                break
    return best


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
    walks = [p for p in designed.plan.plans if tasks[p.index].kind == "walk"]
    now, tempo = Tempo.of(gait), sqrt(leg_length(robot) / LEG)
    swing = max(now.swing * swing_share(robot, walks) / PEAK, SHORTEST_SWING * tempo)
    gap = min(SHORTEST_GAP * tempo, now.gap)
    slowest = min(s.run for s in flights)
    enough = inf if wish.speed is None else tread_way(gait, slowest) / wish.speed
    if enough < inf and now.cycle <= enough:
        return designed
    short = short_course(designed.scenario, robot, flights)

    def margin(switch: float) -> float:
        return try_tempo(short, robot, Tempo(swing, gap, switch)).margin

    first = USUAL_SWITCH * tempo
    if enough < inf:  # all the time that there is at that speed
        first = max(0.5 * (enough - 4.0 * swing - 2.0 * gap), gap)
        switch = first if margin(first) >= kept else seek_switch(margin, 1.2 * first, gap, kept)
    else:
        switch = seek_switch(margin, first, gap, kept)
    for _ in range(TRIES if switch < inf else 0):
        chosen = Tempo(swing, gap, switch)
        if chosen.cycle * WORTH > now.cycle:
            break
        found, pace = _plan(designed, robot, course, chosen, source)
        if found is not None and pace is not None and _keeps(found, pace, designed, kept):
            return found
        switch *= LONGER
    return designed


def _plan(
    designed: Designed, robot: RobotModel, course: Course, tempo: Tempo, source: str
) -> tuple[Designed | None, PlanPace | None]:
    """The design with such times, planned on the course itself, and its pace; None without plan."""
    scenario = tempo.put(designed.scenario)
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


def _keeps(found: Designed, pace: PlanPace, before: Designed, kept: float) -> bool:
    """Whether a quick plan keeps the margin, and enough of all else that the slow one left."""
    wanted = before.design.wanted
    room = ROOM_KEPT * min(before.room.weighted, wanted["legs"])
    torque = TORQUE_KEPT * min(before.torque, wanted["torque"])
    least = min(found.margin, pace.zmp_margin)
    quick = pace.peak is None or pace.peak.share <= MOST_PEAK
    return least >= kept and found.room.weighted >= room and found.torque >= torque and quick
