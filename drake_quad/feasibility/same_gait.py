"""Whether a gait that was found for one flight climbs a flight that is built otherwise."""

from dataclasses import replace

from drake_quad.errors import PlanningError
from drake_quad.feasibility.flight import make_stairs_scenario
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.designed import POOR, plan_design
from drake_quad.robot.model import link_outline_of
from drake_quad.scenario.build import course_of
from drake_quad.terrain.elements import Stairs


def check_same_gait(found: Feasibility, stairs: Stairs) -> Feasibility | None:
    """Plans a gait on another flight than the one that it was found for.

    Args:
        found: The answer of `check_flight` for the flight that the gait is of.
        stairs: The other flight.

    Returns:
        The answer with the other flight's plan; None if this gait has no plan on it, or one with
        less than half of the margin, clearance or torque that is wanted.
    """
    designed, robot = found.designed, found.robot
    if designed is None or robot is None:
        return None
    course = make_stairs_scenario(robot, stairs, found.around, model=designed.scenario.robot.model)
    scenario = replace(designed.scenario, course=course.course, description=course.description)
    try:
        again = plan_design(
            scenario, design=designed.design, robot=robot, shape=link_outline_of(robot),
            course=course_of(scenario, source="check", foot_radius=robot.foot_radius),
            source="check", beat=None,
        )  # fmt: skip
    except PlanningError:
        return None
    if again is None or again.quality < POOR:
        return None
    return replace(found, scenario=again.scenario, designed=again, stairs=stairs)
