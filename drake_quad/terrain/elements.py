"""One stretch of a course, and the checks of its fields.

A course is a list of `Element`s, one after the other. Every step of a flight is a riser followed
by a tread of its run, going up and going down alike: so a flight of n steps has n risers, is
sum(runs) long, and its last tread is flush with the element after it. A run is measured from
nosing to nosing, as one sees it from above: an overhang takes nothing from it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field as yaml_field
from itertools import accumulate, pairwise
from numbers import Integral, Real
from typing import Any

from drake_quad.errors import InputError, did_you_mean
from drake_quad.util.schema import TEXT, FieldBound, number

DEFAULT_WIDTH = 2.0  # [m] of an element without a width, but for a landing to turn on
WIDTH_MIN = 0.8  # [m] on anything narrower no stance of a robot that climbs stairs fits
TURNING_SPACE = 1.5  # [m] to turn on, of courses that are read before the robot is
DEFAULT_THICKNESS = 0.04  # [m] of a tread that reaches out, or lies over an open riser
LONGEST = 1000.0  # [m] of a stretch of the course, and of all of it
STEPS_MAX = 1000  # of a flight
ELEMENTS_MAX = 1000  # of a course
RISE_MAX, RUN_MAX = 2.0, 5.0  # [m] of a step: more is a slip of the pen, such as of millimetres
RUN_MIN = 0.10  # [m]
FOOT_ROOM = 0.02  # [m] of tread before and behind a foot
BACK_DEG = 180.0  # by which a robot turns to go back
STEEPEST = 0.7  # rise over length of a slope: on anything steeper nothing stands by friction


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


_STAIRS = ("going", "rise", "run", "count", "rises", "runs", "overhang", "open", "thickness")
FIELDS_OF_KIND: dict[str, tuple[str, ...]] = {
    "floor": ("length", "width"),
    "stairs": (*_STAIRS, "width"),
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


class Checker:
    """Checks fields of one element.

    Args:
        element: The element as it was written.
        path: Path of the element in the file, for example `course[2]`.
        source: What an error names as the holder of the field, for example the file.
    """

    def __init__(self, element: Element, path: str, source: str) -> None:
        self.element = element
        self.path = path
        self.source = source

    def error(self, field: str, remedy: str, *value: Any) -> InputError:
        """The error at `field` of this element, by default with that field's value."""
        shown = value[0] if value else getattr(self.element, field)
        path = f"{self.path}.{field}"
        return InputError(source=self.source, field=path, value=shown, remedy=remedy)

    def check_word(self, field: str, words: tuple[str, ...]) -> None:
        """The field must be one of the words."""
        value = getattr(self.element, field)
        if value not in words:
            raise self.error(field, f"must be {' or '.join(words)}{did_you_mean(value, words)}")

    def number(self, field: str) -> float:
        """The field as a finite float, or the error."""
        value = getattr(self.element, field)
        if value is None:
            raise self.error(field, f"{self.element.kind} must say its {field}")
        return self.finite(field, value)

    def finite(self, field: str, value: Any) -> float:
        """The value as a finite float, or the error at `field`."""
        if isinstance(value, bool) or not isinstance(value, Real):
            raise self.error(field, "must be a number", value)
        if not math.isfinite(value):
            raise self.error(field, "must be finite", value)
        return float(value)


class StairsChecker(Checker):
    """Checks a flight, but for the fields that other elements have too."""

    def check(self, run_min: float) -> None:
        """A flight: each rise, each run, their number, and how it is built."""
        for field, rise in self.step_values("rise", "rises"):
            if rise <= 0.0:
                sign = "negative rise" if rise < 0.0 else "no rise"
                remedy = f"{sign}: must be more than 0 m; stairs that descend say going: down"
                raise self.error(field, remedy, rise)
            if rise > RISE_MAX:
                raise self.error(field, f"must be at most {RISE_MAX:g} m; in metres?", rise)
        for field, run in self.step_values("run", "runs"):
            if run < run_min:
                remedy = f"shorter than a foot: a tread must be at least {run_min:.3g} m deep"
                raise self.error(field, remedy, run)
            if run > RUN_MAX:
                remedy = f"must be at most {RUN_MAX:g} m; in metres? Beyond that it is a landing"
                raise self.error(field, remedy, run)
        self.check_count()
        self.check_style()

    def check_style(self) -> None:
        """How the treads are built: their overhang and thickness, and whether risers are open."""
        element = self.element
        if element.open is not None and not isinstance(element.open, bool):
            raise self.error("open", "must be true or false")
        if element.overhang is not None:
            least = min(run for _, run in self.step_values("run", "runs"))
            if not 0.0 <= self.number("overhang") <= 0.5 * least:
                raise self.error("overhang", "must be from 0 to half of the shortest run")
        if element.thickness is not None:
            if not (element.open or element.overhang):
                raise self.error("thickness", "only of treads with an overhang or open risers")
            if self.number("thickness") <= 0.0:
                raise self.error("thickness", "must be more than 0 m")
        thickness = element.style[1]
        if thickness >= min(rise for _, rise in self.step_values("rise", "rises")):
            remedy = f"treads {thickness:g} m thick fill the lowest riser: they must be thinner"
            raise self.error("thickness", remedy)

    def step_values(self, one: str, many: str) -> list[tuple[str, float]]:
        """Field and value of every rise (or run), whether written once or step by step."""
        values = getattr(self.element, many)
        if values is None:
            return [(one, self.number(one))]
        if getattr(self.element, one) is not None:
            raise self.error(many, f"say {one} or {many}, not both")
        if len(values) == 0:
            raise self.error(many, "needs a step at least")
        return [(f"{many}[{k}]", self.finite(f"{many}[{k}]", v)) for k, v in enumerate(values)]

    def check_count(self) -> None:
        """The number of steps: whole, within bounds, and the same in all fields that give it."""
        element = self.element
        count, rises, runs = element.count, element.rises, element.runs
        if rises is not None and runs is not None and len(rises) != len(runs):
            remedy = f"has {len(runs)} steps but rises has {len(rises)}: one value for each step"
            raise self.error("runs", remedy)
        if rises is None and runs is None:
            if isinstance(count, bool) or not isinstance(count, Integral) or count < 1:
                raise self.error("count", "must be a whole number of steps, at least 1")
        elif count is not None and count != element.step_count:
            raise self.error("count", f"the lists have {element.step_count} steps: leave it out")
        if element.step_count > STEPS_MAX:
            raise self.error("count", f"a flight has at most {STEPS_MAX} steps: add a landing")


LEVEL = ("floor", "landing")


def check_elements(
    elements: Sequence[Element],
    *,
    source: str = "course",
    foot_radius: float = 0.035,
    turning_space: float = TURNING_SPACE,
) -> None:
    """Raises `InputError` at the first field that no course can have.

    Args:
        elements: The course, in walking order.
        source: What the error names as the holder of the field, for example the file.
        foot_radius: Radius of the robot's feet [m]: a tread must be deeper than a foot.
        turning_space: Shortest landing on which the robot turns [m].
    """
    if not elements:
        raise InputError(source=source, field="course", value=[], remedy="needs a floor at least")
    if len(elements) > ELEMENTS_MAX:
        raise InputError(
            source=source, field="course", value=f"{len(elements)} elements",
            remedy=f"may have {ELEMENTS_MAX} elements at most",
        )  # fmt: skip
    run_min = max(RUN_MIN, 2.0 * foot_radius + 2.0 * FOOT_ROOM)
    checkers = [
        _ElementChecker(element, f"course[{i}]", source) for i, element in enumerate(elements)
    ]
    for checker in checkers:
        checker.check(run_min, turning_space)
    for checker in checkers[:-1]:
        if checker.element.kind == "return":
            raise checker.error("kind", "is where the course ends: nothing may follow it")
    if checkers[-1].element.kind == "return":
        _check_return(checkers, turning_space)
        checkers.pop()
    for checker in (checkers[0], checkers[-1]):
        if checker.element.kind not in LEVEL:
            raise checker.error("kind", "a course begins and ends on a floor or a landing")
    for before, checker in pairwise(checkers):
        _check_edge(before.element, checker)


def _check_return(checkers: Sequence["_ElementChecker"], turning_space: float) -> None:
    """The way back begins in the middle of a floor or a landing that is large enough to turn on."""
    own = checkers[-1]
    before = checkers[-2].element if len(checkers) > 1 else None
    if before is None or before.kind not in LEVEL or before.turn_deg:
        raise own.error("kind", "must follow a floor or a landing that leads straight on")
    for field in ("length", "width"):
        size = getattr(before, field)
        if size is not None and size < turning_space:
            remedy = f"too small to turn back on: must be at least {turning_space} m"
            raise checkers[-2].error(field, remedy)


def _check_edge(before: Element, checker: Checker) -> None:
    """Stairs that go down from an overhang need ground before them that can be cut back."""
    stairs = checker.element
    if stairs.kind != "stairs" or stairs.going != "down" or not stairs.overhang or stairs.open:
        return
    if before.kind not in LEVEL:
        remedy = "stairs that go down from an overhang begin at a floor or a landing"
        raise checker.error("overhang", remedy)
    if stairs.overhang > 0.5 * (before.length or 0.0):
        raise checker.error("overhang", "reaches over more than half of what is before it")


class _ElementChecker(Checker):
    """Checks one element."""

    def check(self, run_min: float, turning_space: float) -> None:
        """Checks the fields in the order in which a person would mend them."""
        self.check_word("kind", tuple(FIELDS_OF_KIND))
        kind = self.element.kind
        for name in ("turn_deg", "length", "width", *_STAIRS, "height"):
            if getattr(self.element, name) is not None and name not in FIELDS_OF_KIND[kind]:
                only = "; only a landing turns" if name == "turn_deg" else ""
                raise self.error(name, f"{kind} has no {name}{only}")
        if self.element.width is not None and self.number("width") < WIDTH_MIN:
            raise self.error("width", f"must be at least {WIDTH_MIN} m")
        if "going" in FIELDS_OF_KIND[kind]:
            self.check_word("going", ("up", "down"))
        if kind == "stairs":
            StairsChecker(self.element, self.path, self.source).check(run_min)
            return
        for name in ("length", "height"):
            if name in FIELDS_OF_KIND[kind] and self.number(name) <= 0.0:
                raise self.error(name, "must be more than 0 m")
        if kind in ("block", "curb") and self.number("height") > RISE_MAX:
            raise self.error("height", f"must be at most {RISE_MAX:g} m; in metres?")
        if kind == "return":
            if self.element.turn_deg is not None and abs(self.number("turn_deg")) != BACK_DEG:
                raise self.error("turn_deg", f"must be {BACK_DEG:g} or -{BACK_DEG:g} degrees")
            return
        if kind == "slope" and self.number("height") > STEEPEST * self.number("length"):
            raise self.error("height", f"too steep: at most {STEEPEST:g} of the length")
        if self.element.turn_deg:
            self.check_turn(turning_space)

    def check_turn(self, turning_space: float) -> None:
        """A landing to turn on: long enough, and square where the turn is a right angle."""
        turn, length = self.number("turn_deg"), self.number("length")
        if abs(turn) > 180.0:
            raise self.error("turn_deg", "must be within -180 and 180 degrees")
        if length < turning_space:
            raise self.error("length", f"too short to turn on: must be at least {turning_space} m")
        width = length if self.element.width is None else self.element.width
        right_angle = abs(math.remainder(turn, 90.0)) < 1e-6
        if width > length or (right_angle and width < length):
            remedy = f"a landing to turn on is as wide as long: leave it out, or {length}"
            raise self.error("width", remedy)
