"""Reads the files that a run left in its directory, however it ended."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.given_files import MOST_JSON, read_given
from drake_quad.given_tables import read_given_table
from drake_quad.plain_json import plain_of
from drake_quad.report.columns import RunLog
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout, make_layout
from drake_quad.scenario import Scenario, course_of, load_scenario, world_of
from drake_quad.scenario_robot import robot_of
from drake_quad.terrain import Course
from drake_quad.user_path import user_path

SUMMARY, LOG, SCENARIO = "summary.json", "log.parquet", "scenario.yaml"
LONGEST_RUN = 10_000.0  # [s]: with 30 pictures a second, a replay of more has no use
LONGEST_GAP = 2.0  # [s] between samples: twice the longest `simulation.log_period`
LARGEST = 1e9  # of a figure, in SI units: what is beyond is no measurement


@dataclass(frozen=True, eq=False)
class Run:
    """A finished run, as its files have it.

    Attributes:
        directory: Where they are.
        summary: What the run said of itself; empty if it came to say nothing.
        log: The samples, maybe none.
        scenario: In full.
        robot: The scenario's robot.
        course: The scenario's course, as the map has it.
        world: What the robot walked on: the map itself where it has no errors, and in a kinematic
            replay.
        layout: Where what is in `positions` and `velocities`.
        positions: (N, nq) the robot's positions, in Drake's order.
        velocities: (N, nv) its velocities, in Drake's order.
        notices: What is amiss with the files, a sentence each.
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

    @property
    def name(self) -> str:
        """What to call it: the scenario's name, else its description, else the directory's."""
        return str(self.summary.get("scenario") or self.scenario.description or self.directory.name)

    @property
    def kinematic(self) -> bool:
        """Whether the robot was moved along its plan, without forces."""
        return _is_kinematic(self.summary, self.scenario)


def read_run(directory: str | Path) -> Run:
    """Reads a run's `scenario.yaml`, `log.parquet` and `summary.json`.

    The scenario is needed; a missing or cut log or summary only makes a notice.

    Raises:
        InputError: No such directory, no scenario in it, or one that cannot be used; or a log whose
            times are none of a run.
    """
    directory = user_path(directory)
    if not (directory / SCENARIO).is_file():
        there = "holds no scenario.yaml" if directory.is_dir() else "no such directory"
        raise InputError(
            source=str(directory),
            field="directory",
            value=directory.name,
            remedy=f"{there}; give one that `drake-quad run --out` has written",
        )
    notices: list[str] = []
    summary = _read_summary(directory / SUMMARY, notices)
    log = _read_log(directory / LOG, notices)
    scenario = load_scenario(directory / SCENARIO)
    robot = robot_of(scenario)
    source = str(directory / SCENARIO)
    course = course_of(scenario, source=source, foot_radius=robot.foot_radius)
    kinematic = _is_kinematic(summary, scenario)
    plant = MakeModelPlant(robot.url)
    positions = [f"q_{name}" for name in plant.GetPositionNames()]
    velocities = [f"v_{name}" for name in plant.GetVelocityNames()]
    lacking = [name for name in (*positions, *velocities) if name not in log.columns]
    if len(log) and lacking:
        notices.append(f"The log lacks {len(lacking)} of the robot's states, such as {lacking[0]}.")
    return Run(
        directory=directory,
        summary=summary,
        log=log,
        scenario=scenario,
        robot=robot,
        course=course,
        world=course if kinematic else world_of(scenario, course, source=source),
        layout=make_layout(plant, robot),
        positions=read_only(log.numbers(positions)),
        velocities=read_only(log.numbers(velocities)),
        notices=tuple(notices),
    )


def _is_kinematic(summary: Mapping[str, Any], scenario: Scenario) -> bool:
    """Whether a run was a replay of its plan; the scenario decides where no summary says so."""
    return str(summary.get("simulation", scenario.simulation.mode)) == "kinematic"


def _read_summary(path: Path, notices: list[str]) -> dict[str, Any]:
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
        table = read_given_table(path)
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
        InputError: The times are none of a run.
    """
    found = {}
    for name, column in columns.items():
        values = column.to_numpy(zero_copy_only=False)
        if name == "t":
            _check_times(values, path)
        elif values.dtype.kind == "f":
            wrong = np.abs(values) > LARGEST
            if np.any(wrong):
                values = np.where(wrong, np.nan, values)
                notices.append(
                    f"{path.name} has {int(wrong.sum())} values in column {name} that are beyond "
                    f"{LARGEST:g}: they are left out."
                )
        found[name] = values
    return found


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
        (np.abs(t) > LONGEST_RUN, f"must be within {LONGEST_RUN:g} s"),
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
