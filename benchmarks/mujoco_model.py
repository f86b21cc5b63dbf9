"""The robot and the course as a model of MuJoCo's.

The robot is read from the same URDF by MuJoCo's own reader; what that format leaves to Drake's tags
(the rotors' inertia) and what is a setting (the drives' gains) comes from where Drake has it from.
"""

from collections.abc import Sequence
from importlib import resources
from typing import Any

import mujoco
import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.control.settings import ControlSettings
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course

GRAVITY = 9.81
STEP = 0.001  # [s]
PACKAGE = "package://drake_quad_models/"

# Contacts stiffer than MuJoCo's defaults (two steps are the least): a foot sinks by a quarter of a
# millimetre instead of three, and creeps by less than one while it bears instead of by seven.
CONTACT_TIME = 0.004  # [s]
FRICTION_STIFFER = 20.0  # friction against normal constraints


def build_model(
    robot: RobotModel,
    plant: MultibodyPlant,
    course: Course,
    control: ControlSettings,
    *,
    friction: float = 0.8,
    mass_factor: float = 1.0,
    com_offset: Sequence[float] = (0.0, 0.0, 0.0),
) -> Any:
    """An MjModel of the robot on the course, its joints driven as Drake's plant drives them.

    Args:
        robot: Name of a shipped model.
        plant: The robot alone, for its rotors' inertia.
        course: Course in W.
        control: Settings that have the drives' gains.
        friction: Coulomb's coefficient.
        mass_factor: Ratio of every link's mass and inertia to the file's.
        com_offset: Offset of the trunk's centre of mass from the file's, in B [m].
    """
    path = resources.files("drake_quad_models").joinpath(robot.url.removeprefix(PACKAGE))
    spec = mujoco.MjSpec.from_string(path.read_text(encoding="utf-8"))
    spec.option.timestep = STEP
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    # Implicit in the drives' damping, and in their stiffness explicit: at 1 ms far from its limit.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = FRICTION_STIFFER
    spec.body(robot.trunk).add_freejoint(name="base")
    for box in course.boxes:
        yaw, pitch = 0.5 * box.yaw, 0.5 * box.pitch
        turn, tilt = [np.cos(yaw), 0.0, 0.0, np.sin(yaw)], [np.cos(pitch), 0.0, np.sin(pitch), 0.0]
        quaternion = np.zeros(4)
        mujoco.mju_mulQuat(quaternion, turn, tilt)
        spec.worldbody.add_geom(
            name=box.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=box.centre,
            size=0.5 * box.size,
            quat=quaternion,
        )
    for geom in spec.geoms:
        geom.friction = [friction, 0.0, 0.0]
        geom.solref = [CONTACT_TIME, 1.0]
        geom.condim = 3
    rotors = [plant.get_joint_actuator(k) for k in plant.GetJointActuatorIndices()]
    inertia = {
        a.joint().name(): a.default_rotor_inertia() * a.default_gear_ratio() ** 2 for a in rotors
    }
    for name, effort in zip(robot.joint_names, robot.effort, strict=True):
        spec.joint(name).armature = inertia[name]
        # force = clip(kp (ctrl - q) - kd v): `command` puts the other terms into ctrl.
        spec.add_actuator(
            name=name,
            target=name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[control.kp] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -control.kp, -control.kd] + [0.0] * 7,
            forcelimited=True,
            forcerange=[-effort, effort],
        )
    model = spec.compile()
    model.body_mass *= mass_factor
    model.body_inertia *= mass_factor
    model.body_ipos[model.body(robot.trunk).id] += com_offset
    mujoco.mj_setConst(model, mujoco.MjData(model))  # what MuJoCo works out of these
    return model
