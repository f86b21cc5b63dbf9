"""Bodies that are lower, and gaits that are slower, where a design cannot be planned as it is."""

import copy
from collections.abc import Callable
from functools import partial

from drake_quad.designer_plan import POOR, Designed
from drake_quad.errors import PlanningError
from drake_quad.scenario import Scenario

LOWER = (0.0, 0.0075, 0.015, 0.03, 0.06, 0.1)  # of a leg: by which a body is lowered for a plan
# Heights at which a gait's plan may touch what it must not, before it is given up. A body that is
# lower on stairs is also elsewhere; over a curb it makes no room.
TOUCHES = 6
SLOWER, SLOWEST = 1.1, 3.0  # times as slow as joints' speeds ask for, and at most do


def plan_lower(
    scenario: Scenario,
    plan: Callable[..., Designed | None],
    leg: float,
    best: Designed | None,
    touches: int = TOUCHES,
) -> tuple[Designed | None, PlanningError | None]:
    """The best of what there was and of a design whose body is as high as it can be, or lower.

    At a flight's ends, and as it sways, the body is not quite where it is on endless stairs: legs
    that are then too short are long enough for a body that is lower. Of a poor plan the next lower
    one is tried, too; below one that is refused then there is none. Nor is there after so many
    plans by which parts touch.

    Args:
        scenario: In full, with the body as high as the design has it.
        plan: Makes a `Designed` of a scenario; see `plan_design`, whose `beat` it takes.
        leg: The legs' length [m].
        best: What there is already.
        touches: Heights at which parts may touch.

    Returns:
        The best, if there is one, and why the first was refused that was.
    """
    refused: PlanningError | None = None
    planned, touched, tried = 0, 0, scenario
    for share in LOWER:
        tried = copy.deepcopy(tried)  # with it how slow a higher body had to be: so will this
        tried.gait.body_height = scenario.gait.body_height - share * leg
        try:
            best = _or_slower(tried, partial(plan, beat=best)) or best
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
