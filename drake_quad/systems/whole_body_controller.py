"""WholeBodyController: joint torques by inverse dynamics with contact forces from a program."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.kernel_state import fields_of
from drake_quad.control.settings import ControlSettings
from drake_quad.control.whole_body_qp import plan_forces, solve_sound, torques_of
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import DeclareStateOutput
from drake_quad.systems.tracking_controller import Effort, Tick, TrackingController
from drake_quad.terrain.course import Course

REUSES = 10  # ticks for which the last solution serves; then the robot is held still


class WholeBodyController(TrackingController):
    """Inverse dynamics of the floating base, with the feet's forces from a quadratic program.

    The base's acceleration is what the plan has, corrected by its errors; the feet's is the
    plan's, or none where they stand. The program (`control/force_qp.py`) finds the forces within
    friction, torque and joint limits. An unsolved program, or an estimate that holds no numbers, is
    survived: for REUSES ticks with the last torques, then with those that carry the robot's
    weight; it is counted.

    Output ports, beyond TrackingController's:
        qp_state: (2,) programs not solved so far; and in a row.
        carried_estimated: (3,) what an unknown load needs: a force upwards [N], and moments about
            x and y of the heading [Nm].
        friction_estimated: (4,) coefficient that each foot's force stays within: less after a slip.
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        model: MultibodyPlant,
        control: ControlSettings,
        course: Course | None = None,
    ) -> None:
        super().__init__(
            robot=robot,
            layout=layout,
            model=model,
            control=control,
            course=course,
            stiffness=control.stance_stiffness,
        )
        self.set_name("whole_body_controller")
        self._raw_torque = int(self.DeclareDiscreteState(12))
        self._qp = DeclareStateOutput(self, "qp_state", 2)
        self._carried = DeclareStateOutput(self, "carried_estimated", 3)
        assumed = np.full(4, control.friction)
        self._friction = DeclareStateOutput(self, "friction_estimated", assumed)

    def _calc_torque(self, context: Context, state: DiscreteValues, tick: Tick) -> Effort:
        model, work, com = self._model, tick.work, np.empty(3)
        M = model.CalcMassMatrix(tick.scratch)
        program, sound = plan_forces(
            M, model.CalcBiasTerm(tick.scratch), GRAVITY, tick.running, self._constants, work,
            state.get_mutable_value(self._carried), state.get_mutable_value(self._friction), com,
        )  # fmt: skip
        x = solve_sound(program) if sound else None
        qp, torque = state.get_mutable_value(self._qp), state.get_mutable_value(self._raw_torque)
        if x is not None:
            torques_of(x, work, torque)
            qp[1] = 0.0
            return Effort(torque, com)
        qp += 1.0
        return Effort(torque if qp[1] <= REUSES else self._hold_still(M, tick), com)

    def _hold_still(self, M: FloatArray, tick: Tick) -> FloatArray:
        """Torques (12,) that carry the weight on the loaded feet; joint stiffness does the rest."""
        found = fields_of(tick.work)
        load, jacobian = found.target.load, found.measured.feet.contact_jacobian
        share = load / max(load.sum(), 1e-9) * self._robot.mass * GRAVITY
        legs = M[self._velocities, 5] * GRAVITY  # see `plan_forces`
        return np.asarray(legs - (jacobian[:, 2] * share[:, None]).ravel())
