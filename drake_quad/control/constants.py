"""What a controller knows from the beginning, as a record that the tick's kernels take whole."""

from typing import Any

import numpy as np

from drake_quad.common import GRAVITY
from drake_quad.control.base_tracking import BaseGains, longest_legs
from drake_quad.control.joint_targets import Softness
from drake_quad.control.kernel_state import ROBOT, Pace, Records, record_type
from drake_quad.control.measurement import state_indices
from drake_quad.control.payload_observer import PayloadUpdate
from drake_quad.control.settings import ControlSettings
from drake_quad.control.whole_body_qp import Weights
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout

# Of a large error only so much is asked for at once: more than the feet can give makes the program
# trade the robot's uprightness for it.
MOST_SHIFT = 0.04  # [m]
MOST_TURN = 0.03  # [rad]
MOST_ACCELERATION = 3.0  # [m/s^2], horizontal
MOST_AWAY = 0.05  # [rad] of a loaded leg's joints from their targets
MOST_FASTER = 0.5  # [rad/s]


def _numbers(kind: Any) -> np.dtype[np.void]:
    return record_type(dict.fromkeys(kind._fields, ()))


# Of the robot: see ROBOT; the feet's radius [m], how long its legs can be [m], the joints' limits,
# leg by leg; the joints' places in the velocities; and in which order the actuators have the
# joints. The settings, see there.
CONSTANTS = np.dtype(
    [
        *ROBOT,
        ("radius", np.float64),
        ("longest", np.float64, (4,)),
        ("velocities", np.int64, (12,)),
        ("order", np.int64, (12,)),
        ("q_lower", np.float64, (12,)),
        ("q_upper", np.float64, (12,)),
        ("effort", np.float64, (12,)),
        ("speed", np.float64, (12,)),
        ("unload_time", np.float64),
        ("load_time", np.float64),
        ("friction", np.float64),
        ("least_force", np.float64),
        ("pace", _numbers(Pace)),
        ("weights", _numbers(Weights)),
        ("gains", _numbers(BaseGains)),
        ("softness", _numbers(Softness)),
        ("learning", _numbers(PayloadUpdate)),
    ],
    align=True,
)


def make_constants(
    robot: RobotModel,
    layout: StateLayout,
    control: ControlSettings,
    *,
    stiffness: float,
    inertia: float,
) -> Records:
    """The record, of type CONSTANTS.

    Args:
        robot: The robot.
        layout: Of its state.
        control: Of the controller.
        stiffness: Share of the joints' that a loaded leg keeps.
        inertia: The robot's moment of inertia [kg m^2].
    """
    constants = np.zeros(1, dtype=CONSTANTS)
    c = constants[0]
    c["legs"], c["radius"] = leg_array(robot.geometry), robot.foot_radius
    c["longest"] = longest_legs(robot.geometry, robot.q_lower, robot.q_upper)
    c["places"] = state_indices(layout)
    c["velocities"] = layout.v_joints - layout.num_positions
    c["order"] = np.argsort(layout.actuators)
    c["q_lower"], c["q_upper"] = robot.q_lower, robot.q_upper
    c["effort"], c["speed"] = robot.effort, robot.speed
    c["unload_time"], c["load_time"] = control.unload_time, control.load_time
    c["friction"], c["least_force"] = control.friction, control.least_force
    c["pace"] = Pace(
        control.period,
        control.foothold_time,
        control.touchdown_press,
        control.search_speed,
        control.height_time,
    )
    weight = robot.mass * GRAVITY
    c["weights"] = Weights(
        angular=30.0,
        linear=1.0,
        force=1e-6,
        along=1e-5,
        greatest_force=1.5 * weight,
        pressure_margin=control.pressure_margin,
    )
    c["gains"] = BaseGains(
        control.base_stiffness / robot.mass,
        control.base_damping / robot.mass,
        control.base_rotation_stiffness / inertia,
        control.base_rotation_damping / inertia,
        MOST_SHIFT,
        MOST_TURN,
        MOST_ACCELERATION,
    )
    c["softness"] = Softness(stiffness, MOST_AWAY, MOST_FASTER)
    learn_time = max(control.load_time, control.period)
    c["learning"] = PayloadUpdate(
        control.base_stiffness / learn_time,
        control.base_rotation_stiffness / learn_time,
        weight,
        control.period,
    )
    constants.setflags(write=False)
    return constants
