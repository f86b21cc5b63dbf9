"""The controller's Diagram in MuJoCo, beside a run in Drake: the table of docs/mujoco.md.

    python -m benchmarks.mujoco_runs --out docs/mujoco.md

Four steps up and four down, and the case study, by both controllers, told the robot's true state or
on its own sensors' without noise. It needs the extra `mujoco`.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder

from benchmarks.common import markdown_table
from benchmarks.cross_trials import SETTLED
from benchmarks.page import check_out, describe, errors_in_a_line
from drake_quad.common import GRAVITY
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate
from drake_quad.sweep.report import put_section
from drake_quad.systems.controller import MakeController
from drake_quad.systems.state_estimator import StateEstimator

SECTION = "runs in MuJoCo"
FOUR_STEPS = (
    "course=[{kind: floor, length: 3.0}, {kind: stairs, going: up, rise: 0.13, run: 0.5, count: 4},"
    " {kind: landing, length: 2.0},"
    " {kind: stairs, going: down, rise: 0.13, run: 0.5, count: 4}, {kind: floor, length: 2.5}]",
    "mission=[]",
    "gait.swing_clearance=0.04",
)
COURSES = {"four steps": FOUR_STEPS, "`case_study`": ()}
BEARS = 0.01  # of the weight: a foot with more on it bears
HEADER = (
    "course", "controller", "state", "outcome", "min margin [m]", "base error [mm]",
    "peak torque / limit", "samples under 3 feet", "non-foot contacts", "real-time factor",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A row of the table.

    Attributes:
        course: One of COURSES.
        kind: `controller.kind`.
        estimated: Whether the controller's state is what its own estimator makes of the sensors.
        drake: Whether it is a run in Drake, beside which the others stand.
    """

    course: str
    kind: str
    estimated: bool = False
    drake: bool = False


CASES = (
    Case("four steps", "ik", drake=True),
    Case("four steps", "whole_body", drake=True),
    *(Case("four steps", k, estimated=e) for e in (False, True) for k in ("ik", "whole_body")),
    Case("`case_study`", "whole_body", drake=True),
    Case("`case_study`", "ik"),
    *(Case("`case_study`", "whole_body", estimated=e) for e in (False, True)),
)  # fmt: skip


def with_estimator(
    controller: Diagram, robot: RobotModel, plant: MultibodyPlant, stance: Stance
) -> Diagram:
    """The controller on what a robot senses: its state comes from the estimator.

    Args:
        controller: The controller's Diagram.
        robot: The robot.
        plant: The robot without ground.
        stance: The stance in which the run begins.
    """
    builder = DiagramBuilder()
    builder.AddSystem(controller)
    body = stance.body
    q, _, _ = pose_robot(robot, body[None], stance.feet[None])
    estimator = builder.AddSystem(
        StateEstimator(
            robot=robot, layout=make_layout(plant, robot), p_WB=body[:3], pitch=body[3],
            yaw=body[4], q=q.ravel(),
        )
    )  # fmt: skip
    builder.Connect(
        estimator.GetOutputPort("robot_state_estimated"),
        controller.GetInputPort("robot_state_estimated"),
    )
    contacts = builder.ExportInput(
        estimator.GetInputPort("contact_state_measured"), "contact_state_measured"
    )
    builder.ConnectInput(contacts, controller.GetInputPort("contact_state_measured"))
    for name in ("imu_measured", "joint_state_measured"):
        builder.ExportInput(estimator.GetInputPort(name), name)
    for k in range(controller.num_output_ports()):
        port = controller.get_output_port(k)
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


def run_case(case: Case, more: Sequence[str] = ()) -> tuple[str, ...]:
    """Carries out a case; a row of the table.

    Args:
        case: The case.
        more: Overrides of the scenario besides.
    """
    overrides = [*COURSES[case.course], f"controller.kind={case.kind}", *more]
    run = run_in_drake if case.drake else run_in_mujoco
    found = run(overrides, estimated=case.estimated)
    course = f"{case.course}, *in Drake*" if case.drake else case.course
    return (
        course, f"`{case.kind}`", "estimated" if case.estimated else "true",
        str(found["outcome"]), f"{found['margin']:.3f}", f"{1e3 * found['base_error']:.1f}",
        f"{found['torque']:.2f}", str(found["few"]), str(found["others"]), f"{found['pace']:.1f}",
    )  # fmt: skip


def run_in_drake(overrides: Sequence[str], *, estimated: bool = False) -> dict[str, Any]:
    """The scenario's own run; its figures as the table has them."""
    scenario = load_scenario("case_study", [*overrides, "monitor.margins=hull"])
    scenario.estimator.kind = "ekf" if estimated else "truth"
    found = simulate(scenario, source="case_study").summary
    return {
        "outcome": found["outcome"], "margin": found["margin"]["minimum"],
        "base_error": found["base_error_max"], "torque": found["torque_ratio_max"],
        "few": found["samples_under_three_feet"], "others": found["nonfoot_contact_samples"],
        "pace": found["real_time_factor"],
    }  # fmt: skip


def run_in_mujoco(overrides: Sequence[str], *, estimated: bool = False) -> dict[str, Any]:
    """The scenario's controller in MuJoCo; its figures as the table has them."""
    from benchmarks.mujoco_drive import drive
    from benchmarks.mujoco_robot import MujocoRobot

    scenario = load_scenario("case_study", overrides)
    p = prepare(scenario, source="case_study")
    plant = MakeModelPlant(p.robot.url)
    friction = scenario.simulation.friction
    body = MujocoRobot(p.robot, plant, p.world, scenario.controller, p.stance, friction=friction)
    controller = MakeController(
        robot=p.robot, course=p.course, settings=p.settings, mission=p.tasks,
        control=scenario.controller, model=plant,
    )  # fmt: skip
    limit, begun = 10.0 + p.plan.duration, time.perf_counter()
    if estimated:  # the estimator's clock and the controllers' have a millisecond in common
        whole = with_estimator(controller, p.robot, plant, p.stance)
        found = drive(whole, body, limit=limit, exchange=0.001)
    else:
        found = drive(controller, body, limit=limit)
    took = time.perf_counter() - begun
    settled = found.times >= SETTLED
    bear = (found.force[settled] > BEARS * p.robot.mass * GRAVITY).sum(axis=1)
    return {
        "outcome": found.outcome, "margin": float(found.margin[settled].min()),
        "base_error": float(found.base_error.max()), "torque": float(found.torque_ratio.max()),
        "few": int(np.sum(bear < 3)), "others": len(found.others),
        "pace": float(found.times[-1]) / took,
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out all cases and prints the table, or writes it on a page."""
    parser = argparse.ArgumentParser(prog="mujoco_runs.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, help="page between whose marks the table goes")
    parser.add_argument("--set", dest="more", action="append", default=[], metavar="PATH=VALUE")
    options = parser.parse_args(arguments)
    with errors_in_a_line("mujoco_runs"):
        check_out(options.out, SECTION)
        rows = []
        for case in CASES:
            rows.append(run_case(case, options.more))
            print(" | ".join(rows[-1]), flush=True)
        command = ["python -m benchmarks.mujoco_runs --out docs/mujoco.md"]
        command += [f"--set {more}" for more in options.more]
        written = f"{describe(command, ['mujoco'])}\n{markdown_table(HEADER, rows)}"
        if options.out is not None:
            put_section(options.out, SECTION, written, option="--out")


if __name__ == "__main__":
    main()
