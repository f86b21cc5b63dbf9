"""Can this robot climb these stairs, or this course? The search for a gait."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from drake_quad.errors import InputError, PlanningError
from drake_quad.feasibility.changes import Case
from drake_quad.feasibility.flight import (
    AS_USUAL,
    Around,
    check_margin_kind,
    check_stairs_numbers,
    make_stairs_scenario,
    wrong_option,
)
from drake_quad.feasibility.result import MOST_MARGIN, Feasibility
from drake_quad.gait_design.designer import design_scenario
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.gait_design.quicken import find_quicker
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs
from drake_quad.util.files import user_path
from drake_quad.util.stopping import Stopping, never


def check_preference(preference: GaitPreference, margin: str) -> None:
    """Makes sure that the preference, and the region of the margin, can be used.

    Raises:
        InputError: The error names the option, its value and what would be right.
    """
    check_margin_kind(margin)
    preference.check()
    if preference.dynamic and margin != HULL:
        remedy = f"give {HULL}: with --balance dynamic no static margin is asked for"
        raise InputError(source="--margin", field="margin", value=margin, remedy=remedy)


def check_flight(
    model: str,
    stairs: Stairs,
    *,
    around: Around = AS_USUAL,
    margin: str = HULL,
    preference: GaitPreference = MOST_MARGIN,
    nearest: bool = True,
    thorough: bool = True,
    robot: RobotModel | None = None,
    note: Callable[[str], object] = lambda _: None,
    stopping: Stopping = never,
) -> Feasibility:
    """Whether a robot climbs a flight up and down.

    Args:
        model: Robot name or file.
        stairs: The flight.
        around: Width, landing and turn.
        margin: Region that the plan's margin is measured in, one of `KINDS`.
        preference: Whether the gait is to be quick, and how much margin it is to keep.
        nearest: Whether a reason says which rise would work; that takes a while.
        thorough: Whether to look for a good gait, or any that a quick search finds.
        robot: The robot of that name, if it is loaded already.
        note: Receives a line about what is being done.
        stopping: Entered while a quicker gait is looked for; says whether the best so far will do.

    Raises:
        InputError: If the robot cannot be used, or there are no such stairs.
    """
    check_stairs_numbers(stairs, around)
    check_preference(preference, margin)
    robot = robot or load_robot(model)
    scenario = make_stairs_scenario(robot, stairs, around, model=_whole_path(model))
    scenario.gait.margin = margin
    try:
        found = _design(
            scenario,
            robot,
            source="check",
            preference=preference,
            nearest=nearest,
            thorough=thorough,
            note=note,
            stopping=stopping,
        )
    except InputError as error:
        # The course's fields are the options' here.
        name = error.field.rpartition(".")[2] if error.field.startswith("course") else ""
        name = "landing" if name == "length" and around.landing is not None else name
        if name not in ("rise", "run", "count", "overhang", "width", "landing"):
            raise
        raise wrong_option(name, error.value, error.remedy) from None
    quick_margin = partial(_quick_margin, scenario.robot.model, around, margin)
    return replace(found, stairs=stairs, around=around, quick_margin=quick_margin)


def _quick_margin(model: str, around: Around, margin: str, case: Case) -> float | None:
    """Static margin of a plan that a quick search finds [m]; None if it finds none."""
    try:
        return check_flight(
            model, case.stairs, around=replace(around, landing=case.landing), margin=margin,
            nearest=False, thorough=False, robot=case.robot,
        ).margin  # fmt: skip
    except InputError:  # no such stairs can be built, or they are too shallow for the feet
        return None


def design_for_course(
    model: str,
    scenario: str | Scenario,
    *,
    margin: str = HULL,
    preference: GaitPreference = MOST_MARGIN,
    nearest: bool = True,
    note: Callable[[str], object] = lambda _: None,
    stopping: Stopping = never,
) -> Feasibility:
    """Whether a robot climbs the course of a scenario, with a gait of its own.

    Args:
        model: Robot name or file.
        scenario: A scenario, or a shipped one's name or a file; its robot and its gait do not
            count.
        margin: Region that the plan's margin is measured in, one of `KINDS`.
        preference: Whether the gait is to be quick, and how much margin it is to keep.
        nearest: Whether a reason says which rise would work; that takes a while.
        note: Receives a line about what is being done.
        stopping: Entered while a quicker gait is looked for; says whether the best so far will do.

    Raises:
        InputError: If robot or scenario cannot be used.
    """
    check_preference(preference, margin)
    robot = load_robot(model)
    name = "scenario" if isinstance(scenario, Scenario) else scenario
    given = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    asked = Scenario(
        description=f"{robot.name} on the course of {Path(name).name}",
        course=given.course,
        mission=given.mission,
        start=given.start,
        world=given.world,
        simulation=given.simulation,
        design="auto",
    )
    asked.robot.model = _whole_path(model)
    asked.gait.margin = margin
    return _design(
        asked, robot, source=name, preference=preference, nearest=nearest, note=note,
        stopping=stopping,
    )  # fmt: skip


def _design(
    scenario: Scenario,
    robot: RobotModel,
    *,
    source: str,
    preference: GaitPreference,
    nearest: bool,
    thorough: bool = True,
    note: Callable[[str], object],
    stopping: Stopping,
) -> Feasibility:
    """Designs a gait for a scenario, and its times as is preferred, or says why there is none.

    Raises:
        InputError: If robot or scenario cannot be used; it names `source`.
    """
    try:
        designed = design_scenario(
            scenario, source=source, nearest=nearest, thorough=thorough, robot=robot, note=note
        )
    except PlanningError as error:
        return Feasibility(
            scenario, None, error.reason, dict(error.data), robot, preference=preference
        )
    if not preference.quick:
        return Feasibility(
            designed.scenario, designed, "", {}, robot, preference=preference, slow=designed
        )
    begun, slow = f"found a gait that keeps {1e3 * designed.margin:.0f} mm of margin", designed
    with stopping() as stop:
        note(f"{begun}; looking for a quicker one")
        designed = find_quicker(
            slow, robot, preference, source=source, note=lambda words: note(f"{begun}; {words}"),
            stop=stop,
        )  # fmt: skip
        stopped = stop()
    return Feasibility(
        designed.scenario, designed, "", {}, robot, preference=preference, slow=slow,
        stopped=stopped,
    )  # fmt: skip


def _whole_path(model: str) -> str:
    """A robot's file by its whole path, so that a scenario can be saved anywhere; names stay."""
    path = user_path(model)
    return str(path.resolve()) if "://" not in model and path.is_file() else model
