"""Watches on what comes over the bus: what is newest and sound, and what is wrong.

Pure of clocks and sockets: each is given what was received, and says what it makes of it.
"""

from collections import deque
from math import sqrt

import numpy as np

from drake_quad.bus.messages import CommandMessage, Received, StateMessage
from drake_quad.bus.real_time import NS
from drake_quad.bus.safety import SafetyMode
from drake_quad.common import GRAVITY, FloatArray

JUMP = 0.09  # [s] by which a robot's clock may gain on the receiver's from a state to the next
LONGEST = 0.1  # [s] for which a turn rate is taken to have lasted
GAPS = 101  # between states, of which the middle one counts
UP_TIME = 0.5  # [s] over which the accelerometer corrects which way is up
MODES = frozenset(int(mode) for mode in SafetyMode)
GONE = 0.5  # [s] of silence after which another sender may take over


class StateWatch:
    """Takes the robot's states in, in their order, and says which fault they show.

    Args:
        period: The robot's, between states [s].

    Attributes:
        newest: The newest sound state; None before there is one.
        received_ns: When it was received [ns].
        up: Which way is up, in B (3,): the gyroscope's turns, drawn to the accelerometer.
        lost: How many of the robot's periods had no state that came in time, by its clock.
    """

    def __init__(self, period: float = 0.002) -> None:
        self._period_ns = round(period * NS)
        self.newest: StateMessage | None = None
        self.received_ns = 0
        self.up: FloatArray = np.array([0.0, 0.0, 1.0])
        self.lost = 0
        self._gaps_ns: deque[int] = deque(maxlen=GAPS)

    @property
    def interval(self) -> float:
        """Time from a state to the next by the robot's clock, the median of the last [s]."""
        if not self._gaps_ns:
            return self._period_ns / NS
        return sorted(self._gaps_ns)[len(self._gaps_ns) // 2] / NS

    def take(self, received: list[Received[StateMessage]]) -> tuple[list[StateMessage], str]:
        """The states that are new and sound, oldest first; and the first fault among all.

        Those that were overtaken by a newer one are dropped without a word: buses reorder.
        """
        good: list[StateMessage] = []
        fault = ""
        for one in received:
            state, wrong = one.message, one.fault
            if state is not None and not wrong:
                wrong, old = self._compare(state, one.time_ns)
                if old:
                    continue
            if wrong:
                fault = fault or wrong
                if state is not None:
                    self._adopt(state, one.time_ns, sound=False)
                continue
            assert state is not None
            self._feel(state)
            self._adopt(state, one.time_ns, sound=True)
            good.append(state)
        return good, fault

    def _compare(self, state: StateMessage, time_ns: int) -> tuple[str, bool]:
        """What is wrong with a state beside the newest; and whether it is an old one."""
        last = self.newest
        if last is None:
            return "", False
        if state.session != last.session:
            if time_ns - self.received_ns < GONE * NS:
                return "two robots' states", False
            return "", False
        if state.sequence <= last.sequence:
            return "", True
        if state.time_ns < last.time_ns:
            return "the robot's clock went back", False
        if state.time_ns == last.time_ns:
            return "the robot's clock stands", False
        # Messages that were lost, or waited where nobody read them, account for time that passed.
        passed_ns = max(
            time_ns - self.received_ns, (state.sequence - last.sequence) * self.interval * NS
        )
        if state.time_ns - last.time_ns - passed_ns > JUMP * NS:
            return "the robot's clock jumped ahead", False
        return "", False

    def _adopt(self, state: StateMessage, time_ns: int, *, sound: bool) -> None:
        last = self.newest
        if last is None or last.session != state.session:
            if not sound and last is not None:
                return  # another robot's
        elif sound:
            gap_ns = state.time_ns - last.time_ns
            self._gaps_ns.append(gap_ns)
            if gap_ns > self._period_ns:  # the median takes a while
                usual_ns = max(self._period_ns, self.interval * NS)  # a robot may be slower
                self.lost += max(round(gap_ns / usual_ns) - 1, 0)
        if sound:
            self.newest, self.received_ns = state, time_ns

    def _feel(self, state: StateMessage) -> None:
        """Turns `up` by what the gyroscope tells, and draws it to what the accelerometer does."""
        # In plain numbers: for three of them numpy's cross product alone takes a tenth of a tick.
        fx, fy, fz = state.specific_force.tolist()
        norm, last = sqrt(fx * fx + fy * fy + fz * fz), self.newest
        sound = 0.5 < norm / GRAVITY < 1.5
        if last is None or last.session != state.session:
            if sound:
                self.up = np.array([fx, fy, fz]) / norm
            return
        dt = min((state.time_ns - last.time_ns) / NS, LONGEST)
        (wx, wy, wz), (x, y, z) = state.angular_rate.tolist(), self.up.tolist()
        x, y, z = (
            x - dt * (wy * z - wz * y), y - dt * (wz * x - wx * z), z - dt * (wx * y - wy * x),
        )  # fmt: skip
        if sound:
            share = min(dt / UP_TIME, 1.0)
            x += share * (fx / norm - x)
            y += share * (fy / norm - y)
            z += share * (fz / norm - z)
        norm = max(sqrt(x * x + y * y + z * z), 1e-9)
        self.up = np.array([x / norm, y / norm, z / norm])


class CommandWatch:
    """Takes commands in and says whether another commander than one's own, or two, are there.

    Args:
        own: Session of one's own commands, which are no others'; None for a robot's side.

    Attributes:
        newest: The newest sound command of the one commander; None before there is one.
        received_ns: When it was received [ns].
    """

    def __init__(self, own: int | None = None) -> None:
        self.newest: CommandMessage | None = None
        self.received_ns = 0
        self._own = own

    def take(self, received: list[Received[CommandMessage]]) -> str:
        """Takes them in; what is wrong with them, or empty."""
        fault = ""
        for one in received:
            command = one.message
            if command is None or one.fault:
                fault = fault or one.fault
                continue
            if command.mode not in MODES:
                fault = fault or f"a command of mode {command.mode}, which there is not"
                continue
            if self._own is not None:
                if command.session != self._own:
                    fault = fault or "a second commander"
                continue
            last = self.newest
            if last is not None and command.session != last.session:
                if one.time_ns - self.received_ns < GONE * NS:
                    fault = fault or "a second commander"
                    continue
            elif last is not None:
                if command.sequence <= last.sequence:
                    continue
                if command.time_ns < last.time_ns:
                    fault = fault or "the commander's clock went back"
                    continue
            self.newest, self.received_ns = command, one.time_ns
        return fault
