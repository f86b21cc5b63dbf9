"""Plans candidate gaits on the real course, lowered and slowed where that is needed."""

import copy
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

from drake_quad.errors import PlanningError
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.designed import GOOD_MARGIN, LEFT_OVER, POOR, Designed
from drake_quad.gait_design.doubts import find_doubt
from drake_quad.planning.mission import how_much_slower
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.course import Course

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
