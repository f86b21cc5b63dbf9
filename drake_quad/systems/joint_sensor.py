"""JointSensor: what the joints' encoders say."""

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.estimation.joint_model import (
    IDEAL_JOINTS,
    JointErrors,
    JointNoise,
    draw_joint_errors,
)
from drake_quad.estimation.sensing import sense_joints
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.state_output import DeclareStateOutput


class JointSensor(LeafSystem):
    """The encoders of the twelve drives.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
    Output ports:
        joint_state_measured: (24,) angles [rad], then speeds [rad/s]; leg by leg (FL, FR, RL, RR),
            abduction, hip pitch, knee.
    """

    def __init__(
        self,
        *,
        layout: StateLayout,
        generator: np.random.Generator,
        noise: JointNoise = IDEAL_JOINTS,
        period: float = 0.002,
    ) -> None:
        super().__init__()
        self.set_name("joint_sensor")
        self._period = period
        self._errors = draw_joint_errors(noise, generator)
        self._places = np.concatenate([layout.q_joints, layout.v_joints])
        self._input = self.DeclareVectorInputPort("robot_state", layout.size)
        self._measured = DeclareStateOutput(self, "joint_state_measured", 24)
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    @property
    def errors(self) -> JointErrors:
        """The drives' errors in this run: for monitors and tests alone."""
        return self._errors

    def _update(self, context: Context, state: DiscreteValues) -> None:
        errors, tick = self._errors, round(context.get_time() / self._period)
        sense_joints(
            self._input.Eval(context), self._places, tick, errors.white, errors.zero, errors.count,
            state.get_mutable_value(self._measured),
        )  # fmt: skip
