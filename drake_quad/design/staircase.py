"""An endless regular staircase, as a gait's cycle sees it: lengths, slope, and room beside it."""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import FloatArray

NEIGHBOURS = 2  # treads on either side that can be the nearest to a point


@dataclass(frozen=True)
class Staircase:
    """Treads of one rise and one run without end, or level ground.

    Tread i reaches from (i - 1/2) run to (i + 1/2) run along the way and is i rise high: the line
    through the treads' middles goes through the origin.

    Attributes:
        rise: Height of a step [m]; negative going down, 0 on level ground.
        run: Depth of a tread [m]; on level ground the distance between places to step on.
    """

    rise: float
    run: float

    @property
    def slope(self) -> float:
        """Rise over run."""
        return self.rise / self.run

    def line(self, s: FloatArray) -> FloatArray:
        """Height of the line through the treads' middles at `s` [m]."""
        return self.slope * s

    def distance(self, s: FloatArray, z: FloatArray) -> FloatArray:
        """Signed distance of points (s, z) from the staircase [m], negative inside it.

        Exact for what is nearer than two treads; beyond, it may be less far than it says.
        """
        middle = np.round(s / self.run)
        best = np.full(np.broadcast(s, z).shape, np.inf)
        for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
            i = middle + k
            beside = np.abs(s - i * self.run) - 0.5 * self.run
            above = z - i * self.rise
            outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
            inside = np.minimum(np.maximum(beside, above), 0.0)
            best = np.minimum(best, outside + inside)
        return best
