"""Reads the files that a run left in its directory, however it ended."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.given_files import MOST_JSON, read_given
from drake_quad.given_tables import read_given_table
from drake_quad.plain_json import plain_of
from drake_quad.report.columns import RunLog
from drake_quad.robot.load_robot import MakeModelPlant, load_robot
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout, make_layout
from drake_quad.scenario import Scenario, course_of, load_scenario, world_of
from drake_quad.terrain import Course
from drake_quad.user_path import user_path

SUMMARY, LOG, SCENARIO = "summary.json", "log.parquet", "scenario.yaml"


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
        InputError: No such directory, no scenario in it, or one that cannot be used.
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
    robot = load_robot(scenario.robot.model)
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
    columns = {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
    log = RunLog(columns)
    if not len(log):
        notices.append(f"{path.name} holds no sample: nothing to draw.")
    return log
