"""The robot in MuJoCo is Drake's: dynamics, masses, limits, contacts, sensors."""

from typing import Any

import numpy as np
import pytest
from mujoco_rig import GRAVITY, STEP, MujocoRobot, mujoco
from pydrake.geometry import Box, Capsule, Cylinder, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant
from rig import (
    URL,
    course_of,
    feet_of,
    flat_course,
    model_layout,
    model_plant,
    paper_robot,
    stance_at,
    state_from_joints,
)

from drake_quad.common import FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.problem import PlanSettings
from drake_quad.robot.kinematics import calc_com
from drake_quad.robot.loader import AddRobot
from drake_quad.simulation.plant import MakeTrueModel
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

REAL = {"mass_factor": 1.08, "com_offset": (0.015, -0.02, 0.01)}  # what no controller is told


def standing(course: Course | None = None, **real: Any) -> MujocoRobot:
    """The robot in MuJoCo where a run begins."""
    course, settings = course or flat_course(), PlanSettings()
    stance = stance_at(course, settings)
    return MujocoRobot(paper_robot(), model_plant(), course, ControlSettings(), stance, **real)


def hold(robot: MujocoRobot, seconds: float) -> None:
    """Lets the drives hold the joints where they are."""
    robot.command(np.array([*robot.data.ctrl, *np.zeros(12)]), np.zeros(12))
    for _ in range(round(seconds / STEP)):
        robot.step()


def throw(robot: MujocoRobot, seed: int) -> None:
    """Puts the robot into the air, in some posture and with some velocity."""
    rng, data = np.random.default_rng(seed), robot.data
    data.qpos[:3], data.qpos[3:7] = [1.0, 2.0, 30.0], rng.normal(size=4)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    q = rng.uniform(0.9 * paper_robot().q_lower, 0.9 * paper_robot().q_upper)
    data.qpos[7:], data.qvel[:] = q, rng.normal(size=18)
    mujoco.mj_forward(robot.model, data)


def from_mujoco(robot: MujocoRobot) -> FloatArray:
    """The matrix (18, 18) that takes MuJoCo's velocities to those of Drake's plant."""
    T, layout = np.zeros((18, 18)), model_layout()
    base = layout.v_base - layout.num_positions
    T[base : base + 3, 3:6], T[base + 3 : base + 6, :3] = robot.R_WB, np.eye(3)
    for joint, name in zip(layout.v_joints, paper_robot().joint_names, strict=True):
        T[joint - layout.num_positions, robot.model.joint(name).dofadr[0]] = 1.0
    return T


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("real", [{}, REAL], ids=["as told", "not as told"])
def test_robot_has_the_dynamics_that_it_has_in_drake(seed: int, real: dict[str, Any]) -> None:
    """In any posture: mass matrix, rotors included, weight, centre of mass and feet are the same.

    The mass matrix in all postures leaves nothing of the dynamics without contact open.
    """
    robot, plant = standing(**real), MakeTrueModel(paper_robot(), Disturbances(**real))
    throw(robot, seed)
    robot.data.qvel[:] = 0.0
    mujoco.mj_forward(robot.model, robot.data)
    x = robot.robot_state_estimated()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, x)
    T, mass = from_mujoco(robot), np.zeros((18, 18))
    mujoco.mj_fullM(robot.model, robot.data, mass)
    np.testing.assert_allclose(mass, T.T @ plant.CalcMassMatrix(context) @ T, atol=1e-6)
    weight = T.T @ plant.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(-robot.data.qfrc_bias, weight, atol=1e-6)
    np.testing.assert_allclose(robot.com, plant.CalcCenterOfMassPositionInWorld(context), atol=1e-9)
    feet = [robot.data.geom(name.split("::")[-1]).xpos for name in paper_robot().foot_geometry]
    np.testing.assert_allclose(feet, feet_of(x), atol=1e-9)


def test_links_have_the_masses_and_inertias_that_they_have_in_drake() -> None:
    """Body by body, to a millionth."""
    model, plant = standing().model, model_plant()
    assert model.nbody == plant.num_bodies() and model.nv == plant.num_velocities()
    for k in range(1, model.nbody):
        theirs, mine = model.body(k), plant.GetBodyByName(model.body(k).name)
        spatial = mine.default_spatial_inertia()
        assert theirs.mass[0] == pytest.approx(spatial.get_mass(), rel=1e-6)
        np.testing.assert_allclose(theirs.ipos, spatial.get_com(), atol=1e-9)
        entries = np.zeros(9)
        mujoco.mju_quat2Mat(entries, theirs.iquat)
        R = entries.reshape(3, 3)
        about_com = spatial.Shift(spatial.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
        np.testing.assert_allclose(R @ np.diag(theirs.inertia) @ R.T, about_com, atol=1e-6)


def test_joints_have_the_limits_and_friction_that_they_have_in_drake() -> None:
    """Angles, torques and damping."""
    model, plant, robot = standing().model, model_plant(), paper_robot()
    for k, name in enumerate(robot.joint_names):
        joint, drive_ = model.joint(name), model.actuator(k)
        assert joint.range == pytest.approx([robot.q_lower[k], robot.q_upper[k]])
        assert drive_.name == name
        assert drive_.forcerange == pytest.approx([-robot.effort[k], robot.effort[k]])
        assert joint.damping[0] == plant.GetJointByName(name).default_damping()
        assert joint.armature[0] == pytest.approx(0.0001 * 50.0**2)  # the file's rotor and gear


def test_what_can_be_touched_is_what_can_be_touched_in_drake() -> None:
    """The same shapes on the same links, at the same places."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, URL)
    plant.Finalize()
    inspector, model = scene_graph.model_inspector(), standing().model
    shapes = {
        inspector.GetName(g).split("::")[-1]: (
            plant.get_body(index).name(),
            inspector.GetShape(g),
            inspector.GetPoseInFrame(g).translation(),
        )
        for index in plant.GetBodyIndices(plant.GetModelInstanceByName("paper_quadruped"))
        for g in plant.GetCollisionGeometriesForBody(plant.get_body(index))
    }
    geoms = [model.geom(k) for k in range(model.ngeom) if model.geom_bodyid[k]]
    assert sorted(g.name for g in geoms) == sorted(shapes)
    for geom in geoms:
        link, shape, place = shapes[geom.name]
        assert model.body(int(geom.bodyid[0])).name == link
        np.testing.assert_allclose(geom.pos, place, atol=1e-9)
        if isinstance(shape, Box):
            assert geom.size == pytest.approx(0.5 * shape.size())
        elif isinstance(shape, Capsule | Cylinder):
            assert geom.size[:2] == pytest.approx([shape.radius(), 0.5 * shape.length()])
        else:
            assert isinstance(shape, Sphere) and geom.size[0] == shape.radius()


def test_course_is_as_high_as_the_map_everywhere() -> None:
    """Rays from above meet the boxes where its ground is, on a slope and beyond a turn too."""
    course = course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.13, run=0.5, count=3),
        Element("landing", length=3.0, turn_deg=30.0),
        Element("stairs", going="down", rise=0.13, run=0.5, count=3),
        Element("floor", length=2.0),
        Element("slope", going="up", length=2.0, height=0.3),
        Element("floor", length=2.0),
    )
    robot = standing(course)
    throw(robot, 0)  # out of the way
    low, high = course.bounds()
    met = 0
    for x, y in np.random.default_rng(1).uniform(low[:2], high[:2], (1000, 2)):
        ground = float(course.height(x, y))
        found, down = np.zeros(1, dtype=np.int32), np.array([0.0, 0.0, -1.0])
        start = np.array([x, y, 10.0])
        distance = mujoco.mj_ray(robot.model, robot.data, start, down, None, 1, -1, found, None)
        if np.isnan(ground):
            assert distance < 0.0
        else:
            assert 10.0 - distance == pytest.approx(ground, abs=1e-9)
            met += 1
    assert met > 200


def test_drives_follow_their_law_up_to_their_limits() -> None:
    """Torque is clip(feed-forward + kp angle error + kd speed error), joint by joint."""
    robot, rng, control = standing(), np.random.default_rng(3), ControlSettings()
    throw(robot, 3)
    order, limit = np.argsort(model_layout().actuators), paper_robot().effort
    q, v = (robot.joint_state_measured()[k : k + 12] for k in (0, 12))
    for spread in (0.02, 0.2):  # within the limits, and beyond
        desired = q + spread * rng.normal(size=12)
        speed, torque = v + rng.normal(size=12), 20.0 * rng.normal(size=12)
        robot.command(np.concatenate([desired[order], speed[order]]), torque[order])
        mujoco.mj_forward(robot.model, robot.data)
        wanted = torque + control.kp * (desired - q) + control.kd * (speed - v)
        np.testing.assert_allclose(
            robot.data.actuator_force, np.clip(wanted, -limit, limit), atol=1e-9
        )
    assert np.any(np.abs(wanted) > limit)


@pytest.mark.parametrize("seed", range(3))
def test_state_reaches_the_controller_in_drakes_terms(seed: int) -> None:
    """Through a step of MuJoCo's, the coordinates change as Drake has it from the velocities."""
    robot, plant, n = standing(), model_plant(), model_plant().num_positions()
    throw(robot, seed)
    robot.data.ctrl[:] = robot.data.qpos[7:]
    before = robot.robot_state_estimated()
    robot.step()
    after = robot.robot_state_estimated()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, 0.5 * (before + after)[:n])
    np.testing.assert_allclose(
        (after - before)[:n] / STEP, plant.MapVelocityToQDot(context, after[n:]), atol=2e-3
    )


def test_state_and_joint_sensors_agree_with_the_rigs_own_state() -> None:
    """At the start, the state is that of the stance, and the joints are in it leg by leg."""
    robot, stance = standing(), stance_at(flat_course(), PlanSettings())
    joints = robot.joint_state_measured()
    wanted = state_from_joints(stance.body, joints[:12])
    np.testing.assert_allclose(robot.robot_state_estimated(), wanted, atol=1e-9)
    np.testing.assert_allclose(feet_of(wanted), stance.feet, atol=1e-9)


def test_standing_robot_feels_its_weight() -> None:
    """At rest the feet bear the weight, its line passes the centre of mass, and gravity is felt."""
    robot = standing()
    hold(robot, 6.0)  # the drives alone, without the controller: it sways for a while
    force, position = robot.contacts.force, robot.contacts.position
    assert force.sum() == pytest.approx(paper_robot().mass * GRAVITY, rel=1e-3)
    assert robot.contact_state_measured().tolist() == [1.0] * 4
    np.testing.assert_allclose(force @ position[:, :2] / force.sum(), robot.com[:2], atol=1e-3)
    com = calc_com(paper_robot(), robot.joint_state_measured()[:12].reshape(4, 3))
    np.testing.assert_allclose(robot.com, robot.data.qpos[:3] + robot.R_WB @ com, atol=1e-4)
    assert robot.margin == pytest.approx(stability_margin(robot.com[:2], position[:, :2]))
    up = robot.R_WB.T @ [0.0, 0.0, GRAVITY]
    np.testing.assert_allclose(robot.imu_measured(), [0.0, 0.0, 0.0, *up], atol=1e-2)


def test_falling_robot_feels_no_weight() -> None:
    """In the air no foot bears, the accelerometer shows nothing, and the gyroscope the spin in B.

    The spin is about a principal axis that all links keep to, so that nothing moves in the robot.
    """
    robot = standing()
    q = np.array(robot.data.qpos)
    throw(robot, 4)
    robot.data.qpos[7:], robot.data.qvel[:] = q[7:], 0.0
    robot.data.qvel[:3] = [0.3, 0.2, 0.1]
    mujoco.mj_forward(robot.model, robot.data)
    hold(robot, 0.1)
    assert robot.contact_state_measured().tolist() == [0.0] * 4 and robot.margin == -9.0
    np.testing.assert_allclose(robot.imu_measured(), np.zeros(6), atol=1e-6)
    robot.data.qvel[3:6] = [0.0, 0.0, 0.5]
    robot.steps += 1  # so that the next sample is whole
    robot.step()
    w_WB = robot.robot_state_estimated()[model_layout().v_base :][:3]
    np.testing.assert_allclose(robot.imu_measured()[:3], robot.R_WB.T @ w_WB, atol=1e-9)
    assert robot.imu_measured()[2] == pytest.approx(0.5, abs=0.01)
