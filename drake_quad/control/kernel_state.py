"""Structured array types of the control loop, which its kernels read and write, and its constants.

A kernel's call costs by the number of its arguments, and a NamedTuple counts field by field. A
record is an array of one element, whose fields have the names that the NamedTuples have: kernels
that take those take a part of a record as well.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.control.settings import ControlSettings
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import LegGeometry, RobotModel
from drake_quad.robot.state import StateLayout

# One element of such an array, its fields read as attributes: by numba, and by numpy's recarray.
Record = Any
Records = NDArray[np.void]
Dtype = np.dtype[np.void]
Shape = tuple[int, ...]


def record_type(fields: Mapping[str, Shape | Dtype]) -> Dtype:
    """The type of a record of float arrays by their shapes, () for a number, and of records."""
    columns: list[Any] = [
        (name, np.float64, what) if isinstance(what, tuple) else (name, what)
        for name, what in fields.items()
    ]
    return np.dtype(columns, align=True)


# The feet at one instant, all in W. The contact Jacobian is that of the material points where the
# ground pushes, a radius off the centres against the ground's normal.
FEET = record_type(
    {
        "place": (4, 3),  # centres of the foot spheres [m]
        "velocity": (4, 3),  # [m/s]
        "drift": (4, 3),  # acceleration while base and joints have none [m/s^2]
        "jacobian": (4, 3, 3),  # of the centres by each leg's joints [m/rad]
        "contact_jacobian": (4, 3, 3),  # [m/rad]
        "normal": (4, 3),  # unit normals of the ground under them, as felt or by the map
    }
)
# The fields of RobotMeasurement, see there.
MEASURED = record_type(
    {
        "p": (3,),
        "R": (3, 3),
        "w": (3,),
        "v": (3,),
        "q": (12,),
        "qd": (12,),
        "feet": FEET,
        "known": (),
    }
)
# What base and feet are to do now, in W.
TARGET = record_type(
    {
        "body": (5,),  # x, y, z [m], pitch, yaw [rad]
        "R": (3, 3),  # R_WB
        "v": (3,),  # velocity of B [m/s]
        "w": (3,),  # angular velocity of B [rad/s]
        "acceleration": (6,),  # of B, angular, then linear [rad/s^2, m/s^2]
        "feet_acceleration": (4, 3),  # [m/s^2]
        "load": (4,),  # how much each foot may carry, 0 to 1
    }
)

# What a robot's feet are measured by: its legs (see `leg_array`), and the indices of its state (see
# `state_indices`). All records that hold these hold them in this layout, because a
# kernel is compiled anew for any other.
ROBOT = [("legs", np.float64, (4, 8)), ("places", np.int64, (26,))]

# What a tick finds on its way. Beyond what is measured and wanted: where the feet are to be in W
# (4, 3) [m] and how fast [m/s]; how soft the legs are to be, 0 to 1, (4,); which feet bear
# and are to lift off as soon as the clock goes on, 0 or 1, (4,); how far the centre of mass is from
# the model's in W (2,) [m]; the joints' torques by the feet's forces, (12, 12) and (12,) [Nm].
WORK = record_type(
    {
        "measured": MEASURED,
        "target": TARGET,
        "place": (4, 3),
        "velocity": (4, 3),
        "soft": (4,),
        "leaving": (4,),
        "com_shift": (2,),
        "torque": (12, 12),
        "torque_offset": (12,),
    }
)


def new_record(kind: Dtype) -> Records:
    """One record, all zero."""
    return np.zeros(1, dtype=kind)


def fields_of(record: Records) -> Record:
    """The one element, its fields to be read and written as attributes."""
    return record.view(np.recarray)[0]


# Places in a controller's memory: each foot's hold in W (12) [m]; the foot less its planned place
# when it lifted off (12) [m]; how deep each has searched below the plan for ground (4) [m]; whether
# each, swinging, found ground before its time (4); the standing feet's mean height over the plan's
# [m];
# where a catching foot set out from (3) [m]; how fast the body follows its path, and how far it is
# ahead of the gait clock there [s]; how far a foot that had lost the ground has come back to its
# full load, 0 to 1, (4), or NEVER for one that has not borne yet, as a run begins;
# how much lower the body is for its legs to reach the ground [m].
HOLD, LIFTED, DEPTH, LANDED, HEIGHT, CAUGHT = 0, 12, 24, 28, 32, 33
BODY_RATE, LEAD, REGAINED, LOWER = 36, 37, 38, 42
MEMORY_SIZE = 43
NEVER = 2.0


def new_memory(feet: FloatArray) -> FloatArray:
    """What a controller remembers (MEMORY_SIZE,) as it begins, on its feet in W (4, 3) [m]."""
    memory = np.zeros(MEMORY_SIZE)
    memory[HOLD : HOLD + 12] = feet.ravel()
    memory[BODY_RATE] = np.nan
    memory[REGAINED : REGAINED + 4] = NEVER
    return memory


class Pace(NamedTuple):
    """Times and speeds of `compute_foot_targets`; see ControlSettings.

    Attributes:
        period: Control period [s].
        foothold_time: Time over which a standing foot's target follows where it stands [s].
        touchdown_press: How far below the ground a swing foot aims as it lands [m].
        landing_speed: Speed downwards of a swing foot that found no ground in its time [m/s].
        search_speed: Speed downwards of a foot that lost the ground [m/s].
        height_time: Time over which the body follows the height of the ground as found [s].
    """

    period: float
    foothold_time: float
    touchdown_press: float
    landing_speed: float
    search_speed: float
    height_time: float


class Weights(NamedTuple):
    """Weights and limits of the program of contact forces.

    Attributes:
        angular: Weight of the error of the base's angular acceleration.
        linear: Weight of the error of its linear acceleration.
        force: Weight of the squared normal forces [1/N^2].
        along: Weight of the squared force along the ground of a foot that bears its even share
            [1/N^2].
        greatest_force: Greatest normal force of a foot under full load [N].
        pressure_margin: Distance of the centre of pressure from the support's sides [m].
    """

    angular: float
    linear: float
    force: float
    along: float
    greatest_force: float
    pressure_margin: float


class BaseGains(NamedTuple):
    """How the base's errors are corrected: accelerations per error, and the most of each.

    Attributes:
        stiffness: Acceleration per error of place [1/s^2].
        damping: Acceleration per error of velocity [1/s].
        rotation_stiffness: Angular acceleration per error of orientation [1/s^2].
        rotation_damping: Angular acceleration per error of angular velocity [1/s].
        most_shift: Greatest error of place that counts [m].
        most_turn: Greatest error of orientation that counts [rad].
        most_acceleration: Greatest horizontal acceleration in all [m/s^2].
    """

    stiffness: float
    damping: float
    rotation_stiffness: float
    rotation_damping: float
    most_shift: float
    most_turn: float
    most_acceleration: float


def longest_legs(geometry: LegGeometry, q_lower: FloatArray, q_upper: FloatArray) -> FloatArray:
    """From hip to foot's centre, the knee as straight as its limits let it be (4,) [m].

    Args:
        geometry: The legs' lengths.
        q_lower: Lower joint limits, leg by leg (12,) [rad].
        q_upper: Upper joint limits (12,) [rad].
    """
    least = np.maximum(np.maximum(q_lower[2::3], -q_upper[2::3]), 0.0)  # |knee|
    a, b = geometry.thigh, geometry.shank
    return np.asarray(np.sqrt(a * a + b * b + 2.0 * a * b * np.cos(least)))


class Softness(NamedTuple):
    """How much of the joints' stiffness a loaded leg keeps, and how far it may pull.

    Attributes:
        share: Share of the stiffness and damping that is left under full load.
        most_away: Greatest distance of a loaded leg's joints from their targets [rad].
        most_faster: Greatest distance of their speeds from the targets [rad/s].
    """

    share: float
    most_away: float
    most_faster: float


class PayloadUpdate(NamedTuple):
    """Gains of the payload observer.

    Attributes:
        force_rate: Rate of the force per height error [N/(m s)].
        moment_rate: Rate of the moments per tilt error [Nm/(rad s)].
        weight: Robot weight without the payload [N].
        period: Control period [s].
    """

    force_rate: float
    moment_rate: float
    weight: float
    period: float


def state_indices(layout: StateLayout) -> IntArray:
    """Indices of the base's quaternion and angular velocity, of joint angles and speeds (26,)."""
    return np.concatenate([[layout.q_base, layout.v_base], layout.q_joints, layout.v_joints])


# Only so much of a large error is corrected at once: if the feet cannot give what is wanted,
# the program trades the robot's uprightness for it.
MOST_SHIFT = 0.04  # [m]
MOST_TURN = 0.03  # [rad]
MOST_ACCELERATION = 3.0  # [m/s^2], horizontal
MOST_AWAY = 0.05  # [rad] of a loaded leg's joints from their targets
MOST_FASTER = 0.5  # [rad/s]


LEG = 1.22  # [m] of the robot that the time below is of; times go with the root of the length
LOOK_AHEAD = 0.05  # [s] within which a joint is to stop before its limit


def _numbers(kind: Any) -> np.dtype[np.void]:
    return record_type(dict.fromkeys(kind._fields, ()))


# The robot (see ROBOT, and the feet's radius [m], the longest legs [m], the joints' indices in the
# velocities and their damping leg by leg [Nm s/rad], the actuators' order of the joints, the
# joints' limits leg by leg, and the times in which legs are to stop before them [s]), and the
# settings.
CONSTANTS = np.dtype(
    [
        *ROBOT,
        ("radius", np.float64),
        ("longest", np.float64, (4,)),
        ("velocities", np.int64, (12,)),
        ("damping", np.float64, (12,)),
        ("order", np.int64, (12,)),
        ("q_lower", np.float64, (12,)),
        ("q_upper", np.float64, (12,)),
        ("look_ahead", np.float64, (4,)),
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
    damping: FloatArray,
) -> Records:
    """The record, of type CONSTANTS.

    Args:
        robot: The robot.
        layout: The state's layout.
        control: Settings of the controller.
        stiffness: Share of the joints' stiffness that a loaded leg keeps.
        inertia: The robot's moment of inertia [kg m^2].
        damping: Damping of the joints (12,), leg by leg [Nm s/rad].
    """
    constants = np.zeros(1, dtype=CONSTANTS)
    c = constants[0]
    c["legs"], c["radius"] = leg_array(robot.geometry), robot.foot_radius
    c["longest"] = longest_legs(robot.geometry, robot.q_lower, robot.q_upper)
    c["places"] = state_indices(layout)
    c["velocities"] = layout.v_joints - layout.num_positions
    c["damping"] = damping
    c["order"] = np.argsort(layout.actuators)
    c["q_lower"], c["q_upper"] = robot.q_lower, robot.q_upper
    lengths = robot.geometry.thigh + robot.geometry.shank
    c["look_ahead"] = LOOK_AHEAD * np.sqrt(lengths / LEG)  # small robots move quickly
    c["effort"], c["speed"] = robot.effort, robot.speed
    c["unload_time"], c["load_time"] = control.unload_time, control.load_time
    c["friction"], c["least_force"] = control.friction, control.least_force
    c["pace"] = Pace(
        control.period,
        control.foothold_time,
        control.touchdown_press,
        control.landing_speed,
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
