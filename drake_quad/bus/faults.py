"""A bus with the faults that buses have, on request and by a seed."""

import heapq
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from drake_quad.bus.messages import CommandMessage, Received, StateMessage
from drake_quad.bus.real_time import NS, Clock
from drake_quad.bus.robot_bus import RobotBus


@dataclass(frozen=True, kw_only=True)
class BusFaults:
    """What goes wrong with messages, both ways.

    Attributes:
        loss: Share of messages that are lost.
        delay: How late every message is [s].
        jitter: How much later it may be besides, evenly drawn [s]; messages keep their order.
        reorder: Share of messages that come 5 ms later than those after them.
        freeze_at: Time from which the sensors show the same without end [s]; None: they do not.
    """

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    reorder: float = 0.0
    freeze_at: float | None = None

    @property
    def any(self) -> bool:
        """Whether there is any fault at all."""
        return self != BusFaults()


LATER = 0.005  # [s] of a message that others overtake


class FaultyBus:
    """A robot's end of a bus whose messages are lost, late, out of order or frozen.

    Args:
        bus: The bus itself.
        faults: What goes wrong.
        clock: The clock of delays.
        generator: Draws which messages.
    """

    def __init__(
        self, bus: RobotBus, faults: BusFaults, clock: Clock, generator: np.random.Generator
    ) -> None:
        self._bus, self._faults, self._clock = bus, faults, clock
        self._generator, self._start_ns = generator, clock.now_ns()
        self._out: list[tuple[int, int, StateMessage]] = []
        self._in: list[tuple[int, int, Received[CommandMessage]]] = []
        self._numbers = count()
        self._last = {"out": 0, "in": 0}
        self._frozen: StateMessage | None = None

    def publish_state(self, state: StateMessage) -> None:
        """Sends a state, in time."""
        freeze = self._faults.freeze_at
        if freeze is not None and self._clock.now_ns() - self._start_ns >= freeze * NS:
            self._frozen = self._frozen or state
            state = replace(
                self._frozen, sequence=state.sequence, time_ns=state.time_ns, drives=state.drives
            )
        due = self._due("out")
        if due is not None:
            heapq.heappush(self._out, (due, next(self._numbers), state))
        self._send()

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a command at once: the faults are the robot's own end's."""
        self._bus.publish_command(command)

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states since the last call."""
        return self._bus.receive_states()

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """The commands that have come through since the last call."""
        self._send()
        for one in self._bus.receive_commands():
            due = self._due("in")
            if due is not None:
                heapq.heappush(self._in, (due, next(self._numbers), one))
        now = self._clock.now_ns()
        come = []
        while self._in and self._in[0][0] <= now:
            come.append(replace(heapq.heappop(self._in)[2], time_ns=now))
        return come

    def close(self) -> None:
        """Leaves the bus."""
        self._bus.close()

    def _due(self, way: str) -> int | None:
        """When a message sent now is to come [ns]; None if it is lost."""
        faults, draw = self._faults, self._generator.random
        if draw() < faults.loss:
            return None
        due = self._clock.now_ns() + round((faults.delay + faults.jitter * draw()) * NS)
        if draw() < faults.reorder:
            return due + round(LATER * NS)
        self._last[way] = due = max(due, self._last[way])
        return due

    def _send(self) -> None:
        now = self._clock.now_ns()
        while self._out and self._out[0][0] <= now:
            self._bus.publish_state(heapq.heappop(self._out)[2])
