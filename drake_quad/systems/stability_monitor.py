"""StabilityMonitor: the margins of the whole robot, from the contacts as measured."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, LeafSystem

from drake_quad.gait.support import margin_of_floats
from drake_quad.robot.robot_state import StateLayout
from drake_quad.systems.scratch import DeclareScratch, EvalScratch

NO_SUPPORT = -9.0  # [m] logged instead of -inf where fewer feet than one bear


class StabilityMonitor(LeafSystem):
    """Measures margins and ends the run on a fall.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
        contact_state_measured: (4,) 1 where a foot bears.
        foot_contact_position: (12,) where the feet's forces act, in W [m].
        foot_force_measured: (12,) the forces on the feet in W [N].
    Output ports:
        stability_margin: (1,) static margin of the whole robot's centre of mass over the bearing
            feet [m].
        lift_off_margin: (4,) what it would be without each leg [m].
        zmp_margin: (1,) the same for the centre of pressure of the measured forces [m].
        com_position: (3,) the whole robot's centre of mass in W [m].
    """

    def __init__(
        self,
        *,
        model: MultibodyPlant,
        layout: StateLayout,
        period: float = 0.005,
        tilt_limit: float = np.radians(40.0),
        height_limit: float = 0.25,
    ) -> None:
        super().__init__()
        self.set_name("stability_monitor")
        self._model, self._layout = model, layout
        self._tilt, self._height = np.cos(tilt_limit), height_limit
        self._state_port = self.DeclareVectorInputPort("robot_state", layout.size)
        self._contact_port = self.DeclareVectorInputPort("contact_state_measured", 4)
        self._position_port = self.DeclareVectorInputPort("foot_contact_position", 12)
        self._force_port = self.DeclareVectorInputPort("foot_force_measured", 12)
        self._margin = self.DeclareDiscreteState(1)
        self._zmp = self.DeclareDiscreteState(1)
        self._com = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("stability_margin", self._margin)
        # Asked for at lift-offs only: worked out then, from the centre of mass as last measured.
        self.DeclareVectorOutputPort(
            "lift_off_margin",
            4,
            self._calc_lift_off_margin,
            {
                self.discrete_state_ticket(self._com),
                self.input_port_ticket(self._contact_port.get_index()),
                self.input_port_ticket(self._position_port.get_index()),
            },
        )
        self.DeclareStateOutputPort("zmp_margin", self._zmp)
        self.DeclareStateOutputPort("com_position", self._com)
        self._scratch = DeclareScratch(self, model)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        x = self._state_port.Eval(context)
        if not np.all(np.isfinite(x)):
            return EventStatus.ReachedTermination(self, "stopped: the robot's state is not finite")
        scratch = EvalScratch(self._scratch, context)
        self._model.SetPositions(scratch, x[: self._layout.num_positions])
        com = self._model.CalcCenterOfMassPositionInWorld(scratch)
        bearing = [c > 0.5 for c in self._contact_port.Eval(context).tolist()]
        feet = self._position_port.Eval(context).reshape(4, 3).tolist()
        load = self._force_port.Eval(context)[2::3].tolist()
        support = [foot[:2] for foot, bears in zip(feet, bearing, strict=True) if bears]
        margin = _finite(margin_of_floats(float(com[0]), float(com[1]), support))
        total, zmp = sum(load), NO_SUPPORT
        if total > 1.0:
            x_zmp, y_zmp = (
                sum(f * foot[k] for f, foot in zip(load, feet, strict=True)) / total
                for k in range(2)
            )
            zmp = _finite(margin_of_floats(x_zmp, y_zmp, support))
        state.set_value(self._margin, [margin])
        state.set_value(self._zmp, [zmp])
        state.set_value(self._com, com)
        # R_WB's lower right entry, and the base's height, straight from the state.
        i = self._layout.q_base
        w, qx, qy, qz = x[i : i + 4].tolist()
        upright = 1.0 - 2.0 * (qx * qx + qy * qy) / (w * w + qx * qx + qy * qy + qz * qz)
        if upright < self._tilt:
            tilt = np.degrees(np.arccos(max(upright, -1.0)))
            return EventStatus.ReachedTermination(self, f"fell: the trunk is tilted by {tilt:.0f}°")
        # Where no foot bears, where they bore last: a collapsed robot may lie on its knees.
        below = [foot[2] for foot, bears in zip(feet, bearing, strict=True) if bears]
        if x[i + 6] - min(below or [foot[2] for foot in feet]) < self._height:
            return EventStatus.ReachedTermination(self, "fell: the trunk is down at its feet")
        return EventStatus.Succeeded()

    def _calc_lift_off_margin(self, context: Context, output: BasicVector) -> None:
        x, y, _ = context.get_discrete_state(self._com).value().tolist()
        bearing = [c > 0.5 for c in self._contact_port.Eval(context).tolist()]
        feet = self._position_port.Eval(context).reshape(4, 3)[:, :2].tolist()
        output.SetFromVector(
            [
                _finite(
                    margin_of_floats(x, y, [feet[k] for k in range(4) if bearing[k] and k != row])
                )
                for row in range(4)
            ]
        )


def _finite(margin: float) -> float:
    return margin if np.isfinite(margin) else NO_SUPPORT
