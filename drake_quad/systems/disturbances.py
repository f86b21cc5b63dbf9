"""Disturbances of a run, and the systems that make them: pushes as forces, and delayed signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import accumulate

import numpy as np
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import FloatArray
from drake_quad.robot.state import StateLayout

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Push:
    """A force on a body of the robot for a while.

    Its direction is given in H, the robot's heading frame as the push begins: x ahead, y to the
    left, z up. From then on the force keeps its direction in W.

    Attributes:
        time: When it begins [s].
        duration: How long it lasts [s].
        force_H: Its force [N].
        body: Name of the body it acts on.
        p_BP: Where on that body, in the body's own frame [m].
        speed: Change of speed that its impulse makes of the robot as its file has it, without
            payload or mass factor [m/s].
    """

    time: float
    duration: float
    force_H: Vector
    body: str
    p_BP: Vector = (0.0, 0.0, 0.0)
    speed: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """All of them; by default there are none.

    Attributes:
        pushes: Forces from outside.
        payload_mass: Mass of a box fixed to the trunk [kg].
        p_BPayload: Place of its middle, in B [m].
        com_offset: Offset of the trunk's own centre of mass from the model's, in B [m].
        mass_factor: Ratio of every link's mass and inertia to the model's.
        motor_strength: Share in [0, 1] of the commanded torque, and of the effort limit, that a
            joint's drive delivers, by the joint's name.
        sensor_delay: Delay of all that the controller senses [s].
        command_delay: Delay of its commands to the drives [s]. The drives' own PD runs on the
            joints as they are.
    """

    pushes: tuple[Push, ...] = ()
    payload_mass: float = 0.0
    p_BPayload: Vector = (0.0, 0.0, 0.0)
    com_offset: Vector = (0.0, 0.0, 0.0)
    mass_factor: float = 1.0
    motor_strength: dict[str, float] = field(default_factory=dict)
    sensor_delay: float = 0.0
    command_delay: float = 0.0

    def mass_of(self, nominal: float) -> float:
        """Mass that moves [kg], of a robot whose model has `nominal`: heavier links, and a load."""
        return self.mass_factor * nominal + self.payload_mass


ONCE = 1e9  # [s] period of an event that happens once: its second time never comes

_Forces = Value[list[ExternallyAppliedSpatialForce]]


class PushSource(LeafSystem):
    """Applies each push in its time; between them it costs nothing.

    Its state changes in two events a push, and its outputs depend on that state alone.

    Input ports:
        robot_state: [q; v] of the robot, the truth: its heading as a push begins.
    Output ports:
        applied_spatial_force: The forces that act now (abstract, a list of
            ExternallyAppliedSpatialForce), for the plant's port of that name.
        push_force: (3,) their sum in W [N].
    """

    def __init__(
        self,
        *,
        pushes: Sequence[Push],
        bodies: Sequence[BodyIndex],
        layout: StateLayout,
        time_step: float,
    ) -> None:
        """Declares the events.

        Args:
            pushes: What to apply.
            bodies: What each acts on, in the plant.
            layout: The layout of the plant's state.
            time_step: Time step of the plant [s], 0 if it is continuous; pushes last a whole number
                of steps, at least one.
        """
        super().__init__()
        self.set_name("push_source")
        self._pushes, self._bodies, self._layout = tuple(pushes), tuple(bodies), layout
        self._state_port = self.DeclareVectorInputPort("robot_state", layout.size)
        self._forces = self.DeclareDiscreteState(3 * len(self._pushes))
        self._total = self.DeclareDiscreteState(3)
        self.DeclareAbstractOutputPort(
            "applied_spatial_force",
            lambda: _Forces(),
            self._calc_forces,
            {self.discrete_state_ticket(self._forces)},
        )
        self.DeclareStateOutputPort("push_force", self._total)
        for k, push in enumerate(self._pushes):
            begin, end = push.time, push.time + push.duration
            if time_step > 0.0:
                first = round(push.time / time_step)
                last = first + max(1, round(push.duration / time_step))
                # The plant's step at a time takes the state from before that time's events, so
                # they come a step ahead.
                begin, end = (first - 1) * time_step, (last - 1) * time_step
            if begin < 0.0:
                self.DeclareInitializationDiscreteUpdateEvent(partial(self._begin, k))
            else:
                self.DeclarePeriodicDiscreteUpdateEvent(ONCE, begin, partial(self._begin, k))
            self.DeclarePeriodicDiscreteUpdateEvent(ONCE, end, partial(self._end, k))

    def _begin(self, k: int, context: Context, state: DiscreteValues) -> None:
        x = self._state_port.Eval(context)
        R_WB = self._layout.read(x).R_WB
        ahead_x, ahead_y = float(R_WB[0, 0]), float(R_WB[1, 0])
        length = (ahead_x**2 + ahead_y**2) ** 0.5
        c, s = ahead_x / length, ahead_y / length
        x_H, y_H, z_H = self._pushes[k].force_H
        self._set(k, state, [c * x_H - s * y_H, s * x_H + c * y_H, z_H])

    def _end(self, k: int, context: Context, state: DiscreteValues) -> None:
        self._set(k, state, [0.0, 0.0, 0.0])

    def _set(self, k: int, state: DiscreteValues, force: list[float]) -> None:
        """Writes one push's force, and the sum with what this very instant has changed before."""
        forces = state.get_value(self._forces).copy()
        forces[3 * k : 3 * k + 3] = force
        state.set_value(self._forces, forces)
        state.set_value(self._total, forces.reshape(-1, 3).sum(axis=0))

    def _calc_forces(self, context: Context, output: Value) -> None:
        acting = []
        forces = context.get_discrete_state(self._forces).value().reshape(-1, 3)
        for push, body, force_W in zip(self._pushes, self._bodies, forces, strict=True):
            if force_W.any():
                one = ExternallyAppliedSpatialForce()
                one.body_index = body
                one.p_BoBq_B = push.p_BP
                one.F_Bq_W = SpatialForce(tau=[0.0, 0.0, 0.0], f=force_W)
                acting.append(one)
        output.set_value(acting)


class Delay(LeafSystem):
    """Passes vectors on a whole number of steps late.

    What is read from it at step k is what was on its input at step k - n; before there is such a
    step, what the constructor was given.

    Input ports:
        <name>: Any vector, for each name.
    Output ports:
        <name>_delayed: The same vector of n steps before.
    """

    def __init__(self, *, initial: Mapping[str, FloatArray], period: float, steps: int) -> None:
        """Declares the ports.

        Args:
            initial: The outputs' first values, by the signals' names.
            period: Period of the steps [s].
            steps: n, at least 1.
        """
        super().__init__()
        assert steps >= 1
        self._period, self._kept = period, steps - 1
        values = {name: np.asarray(value, dtype=float) for name, value in initial.items()}
        start = np.concatenate(list(values.values()))
        # Where each signal begins in what is kept of a step, and how long that is.
        self._starts = [0, *accumulate(len(value) for value in values.values())]
        self._size = len(start)
        self._inputs = [self.DeclareVectorInputPort(n, len(v)) for n, v in values.items()]
        # Everything but the newest goes round a ring; what comes out next lies outside of it.
        self._ring = self.DeclareDiscreteState(np.tile(start, self._kept))
        self._outputs = [self.DeclareDiscreteState(value) for value in values.values()]
        for name, index in zip(values, self._outputs, strict=True):
            self.DeclareStateOutputPort(f"{name}_delayed", index)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        parts = [port.Eval(context) for port in self._inputs]
        if self._kept:
            ring = state.get_mutable_value(self._ring)  # begins as the context has it
            at = self._size * (round(context.get_time() / self._period) % self._kept)
            for k, (index, part) in enumerate(zip(self._outputs, parts, strict=True)):
                begin, end = at + self._starts[k], at + self._starts[k + 1]
                state.set_value(index, ring[begin:end])
                ring[begin:end] = part
        else:
            for index, part in zip(self._outputs, parts, strict=True):
                state.set_value(index, part)
