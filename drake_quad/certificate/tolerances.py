"""How far a run may be from its plan, and the world from its map, for a proof to hold all the same.

A proof within tolerances is of all motions whose body, feet, masses and stairs differ from the
plan's by no more than these, each from moment to moment as it likes: they are unknown numbers in
the enclosures of the plan (`certificate.enclosure.vary`), and all else follows as it does without.
"""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Tolerances:
    """What a proof is to hold for.

    Heights are against a common one: what lifts map, body and feet alike changes nothing.

    Attributes:
        rise: How much higher or lower than mapped each tread is, at most [m].
        run: How far each riser is from its mapped place, at most [m].
        mass: Share by which all masses are more or less, in one ratio.
        com: Horizontal distance of the whole robot's centre of mass from the model's [m].
        body: Distance of the body's origin from its planned place along each axis of W [m].
        tilt: Roll, and error of pitch [rad].
        turn: Error of yaw [rad].
        foot: Distance of a standing foot from its planned place [m]; its height may besides be off
            by `rise`.
        swing: Distance of a swing foot from its planned place [m], also of one that is late.
        late: How late a foot comes to bear after its touchdown, in the gait clock's time [s].
    """

    rise: float = 0.0
    run: float = 0.0
    mass: float = 0.0
    com: float = 0.0
    body: float = 0.0
    tilt: float = 0.0
    turn: float = 0.0
    foot: float = 0.0
    swing: float = 0.0
    late: float = 0.0

    def scaled(self, share: float) -> "Tolerances":
        """All of them times `share`."""
        return Tolerances(**{f.name: share * getattr(self, f.name) for f in fields(self)})

    def with_more(self, others: "Tolerances") -> "Tolerances":
        """All of them, with as much again as others are."""
        return Tolerances(
            **{f.name: getattr(self, f.name) + getattr(others, f.name) for f in fields(self)}
        )


NONE = Tolerances()
