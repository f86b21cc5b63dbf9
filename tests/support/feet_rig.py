"""Random states of the robot, their feet as measured, and what Drake says of these."""

from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context
from rig import model_layout, model_plant, paper_robot

from drake_quad.common import FloatArray
from drake_quad.control.kernel_state import Record
from drake_quad.control.measurement import measure
from drake_quad.robot.kinematics import leg_array

KV = JacobianWrtVariable.kV


class Case(NamedTuple):
    """A state, its context in Drake, and its feet."""

    state: FloatArray
    context: Context
    feet: Record


def any_state(seed: int) -> FloatArray:
    """[q; v] of any pose, turned any way, all of it moving."""
    rng = np.random.default_rng(seed)
    layout = model_layout()
    state = rng.uniform(-2.0, 2.0, layout.size)
    quaternion = rng.normal(size=4)
    state[:4] = quaternion / np.linalg.norm(quaternion)
    return np.asarray(state)


def case_of(seed: int) -> Case:
    state, plant, robot = any_state(seed), model_plant(), paper_robot()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    legs = leg_array(robot.geometry)
    feet = measure(model_layout(), legs, robot.foot_radius, state, 0.0 * state).feet
    return Case(state, context, feet)


def drakes_jacobian(context: Context, row: int, *, under: float = 0.0) -> FloatArray:
    """Of a foot's material point `under` [m] below its centre, by Drake's velocities (3, 18)."""
    plant, robot = model_plant(), paper_robot()
    body = plant.GetJointByName(robot.joint_names[3 * row + 2]).child_body()
    X: RigidTransform = body.EvalPoseInWorld(context)
    point = np.array([0.0, 0.0, -robot.geometry.shank[row]])
    point = point + X.rotation().matrix().T @ [0.0, 0.0, -under]
    world = plant.world_frame()
    return np.asarray(
        plant.CalcJacobianTranslationalVelocity(context, KV, body.body_frame(), point, world, world)
    )


def drakes_drift(context: Context, row: int) -> FloatArray:
    """Of a foot's centre: its acceleration while no velocity changes (3,) [m/s^2]."""
    plant, robot = model_plant(), paper_robot()
    body = plant.GetJointByName(robot.joint_names[3 * row + 2]).child_body()
    point = [0.0, 0.0, -robot.geometry.shank[row]]
    world = plant.world_frame()
    bias = plant.CalcBiasTranslationalAcceleration(
        context, KV, body.body_frame(), point, world, world
    )
    return np.asarray(bias).ravel()
