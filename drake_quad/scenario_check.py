"""What a scenario's values must be: checked once, after loading, by their paths."""

import difflib
import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any

from pydrake.systems.analysis import GetIntegrationSchemes

from drake_quad.errors import InputError
from drake_quad.scenario_build import course_of, mission_of
from drake_quad.scenario_check_world import check_disturbances
from drake_quad.scenario_config import MissionElement, Scenario
from drake_quad.stability.kinds import HULL, KINDS

MULTIPLE_TOLERANCE = 1e-9  # relative: 0.005 is five times 0.001 only up to rounding

_WORDS: dict[str, tuple[str, ...]] = {
    "gait.pitch": ("level", "slope"),
    "gait.margin": KINDS,
    "transition.mode": ("still", "shift"),
    "body.path": ("optimised", "uniform"),
    "body.balance": ("static", "dynamic"),
    "controller.kind": ("ik", "whole_body"),
    "estimator.kind": ("truth", "ekf"),
    "design": ("given", "auto"),
    "sensors.noise": ("none", "realistic"),
    "monitor.margins": KINDS,
    "simulation.mode": ("physics", "kinematic"),
    "simulation.plant.contact_model": ("point", "hydroelastic", "hydroelastic_with_fallback"),
    # not tamsi: it ignores the joints' gains without a word, and the robot collapses
    "simulation.plant.discrete_contact_approximation": ("lagged", "similar", "sap"),
    "simulation.plant.contact_surface_representation": ("polygon", "triangle"),
}

_POSITIVE = (
    "gait.cycle_time",
    "gait.stride",
    "gait.stance_length",
    "gait.stance_width",
    "gait.workspace_length",
    "gait.workspace_width",
    "gait.body_height",
    "spin.cycle_time",
    "transition.swing_time",
    "controller.period",
    "controller.friction",
    "controller.height_time",
    "controller.push_speed",
    "simulation.friction",
    "simulation.log_period",
    "simulation.plant.penetration_allowance",
    "simulation.plant.stiction_tolerance",
    "simulation.simulator.max_step_size",
    "simulation.simulator.accuracy",
)

_NOT_NEGATIVE = (
    "certify.margin",
    "certify.clearance",
    "start.distance",
    "gait.switch_wait",
    "gait.stance_stagger",
    "gait.swing_clearance",
    "gait.map_error_place",
    "gait.map_error_height",
    "spin.workspace_length",
    "spin.workspace_width",
    "transition.max_shift",
    "transition.shift_time",
    "body.margin_desired",
    "body.zmp_margin",
    "controller.kp",
    "controller.kd",
    "controller.base_stiffness",
    "controller.base_damping",
    "controller.base_rotation_stiffness",
    "controller.base_rotation_damping",
    "controller.foothold_time",
    "controller.unload_time",
    "controller.load_time",
    "controller.least_force",
    "controller.touchdown_press",
    "controller.search_speed",
    "controller.lift_off_margin",
    "controller.margin_demanded",
    "controller.pressure_margin",
    "controller.patience",
    "simulation.plant.time_step",
    "simulation.plant.sap_near_rigid_threshold",
    "simulation.seed",
    "simulation.realtime_rate",
)

# Values beyond these are slips of the pen, and some would take all memory or never end.
_WITHIN: dict[str, tuple[float, float]] = {
    "gait.cycle_time": (0.5, 120.0),
    "spin.cycle_time": (0.5, 120.0),
    "gait.switch_wait": (0.0, 60.0),
    "gait.stride": (0.05, 5.0),
    "gait.treads": (1, 3),
    "gait.lag": (1, 6),
    "gait.places_per_tread": (1, 3),
    "gait.deep_tread": (0.05, 100.0),
    "gait.body_ahead": (-3.0, 3.0),
    "gait.tread_phase_up": (-0.45, 0.45),
    "gait.tread_phase_down": (-0.45, 0.45),
    "gait.body_shift_up": (-2.0, 2.0),
    "gait.body_shift_down": (-2.0, 2.0),
    "gait.lift_down": (-2.0, 2.0),
    "gait.max_ahead": (0.0, 100.0),
    "gait.shank_room": (0.0, 1.0),
    "gait.pitch_share": (0.0, 1.5),
    "gait.body_height": (0.05, 5.0),
    "transition.swing_time": (0.1, 60.0),
    "transition.shift_time": (0.0, 60.0),
    "controller.period": (1e-4, 0.05),
    "controller.stance_stiffness": (0.0, 1.0),
    "simulation.log_period": (1e-4, 1.0),
    "simulation.plant.time_step": (0.0, 0.01),
}
LONGEST = 1000.0  # [m] of a stretch of the course
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
    for path, words in _WORDS.items():
        _check_word(path, words, fail, scenario)
    schemes = tuple(GetIntegrationSchemes())
    _check_word("simulation.simulator.integration_scheme", schemes, fail, scenario)
    for path in _POSITIVE:
        if not value_at(scenario, path) > 0:
            raise fail(path, "must be more than 0")
    for path in _NOT_NEGATIVE:
        if not value_at(scenario, path) >= 0:
            raise fail(path, "must not be negative")
    for path, (least, most) in _WITHIN.items():
        if not least <= value_at(scenario, path) <= most:
            raise fail(path, f"must be from {least:g} to {most:g}")
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
    if scenario.gait.margin != HULL and scenario.body.balance == "dynamic":
        raise fail(
            "gait.margin", "must be hull with body.balance dynamic, which asks for no static margin"
        )
    if scenario.gait.stance_stagger >= scenario.gait.stance_width:
        raise fail("gait.stance_stagger", "must be less than gait.stance_width")
    if scenario.simulation.simulator.target_realtime_rate != 0.0:
        raise fail("simulation.simulator.target_realtime_rate", "say simulation.realtime_rate")
    for path in ("controller.period", "simulation.log_period"):
        _check_multiple(path, fail, scenario)
    check_disturbances(scenario, source=source)
    for i, element in enumerate(scenario.mission):
        _check_mission(element, f"mission[{i}]", source)
    course = course_of(scenario, source=source)
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
