"""A robot's own MJCF as the robot's side of a bus: its messages mean what ours mean."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from robot_formats import LINKS, mjcf

from drake_quad.bus.messages import DRIVES_FOLLOW, CommandMessage
from drake_quad.bus.mjcf_side import MjcfSide
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.processes import load_for_bus
from drake_quad.common import GRAVITY
from drake_quad.errors import InputError
from drake_quad.math.rotations import quaternion_matrix
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_feet
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.systems.disturbances import Disturbances

pytest.importorskip("mujoco")
LAST_MOTOR = f'<motor class="{LINKS[2][0]}" joint="RR_{LINKS[2][0]}_joint"/>'
SCENARIO = """
description: Standing
robot: {{model: {robot}}}
course:
  - {{kind: floor, length: 3.0, width: 2.0}}
start: {{distance: 1.0}}
mission:
  - {{kind: stand, duration: 0.2}}
sensors: {{noise: none, torque_noise: 0.0}}
"""


def standing(folder: Path, text: str | None = None) -> tuple[Path, PreparedScenario]:
    """The robot's file, and a scenario in which it stands."""
    robot, scenario = folder / "r.xml", folder / "stand.yaml"
    robot.write_text(mjcf() if text is None else text)
    scenario.write_text(SCENARIO.format(robot=robot))
    return robot, prepare(load_for_bus(str(scenario), []))


def test_it_senses_what_it_does_in_our_words(tmp_path: Path) -> None:
    """Held on folded legs it is at rest, its joints where they are told to be in the normal form.

    The IMU feels gravity alone, the feet carry the weight between them, and each joint is off by
    what its stiffness gives under the torque that its drive shows.
    """
    path, prepared = standing(tmp_path)
    robot, control = prepared.robot, prepared.scenario.controller
    side = MjcfSide(path, prepared)
    stance = lowest_stance(robot, prepared.stance)
    q, _, _ = pose_robot(robot, stance.body[None], stance.feet[None])
    hold = CommandMessage(
        1, 1, 0, 2, -1, q.ravel(), np.zeros(12), np.zeros(12), np.full(12, control.kp),
        np.full(12, control.kd),
    )  # fmt: skip
    for k in range(1, 751):
        side.advance(DRIVES_FOLLOW, hold)
        state = side.sense(1, k, 0, DRIVES_FOLLOW)
    assert side.time == pytest.approx(750 * side.period)
    assert np.abs(state.velocity).max() < 1e-2
    np.testing.assert_allclose(state.position, q.ravel() - state.effort / control.kp, atol=1e-3)
    np.testing.assert_allclose(state.angular_rate, 0.0, atol=1e-2)
    assert np.linalg.norm(state.specific_force) == pytest.approx(GRAVITY, rel=1e-2)
    assert state.specific_force[2] > 0.98 * GRAVITY
    assert state.foot_force.sum() == pytest.approx(robot.mass * GRAVITY, rel=0.02)
    assert not side.others
    np.testing.assert_allclose(side.base[:2], stance.body[:2], atol=0.02)
    truth = side.truth()
    np.testing.assert_array_equal(truth["pose"][:3], side.base)
    assert truth["pose"][3] > 0.999 and truth["bearing"].tolist() == [1.0] * 4
    R_WB = quaternion_matrix(truth["pose"][3:])
    feet = side.base + calc_feet(robot.geometry, state.position.reshape(4, 3)) @ R_WB.T
    np.testing.assert_allclose(truth["feet"], feet, atol=2e-3)


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (LAST_MOTOR, "", "0 actuators have this joint"),
        ("<freejoint/>", "", "its trunk, and nothing else, must be free"),
        ("</worldbody>", "", "MuJoCo says: "),
        ('type="sphere"', 'type="sphere" contype="0" conaffinity="0"', "no shape that collides"),
    ],
)
def test_a_file_of_another_robot_is_refused_in_a_line(
    tmp_path: Path, before: str, after: str, told: str
) -> None:
    """It names the file and says what would be right."""
    path, prepared = standing(tmp_path)
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))
    with pytest.raises(InputError) as caught:
        MjcfSide(path, prepared)
    line = str(caught.value)
    assert told in line and str(path) in line and "\n" not in line


def test_what_only_drake_can_do_is_refused(tmp_path: Path) -> None:
    """A push of the scenario would be left out without a word."""
    path, prepared = standing(tmp_path)
    pushed = replace(prepared, disturbances=Disturbances(payload_mass=1.0))
    with pytest.raises(InputError, match="in Drake's physics alone"):
        MjcfSide(path, pushed)


@pytest.mark.slow  # two processes by the wall clock, which a machine busy with tests may not keep
def test_two_processes_over_dds_with_mujoco(tmp_path: Path) -> None:
    """By Unitree's messages on loopback the robot stands up, stands, and sits down in MuJoCo."""
    # Damped legs sink until the robot lies on its trunk, which the file has no shape of.
    trunk = '<freejoint/><geom type="box" size="0.12 0.04 0.1" mass="0"/>'
    robot, _ = standing(tmp_path, mjcf().replace("<freejoint/>", trunk))
    common = [str(tmp_path / "stand.yaml"), "--bus", "unitree", "--out", str(tmp_path), "--domain",
              str(100 + os.getpid() % 100), "--rate", "0.2"]  # fmt: skip
    command = [sys.executable, "-m", "drake_quad"]
    side = subprocess.Popen([*command, "simulate", *common, "--mjcf", str(robot)])
    try:
        subprocess.run([*command, "control", *common], timeout=240, check=True)
    finally:
        side.send_signal(signal.SIGINT)
        side.wait(60)
    told = json.loads((tmp_path / "control.json").read_text())
    assert told["outcome"] == "goal_reached" and told["largest_step"] <= 0.05
    modes = [event["mode"] for event in told["events"]]
    assert modes == ["standing_up", "standing", "walking", "standing", "sitting_down", "damping"]
    drives = json.loads((tmp_path / "robot.json").read_text())["drives"]
    assert [change["drives"] for change in drives] == ["following", "damping"]
