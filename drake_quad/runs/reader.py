"""Reads a finished run from its directory, and says what is wrong with its files."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import InputError, check_kind
from drake_quad.perception.stair_map import course_of_description
from drake_quad.robot.digest import robot_digest
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.runs.result import summary_html
from drake_quad.runs.run_log import RunLog, read_log
from drake_quad.runs.seen import SEEN
from drake_quad.scenario.build import course_of, robot_of, world_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.terrain.course import Course
from drake_quad.util.display import one_line
from drake_quad.util.files import (
    MOST_JSON,
    is_given,
    plain_of,
    read_given,
    user_path,
)

SUMMARY, LOG, SCENARIO = "summary.json", "log.parquet", "scenario.yaml"


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
    def outcome(self) -> str:
        """How it ended: `goal_reached`, `fell` or `stopped`; empty where the summary is lost."""
        return str(self.summary.get("outcome") or "")

    @property
    def reason(self) -> str:
        """What ended it; empty where the summary is lost."""
        return str(self.summary.get("reason") or "")

    @property
    def kinematic(self) -> bool:
        """Whether the robot was moved along its plan, without forces."""
        return _is_kinematic(self.summary, self.scenario)

    def __repr__(self) -> str:
        return one_line(self, self.name, self.outcome or "no outcome", f"in {self.directory}")

    def _repr_html_(self) -> str:
        """The outcome and the figures that matter, where a notebook shows it."""
        return summary_html(self.summary)


def run_of(run: RecordedRun | str | Path) -> RecordedRun:
    """A run, or the one in a directory.

    Raises:
        InputError: As for `load_run`.
    """
    return run if isinstance(run, RecordedRun) else load_run(run)


def _changed_robot(summary: Mapping[str, Any], model: str) -> list[str]:
    """A notice if the robot's file is not what it was when the run was made; else none."""
    robot = summary.get("robot")
    then = robot.get("digest") if isinstance(robot, Mapping) else None
    if not isinstance(then, str) or not then or then == robot_digest(model):
        return []
    return [
        f"The robot's file, {model}, has changed since this run: what is shown of its shape, and "
        "the angles of its own joints, are those of the file as it is now."
    ]


def load_run(directory: str | Path) -> RecordedRun:
    """Reads a run's `scenario.yaml`, `log.parquet` and `summary.json`.

    The scenario is needed; a missing or cut log or summary only makes a notice.

    Raises:
        InputError: No such directory, no scenario in it, or one that cannot be used; or a log whose
            times are none of a run.
    """
    remedy = "must be a run's directory; `save` of a RunResult writes one"
    check_kind(directory, (str, Path), "run", remedy)
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
    log = read_log(directory / LOG, notices)
    scenario = load_scenario(directory / SCENARIO)
    robot = robot_of(scenario)
    notices += _changed_robot(summary, scenario.robot.model)
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
