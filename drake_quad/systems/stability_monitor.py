"""StabilityMonitor: the margins of the whole robot, from the contacts as measured."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_quad.gait.support import stability_margin
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
        self._without = self.DeclareDiscreteState(4)
        self._zmp = self.DeclareDiscreteState(1)
        self._com = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("stability_margin", self._margin)
        self.DeclareStateOutputPort("lift_off_margin", self._without)
        self.DeclareStateOutputPort("zmp_margin", self._zmp)
        self.DeclareStateOutputPort("com_position", self._com)
        self._scratch = DeclareScratch(self, model)
        self.DeclarePeriodicDiscreteUpdateEvent(period, period, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        x = self._state_port.Eval(context)
        if not np.all(np.isfinite(x)):
            return EventStatus.ReachedTermination(self, "stopped: the robot's state is not finite")
        scratch = EvalScratch(self._scratch, context)
        self._model.SetPositions(scratch, x[: self._layout.num_positions])
        com = self._model.CalcCenterOfMassPositionInWorld(scratch)
        bearing = self._contact_port.Eval(context) > 0.5
        feet = self._position_port.Eval(context).reshape(4, 3)
        force = self._force_port.Eval(context).reshape(4, 3)
        margin = _finite(stability_margin(com[:2], feet[bearing, :2]))
        without = np.full(4, margin)
        for row in np.flatnonzero(bearing):
            others = bearing.copy()
            others[row] = False
            without[row] = _finite(stability_margin(com[:2], feet[others, :2]))
        load = force[:, 2].sum()
        zmp = NO_SUPPORT
        if load > 1.0:
            pressure = (force[:, 2] @ feet[:, :2]) / load
            zmp = _finite(stability_margin(pressure, feet[bearing, :2]))
        state.set_value(self._margin, [margin])
        state.set_value(self._without, without)
        state.set_value(self._zmp, [zmp])
        state.set_value(self._com, com)
        robot = self._layout.read(x)
        if robot.R_WB[2, 2] < self._tilt:
            tilt = np.degrees(np.arccos(np.clip(robot.R_WB[2, 2], -1.0, 1.0)))
            return EventStatus.ReachedTermination(self, f"fell: the trunk is tilted by {tilt:.0f}°")
        if np.any(bearing) and robot.p_WB[2] - feet[bearing, 2].min() < self._height:
            return EventStatus.ReachedTermination(self, "fell: the trunk is down at its feet")
        return EventStatus.Succeeded()


def _finite(margin: float) -> float:
    return margin if np.isfinite(margin) else NO_SUPPORT
