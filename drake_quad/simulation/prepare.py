"""Makes a scenario into the values that planning and simulation take."""

import copy
from dataclasses import replace

from drake_quad.errors import DrakeQuadError, InputError, PlanningError
from drake_quad.gait_design.quicken import design_preferred
from drake_quad.planning.mission import (
    check_lift_offs,
    check_mission,
    check_slopes,
    check_torques,
    initial_stance,
    plan_mission,
)
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.onward import why_not
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.stance_margin import slopes_of
from drake_quad.robot.digest import robot_digest
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import (
    course_of,
    disturbances_of,
    mission_of,
    plan_settings,
    robot_of,
    world_of,
)
from drake_quad.scenario.config import Scenario
from drake_quad.simulation.eyes import check_mount
from drake_quad.simulation.look import look_around
from drake_quad.simulation.prepare_seen import (
    blind_scenario,
    floor_underfoot,
    plan_on_sight,
    stay,
)
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.terrain.course import Course

__all__ = ["PreparedScenario", "judge_plan", "prepare"]

LOW_RISE = 0.005  # [m]


def prepare(scenario: Scenario, *, source: str = "scenario") -> PreparedScenario:
    """Reads the robot, lays the course and plans the whole mission on paper.

    With `perception.map: seen` the robot stands and looks before that, in a simulation.

    Args:
        scenario: Scenario, loaded and checked.
        source: Name of the file, for errors.

    Raises:
        InputError: If something in the scenario cannot be, or is out of the robot's reach.
        PlanningError: If there is no plan for another reason.
        MachineError: If it is to look, and this machine cannot render.
    """
    if scenario.perception.map == "seen":
        return _prepare_seen(scenario, source=source)
    return _prepare_told(scenario, source=source)


def _prepare_told(
    scenario: Scenario, course: Course | None = None, *, source: str
) -> PreparedScenario:
    """As `prepare`, of a map that is told: `course`, or the scenario's."""
    if scenario.design == "auto":
        scenario = design_preferred(scenario, source=source).scenario
    robot, course, settings, tasks, stance = _values(scenario, course, source=source)
    if scenario.estimator.landmarks != "none":
        check_mount(scenario.perception, robot, source=source)
    world = world_of(scenario, course, source=source)
    disturbances = disturbances_of(scenario, robot, source=source)
    try:
        plan = plan_mission(robot, course, settings, tasks, stance)
        check_mission(robot, plan, uniform_body=settings.uniform_body)
    except PlanningError as error:
        raise _blame(scenario, error, source=source) from None
    return PreparedScenario(
        scenario, robot, course, settings, tasks, stance, plan, world, disturbances,
        robot_digest=robot_digest(scenario.robot.model),
    )  # fmt: skip


def _prepare_seen(scenario: Scenario, *, source: str) -> PreparedScenario:
    """As `prepare`, on a map of what is seen; where there is no climb of it, the robot stays."""
    radius = robot_of(scenario).foot_radius
    floor = floor_underfoot(scenario, foot_radius=radius)
    blind = _prepare_told(blind_scenario(scenario), floor, source=source)
    check_mount(scenario.perception, blind.robot, source=source)
    course = course_of(scenario, source=source, foot_radius=radius)
    blind = replace(blind, world=world_of(scenario, course, source=source))
    sight = look_around(blind)
    try:
        planned = plan_on_sight(scenario, blind, sight, source=source)
        judge_plan(planned)
    except DrakeQuadError as error:
        return stay(scenario, blind, sight, why_not(error))
    return planned


def judge_plan(p: PreparedScenario) -> None:
    """Checks that a prepared plan can be carried out: by the gait's clock, and by the joints.

    What can be planned at all `prepare` has seen to, and a run may try it. The paper's own path,
    which has no margin, is judged by neither; a dynamic one is lifted off without a static margin.

    Raises:
        PlanningError: With the least margin and the clock's, the joint and its torque, or a slope
            and the friction that it takes; or why the robot does not climb what it has seen.
    """
    if p.sight is not None and p.sight.refused:
        raise PlanningError(p.sight.refused)
    if p.settings.uniform_body:
        return
    control = p.scenario.controller
    for plan, samples in zip(p.plan.plans, check_mission(p.robot, p.plan), strict=True):
        if not p.settings.dynamic:
            check_lift_offs(
                plan, samples, control.lift_off_margin, demanded=control.margin_demanded
            )
        check_slopes(p.course, plan, p.settings.friction)
        check_torques(p.robot, plan, samples, slopes_of(p.course, p.settings.friction))


def _values(
    scenario: Scenario, course: Course | None = None, *, source: str
) -> tuple[RobotModel, Course, PlanSettings, tuple[Task, ...], Stance]:
    robot = robot_of(scenario)
    if course is None:
        course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    settings = plan_settings(scenario)
    tasks = mission_of(scenario, course, source=source)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    return robot, course, settings, tasks, stance


def _blame(scenario: Scenario, error: PlanningError, *, source: str) -> DrakeQuadError:
    """The scenario's field behind a plan that the legs cannot follow, if there is one."""
    if "excess" not in error.data:
        return error
    flights = [
        (max(e.rises or [e.rise or 0.0]), k)
        for k, e in enumerate(scenario.course)
        if e.kind == "stairs"
    ]
    if flights and _works_on_low_steps(scenario):
        rise, k = max(flights)
        name = "rises" if scenario.course[k].rises else "rise"
        return InputError(
            source=source,
            field=f"course[{k}].{name}",
            value=rise,
            remedy=f"out of the robot's reach: {error.reason}; take a lower rise",
        )
    return InputError(
        source=source,
        field="gait.body_height",
        value=scenario.gait.body_height,
        remedy=f"out of the robot's reach: {error.reason}; take another body height, a "
        "shorter stride, or `design: auto`, with which a gait is designed for the robot",
    )


def _works_on_low_steps(scenario: Scenario) -> bool:
    """Whether the same mission can be carried out if every rise is next to nothing."""
    low = copy.deepcopy(scenario)
    for element in low.course:
        if element.kind == "stairs":
            if element.rises:
                element.rises = [LOW_RISE] * len(element.rises)
            else:
                element.rise = LOW_RISE
    try:
        robot, course, settings, tasks, stance = _values(low, source="scenario")
        check_mission(robot, plan_mission(robot, course, settings, tasks, stance))
    except DrakeQuadError as error:
        return not (isinstance(error, PlanningError) and "excess" in error.data)
    return True
