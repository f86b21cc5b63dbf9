"""What a person may say of a robot that its file does not, or says wrongly: a `.robot.yaml`."""

from dataclasses import dataclass, field, replace

import numpy as np

from drake_quad.robot.importing.limits import JointLimits


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
