"""Which trials of a sweep went worst."""

from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.sweep.bands import places_of
from drake_quad.sweep.draws import GRID, way_of
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.table_read import values_of
from drake_quad.sweep.trials import RANKED_BY

LISTED = 12  # trials that are told of


def worst_first(table: pa.Table) -> list[int]:
    """The rows of the table, all of them: those that failed, then those that did not.

    Both by their least margin; those that have none come after, in order of their index.
    """
    margins, success = _margins(table), table["success"].to_pylist()
    return sorted(
        range(len(table)),
        key=lambda k: (success[k], np.inf if margins[k] is None else margins[k], k),
    )


def worst_of(study: Study, table: pa.Table) -> list[dict[str, Any]]:
    """The first few of these; `cell` is their place in a grid."""
    margins, names = _margins(table), ("index", "outcome", "reason", "command")
    labels = []
    for vary in study.vary:
        if way_of(vary) in GRID:
            words, places, _ = places_of(vary, values_of(vary, table))
            before = "" if way_of(vary) == "cases" else f"{vary.title} "
            labels.append([before + words[place] for place in places])
    return [
        {name: table[name][k].as_py() for name in names}
        | {"margin": margins[k], "cell": ", ".join(label[k] for label in labels)}
        for k in worst_first(table)[:LISTED]
    ]


def _margins(table: pa.Table) -> list[float | None]:
    name = f"figure.{RANKED_BY}"
    if name not in table.column_names:  # of an older sweep, told again
        return [None] * len(table)
    return list(table[name].to_pylist())
