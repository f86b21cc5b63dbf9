"""IkController: joint targets by inverse kinematics, statics fed forward."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues

from drake_quad.common import GRAVITY, Vector
from drake_quad.control.base_tracking import rotation_error
from drake_quad.control.kernel_state import Record, fields_of
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.contact_forces import distribute_wrench
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.tracking_controller import Effort, Tick, TrackingController
from drake_quad.terrain.course import Course

LEAST_LOAD = 0.01  # of a full one, with which a foot counts as one of three


class IkController(TrackingController):
    """Joint targets by inverse kinematics, with gravity and stance forces fed forward.

    Beyond what every TrackingController does, the wrench that the feet share holds a term on the
    base's error.
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
        super().__init__(robot=robot, layout=layout, model=model, control=control, course=course)
        self.set_name("ik_controller")

    def _calc_torque(self, context: Context, state: DiscreteValues, tick: Tick) -> Effort:
        """Torques (12,) that carry the legs' weight and the standing feet's forces."""
        com = self._model.CalcCenterOfMassPositionInWorld(tick.scratch)
        cx, cy, cz = com.tolist()
        torque = -self._model.CalcGravityGeneralizedForces(tick.scratch)[self._velocities]
        found = fields_of(tick.work)
        measured, target = found.measured, found.target
        feet, load = measured.feet, target.load
        # The shares need three feet: thrown off some of them, all are to be ready.
        load = load if np.sum(load > LEAST_LOAD) > 2 else np.ones(4)
        forces = distribute_wrench(
            self._force(measured, target),
            self._moment(measured, target),
            [(fx - cx, fy - cy, fz - cz) for fx, fy, fz in feet.place.tolist()],
            load.tolist(),
            least=self._control.least_force,
            normals=feet.normal.tolist(),
        )
        stance = np.einsum("kji,kj->ki", feet.jacobian, np.array(forces))
        return Effort(torque - stance.ravel(), com)

    def _force(self, measured: Record, target: Record) -> Vector:
        """The force that the feet are to make together [N]."""
        c, mass = self._control, self._robot.mass
        fx, fy, fz = (
            mass * target.acceleration[3:]
            + c.base_stiffness * (target.body[:3] - measured.p)
            + c.base_damping * (target.v - measured.v)
        ).tolist()
        return fx, fy, fz + mass * GRAVITY

    def _moment(self, measured: Record, target: Record) -> Vector:
        """The moment about the centre of mass that the feet are to make together [Nm]."""
        c = self._control
        error = rotation_error(target.R, measured.R)
        mx, my, mz = (
            c.base_rotation_stiffness * error + c.base_rotation_damping * (target.w - measured.w)
        ).tolist()
        return mx, my, mz
