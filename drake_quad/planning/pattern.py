"""The wave gait's footprints on a lattice of places: which place each foot stands on, and when.

On stairs a foot can only stand on treads. The paper describes cycles of one and of two treads
(section II-A); this is the general pattern of n places a cycle with rear feet k places behind. A
tread is one place, or more where treads are deep against the legs.
"""

from dataclasses import dataclass
from functools import cached_property

from drake_quad.gait.legs import LEGS, Leg

# The fraction of the cycle at which each leg lifts off, in the order 1-4-2-3.
LIFT_OFF = {Leg(1): 0.0, Leg(4): 0.25, Leg(2): 0.5, Leg(3): 0.75}


@dataclass(frozen=True)
class Pattern:
    """Footprints of a wave gait.

    Attributes:
        treads: n: how many places every foot, and the body, advance in a cycle: treads, if a tread
            is one place.
        lag: k: how many places the right rear foot stands behind the left front foot as a cycle
            begins.
        per_tread: q: how many places every tread has, one behind the other.
    """

    treads: int = 2
    lag: int = 1
    per_tread: int = 1

    def first(self, leg: Leg) -> int:
        """The place of a leg as a cycle begins, from the body's: it then steps `treads` on."""
        return self._first(leg) + self._middle

    def _first(self, leg: Leg) -> int:
        """The same from the left front foot's place."""
        late = self.treads // 2 if LIFT_OFF[leg] >= 0.5 else 0
        return late - (self.lag if leg in (Leg(3), Leg(4)) else 0)

    @cached_property
    def _middle(self) -> int:
        """How many places behind the left front foot's the body's is: the nearest to the middle."""
        strokes = [self._first(leg) + self.treads * (0.5 - LIFT_OFF[leg]) for leg in LEGS]
        return -round(sum(strokes) / len(LEGS))

    def centre(self, leg: Leg, duty_factor: float) -> float:
        """Where the middle of a leg's stroke is, from the body's place [places]."""
        return self.first(leg) + self.treads * (0.5 * duty_factor - LIFT_OFF[leg])

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
