"""The log of a finished run as arrays: every column is there, nan where the file lacks it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_quad.gait.legs import SHORT_NAMES, BoolArray, FloatArray

ObjectArray = np.ndarray[Any, np.dtype[np.object_]]


@dataclass(frozen=True)
class Band:
    """A stretch of a run in which one segment of the plan is under way.

    Attributes:
        name: The segment's, for people.
        kind: `stand`, `transition`, `wave` or `spin`.
        start: Its first sample's time [s].
        end: The time of the sample after its last, or of its last at the log's end [s].
    """

    name: str
    kind: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class RunLog:
    """The columns of a log, N samples long, by their names in the file.

    A report shows what there is: a missing or textual column reads as nan, so nobody needs to ask.
    """

    columns: Mapping[str, np.ndarray[Any, Any]]

    def __len__(self) -> int:
        return len(self.columns["t"]) if "t" in self.columns else 0

    @property
    def t(self) -> FloatArray:
        """Simulated time, (N,) [s]."""
        return self.number("t")

    def number(self, name: str) -> FloatArray:
        """A column of numbers, (N,) in its own unit; read-only."""
        try:
            values = np.asarray(self.columns[name], dtype=np.float64)
        except (KeyError, ValueError, TypeError):
            values = np.full(len(self), np.nan)
        values = values.view()
        values.setflags(write=False)
        return values

    def numbers(self, names: Sequence[str]) -> FloatArray:
        """Columns of numbers side by side, (N, len(names))."""
        return np.stack([self.number(name) for name in names], axis=-1)

    def vector(self, name: str, parts: Sequence[str] = "xyz") -> FloatArray:
        """`name_x`, `name_y`, `name_z` side by side, (N, 3), or other parts than these."""
        return self.numbers([f"{name}_{part}" for part in parts])

    def feet(self, name: str) -> FloatArray:
        """`FL_name_x` and its like of all feet, (N, 4, 3)."""
        return np.stack([self.vector(f"{leg}_{name}") for leg in SHORT_NAMES], axis=1)

    def flags(self, name: str) -> BoolArray:
        """`FL_name` and its like of all feet, (N, 4); False where not known."""
        values = self.numbers([f"{leg}_{name}" for leg in SHORT_NAMES])
        return np.asarray(np.isfinite(values) & (values > 0.5))

    def words(self, name: str) -> ObjectArray:
        """A column of words, (N,); empty words where the file lacks it."""
        return np.asarray(self.columns.get(name, np.full(len(self), "")), dtype=object)

    def text(self, name: str) -> list[str]:
        """A column of words, N long; empty words where the file lacks it."""
        return [str(word) for word in self.words(name)]

    def bands(self) -> list[Band]:
        """The segments in the order in which they were walked."""
        if not len(self):
            return []
        names, kinds, t = self.words("segment"), self.words("segment_kind"), self.t
        # A plan made anew has a recovery of its own, though that of the plan before is as named.
        turns = self.numbers(["task", "plan_revision"])
        changes = (names[1:] != names[:-1]) | np.any(turns[1:] > turns[:-1], axis=1)
        starts = [0, *(np.flatnonzero(changes) + 1).tolist()]
        ends = [*starts[1:], len(self) - 1]
        return [
            Band(str(names[a]), str(kinds[a]), float(t[a]), float(t[b]))
            for a, b in zip(starts, ends, strict=True)
        ]


def runs_of(flags: BoolArray) -> list[tuple[int, int]]:
    """The stretches of True in (N,) `flags` as half-open ranges [first, past)."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    firsts, pasts = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(firsts.tolist(), pasts.tolist(), strict=True))
