"""Checks of a study by itself, whatever its scenario."""

import difflib
import json
import math
from collections.abc import Callable
from typing import Any

from drake_quad.errors import InputError
from drake_quad.runs.summary_figures import FIGURES, WALL_CLOCK
from drake_quad.scenario.load import parse_override
from drake_quad.sweep.sampling import (
    DRAWN,
    GRID,
    WIDEST,
    Draws,
    axis_values,
    distribution_of,
    multiples_within,
)
from drake_quad.sweep.study import Study, Vary

MOST_BANDS = 50
LONGEST_AXIS = 10_000
MOST_WHOLE = 2**53  # up to it a float holds every whole number

Fail = Callable[[str, Any, str], InputError]

MOST_TRIALS = 1_000_000
MOST_AXES = 32  # numpy's arrays have up to 64
MOST_VARIED = 100  # fields of the scenario that differ between trials
SEED = ("simulation", "seed")

Steps = tuple[str | int, ...]


def check_vary(vary: Vary, at: str, fail: Fail) -> None:
    """Raises what `fail` makes of the first value that is wrong in `vary`, which stands at `at`."""
    given = [way for way in (*DRAWN, *GRID) if getattr(vary, way) is not None]
    if len(given) != 1:
        words = ", ".join((*DRAWN, *GRID))
        has = " and ".join(given) or "none of them"
        raise fail(at, vary.title, f"must have one of {words}; has {has}")
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
    """Whether a value occurs twice: numbers compare as such; else true, 1 and 1.0 differ."""
    numbers = all(type(value) in (int, float) for value in values)
    return len(set(values if numbers else map(json.dumps, values))) != len(values)


def _check_step(vary: Vary, step: float, field: str, fail: Fail) -> None:
    """Checks that draws are a number of steps that a float can hold."""
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
    """Checks the numbers of the ways that have two or three."""
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
    """Raises what `fail` makes of an override that cannot be read."""
    try:
        parse_override(text)
    except InputError as error:
        raise fail(field, text, error.remedy) from None


def check_study(study: Study, *, source: str) -> None:
    """Raises `InputError` at the first value that no study can have.

    Args:
        study: The study as it was read, with values of the right types.
        source: The file, which the error names.
    """

    def fail(field: str, value: Any, remedy: str) -> InputError:
        return InputError(source=source, field=field, value=value, remedy=remedy)

    if not study.scenario:
        raise fail("scenario", "", "must say which scenario: a shipped one's name, or a file")
    for path, words in (("sampling", ("random", "sobol")), ("draws", ("independent", "common"))):
        if getattr(study, path) not in words:
            raise fail(path, getattr(study, path), f"must be {' or '.join(words)}")
    if study.seed < 0:
        raise fail("seed", study.seed, "must not be negative")
    if len(study.vary) > MOST_VARIED or len(study.set) > MOST_VARIED:
        name = "vary" if len(study.vary) > MOST_VARIED else "set"
        remedy = f"at most {MOST_VARIED} can be given"
        raise fail(name, f"{len(getattr(study, name))} elements", remedy)
    for k, text in enumerate(study.set):
        check_override(text, f"set[{k}]", fail)
    for k, vary in enumerate(study.vary):
        check_vary(vary, f"vary[{k}]", fail)
    _check_names(study, fail)
    _check_counts(study, fail)
    _check_figures(study, fail)
    for name, least, most in (
        ("wall_time", 0.1, 1e6),
        ("memory", 0.5, 1024.0),
        ("retries", 0, 100),
        ("recycle", 1, 100_000),
    ):
        value = getattr(study.limits, name)
        if not least <= value <= most:
            raise fail(f"limits.{name}", value, f"must be from {least:g} to {most:g}")
    rate = study.gate.rate
    if rate is not None and not 0.0 <= rate <= 1.0:
        raise fail("gate.rate", rate, "must be from 0 to 1")
    each, names = study.gate.each, study.by_name()
    if each is not None and rate is None:
        raise fail("gate.each", each, "has no rate to ask for: give gate.rate, too")
    if each is not None and each not in names:
        known = ", ".join(sorted(names)) or "nothing here"
        raise fail("gate.each", each, f"must be the name or path of what varies: {known}")


def _check_names(study: Study, fail: Fail) -> None:
    """Checks that nothing varies twice, whole or in part, and that maps name what varies."""
    titles: set[str] = set()
    seen: dict[Steps, int] = {}
    for k, vary in enumerate(study.vary):
        if vary.title in titles:
            raise fail(f"vary[{k}]", vary.title, "is given twice")
        titles.add(vary.title)
        own = [path for path in (vary.path, *vary.also) if path]
        if len({_steps_of(path) for path in own}) != len(own):
            raise fail(f"vary[{k}].also", vary.also, "names a path twice")
        cases = (vary.cases or {}).values()
        paths = [*own, *(text.partition("=")[0] for overrides in cases for text in overrides)]
        mine: dict[Steps, int] = {}
        for path in paths:
            steps = _steps_of(path)
            for before, j in seen.items() if steps not in mine else ():
                if all(a == b for a, b in zip(steps, before, strict=False)):
                    remedy = f"is given twice: vary[{j}] sets that or a part of it as well"
                    raise fail(f"vary[{k}]", path.strip(), remedy)
            mine[steps] = k
            if len(seen) + len(mine) > MOST_VARIED:
                remedy = f"is one field too many: at most {MOST_VARIED} can vary"
                raise fail(f"vary[{k}]", path.strip(), remedy)
        seen |= mine
    known = set(study.by_name())
    for k, pair in enumerate(study.maps):
        if len(pair) != 2 or pair[0] == pair[1] or not set(pair) <= known:
            remedy = f"must be two of {', '.join(sorted(known)) or 'what varies'}"
            raise fail(f"maps[{k}]", pair, remedy)


def _steps_of(path: str) -> Steps:
    return parse_override(f"{path}=0").steps


def _check_counts(study: Study, fail: Fail) -> None:
    """Checks that trials are neither none, nor too many, nor all alike."""
    if study.trials < 1:
        raise fail("trials", study.trials, "must be 1 or more")
    grid = [vary for vary in study.vary if distribution_of(vary) in GRID]
    if len(grid) > MOST_AXES:
        raise fail("vary", f"{len(grid)} axes", f"a grid has at most {MOST_AXES}")
    if study.trials > 1 and len(grid) == len(study.vary) and _seeds(study):
        remedy = "would be alike: simulation.seed is given, and nothing is drawn; give 1"
        raise fail("trials", study.trials, remedy)
    cells = math.prod(len(v.values or v.cases or "x") for v in study.vary)
    cells *= math.prod(int(v.linspace[2]) for v in study.vary if v.linspace)
    if cells * study.trials > MOST_TRIALS:
        remedy = f"makes {cells * study.trials} trials; at most {MOST_TRIALS}"
        raise fail("trials", study.trials, remedy)
    if study.sampling == "sobol" and len(Draws(study).drawn) > 1000:
        raise fail("sampling", study.sampling, "takes at most 1000 draws")


def _seeds(study: Study) -> bool:
    """Whether an override, or a value of the grid, sets the seed of its trials."""
    texts = [
        *study.set,
        *(o for v in study.vary for case in (v.cases or {}).values() for o in case),
    ]
    given = [(one.steps, one.value) for one in map(parse_override, texts)]
    for vary in study.vary:
        steps = [_steps_of(path) for path in (vary.path, *vary.also) if path]
        given += [(own, value) for own in steps for value in axis_values(vary)[:1]]
    return any(
        steps == SEED or (steps == SEED[:1] and isinstance(value, dict) and SEED[1] in value)
        for steps, value in given
    )


def _check_figures(study: Study, fail: Fail) -> None:
    """Checks that figures exist, are named once, and do not depend on the machine."""
    for k, bound in enumerate(study.success):
        if not bound.figure:
            raise fail(f"success[{k}].figure", "", "must name a figure of summary.json")
        if bound.least is None and bound.most is None:
            raise fail(f"success[{k}]", bound.figure, "must say least or most")
        own = [other for other in study.success[: k + 1] if other.figure == bound.figure]
        least = max((one.least for one in own if one.least is not None), default=-math.inf)
        most = min((one.most for one in own if one.most is not None), default=math.inf)
        if least > most:
            remedy = f"no trial can keep least {least:g} and most {most:g}"
            raise fail(f"success[{k}]", bound.figure, remedy)
    named = [(f"success[{k}].figure", bound.figure) for k, bound in enumerate(study.success)]
    named += [(f"figures[{k}]", figure) for k, figure in enumerate(study.figures)]
    for field, figure in named:
        if figure in WALL_CLOCK:
            raise fail(field, figure, "must be a figure that a trial has again when run again")
        if figure not in FIGURES:
            near = difflib.get_close_matches(figure, FIGURES, n=1, cutoff=0.4)
            remedy = "must be a number of summary.json" + (f": {near[0]}?" if near else "")
            raise fail(field, figure, f"{remedy} (docs/log_format.md lists them)")
    if len(set(study.figures)) != len(study.figures):
        raise fail("figures", study.figures, "names one twice")
