"""Whether a sweep's table that was read is that of its study, in all that is told of it."""

import json

import pyarrow as pa

from drake_quad.errors import brief
from drake_quad.plain_json import is_number
from drake_quad.sweep.draws import GRID, extremes, way_of
from drake_quad.sweep.reading import check_column, strange
from drake_quad.sweep.study_config import Study, Vary
from drake_quad.sweep.table import type_of
from drake_quad.sweep.trials import RANKED_BY, count_trials, figures_of


def check_told(study: Study, table: pa.Table, source: str) -> None:
    """Sees that a table that was read is the study's, in all that `tell` reads.

    Args:
        study: Checked.
        table: Of `read_table`.
        source: Its file.

    Raises:
        InputError: The first column that is not.
    """
    varied = {f"vary.{vary.title}": vary for vary in study.vary}
    figures = {f"figure.{name}" for name in figures_of(study)}
    if f"figure.{RANKED_BY}" not in table.column_names:  # of an older sweep
        figures.remove(f"figure.{RANKED_BY}")
    for name in table.column_names:
        if name.startswith(("vary.", "figure.")) and name not in {*varied, *figures}:
            what = "is no column of the study in study.json: the two are of two sweeps"
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
    """Sees that the values of a column are such as the study has."""
    values, known = table[name].to_pylist(), extremes(vary)
    if way_of(vary) in (*GRID, "choice"):
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
