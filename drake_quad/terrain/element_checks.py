"""Checks of a course's elements, in the order in which a person would mend them."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from numbers import Integral, Real
from typing import Any

from drake_quad.errors import InputError, did_you_mean
from drake_quad.terrain.elements import (
    BACK_DEG,
    ELEMENTS_MAX,
    FIELDS_OF_KIND,
    FOOT_ROOM,
    RISE_MAX,
    RUN_MAX,
    RUN_MIN,
    STAIRS_FIELDS,
    STEEPEST,
    STEPS_MAX,
    TURNING_SPACE,
    WIDTH_MIN,
    Element,
)


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
    many = isinstance(elements, Iterable) and not isinstance(elements, str)
    for one in elements if many else [elements]:
        if not many or not isinstance(one, Element):
            raise InputError(
                source=source, field="course", value=type(one).__name__,
                remedy='must be a list of Elements, such as [Element("floor", length=2.0)]',
            )  # fmt: skip
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
        for name in ("turn_deg", "length", "width", *STAIRS_FIELDS, "height"):
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
