"""What a scenario's values must be: checked once, after loading, by their paths."""

import difflib
import functools
import operator
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from pydrake.systems.analysis import GetIntegrationSchemes

from drake_quad.errors import InputError
from drake_quad.scenario_bounds import NOT_NEGATIVE, POSITIVE, WITHIN, WORDS
from drake_quad.scenario_build import course_of, mission_of
from drake_quad.scenario_check_world import check_disturbances
from drake_quad.scenario_config import MissionElement, Scenario
from drake_quad.stability.kinds import HULL

MULTIPLE_TOLERANCE = 1e-9  # relative: 0.005 is five times 0.001 only up to rounding

LONGEST = 1000.0  # [m] of a stretch of the course, and of all of it
_SHORTEST_STEP = 1e-5  # [s] of the plant: a run of a minute would have millions
_LONGEST_STAND = 600.0  # [s]
_SHORTEST_STAND = 0.1  # [s]
_MOST_TURN = 3600.0  # [deg] of a spin
_SHORTEST_SWING = 0.1  # [s]

_MISSION = {"walk": "distance", "spin": "angle_deg", "stand": "duration"}


def check_scenario(scenario: Scenario, *, source: str) -> None:
    """Raises `InputError` at the first value that no run can have.

    Whether the robot can do what is asked of it is for the planner to say.

    Args:
        scenario: As loaded; its types are right.
        source: What the error names as the holder of the field, the file.
    """
    fail = functools.partial(_fail, scenario, source)
    for path, words in WORDS.items():
        _check_word(path, words, fail, scenario)
    schemes = tuple(GetIntegrationSchemes())
    _check_word("simulation.simulator.integration_scheme", schemes, fail, scenario)
    for path in POSITIVE:
        if not value_at(scenario, path) > 0:
            raise fail(path, "must be more than 0")
    for path in NOT_NEGATIVE:
        if not value_at(scenario, path) >= 0:
            raise fail(path, "must not be negative")
    for path, (least, most) in WITHIN.items():
        if not least <= value_at(scenario, path) <= most:
            raise fail(path, f"must be from {least:g} to {most:g}")
    if 0.0 < scenario.simulation.plant.time_step < _SHORTEST_STEP:
        remedy = f"must be 0, for a plant without steps, or at least {_SHORTEST_STEP:g} s"
        raise fail("simulation.plant.time_step", remedy)
    for i, stretch in enumerate(scenario.course):
        if stretch.length is not None and stretch.length > LONGEST:
            raise InputError(
                source=source,
                field=f"course[{i}].length",
                value=stretch.length,
                remedy=f"must be at most {LONGEST:g} m",
            )
    for path in ("gait.duty_factor", "spin.duty_factor"):
        if not 0.75 <= value_at(scenario, path) < 1.0:
            raise fail(path, "must be in [0.75, 1): with less, three feet do not always stand")
    for gait in ("gait", "spin"):
        swing = (1.0 - value_at(scenario, f"{gait}.duty_factor")) * value_at(
            scenario, f"{gait}.cycle_time"
        )
        if swing < _SHORTEST_SWING:
            raise fail(f"{gait}.duty_factor", f"leaves {swing:.3g} s of the cycle to swing a leg")
    for path in ("transition.wave_order", "transition.spin_order"):
        _check_order(path, fail, scenario)
    if scenario.robot.point_feet and scenario.simulation.mode != "kinematic":
        raise fail("robot.point_feet", "must be false with physics, in which feet have a size")
    if scenario.robot.point_feet and scenario.design == "auto":
        raise fail("robot.point_feet", "must be false with design auto, which is for real feet")
    if scenario.gait.margin != HULL and scenario.body.balance == "dynamic":
        raise fail(
            "gait.margin", "must be hull with body.balance dynamic, which asks for no static margin"
        )
    if scenario.gait.stance_stagger >= scenario.gait.stance_width:
        raise fail("gait.stance_stagger", "must be less than gait.stance_width")
    if scenario.simulation.simulator.target_realtime_rate != 0.0:
        raise fail("simulation.simulator.target_realtime_rate", "say simulation.realtime_rate")
    if scenario.simulation.simulator.start_time != 0.0:
        raise fail("simulation.simulator.start_time", "must be 0: a run begins then")
    for path in ("controller.period", "simulation.log_period"):
        _check_multiple(path, fail, scenario)
    check_disturbances(scenario, source=source)
    for i, element in enumerate(scenario.mission):
        _check_mission(element, f"mission[{i}]", source)
    course = course_of(scenario, source=source)
    whole = sum(lane.length for lane in course.lanes)
    if whole > LONGEST:
        remedy = f"is {whole:g} m long; at most {LONGEST:g} m"
        elements = f"{len(scenario.course)} elements"
        raise InputError(source=source, field="course", value=elements, remedy=remedy)
    length = course.lanes[0].length
    if scenario.start.distance > length:
        raise fail("start.distance", f"must lie on the first lane, {length:g} m long")
    mission_of(scenario, course, source=source)


def value_at(scenario: Scenario, path: str) -> Any:
    """The value at a dotted path, for example `gait.duty_factor`."""
    return operator.attrgetter(path)(scenario)


def _fail(scenario: Scenario, source: str, path: str, remedy: str) -> InputError:
    """The error at a dotted path."""
    value = value_at(scenario, path)
    return InputError(source=source, field=path, value=value, remedy=remedy)


def _check_word(
    path: str, words: Sequence[str], fail: Callable[[str, str], InputError], scenario: Scenario
) -> None:
    """The value must be one of the words."""
    value = value_at(scenario, path)
    if value not in words:
        near = difflib.get_close_matches(value, words, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise fail(path, f"must be {', '.join(words[:-1])} or {words[-1]}{hint}")


def _check_multiple(path: str, fail: Callable[[str, str], InputError], scenario: Scenario) -> None:
    """A period of the loop must be a whole number of the plant's steps, if it has any."""
    step = scenario.simulation.plant.time_step
    if step == 0.0:  # a continuous plant
        return
    ratio = value_at(scenario, path) / step
    if abs(ratio - round(ratio)) > MULTIPLE_TOLERANCE * ratio:
        remedy = f"must be a whole multiple of simulation.plant.time_step, {step:g} s"
        raise fail(path, remedy)


def _check_order(path: str, fail: Callable[[str, str], InputError], scenario: Scenario) -> None:
    """An order of lifts has every leg, none twice in a row, and not too many detours."""
    order = value_at(scenario, path)
    if not order:
        return
    if set(order) != {1, 2, 3, 4}:
        raise fail(path, "must lift each of the legs 1, 2, 3 and 4, and no other")
    if any(a == b for a, b in pairwise(order)):
        raise fail(path, "must not lift a leg twice in a row")
    most = 6 if scenario.transition.mode == "still" else 5
    if len(order) > most:
        mode = scenario.transition.mode
        raise fail(path, f"must have at most {most} lifts with transition.mode {mode}")


def _check_mission(element: MissionElement, path: str, source: str) -> None:
    """One element: its kind, and just the number that belongs to the kind."""

    def error(field: str, remedy: str) -> InputError:
        value = getattr(element, field)
        return InputError(source=source, field=f"{path}.{field}", value=value, remedy=remedy)

    if element.kind not in _MISSION:
        near = difflib.get_close_matches(element.kind, _MISSION, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise error("kind", f"must be walk, spin or stand{hint}")
    own = _MISSION[element.kind]
    for field in _MISSION.values():
        if field != own and getattr(element, field) is not None:
            raise error(field, f"{element.kind} has no {field}; it has {own}")
    if not getattr(element, own):
        raise error(own, f"{element.kind} must say its {own}, other than 0")
    if element.distance is not None and element.distance < 0.0:
        raise error("distance", "must be more than 0 m: the robot walks forward")
    if element.duration is not None and not (_SHORTEST_STAND <= element.duration <= _LONGEST_STAND):
        raise error("duration", f"must be more than 0 s: {_SHORTEST_STAND:g} to {_LONGEST_STAND:g}")
    if element.angle_deg is not None and abs(element.angle_deg) > _MOST_TURN:
        raise error("angle_deg", f"must be at most {_MOST_TURN:g} either way")
