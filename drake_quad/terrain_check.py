"""What no course can be: each complaint names the field as the person wrote it."""

import math
from collections.abc import Sequence
from itertools import pairwise

from drake_quad.errors import InputError
from drake_quad.terrain_check_field import Checker
from drake_quad.terrain_check_stairs import RISE_MAX, StairsChecker
from drake_quad.terrain_elements import WIDTH_MIN, Element

RUN_MIN = 0.10  # [m]
LEVEL = ("floor", "landing")
FOOT_ROOM = 0.02  # [m] of tread before and behind a foot

STEEPEST = 0.7  # rise over length of a slope: on anything steeper nothing stands by friction

_STAIRS = ("going", "rise", "run", "count", "rises", "runs", "overhang", "open", "thickness")
FIELDS_OF_KIND: dict[str, tuple[str, ...]] = {
    "floor": ("length", "width"),
    "stairs": (*_STAIRS, "width"),
    "landing": ("length", "width", "turn_deg"),
    "block": ("length", "height", "width"),
    "curb": ("going", "height"),
    "slope": ("going", "length", "height", "width"),
}


def check_elements(
    elements: Sequence[Element],
    *,
    source: str = "course",
    foot_radius: float = 0.035,
    turning_space: float = 1.5,
) -> None:
    """Raises `InputError` at the first field that no course can have.

    Args:
        elements: The course, in walking order.
        source: What the error names as the holder of the field, for example the file.
        foot_radius: Of the robot [m]: a tread must be deeper than a foot.
        turning_space: Shortest landing on which the robot turns [m].
    """
    if not elements:
        raise InputError(source=source, field="course", value=[], remedy="needs a floor at least")
    run_min = max(RUN_MIN, 2.0 * foot_radius + 2.0 * FOOT_ROOM)
    checkers = [
        _ElementChecker(element, f"course[{i}]", source) for i, element in enumerate(elements)
    ]
    for checker in checkers:
        checker.check(run_min, turning_space)
    for checker in (checkers[0], checkers[-1]):
        if checker.element.kind not in LEVEL:
            raise checker.error("kind", "a course begins and ends on a floor or a landing")
    for before, checker in pairwise(checkers):
        _check_edge(before.element, checker)


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
