"""A robot's own MJCF as the robot's side of a bus: its messages mean what ours mean."""

from pathlib import Path

import numpy as np
import pytest
from robot_formats import LEGS, mjcf

from benchmarks.mjcf_robot import MjcfSide
from drake_quad.bus.messages import DRIVES_FOLLOW, CommandMessage
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.processes import load_for_bus
from drake_quad.common import GRAVITY
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.simulation.prepare import PreparedScenario, prepare

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


def standing(folder: Path) -> tuple[Path, PreparedScenario]:
    """The robot's file, and a scenario in which it stands."""
    robot, scenario = folder / "r.xml", folder / "stand.yaml"
    text = mjcf()
    for leg in LEGS:  # in the order in which the file has them
        text = text.replace('<geom type="sphere"', f'<geom name="{leg}" type="sphere"', 1)
    robot.write_text(text)
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
