"""What a course is made of: floor, stairs, landing, as a person writes them.

A course is a list of `Element`s, one after the other. Every step of a flight is a riser followed
by a tread of its run, going up and going down alike: so a flight of n steps has n risers, is
sum(runs) long, and its last tread is flush with the element after it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

DEFAULT_WIDTH = 2.0  # [m] of a floor, a flight or a landing that says nothing else


@dataclass(frozen=True)
class Element:
    """One stretch of a course. A field that the kind does not have must stay `None`.

    Attributes:
        kind: `floor`, `stairs` or `landing`.
        length: Of a floor or a landing, along the heading [m].
        width: Across the heading [m]; `None` is 2 m, or `length` for a landing to turn on.
        turn_deg: Of a landing: the robot turns on it by this angle [deg], left positive.
        going: Of stairs: `up` or `down`.
        rise: Of stairs: height of every step [m].
        run: Of stairs: depth of every tread [m].
        count: Of stairs: number of steps, which is the number of risers.
        rises: Of irregular stairs: the height of each step [m].
        runs: Of irregular stairs: the depth of each tread [m].
    """

    kind: str
    length: float | None = None
    width: float | None = None
    turn_deg: float | None = None
    going: str | None = None
    rise: float | None = None
    run: float | None = None
    count: int | None = None
    rises: Sequence[float] | None = None
    runs: Sequence[float] | None = None

    @property
    def turn(self) -> float:
        """The angle by which the robot turns on it [rad], left positive."""
        return math.radians(self.turn_deg or 0.0)

    @property
    def step_count(self) -> int:
        """Number of steps of stairs: that of their lists, or `count`."""
        for values in (self.rises, self.runs):
            if values is not None:
                return len(values)
        return self.count or 0

    @property
    def profile(self) -> list[tuple[float, float]]:
        """Of checked stairs: of each tread, its height over the start and its run [m]."""
        count = self.step_count
        rises = self.rises if self.rises is not None else [self.rise or 0.0] * count
        runs = self.runs if self.runs is not None else [self.run or 0.0] * count
        sign = -1.0 if self.going == "down" else 1.0
        heights = (
            [k * rises[0] for k in range(1, count + 1)]  # exact where the steps are alike
            if self.rises is None
            else list(accumulate(rises))
        )
        return [(sign * float(h), float(w)) for h, w in zip(heights, runs, strict=True)]
