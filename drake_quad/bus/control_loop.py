"""The controller's side of a bus: one tick of it, whatever the clock and the bus."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_quad.bus.bus_controller import BusController, Walker
from drake_quad.bus.drive_limits import DAMP_AFTER, Drives, gain_share
from drake_quad.bus.messages import DRIVES_DAMP, CommandMessage, StateMessage
from drake_quad.bus.postures import lower, safety_limits, sit_to_stand
from drake_quad.bus.real_time import NS, Clock, LoopTimes
from drake_quad.bus.robot_bus import RobotBus, new_session
from drake_quad.bus.safety import (
    NOT_ARMED,
    Known,
    Request,
    SafetyMode,
    advance,
    initial_safety_memory,
)
from drake_quad.bus.sensor_watch import SensorWatch
from drake_quad.bus.watch import CommandWatch, StateWatch
from drake_quad.common import FloatArray
from drake_quad.planning.plan_job import PlanMaker
from drake_quad.simulation.prepared import PreparedScenario

UPRIGHT = (SafetyMode.STANDING, SafetyMode.WALKING)
STANDS = 1.0  # [s] that it stands before it walks
REST = 1.0  # [s] that it is damped before it leaves
WOULD_STAND_UP = f"{NOT_ARMED}, for it only listens: it would stand up now"
LISTENS = 0.5  # [s] that it listens for another commander before it says anything itself
# Periods, by the robot's clock, whose states a tick of the walk answers at most. After a stall of
# 60 ms thirty are waiting, and the drives would hear nothing for another 20 ms until all of them
# were answered: near to damping. Not so many states: a bus may be quicker than the controller.
AT_ONCE = 4


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


class ControlLoop:
    """A tick of the controller's side: take in, judge, go on, and say what the drives are to do.

    Args:
        prepared: The scenario, planned.
        bus: The controller's end of the bus.
        clock: The loop's clock.
        controller: What walks; a BusController of the scenario unless given.
        maker: Who makes plans while the robot stands; without one they are made within a tick.
        silent: Whether nothing is published (`--dry-run`).
        session: Its number as a sender; a new one unless given.

    Attributes:
        mode: What the safety machine does.
        events: The changes of mode so far.
        outcome: `goal_reached`, or why not; empty while it goes on.
        commanded: The last command to the drives.
        remarks: What a person should know of the robot's messages, each once.
        session: Its number as a sender.
        would_arm: Whether a silent loop would have armed the robot at any time.
    """

    def __init__(
        self,
        prepared: PreparedScenario,
        bus: RobotBus,
        clock: Clock,
        *,
        controller: Walker | None = None,
        maker: PlanMaker | None = None,
        silent: bool = False,
        session: int | None = None,
    ) -> None:
        self._control = control = prepared.scenario.controller
        self.period = control.period
        self.limits = safety_limits(prepared.robot, control)
        self._postures = sit_to_stand(prepared.robot, prepared.stance)
        self.controller: Walker = controller or BusController(prepared, control, maker)
        self._robot, self._bearing = prepared.robot, self.controller.bearing
        self._bus, self._clock, self._silent = bus, clock, silent
        self.session, self._sequence = new_session() if session is None else session, 0
        self._states, self._commands = StateWatch(self.period), CommandWatch(self.session)
        self._sensors = SensorWatch(self.limits, prepared.robot.joint_names)
        self._lost_before = 0  # messages lost while the controller was made ready
        self._start_ns = self._now_ns = clock.now_ns()
        self._memory = initial_safety_memory(self.limits, 0.0)
        self.commanded = self._memory.commanded
        self.events: list[Event] = []
        self.remarks: list[str] = []
        self.outcome, self.would_arm = "", False
        self.times = LoopTimes(self.period)
        self.largest_step = 0.0
        self.holds = 0
        self._waiting: deque[tuple[StateMessage, int]] = deque()  # states to answer, when they came
        self._answered = -1, 0  # number of the state that is answered, and when it came
        self._obeyed = 0.0  # when the drives last did as they were told [s]
        self._stop, self._sit = "", False

    @property
    def mode(self) -> SafetyMode:
        """What the safety machine does."""
        return self._memory.mode

    @property
    def reason(self) -> str:
        """Why the robot is damped, or not armed yet."""
        return self._memory.reason

    @property
    def newest(self) -> StateMessage | None:
        """The newest sound state."""
        return self._states.newest

    @property
    def lost(self) -> int:
        """How many of the robot's messages did not come, or came too late, since it was armed."""
        return self._states.lost - self._lost_before

    @property
    def tilt(self) -> float:
        """The trunk's tilt, by the IMU [rad]."""
        return float(np.arccos(np.clip(self._states.up[2], -1.0, 1.0)))

    @property
    def interval(self) -> float:
        """Time from a state to the next by the robot's clock [s]."""
        return self._states.interval

    @property
    def first_posture(self) -> FloatArray:
        """Joint angles that it goes to first as it begins to stand up (12,) [rad]."""
        return self._postures[0]

    @property
    def time(self) -> float:
        """From when the loop began to its last tick [s]."""
        return (self._now_ns - self._start_ns) / NS

    def stop(self, reason: str, *, sit: bool = False) -> None:
        """Damps the robot at the next tick, and ends once it has rested so.

        Args:
            reason: Why.
            sit: Whether a robot that stands or walks sits down before its drives damp.
        """
        self._stop, self._sit = self._stop or reason, sit

    def tick(self) -> None:
        """One tick."""
        begun = self._now_ns = self._clock.now_ns()
        come = self._bus.receive_states()
        for remark in (remark for one in come for remark in one.remarks):
            if remark not in self.remarks:
                self.remarks.append(remark)
        fresh, fault = self._states.take(come)
        for state in fresh:
            fault = fault or self._sensors.take(state)
        rival = self._commands.take(self._bus.receive_commands())
        # It was there before, and nobody is to be commanded by two; one may listen to it.
        if rival and not self.events and not self._silent:
            self._stop = self._stop or rival
        fault = fault or rival
        newest = self._states.newest
        memory, now = self._memory, (begun - self._start_ns) / NS
        fault = fault or self._drives_fault(newest, memory.mode, now)
        wanted = None
        if memory.mode == SafetyMode.WALKING:
            wanted, failed = self._walk(fresh)
            fault = fault or failed
        elif newest is not None:
            self._answered = newest.sequence, self._states.received_ns
            self._waiting.clear()
        if not self.events:
            self._suit_drives()
            self._lost_before = self._states.lost
        request = self._request(memory.mode, now)
        if request == Request.SIT and memory.mode in UPRIGHT:
            self._postures = lower(self._robot, self.commanded.q, self._states.up)
            self._bearing = self.commanded.torque
        known = Known(
            time=now,
            q=None if newest is None else newest.position,
            v=None if newest is None else newest.velocity,
            up=self._states.up,
            age=(begun - self._states.received_ns) / NS if newest is not None else np.inf,
            fault=fault,
            request=request,
            wanted=wanted,
            ended=self.controller.ended,
        )
        before = self.commanded
        self._memory, self.commanded = advance(
            memory, known, self.limits, self._postures, self._bearing
        )
        if self._silent and self._memory.mode == SafetyMode.STANDING_UP:
            # Nobody obeys: it goes on listening instead.
            self._memory, self.would_arm = replace(memory, reason=WOULD_STAND_UP), True
        self.holds += self._memory.holding
        if self.commanded.stiffness > 0.0:
            self.largest_step = max(
                self.largest_step, float(np.abs(self.commanded.q - before.q).max())
            )
        sequence, came_ns = self._answered
        if not self._silent and now >= LISTENS:
            self._publish(sequence)
        ended = self._clock.now_ns()
        self.times.note(begun, ended, -1 if newest is None else ended - came_ns)
        self._tell(memory.mode, now)

    def _drives_fault(self, newest: StateMessage | None, mode: SafetyMode, now: float) -> str:
        """Says that the drives damp although they are told something else; empty if they do not.

        They do so by themselves where commands came late, and until they are told to damp.
        """
        damp = newest is not None and newest.drives == DRIVES_DAMP
        if mode == SafetyMode.DAMPING or not damp or self._silent:
            self._obeyed = now
        late = now - self._obeyed > DAMP_AFTER
        return "the robot's drives damp, whatever they are told" if late else ""

    def _walk(self, fresh: Sequence[StateMessage]) -> tuple[Drives | None, str]:
        """What the controller wants after new states, and what went wrong in it, which damps.

        Whatever that is: the drives may not be left with what they were told last. Of many states
        at once some wait for the ticks that follow, which come without a pause.
        """
        waiting = self._waiting
        waiting.extend((state, self._states.received_ns) for state in fresh)
        if not waiting:
            return None, self.controller.fault
        end_ns = waiting[0][0].time_ns + AT_ONCE * round(self.period * NS)
        try:
            while waiting and waiting[0][0].time_ns < end_ns:
                state, came_ns = waiting.popleft()
                self.controller.take(state)
                self._answered = state.sequence, came_ns
            return self.controller.wanted(), self.controller.fault
        except Exception as problem:
            said = str(problem).splitlines()[:1]
            return None, ": ".join(["the controller failed", type(problem).__name__, *said])

    def release(self) -> None:
        """Tells the drives to damp, now, for a loop that cannot go on."""
        last, zero = self.commanded, np.zeros(12)
        self.commanded = Drives(last.q, zero, zero, 0.0, self.limits.damping)
        self._memory = replace(self._memory, mode=SafetyMode.DAMPING, commanded=self.commanded)
        if not self._silent:
            self._publish(-1)

    def _suit_drives(self) -> None:
        """Takes the gains down for drives that are slower than the controller, before it arms."""
        share = gain_share(self.period, self._states.interval)
        stiffness, damping = self._control.kp, self._control.kd
        self.limits = replace(self.limits, stiffness=share * stiffness, damping=share * damping)

    def _request(self, mode: SafetyMode, now: float) -> Request:
        """What comes next: up, walk, down; a person's stop before all."""
        if self._stop and self._sit and (mode in UPRIGHT or mode == SafetyMode.SITTING_DOWN):
            return Request.SIT
        if self._stop:
            return Request.DAMP
        waited = now - self._memory.since
        if mode == SafetyMode.DAMPING and not self.events:
            return Request.STAND
        if mode == SafetyMode.STANDING and waited >= STANDS:
            return Request.SIT if self.controller.ended else Request.WALK
        return Request.NOTHING

    def _publish(self, state_sequence: int) -> None:
        command = self.commanded
        self._sequence += 1
        self._bus.publish_command(
            CommandMessage(
                self.session, self._sequence, self._clock.now_ns(), int(self.mode),
                state_sequence, command.q, command.v, command.torque,
                np.full(12, command.stiffness), np.full(12, command.damping),
            )
        )  # fmt: skip

    def _tell(self, before: SafetyMode, now: float) -> None:
        """Notes a change of mode, and how it all ended."""
        memory = self._memory
        if memory.mode != before:
            if not self.events and self.limits.stiffness < self._control.kp:
                share = 100.0 * self.limits.stiffness / self._control.kp
                self.remarks.append(
                    f"states come every {1e3 * self._states.interval:.1f} ms, not"
                    f" {1e3 * self.period:g}: the drives get {share:.0f} % of the planned gains"
                )
            self.events.append(Event(now, memory.mode.name.lower(), memory.reason))
        if memory.mode == SafetyMode.DAMPING and now - memory.since >= REST:
            if self._stop:
                self.outcome = f"stopped: {self._stop}"
            elif self.events and memory.reason == "sat down":
                self.outcome = self.controller.ended
            elif self.events:
                self.outcome = f"damped: {memory.reason}"
