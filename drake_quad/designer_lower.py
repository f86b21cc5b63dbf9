"""Bodies that are lower, and gaits that are slower, where a design cannot be planned as it is."""

import copy
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from drake_quad.designer_plan import POOR, Designed
from drake_quad.errors import PlanningError
from drake_quad.scenario import Scenario

LOWER = (0.0, 0.0075, 0.015, 0.03, 0.06, 0.1)  # of a leg: by which a body is lowered for a plan
ANY_LOWER = LOWER[::2]  # the same where any plan will do
# Heights at which a gait's plan may touch what it must not, before it is given up. A body that is
# lower on stairs is also elsewhere; over a curb it makes no room.
TOUCHES = 6
SLOWER, SLOWEST = 1.1, 3.0  # times as slow as joints' speeds ask for, and at most do


@dataclass(frozen=True, eq=False)
class Gait:
    """A gait to be planned.

    Attributes:
        score: What it is worth on endless stairs.
        scenario: In full, with the body as high as the design has it.
        plan: Makes a `Designed` of such a scenario; see `plan_design`, whose `beat` it takes.
    """

    score: float
    scenario: Scenario
    plan: Callable[..., Designed | None]

    def lower(self, depth: float, like: Scenario) -> Scenario:
        """Like a scenario, with the body so much lower than in this one's [m]."""
        scenario = copy.deepcopy(like)
        scenario.gait.body_height = self.scenario.gait.body_height - depth
        return scenario


def plan_lower(
    gait: Gait, leg: float, best: Designed | None, touches: int = TOUCHES
) -> tuple[Designed | None, PlanningError | None]:
    """The best of what there was and of a gait whose body is as high as it can be, or lower.

    At a flight's ends, and as it sways, the body is not quite where it is on endless stairs: legs
    that are then too short are long enough for a body that is lower. Of a poor plan the next lower
    one is tried, too; below one that is refused then there is none. Nor is there after so many
    plans by which parts touch.

    Args:
        gait: To be planned.
        leg: The legs' length [m].
        best: What there is already.
        touches: Heights at which parts may touch.

    Returns:
        The best, if there is one, and why the first was refused that was.
    """
    refused: PlanningError | None = None
    planned, touched, tried = 0, 0, gait.scenario
    for share in LOWER:
        tried = gait.lower(share * leg, tried)  # with how slow a higher body had to be: so will it
        try:
            best = _or_slower(tried, partial(gait.plan, beat=best)) or best
        except PlanningError as error:
            refused = refused or error
            touched += "room" in error.data or "apart" in error.data
            if planned or touched == touches:
                break
            continue
        planned += 1
        if planned == 2 or (best is not None and best.quality >= POOR):
            break
    return best, refused


def plan_any(gaits: Iterable[Gait], leg: float) -> tuple[Designed | None, PlanningError | None]:
    """The first plan that there is: of all gaits with bodies as high as they can be, then lower.

    Args:
        gaits: To be planned; no more are asked for than are tried.
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
        too_fast = error.data.get("too_fast")
        if too_fast is None or too_fast > SLOWEST:
            raise
        for section in (scenario.gait, scenario.spin):
            section.cycle_time *= SLOWER * too_fast
        for name in ("swing_time", "shift_time"):
            setattr(
                scenario.transition, name, SLOWER * too_fast * getattr(scenario.transition, name)
            )
        return plan(scenario)
