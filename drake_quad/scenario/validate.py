"""Checks of a scenario: what stands beside its fields, and what needs more than one field."""

import functools
import math
import operator
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from drake_quad.errors import InputError, did_you_mean
from drake_quad.planning.foothold_pattern import TROT
from drake_quad.robot.legs import LEGS
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import (
    MissionElement,
    MotorStrengthConfig,
    PushConfig,
    Scenario,
)
from drake_quad.scenario.motion_config import DUTY_REMEDY, LEAST_DUTY, PREFER
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import LONGEST
from drake_quad.util.schema import check_fields

WHOLE = 1e-6  # relative: 0.004 is four times 0.001 only up to rounding
MULTIPLE_TOLERANCE = 1e-9  # relative: 0.005 is five times 0.001 only up to rounding
_SHORTEST_STEP = 1e-5  # [s] of the plant: a run of a minute would have millions
_LONGEST_STAND = 600.0  # [s]
_SHORTEST_STAND = 0.1  # [s]
_MOST_TURN = 3600.0  # [deg] of a spin
_SHORTEST_SWING = 0.1  # [s]

_MISSION = {"walk": "distance", "spin": "angle_deg", "stand": "duration"}


def check_disturbances(scenario: Scenario, *, source: str) -> None:
    """Raises `InputError` at the first value that no run can have.

    Whether the robot has a joint or a body of that name is seen when the robot is read.

    Args:
        scenario: Scenario whose other values are right.
        source: Name of the file, for the error.
    """
    given, step = scenario.disturbances, scenario.simulation.plant.time_step
    for i, push in enumerate(given.pushes):
        _Checker(push, f"disturbances.pushes[{i}]", source).check_push(push)
    seen: set[str] = set()
    for i, motor in enumerate(given.motor_strength):
        checker = _Checker(motor, f"disturbances.motor_strength[{i}]", source)
        checker.check_motor(motor)
        if motor.joint in seen:
            raise checker.error("joint", "is given twice")
        seen.add(motor.joint)
    for name in ("sensor_delay", "command_delay"):
        _Checker(given, "disturbances", source).check_whole(name, step)


class _Checker:
    """Checks the fields of one mapping."""

    def __init__(self, holder: Any, path: str, source: str) -> None:
        self.holder, self.path, self.source = holder, path, source

    def error(self, field: str, remedy: str) -> InputError:
        """The error at `field`."""
        value = getattr(self.holder, field)
        path = f"{self.path}.{field}"
        return InputError(source=self.source, field=path, value=value, remedy=remedy)

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
        if push.speed is None and push.force is None:
            raise self.error("speed", "a push must say its speed or its force")
        if push.force is not None:
            for name in ("speed", "direction_deg"):
                if getattr(push, name) is not None:
                    raise self.error(name, "say speed and direction_deg, or force, not both")
        for name in ("force", "point"):
            vector = getattr(push, name)
            if vector is not None and len(vector) != 3:
                raise self.error(name, "must be three numbers: x, y, z")
        if push.force is not None and math.hypot(*push.force) == 0.0:
            raise self.error("force", "must not be zero")

    def check_motor(self, motor: MotorStrengthConfig) -> None:
        """A weak drive says which and how weak."""
        if not motor.joint:
            raise self.error("joint", "must say which joint")
        if motor.factor is None:
            raise self.error("factor", f"{motor.joint} must say its factor")


def check_scenario(scenario: Scenario, *, source: str) -> None:
    """Raises `InputError` at the first value that no run can have.

    Whether the robot can do what is asked of it is for the planner to say.

    Args:
        scenario: Scenario as loaded; its types are right.
        source: Name of the file, for the error.
    """
    fail = functools.partial(_fail, scenario, source)

    def wrong(path: str, value: Any, remedy: str) -> InputError:
        return InputError(source=source, field=path, value=value, remedy=remedy)

    check_fields(scenario, "", wrong)
    if 0.0 < scenario.simulation.plant.time_step < _SHORTEST_STEP:
        remedy = f"must be 0, for a plant without steps, or at least {_SHORTEST_STEP:g} s"
        raise fail("simulation.plant.time_step", remedy)
    if scenario.gait.pattern == TROT:
        _check_trot(fail, scenario)
    elif scenario.gait.duty_factor < LEAST_DUTY:
        raise fail("gait.duty_factor", DUTY_REMEDY)
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
    if scenario.prefer != PREFER[0]:
        if scenario.design != "auto":
            raise fail("prefer", f"must be {PREFER[0]} unless design is auto: this gait is given")
        if scenario.perception.map == "seen":
            raise fail("prefer", f"must be {PREFER[0]} with perception.map seen: no quick gait yet")
    if scenario.estimator.landmarks != "none":
        if scenario.estimator.kind != "ekf":
            remedy = "must be none unless estimator.kind is ekf: they correct what it estimates"
            raise fail("estimator.landmarks", remedy)
        if scenario.perception.map == "seen":
            remedy = "must be none with perception.map seen: only a map that is told has landmarks"
            raise fail("estimator.landmarks", remedy)
    if scenario.gait.margin != HULL and scenario.body.balance == "dynamic":
        raise fail(
            "gait.margin", "must be hull with body.balance dynamic, which asks for no static margin"
        )
    for path in (f"gait.swing_speed_{way}.{leg.short}" for way in ("up", "down") for leg in LEGS):
        if value_at(scenario, path) > 0.0 and scenario.gait.swing_speed == 0.0:
            raise fail(path, "must be 0 where gait.swing_speed is 0: all swings last as long")
    if scenario.gait.stance_stagger >= scenario.gait.stance_width:
        raise fail("gait.stance_stagger", "must be less than gait.stance_width")
    if scenario.simulation.simulator.target_realtime_rate != 0.0:
        raise fail("simulation.simulator.target_realtime_rate", "say simulation.realtime_rate")
    if scenario.simulation.simulator.start_time != 0.0:
        raise fail("simulation.simulator.start_time", "must be 0: a run begins then")
    if scenario.perception.map == "seen" and scenario.mission:
        remedy = "needs no mission, leave it out: the robot looks, and walks up what it has seen"
        raise fail("perception.map", remedy)
    if scenario.perception.map != "seen" and scenario.start.heading_deg != 0.0:
        remedy = "must be 0 with perception.map told: the robot then heads along the first lane"
        raise fail("start.heading_deg", remedy)
    for path in ("controller.period", "simulation.log_period", "perception.image_period"):
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


# What a trot takes: path, the values that will do, and why.
_TROT_TAKES: tuple[tuple[str, tuple[Any, ...], str], ...] = (
    ("design", ("given",), "no trot is designed yet: give the gait"),
    ("body.balance", ("dynamic",), "two feet hold no robot that stands still"),
    ("body.path", ("optimised",), "the zero-moment point has to be on the line of two feet"),
    ("controller.kind", ("whole_body",), "the other shares the weight among three feet or more"),
    ("controller.catch_pushes", (False,), "no step is known yet that catches a robot on two feet"),
    ("controller.margin_demanded", (0.0,), "two feet have no static margin"),
    ("gait.switch_wait", (0.0,), "the time on four feet follows from the duty factor"),
    ("gait.treads", (1, 2), "the pairs are half a cycle apart"),
    ("perception.map", ("told",), "no robot that trots has been tried on a map that grows"),
)


def _check_trot(fail: Callable[[str, str], InputError], scenario: Scenario) -> None:
    """A trot is refused with whatever it does not work with, or was not tried with."""
    for path, right, why in _TROT_TAKES:
        if value_at(scenario, path) not in right:
            words = " or ".join(str(value).lower() for value in right)
            raise fail(path, f"must be {words} with gait.pattern trot: {why}")


def _check_mission(element: MissionElement, path: str, source: str) -> None:
    """One element: its kind, and just the number that belongs to the kind."""

    def error(field: str, remedy: str) -> InputError:
        value = getattr(element, field)
        return InputError(source=source, field=f"{path}.{field}", value=value, remedy=remedy)

    if element.kind not in _MISSION:
        hint = did_you_mean(element.kind, _MISSION)
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
