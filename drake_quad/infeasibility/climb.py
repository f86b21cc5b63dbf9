"""The moments that every climb has to pass, whatever the gait.

Levels are 0 (the floor), 1 to n - 1 (the treads) and n (the landing). A boundary k lies between
the levels up to k and those above it. Each standing foot is on one side of it, so that the feet's
sides make one of sixteen states. A climb begins with all feet below and ends with all above. One
foot moves at a time, so that it is a path along the edges of a four-dimensional cube of states.

An edge moves foot i while the three others stand on their sides. The robot must hold itself on
these three as foot i leaves its place on one side, and again as it reaches its place on the
other. Each of these two moments is a `Moment`. If one of them is impossible the edge is, in both
directions. If so many moments are impossible that no path of edges is left, there is no climb.

The same argument is a cut in the graph of stances and transitions of multi-contact planners
(Hauser, Bretl, Latombe, Harada and Wilcox, *Motion planning for legged robots on varied terrain*,
IJRR 2008).
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

FEET = 4
BELOW, ABOVE = 0, 15  # states: bit i is set if foot i is above the boundary


@dataclass(frozen=True, order=True)
class Moment:
    """Foot `mover` touches the ground without bearing; the three others carry the robot.

    Attributes:
        above: State of the four feet, the mover's included: bit i is set if foot i is above.
        mover: Row of the foot that lifts or lands (FL, FR, RL, RR).
    """

    above: int
    mover: int

    @property
    def mixed(self) -> bool:
        """Whether there are feet on both sides; the others cannot be refuted."""
        return self.above not in (BELOW, ABOVE)


def edges() -> Iterator[tuple[Moment, Moment]]:
    """The 32 edges, each as its two moments: the mover below, and above."""
    for mover in range(FEET):
        bit = 1 << mover
        for above in range(16):
            if not above & bit:
                yield Moment(above, mover), Moment(above | bit, mover)


def find_way(impossible: Collection[Moment]) -> list[Moment] | None:
    """The mixed moments of a shortest path from all feet below to all above; None if none is left.

    Args:
        impossible: Moments that no path may pass.
    """
    ways: dict[int, tuple[int, tuple[Moment, ...]]] = {BELOW: (BELOW, ())}
    waiting = [BELOW]
    steps = [edge for edge in edges() if not set(edge) & set(impossible)]
    for here in waiting:  # breadth first: the list grows as it is read
        for low, high in steps:
            for one, other in ((low.above, high.above), (high.above, low.above)):
                if one == here and other not in ways:
                    ways[other] = (here, tuple(m for m in (low, high) if m.mixed))
                    waiting.append(other)
    if ABOVE not in ways:
        return None
    passed: list[Moment] = []
    here = ABOVE
    while here != BELOW:
        here, on_edge = ways[here]
        passed += on_edge
    return passed
