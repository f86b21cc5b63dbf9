"""Loads a study: from YAML to values that are checked."""

import dataclasses
import difflib
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from drake_quad.errors import InputError
from drake_quad.runs.summary_figures import FIGURES, WALL_CLOCK
from drake_quad.scenario.load import parse_override
from drake_quad.sweep.sampling import (
    DRAWN,
    GRID,
    WIDEST,
    Draws,
    Value,
    axis_values,
    distribution_of,
    multiples_within,
    support_of,
)
from drake_quad.sweep.study import Base, Gate, Limits, Study, SuccessBound, Vary, find_base
from drake_quad.util.files import MOST_YAML, read_given_text, user_path
from drake_quad.util.yaml_io import bare_as_numbers, conform, parse_yaml

MOST_BANDS = 50
LONGEST_AXIS = 10_000
MOST_WHOLE = 2**53  # up to it a float holds every whole number

Fail = Callable[[str, Any, str], InputError]

MOST_TRIALS = 1_000_000
MOST_AXES = 32  # numpy's arrays have up to 64
MOST_VARIED = 100  # fields of the scenario that differ between trials
SEED = ("simulation", "seed")

Steps = tuple[str | int, ...]

_PAIR = re.compile(r"\\ud[89ab][0-9a-f]{2}\\ud[c-f][0-9a-f]{2}")
MOST_TRIED = 300  # values that a study is checked with; loading a scenario takes 0.02 s
# Fields of any type: they are checked here, or by the scenario itself.
FREE = ("choice", "values", "cases")


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


def load_study_and_base(path: str | Path) -> tuple[Study, Base]:
    """Reads and checks a study.

    Raises:
        InputError: It cannot be read, or anything in it or in its scenario cannot be used.
    """
    source = str(path)
    try:
        text = read_given_text(user_path(path), most=MOST_YAML)
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) else "not a text file"
        remedy = f"cannot be read: {reason}; give a study in YAML, see docs/sweeps.md"
        raise InputError(source=source, field="study", value=source, remedy=remedy) from None
    study = parse_study(text, source=source)
    base = find_base(study, directory=user_path(path).parent)
    check_against(study, base, source=source)
    return study, base


def parse_study(text: str, *, source: str) -> Study:
    """A study from its YAML text, checked by itself.

    Raises:
        InputError: Something in it cannot be used.
    """
    if not text.strip():
        remedy = "empty: a study needs a scenario at least"
        raise InputError(source=source, field="document", value="", remedy=remedy)
    data = parse_yaml(text, source=source, needs="scenario: ...")
    free = _take_free(data, source=source)
    plain = conform(data, Study, path="", source=source)
    varies = plain.pop("vary", [])
    study = Study(
        vary=[Vary(**{**one, **more}) for one, more in zip(varies, free, strict=True)],
        success=[SuccessBound(**bound) for bound in plain.pop("success", [])],
        limits=Limits(**plain.pop("limits", {})),
        gate=Gate(**plain.pop("gate", {})),
        **plain,
    )
    check_study(study, source=source)
    return study


def check_against(study: Study, base: Base, *, source: str) -> None:
    """Loads the scenario as it is, and with each thing that varies at its ends.

    Values that are possible alone and impossible together come to light in their trials. So do
    impossible values of a very long list that lie between those that are tried here.

    Raises:
        InputError: The error names the first value that cannot be loaded, and why.
    """
    base.load(study.set)
    for k, vary in enumerate(study.vary):
        for value in _spread(support_of(vary), MOST_TRIED // len(study.vary)):
            try:
                base.load([*study.set, *overrides_of(vary, value)])
            except InputError as error:
                raise InputError(
                    source=source,
                    field=f"vary[{k}]",
                    value=value,
                    remedy=f"{error.field} = {error.value!r}: {error.remedy}",
                ) from None


def _spread(values: list[Value], most: int) -> list[Value]:
    """All values if they are few, else evenly spaced ones with the first and the last."""
    if len(values) <= most:
        return values
    return [values[round(k * (len(values) - 1) / (most - 1))] for k in range(most)]


def overrides_of(vary: Vary, value: Value) -> list[str]:
    """The overrides that give a trial this value."""
    if vary.cases is not None:
        return list(vary.cases[value])
    return [f"{path}={value_text(value)}" for path in (vary.path, *vary.also)]


def value_text(value: Value) -> str:
    """A value as it stands in an override: YAML in one line, numbers with every digit."""
    if isinstance(value, str) and value.isidentifier() and yaml.safe_load(value) == value:
        return value
    # JSON writes the rarer letters as two surrogates each, which YAML does not know.
    return _PAIR.sub(_as_one, json.dumps(value))


def _as_one(pair: re.Match[str]) -> str:
    letter = json.loads('"' + pair[0] + '"')
    return f"\\U{ord(letter):08x}"


def as_plain(study: Study) -> dict[str, Any]:
    """The study as plain data, all fields written."""
    return dataclasses.asdict(study)


def study_from(plain: dict[str, Any], *, source: str) -> Study:
    """The study whose `as_plain` this is, checked by itself.

    Raises:
        InputError: It is not a study's.
    """
    try:
        more = {
            "vary": [Vary(**one) for one in plain["vary"]],
            "success": [SuccessBound(**one) for one in plain["success"]],
            "limits": Limits(**plain["limits"]),
            "gate": Gate(**plain["gate"]),
        }
        study = Study(**{**plain, **more})
        check_study(study, source=source)
    except (TypeError, KeyError, AttributeError, ValueError) as problem:
        remedy = f"is no study as sweeps write it: {type(problem).__name__}: {problem}"
        raise InputError(source=source, field="definition", value="...", remedy=remedy) from None
    return study


def _take_free(data: dict[str, Any], *, source: str) -> list[dict[str, Any]]:
    """Takes the fields in FREE out of each element of `vary`; checks that JSON can hold them."""
    varies = data.get("vary")
    if not isinstance(varies, list):
        return []
    taken: list[dict[str, Any]] = []
    for k, vary in enumerate(varies):
        own = {}
        if isinstance(vary, dict):
            own = {n: bare_as_numbers(vary[n]) for n in FREE if vary.get(n) is not None}
            varies[k] = {name: value for name, value in vary.items() if name not in FREE}
        for name, value in own.items():
            path = f"vary[{k}].{name}"

            def error(remedy: str, path: str = path, value: Any = value) -> InputError:
                return InputError(source=source, field=path, value=value, remedy=remedy)

            if name == "cases":
                _check_cases(value, error)
            elif not isinstance(value, list):
                raise error("must be a list")
            try:
                json.dumps(value, allow_nan=False)
            except (TypeError, ValueError, RecursionError):
                raise error("must be finite numbers, text, lists and mappings") from None
        taken.append(own)
    return taken


def _check_cases(value: Any, error: Any) -> None:
    if not (isinstance(value, dict) and all(isinstance(name, str) for name in value)):
        raise error("must be a mapping: a name, and its list of overrides, each")
    for overrides in value.values():
        if not (isinstance(overrides, list) and all(isinstance(o, str) for o in overrides)):
            raise error("each case must be a list of overrides, path=value")
