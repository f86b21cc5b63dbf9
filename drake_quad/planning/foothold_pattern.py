"""Which place each foot of a wave gait, or of a trot, stands on as a cycle begins.

On stairs a foot can only stand on treads. The paper describes cycles of one and of two treads
(section II-A); this is the general pattern of n places a cycle with rear feet k places behind. A
tread is one place, or more where treads are deep against the legs.
"""

from dataclasses import dataclass
from functools import cached_property

from drake_quad.robot.legs import DIAGONALS, LEGS, Leg

# The fraction of the cycle at which each leg lifts off: of the wave gait, in the order 1-4-2-3, and
# of the trot.
LIFT_OFF = {Leg(1): 0.0, Leg(4): 0.25, Leg(2): 0.5, Leg(3): 0.75}
TROT_LIFT_OFF = {leg: 0.5 * k for k, pair in enumerate(DIAGONALS) for leg in pair}
WAVE, TROT = "wave", "trot"
GAITS = (WAVE, TROT)


@dataclass(frozen=True)
class FootholdPattern:
    """Footprints of a wave gait, or of a trot.

    Attributes:
        treads: n: how many places every foot, and the body, advance in a cycle: treads, if a tread
            is one place.
        lag: k: how many places the right rear foot stands behind the left front foot as a cycle
            begins.
        per_tread: q: how many places every tread has, one behind the other.
        gait: One of GAITS.
    """

    treads: int = 2
    lag: int = 1
    per_tread: int = 1
    gait: str = WAVE

    @property
    def lift_off(self) -> dict[Leg, float]:
        """The fraction of the cycle at which each leg lifts off."""
        return TROT_LIFT_OFF if self.gait == TROT else LIFT_OFF

    def first(self, leg: Leg) -> int:
        """The place of a leg as a cycle begins, from the body's: it then steps `treads` on."""
        return self._first(leg) + self._middle

    def _first(self, leg: Leg) -> int:
        """The place of a leg as a cycle begins, from the left front foot's."""
        late = self.treads // 2 if self.lift_off[leg] >= 0.5 else 0
        return late - (self.lag if leg in (Leg(3), Leg(4)) else 0)

    @cached_property
    def _middle(self) -> int:
        """How many places behind the left front foot's the body's is: the nearest to the middle."""
        strokes = [self._first(leg) + self.treads * (0.5 - self.lift_off[leg]) for leg in LEGS]
        return -round(sum(strokes) / len(LEGS))

    def centre(self, leg: Leg, duty_factor: float) -> float:
        """Where the middle of a leg's stroke is, from the body's place [places]."""
        return self.first(leg) + self.treads * (0.5 * duty_factor - self.lift_off[leg])

    @cached_property
    def stance(self) -> float:
        """Distance of the middles of the front legs' strokes from the rear legs' [places]."""
        c = {leg: self.centre(leg, 1.0) for leg in LEGS}
        return 0.5 * (c[Leg(1)] + c[Leg(2)] - c[Leg(3)] - c[Leg(4)])

    def ahead(self, duty_factor: float) -> float:
        """How far the middle of all strokes is ahead of the body's place [places]."""
        return sum(self.centre(leg, duty_factor) for leg in LEGS) / len(LEGS)

    @property
    def shares_places(self) -> bool:
        """Whether a rear foot ever lands on the place where the front foot of its side stands."""
        return self.lag in (self.treads // 2, self.treads - self.treads // 2)

    @property
    def behind(self) -> int:
        """How many places behind the body's the rearmost foot stands as a cycle begins."""
        return max(0, *(-self.first(leg) for leg in LEGS))

    @property
    def beyond(self) -> int:
        """How many places ahead of the body's the foremost foot stands as a cycle begins."""
        return max(1, *(self.first(leg) for leg in LEGS))
