"""Parts what varies into bands: of a grid's axis its values, of what is drawn ranges."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from drake_quad.sweep.draws import GRID, axis_values, draw, way_of
from drake_quad.sweep.rates import Rate, rate_of
from drake_quad.sweep.study_config import Vary

DIGITS = 17  # that tell any two numbers apart


@dataclass(frozen=True)
class Band:
    """The trials whose value lies within a band, or is one of a grid's.

    Attributes:
        label: What to call it.
        low: Its ends; both the value itself on a grid's axis; both None of what is no number.
        high: The upper one.
        middle: Half of its trials have less: where the rate stands. None of no numbers, or none.
        rate: Of its trials.
    """

    label: str
    low: float | None
    high: float | None
    middle: float | None
    rate: Rate


def places_of(vary: Vary, values: Sequence[Any]) -> tuple[list[str], np.ndarray, list[Any]]:
    """Parts values into bands.

    Returns:
        The bands' labels; of each value the band's number; of each band its ends, or its value
        twice, or None twice of what is no number.
    """
    if way_of(vary) in (*GRID, "choice"):
        known = axis_values(vary) if way_of(vary) in GRID else list(vary.choice or [])
        numbers = all(type(value) in (int, float) for value in known)
        # A table has numbers alone as numbers; beside anything else true, 1 and 1.0 are three.
        keys = [value if numbers else json.dumps(value) for value in known]
        by_key = dict(zip(keys, known, strict=True))
        keys = sorted(by_key) if numbers else list(by_key)
        place = {key: k for k, key in enumerate(keys)}
        places = np.array([place[v if numbers else json.dumps(v)] for v in values], dtype=int)
        ends = [(key, key) if numbers else (None, None) for key in keys]
        return _labels([by_key[key] for key in keys], 6), places, ends
    if vary.integers is not None:
        return _whole_bands(vary.integers[0], vary.integers[1], vary.bands, values)
    # Bands that as many draws fall into: even in the distribution, but for the rounding to steps.
    edges = [draw(vary, min(k / vary.bands, 1.0 - 2.0**-53)) for k in range(vary.bands + 1)]
    edges = sorted(set(edges))
    if vary.log_uniform is None:  # 0, of which rounding leaves some 1e-18
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
    """Bands of whole numbers: one each if they are few, else as many in each as can be."""
    count = last - first + 1
    bands = min(bands, count)
    starts = [first + k * count // bands for k in range(bands + 1)]
    places = np.searchsorted(starts[1:-1], values, side="right")
    ends = [(low, after - 1) for low, after in pairwise(starts)]
    return [f"{a}" if a == b else f"{a} to {b}" for a, b in ends], places, ends


def bands_of(vary: Vary, values: Sequence[Any], success: Sequence[bool]) -> list[Band]:
    """The rate in each band of what varies."""
    labels, places, ends = places_of(vary, values)
    # By band, each in one piece: bands may be ten thousands, and trials a million.
    order = np.argsort(places, kind="stable")
    starts = np.searchsorted(places[order], np.arange(1, len(labels)))
    bands = []
    for label, (low, high), own in zip(labels, ends, np.split(order, starts), strict=True):
        numbers = low is not None and len(own) > 0
        middle = float(np.median([values[k] for k in own])) if numbers else None
        rate = rate_of(sum(success[k] for k in own), len(own))
        bands.append(Band(label, low, high, middle, rate))
    return bands


def _labels(values: Sequence[Any], digits: int) -> list[str]:
    """What to call values that differ: numbers by so many digits, or as many more as it takes."""
    for more in range(digits, DIGITS + 1):
        found = [f"{value:.{more}g}" if type(value) is float else str(value) for value in values]
        if len(set(found)) == len(found):
            return found
    return [json.dumps(value, ensure_ascii=False) for value in values]  # 1 and 1.0, or "1"
