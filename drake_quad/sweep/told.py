"""What a sweep's tables say, as plain values: what is printed, written as JSON, and drawn."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.sweep.bands import Band, bands_of, places_of
from drake_quad.sweep.draws import GRID, way_of
from drake_quad.sweep.evidence import given_up, repeats
from drake_quad.sweep.pairing import shared_by
from drake_quad.sweep.rates import Rate, causes_of, rate_of
from drake_quad.sweep.study_config import Study, Vary
from drake_quad.sweep.table_read import values_of
from drake_quad.sweep.trials import count_trials
from drake_quad.sweep.worst import worst_of


def tell(study: Study, table: pa.Table, clock: pa.Table) -> dict[str, Any]:
    """The findings of a sweep.

    Args:
        study: Checked.
        table: Of `make_table`; one that was read is to be checked by `check_told`.
        clock: Of `make_clock`.
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
        "given_up": given_up(table),
        "repeats": repeats(study, table),
        "sharing": shared_by(study),
        "kinematic": "kinematic" in table["mode"].to_pylist(),
        "rate": rate_told(total),
        "gate": gate,
        "gate_each": each,
        "gate_untried": untried if complete else [],
        # What is asked of a band is not kept by trying nothing there.
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


def rate_told(rate: Rate) -> dict[str, Any]:
    """A rate as plain values."""
    return {**asdict(rate), "rate": None if not rate.trials else rate.rate, "text": rate.text()}


def maps_of(study: Study) -> list[tuple[Vary, Vary]]:
    """The pairs to draw maps of: those asked for, else the grid's first two axes."""
    by_name = study.by_name()
    if study.maps:
        return [(by_name[one], by_name[other]) for one, other in study.maps]
    axes = [vary for vary in study.vary if way_of(vary) in GRID]
    return [(axes[0], axes[1])] if len(axes) > 1 else []


def _bands(vary: Vary, table: pa.Table) -> list[Band]:
    return bands_of(vary, values_of(vary, table), table["success"].to_pylist())


def _band(band: Band) -> dict[str, Any]:
    told = rate_told(band.rate)
    bounds = {"bound_low": told.pop("low"), "bound_high": told.pop("high")}
    ends = {"low": band.low, "high": band.high, "middle": band.middle}
    return {"label": band.label, **ends, **told, **bounds}


def _map(study: Study, pair: tuple[Vary, Vary], table: pa.Table) -> dict[str, Any]:
    """Good and all trials of each cell; rows are the second's bands."""
    (x_labels, x, _), (y_labels, y, _) = (places_of(vary, values_of(vary, table)) for vary in pair)
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
    """Least, 5 %, median, 95 % and greatest of what was measured."""
    values = np.array([v for v in column.to_pylist() if v is not None], dtype=float)
    names = ("least", "percentile_5", "median", "percentile_95", "greatest")
    if not len(values):
        return dict.fromkeys(names)
    found = np.percentile(values, [0, 5, 50, 95, 100])
    return dict(zip(names, map(float, found), strict=True))


def _clock(clock: pa.Table) -> dict[str, Any]:
    """What the trials took, together."""

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
        # What a place of trials does besides simulating, of that: see Isolated.run.
        "overhead": held / simulated - 1.0 if simulated else None,
    }
