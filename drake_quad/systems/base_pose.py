"""From a robot's state to where its base and its feet are, for whoever looks around from there."""

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout


class BasePose(LeafSystem):
    """Tells the base's pose and the feet's places, by the legs' kinematics.

    Input ports:
        robot_state_estimated: [q; v] of the robot.
    Output ports:
        base_pose_estimated: (7,) quaternion (w, x, y, z) and place of the base in W [m].
        feet_estimated: (12,) points of the feet on level ground below them in W [m], leg by leg
            (FL, FR, RL, RR).

    Args:
        robot: The robot.
        layout: Where what is in its state.
    """

    def __init__(self, *, robot: RobotModel, layout: StateLayout) -> None:
        super().__init__()
        self.set_name("base_pose")
        self._robot, self._layout = robot, layout
        self._state = self.DeclareVectorInputPort("robot_state_estimated", layout.size)
        prerequisites = {self._state.ticket()}
        self.DeclareVectorOutputPort("base_pose_estimated", 7, self._tell_pose, prerequisites)
        self.DeclareVectorOutputPort("feet_estimated", 12, self._tell_feet, prerequisites)

    def _tell_pose(self, context: Context, output: BasicVector) -> None:
        first = self._layout.q_base
        output.SetFromVector(self._state.Eval(context)[first : first + 7])

    def _tell_feet(self, context: Context, output: BasicVector) -> None:
        state = self._layout.read(self._state.Eval(context))
        feet = state.p_WB + calc_feet(self._robot.geometry, state.q) @ state.R_WB.T
        feet[:, 2] -= self._robot.foot_radius
        output.SetFromVector(feet.ravel())
