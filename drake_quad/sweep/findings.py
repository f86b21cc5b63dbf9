"""What a sweep found: rates over bands and maps, worst trials, repeats."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pyarrow as pa
import yaml

from drake_quad.sweep.results import values_of
from drake_quad.sweep.sampling import GRID, Draws, axis_values, distribution_of, draw
from drake_quad.sweep.statistics import Rate, causes_of, rate_of
from drake_quad.sweep.study import Study, Vary
from drake_quad.sweep.trials import RANKED_BY, count_trials

DIGITS = 17  # with so many, any two numbers differ

LISTED = 12  # worst trials that are listed

ENDED = ("timeout", "memory", "killed")  # outcomes of trials that were cut off
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Bin:
    """The trials whose value lies within a band, or is one value of a grid's axis.

    Attributes:
        label: Name of the band.
        low: Lower end; on a grid's axis the value itself; None if values are not numbers.
        high: Upper end, likewise.
        middle: Median of its trials' values; None without trials, or if values are not numbers.
        rate: Rate of success of its trials.
    """

    label: str
    low: float | None
    high: float | None
    middle: float | None
    rate: Rate


def bin_indices(vary: Vary, values: Sequence[Any]) -> tuple[list[str], np.ndarray, list[Any]]:
    """Divides values into bands.

    Returns:
        The bands' labels; each value's number of its band; each band's ends, which are its value
        twice on a grid's axis, and None twice if values are not numbers.
    """
    if distribution_of(vary) in (*GRID, "choice"):
        known = axis_values(vary) if distribution_of(vary) in GRID else list(vary.choice or [])
        numbers = all(type(value) in (int, float) for value in known)
        # Where all are numbers they compare as numbers; else true, 1 and 1.0 are three values.
        keys = [value if numbers else json.dumps(value) for value in known]
        by_key = dict(zip(keys, known, strict=True))
        keys = sorted(by_key) if numbers else list(by_key)
        place = {key: k for k, key in enumerate(keys)}
        places = np.array([place[v if numbers else json.dumps(v)] for v in values], dtype=int)
        ends = [(key, key) if numbers else (None, None) for key in keys]
        return _labels([by_key[key] for key in keys], 6), places, ends
    if vary.integers is not None:
        return _whole_bands(vary.integers[0], vary.integers[1], vary.bands, values)
    # Bands of equal probability, but for the rounding to steps.
    edges = [draw(vary, min(k / vary.bands, 1.0 - 2.0**-53)) for k in range(vary.bands + 1)]
    edges = sorted(set(edges))
    if vary.log_uniform is None:  # rounding leaves some 1e-18 of a 0
        edges = [0.0 if abs(e) < 1e-12 * (edges[-1] - edges[0]) else e for e in edges]
    words = _labels(edges, 3)
    if len(edges) == 1:  # all draws are alike
        edges, words = edges * 2, words * 2
    places = np.clip(np.searchsorted(edges[1:-1], values, side="right"), 0, len(edges) - 2)
    ends = list(pairwise(edges))
    return [f"{low} to {high}" for low, high in pairwise(words)], places, ends


def _whole_bands(
    first: int, last: int, bands: int, values: Sequence[int]
) -> tuple[list[str], np.ndarray, list[Any]]:
    """Bands of whole numbers: one number each if they are few, else about equally many."""
    count = last - first + 1
    bands = min(bands, count)
    starts = [first + k * count // bands for k in range(bands + 1)]
    places = np.searchsorted(starts[1:-1], values, side="right")
    ends = [(low, after - 1) for low, after in pairwise(starts)]
    return [f"{a}" if a == b else f"{a} to {b}" for a, b in ends], places, ends


def bins_of(vary: Vary, values: Sequence[Any], success: Sequence[bool]) -> list[Bin]:
    """The rate in each band of what varies."""
    labels, places, ends = bin_indices(vary, values)
    # Sorted by band once: there may be ten thousand bands, and a million trials.
    order = np.argsort(places, kind="stable")
    starts = np.searchsorted(places[order], np.arange(1, len(labels)))
    bands = []
    for label, (low, high), own in zip(labels, ends, np.split(order, starts), strict=True):
        numbers = low is not None and len(own) > 0
        middle = float(np.median([values[k] for k in own])) if numbers else None
        rate = rate_of(sum(success[k] for k in own), len(own))
        bands.append(Bin(label, low, high, middle, rate))
    return bands


def _labels(values: Sequence[Any], digits: int) -> list[str]:
    """Labels of values: numbers with so many digits, or with more until all labels differ."""
    for more in range(digits, DIGITS + 1):
        found = [f"{value:.{more}g}" if type(value) is float else str(value) for value in values]
        if len(set(found)) == len(found):
            return found
    return [json.dumps(value, ensure_ascii=False) for value in values]  # 1 and 1.0, or "1"


def worst_first(table: pa.Table) -> list[int]:
    """All rows of the table: trials that failed, then those that did not.

    Both are sorted by their smallest margin; trials without one come last, by index.
    """
    margins, success = _margins(table), table["success"].to_pylist()
    return sorted(
        range(len(table)),
        key=lambda k: (success[k], np.inf if margins[k] is None else margins[k], k),
    )


def worst_of(study: Study, table: pa.Table) -> list[dict[str, Any]]:
    """The first few of `worst_first`; `cell` is their place in a grid."""
    margins, names = _margins(table), ("index", "outcome", "reason", "command")
    labels = []
    for vary in study.vary:
        if distribution_of(vary) in GRID:
            words, places, _ = bin_indices(vary, values_of(vary, table))
            before = "" if distribution_of(vary) == "cases" else f"{vary.title} "
            labels.append([before + words[place] for place in places])
    return [
        {name: table[name][k].as_py() for name in names}
        | {"margin": margins[k], "cell": ", ".join(label[k] for label in labels)}
        for k in worst_first(table)[:LISTED]
    ]


def _margins(table: pa.Table) -> list[float | None]:
    name = f"figure.{RANKED_BY}"
    if name not in table.column_names:  # an older sweep's
        return [None] * len(table)
    return list(table[name].to_pylist())


def count_skipped(table: pa.Table) -> int:
    """Number of trials that are not done although a later one is.

    Trials begin in order. When a sweep is stopped, some are under way. Those that ended early are
    in the table, and they fail more often than others, because a fall ends a trial.
    """
    indices = table["index"].to_pylist()
    return max(indices, default=-1) + 1 - len(indices)


def count_duplicates(study: Study, table: pa.Table) -> int:
    """Number of trials that duplicate another of their cell: only a seed differs that no run reads.

    A study that draws anything has none, because equal draws are evidence like others. A cell has
    none if two of its trials ended differently; trials cut off for time or memory do not count.
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
    """Whether a run of a saved scenario may depend on its seed, as `scenario.build` has it."""
    try:
        plain: dict[str, Any] = yaml.load(scenario, LOADER)
        world = plain["world"]
        still = (
            plain["estimator"]["kind"] == "truth"
            and plain["sensors"]["contacts"] == "feet"  # else the drives' torques have noise
            and plain["perception"]["map"] == "told"  # else a camera has errors
            and world["tread_error"] == 0.0
        )
        return not still or bool(world["random"])
    except (KeyError, TypeError, AttributeError, yaml.YAMLError):
        return True


def draws_shared(study: Study) -> int:
    """Number of trials that share each of its draws."""
    return Draws(study).cells if study.draws == "common" else 1


def summarize_sweep(study: Study, table: pa.Table, clock: pa.Table) -> dict[str, Any]:
    """The findings of a sweep.

    Args:
        study: The study.
        table: Table of the trials; one that was read must have passed `validate_results`.
        clock: Table of their times.
    """
    success = table["success"].to_pylist()
    outcomes, reasons = table["outcome"].to_pylist(), table["reason"].to_pylist()
    total = rate_of(sum(success), len(success))
    asked = count_trials(study)
    gate, each = study.gate.rate, study.gate.each
    bands = {vary.title: _bands(vary, table) for vary in study.vary}
    if each is not None:
        each = study.by_name()[each].title
    asked_of = [total] if each is None else [band.rate for band in bands[each]]
    complete = len(success) == asked
    untried = [] if each is None else [band.label for band in bands[each] if not band.rate.trials]
    return {
        "description": study.description,
        "trials": len(success),
        "asked": asked,
        "complete": complete,
        "given_up": count_skipped(table),
        "repeats": count_duplicates(study, table),
        "sharing": draws_shared(study),
        "kinematic": "kinematic" in table["mode"].to_pylist(),
        "rate": rate_as_dict(total),
        "gate": gate,
        "gate_each": each,
        "gate_untried": untried if complete else [],
        # A band without trials does not pass the gate.
        "passed": None
        if gate is None or not success
        else all(rate.rate >= gate for rate in asked_of if rate.trials)
        and not (complete and untried),
        "bands": {title: [_band(band) for band in found] for title, found in bands.items()},
        "maps": [_map(study, pair, table) for pair in maps_of(study)],
        "causes": [{"cause": c, "trials": n} for c, n in causes_of(outcomes, reasons)],
        "figures": {
            name.removeprefix("figure."): _spread(table[name])
            for name in table.column_names
            if name.startswith("figure.")
        },
        "worst": worst_of(study, table),
        "clock": _clock(clock),
    }


def rate_as_dict(rate: Rate) -> dict[str, Any]:
    """A rate as plain values."""
    return {**asdict(rate), "rate": None if not rate.trials else rate.rate, "text": rate.text()}


def maps_of(study: Study) -> list[tuple[Vary, Vary]]:
    """The pairs to draw maps of: those of the study, else the grid's first two axes."""
    by_name = study.by_name()
    if study.maps:
        return [(by_name[one], by_name[other]) for one, other in study.maps]
    axes = [vary for vary in study.vary if distribution_of(vary) in GRID]
    return [(axes[0], axes[1])] if len(axes) > 1 else []


def _bands(vary: Vary, table: pa.Table) -> list[Bin]:
    return bins_of(vary, values_of(vary, table), table["success"].to_pylist())


def _band(band: Bin) -> dict[str, Any]:
    rate = rate_as_dict(band.rate)
    bounds = {"bound_low": rate.pop("low"), "bound_high": rate.pop("high")}
    ends = {"low": band.low, "high": band.high, "middle": band.middle}
    return {"label": band.label, **ends, **rate, **bounds}


def _map(study: Study, pair: tuple[Vary, Vary], table: pa.Table) -> dict[str, Any]:
    """Successful trials and all trials of each cell; rows are the bands of the second."""
    (x_labels, x, _), (y_labels, y, _) = (
        bin_indices(vary, values_of(vary, table)) for vary in pair
    )
    good = np.asarray(table["success"].to_pylist(), dtype=bool)
    cells, size = y * len(x_labels) + x, len(x_labels) * len(y_labels)
    shape = len(y_labels), len(x_labels)
    all_of, good_of = (
        np.bincount(cells[which], minlength=size).reshape(shape).tolist()
        for which in (slice(None), good)
    )
    return {
        "x": pair[0].title,
        "y": pair[1].title,
        "x_labels": x_labels,
        "y_labels": y_labels,
        "good": good_of,
        "trials": all_of,
    }


def _spread(column: pa.ChunkedArray) -> dict[str, float | None]:
    """Minimum, 5 %, median, 95 % and maximum of the values that were measured."""
    values = np.array([v for v in column.to_pylist() if v is not None], dtype=float)
    names = ("least", "percentile_5", "median", "percentile_95", "greatest")
    if not len(values):
        return dict.fromkeys(names)
    found = np.percentile(values, [0, 5, 50, 95, 100])
    return dict(zip(names, map(float, found), strict=True))


def _clock(clock: pa.Table) -> dict[str, Any]:
    """Time, memory and processes of all trials together."""

    def known(name: str) -> list[float]:
        own = clock[name].to_pylist() if name in clock.column_names else []
        return [v for v in own if v is not None]

    timed = ("held", "simulating")
    rows = [row for row in clock.to_pylist() if None not in map(row.get, timed)]
    held, simulated = (sum(row[name] for row in rows) for name in timed)
    return {
        "wall": float(sum(known("wall"))),
        "simulating": float(sum(known("simulating"))),
        "memory_max": max(known("memory"), default=None),
        "tried_again": sum(tried > 1 for tried in known("tried")),
        "processes": len(set(known("process"))),
        # Time besides simulating, over the time of simulating: see IsolatedWorker.run.
        "overhead": held / simulated - 1.0 if simulated else None,
    }
