"""Robots whose hip pitch axes pass above or below those of abduction: all that poses legs knows.

The robot is the shipped one with other hips, read from a file; where poses are needed, Drake's own
plant of that file is what ours is held against.
"""

import importlib
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from certificate_rig import SCRIPTS, checker
from hypothesis import given, settings, strategies as st
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context
from rig import course_of, paper_robot

from drake_quad.certificate.certify import certify_plans
from drake_quad.certificate.kinematics import shank_of
from drake_quad.feasibility.robot_picture import stand
from drake_quad.math.rotations import rotations
from drake_quad.planning import clearance as thighs
from drake_quad.planning.leg_limits import reach_left
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.planning.zmp import link_places
from drake_quad.robot.kinematics import calc_feet, calc_holding
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.terrain.elements import Element

RAISED = {"FL": -0.08, "FR": -0.08, "RL": 0.03, "RR": 0.03}
SHIPPED = Path(__file__).parents[2] / "models" / "paper_quadruped.urdf"
SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20, deadline=None)
WALK = """
robot: {{model: {model}}}
course: [{{kind: floor, length: 3.0, width: 2.0}}, {{kind: stairs, going: up, rise: 0.1,
  run: 0.5, count: 1, width: 2.0}}, {{kind: floor, length: 3.0, width: 2.0}}]
mission: [{{kind: walk, distance: 4.0}}]
gait: {{body_height: 0.95}}
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The shipped robot's file with the hip pitch joints moved."""
    text = SHIPPED.read_text()
    for leg, z in RAISED.items():
        text, count = re.subn(
            rf'(<joint name="{leg}_hip_pitch"[^>]*>\s*<origin xyz="0 \S+ )0"', rf'\g<1>{z}"', text
        )
        assert count == 1
    path = tmp_path_factory.mktemp("raised") / "raised.urdf"
    path.write_text(text)
    return str(path)


@cache
def robot_of(file: str) -> RobotModel:
    return load_robot(file)


@cache
def plant_of(file: str) -> MultibodyPlant:
    return MakeModelPlant(file)


def random_pose(robot: RobotModel, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A body (5,), feet (4, 3) in W within reach, and the joints' angles there (4, 3)."""
    rng = np.random.default_rng(seed)
    body = np.array([*rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)])
    q = stand(robot).q + rng.uniform(-0.2, 0.2, (4, 3))
    feet = body[:3] + calc_feet(robot.geometry, q) @ rotations(body).T
    return body, feet, q


def drake_at(robot: RobotModel, plant: MultibodyPlant, body: np.ndarray, q: np.ndarray) -> Context:
    """Drake's context of a pose."""
    context = plant.CreateDefaultContext()
    X = RigidTransform(RotationMatrix(rotations(body)), body[:3])
    plant.SetFreeBodyPose(context, plant.GetBodyByName(robot.trunk), X)
    for name, angle in zip(robot.joint_names, q.ravel(), strict=True):
        plant.GetJointByName(name).set_angle(context, angle)
    return context


def test_the_file_is_read_as_it_is(file: str) -> None:
    """All legs as far raised as told; of the shipped robot none is."""
    np.testing.assert_allclose(robot_of(file).geometry.raised, list(RAISED.values()))
    np.testing.assert_array_equal(paper_robot().geometry.raised, 0.0)


@FEW
@given(SEEDS)
def test_poses_masses_and_weights_are_drakes(file: str, seed: int) -> None:
    """Angles, centre of mass by two ways, and what holds the links up."""
    robot, plant = robot_of(file), plant_of(file)
    body, feet, q = random_pose(robot, seed)
    found, excess, com = pose_robot(robot, body[None], feet[None])
    assert excess.max() == 0.0
    np.testing.assert_allclose(found[0], q, atol=1e-6)
    context = drake_at(robot, plant, body, q)
    expected = plant.CalcCenterOfMassPositionInWorld(context)
    np.testing.assert_allclose(com[0], expected, atol=1e-9)
    places, mass = link_places(robot, body[None], feet[None])
    np.testing.assert_allclose(mass @ places[0] / robot.mass, expected, atol=1e-6)
    gravity = plant.CalcGravityGeneralizedForces(context)
    joints = [plant.GetJointByName(name).velocity_start() for name in robot.joint_names]
    holding = calc_holding(robot, q, rotations(body)[2])
    np.testing.assert_allclose(holding.ravel(), -gravity[joints], atol=1e-9)


@FEW
@given(SEEDS)
def test_thighs_are_where_drake_has_them(file: str, seed: int) -> None:
    """The lowest of their points is as high over level ground as by Drake's poses of the links."""
    robot, plant = robot_of(file), plant_of(file)
    body, _, q = random_pose(robot, seed)
    body[2] = 0.8
    lane = course_of(Element("floor", length=9.0, width=9.0)).lanes[0]
    found = thighs.thigh_clearance(robot, lane, body[None], q[None])[0]
    context = drake_at(robot, plant, body, q)
    for k, name in enumerate(robot.joint_names[1::3]):
        X = plant.GetJointByName(name).child_body().EvalPoseInWorld(context)
        points = robot.thigh_points[k].reshape(-1, 3)
        lowest = (X.multiply(points.T)[2].reshape(robot.thigh_points[k].shape[:2])).min(axis=1)
        assert found[k] == pytest.approx(float((lowest - robot.thigh_radii[k]).min()), abs=1e-9)


@FEW
@given(SEEDS)
def test_room_to_stretch_is_what_a_leg_has_left(file: str, seed: int) -> None:
    """From hip pitch axis to foot, at most thigh and shank; and beyond that no foot is reached."""
    robot = robot_of(file)
    g = robot.geometry
    body, feet, q = random_pose(robot, seed)
    far = np.sqrt(g.thigh**2 + g.shank**2 + 2.0 * g.thigh * g.shank * np.cos(q[:, 2]))
    knees = np.stack([robot.q_lower[2::3], robot.q_upper[2::3]]) * g.knee_sign
    bend = np.maximum(knees.min(axis=0), 0.0)
    longest = np.sqrt(g.thigh**2 + g.shank**2 + 2.0 * g.thigh * g.shank * np.cos(bend))
    room = reach_left(robot, body[None], feet[None])[0, :, 0]
    np.testing.assert_allclose(room, longest - far, atol=1e-6)


def test_a_plan_is_certified_and_checked_by_itself(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Proven for this robot, accepted by the checker for its file, refused for the shipped one."""
    p = prepare(parse_scenario(WALK.format(model=file), source="here"))
    made = certify_plans(p.robot, shank_of(p.robot), p.plan.plans, p.course.boxes)
    assert made.record is not None
    check = checker()
    check.check(made.record)
    monkeypatch.syspath_prepend(str(SCRIPTS))
    compare = importlib.import_module("certificate_robot").compare_robot
    compare(made.record, file)
    with pytest.raises(check.RefusedError, match="raised"):
        compare(made.record, SHIPPED)
