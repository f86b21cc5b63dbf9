"""What a course is made of: floor, stairs, landing and the like, as a person writes them.

A course is a list of `Element`s, one after the other. Every step of a flight is a riser followed
by a tread of its run, going up and going down alike: so a flight of n steps has n risers, is
sum(runs) long, and its last tread is flush with the element after it. A run is measured from
nosing to nosing, as one sees it from above: an overhang takes nothing from it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

DEFAULT_WIDTH = 2.0  # [m] of whatever says nothing else, but for a landing to turn on
WIDTH_MIN = 0.8  # [m] on anything narrower no stance of a robot worth climbing with fits
DEFAULT_THICKNESS = 0.04  # [m] of a tread that reaches out, or lies over an open riser


@dataclass(frozen=True)
class Element:
    """One stretch of a course. A field that the kind does not have must stay `None`.

    Attributes:
        kind: `floor`, `stairs`, `landing`, `block`, `curb` or `slope`.
        length: Of a floor, a landing, a block or a slope, along the heading, from above [m].
        width: Across the heading [m]; `None` is 2 m, on a landing to turn on as `turning_width`.
        turn_deg: Of a landing: the robot turns on it by this angle [deg], left positive.
        going: Of stairs, a curb or a slope: `up` or `down`.
        rise: Of stairs: height of every step [m].
        run: Of stairs: depth of every tread [m].
        count: Of stairs: number of steps, which is the number of risers.
        rises: Of irregular stairs: the height of each step [m].
        runs: Of irregular stairs: the depth of each tread [m].
        overhang: Of stairs: by how much each tread reaches beyond the riser under it [m].
        open: Of stairs: whether the risers are open, nothing between the treads.
        thickness: Of stairs with an overhang or open risers: of the treads [m].
        height: Of a block, on which and off which one steps; of a curb, which is one riser and
            has no length; of a slope, from its one end to the other [m].
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
    overhang: float | None = None
    open: bool | None = None
    thickness: float | None = None
    height: float | None = None

    @property
    def turn(self) -> float:
        """The angle by which the robot turns on it [rad], left positive."""
        return math.radians(self.turn_deg or 0.0)

    @property
    def turning_width(self) -> float:
        """Of a landing to turn on: unless told, so wide that it crosses neither neighbour [m]."""
        length = self.length or 0.0
        if self.width is not None:
            return self.width
        if abs(math.remainder(self.turn, 0.5 * math.pi)) < 1e-9:
            return length
        width = length * min(1.0, 1.0 / abs(math.tan(0.5 * self.turn)))
        return width if width >= WIDTH_MIN else length

    @property
    def climb(self) -> float:
        """By how much the ground is higher on a block, or past a curb or a slope [m]."""
        return (-1.0 if self.going == "down" else 1.0) * (self.height or 0.0)

    @property
    def style(self) -> tuple[float, float, bool]:
        """Of stairs: overhang and thickness of the treads [m], and whether the risers are open."""
        overhang, is_open = self.overhang or 0.0, bool(self.open)
        if overhang == 0.0 and not is_open:
            return 0.0, 0.0, False
        thickness = DEFAULT_THICKNESS if self.thickness is None else self.thickness
        return overhang, thickness, is_open

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
