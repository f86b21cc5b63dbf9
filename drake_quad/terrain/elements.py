"""One stretch of a course, and the checks of its fields.

A course is a list of `Element`s, one after the other. Every step of a flight is a riser followed
by a tread of its run, going up and going down alike: so a flight of n steps has n risers, is
sum(runs) long, and its last tread is flush with the element after it. A run is measured from
nosing to nosing, as one sees it from above: an overhang takes nothing from it.
"""

import math
from dataclasses import dataclass, field as yaml_field
from itertools import accumulate
from typing import Any

from drake_quad.util.schema import TEXT, FieldBound, number

WIDTH_MIN = 0.8  # [m] on anything narrower no stance of a robot that climbs stairs fits
STEPS_MAX = 1000  # of a flight
ELEMENTS_MAX = 1000  # of a course
RISE_MAX, RUN_MAX = 2.0, 5.0  # [m] of a step: more is a slip of the pen, such as of millimetres
RUN_MIN = 0.10  # [m]
FOOT_ROOM = 0.02  # [m] of tread before and behind a foot
STEEPEST = 0.7  # rise over length of a slope: on anything steeper nothing stands by friction
DEFAULT_WIDTH = 2.0  # [m] of an element without a width, but for a landing to turn on
TURNING_SPACE = 1.5  # [m] to turn on, of courses that are read before the robot is
DEFAULT_THICKNESS = 0.04  # [m] of a tread that reaches out, or lies over an open riser
LONGEST = 1000.0  # [m] of a stretch of the course, and of all of it
BACK_DEG = 180.0  # by which a robot turns to go back


@dataclass(frozen=True)
class Stairs:
    """A flight of stairs.

    Attributes:
        rise: Height of every step [m].
        run: Depth of every tread [m], from nosing to nosing.
        count: Number of steps.
        overhang: Distance that each tread reaches beyond the riser under it [m].
        open: Whether there is nothing between the treads.
    """

    rise: float
    run: float
    count: int = 10
    overhang: float = 0.0
    open: bool = False

    @property
    def closed(self) -> bool:
        """Whether each riser stands under the edge of its tread."""
        return self.overhang == 0.0 and not self.open

    def fields(self) -> dict[str, Any]:
        """The fields that are not as usual, after rise, run and count."""
        told = {"rise": self.rise, "run": self.run, "count": self.count}
        told |= {"overhang": self.overhang} if self.overhang else {}
        return told | ({"open": True} if self.open else {})

    def __str__(self) -> str:
        """The flight for people, in the middle of a sentence."""
        steps = "1 step" if self.count == 1 else f"{self.count} steps"
        text = f"{steps} of {self.rise:g} m on treads of {self.run:g} m"
        text += f" that reach out by {self.overhang:g} m" if self.overhang else ""
        return text + (", with open risers" if self.open else "")


STAIRS_FIELDS = ("going", "rise", "run", "count", "rises", "runs", "overhang", "open", "thickness")
FIELDS_OF_KIND: dict[str, tuple[str, ...]] = {
    "floor": ("length", "width"),
    "stairs": (*STAIRS_FIELDS, "width"),
    "landing": ("length", "width", "turn_deg"),
    "block": ("length", "height", "width"),
    "curb": ("going", "height"),
    "slope": ("going", "length", "height", "width"),
    "return": ("turn_deg",),
}


@dataclass
class Element:
    """One stretch of a course, as YAML fills it. A field that the kind does not have stays `None`.

    Each field's unit and meaning stand beside it. It is not frozen, and annotations are not
    postponed, for Drake's YAML reader; nobody else writes to it.
    """

    kind: str = yaml_field(
        default="",
        metadata={
            "words": tuple(FIELDS_OF_KIND),
            TEXT: "`floor`, `stairs`, `landing`, `block`, `curb` or `slope`; `return` at the end",
        },
    )
    length: float | None = number(
        None,
        "m",
        "Length along the heading, from above",
        FieldBound(f"must be at most {LONGEST:g} m", most=LONGEST),
    )
    width: float | None = number(
        None,
        "m",
        f"Width across the heading, at least {WIDTH_MIN:g}; {DEFAULT_WIDTH:g} by default, on a "
        "landing to turn on its `length`",
    )
    turn_deg: float | None = number(
        None,
        "deg",
        "Turn on the landing, left positive, within ±180; not given: straight on. Of `return` 180, "
        "which is the default, or -180",
    )
    going: str | None = number(None, "", "`up` or `down`")
    rise: float | None = number(
        None, "m", f"Height of every step, more than 0 also going down, at most {RISE_MAX:g}"
    )
    run: float | None = number(
        None,
        "m",
        f"Depth of every tread from nosing to nosing, at least {RUN_MIN:.2f} and a foot's diameter "
        f"+ {2 * FOOT_ROOM:g}, at most {RUN_MAX:g}: what is deeper is a landing",
    )
    count: int | None = number(
        None, "", f"Number of steps, which is that of risers, at most {STEPS_MAX}"
    )
    rises: list[float] | None = number(
        None, "m", "Instead of `rise`: the height of each step of irregular stairs"
    )
    runs: list[float] | None = number(
        None, "m", "Instead of `run`: the depth of each tread of irregular stairs"
    )
    overhang: float | None = number(
        None, "m", "How far each tread reaches beyond the riser under it, at most half of a run"
    )
    open: bool | None = number(None, "", "Whether the risers are open, nothing between the treads")
    thickness: float | None = number(
        None,
        "m",
        f"Thickness of treads with an overhang or open risers; {DEFAULT_THICKNESS:g} by default, "
        "and less than a rise",
    )
    height: float | None = number(
        None,
        "m",
        f"Height of a block over its ground, on and off which one steps, or of a curb's riser, at "
        f"most {RISE_MAX:g}; of a slope's one end over the other, at most {STEEPEST:g} of its "
        "length",
    )

    @property
    def turn(self) -> float:
        """The angle by which the robot turns on it [rad], left positive."""
        default = BACK_DEG if self.kind == "return" else 0.0
        return math.radians(default if self.turn_deg is None else self.turn_deg)

    @property
    def turning_width(self) -> float:
        """Width of a landing to turn on; by default it crosses neither neighbour [m]."""
        length = self.length or 0.0
        if self.width is not None:
            return self.width
        if abs(math.remainder(self.turn, 0.5 * math.pi)) < 1e-9:
            return length
        width = length * min(1.0, 1.0 / abs(math.tan(0.5 * self.turn)))
        return width if width >= WIDTH_MIN else length

    @property
    def climb(self) -> float:
        """Height gained on a block, or past a curb or a slope [m]."""
        return (-1.0 if self.going == "down" else 1.0) * (self.height or 0.0)

    @property
    def style(self) -> tuple[float, float, bool]:
        """Overhang and thickness of the treads of stairs [m], and whether their risers are open."""
        overhang, is_open = self.overhang or 0.0, bool(self.open)
        if overhang == 0.0 and not is_open:
            return 0.0, 0.0, False
        thickness = DEFAULT_THICKNESS if self.thickness is None else self.thickness
        return overhang, thickness, is_open

    @property
    def step_count(self) -> int:
        """Number of steps of stairs: the length of their lists, or `count`."""
        for values in (self.rises, self.runs):
            if values is not None:
                return len(values)
        return self.count or 0

    @property
    def profile(self) -> list[tuple[float, float]]:
        """Height over the start and run of each tread of checked stairs [m]."""
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
