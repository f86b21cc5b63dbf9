"""What no course can be: each complaint names the field as the person wrote it."""

import difflib
import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

from drake_quad.errors import InputError
from drake_quad.terrain_elements import Element

WIDTH_MIN = 0.8  # [m] on anything narrower no stance of a robot worth climbing with fits
RUN_MIN = 0.10  # [m]
STEPS_MAX = 1000  # of a flight
FOOT_ROOM = 0.02  # [m] of tread before and behind a foot

FIELDS_OF_KIND: dict[str, tuple[str, ...]] = {
    "floor": ("length", "width"),
    "stairs": ("going", "rise", "run", "count", "rises", "runs", "width"),
    "landing": ("length", "width", "turn_deg"),
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
    checkers = [_Checker(element, f"course[{i}]", source) for i, element in enumerate(elements)]
    for checker in checkers:
        checker.check(run_min, turning_space)
    for checker in (checkers[0], checkers[-1]):
        if checker.element.kind == "stairs":
            raise checker.error("kind", "a course begins and ends on a floor or a landing")


class _Checker:
    """Checks one element."""

    def __init__(self, element: Element, path: str, source: str) -> None:
        self.element = element
        self.path = path
        self.source = source

    def error(self, field: str, remedy: str, *value: Any) -> InputError:
        """The error at `field` of this element, by default with that field's value."""
        shown = value[0] if value else getattr(self.element, field)
        path = f"{self.path}.{field}"
        return InputError(source=self.source, field=path, value=shown, remedy=remedy)

    def check(self, run_min: float, turning_space: float) -> None:
        """Checks the fields in the order in which a person would mend them."""
        self.check_word("kind", tuple(FIELDS_OF_KIND))
        kind = self.element.kind
        for name in ("turn_deg", "length", "going", "rise", "run", "count", "rises", "runs"):
            if getattr(self.element, name) is not None and name not in FIELDS_OF_KIND[kind]:
                only = "; only a landing turns" if name == "turn_deg" else ""
                raise self.error(name, f"{kind} has no {name}{only}")
        if self.element.width is not None and self.number("width") < WIDTH_MIN:
            raise self.error("width", f"must be at least {WIDTH_MIN} m")
        if kind == "stairs":
            self.check_stairs(run_min)
            return
        if self.number("length") <= 0.0:
            raise self.error("length", "must be more than 0 m")
        if self.element.turn_deg:
            self.check_turn(turning_space)

    def check_word(self, field: str, words: tuple[str, ...]) -> None:
        """The field must be one of the words."""
        value = getattr(self.element, field)
        if value not in words:
            near = difflib.get_close_matches(str(value), words, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise self.error(field, f"must be {' or '.join(words)}{hint}")

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

    def check_stairs(self, run_min: float) -> None:
        """A flight: its sense, each rise, each run, and their number."""
        self.check_word("going", ("up", "down"))
        for field, rise in self.step_values("rise", "rises"):
            if rise <= 0.0:
                sign = "negative rise" if rise < 0.0 else "no rise"
                remedy = f"{sign}: must be more than 0 m; stairs that descend say going: down"
                raise self.error(field, remedy, rise)
        for field, run in self.step_values("run", "runs"):
            if run < run_min:
                remedy = f"shorter than a foot: a tread must be at least {run_min:.3g} m deep"
                raise self.error(field, remedy, run)
        self.check_count()

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
        """The number of steps: a whole number, in bounds, and the same in whatever says it."""
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
