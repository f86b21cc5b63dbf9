"""Overrides: what a `.robot.yaml` adds to a robot's file, or corrects in it."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_quad.errors import InputError
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import CameraMount
from drake_quad.util.files import MOST_YAML, read_given_text
from drake_quad.util.yaml_io import bare_as_numbers, parse_yaml

if TYPE_CHECKING:  # what it stands beside takes Drake, which a file's name and digest do without
    from drake_quad.robot.importer.raw_robot import JointLimits


@dataclass(frozen=True)
class Overrides:
    """The fields of a `.robot.yaml`; all but `model` may be left out.

    Attributes:
        model: The robot's file (relative to this one), or its name.
        name: The robot's name.
        legs: The names of each leg's joints (abduction, hip, knee), in the file's terms.
        forward_deg: Heading of the front in the trunk's frame, from +x to the left [deg].
        knees: `backward` or `forward` for all legs, or by leg (FL, FR, RL, RR).
        foot_radius: Radius of the feet [m].
        effort: Torque limits of abduction, hip and knee [Nm].
        speed: Speed limits of abduction, hip and knee [rad/s].
        abduction: Lower and upper limit of the left legs, in normal form; mirrored on the right
            [rad].
        hip: Lower and upper limit, in normal form [rad].
        knee: How far it bends at least and at most, to its own side [rad].
        camera: Where its depth camera is mounted on the trunk, in normal form.
    """

    model: str = ""
    name: str = ""
    legs: dict[str, list[str]] | None = None
    forward_deg: float | None = None
    knees: dict[str, str] = field(default_factory=dict)
    foot_radius: float | None = None
    effort: list[float] | None = None
    speed: list[float] | None = None
    abduction: list[float] | None = None
    hip: list[float] | None = None
    knee: list[float] | None = None
    camera: CameraMount | None = None

    def knee_side(self, short: str) -> float:
        """-1 for backward, +1 for forward, 0 if not given."""
        return {"": 0.0, "backward": -1.0, "forward": 1.0}[self.knees.get(short, "")]

    def applied(self, limits: "JointLimits", *, short: str, names: list[str]) -> "JointLimits":
        """The limits of one leg with these overrides.

        Args:
            limits: Limits from the file, or assumed.
            short: FL, FR, RL or RR.
            names: Names of the leg's three joints; values given for them need no note.
        """
        lower, upper = limits.lower.copy(), limits.upper.copy()
        mirror = (1.0 if short.endswith("L") else -1.0, 1.0, float(np.sign(lower[2] + upper[2])))
        notes = limits.notes
        for k, ends in enumerate((self.abduction, self.hip, self.knee)):
            if ends is not None:
                lower[k], upper[k] = sorted(mirror[k] * end for end in ends)
                words = (f"{names[k]}: no limits", f"{names[k]}: limits ")
                notes = tuple(n for n in notes if not n.text.startswith(words))
        for values, word in ((self.effort, "effort"), (self.speed, "speed")):
            if values is not None:
                notes = tuple(n for n in notes if f": {word} " not in n.text)
        return replace(
            limits,
            lower=lower,
            upper=upper,
            effort=limits.effort if self.effort is None else np.array(self.effort, dtype=float),
            speed=limits.speed if self.speed is None else np.array(self.speed, dtype=float),
            notes=notes,
        )


YAML = (".yaml", ".yml")
# It names files in the cache: 255 bytes with what is added to it, and a letter has 4 at most.
NAME = re.compile(r"[\w.+-]{1,60}")
# Of numbers: how many, least, most, unit. What lies outside is a slip: another unit, most often.
NUMBERS = {
    "forward_deg": (1, -360.0, 360.0, "degrees"),
    "foot_radius": (1, 1e-3, 0.3, "m"),
    "effort": (3, 1e-3, 1e5, "Nm"),
    "speed": (3, 1e-2, 1e3, "rad/s"),
    "abduction": (2, -2.0 * math.pi, 2.0 * math.pi, "rad"),
    "hip": (2, -2.0 * math.pi, 2.0 * math.pi, "rad"),
    "knee": (2, 0.0, math.pi, "rad, how far it bends at least and at most"),
}
CAMERA = {"x": (-2.0, 2.0), "y": (-2.0, 2.0), "z": (-2.0, 2.0), "pitch_deg": (-30.0, 90.0)}
LEAST_RANGE = 0.01  # [rad] between a joint's limits

Refuse = Callable[[str, object, str], InputError]


def is_yaml(path: Path) -> bool:
    """Whether a file is a `.robot.yaml` by its name."""
    return path.name.lower().endswith(YAML)


def read_overrides(path: Path) -> Overrides:
    """Reads a `.robot.yaml`.

    Raises:
        InputError: If it is no such file, or a field of it is unknown, of the wrong kind, or of a
            size that no robot has.
    """
    source = path.name

    def refuse(name: str, value: object, remedy: str) -> InputError:
        return InputError(source=source, field=name, value=value, remedy=remedy)

    try:
        text = read_given_text(path, most=MOST_YAML, encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else f"not text in UTF-8 ({error})"
        raise refuse("robot.model", str(path), f"cannot be read: {reason}") from None
    data = bare_as_numbers(parse_yaml(text, source=source, needs="model: my_robot.urdf"))
    if "model" not in data and "course" in data:
        remedy = "this is a scenario; give a robot, and with `check` this file by --scenario"
        raise refuse("course", "...", remedy)
    model = data.get("model")
    if not isinstance(model, str) or not model.strip():
        raise refuse("model", model, "the file must name the robot's own file as `model`")
    known = [f.name for f in fields(Overrides)]
    for name in data:
        if name not in known:
            raise refuse(str(name), data[name], f"no such field; there are {', '.join(known)}")
    given = {name: value for name, value in data.items() if value is not None}
    name = given.get("name", "robot")
    if not isinstance(name, str) or not NAME.fullmatch(name) or name in (".", ".."):
        rule = "text of at most 60 letters, digits and . + - _ is needed (a number in quotes)"
        raise refuse("name", name, rule)
    for name, (count, least, most, unit) in NUMBERS.items():
        if name in given:
            numbers = _numbers(name, given[name], count, refuse)
            if not all(least <= x <= most for x in numbers):
                remedy = f"must be within {least:.4g} and {most:.4g} {unit}"
                raise refuse(name, given[name], remedy)
            if count == 2 and not numbers[0] + LEAST_RANGE <= numbers[1]:
                remedy = f"the smaller first, at least {LEAST_RANGE} rad apart"
                raise refuse(name, given[name], remedy)
            given[name] = numbers if count > 1 else numbers[0]
    if "knees" in given:
        given["knees"] = _knees(given["knees"], refuse)
    if "legs" in given:
        _check_legs(given["legs"], refuse)
    if "camera" in given:
        given["camera"] = _camera(given["camera"], refuse)
    return Overrides(**given)


def _numbers(name: str, value: Any, count: int, refuse: Refuse) -> list[float]:
    """Just so many finite numbers; one of them alone is no list."""
    numbers = value if count > 1 else [value]
    remedy = f"{count} numbers are needed" if count > 1 else "not a number"
    if not isinstance(numbers, list) or len(numbers) != count:
        raise refuse(name, value, remedy)
    if any(isinstance(x, bool) or not isinstance(x, (int, float)) for x in numbers):
        raise refuse(name, value, remedy)
    try:
        floats = [float(x) for x in numbers]
    except OverflowError:  # a whole number beyond all floats
        floats = [math.inf]
    if not all(map(math.isfinite, floats)):
        raise refuse(name, value, "must be finite")
    return floats


def _knees(value: Any, refuse: Refuse) -> dict[str, str]:
    """The side of each leg's knee."""
    sides = {leg: value for leg in SHORT_NAMES} if isinstance(value, str) else value
    if (
        not isinstance(sides, dict)
        or not set(sides) <= set(SHORT_NAMES)
        or any(side not in ("forward", "backward") for side in sides.values())
    ):
        raise refuse("knees", value, "`forward` or `backward`, or one of them by leg (FL: ...)")
    return dict(sides)


def _camera(value: Any, refuse: Refuse) -> CameraMount:
    """Where the camera is."""
    if not isinstance(value, dict) or set(value) != set(CAMERA):
        raise refuse("camera", value, f"{', '.join(CAMERA)} are needed, in m and degrees")
    figures = {}
    for name, (least, most) in CAMERA.items():
        (figures[name],) = _numbers(f"camera.{name}", value[name], 1, refuse)
        if not least <= figures[name] <= most:
            remedy = f"must be within {least:g} and {most:g}"
            raise refuse(f"camera.{name}", value[name], remedy)
    return CameraMount(**figures)


def _check_legs(legs: Any, refuse: Refuse) -> None:
    """Refuses what does not name three joints of each leg."""
    if not isinstance(legs, dict) or set(legs) != set(SHORT_NAMES):
        raise refuse("legs", legs, "three joints' names for each of FL, FR, RL, RR are needed")
    for leg, names in legs.items():
        three = isinstance(names, list) and len(names) == 3
        if not three or any(not isinstance(name, str) for name in names):
            remedy = "three joints' names are needed: abduction, hip and knee"
            raise refuse(f"legs.{leg}", names, remedy)
