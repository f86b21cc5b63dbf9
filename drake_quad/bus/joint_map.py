"""How a robot's own file means its joints and its trunk, which a bus speaks of."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.mapping import read_mapping
from drake_quad.robot.model import RobotModel


@dataclass(frozen=True, eq=False)
class JointMap:
    """How the robot's own file means its joints and its trunk: q_own = sign (q + turn).

    Attributes:
        sign: ±1 of each joint, leg by leg (12,).
        turn: Leg by leg (12,) [rad].
        R_BT: Rotation from the trunk's frame in the file to B (3, 3).
    """

    sign: FloatArray
    turn: FloatArray
    R_BT: FloatArray

    @cached_property
    def signs(self) -> FloatArray:
        """Of five vectors that go over a bus: angles, speeds, torques, and two gains (60,)."""
        return np.concatenate([np.tile(self.sign, 3), np.ones(24)])


SAME = JointMap(np.ones(12), np.zeros(12), np.eye(3))


def joint_map(robot: RobotModel) -> JointMap:
    """How the robot's own file means its joints and its trunk."""
    mapping = read_mapping(robot)
    own = [mapping.get("joints", {}).get(name, {}) for name in robot.joint_names]
    yaw = np.deg2rad(float(mapping.get("trunk", {}).get("yaw_TB_deg", 0.0)))
    R_TB = np.array(
        [[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    )
    return JointMap(
        np.array([float(one.get("sign", 1.0)) for one in own]),
        np.array([float(one.get("turn", 0.0)) for one in own]),
        R_TB.T,
    )
