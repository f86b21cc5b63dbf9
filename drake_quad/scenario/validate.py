"""Checks of a scenario that need more than a field's type."""

import difflib
import functools
import math
import operator
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from pydrake.systems.analysis import GetIntegrationSchemes

from drake_quad.errors import InputError
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import MissionElement, MotorStrengthConfig, PushConfig, Scenario
from drake_quad.stability.equilibrium_region import HULL, KINDS

# ------------------------------------------------------------------------------------------------
# What disturbances and the world's errors must be, by their paths.
# ------------------------------------------------------------------------------------------------


_LONGEST_PUSH = 10.0  # [s]
_HARDEST_PUSH = 10.0  # [m/s]
_MOST_FORCE = 1e5  # [N] along each axis
_LONGEST_DELAY = 1.0  # [s]
_HEAVIEST = 1000.0  # [kg]
_MASS_FACTORS = (0.2, 5.0)
_FARTHEST = 2.0  # [m] of a payload, a centre of mass or a push's point from the trunk's middle
_MOST_ERROR = {
    "rise_error": 0.1,
    "run_error": 0.1,
    "position_error": 1.0,
    "tread_error": 0.1,
    "yaw_error_deg": 20.0,
}
WHOLE = 1e-6  # relative: 0.004 is four times 0.001 only up to rounding


def check_disturbances(scenario: Scenario, *, source: str) -> None:
    """Raises `InputError` at the first value that no run can have.

    Whether the robot has a joint or a body of that name is seen when the robot is read.

    Args:
        scenario: As loaded; its types are right, and so is the rest of it.
        source: What the error names as the holder of the field, the file.
    """
    given, step = scenario.disturbances, scenario.simulation.plant.time_step
    for i, push in enumerate(given.pushes):
        _Checker(push, f"disturbances.pushes[{i}]", source).check_push(push)
    payload = _Checker(given.payload, "disturbances.payload", source)
    payload.within("mass", 0.0, _HEAVIEST)
    for part, path in ((given.payload, "payload"), (given.com_offset, "com_offset")):
        for axis in "xyz":
            _Checker(part, f"disturbances.{path}", source).within(axis, -_FARTHEST, _FARTHEST)
    seen: set[str] = set()
    for i, motor in enumerate(given.motor_strength):
        checker = _Checker(motor, f"disturbances.motor_strength[{i}]", source)
        checker.check_motor(motor)
        if motor.joint in seen:
            raise checker.error("joint", "is given twice")
        seen.add(motor.joint)
    _Checker(given, "disturbances", source).within("mass_factor", *_MASS_FACTORS)
    for name in ("sensor_delay", "command_delay"):
        checker = _Checker(given, "disturbances", source)
        checker.within(name, 0.0, _LONGEST_DELAY)
        checker.check_whole(name, step)
    for name, most in _MOST_ERROR.items():
        least = 0.0 if name == "tread_error" else -most
        _Checker(scenario.world, "world", source).within(name, least, most)


class _Checker:
    """Checks the fields of one mapping."""

    def __init__(self, holder: Any, path: str, source: str) -> None:
        self.holder, self.path, self.source = holder, path, source

    def error(self, field: str, remedy: str) -> InputError:
        """The error at `field`."""
        value = getattr(self.holder, field)
        path = f"{self.path}.{field}"
        return InputError(source=self.source, field=path, value=value, remedy=remedy)

    def within(self, field: str, least: float, most: float) -> None:
        """The value must be from `least` to `most`."""
        if not least <= getattr(self.holder, field) <= most:
            raise self.error(field, f"must be from {least:g} to {most:g}")

    def check_whole(self, field: str, step: float) -> None:
        """A delay must be a whole number of the plant's steps."""
        delay = getattr(self.holder, field)
        if delay == 0.0:
            return
        if step == 0.0:
            raise self.error(field, "needs a plant in steps: give simulation.plant.time_step")
        steps = delay / step
        if round(steps) < 1 or abs(steps - round(steps)) > WHOLE * steps:
            raise self.error(
                field, f"must be a whole multiple of simulation.plant.time_step, {step:g} s"
            )

    def check_push(self, push: PushConfig) -> None:
        """A push says when, and how hard in just one way."""
        if push.time is None:
            raise self.error("time", "a push must say its time")
        if push.time < 0.0:
            raise self.error("time", "must not be negative")
        if not 0.0 < push.duration <= _LONGEST_PUSH:
            raise self.error("duration", f"must be more than 0 s, {_LONGEST_PUSH:g} s at most")
        if push.speed is None and push.force is None:
            raise self.error("speed", "a push must say its speed or its force")
        if push.force is not None:
            for name in ("speed", "direction_deg"):
                if getattr(push, name) is not None:
                    raise self.error(name, "say speed and direction_deg, or force, not both")
        elif push.speed is not None and not 0.0 < push.speed <= _HARDEST_PUSH:
            raise self.error("speed", f"must be more than 0 m/s, {_HARDEST_PUSH:g} m/s at most")
        for name in ("force", "point"):
            vector = getattr(push, name)
            if vector is not None and len(vector) != 3:
                raise self.error(name, "must be three numbers: x, y, z")
        for name, most in (("force", _MOST_FORCE), ("point", _FARTHEST)):
            if max(map(abs, getattr(push, name) or [0.0])) > most:
                unit = "N" if name == "force" else "m"
                raise self.error(name, f"must be within {most:g} {unit} along each axis")
        if push.force is not None and math.hypot(*push.force) == 0.0:
            raise self.error("force", "must not be zero")

    def check_motor(self, motor: MotorStrengthConfig) -> None:
        """A weak drive says which and how weak."""
        if not motor.joint:
            raise self.error("joint", "must say which joint")
        if motor.factor is None:
            raise self.error("factor", f"{motor.joint} must say its factor")
        self.within("factor", 0.0, 1.0)


# ------------------------------------------------------------------------------------------------
# Which words and numbers a scenario's fields may have, by their paths.
# ------------------------------------------------------------------------------------------------


WORDS: dict[str, tuple[str, ...]] = {
    "gait.pitch": ("level", "slope"),
    "gait.margin": KINDS,
    "spin.swing_path": ("chord", "arc"),
    "transition.mode": ("still", "shift"),
    "body.path": ("optimised", "uniform"),
    "body.balance": ("static", "dynamic"),
    "controller.kind": ("ik", "whole_body"),
    "estimator.kind": ("truth", "ekf"),
    "design": ("given", "auto"),
    "sensors.noise": ("none", "realistic"),
    "monitor.margins": KINDS,
    "simulation.mode": ("physics", "kinematic"),
    # not hydroelastic alone: only feet and ground have what it needs, all else would end the run
    "simulation.plant.contact_model": ("point", "hydroelastic_with_fallback"),
    # not tamsi: it ignores the joints' gains without a word, and the robot collapses
    "simulation.plant.discrete_contact_approximation": ("lagged", "similar", "sap"),
    "simulation.plant.contact_surface_representation": ("polygon", "triangle"),
}

POSITIVE = (
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

NOT_NEGATIVE = (
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
WITHIN: dict[str, tuple[float, float]] = {
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
    # rubber on dry rock has 1 or so
    "simulation.friction": (0.0, 10.0),
    "controller.friction": (0.0, 10.0),
}


# ------------------------------------------------------------------------------------------------
# What a scenario's values must be: checked once, after loading, by their paths.
# ------------------------------------------------------------------------------------------------


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
