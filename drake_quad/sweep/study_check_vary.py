"""What one thing that varies must be: its path, its one way, and that way's numbers."""

import json
import math
from collections.abc import Callable
from typing import Any

from drake_quad.errors import InputError
from drake_quad.scenario_override import parse_override
from drake_quad.sweep.draws import DRAWN, GRID, WIDEST, axis_values, multiples_within
from drake_quad.sweep.study_config import Vary

MOST_BANDS = 50
LONGEST_AXIS = 10_000
MOST_WHOLE = 2**53  # up to which every whole number is a number of a table

Fail = Callable[[str, Any, str], InputError]


def check_vary(vary: Vary, at: str, fail: Fail) -> None:
    """Raises what `fail` makes of the first value that is wrong in `vary`, which stands at `at`."""
    given = [way for way in (*DRAWN, *GRID) if getattr(vary, way) is not None]
    if len(given) != 1:
        words = ", ".join((*DRAWN, *GRID))
        told = " and ".join(given) or "none of them"
        raise fail(at, vary.title, f"must have one of {words}; has {told}")
    (way,) = given
    value = getattr(vary, way)
    if way == "cases":
        if vary.path or vary.also or not vary.name:
            raise fail(f"{at}.cases", list(value), "has a name, and neither path nor also")
        for name, overrides in value.items():
            for k, text in enumerate(overrides):
                check_override(text, f"{at}.cases.{name}[{k}]", fail)
    else:
        for k, path in enumerate((vary.path, *vary.also)):
            field = f"{at}.path" if k == 0 else f"{at}.also[{k - 1}]"
            if "=" in path:
                raise fail(field, path, "must be a field's path alone, such as simulation.friction")
            check_override(f"{path}=0", field, fail)
    if not value or (isinstance(value, list | dict) and len(value) > LONGEST_AXIS):
        raise fail(f"{at}.{way}", value, f"must have from 1 to {LONGEST_AXIS} elements")
    _check_numbers(vary, way, f"{at}.{way}", fail)
    if way in GRID and _has_one_twice(axis_values(vary)):
        raise fail(f"{at}.{way}", value, "has one twice: its trials would count twice")
    if vary.step is not None and (
        way not in ("uniform", "log_uniform", "normal") or not vary.step > 0.0
    ):
        raise fail(f"{at}.step", vary.step, "must be more than 0, of a drawn number")
    if vary.step is not None:
        _check_step(vary, vary.step, f"{at}.step", fail)
    if not 1 <= vary.bands <= MOST_BANDS:
        raise fail(f"{at}.bands", vary.bands, f"must be from 1 to {MOST_BANDS}")


def _has_one_twice(values: list[Any]) -> bool:
    """Numbers are compared as such; beside anything else true, 1 and 1.0 are three."""
    numbers = all(type(value) in (int, float) for value in values)
    return len(set(values if numbers else map(json.dumps, values))) != len(values)


def _check_step(vary: Vary, step: float, field: str, fail: Fail) -> None:
    """What is drawn is a number of steps that can be counted."""
    drawn = vary.uniform or vary.log_uniform or vary.normal or [0.0]
    reach = max(map(abs, drawn)) * (1.0 if vary.normal is None else 1.0 + WIDEST)
    if not reach / step < MOST_WHOLE:
        raise fail(field, step, f"is too small for numbers as far from 0 as {reach:g}")
    ends = vary.uniform or vary.log_uniform
    if ends is not None and len(multiples_within(ends, step)) < 2:
        low, high = ends
        remedy = f"leaves nothing to draw: fewer than two multiples of it from {low:g} to {high:g}"
        raise fail(field, step, remedy)


def _check_numbers(vary: Vary, way: str, field: str, fail: Fail) -> None:
    """The numbers of those ways that have two or three."""
    value = getattr(vary, way)
    if way in ("uniform", "log_uniform", "integers"):
        if len(value) != 2 or not value[0] < value[1]:
            raise fail(field, value, "must be two numbers, the lesser first")
        if way == "integers" and max(map(abs, value)) > MOST_WHOLE:
            raise fail(field, value, f"must be from {-MOST_WHOLE} to {MOST_WHOLE}")
        if not math.isfinite(float(value[1]) - float(value[0])):
            raise fail(field, value, "are too far apart")
        if way == "log_uniform" and not value[0] > 0.0:
            raise fail(field, value, "must be more than 0")
        if way == "log_uniform" and not math.isfinite(float(value[1]) / float(value[0])):
            raise fail(field, value, "are too far apart")
    elif way == "normal" and (len(value) != 2 or not 0.0 < value[1] < 1e300):
        raise fail(field, value, "must be mean and standard deviation, the latter more than 0")
    elif way == "linspace":
        whole = len(value) == 3 and value[2] == int(value[2]) and 1 <= value[2] <= LONGEST_AXIS
        if not whole:
            raise fail(field, value, f"must be from, to, and how many: 1 to {LONGEST_AXIS}")


def check_override(text: str, field: str, fail: Fail) -> None:
    """The same of an override."""
    try:
        parse_override(text)
    except InputError as error:
        raise fail(field, text, error.remedy) from None
