"""The simulated plant: the robot as it really is, on the course as it really is."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import (
    ModelInstanceIndex,
    PdControllerGains,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.errors import InputError
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse, SetContactFriction, SetHydroelastic

NO_STRENGTH = 1e-6  # what is left of a dead drive: Drake wants stiffness and limit above zero
PAYLOAD_DENSITY = 1000.0  # [kg/m³] a cube of water
PAYLOAD_COLOUR = [0.75, 0.15, 0.15, 1.0]


class SimulatedPlant(NamedTuple):
    """What AddSimulatedPlant added."""

    plant: MultibodyPlant
    scene_graph: SceneGraph
    instance: ModelInstanceIndex  # of the robot
    layout: StateLayout


def AddSimulatedPlant(
    builder: DiagramBuilder,
    *,
    robot: RobotModel,
    world: Course,
    control: ControlSettings,
    stance: Stance,
    config: MultibodyPlantConfig,
    friction: float,
    disturbances: Disturbances,
) -> SimulatedPlant:
    """Adds robot and world, with the drives' own PD; the robot stands in `stance` by default.

    Args:
        builder: Builder to add to.
        robot: The robot as its controller knows it.
        world: The course as it really is, whatever the map says.
        control: Controller's settings, for the drives' `kp` and `kd`.
        stance: Stance in which it stands at first.
        config: Drake's settings of the plant.
        friction: Coulomb's coefficient of contacts; see SetContactFriction.
        disturbances: Disturbances, for payload, masses, centre of mass and strength of the drives.

    Raises:
        InputError: If the robot cannot stand so.
    """
    plant, scene_graph = AddMultibodyPlant(config, builder)
    instance = AddRobot(plant, robot.url)
    trunk = plant.GetBodyByName(robot.trunk, instance)
    AddPayload(plant, trunk, disturbances)
    _ScaleMass(plant, instance, disturbances)
    _ShiftCentreOfMass(plant, trunk, disturbances)
    AddCourse(plant, world, friction=friction)
    SetContactFriction(plant, scene_graph, instance, robot, friction)
    if config.contact_model != "point":
        SetHydroelastic(plant, scene_graph, instance, robot)
    _WeakenMotors(plant, disturbances)
    plant.Finalize()
    layout = make_layout(plant, robot)
    # After Finalize: before it a model instance has no actuator indices, and the loop sets none.
    for index in plant.GetJointActuatorIndices(instance):
        actuator = plant.get_joint_actuator(index)
        strength = disturbances.motor_strength.get(actuator.joint().name(), 1.0)
        strength = max(strength, NO_STRENGTH)
        actuator.set_controller_gains(
            PdControllerGains(p=strength * control.kp, d=strength * control.kd)
        )
    angles = _stance_angles(robot, stance)
    positions = np.array(plant.GetDefaultPositions())
    quaternion = RollPitchYaw(0.0, stance.body[3], stance.body[4]).ToQuaternion()
    positions[layout.q_base : layout.q_base + 4] = quaternion.wxyz()
    positions[layout.q_base + 4 : layout.q_base + 7] = stance.body[:3]
    positions[layout.q_joints] = angles
    plant.SetDefaultPositions(positions)
    return SimulatedPlant(plant, scene_graph, instance, layout)


def MakeTrueModel(robot: RobotModel, disturbances: Disturbances) -> MultibodyPlant:
    """Returns a finalized plant of the robot alone as it really is: for monitors, the truth."""
    plant = MultibodyPlant(0.0)
    instance = AddRobot(plant, robot.url)
    trunk = plant.GetBodyByName(robot.trunk, instance)
    AddPayload(plant, trunk, disturbances)
    _ScaleMass(plant, instance, disturbances)
    _ShiftCentreOfMass(plant, trunk, disturbances)
    plant.Finalize()
    return plant


def feedforward_strength(
    plant: MultibodyPlant, robot: RobotModel, layout: StateLayout, disturbances: Disturbances
) -> FloatArray:
    """(12,) the part of each feed-forward torque that its drive delivers, by actuator index."""
    strength = np.ones(plant.num_actuators())
    for name, index in zip(robot.joint_names, layout.actuators, strict=True):
        strength[index] = disturbances.motor_strength.get(name, 1.0)
    return strength


def _stance_angles(robot: RobotModel, stance: Stance) -> FloatArray:
    """The joints' angles (12,) in `stance`, leg by leg; smaller feet are on the ground, too."""
    smaller = robot.foot_smaller
    shank = robot.geometry.shank + smaller
    real = replace(robot, geometry=replace(robot.geometry, shank=shank))
    feet = stance.feet - np.outer(smaller, [0.0, 0.0, 1.0])
    q, excess, _ = pose_robot(real, stance.body[None], feet[None])
    angles = q.reshape(12)
    outside = (angles < robot.q_lower) | (angles > robot.q_upper)
    if excess.max() > 1e-6 or np.any(outside):
        raise InputError(
            source=robot.name,
            field="gait.body_height",
            value=float(stance.body[2]),
            remedy=f"the legs cannot stand so: {excess.max():.3f} m out of reach",
        )
    return np.asarray(angles)


def AddPayload(plant: MultibodyPlant, trunk: RigidBody, disturbances: Disturbances) -> None:
    """Fixes the payload, a cube without collision, to the trunk, if there is one."""
    mass = disturbances.payload_mass
    if mass == 0.0:
        return
    side = (mass / PAYLOAD_DENSITY) ** (1.0 / 3.0)
    body = plant.AddRigidBody(
        "payload",
        plant.AddModelInstance("payload"),
        SpatialInertia.SolidBoxWithMass(mass, side, side, side),
    )
    plant.WeldFrames(trunk.body_frame(), body.body_frame(), RigidTransform(disturbances.p_BPayload))
    if plant.geometry_source_is_registered():
        plant.RegisterVisualGeometry(
            body, RigidTransform(), Box(side, side, side), "payload", PAYLOAD_COLOUR
        )


def _ScaleMass(
    plant: MultibodyPlant, instance: ModelInstanceIndex, disturbances: Disturbances
) -> None:
    """Makes every link of the robot heavier or lighter, as if of another density.

    As for `_ShiftCentreOfMass`: each link gets what it has more, or less, welded to it.
    """
    more = disturbances.mass_factor - 1.0
    if more == 0.0:
        return
    added = plant.AddModelInstance("mass_factor")
    for index in plant.GetBodyIndices(instance):
        link = plant.get_body(index)
        own = link.default_spatial_inertia()
        inertia = SpatialInertia(
            more * own.get_mass(),
            own.get_com(),
            own.get_unit_inertia(),
            skip_validity_check=True,
        )
        body = plant.AddRigidBody(f"more_{link.name()}", added, inertia)
        plant.WeldFrames(link.body_frame(), body.body_frame())


def _ShiftCentreOfMass(plant: MultibodyPlant, trunk: RigidBody, disturbances: Disturbances) -> None:
    """Moves the trunk's mass by the offset, its inertia about its own centre unchanged.

    A body's inertia cannot be changed before there is a context, and a change in a context would
    not be in the Diagram's default. Two points that add up to no mass do the same to every term
    of the dynamics: minus the trunk's mass where its centre was, plus it where it is to be.
    """
    offset = np.array(disturbances.com_offset)
    if not offset.any():
        return
    mass, p_BScm = disturbances.mass_factor * trunk.default_mass(), trunk.default_com()
    instance = plant.AddModelInstance("com_offset")
    for name, m, p in (("from", -mass, p_BScm), ("to", mass, p_BScm + offset)):
        inertia = SpatialInertia(m, p, UnitInertia.PointMass(p), skip_validity_check=True)
        body = plant.AddRigidBody(f"com_{name}", instance, inertia)
        plant.WeldFrames(trunk.body_frame(), body.body_frame())


def _WeakenMotors(plant: MultibodyPlant, disturbances: Disturbances) -> None:
    """Lowers the effort limits; before Finalize, where actuators have no model instance yet."""
    for name, factor in disturbances.motor_strength.items():
        for index in plant.GetJointActuatorIndices():
            actuator = plant.get_mutable_joint_actuator(index)
            if actuator.joint().name() == name:
                actuator.set_effort_limit(max(factor, NO_STRENGTH) * actuator.effort_limit())
