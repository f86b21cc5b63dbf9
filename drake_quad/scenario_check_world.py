"""What disturbances and the world's errors must be, by their paths."""

import math
from typing import Any

from drake_quad.errors import InputError
from drake_quad.scenario_config import Scenario
from drake_quad.scenario_config_world import MotorStrengthConfig, PushConfig

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
