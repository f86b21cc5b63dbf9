"""The controller climbs in another simulator: what it needs to know is in its ports alone."""

import ast
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mujoco_rig import GRAVITY, Drive, MujocoRobot, drive, mujoco_runs
from pydrake.systems.framework import Diagram
from rig import course_of, flat_course, model_plant, paper_robot, stance_at

from drake_quad.control.settings import ControlSettings
from drake_quad.planning.mission import plan_mission
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, Task, derive_mission
from drake_quad.scenario.build import course_of as course_of_scenario, mission_of, plan_settings
from drake_quad.scenario.load import load_scenario
from drake_quad.systems.controller import MakeController
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

with_estimator = mujoco_runs.with_estimator

PACKAGE = Path(__file__).resolve().parents[2] / "drake_quad"
CLIMB = PlanSettings(swing_clearance=0.04)
RISE, COUNT = 0.13, 3  # of a flight's steps, as many as the robot is long
SETTLED = 0.03  # [s] from the start; before it the feet take up their load


@cache
def stairs_up_and_down() -> Course:
    """Floor, a flight up, a landing, the same flight down, floor."""
    return course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=RISE, run=0.5, count=COUNT),
        Element("landing", length=2.0),
        Element("stairs", going="down", rise=RISE, run=0.5, count=COUNT),
        Element("floor", length=2.5),
    )


def make_controller(
    course: Course, settings: PlanSettings, mission: Sequence[Task], control: ControlSettings
) -> Diagram:
    """The controller, made as for Drake's plant."""
    return MakeController(
        robot=paper_robot(),
        course=course,
        settings=settings,
        mission=mission,
        control=control,
        model=model_plant(),
    )


def simulate(
    course: Course,
    settings: PlanSettings,
    *,
    mission: Sequence[Task] | None = None,
    control: ControlSettings | None = None,
    stance: Stance | None = None,
    limit: float | None = None,
    deaf: frozenset[str] = frozenset(),
    estimated: bool = False,
) -> Drive:
    """Carries out a mission, the course's own unless told, in MuJoCo.

    The controller is told the robot's state, or, if `estimated`, what its sensors show.
    """
    mission, control = mission or derive_mission(course, settings), control or ControlSettings()
    stance = stance or stance_at(course, settings)
    robot = MujocoRobot(paper_robot(), model_plant(), course, control, stance)
    if limit is None:
        limit = 10.0 + plan_mission(paper_robot(), course, settings, mission, stance).duration
    controller = make_controller(course, settings, mission, control)
    if not estimated:
        return drive(controller, robot, limit=limit, deaf=deaf)
    # The estimator's clock and the controllers' have a millisecond in common.
    whole = with_estimator(controller, paper_robot(), model_plant(), stance)
    return drive(whole, robot, limit=limit, exchange=0.001)


@pytest.fixture(scope="module")
def climb() -> Drive:
    return simulate(stairs_up_and_down(), CLIMB)


def assert_climbed(run: Drive, course: Course, settings: PlanSettings, *, top: float) -> None:
    """Up to the height `top` [m] and down again, over every tread, and to the plan's end."""
    assert run.outcome == "goal_reached"
    assert run.touched == {box.name for box in course.boxes}
    assert run.place[:, 2].max() == pytest.approx(top + settings.body_height, abs=0.03)
    assert run.place[[0, -1], 2] == pytest.approx([settings.body_height] * 2, abs=0.03)
    np.testing.assert_allclose(run.place[-1], run.plan.end.body[:3], atol=0.05)


def assert_stable(run: Drive) -> None:
    """No contact but the feet's, at no step; three feet bear, the centre of mass between them."""
    assert run.others == frozenset()
    settled = run.times >= SETTLED
    threshold = 0.01 * paper_robot().mass * GRAVITY
    count = (run.force[settled] > threshold).sum(axis=1)
    assert count.min() >= 3 and count.max() == 4
    assert run.margin[settled].min() > 0.0


@pytest.mark.long
def test_controller_climbs_up_and_down_in_mujoco(climb: Drive) -> None:
    """The goal is reached, over every tread of both flights, and the base is where it ends."""
    assert_climbed(climb, stairs_up_and_down(), CLIMB, top=COUNT * RISE)


@pytest.mark.long
def test_robot_stays_stable_in_mujoco(climb: Drive) -> None:
    """By MuJoCo's own contacts: nothing but feet touches, and the margin stays positive."""
    assert_stable(climb)


@pytest.mark.long
def test_base_stays_with_its_plan_in_mujoco(climb: Drive) -> None:
    """Within 50 mm, with torque in reserve, and without long waits for a touchdown."""
    assert climb.base_error.max() < 0.05
    assert climb.torque_ratio.max() < 1.0
    assert climb.waited < 1.0


def test_controller_spins_in_mujoco() -> None:
    """An eighth of a turn on level ground: so heading and world are told apart on the way."""
    course = course_of(Element("floor", length=4.0, width=4.0))
    turn = Task(kind="spin", name="spin", lane=0, angle=0.25 * np.pi)
    run = simulate(course, CLIMB, mission=[turn], stance=stance_at(course, CLIMB, 2.0))
    assert run.outcome == "goal_reached" and run.base_error.max() < 0.05
    assert run.yaw[-1] == pytest.approx(0.25 * np.pi, abs=0.02)
    assert_stable(run)


def test_touchdowns_are_mujocos() -> None:
    """With the contact sensors dead from the start the clock waits at the first step, and stops.

    So it is not by the clock alone that the robot climbs.
    """
    run = simulate(
        flat_course(),
        PlanSettings(),
        control=ControlSettings(patience=0.5),
        limit=10.0,
        deaf=frozenset({"contact_state_measured"}),
    )
    assert run.outcome.startswith("stopped") and "wait" in run.outcome


def test_same_run_in_mujoco_is_the_same_to_the_bit() -> None:
    """Two runs of the first seconds have the same forces and places."""
    first, second = (simulate(flat_course(), PlanSettings(), limit=3.0) for _ in range(2))
    np.testing.assert_array_equal(first.force, second.force)
    np.testing.assert_array_equal(first.place, second.place)


def test_no_controller_or_plan_knows_mujoco() -> None:
    """Of the package the robot's side of a bus alone imports the simulator."""
    paths = sorted(PACKAGE.rglob("*.py"))
    assert len(paths) > 50
    for path in paths:
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "mujoco" in text else ():
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            known = any(name.split(".")[0] == "mujoco" for name in names)
            assert not known or path.name == "mjcf_side.py", path


def test_rows_of_the_table_stand_beside_each_other() -> None:
    """A short stand in both engines: margins within a millimetre, feet alone touch, three bear."""
    short = ["mission=[{kind: stand, duration: 0.3}]"]
    margins = []
    for case in (
        mujoco_runs.Case("four steps", "whole_body", drake=True),
        mujoco_runs.Case("four steps", "whole_body", estimated=True),
    ):
        row = dict(zip(mujoco_runs.HEADER, mujoco_runs.run_case(case, short), strict=True))
        assert row["outcome"] == "goal_reached" and row["samples under 3 feet"] == "0"
        assert row["non-foot contacts"] == "0" and float(row["peak torque / limit"]) > 0.1
        margins.append(float(row["min margin [m]"]))
    assert margins[0] == pytest.approx(margins[1], abs=2e-3) and margins[0] > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ik", "whole_body"])
@pytest.mark.parametrize("estimated", [False, True], ids=["truth", "sensors"])
def test_every_controller_climbs_in_mujoco(kind: str, *, estimated: bool) -> None:
    """By inverse kinematics or by inverse dynamics; told its state or on its sensors alone."""
    run = simulate(
        stairs_up_and_down(), CLIMB, control=ControlSettings(kind=kind), estimated=estimated
    )
    assert_climbed(run, stairs_up_and_down(), CLIMB, top=COUNT * RISE)
    assert_stable(run)
    assert run.base_error.max() < 0.05


@pytest.mark.slow
def test_case_study_in_mujoco() -> None:
    """Six steps up, a quarter turn on the landing, six down: the shipped scenario."""
    scenario = load_scenario("case_study")
    course = course_of_scenario(scenario, foot_radius=paper_robot().foot_radius)
    settings = plan_settings(scenario)
    run = simulate(
        course,
        settings,
        mission=mission_of(scenario, course),
        control=scenario.controller,
        stance=stance_at(course, settings, scenario.start.distance),
    )
    assert_climbed(run, course, settings, top=6 * 0.13)
    assert_stable(run)
    assert run.base_error.max() < 0.05
