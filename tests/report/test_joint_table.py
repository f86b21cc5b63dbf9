"""A run's joints as CSV: in the robot's own file they put every foot where the run had it."""

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from command import drake_quad, refused
from import_rig import write
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from report_run import make_log, short_scenario, write_run
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.report.joint_table import joint_table, write_joint_table
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.state import make_layout
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog

ROWS = 5
OTHERS = (
    Quadruped(),
    Quadruped(signs=(-1, 1, -1), rear=-1, shank=(0.05, -0.3), thigh=(0.02, -0.3)),
    Quadruped(tilt=(0.2, -0.1, 0.3), roll=0.1, signs=(1, -1, 1)),
)


def made_up(url: str, rng: np.random.Generator) -> tuple[RecordedRun, MultibodyPlant]:
    """What an export reads of a run of that robot: random poses and speeds; and its normal form."""
    robot, plant = load_robot(url), MakeModelPlant(load_robot(url).url)
    layout = make_layout(plant, robot)
    positions = np.zeros((ROWS, plant.num_positions()))
    quaternions = rng.normal(size=(ROWS, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    positions[:, layout.q_base : layout.q_base + 4] = quaternions
    positions[:, layout.q_base + 4 : layout.q_base + 7] = rng.uniform(-1.0, 1.0, (ROWS, 3))
    positions[:, layout.q_joints] = rng.uniform(robot.q_lower, robot.q_upper, (ROWS, 12))
    velocities = rng.normal(size=(ROWS, plant.num_velocities()))
    torques = {f"tau_{name}": rng.normal(size=ROWS) for name in robot.joint_names}
    log = RunLog({"t": np.arange(ROWS) * 0.1, **torques})
    run = SimpleNamespace(
        robot=robot, layout=layout, log=log, positions=positions, velocities=velocities,
        directory=Path("run"),
    )  # fmt: skip
    return cast(RecordedRun, run), plant


@pytest.mark.parametrize("form", OTHERS)
def test_the_own_file_has_feet_and_power_as_the_run(form: Quadruped, tmp_path: Path) -> None:
    """By Drake's own parser: every shank and the trunk are where they were, and so is the power."""
    rng = np.random.default_rng(1)
    path = write(tmp_path, form.text())
    run, normal = made_up(path, rng)
    names, values = joint_table(run)
    own = MultibodyPlant(0.0)
    Parser(own).AddModels(str(path))
    own.Finalize()
    here, there = own.CreateDefaultContext(), normal.CreateDefaultContext()
    for row, told in enumerate(dict(zip(names, v, strict=True)) for v in values):
        normal.SetPositions(there, run.positions[row])
        q = [told[f"base_q{k}"] for k in "wxyz"]
        p = [told[f"base_{k}"] for k in "xyz"]
        own.SetFloatingBaseBodyPoseInWorldFrame(
            here, own.GetBodyByName("body"), RigidTransform(Quaternion(q), p)
        )
        for name in run.robot.joint_names:
            own.GetJointByName(name).set_angle(here, told[name])
        for leg, at in zip(("FL", "FR", "RL", "RR"), run.robot.geometry.shank, strict=True):
            mine = own.EvalBodyPoseInWorld(here, own.GetBodyByName(f"{leg}_foot")).translation()
            shank = normal.GetBodyByName(f"{leg}_shank")
            theirs = normal.EvalBodyPoseInWorld(there, shank) @ [0.0, 0.0, -at]
            np.testing.assert_allclose(mine, theirs, atol=1e-6)
        speeds = run.velocities[row][run.layout.v_joints - run.layout.num_positions]
        for k, name in enumerate(run.robot.joint_names):
            power = told[f"{name}_velocity"] * told[f"{name}_effort"]
            assert power == pytest.approx(speeds[k] * run.log.number(f"tau_{name}")[row])


def test_the_file_holds_the_table(tmp_path: Path) -> None:
    """One row a sample, nine digits, nothing where nothing is known; the command says where."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=0.2), versions={})
    run = load_run(tmp_path / "run")
    done = drake_quad("export", "run", "--csv", "out.csv", cwd=tmp_path)
    assert done.returncode == 0 and f"{len(run.log)} rows in out.csv" in done.stdout
    with (tmp_path / "out.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    names, values = joint_table(run)
    assert head == names and len(rows) == len(run.log) and len(set(head)) == len(head)
    read = np.array([[float(x) if x else np.nan for x in row] for row in rows])
    np.testing.assert_allclose(read, values, rtol=1e-8, atol=1e-12)


def test_what_cannot_be_exported_is_refused(tmp_path: Path) -> None:
    """A run without samples, and a place that is none: a line each."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=0.1), versions={})
    line = refused(drake_quad("export", "run", "--csv", "/dev/null", cwd=tmp_path))
    assert "--csv" in line
    empty = replace(
        load_run(tmp_path / "run"),
        log=RunLog({}),
        positions=np.zeros((0, 19)),
        velocities=np.zeros((0, 18)),
    )
    with pytest.raises(InputError, match="nothing to export"):
        write_joint_table(empty, tmp_path / "x.csv")
