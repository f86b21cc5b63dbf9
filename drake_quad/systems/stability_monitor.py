"""StabilityMonitor: the margins of the whole robot, from the contacts as measured."""

from math import isfinite

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem, State

from drake_quad.common import FloatArray
from drake_quad.estimation.sensor_models import CONTACTS_SIZE, FORCES, OTHERS, PLACES, SLIPS
from drake_quad.robot.state import StateLayout
from drake_quad.stability.equilibrium_region import AT_REST
from drake_quad.stability.margin_kinds import HULL
from drake_quad.stability.margins import (
    FALL_TIME,
    FALLEN_TILT,
    MarginEstimator,
    Margins,
    Posture,
    demand_of,
)
from drake_quad.stability.support_polygon import (
    FallLimits,
    measure_margins,
    watch_margins,
)
from drake_quad.systems.leaf_system import (
    DeclareModelContext,
    DeclareStateOutput,
    EvalModelContext,
    Instant,
)

FIRST = 1.5  # periods, before which no contact is measured yet
FEW = 3  # feet that have to bear
# Places of `contact_totals`.
FEW_FEET, OTHERS_TIME, OTHERS_FORCE = range(3)
# The outputs of one instant and their sizes.
MARGIN_PORTS = {"stability_margin": 1, "zmp_margin": 1, "com_position": 3, "ground_height": 1}
COM, GROUND = slice(2, 5), 5  # places among them
NO_SUPPORT = -9.0  # [m] logged instead of -inf where fewer feet than one bear


class StabilityMonitor(LeafSystem):
    """Measures margins and ends the run on a fall.

    Input ports:
        robot_state: [q; v] of the robot, the truth.
        contacts: (34,) see ContactMonitor.
    Output ports:
        stability_margin: (1,) static margin of the whole robot's centre of mass over the bearing
            feet [m]; as the four that follow, of the instant at which it is asked for.
        zmp_margin: (1,) the same for the centre of pressure of the measured forces [m].
        com_position: (3,) the whole robot's centre of mass in W [m].
        ground_height: (1,) height in W of the lowest foot that bears [m]; of the lowest foot
            where none does.
        margins: (6,) the four above, one after the other.
        least_margins: (2,) the smallest of both margins over the last `window` measurements [m]: no
            less frequent log passes one over. Infinite until contacts are measured.
        contact_totals: (3,) since the run began, over every measurement: how long fewer than three
            feet bore [s], how long anything else touched [s], and the greatest normal force of
            that [N].
        further_margins: See Margins; what the gauge does not measure is nan. Every `gauge_period`.
    """

    def __init__(
        self,
        *,
        model: MultibodyPlant,
        layout: StateLayout,
        period: float = 0.005,
        tilt_limit: float = FALLEN_TILT,
        height_limit: float = 0.25,
        gauge: MarginEstimator | None = None,
        gauge_period: float = 0.1,
        window: int = 1,
        since: float | None = None,
    ) -> None:
        """Declares it.

        Args:
            model: The robot as it is, for its centre of mass and momentum.
            layout: Places in its state.
            period: Time between measurements [s].
            tilt_limit: Tilt of the trunk from which it counts as falling [rad].
            height_limit: Height of the trunk over the feet, below which it counts as down [m].
            gauge: Measures the further margins; None for none of them.
            gauge_period: Time between measurements of those [s].
            window: Number of measurements that `least_margins` looks back on.
            since: Time from which contacts are measured, and count [s].
        """
        super().__init__()
        self.set_name("stability_monitor")
        self._model, self._layout, self._base = model, layout, int(layout.q_base)
        self._limits = FallLimits(float(np.cos(tilt_limit)), height_limit, period)
        self._state_port = self.DeclareVectorInputPort("robot_state", layout.size)
        self._contact_port = self.DeclareVectorInputPort("contacts", CONTACTS_SIZE)
        self._least = DeclareStateOutput(self, "least_margins", np.full(2, np.inf))
        self._totals = DeclareStateOutput(self, "contact_totals", np.zeros(3))
        self._further = DeclareStateOutput(self, "further_margins", np.full(len(Margins), np.nan))
        # For how long the trunk has been tilted, and down [s]; whether the further margins are
        # known; the margins of the last ticks, the oldest first [m].
        self._memory = int(self.DeclareDiscreteState(np.append(np.zeros(3), [np.inf] * 2 * window)))
        # When; then about the centre of mass, angular and linear. Nan until there is one.
        self._momentum = self.DeclareDiscreteState(np.full(7, np.nan))
        self._scratch = DeclareModelContext(self, model)
        depends = {self._state_port.ticket(), self._contact_port.ticket()}
        self.parts = Instant(self, "margins", MARGIN_PORTS, self._calc_now, depends)
        self._period = period
        self._since = FIRST * period if since is None else since
        # Unrestricted, as the contact monitor's.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self._gauge = None if gauge is None or gauge.kind == HULL else gauge
        if self._gauge is not None:
            self.DeclarePeriodicUnrestrictedUpdateEvent(gauge_period, 0.0, self._gauge_now)

    def _calc_now(self, context: Context, margins: FloatArray) -> None:
        x = self._state_port.Eval(context)
        if not isfinite(x.dot(x)):  # what is not spoils the sum of squares
            margins[:2], margins[2:] = NO_SUPPORT, np.nan
            return
        scratch = EvalModelContext(self._scratch, context)
        self._model.SetPositions(scratch, x[: self._layout.num_positions])
        com, contacts = margins[COM], self._contact_port.Eval(context)
        com[:] = self._model.CalcCenterOfMassPositionInWorld(scratch)
        margins[GROUND] = measure_margins(
            com, contacts[:4], contacts[PLACES:SLIPS], contacts[FORCES:PLACES], NO_SUPPORT, margins
        )

    def _update(self, context: Context, states: State) -> EventStatus:
        x = self._state_port.Eval(context)
        if not isfinite(x.dot(x)):
            return EventStatus.ReachedTermination(self, "stopped: the robot's state is not finite")
        margin, zmp_margin, *_, ground = self.parts.Eval(context).tolist()
        state = states.get_mutable_discrete_state()
        memory = state.get_mutable_value(self._memory)  # begins as the Context's: it goes on
        fallen, recent = memory[:2], memory[3:]
        known = context.get_time() > self._since
        watch = (recent, state.get_mutable_value(self._least), fallen)
        now = (margin, zmp_margin, ground)
        upright = watch_margins(x, self._base, now, known, self._limits, watch)
        if known:
            self._count(self._contact_port.Eval(context), state.get_mutable_value(self._totals))
        if known and self._gauge is not None and not memory[2]:
            self._measure(context, state)  # the first time, as soon as contacts are known
        if fallen[0] > FALL_TIME:
            tilt = np.degrees(np.arccos(max(upright, -1.0)))
            return EventStatus.ReachedTermination(self, f"fell: the trunk is tilted by {tilt:.0f}°")
        if fallen[1] > FALL_TIME:
            return EventStatus.ReachedTermination(self, "fell: the trunk is down at its feet")
        return EventStatus.Succeeded()

    def _count(self, contacts: FloatArray, totals: FloatArray) -> None:
        """Adds a measurement's contacts to `contact_totals`."""
        if contacts[:4].sum() < FEW:
            totals[FEW_FEET] += self._period
        if contacts[OTHERS] > 0.0:
            totals[OTHERS_TIME] += self._period
            totals[OTHERS_FORCE] = max(totals[OTHERS_FORCE], contacts[OTHERS + 1])

    def _gauge_now(self, context: Context, state: State) -> None:
        self._measure(context, state.get_mutable_discrete_state())

    def _measure(self, context: Context, state: DiscreteValues) -> None:
        """The margins that take longer, and so are held for a while."""
        x: FloatArray = self._state_port.Eval(context)
        t = context.get_time()
        if not isfinite(x.dot(x)) or t < self._since:
            return
        assert self._gauge is not None
        model, scratch = self._model, EvalModelContext(self._scratch, context)
        model.SetPositionsAndVelocities(scratch, x)
        com = model.CalcCenterOfMassPositionInWorld(scratch)
        whole = model.CalcSpatialMomentumInWorldAboutPoint(scratch, com)
        momentum = np.concatenate([whole.rotational(), whole.translational()])
        before = context.get_discrete_state(self._momentum).value()
        robot, contacts = self._layout.read(x), self._contact_port.Eval(context)
        posture = Posture(
            bearing=contacts[:4],
            places=contacts[PLACES:SLIPS].reshape(4, 3),
            com=com,
            com_velocity=momentum[3:] / self._gauge.mass,
            p_WB=robot.p_WB,
            R_WB=robot.R_WB,
            q=robot.q,
        )
        demand = AT_REST
        if isfinite(before.sum()) and t > before[0]:
            demand = demand_of(
                momentum, before[1:], t - before[0], mass=self._gauge.mass, height=float(com[2])
            )
        state.set_value(self._momentum, [t, *momentum])
        state.set_value(self._further, self._gauge.measure(posture, demand))
        state.get_mutable_value(self._memory)[2] = 1.0
