"""The controller's side of a bus: one tick of it, whatever the clock and the bus.

The controller is the project's own Diagram, which estimates its state from the messages alone. It
is built, planned and compiled before anything may move, and it stands at its first instant until
the robot stands. In walking it takes one of its own ticks for each of the robot's periods, by the
robot's time stamps: what a lost message held it takes to have been as in the next.
"""

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator, SimulatorStatus

from drake_quad.bus.messages import CommandMessage, StateMessage
from drake_quad.bus.postures import lower, safety_limits, sit_to_stand
from drake_quad.bus.real_time import NS, Clock, LoopTimes
from drake_quad.bus.robot_bus import RobotBus, new_session
from drake_quad.bus.safety import (
    Drives,
    Known,
    Request,
    SafetyMode,
    advance,
    initial_safety_memory,
)
from drake_quad.bus.watch import CommandWatch, StateWatch
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.errors import DrakeQuadError
from drake_quad.estimation.contact_from_torques import TouchMemory, TouchSettings, observe
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.scenario.build import touch_settings
from drake_quad.simulation.instruments import velocities_at_rest
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.controller import MakeController
from drake_quad.systems.joint_contact_estimator import TorqueDynamics

MOST_TICKS = 25  # of the controller for one of the loop: what messages lost in 50 ms come to
STANDS = 1.0  # [s] that it stands before it walks
REST = 1.0  # [s] that it is damped before it leaves
BEARS = 0.01  # of the robot's weight: a foot that bears as much has contact
PORTS = ("imu_measured", "joint_state_measured", "contact_state_measured")


@dataclass(frozen=True)
class Event:
    """A change of mode.

    Attributes:
        time: Since the loop began [s].
        mode: The mode from then on.
        reason: Why, or empty.
    """

    time: float
    mode: str
    reason: str


class Walker(Protocol):
    """What wants something of the drives in walking.

    Attributes:
        ended: Why it does no more, or empty.
        bearing: Torques (12,) that bear the robot as it stands before it walks [Nm].
    """

    ended: str
    bearing: FloatArray

    def take(self, state: StateMessage) -> None: ...  # noqa: D102
    def wanted(self) -> Drives: ...  # noqa: D102


class BusController:
    """The controller Diagram by itself, fed with messages.

    Args:
        prepared: The scenario, planned.
        control: Its settings.
    """

    def __init__(self, prepared: PreparedScenario, control: ControlSettings) -> None:
        robot = prepared.robot
        model = MakeModelPlant(robot.url)
        layout = make_layout(model, robot)
        self._leg_order = layout.actuators  # of the ports' rows, leg by leg
        self._control, self._least = control, BEARS * robot.mass * GRAVITY
        feel = touch_settings(prepared.scenario)
        self._touch = None if feel is None else TouchByTorque(robot, layout, model, control, feel)
        self._diagram = MakeController(
            robot=robot,
            course=prepared.course,
            settings=prepared.settings,
            mission=prepared.tasks,
            control=control,
            model=model,
            start=prepared.stance,
            planned=prepared.plan.plans,
            foot_give=prepared.scenario.estimator.foot_give,
        )
        q, _, _ = pose_robot(robot, prepared.stance.body[None], prepared.stance.feet[None])
        self._rest = velocities_at_rest(q.reshape(12)) | {"contact_state_measured": np.ones(4)}
        for plan in prepared.plan.plans:  # what a plan works out when it is first asked for
            plan.sample(0.0)
            plan.contacts.feet_at(np.array([plan.duration]))
        self._begin()
        self._rehearse()
        self._begin()

    def _begin(self) -> None:
        """Puts it at its first instant."""
        self._simulator = Simulator(self._diagram)
        self._context = self._simulator.get_mutable_context()
        self._values = {
            name: self._diagram.GetInputPort(name).FixValue(self._context, self._rest[name])
            for name in PORTS
        }
        self._ports = [
            self._diagram.GetOutputPort(name)
            for name in ("joint_state_desired", "joint_torque_feedforward")
        ]
        self._simulator.Initialize()
        self._estimate = self._diagram.GetOutputPort("robot_state_estimated")
        self._ticks, self._last_ns, self.ended = 0, 0, ""

    def _rehearse(self) -> None:
        """Some ticks on the spot, so that all is compiled and in memory before it counts.

        What it feeds its joints there bears the robot as it stands.
        """
        for k in range(1, 101):
            self._simulator.AdvanceTo((k + 0.5) * self._control.period)
            self.bearing = self.wanted().torque

    def take(self, state: StateMessage) -> None:
        """Goes on to the time of a state, which is newer than all before."""
        if self.ended:
            return
        gap = 1
        if self._last_ns:
            gap = round((state.time_ns - self._last_ns) / (self._control.period * NS))
            if gap < 1:
                return  # a bus quicker than the controller: its next tick has not come
        self._last_ns = state.time_ns
        for name, value in (
            ("imu_measured", np.concatenate([state.angular_rate, state.specific_force])),
            ("joint_state_measured", np.concatenate([state.position, state.velocity])),
            ("contact_state_measured", self._bearing(state, gap)),
        ):
            self._values[name].GetMutableData().get_mutable_value().SetFromVector(value)
        self._ticks += min(gap, MOST_TICKS)
        try:
            status = self._simulator.AdvanceTo((self._ticks + 0.5) * self._control.period)
        except (DrakeQuadError, RuntimeError) as problem:
            self.ended = f"stopped: {str(problem).splitlines()[0]}"
            return
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            found = re.search(r'message: "(.*)"', status.FormatMessage(), re.DOTALL)
            self.ended = found.group(1) if found else status.FormatMessage()

    def wanted(self) -> Drives:
        """What it wants of the drives now, leg by leg."""
        desired, torque = (port.Eval(self._context) for port in self._ports)
        legs, c = self._leg_order, self._control
        return Drives(desired[:12][legs], desired[12:][legs], torque[legs], c.kp, c.kd)

    def _bearing(self, state: StateMessage, gap: int) -> FloatArray:
        """Which feet bear (4,)."""
        if self._touch is None:
            return (state.foot_force > self._least).astype(float)
        return self._touch.feel(self._estimate.Eval(self._context), state, gap)


class TouchByTorque:
    """Which feet bear, felt by the joints: of messages, what JointContactEstimator is of ports.

    The trunk's velocity is the estimate of the tick before, for the estimate now needs contacts.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
        control: Controller whose period is read.
        settings: How the observer listens.
    """

    def __init__(
        self, robot: RobotModel, layout: StateLayout, model: MultibodyPlant,
        control: ControlSettings, settings: TouchSettings,
    ) -> None:  # fmt: skip
        self._robot, self._layout, self._period = robot, layout, control.period
        self._settings = settings
        self._dynamics = TorqueDynamics(
            robot, layout, model, control=control, friction=robot.joint_friction
        )
        self._scratch = model.CreateDefaultContext()
        self._memory = np.zeros(TouchMemory.SIZE)
        self._before = np.zeros(self._dynamics.memory_shape)

    def feel(self, estimate: FloatArray, state: StateMessage, periods: int) -> FloatArray:
        """Which feet bear (4,), so many periods after the last call."""
        x = np.array(estimate)
        x[self._layout.q_joints], x[self._layout.v_joints] = state.position, state.velocity
        period = periods * self._period
        now, self._before = self._dynamics.calc(
            self._scratch, self._before, x, state.effort, period
        )
        observe(self._memory, now, self._robot.mass, period, self._settings)
        return self._memory[TouchMemory.BEARING].copy()


class ControlLoop:
    """A tick of the controller's side: take in, judge, go on, and say what the drives are to do.

    Args:
        prepared: The scenario, planned.
        bus: The controller's end of the bus.
        clock: The loop's clock.
        controller: What walks; a BusController of the scenario unless given.
        silent: Whether nothing is published (`--dry-run`).
        session: Its number as a sender; a new one unless given.

    Attributes:
        mode: What the safety machine does.
        events: The changes of mode so far.
        outcome: `goal_reached`, or why not; empty while it goes on.
        told: What the drives were last told.
        session: Its number as a sender.
    """

    def __init__(
        self,
        prepared: PreparedScenario,
        bus: RobotBus,
        clock: Clock,
        *,
        controller: "Walker | None" = None,
        silent: bool = False,
        session: int | None = None,
    ) -> None:
        control = prepared.scenario.controller
        self.period = control.period
        self.limits = safety_limits(prepared.robot, control)
        self._postures = sit_to_stand(prepared.robot, prepared.stance)
        self.controller: Walker = controller or BusController(prepared, control)
        self._robot, self._bearing = prepared.robot, self.controller.bearing
        self._bus, self._clock, self._silent = bus, clock, silent
        self.session, self._sequence = new_session() if session is None else session, 0
        self._states, self._commands = StateWatch(self.period), CommandWatch(self.session)
        self._start_ns = self._now_ns = clock.now_ns()
        self._memory = initial_safety_memory(self.limits, 0.0)
        self.told = self._memory.told
        self.events: list[Event] = []
        self.outcome = ""
        self.times = LoopTimes(self.period)
        self.largest_step = 0.0
        self.holds = 0
        self._stop = ""

    @property
    def mode(self) -> SafetyMode:
        """What the safety machine does."""
        return self._memory.mode

    @property
    def reason(self) -> str:
        """Why the robot is damped, or not armed yet."""
        return self._memory.reason

    @property
    def lost(self) -> int:
        """How many of the robot's messages did not come, or came too late."""
        return self._states.lost

    @property
    def time(self) -> float:
        """From when the loop began to its last tick [s]."""
        return (self._now_ns - self._start_ns) / NS

    def stop(self, reason: str) -> None:
        """Damps the robot at the next tick, and ends once it has rested so."""
        self._stop = self._stop or reason

    def tick(self) -> None:
        """One tick."""
        begun = self._now_ns = self._clock.now_ns()
        fresh, fault = self._states.take(self._bus.receive_states())
        fault = fault or self._commands.take(self._bus.receive_commands())
        newest = self._states.newest
        memory, now = self._memory, (begun - self._start_ns) / NS
        if memory.mode == SafetyMode.WALKING:
            for state in fresh:
                self.controller.take(state)
        request = self._request(memory.mode, now)
        if request == Request.SIT and memory.mode == SafetyMode.STANDING:
            self._postures = lower(self._robot, self.told.q, self._states.up)
            self._bearing = self.told.torque
        known = Known(
            time=now,
            q=None if newest is None else newest.position,
            v=None if newest is None else newest.velocity,
            up=self._states.up,
            age=(begun - self._states.received_ns) / NS if newest is not None else np.inf,
            fault=fault,
            request=request,
            wanted=self.controller.wanted()
            if memory.mode == SafetyMode.WALKING and fresh
            else None,
            ended=self.controller.ended,
        )
        before = self.told
        self._memory, self.told = advance(memory, known, self.limits, self._postures, self._bearing)
        self.holds += self._memory.holding
        if self.told.stiffness > 0.0:
            self.largest_step = max(self.largest_step, float(np.abs(self.told.q - before.q).max()))
        if not self._silent:
            self._publish(-1 if newest is None else newest.sequence)
        ended = self._clock.now_ns()
        age = -1 if newest is None else ended - self._states.received_ns
        self.times.note(begun, ended, age)
        self._tell(memory.mode, now)

    def _request(self, mode: SafetyMode, now: float) -> Request:
        """What comes next: up, walk, down; a person's stop before all."""
        if self._stop:
            return Request.DAMP
        waited = now - self._memory.since
        if mode == SafetyMode.DAMPING and not self.events:
            return Request.STAND
        if mode == SafetyMode.STANDING and waited >= STANDS:
            return Request.SIT if self.controller.ended else Request.WALK
        return Request.NOTHING

    def _publish(self, state_sequence: int) -> None:
        told = self.told
        self._sequence += 1
        self._bus.publish_command(
            CommandMessage(
                self.session, self._sequence, self._clock.now_ns(), int(self.mode),
                state_sequence, told.q, told.v, told.torque, np.full(12, told.stiffness),
                np.full(12, told.damping),
            )
        )  # fmt: skip

    def _tell(self, before: SafetyMode, now: float) -> None:
        """Notes a change of mode, and how it all ended."""
        memory = self._memory
        if memory.mode != before:
            self.events.append(Event(now, memory.mode.name.lower(), memory.reason))
        if memory.mode == SafetyMode.DAMPING and now - memory.since >= REST:
            if self._stop:
                self.outcome = f"stopped: {self._stop}"
            elif self.events and memory.reason == "sat down":
                self.outcome = self.controller.ended
            elif self.events:
                self.outcome = f"damped: {memory.reason}"
