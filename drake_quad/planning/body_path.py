"""The body's path over a contact plan: nominal course, sway for margin, height and pitch."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.body_qp import BROKEN
from drake_quad.planning.body_search import BodySearch
from drake_quad.planning.body_spline import BodySpline
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.footing import Footing
from drake_quad.planning.route import Route
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel

DYNAMIC_PASSES = 3
FEASIBLE_PASSES = 4  # where the region is that of the posture
PASSES = 2  # the second corrects what `com_gain` leaves of the legs' share by about a millimetre
ROUGH = 1e-3  # [m] by which rows may be broken by a path that is corrected anyway
LIMIT_PASSES = 6  # besides, where legs come to their limits
DAMPED = 0.6  # of the way to the next path, in these


def plan_body(
    robot: RobotModel,
    contacts: ContactPlan,
    route: Route,
    settings: PlanSettings,
    footing: Footing | None = None,
    rolled: FloatArray | None = None,
) -> tuple[BodySpline, ContactPlan, float]:
    """Plans the body so that the whole robot's centre of mass keeps the margin.

    Or, if the settings are `dynamic`, its zero-moment point alone.

    Args:
        robot: The robot.
        contacts: Who stands where, when.
        route: Where the body is to be if margins did not matter.
        settings: Gait and body parameters.
        footing: What the margin is measured from; None: the hull of the feet.
        rolled: How far the feet have rolled before (4, 2) [m]; None: not at all.

    Returns:
        The path, the contacts with feet that roll as they do along it, and the smallest static
        margin over the sampled times [m]; if the settings are `dynamic`, the smallest margin of the
        zero-moment point.

    Raises:
        PlanningError: If there is no such path.
    """
    begin = np.zeros((4, 2)) if rolled is None else rolled
    search = BodySearch(robot, contacts, route, settings, footing, begin)
    if not settings.uniform_body:
        _search(search, settings, feasible=footing is not None and footing.drives)
        search.settle_feet()
    return search.spline, search.contacts, search.margin()


def _search(search: BodySearch, settings: PlanSettings, *, feasible: bool) -> None:
    """Solves the program until the legs' share is right, and then within the legs' limits."""
    passes = DYNAMIC_PASSES if settings.dynamic else FEASIBLE_PASSES if feasible else PASSES
    for k in range(passes):
        search.follow(search.solve(broken=BROKEN if k == passes - 1 else ROUGH))
    best, best_path = np.inf, search.control
    for k in range(LIMIT_PASSES + 1):
        short = search.find_limits()
        if short < best:
            best, best_path = short, search.control
        if short == 0.0 or k == LIMIT_PASSES:
            break
        path, before = search.solve(broken=BROKEN), search.control
        if k > 0:  # what holds here need not there: not all the way
            path = before + DAMPED * (path - before)
        search.follow(path)
    if best_path is not search.control:  # it went to and fro
        search.follow(best_path)
