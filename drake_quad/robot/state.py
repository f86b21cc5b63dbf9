"""Takes a plant's state vector [q; v] apart: base pose and velocity, joints leg by leg.

The plant's own order of joints is looked up once, when the layout is made, and never assumed.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from drake_quad.common import FloatArray, IntArray
from drake_quad.math.rotations import quaternion_rotation
from drake_quad.robot.model import RobotModel

if TYPE_CHECKING:
    from pydrake.multibody.plant import MultibodyPlant


@dataclass(frozen=True, eq=False)
class RobotState:
    """One state. W world, B body.

    Attributes:
        p_WB: (3,) [m].
        R_WB: (3, 3).
        w_WB: (3,) angular velocity in W [rad/s].
        v_WB: (3,) velocity of B's origin in W [m/s].
        q: (4, 3) joint angles [rad], leg by leg.
        qd: (4, 3) joint speeds [rad/s].
    """

    p_WB: FloatArray
    R_WB: FloatArray
    w_WB: FloatArray
    v_WB: FloatArray
    q: FloatArray
    qd: FloatArray


@dataclass(frozen=True, eq=False)
class StateLayout:
    """Where what is in [q; v].

    Attributes:
        num_positions: Length of q.
        size: Length of [q; v].
        q_joints: (12,) places of the joints' angles in the state.
        v_joints: (12,) places of the joints' speeds in the state.
        q_base: Place of the base's quaternion; its position follows.
        v_base: Place of the base's angular velocity; its velocity follows.
        actuators: (12,) the plant's actuator index of each joint, leg by leg.
    """

    num_positions: int
    size: int
    q_joints: IntArray
    v_joints: IntArray
    q_base: int
    v_base: int
    actuators: IntArray

    def read(self, state: FloatArray) -> RobotState:
        """Takes `state` (size,) apart."""
        i, j = self.q_base, self.v_base
        return RobotState(
            state[i + 4 : i + 7],
            np.array(quaternion_rotation(*state[i : i + 4].tolist())),
            state[j : j + 3],
            state[j + 3 : j + 6],
            state[self.q_joints].reshape(4, 3),
            state[self.v_joints].reshape(4, 3),
        )


def make_layout(plant: "MultibodyPlant", robot: RobotModel) -> StateLayout:
    """Asks a finalized `plant` that holds `robot` where its coordinates are."""
    joints = [plant.GetJointByName(name) for name in robot.joint_names]
    base = plant.GetBodyByName(robot.trunk)
    n = plant.num_positions()
    actuators = [plant.GetJointActuatorByName(_actuator_of(plant, j.name())) for j in joints]
    return StateLayout(
        num_positions=n,
        size=n + plant.num_velocities(),
        q_joints=np.array([j.position_start() for j in joints]),
        v_joints=n + np.array([j.velocity_start() for j in joints]),
        q_base=base.floating_positions_start(),
        v_base=n + base.floating_velocities_start_in_v(),
        actuators=np.array([int(a.index()) for a in actuators]),
    )


def _actuator_of(plant: "MultibodyPlant", joint: str) -> str:
    """Name of the actuator that drives a joint."""
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        if actuator.joint().name() == joint:
            return str(actuator.name())
    raise KeyError(joint)
