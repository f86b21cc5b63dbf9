"""Reads a run's files back, and says what is wrong with them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.errors import InputError
from drake_quad.perception.stair_map import course_of_description
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.runs.result import summary_html
from drake_quad.runs.seen import SEEN
from drake_quad.runs.summary_figures import FIGURES, VERDICTS, WALL_CLOCK, WORDS
from drake_quad.scenario.build import course_of, robot_of, world_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.terrain.course import Course
from drake_quad.util.files import (
    MOST_JSON,
    is_given,
    plain_of,
    read_given,
    read_given_table,
    user_path,
)

ObjectArray = np.ndarray[Any, np.dtype[np.object_]]


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


SUMMARY, LOG, SCENARIO = "summary.json", "log.parquet", "scenario.yaml"
LONGEST_RUN = 10_000.0  # [s]: with 30 pictures a second, a replay of more has no use
LONGEST_GAP = 2.0  # [s] between samples: twice the longest `simulation.log_period`
MOST_SAMPLES = 1_500_000  # of a log: with the 141 columns of a run these are MOST_VALUES
LARGEST = 1e9  # of a figure, in SI units: what is beyond is no measurement


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A finished run, as its files have it.

    Attributes:
        directory: Directory of the files.
        summary: Its summary; empty if it has none.
        log: Its samples, maybe none.
        scenario: Its scenario, in full.
        robot: The scenario's robot.
        course: The map: the scenario's course, or what was made of what the robot had seen.
        world: What the robot walked on: the map itself where it has no errors, and in a kinematic
            replay.
        layout: Places of base and joints in `positions` and `velocities`.
        positions: (N, nq) positions of the robot, in Drake's order.
        velocities: (N, nv) velocities of the robot, in Drake's order.
        notices: Faults of the files, a sentence each.
        seen: Content of seen.json; empty where the map was told.
    """

    directory: Path
    summary: Mapping[str, Any]
    log: RunLog
    scenario: Scenario
    robot: RobotModel
    course: Course
    world: Course
    layout: StateLayout
    positions: FloatArray
    velocities: FloatArray
    notices: tuple[str, ...]
    seen: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What to call it: the scenario's name, else its description, else the directory's."""
        return str(self.summary.get("scenario") or self.scenario.description or self.directory.name)

    @property
    def kinematic(self) -> bool:
        """Whether the robot was moved along its plan, without forces."""
        return _is_kinematic(self.summary, self.scenario)

    def _repr_html_(self) -> str:
        """The outcome and the figures that matter, where a notebook shows it."""
        return summary_html(self.summary)


def load_run(directory: str | Path) -> RecordedRun:
    """Reads a run's `scenario.yaml`, `log.parquet` and `summary.json`.

    The scenario is needed; a missing or cut log or summary only makes a notice.

    Raises:
        InputError: No such directory, no scenario in it, or one that cannot be used; or a log whose
            times are none of a run.
    """
    directory = user_path(directory)
    if not is_given(directory / SCENARIO):  # a pipe there is told of as it is read
        there = "holds no scenario.yaml" if directory.is_dir() else "no such directory"
        raise InputError(
            source=str(directory),
            field="directory",
            value=directory.name,
            remedy=f"{there}; give one that `drake-quad run --out` has written",
        )
    notices: list[str] = []
    summary = _tolerant_summary(directory / SUMMARY, notices)
    log = _read_log(directory / LOG, notices)
    scenario = load_scenario(directory / SCENARIO)
    robot = robot_of(scenario)
    source = str(directory / SCENARIO)
    built = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    seen = _read_seen(directory / SEEN, notices) if scenario.perception.map == "seen" else {}
    course = _seen_course(seen, robot, notices) or built
    kinematic = _is_kinematic(summary, scenario)
    plant = MakeModelPlant(robot.url)
    positions = [f"q_{name}" for name in plant.GetPositionNames()]
    velocities = [f"v_{name}" for name in plant.GetVelocityNames()]
    lacking = [name for name in (*positions, *velocities) if name not in log.columns]
    if len(log) and lacking:
        notices.append(f"The log lacks {len(lacking)} of the robot's states, such as {lacking[0]}.")
    return RecordedRun(
        directory=directory,
        summary=summary,
        log=log,
        scenario=scenario,
        robot=robot,
        course=course,
        world=course if kinematic else world_of(scenario, built, source=source),
        layout=make_layout(plant, robot),
        positions=read_only(log.numbers(positions)),
        velocities=read_only(log.numbers(velocities)),
        notices=tuple(notices),
        seen=seen,
    )


def _read_seen(path: Path, notices: list[str]) -> dict[str, Any]:
    """What the robot had seen, or nothing with a notice."""
    try:
        seen = plain_of(read_given(path, most=MOST_JSON))
    except OSError:
        seen = None
    if seen is None:
        notices.append(f"{path.name} cannot be read: what the robot had seen is not shown.")
    return seen or {}


def _seen_course(seen: Mapping[str, Any], robot: RobotModel, notices: list[str]) -> Course | None:
    """The map of what was seen; None if there is none, with a notice if it cannot be read."""
    if seen.get("map") is None:
        return None
    try:
        return course_of_description(seen["map"], foot_radius=robot.foot_radius)
    except (InputError, ValueError, TypeError, KeyError, AttributeError):
        notices.append(f"{SEEN} holds no map that can be laid out: the world is shown as the map.")
        return None


def _is_kinematic(summary: Mapping[str, Any], scenario: Scenario) -> bool:
    """Whether a run was a replay of its plan; the scenario decides where no summary says so."""
    return str(summary.get("simulation", scenario.simulation.mode)) == "kinematic"


def _tolerant_summary(path: Path, notices: list[str]) -> dict[str, Any]:
    """The summary, or an empty one with a notice."""
    try:
        summary = plain_of(read_given(path, most=MOST_JSON))
    except OSError as problem:
        notices.append(f"{path.name} cannot be read ({type(problem).__name__}): the run was cut.")
        return {}
    if summary is None:
        notices.append(f"{path.name} holds no object in JSON: the run was cut.")
        return {}
    return summary


def _read_log(path: Path, notices: list[str]) -> RunLog:
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


MOST_WORDS = 10_000  # different ones in a column: names of tasks, which a mission has by hundreds


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


def read_summary(directory: str | Path, *, or_sweep: bool = False) -> dict[str, Any]:
    """The summary of a finished run, all of whose files can be read; `load_run` tolerates more.

    Args:
        directory: Directory of the run.
        or_sweep: Whether the error says that a sweep's directory would have done as well.

    Raises:
        InputError: A file is not there, or is none of a run's; or a value that is printed is none
            that runs write.
    """
    directory = Path(directory)
    wanted = "`drake-quad run`" + (" or `drake-quad sweep`" if or_sweep else "")

    def fail(name: str, what: str) -> InputError:
        return InputError(
            source=str(directory),
            field=name,
            value=str(directory / name),
            remedy=f"{what}; give the directory of a finished {wanted}",
        )

    try:
        summary = plain_of(read_given(directory / "summary.json", most=MOST_JSON))
    except OSError as problem:
        there = directory.is_dir() and not isinstance(problem, FileNotFoundError)
        what = "not there" if directory.is_dir() else "no such directory"
        what = f"cannot be read: {problem.strerror}" if there else what
        raise fail("summary.json", what) from None
    if summary is None:
        raise fail("summary.json", "is cut short, or no mapping in JSON")
    if "outcome" not in summary:
        raise fail("summary.json", "is not a run's summary")
    _check_values(summary, str(directory / "summary.json"))
    try:
        log = read_given_table(
            directory / "log.parquet", columns=["t", "margin"], most_rows=MOST_SAMPLES
        )
    except FileNotFoundError:
        raise fail("log.parquet", "not there") from None
    except (OSError, ValueError, pa.ArrowException) as problem:
        reason = getattr(problem, "strerror", None)  # Arrow's own errors of bytes have none
        if reason:
            raise fail("log.parquet", f"cannot be read: {reason}") from None
        raise fail("log.parquet", "is cut short or not Parquet") from None
    if {*log.column_names} != {"t", "margin"}:
        raise fail("log.parquet", "is not a run's log")
    for name in log.column_names:
        kind, gaps = log[name].type, log[name].null_count
        if not pa.types.is_floating(kind) or gaps:
            raise InputError(
                source=str(directory / "log.parquet"),
                field=name,
                value=f"{kind}, {gaps} rows without a value" if gaps else str(kind),
                remedy=f"must be a column of numbers; give the directory of a finished {wanted}",
            )
    return summary


def _check_values(summary: dict[str, Any], source: str) -> None:
    """Sees that words are text, and that figures are numbers, verdicts true or false.

    Figures and verdicts may also be null, or not there.

    Raises:
        InputError: The first that is something else.
    """

    def fail(path: str, value: Any, what: str) -> InputError:
        remedy = f"must be {what}; give the directory of a finished `drake-quad run`"
        return InputError(source=source, field=path, value=value, remedy=remedy)

    for name in WORDS:
        if not isinstance(summary.get(name, ""), str):
            raise fail(name, summary[name], "text")
    for path in (*FIGURES, *WALL_CLOCK):
        name, _, part = path.partition(".")
        value = summary.get(name)
        if part and value is not None:
            if not isinstance(value, dict):
                raise fail(name, value, "a mapping of figures, or null")
            value = value.get(part)
        verdict = path in VERDICTS
        if value is not None and type(value) not in ((bool,) if verdict else (int, float)):
            raise fail(path, value, "true or false, or null" if verdict else "a number, or null")
