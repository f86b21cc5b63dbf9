"""Plans the body's path: a program's best path, then within the legs' limits.

`body_path.py` has the program around the path so far.
"""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.math.curves import BodySpline
from drake_quad.planning.body_path import KEPT, BodyPathOptimizer
from drake_quad.planning.body_qp import BROKEN
from drake_quad.planning.body_reference import BodyReference
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.limits_search import keep_limits, keep_limits_from
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.stance_margin import Footing
from drake_quad.robot.model import RobotModel

DYNAMIC_PASSES = 3
FEASIBLE_PASSES = 4  # where the region is that of the posture
PASSES = 2  # the second corrects what `com_gain` leaves of the legs' share by about a millimetre
ROUGH = 1e-3  # [m] by which rows may be broken by a path that is corrected anyway
LINE_PASSES = 2  # in which a path that keeps limits comes back to the line of two feet


def plan_body(
    robot: RobotModel,
    contacts: ContactPlan,
    route: BodyReference,
    settings: PlanSettings,
    footing: Footing | None = None,
    rolled: FloatArray | None = None,
    *,
    beat: float | None = None,
    warm_start: MotionPlan | None = None,
) -> tuple[BodySpline, ContactPlan, float]:
    """Plans the body so that the whole robot's centre of mass keeps the margin.

    Or, if the settings are `dynamic`, its zero-moment point alone.

    Args:
        robot: The robot.
        contacts: Who stands where, when.
        route: Where the body is to be if margins did not matter.
        settings: Gait and body parameters.
        footing: Ground and drives, for the region that the margin is measured in; None: the feet's
            hull.
        rolled: How far the feet have rolled before (4, 2) [m]; None: not at all.
        beat: A margin that is of no interest, as any smaller one [m]; None: any is of interest.
        warm_start: A plan of much the same steps, with the body as high. Where its legs were at
            their limits the search begins with its path, and ends sooner; `beat` and further
            searches are not looked at then. None: it begins with the route.

    Returns:
        The path, the contacts with feet that roll as they do along it, and the smallest static
        margin over the sampled times [m]; if the settings are `dynamic`, the smallest margin of the
        zero-moment point.

    Raises:
        PlanningError: If there is no such path, or if it has no more than the margin to beat even
            before it is bent to the legs' limits.
    """
    begin = np.zeros((4, 2)) if rolled is None else rolled
    search = BodyPathOptimizer(robot, contacts, route, settings, footing, begin)
    if not settings.uniform_body:
        warm = warm_start is not None and search.follow_plan(warm_start)
        if not (warm and _stays_within_limits(search)):
            if warm:
                search = BodyPathOptimizer(robot, contacts, route, settings, footing, begin)
            feasible = footing is not None and footing.drives
            _search(search, settings, feasible=feasible, beat=beat)
        if any(len(phase.steps) > 1 for phase in search.contacts.phases):
            _come_to_line(search)
        search.settle_feet()
    return search.spline, search.contacts, search.margin()


def _search(
    search: BodyPathOptimizer, settings: PlanSettings, *, feasible: bool, beat: float | None
) -> None:
    """Solves the program until the legs' share is right, and then within the legs' limits."""
    passes = DYNAMIC_PASSES if settings.dynamic else FEASIBLE_PASSES if feasible else PASSES
    for k in range(passes):
        search.follow(search.solve(broken=BROKEN if k == passes - 1 else ROUGH))
    if beat is not None and (most := search.margin()) <= beat:
        raise PlanningError(f"another path has a margin of {beat:.3f} m, this one {most:.3f} m")
    keep_limits(search, settings.searches)


def _stays_within_limits(search: BodyPathOptimizer) -> bool:
    """Looks for a path within limits from another plan's on; returns whether it found one."""
    try:
        return keep_limits_from(search)
    except PlanningError:
        return False


def _come_to_line(search: BodyPathOptimizer) -> None:
    """Solves again around a path that keeps limits, whose point is not yet on two feet's line.

    A path within limits lifts and tilts the body, and the program sees what that does to the
    zero-moment point along the path before: the point is left beside where the program had it. The
    nearest path is kept of those that go no further beyond limits.
    """
    short = search.find_limits()
    best, path = search.mean_off_line(), search.control
    for _ in range(LINE_PASSES):
        search.follow(search.solve(broken=BROKEN))
        beyond, off = search.find_limits(), search.mean_off_line()
        if off < best and beyond <= short + KEPT:
            best, path = off, search.control
    if path is not search.control:
        search.follow(path)
