"""A whole-body controller alone, and what the ground does for the torques that it asks for."""

import numpy as np
from control_rig import Controller, com_of
from rig import feet_of, model_layout, model_plant, paper_robot

from drake_quad.common import FloatArray
from drake_quad.control.measurement import measure
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.state import StateLayout
from drake_quad.systems.tracking_controller import WholeBodyController
from drake_quad.terrain.course import Course

CONTROL = ControlSettings(kind="whole_body")
MASS = paper_robot().mass


def controller_of(
    plan: MotionPlan,
    state: FloatArray,
    *,
    t: float = 0.0,
    rate: float = 1.0,
    layout: StateLayout | None = None,
    control: ControlSettings = CONTROL,
    course: Course | None = None,
) -> Controller:
    kind = WholeBodyController
    return Controller(
        kind, plan, state, control=control, t=t, rate=rate, layout=layout, course=course
    )


def ground_forces(torque: FloatArray, state: FloatArray) -> FloatArray:
    """The forces on the feet (4, 3) in W that these torques hold, the robot being at rest.

    They act where the spheres touch the ground, a radius under their centres.
    """
    plant, layout, robot = model_plant(), model_layout(), paper_robot()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    gravity = plant.CalcGravityGeneralizedForces(context)[layout.v_joints - layout.num_positions]
    feet = measure(layout, leg_array(robot.geometry), robot.foot_radius, state, state).feet
    held = -(torque + gravity.reshape(4, 3))
    return np.stack([np.linalg.solve(feet.contact_jacobian[k].T, held[k]) for k in range(4)])


def wrench_of(torque: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force [N], and moment about the centre of mass [Nm], that the ground makes."""
    forces = ground_forces(torque, state)
    arms = feet_of(state) - [0.0, 0.0, paper_robot().foot_radius] - com_of(state)
    return forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)


def nan_state() -> FloatArray:
    return np.full(model_layout().size, np.nan)
