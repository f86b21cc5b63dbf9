"""What trials are evidence of: which are not done, which repeat another, and where chance is."""

from typing import Any

import pyarrow as pa
import yaml

from drake_quad.sweep.draws import Draws
from drake_quad.sweep.study_config import Study

ENDED = ("timeout", "memory", "killed")  # outcomes of trials that did not end by themselves
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def given_up(table: pa.Table) -> int:
    """How many trials are not done that come before one that is.

    Trials begin in order. Of those under way when a sweep is stopped the ones that end early are
    in its table, and they fail more often than others, as a fall ends a trial.
    """
    indices = table["index"].to_pylist()
    return max(indices, default=-1) + 1 - len(indices)


def repeats(study: Study, table: pa.Table) -> int:
    """How many trials are another one of their cell over again, but for a seed that nothing reads.

    Of a study that draws anything there are none: a draw that comes twice is evidence as others.
    Nor are there in a cell of which two came out otherwise; trials that were ended for time or
    memory say nothing of it.
    """
    draws = Draws(study)
    if study.trials == 1 or draws.drawn:
        return 0
    figures = [name for name in table.column_names if name.startswith("figure.")]
    rows = table.select(["index", "outcome", "reason", *figures]).to_pylist()
    cells: dict[int, list[str]] = {}
    for row in rows:
        cell = row.pop("index") % draws.cells
        if row["outcome"] not in ENDED:
            cells.setdefault(cell, []).append(repr(row))
    return sum(len(found) - 1 for found in cells.values() if len(set(found)) == 1)


def is_fixed(study: Study, table: pa.Table) -> bool:
    """Whether nothing in the trials is random: nothing is drawn, and no run reads its seed."""
    if Draws(study).drawn or "scenario" not in table.column_names:
        return False
    return not any(map(_reads_seed, table["scenario"].to_pylist()))


def _reads_seed(scenario: str) -> bool:
    """Whether a run of a saved scenario depends on its seed, or may: as `scenario.generator_of`."""
    try:
        plain: dict[str, Any] = yaml.load(scenario, LOADER)
        world = plain["world"]
        still = plain["estimator"]["kind"] == "truth" and world["tread_error"] == 0.0
        return not still or bool(world["random"])
    except (KeyError, TypeError, AttributeError, yaml.YAMLError):
        return True
