"""The log of a run: its columns, read back and checked."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.common import BoolArray, FloatArray
from drake_quad.errors import InputError, did_you_mean
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.util.display import one_line
from drake_quad.util.files import read_given_table

ObjectArray = np.ndarray[Any, np.dtype[np.object_]]

LONGEST_RUN = 10_000.0  # [s]: with 30 pictures a second, a replay of more has no use
LONGEST_GAP = 2.0  # [s] between samples: twice the longest `simulation.log_period`
MOST_SAMPLES = 1_500_000  # of a log: with the 141 columns of a run these are MOST_VALUES
LARGEST = 1e9  # of a figure, in SI units: what is beyond is no measurement
MOST_WORDS = 10_000  # different ones in a column: names of tasks, which a mission has by hundreds


@dataclass(frozen=True)
class Interval:
    """A stretch of a run in which one segment of the plan is under way.

    Attributes:
        name: Name of the segment, for people.
        kind: `stand`, `transition`, `wave` or `spin`.
        start: Time of its first sample [s].
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

    def __getitem__(self, name: str) -> FloatArray:
        """A column of numbers by its name, (N,) in its own unit; read-only.

        Raises:
            InputError: The log has no such column, or it holds words, which `text` gives.
        """
        if name not in self.columns:
            hint = did_you_mean(name, list(self.columns)) or "; docs/log_format.md lists them"
            raise InputError(
                source="log", field="column", value=name, remedy=f"no such column{hint}"
            )
        if self.columns[name].dtype.kind not in "biuf":
            raise InputError(
                source="log", field="column", value=name, remedy="holds words; `text` gives them"
            )
        return self.number(name)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __repr__(self) -> str:
        return one_line(self, f"{len(self)} samples", f"{len(self.columns)} columns")

    def number(self, name: str) -> FloatArray:
        """A column of numbers, (N,) in its own unit, nan where there is none; read-only."""
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

    def bands(self) -> list[Interval]:
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
            Interval(str(names[a]), str(kinds[a]), float(t[a]), float(t[b]))
            for a, b in zip(starts, ends, strict=True)
        ]


def runs_of(flags: BoolArray) -> list[tuple[int, int]]:
    """The stretches of True in (N,) `flags` as half-open ranges [first, past)."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    firsts, pasts = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(firsts.tolist(), pasts.tolist(), strict=True))


def read_log(path: Path, notices: list[str]) -> RunLog:
    """The log, or one without samples with a notice."""
    try:
        table = read_given_table(path, most_rows=MOST_SAMPLES)
    except (OSError, pa.ArrowException) as problem:
        notices.append(f"{path.name} cannot be read ({type(problem).__name__}): nothing to draw.")
        return RunLog({})
    log = RunLog(_plausible({name: table[name] for name in table.column_names}, path, notices))
    if not len(log):
        notices.append(f"{path.name} holds no sample: nothing to draw.")
    return log


def _plausible(
    columns: Mapping[str, pa.ChunkedArray], path: Path, notices: list[str]
) -> dict[str, np.ndarray[Any, Any]]:
    """The columns as arrays, nan in the place of what nothing can have measured.

    Raises:
        InputError: The times are none of a run, or words are as many as no run has.
    """
    found, beyond = {}, {}
    for name, column in columns.items():
        values = _values_of(name, column, path)
        if name == "t":
            _check_times(values, path)
        elif values.dtype.kind == "f":
            wrong = np.abs(values) > LARGEST
            if np.any(wrong):
                values = np.where(wrong, np.nan, values)
                beyond[name] = int(wrong.sum())
        found[name] = values
    if beyond:
        first, *others = beyond
        where = f"column {first}" + (f" and {len(others)} others" if others else "")
        notices.append(
            f"{path.name} has {sum(beyond.values())} values in {where} that are beyond "
            f"{LARGEST:g}: they are left out."
        )
    return found


def _values_of(name: str, column: pa.ChunkedArray, path: Path) -> np.ndarray[Any, Any]:
    """A column's values; of words each is kept once, for a log has the same ones by the thousand.

    Raises:
        InputError: It has more different words than a run has, or neither words nor numbers.
    """
    kind = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind):
        return np.asarray(column.to_numpy(zero_copy_only=False))

    def fail(value: str, remedy: str) -> InputError:
        return InputError(source=str(path), field=name, value=value, remedy=remedy)

    if not (pa.types.is_string(kind) or pa.types.is_large_string(kind)):
        raise fail(str(kind), "must be a column of numbers or of words")
    encoded = column.dictionary_encode().unify_dictionaries()
    words = max((len(chunk.dictionary) for chunk in encoded.chunks), default=0)
    if words > MOST_WORDS:
        raise fail(f"{words} different words", f"may have {MOST_WORDS} at most")
    return np.asarray(encoded.to_numpy(zero_copy_only=False))


def _check_times(t: np.ndarray[Any, Any], path: Path) -> None:
    """Sees that times are numbers in order, without a gap, and no longer than a run.

    Raises:
        InputError: The first thing that is otherwise, with its value.
    """

    def fail(value: Any, remedy: str) -> InputError:
        remedy += "; give the directory of a finished `drake-quad run`"
        return InputError(source=str(path), field="t", value=value, remedy=remedy)

    if t.dtype.kind != "f":
        raise fail(str(t.dtype), "must be a column of numbers")
    for wrong, remedy in (
        (~np.isfinite(t), "must be finite, a time in seconds"),
        ((t < 0.0) | (t > LONGEST_RUN), f"must be from 0 to {LONGEST_RUN:g} s"),
    ):
        if np.any(wrong):
            raise fail(float(t[wrong][0]), remedy)
    steps = np.diff(t)
    for wrong, remedy in (
        (steps < 0.0, "must not be before the sample before it"),
        (steps > LONGEST_GAP, f"must be within {LONGEST_GAP:g} s of the sample before it"),
    ):
        if np.any(wrong):
            raise fail(float(t[1:][wrong][0]), remedy)
