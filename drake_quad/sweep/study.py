"""Studies: read from YAML, and checked against the scenario that they vary."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import yaml

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_YAML, read_given_text
from drake_quad.scenario_schema import conform
from drake_quad.sweep.base import Base, find_base
from drake_quad.sweep.draws import Value, extremes
from drake_quad.sweep.study_check import check_study
from drake_quad.sweep.study_config import Bound, Gate, Limits, Study, Vary
from drake_quad.user_path import user_path
from drake_quad.yaml_text import parse_yaml

_PAIR = re.compile(r"\\ud[89ab][0-9a-f]{2}\\ud[c-f][0-9a-f]{2}")
MOST_TRIED = 300  # values that a study is checked with; loading a scenario takes some 0.02 s
# What conform cannot know the types of: they are checked here, or by the scenario itself.
FREE = ("choice", "values", "cases")


def load_study(path: str | Path) -> tuple[Study, Base]:
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
        InputError: Anything in it that cannot be used.
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
        success=[Bound(**bound) for bound in plain.pop("success", [])],
        limits=Limits(**plain.pop("limits", {})),
        gate=Gate(**plain.pop("gate", {})),
        **plain,
    )
    check_study(study, source=source)
    return study


def check_against(study: Study, base: Base, *, source: str) -> None:
    """Loads the scenario as it is, and with each thing that varies at its ends.

    Two values that each can be and together cannot are found by the trials that have them; so are,
    of a very long list, those between the ones that are tried.

    Raises:
        InputError: The first that cannot be loaded, with what the scenario says of it.
    """
    base.load(study.set)
    for k, vary in enumerate(study.vary):
        for value in _spread(extremes(vary), MOST_TRIED // len(study.vary)):
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
    """All of the values, or evenly spaced ones of them, the first and the last as well."""
    if len(values) <= most:
        return values
    return [values[round(k * (len(values) - 1) / (most - 1))] for k in range(most)]


def overrides_of(vary: Vary, value: Value) -> list[str]:
    """The overrides that give a trial this value."""
    if vary.cases is not None:
        return list(vary.cases[value])
    return [f"{path}={value_text(value)}" for path in (vary.path, *vary.also)]


def value_text(value: Value) -> str:
    """A value as an override has it: YAML in one line, every digit of a number."""
    if isinstance(value, str) and value.isidentifier() and yaml.safe_load(value) == value:
        return value
    # JSON has the rarer letters as two surrogates each, of which YAML knows nothing.
    return _PAIR.sub(_as_one, json.dumps(value))


def _as_one(pair: re.Match[str]) -> str:
    letter = json.loads('"' + pair[0] + '"')
    return f"\\U{ord(letter):08x}"


def as_plain(study: Study) -> dict[str, Any]:
    """The study as plain data, all fields written."""
    return dataclasses.asdict(study)


def study_from(plain: dict[str, Any], *, source: str) -> Study:
    """The study that `as_plain` made this of, checked by itself.

    Raises:
        InputError: It was made of none.
    """
    try:
        more = {
            "vary": [Vary(**one) for one in plain["vary"]],
            "success": [Bound(**one) for one in plain["success"]],
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
    """Takes the fields FREE out of every element of `vary`, checked to be what JSON can hold."""
    varies = data.get("vary")
    if not isinstance(varies, list):
        return []
    taken: list[dict[str, Any]] = []
    for k, vary in enumerate(varies):
        own = {}
        if isinstance(vary, dict):
            own = {name: vary[name] for name in FREE if vary.get(name) is not None}
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
