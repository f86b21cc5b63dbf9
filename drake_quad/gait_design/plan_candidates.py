"""Plans candidate gaits on the real course, lowered and slowed where that is needed."""

import copy
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

from drake_quad.errors import PlanningError
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.doubts import find_doubt
from drake_quad.planning.clearance import (
    Clearance,
    check_self_collision,
    check_thighs,
    find_clearance,
)
from drake_quad.planning.contact_forces import torque_ratio
from drake_quad.planning.contact_plan import swing_times
from drake_quad.planning.mission import (
    MissionPlan,
    check_plan,
    check_slopes,
    check_torques,
    how_much_slower,
    initial_stance,
    join_plans,
    plan_tasks,
)
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.robot.model import LinkOutline, RobotModel
from drake_quad.scenario.build import mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.course import Course

GOOD_MARGIN = 0.6  # of the margin desired: with that, and with
GOOD_CLEARANCE = 0.8  # of the clearance wanted, a gait is as good as any
GOOD_TORQUE = 0.8  # of the torque to spare that is wanted, the same
FAIR_MARGIN = 0.8  # of the margin wanted on endless stairs: with less, lower bodies are tried, too
POOR = 0.5  # quality below which the next lower body is tried, too, and a more thorough search
THIGHS_EVERY = 2  # so many are looked at for thighs
TORQUE_EVERY = 4  # so many samples of a plan are looked at for torques
PER_SWING = 24  # moments of every swing that are looked at: shanks pass nosings in a tenth of one
LEFT_OVER = 1.1  # of the margin that the gait clock demands: what a plan keeps is kept nearly


@dataclass(frozen=True, eq=False)
class Designed:
    """A scenario with its gait filled in.

    Attributes:
        scenario: The scenario in full.
        design: The gait and its slacks on endless stairs.
        plan: The plan of the whole mission on paper.
        margin: The plan's least margin [m].
        clearance: The plan's least clearance between robot and course.
        torque: Smallest remaining fraction of any joint's torque limit when standing still;
            negative if the controllers' default load sharing exceeds a limit. They may share the
            load otherwise: what no sharing allows `check_torques` refuses.
    """

    scenario: Scenario
    design: Design
    plan: MissionPlan
    margin: float
    clearance: Clearance
    torque: float

    @property
    def has_margin(self) -> bool:
        """Whether the plan's margin is no less than what is wanted of a gait on endless stairs."""
        return self.margin >= self.design.wanted["margin"]

    @property
    def is_fair(self) -> bool:
        """Whether it is good enough that no gait is tried with a lower body."""
        return self.quality >= POOR and self.margin >= FAIR_MARGIN * self.design.wanted["margin"]

    @property
    def quality(self) -> float:
        """The least share of what is wanted of margin, clearance and torque, at most 1."""
        return _quality(self.scenario, self.design, self.margin, self.clearance, self.torque)


def plan_design(
    scenario: Scenario,
    *,
    design: Design,
    robot: RobotModel,
    shape: LinkOutline,
    course: Course,
    source: str,
    beat: Designed | None,
) -> Designed | None:
    """Plans a scenario in full; None as soon as it is no better than another.

    Args:
        scenario: With the design's fields filled in.
        design: The gait, and the slacks wanted of it.
        robot: The scenario's.
        shape: The robot's outline.
        course: The scenario's course.
        source: What an error names.
        beat: The other, if there is one.

    Raises:
        PlanningError: If there is no plan, or one that touches the stairs with more than feet.
    """
    settings = plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    tasks = mission_of(scenario, course, source=source)
    begun, plans, ground = time.perf_counter(), [], slopes_of(course, settings.friction)
    clearance, margin, torque = Clearance(inf, inf, "", "", 0.0), inf, 1.0
    for plan in plan_tasks(robot, course, settings, tasks, stance):
        task = tasks[plan.index]
        samples = check_plan(robot, plan, dynamic=settings.dynamic)
        check_slopes(course, plan, settings.friction)
        swings = evaluate(robot, plan, swing_times(plan.contacts, PER_SWING))
        here = find_clearance(robot, shape, course, [task, task], [samples, swings])
        if here.distance <= 0.0:
            raise PlanningError(
                f"{here.part} would be {-here.distance:.3f} m inside the stairs at "
                f"{here.time:.1f} s of '{here.task}'",
                room=here.distance,
            )
        clearance = min(clearance, here, key=lambda r: r.weighted)
        if plan.margin == plan.margin:  # standing still has none
            _refuse_waiting(scenario, task.name, plan.margin)
            margin = min(margin, plan.margin)
        check_thighs(robot, course, task, samples.every(THIGHS_EVERY))
        check_self_collision(robot, task, samples)
        check_self_collision(robot, task, swings)
        seen = samples.every(TORQUE_EVERY)
        here_left = 1.0 - float(torque_ratio(robot, seen, ground=ground).max())
        if here_left < 0.0:
            check_torques(robot, plan, samples, ground)
        torque = min(torque, here_left)
        plans.append(plan)
        if (
            beat is not None
            and _quality(scenario, design, margin, clearance, torque) <= beat.quality
        ):
            return None
    mission = join_plans(plans, time.perf_counter() - begun, dynamic=settings.dynamic)
    return Designed(scenario, design, mission, margin if margin < inf else 0.0, clearance, torque)


SURE = 0.6  # score on endless stairs from which on a gait is planned at once
SHANKS = 0.5  # of their clearance wanted: a gait that is short of more would hardly be fair


def doubt_gait(
    scenario: Scenario, *, design: Design, robot: RobotModel, course: Course, source: str
) -> PlanningError | None:
    """Why a scenario will hardly have a plan that is not poor; None if nothing speaks against it.

    Args:
        scenario: With the design's fields filled in.
        design: The gait, and the slacks wanted of it.
        robot: The scenario's.
        course: The scenario's course.
        source: What an error names.
    """
    if design.score >= SURE:
        return None
    fair = POOR * GOOD_MARGIN * scenario.body.margin_desired
    return find_doubt(
        robot, course, plan_settings(scenario), mission_of(scenario, course, source=source),
        start=scenario.start.distance,
        margin=max(fair, LEFT_OVER * scenario.controller.lift_off_margin),
        shanks=SHANKS * design.wanted["legs"],
    )  # fmt: skip


def _refuse_waiting(scenario: Scenario, task: str, margin: float) -> None:
    """Refuses a plan by which the gait clock would wait at a lift-off, and then stop.

    Raises:
        PlanningError: With the margin that there is, and the one that there has to be.
    """
    least = scenario.controller.lift_off_margin
    if margin < LEFT_OVER * least:
        raise PlanningError(
            f"the static margin would be {margin:.3f} m in '{task}', and no foot is lifted with "
            f"less than {least:.3f} m",
            margin=margin,
        )


def _quality(
    scenario: Scenario, design: Design, margin: float, clearance: Clearance, torque: float
) -> float:
    """See Designed; of the tasks that are planned, more can only make it less."""
    wanted = design.wanted
    return min(
        1.0,
        margin / (GOOD_MARGIN * scenario.body.margin_desired),
        clearance.weighted / (GOOD_CLEARANCE * wanted["legs"]),
        torque / (GOOD_TORQUE * wanted["torque"]),
    )


LOWER = (0.0, 0.0075, 0.015, 0.03, 0.06, 0.1)  # of a leg: by which a body is lowered for a plan
ANY_LOWER = LOWER[::2]  # the same where any plan will do
# Heights at which a gait's plan may touch what it must not, before it is given up. A body that is
# lower on stairs is also elsewhere; over a curb it does not help.
TOUCHES = 6


@dataclass(frozen=True, eq=False)
class Gait:
    """A gait to be planned.

    Attributes:
        score: Its score on endless stairs.
        scenario: Scenario in full, with the body as high as the design has it.
        plan: Makes a `Designed` of such a scenario; see `plan_design`, whose `beat` it takes.
        doubt: Says why there will hardly be a plan, see `doubt_gait`.
    """

    score: float
    scenario: Scenario
    plan: Callable[..., Designed | None]
    doubt: Callable[[Scenario], PlanningError | None] = lambda _: None

    def lower(self, depth: float, like: Scenario) -> Scenario:
        """Like a scenario, with the body so much lower than in this one's [m]."""
        scenario = copy.deepcopy(like)
        scenario.gait.body_height = self.scenario.gait.body_height - depth
        return scenario


class Lowering:
    """Plans a gait with its body as high as it can be, and then lower, at each call.

    At a flight's ends, and as it sways, the body is not quite where it is on endless stairs: legs
    that are then too short are long enough for a body that is lower. Of a poor plan the next lower
    one is tried, too; below one that is refused then there is none. Nor is there after so many
    plans by which parts touch. Heights that are doubtful are put off.

    Attributes:
        refused: Why the first plan was refused that was.
    """

    def __init__(self, gait: Gait, leg: float, touches: int = TOUCHES) -> None:
        """Takes the gait.

        Args:
            gait: Gait to plan.
            leg: The legs' length [m].
            touches: Heights at which parts may touch.
        """
        self._gait, self._leg, self._touches = gait, leg, touches
        self._heights = list(LOWER)
        self._put_off: list[float] | None = []  # None: no height is put off any more
        self._planned = self._touched = 0
        self._tried = gait.scenario
        self.refused: PlanningError | None = None

    @property
    def done(self) -> bool:
        """Whether no lower body is to be tried."""
        return not self._heights

    def take_up(self) -> None:
        """Has the heights tried that were put off."""
        self._heights, self._put_off = self._put_off or [], None

    def plan(self, best: Designed | None) -> Designed | None:
        """The better one of what there is already and of the next plan; or the height is put off.

        Args:
            best: What there is already.
        """
        share = self._heights.pop(0)
        # With how slow a higher body had to be: so will it.
        lower = self._gait.lower(share * self._leg, self._tried)
        if self._put_off is not None and self._gait.doubt(lower) is not None:
            self._put_off.append(share)
            return best
        self._tried = lower
        try:
            best = _or_slower(self._tried, partial(self._gait.plan, beat=best)) or best
        except PlanningError as error:
            self.refused = self.refused or error
            self._touched += "room" in error.data or "apart" in error.data
            if self._planned or self._touched == self._touches:
                self._heights.clear()
            return best
        self._planned += 1
        if self._planned == 2:
            self._heights.clear()
        return best


def plan_gaits(
    gaits: Iterable[Gait],
    leg: float,
    best: Designed | None,
    *,
    touches: int = TOUCHES,
    taken: Callable[[Designed], bool] = lambda _: False,
) -> tuple[Designed | None, PlanningError | None]:
    """The best of what there was and of gaits: each as high as it can be, and then all lower.

    Lower bodies are tried only where there is no fair plan, and doubtful ones after all others. A
    gait of which no more can be hoped for than there is already is not tried.

    Args:
        gaits: Gaits to be planned; no more are drawn than are tried.
        leg: The legs' length [m].
        best: What there is already.
        touches: Heights at which parts of a gait may touch.
        taken: Whether a plan is so good that no other is tried.

    Returns:
        The best, if there is one, and why the first was refused that was.
    """
    tried: list[Lowering] = []
    for gait in gaits:
        if best is not None and best.quality >= max(POOR, gait.score):
            continue  # smaller slacks on endless stairs mostly mean a worse plan
        tried.append(Lowering(gait, leg, touches))
        best = tried[-1].plan(best)
        if best is not None and taken(best):
            break
    best = _lower_all(tried, best)
    if best is None or not best.is_fair:
        for lowering in tried:
            lowering.take_up()
        best = _lower_all(tried, best)
    return best, next((t.refused for t in tried if t.refused is not None), None)


def _lower_all(tried: Sequence[Lowering], best: Designed | None) -> Designed | None:
    """The better one of what there is already and of lower bodies, until one's plan is fair."""
    while best is None or not best.is_fair:
        left = [lowering for lowering in tried if not lowering.done]
        if not left:
            break
        for lowering in left:
            best = lowering.plan(best)
            if best is not None and best.is_fair:
                break
    return best


def plan_any(gaits: Iterable[Gait], leg: float) -> tuple[Designed | None, PlanningError | None]:
    """The first plan that there is: of all gaits with bodies as high as they can be, then lower.

    Doubtful ones are left out.

    Args:
        gaits: Gaits to be planned; no more are drawn than are tried.
        leg: The legs' length [m].

    Returns:
        The plan, if there is one, and why the first was refused that was.
    """
    refused: PlanningError | None = None
    seen: list[Gait] = []
    for share in ANY_LOWER:
        for gait in tuple(seen) if seen else gaits:
            if share == 0.0:
                seen.append(gait)
            try:
                lower = gait.lower(share * leg, gait.scenario)
                doubt = gait.doubt(lower)
                if doubt is not None:
                    raise doubt
                return _or_slower(lower, partial(gait.plan, beat=None)), refused
            except PlanningError as error:
                refused = refused or error
    return None, refused


def _or_slower(scenario: Scenario, plan: Callable[[Scenario], Designed | None]) -> Designed | None:
    """What `plan` makes of a scenario; of it slower, if joints would turn faster than they can.

    Raises:
        PlanningError: As `plan`.
    """
    try:
        return plan(scenario)
    except PlanningError as error:
        factor = how_much_slower(error)
        if factor is None:
            raise
        for section in (scenario.gait, scenario.spin):
            section.cycle_time *= factor
        for name in ("swing_time", "shift_time"):
            setattr(scenario.transition, name, factor * getattr(scenario.transition, name))
        return plan(scenario)
