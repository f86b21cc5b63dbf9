"""Loads a study: from YAML to values that are checked."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import yaml

from drake_quad.errors import InputError
from drake_quad.sweep.sampling import (
    Value,
    support_of,
)
from drake_quad.sweep.study import Base, Gate, Limits, Study, SuccessBound, Vary, find_base
from drake_quad.sweep.study_checks import check_study
from drake_quad.util.files import MOST_YAML, read_given_text, user_path
from drake_quad.util.yaml_io import bare_as_numbers, conform, parse_yaml

_PAIR = re.compile(r"\\ud[89ab][0-9a-f]{2}\\ud[c-f][0-9a-f]{2}")
MOST_TRIED = 300  # values that a study is checked with; loading a scenario takes 0.02 s
# Fields of any type: they are checked here, or by the scenario itself.
FREE = ("choice", "values", "cases")


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
    try:
        base.load(study.set)
    except InputError as error:
        for k, override in enumerate(study.set):
            field = override.partition("=")[0].strip()
            if error.source == f"override {override}" or (
                error.source == "override" and error.field == field
            ):
                raise _within(source, f"set[{k}]", override, error) from None
        raise _within(source, "scenario", study.scenario, error) from None
    for k, vary in enumerate(study.vary):
        for value in _spread(support_of(vary), MOST_TRIED // len(study.vary)):
            try:
                base.load([*study.set, *overrides_of(vary, value)])
            except InputError as error:
                raise _within(source, f"vary[{k}]", value, error) from None


def _within(source: str, field: str, value: object, error: InputError) -> InputError:
    """The error of a scenario as one of the study's field that led to it."""
    remedy = f"{error.field} = {error.value!r}: {error.remedy}"
    return InputError(source=source, field=field, value=value, remedy=remedy)


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
