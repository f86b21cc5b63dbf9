"""Touchdowns that the joints felt beside those that were: missed ones, false ones, how late."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.schema import Columns


@dataclass(frozen=True)
class TouchFigures:
    """Touchdowns felt beside those that were, of all four feet.

    Attributes:
        touchdowns: How many there were.
        missed: How many of them were not felt within the window.
        false: How many were felt that were none.
        delays: How much later the others were felt [s]; negative if earlier.
    """

    touchdowns: int
    missed: int
    false: int
    delays: tuple[float, ...]


def touch_figures(c: Columns) -> dict[str, Any] | None:
    """Touchdowns that the joints felt beside those that were; None where they felt none.

    Returns:
        `touchdowns`, `missed` and `false`, how many; `delay_median` and `delay_percentile_95` [s],
        nan of none.
    """
    if f"{SHORT_NAMES[0]}_felt" not in c:
        return None
    real, felt = (
        np.stack([c[f"{leg}_{name}"] for leg in SHORT_NAMES], axis=-1).astype(bool)
        for name in ("bearing", "felt")
    )
    found = compare_touchdowns(c["t"], real, felt)
    delays = found.delays or (np.nan,)
    return {
        "touchdowns": found.touchdowns,
        "missed": found.missed,
        "false": found.false,
        "delay_median": float(np.median(delays)),
        "delay_percentile_95": float(np.percentile(delays, 95)),
    }


def compare_touchdowns(
    times: FloatArray, real: BoolArray, felt: BoolArray, *, swing: float = 0.15,
    still: float = 0.05, brush: float = 0.02, window: float = 0.15,
) -> TouchFigures:  # fmt: skip
    """Compares touchdowns felt with those that were.

    A touchdown is where a foot begins to bear, for `brush` at least, that has not borne for
    `swing`: one that bounces has landed once, one that brushes a riser has not. Felt too early by
    more than `window`, a touchdown is both missed and false.

    Args:
        times: Times of the samples (N,) [s].
        real: Which feet bear (N, 4).
        felt: Which are felt to bear (N, 4).
        swing: How long a foot must have been off the ground before [s].
        still: How long a foot must not have been felt before, for it to be felt landing; as long
            a bounce must last for its end to excuse that [s].
        brush: How long a foot must bear for it to be more than a brush against a riser [s].
        window: How far apart the two may be to be the same [s].
    """
    count = missed = false = 0
    delays: list[float] = []
    for foot in range(real.shape[1]):
        landed = _landings(times, _lasting(times, real[:, foot], brush), swing)
        bounced = [t for t in _landings(times, real[:, foot], still) if t not in landed]
        noticed = _landings(times, felt[:, foot], still)
        late, rest = _pair(landed, noticed, window)
        count += len(landed)
        missed += len(landed) - len(late)
        delays += late
        false += len(_pair(bounced, rest, window)[1])
    return TouchFigures(count, missed, false, tuple(delays))


def _pair(
    places: list[float], noticed: list[float], window: float
) -> tuple[list[float], list[float]]:
    """How much later each place was noticed, of those that were; and what was noticed besides."""
    late, rest = [], list(noticed)
    for t in places:
        nearest = min(rest, key=lambda n: abs(n - t), default=np.inf)
        if abs(nearest - t) <= window:
            late.append(nearest - t)
            rest.remove(nearest)
    return late, rest


def _lasting(times: FloatArray, bears: BoolArray, least: float) -> BoolArray:
    """The same without what lasts less than `least`, but for what goes on at the end."""
    starts = np.flatnonzero(np.diff(bears.astype(np.int8), prepend=0) > 0)
    ends = np.flatnonzero(np.diff(bears.astype(np.int8)) < 0) + 1
    kept = bears.copy()
    for start, end in zip(starts, ends, strict=False):
        if times[end] - times[start] < least - 1e-9:
            kept[start:end] = False
    return kept


def _landings(times: FloatArray, bears: BoolArray, still: float) -> list[float]:
    """When a foot begins to bear that has not for `still`."""
    changes = np.flatnonzero(np.diff(bears.astype(np.int8)))
    found, left = [], None
    for k in changes:
        if not bears[k]:
            if left is not None and times[k + 1] - left >= still:
                found.append(float(times[k + 1]))
        else:
            left = times[k + 1]
    return found
