"""What the filter remembers between ticks: one flat vector, and where what is in it.

One vector of floats is what a Context can hold and what a compiled kernel takes in one piece.
Errors of the covariance are in the order orientation, velocity, position, feet FL, FR, RL, RR,
gyroscope bias, accelerometer bias: three each, all but the biases in W.
"""

from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.math.rotations import yaw_pitch_rotation
from drake_quad.robot.kinematics import leg_array
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout


@dataclass(frozen=True, kw_only=True)
class EstimatorSettings:
    """Noise, thresholds and times of the filter.

    Deviations are one sigma, densities per sqrt(Hz).

    The sensors' own figures are in `sensor_models`; those here are greater, for they
    stand in as well for what no model has: ground that gives, delays, structure that bends.

    Attributes:
        gyro_density: White noise of the gyroscope [rad/s/sqrt(Hz)].
        accel_density: White noise of the accelerometer [m/s^2/sqrt(Hz)].
        gyro_walk: How fast the gyroscope's bias walks [rad/s/sqrt(s)].
        accel_walk: How fast the accelerometer's bias walks [m/s^2/sqrt(s)].
        foot_walk: How fast a firm foot's centre may creep [m/sqrt(s)].
        foot_noise: Deviation of a foot's place in B by the joints [m].
        settle_time: How long a foot must bear before it counts as firm [s].
        release_time: How long a firm foot may seem not to bear before it is let go [s]: contact
            flags chatter.
        gate: Greatest squared Mahalanobis distance (3 degrees of freedom) of a firm foot's
            innovation; beyond it the foot has slipped.
        still_speed: A foot faster than this [m/s], and than three deviations of the base's velocity
            more, is not taken as firm.
        doubt: How fast the velocity grows uncertain while feet bear and all of them seem to slide
            [m/s/sqrt(s)].
        initial_tilt: Deviation of the first roll and pitch [rad].
        initial_yaw: Deviation of the first yaw [rad].
        initial_velocity: Deviation of the first velocity [m/s].
        initial_position: Deviation of the first position [m].
        initial_gyro_bias: Deviation of the gyroscope's turn-on bias [rad/s].
        initial_accel_bias: Deviation of the accelerometer's turn-on bias [m/s^2].
        shock: Velocity that a knock beyond the accelerometer's range may hide [m/s].
        gyro_range: Greatest rate that the gyroscope shows [rad/s].
        accel_range: Greatest specific force that the accelerometer shows [m/s^2].
        lost_velocity: Deviation of the velocity from which the estimate is not healthy [m/s].
        level_start: Deviation of the ground's height under the feet where the robot is put [m];
            0 if the ground there is not known to be level.
        foot_sink: Deviation of what a foot sinks in, or gives, once it is loaded [m].
        map_height: Deviation of the ground's height from the map's, where a foot comes to stand
            [m]; 0 if no map is counted on.
        step_drift: Deviation of what each step of a foot adds to the place along the ground, beyond
            what the noises above do: feet roll and give by shares that are not white [m].
        camera_range: Deviation of how much too far ahead the camera sees landmarks, as long as it
            is the same camera [m].
        camera_yaw: Deviation of its heading on the robot [rad].
        camera_side: Deviation of how much too far to the left it sees them [m].
        landmarks_alike: How many sightings of landmarks, one after the other, err as one.
    """

    gyro_density: float = 2.0e-4
    accel_density: float = 1.0e-3
    gyro_walk: float = 5.0e-6
    accel_walk: float = 1.0e-4
    foot_walk: float = 1.0e-4
    foot_noise: float = 5.0e-4
    settle_time: float = 0.02
    release_time: float = 0.006
    gate: float = 16.3
    still_speed: float = 0.15
    doubt: float = 0.2
    initial_tilt: float = 0.02
    initial_yaw: float = 1.0e-3
    initial_velocity: float = 0.05
    initial_position: float = 1.0e-3
    initial_gyro_bias: float = 5.0e-3
    initial_accel_bias: float = 0.05
    shock: float = 0.5
    gyro_range: float = 7.85
    accel_range: float = 196.0
    lost_velocity: float = 0.3
    level_start: float = 0.0
    foot_sink: float = 0.0
    map_height: float = 0.0
    step_drift: float = 0.0
    camera_range: float = 0.0
    camera_yaw: float = 0.0
    camera_side: float = 0.0
    landmarks_alike: float = 5.0


DEFAULT_SETTINGS = EstimatorSettings()


# One element of an array of a structured type, its fields read as attributes.
Record = Any
# The settings as the kernels take them, and all that stays the same from tick to tick: lengths of
# the legs, see `robot.kinematics.leg_array`; radius of the feet [m]; period of the filter [s]; and
# where the joints' angles, then their speeds, the base's quaternion and its angular velocity are in
# the estimated state.
SETTINGS = np.dtype([(f.name, np.float64) for f in fields(EstimatorSettings)], align=True)
MODEL = np.dtype(
    [
        ("settings", SETTINGS),
        ("legs", np.float64, (4, 8)),
        ("radius", np.float64),
        ("dt", np.float64),
        ("places", np.int64, (24,)),
        ("q_base", np.int64),
        ("v_base", np.int64),
    ],
    align=True,
)


def filter_model(
    robot: RobotModel,
    settings: EstimatorSettings,
    *,
    radius: float,
    period: float,
    layout: StateLayout,
) -> NDArray[np.void]:
    """The filter's constants, an array of one record of the type MODEL; read-only.

    Args:
        robot: The robot.
        settings: What the filter assumes.
        radius: Radius of the feet [m].
        period: Period of the filter [s].
        layout: Layout of the estimated state.
    """
    model = np.zeros(1, dtype=MODEL)
    m = model[0]
    m["settings"], m["legs"] = astuple(settings), leg_array(robot.geometry)
    m["radius"], m["dt"] = radius, period
    m["places"] = np.concatenate([layout.q_joints, layout.v_joints])
    m["q_base"], m["v_base"] = layout.q_base, layout.v_base
    model.setflags(write=False)
    return model


# Places in the memory.
ROTATION = 0  # R_WB by rows (9)
VELOCITY = 9  # v_WB (3) [m/s]
POSITION = 12  # p_WB (3) [m]
FEET = 15  # where the feet's centres stand in W, by leg (12) [m]; of firm feet alone
GYRO_BIAS = 27  # in B (3) [rad/s]
ACCEL_BIAS = 30  # in B (3) [m/s^2]
ANGLES = 33  # joint angles of the last good tick (12) [rad]
BORNE = 45  # how long each foot has borne (4) [s]
GONE = 49  # how long since each foot bore (4) [s]
FIRM = 53  # 1 for each foot that the filter holds fixed (4)
SLIP = 57  # 1 for each foot that slipped and has not been firm since (4)
STARTED = 61  # 1 once the first good tick has been
RATE = 62  # w_WB of the last good tick (3) [rad/s]
LEVELLED = 65  # 1 once the feet have been taken to stand on level ground
CAMERA = 66  # what the camera has wrong of landmarks: ahead [m], about the vertical, aside (3)
SIGHTED = 69  # time of the last landmark that was seen [s]
LANDMARKS = 70  # how many sightings there have been
LANDMARK_OFF = 71  # what the last one had, less what the camera has wrong; 0 if unseen (3)
COVARIANCE = 74  # by rows (30 x 30)

ERRORS = 30
SIZE = COVARIANCE + ERRORS * ERRORS

# Places of the errors in the covariance.
E_ROTATION, E_VELOCITY, E_POSITION, E_FEET, E_GYRO, E_ACCEL, E_CAMERA = 0, 3, 6, 9, 21, 24, 27


def initial_memory(
    settings: EstimatorSettings, p_WB: FloatArray, yaw: float, pitch: float, q: FloatArray
) -> FloatArray:
    """The memory (SIZE,) of a robot that is put at a known place and has not felt anything yet.

    Args:
        settings: The filter's settings, with the deviations of the first state.
        p_WB: Place of the base, (3,) [m].
        yaw: Heading of the base [rad].
        pitch: Pitch, until the first specific force shows it better [rad].
        q: Joint angles, (12,) [rad].
    """
    m = np.zeros(SIZE)
    m[ROTATION : ROTATION + 9] = np.ravel(yaw_pitch_rotation(pitch, yaw))
    m[POSITION : POSITION + 3] = p_WB
    m[ANGLES : ANGLES + 12] = q
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    # Right-invariant errors: p's is δp + p × δθ, so a tilt about the base's own place moves both.
    x, y, z = p_WB
    L = np.vstack(
        [np.eye(3), np.zeros((3, 3)), np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])]
    )
    s = settings
    tilt, heading = s.initial_tilt**2, s.initial_yaw**2
    P[:9, :9] = L @ np.diag([tilt, tilt, heading]) @ L.T
    for at, deviation in (
        (E_VELOCITY, s.initial_velocity),
        (E_POSITION, s.initial_position),
        (E_GYRO, s.initial_gyro_bias),
        (E_ACCEL, s.initial_accel_bias),
    ):
        P[range(at, at + 3), range(at, at + 3)] += deviation**2
    m[SIGHTED] = -np.inf
    for k, deviation in enumerate((s.camera_range, s.camera_yaw, s.camera_side)):
        P[E_CAMERA + k, E_CAMERA + k] = deviation**2
    return m
