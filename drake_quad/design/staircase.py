"""An endless regular staircase, as a gait's cycle sees it: lengths and slope."""

from dataclasses import dataclass

from drake_quad.gait.legs import FloatArray


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
