"""What a person may say of a robot that its file does not, or says wrongly: a `.robot.yaml`."""

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_quad.errors import InputError
from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.robot.importing.limits import JointLimits

SUFFIX = ".robot.yaml"


@dataclass(frozen=True)
class Overrides:
    """The fields of a `.robot.yaml`; all but `model` may be left out.

    Attributes:
        model: The robot's file (relative to this one), or its name.
        name: The robot's name.
        legs: The names of each leg's joints (abduction, hip, knee), in the file's terms.
        forward_deg: Heading of the front in the trunk's frame, from +x to the left [deg].
        knees: `backward` or `forward` for all legs, or by leg (FL, FR, RL, RR).
        foot_radius: [m].
        effort: Torque limits of abduction, hip and knee [Nm].
        speed: Speed limits of abduction, hip and knee [rad/s].
        abduction: Lower and upper limit of the left legs, in normal form; mirrored on the right
            [rad].
        hip: Lower and upper limit, in normal form [rad].
        knee: How far it bends at least and at most, to its own side [rad].
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

    def knee_side(self, short: str) -> float:
        """-1 backward, +1 forward, 0 not said."""
        return {"": 0.0, "backward": -1.0, "forward": 1.0}[self.knees.get(short, "")]

    def applied(self, limits: JointLimits, *, short: str, names: list[str]) -> JointLimits:
        """The limits of one leg with what is said of them here.

        Args:
            limits: By the file, or assumed.
            short: FL, FR, RL or RR.
            names: Of the leg's three joints: what is said of them needs no note.
        """
        lower, upper = limits.lower.copy(), limits.upper.copy()
        mirror = (1.0 if short.endswith("L") else -1.0, 1.0, float(np.sign(lower[2] + upper[2])))
        notes = limits.notes
        for k, ends in enumerate((self.abduction, self.hip, self.knee)):
            if ends is not None:
                lower[k], upper[k] = sorted(mirror[k] * end for end in ends)
                words = (f"{names[k]}: no limits", f"{names[k]}: limits to both sides")
                notes = tuple(n for n in notes if not n.text.startswith(words))
        for said, word in ((self.effort, "effort"), (self.speed, "speed")):
            if said is not None:
                notes = tuple(n for n in notes if f": {word} " not in n.text)
        return replace(
            limits,
            lower=lower,
            upper=upper,
            effort=limits.effort if self.effort is None else np.array(self.effort, dtype=float),
            speed=limits.speed if self.speed is None else np.array(self.speed, dtype=float),
            notes=notes,
        )


def read_overrides(path: Path) -> Overrides:
    """Reads a `.robot.yaml`.

    Raises:
        InputError: If it is no such file, or a field of it is unknown or of the wrong kind.
    """
    source = path.name

    def refuse(name: str, value: object, remedy: str) -> InputError:
        return InputError(source=source, field=name, value=value, remedy=remedy)

    try:
        data: Any = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise refuse("robot.model", str(path), f"cannot be read: {reason}") from None
    if not isinstance(data, dict) or not isinstance(data.get("model"), str):
        raise refuse("model", data, "the file must name the robot's own file as `model`")
    known = [f.name for f in fields(Overrides)]
    for name in data:
        if name not in known:
            raise refuse(str(name), data[name], f"no such field; there are {', '.join(known)}")
    given = {name: value for name, value in data.items() if value is not None}
    for name, count in (("effort", 3), ("speed", 3), ("abduction", 2), ("hip", 2), ("knee", 2)):
        if name in given:
            given[name] = _numbers(given[name], count, refuse, name)
    for name in ("abduction", "hip", "knee"):
        if name in given and not given[name][0] < given[name][1]:
            raise refuse(name, given[name], "the smaller first")
    if "knee" in given and given["knee"][0] < 0.0:
        raise refuse("knee", given["knee"], "how far it bends at least and at most: not negative")
    for name in ("effort", "speed"):
        if name in given and min(given[name]) <= 0.0:
            raise refuse(name, given[name], "must be greater than 0")
    for name in ("foot_radius", "forward_deg"):
        if name in given:
            given[name] = _numbers([given[name]], 1, refuse, name)[0]
    if given.get("foot_radius", 1.0) <= 0.0:
        raise refuse("foot_radius", given["foot_radius"], "must be greater than 0")
    if "knees" in given:
        given["knees"] = _knees(given["knees"], refuse)
    legs = given.get("legs")
    if legs is not None and (
        not isinstance(legs, dict)
        or sorted(legs) != sorted(SHORT_NAMES)
        or any(
            not isinstance(v, list) or len(v) != 3 or any(not isinstance(n, str) for n in v)
            for v in legs.values()
        )
    ):
        raise refuse("legs", legs, "three joints' names for each of FL, FR, RL, RR are needed")
    return Overrides(**given)


def _numbers(value: Any, count: int, refuse: Any, name: str) -> list[float]:
    """A list of just so many finite numbers."""
    ok = isinstance(value, list) and len(value) == count
    if not ok or any(isinstance(x, bool) or not isinstance(x, (int, float)) for x in value):
        raise refuse(name, value, f"{count} numbers are needed" if count > 1 else "not a number")
    if not np.all(np.isfinite(value)):
        raise refuse(name, value, "must be finite")
    return [float(x) for x in value]


def _knees(value: Any, refuse: Any) -> dict[str, str]:
    """The side of each leg's knee."""
    sides = {leg: value for leg in SHORT_NAMES} if isinstance(value, str) else value
    if (
        not isinstance(sides, dict)
        or not set(sides) <= set(SHORT_NAMES)
        or not set(map(str, sides.values())) <= {"forward", "backward"}
    ):
        raise refuse("knees", value, "`forward` or `backward`, or one of them by leg (FL: ...)")
    return dict(sides)
