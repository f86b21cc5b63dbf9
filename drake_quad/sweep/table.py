"""The tables of a sweep: trials.parquet, the same whoever carried them out, and clock.parquet."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.errors import InputError
from drake_quad.plain_json import is_number, is_whole
from drake_quad.scenario import scenario_text
from drake_quad.sweep.base import Base
from drake_quad.sweep.draws import way_of
from drake_quad.sweep.journal_read import NAME as JOURNAL
from drake_quad.sweep.study_check_vary import MOST_WHOLE
from drake_quad.sweep.study_config import Study, Vary
from drake_quad.sweep.trials import Trial, count_trials, figures_of, make_trials, repeat
from drake_quad.whole_files import write_whole

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


def fitting(study: Study) -> Callable[[Result], bool]:
    """What says whether a result, with its index, can be one of this study's.

    That is, whether the tables can be made of it: a line of a journal may be spoilt.
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


def make_table(study: Study, base: Base, done: dict[int, Result]) -> pa.Table:
    """One row a trial that is done, by index, of nothing that another run would have otherwise.

    Args:
        study: Checked.
        base: Its scenario.
        done: What came of the trials, by index.
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


def make_clock(done: dict[int, Result]) -> pa.Table:
    """Seconds, memory [GiB], process and tries of each trial: of this sweep alone.

    What a journal of an older program does not have is missing.
    """
    order = sorted(done)
    columns = {"index": pa.array(order, type=pa.int64())}
    for name, kind in CLOCK_COLUMNS.items():
        columns[name] = pa.array([done[k]["clock"].get(name) for k in order], type=kind)
    return pa.table(columns)


def write_tables(
    study: Study, base: Base, done: dict[int, Result], out: Path
) -> tuple[pa.Table, pa.Table]:
    """Writes both tables into `out`; neither is ever half.

    Raises:
        InputError: They cannot be written, or one of the results is none of the study's.
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
    trials, clock = make_table(study, base, done), make_clock(done)
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
    """Of the column; what is not a number is written as JSON."""
    way = way_of(vary)
    if way in ("uniform", "log_uniform", "normal", "linspace"):
        return pa.float64()
    if way == "integers":
        return pa.int64()
    values = vary.values if vary.values is not None else vary.choice
    # Whole numbers that are no floats of a table are written as JSON, too, with every digit.
    numbers = values is not None and all(
        type(v) is float or (type(v) is int and abs(v) <= MOST_WHOLE) for v in values
    )
    return pa.float64() if numbers else pa.string()
