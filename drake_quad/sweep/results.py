"""A sweep's tables: trials.parquet, alike wherever it was carried out, and clock.parquet.

Whoever had the files since may have changed them: all that is read is checked.
"""

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.errors import InputError, brief
from drake_quad.scenario.load import scenario_text
from drake_quad.sweep.journal import NAME as JOURNAL
from drake_quad.sweep.sampling import GRID, distribution_of, support_of
from drake_quad.sweep.study import Base, Study, Vary
from drake_quad.sweep.study_checks import LONGEST_AXIS, MOST_TRIALS, MOST_WHOLE
from drake_quad.sweep.study_loading import FREE
from drake_quad.sweep.trials import RANKED_BY, Trial, count_trials, figures_of, make_trials, repeat
from drake_quad.util.files import (
    MOST_JSON,
    is_number,
    is_whole,
    plain_of,
    read_given,
    read_given_table,
    write_whole,
)
from drake_quad.util.yaml_io import conform

TRIALS, CLOCK = "trials.parquet", "clock.parquet"
CLOCK_COLUMNS = {
    "wall": pa.float64(),
    "simulating": pa.float64(),
    "memory": pa.float64(),
    "process": pa.int64(),
    "tried": pa.int64(),
    "held": pa.float64(),
}
Result = dict[str, Any]

REMEDY = "give the directory of a finished `drake-quad sweep`"
TYPES = {
    pa.int64(): "whole numbers",
    pa.float64(): "numbers",
    pa.bool_(): "true or false",
    pa.string(): "text",
    pa.list_(pa.string()): "lists of text",
}

Kind = tuple[Callable[[Any], bool], str]  # whether a value is of that kind, and its name
TEXT: Kind = (lambda value: isinstance(value, str), "text")
TRUTH: Kind = (lambda value: isinstance(value, bool), "true or false")
MAPPING: Kind = (lambda value: isinstance(value, dict), "a mapping")
_LIST: Kind = (lambda value: isinstance(value, list), "a list")
_CASES: Kind = (
    lambda value: (
        isinstance(value, dict)
        and all(isinstance(case, list) for case in value.values())
        and all(isinstance(text, str) for case in value.values() for text in case)
    ),
    "a mapping of names to lists of overrides",
)

# Columns that every reader needs, and their types.
READ = {
    "index": pa.int64(),
    "seed": pa.int64(),
    "success": pa.bool_(),
    "outcome": pa.string(),
    "reason": pa.string(),
    "overrides": pa.list_(pa.string()),
}

FINDINGS, STUDY, REPORT = "sweep.json", "study.json", "report.html"


def fitting(study: Study) -> Callable[[Result], bool]:
    """Makes the check whether a result, with its index, can be one of this study's.

    A line of a journal may be damaged: tables can be made only of results that pass.
    """
    count, figures = count_trials(study), set(figures_of(study))
    whole = {name for name, kind in CLOCK_COLUMNS.items() if kind == pa.int64()}

    def fits(result: Result) -> bool:
        return (
            0 <= result["index"] < count
            and result["success"] == (result["outcome"] == "goal_reached")
            and isinstance(result.get("mode", 0), str | None)
            and result["figures"].keys() == figures
            and all(value is None or is_number(value) for value in result["figures"].values())
            and all(
                value is None or (is_whole if name in whole else is_number)(value)
                for name, value in result["clock"].items()
            )
        )

    return fits


def trials_table(study: Study, base: Base, done: dict[int, Result]) -> pa.Table:
    """One row for each trial that is done, by index, without anything that differs between runs.

    Args:
        study: The study.
        base: Its scenario.
        done: Results of the trials, by index.
    """
    names = {"index": pa.int64(), "seed": pa.int64(), "success": pa.bool_()}
    names |= dict.fromkeys(("outcome", "reason", "mode"), pa.string())
    varied = [f"vary.{vary.title}" for vary in study.vary]
    types = {name: type_of(vary) for name, vary in zip(varied, study.vary, strict=True)}
    figures = figures_of(study)
    names |= types | {f"figure.{name}": pa.float64() for name in figures}
    names |= {"overrides": pa.list_(pa.string()), "scenario": pa.string(), "command": pa.string()}
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for trial in make_trials(study, base, first=0, last=max(done, default=-1) + 1):
        if trial.index not in done:
            continue
        result = done[trial.index]
        columns["index"].append(trial.index)
        columns["seed"].append(trial.seed)
        for name in ("success", "outcome", "reason", "mode"):
            columns[name].append(result[name])
        columns["scenario"].append(result["scenario"] or _scenario_of(trial))
        for name, value in zip(varied, trial.values, strict=True):
            columns[name].append(json.dumps(value) if types[name] == pa.string() else value)
        for name in figures:
            columns[f"figure.{name}"].append(result["figures"][name])
        columns["overrides"].append(list(trial.overrides))
        columns["command"].append(repeat(trial))
    complete = len(done) == count_trials(study)
    return pa.Table.from_arrays(
        [pa.array(columns[name], type=kind) for name, kind in names.items()],
        schema=pa.schema(list(names.items()), metadata={"complete": json.dumps(complete)}),
    )


def clock_table(done: dict[int, Result]) -> pa.Table:
    """Seconds, memory [GiB], process and tries of each trial, which differ from sweep to sweep.

    Values that a journal of an older program does not have are missing.
    """
    order = sorted(done)
    columns = {"index": pa.array(order, type=pa.int64())}
    for name, kind in CLOCK_COLUMNS.items():
        columns[name] = pa.array([done[k]["clock"].get(name) for k in order], type=kind)
    return pa.table(columns)


def write_tables(
    study: Study, base: Base, done: dict[int, Result], out: Path
) -> tuple[pa.Table, pa.Table]:
    """Writes both tables into `out`, each whole or not at all.

    Raises:
        InputError: They cannot be written, or one of the results is not the study's.
    """
    fits = fitting(study)
    for index, result in done.items():
        if not fits({**result, "index": index}):
            raise InputError(
                source=str(out / JOURNAL),
                field="index",
                value=index,
                remedy="the line of that index is no result of the study: remove it, and go on "
                "with --resume",
            )
    trials, clock = trials_table(study, base, done), clock_table(done)
    for name, table in ((CLOCK, clock), (TRIALS, trials)):
        write_whole(out / name, partial(pq.write_table, table, compression="zstd"))
    return trials, clock


def _scenario_of(trial: Trial) -> str | None:
    """The scenario of a trial that gave no result, if there is such a scenario."""
    try:
        return scenario_text(trial.base.load(list(trial.overrides)))
    except InputError:
        return None


def type_of(vary: Vary) -> pa.DataType:
    """The type of the column; values that are not numbers are written as JSON."""
    way = distribution_of(vary)
    if way in ("uniform", "log_uniform", "normal", "linspace"):
        return pa.float64()
    if way == "integers":
        return pa.int64()
    values = vary.values if vary.values is not None else vary.choice
    # Whole numbers that a float cannot hold are written as JSON, too, with every digit.
    numbers = values is not None and all(
        type(v) is float or (type(v) is int and abs(v) <= MOST_WHOLE) for v in values
    )
    return pa.float64() if numbers else pa.string()


def read_plain(
    directory: Path, name: str, kinds: Mapping[str, Kind], *, perhaps: Mapping[str, Kind] = {}
) -> dict[str, Any]:
    """A file of plain values that a sweep left.

    Args:
        directory: The sweep's directory.
        name: Name of the file.
        kinds: Kinds of the values that must be there.
        perhaps: Kinds of the values that may be missing.

    Raises:
        InputError: It cannot be read, or a value is of another kind.
    """
    path = directory / name

    def error(what: str) -> InputError:
        remedy = f"{what}; {REMEDY}"
        return InputError(source=str(directory), field=name, value=str(path), remedy=remedy)

    try:
        plain = plain_of(read_given(path, most=MOST_JSON))
    except OSError as problem:
        raise error(f"cannot be read: {problem.strerror}") from None
    if plain is None:
        raise error("is cut short, or no mapping in JSON")
    for key, (fits, kind) in {**kinds, **perhaps}.items():
        if not fits(plain.get(key)) and (key in plain or key in kinds):
            remedy = f"must be {kind}; {REMEDY}"
            raise InputError(source=str(path), field=key, value=plain.get(key), remedy=remedy)
    return plain


def read_definition(directory: Path, name: str) -> dict[str, Any]:
    """The study's definition as plain data, with values of the right types.

    Args:
        directory: The sweep's directory.
        name: Name of the file that holds the definition.

    Raises:
        InputError: It cannot be read, or a value is of another type.
    """
    plain = read_plain(directory, name, {"definition": MAPPING})["definition"]
    source, given = str(directory / name), plain.get("vary")
    varies = given if isinstance(given, list) else []
    # The fields in FREE can be of any type, and are checked apart.
    free = [
        {key: one[key] for key in FREE if one.get(key) is not None} if isinstance(one, dict) else {}
        for one in varies
    ]
    rest = [
        {key: one[key] for key in one if key not in FREE} if isinstance(one, dict) else one
        for one in varies
    ]

    def fail(field: str, value: Any, what: str) -> InputError:
        remedy = f"must be {what}; {REMEDY}"
        return InputError(source=source, field=f"definition.{field}", value=value, remedy=remedy)

    for k, own in enumerate(free):
        for key, value in own.items():
            fits, kind = _CASES if key == "cases" else _LIST
            if not fits(value):
                raise fail(f"vary[{k}].{key}", value, kind)
    whole = {**plain, "vary": given if rest == [] else rest}
    typed: dict[str, Any] = conform(whole, Study, path="definition", source=source)
    typed["vary"] = [{**one, **own} for one, own in zip(typed["vary"], free, strict=True)]
    if "scenario" not in typed:
        raise fail("scenario", None, "a scenario's name")
    if typed.get("draws") not in ("independent", "common"):
        raise fail("draws", typed.get("draws"), "independent or common")
    for k, one in enumerate(typed["vary"]):
        axis = one.get("linspace")
        if axis is not None and not (len(axis) == 3 and 1 <= axis[2] <= LONGEST_AXIS):
            raise fail(f"vary[{k}].linspace", axis, f"from, to, and how many: 1 to {LONGEST_AXIS}")
    return typed


def check_column(
    table: pa.Table, name: str, kind: pa.DataType, source: str, *, gaps: bool = False
) -> None:
    """Checks that a column is of the type that sweeps write.

    Args:
        table: The file's table.
        name: Name of the column.
        kind: Type of the column, one of TYPES.
        source: The file.
        gaps: Whether values may be missing.

    Raises:
        InputError: It is not there, of another type, or has gaps.
    """
    if name not in table.column_names:
        raise strange(source, name, None, f"is not there; must be a column of {TYPES[kind]}")
    found = table[name]
    if found.type != kind:
        raise strange(source, name, str(found.type), f"must be a column of {TYPES[kind]}")
    if found.null_count and not gaps:
        raise strange(source, name, None, f"must be {TYPES[kind]} in every row")


def strange(source: str, name: str, value: Any, what: str) -> InputError:
    """The error about a column that no sweep writes so."""
    return InputError(source=source, field=name, value=value, remedy=f"{what}; {REMEDY}")


def read_table(directory: Path) -> pa.Table:
    """The trials of a sweep.

    Raises:
        InputError: If there are none in `directory`, they are cut short, or a column that is read
            is not as sweeps write it.
    """
    path = directory / TRIALS

    def error(remedy: str) -> InputError:
        return InputError(source=str(directory), field=TRIALS, value=str(path), remedy=remedy)

    try:
        table = read_given_table(path, most_rows=MOST_TRIALS)
        table.validate(full=True)  # whether text is text is seen only now
    except FileNotFoundError:
        raise error(f"not there; {REMEDY}") from None
    except (OSError, ValueError, pa.ArrowException) as problem:
        if isinstance(problem, OSError) and problem.strerror:  # Arrow's own errors have none
            raise error(f"cannot be read: {problem.strerror}") from None
        raise error("is cut short or not Parquet") from None
    if not set(table.column_names) >= READ.keys():
        raise error("is not a sweep's table")
    for name, kind in READ.items():
        check_column(table, name, kind, str(path))
    rows = zip(*(table[name].to_pylist() for name in ("index", "success", "outcome")), strict=True)
    seen: set[int] = set()
    for index, success, outcome in rows:
        if index < 0 or index in seen:
            raise strange(str(path), "index", index, "must be 0 or more, and of one row alone")
        if success != (outcome == "goal_reached"):
            what = (
                f"must be whether the outcome is goal_reached; that of trial {index} is {outcome}"
            )
            raise strange(str(path), "success", success, what)
        seen.add(index)
    return table


def values_of(vary: Vary, table: pa.Table) -> list[Any]:
    """The value that each trial has of `vary`, as it was before it was written."""
    column = table[f"vary.{vary.title}"]
    values = column.to_pylist()
    return [json.loads(value) for value in values] if column.type == pa.string() else values


def validate_results(study: Study, table: pa.Table, source: str) -> None:
    """Checks that a table that was read is the study's, in all that `summarize_sweep` reads.

    Args:
        study: The study.
        table: The table, as `read_table` returned it.
        source: The table's file.

    Raises:
        InputError: The error names the first column that is not.
    """
    varied = {f"vary.{vary.title}": vary for vary in study.vary}
    figures = {f"figure.{name}" for name in figures_of(study)}
    if f"figure.{RANKED_BY}" not in table.column_names:  # of an older sweep
        figures.remove(f"figure.{RANKED_BY}")
    for name in table.column_names:
        if name.startswith(("vary.", "figure.")) and name not in {*varied, *figures}:
            what = "is not a column of the study in study.json: the files are of two sweeps"
            raise strange(source, name, str(table[name].type), what)
    last = max(table["index"].to_pylist(), default=0)
    if last >= count_trials(study):
        most = count_trials(study) - 1
        raise strange(source, "index", last, f"must be at most {most}, by study.json")
    check_column(table, "mode", pa.string(), source, gaps=True)
    check_column(table, "command", pa.string(), source)
    for name in sorted(figures):
        check_column(table, name, pa.float64(), source, gaps=True)
        for value in table[name].to_pylist():
            if value is not None and not is_number(value):
                raise strange(source, name, value, "must be finite numbers")
    for name, vary in varied.items():
        check_column(table, name, type_of(vary), source)
        _check_varied(vary, table, name, source)


def _check_varied(vary: Vary, table: pa.Table, name: str, source: str) -> None:
    """Checks that the values of a column are ones that the study can have."""
    values, known = table[name].to_pylist(), support_of(vary)
    if distribution_of(vary) in (*GRID, "choice"):
        keys = {json.dumps(one) for one in known} if type_of(vary) == pa.string() else {*known}
        wrong = [value for value in values if value not in keys]
        what = f"must be one of {brief(known)}"
    else:
        low, high = known
        slack = vary.step or 1e-9 * (high - low)  # older sweeps rounded beyond the ends
        wrong = [value for value in values if not low - slack <= value <= high + slack]
        what = f"must be from {low:g} to {high:g}"
    if wrong:
        raise strange(source, name, wrong[0], f"{what}, by study.json")
