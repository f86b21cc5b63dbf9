"""RobotBus: what a controller and a robot need of a bus, whichever it is; and one in a process."""

import secrets
from collections import deque
from collections.abc import Callable
from typing import Protocol

from drake_quad.bus.messages import (
    CommandMessage,
    Received,
    StateMessage,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)


class RobotBus(Protocol):
    """A third bus is one class with these methods that is made of a `buses.BusEnd`."""

    def publish_state(self, state: StateMessage) -> None: ...  # noqa: D102
    def publish_command(self, command: CommandMessage) -> None: ...  # noqa: D102
    def receive_states(self) -> list[Received[StateMessage]]: ...  # noqa: D102
    def receive_commands(self) -> list[Received[CommandMessage]]: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


def new_session() -> int:
    """A number that no other sender has: it names a sender, and no run depends on it."""
    return secrets.randbits(62)


class LoopbackBus:
    """A bus within a process, for tests: all that is published is received once, in order.

    Messages go through their bytes, so that CRCs and versions are checked as on LCM.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self.state_bytes: deque[bytes] = deque()
        self.command_bytes: deque[bytes] = deque()

    def publish_state(self, state: StateMessage) -> None:
        """Sends a state."""
        self.state_bytes.append(encode_state(state))

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a command."""
        self.command_bytes.append(encode_command(command))

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states since the last call, oldest first."""
        return [decode_state(data, self._now_ns()) for data in _drain(self.state_bytes)]

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """The commands since the last call, oldest first."""
        return [decode_command(data, self._now_ns()) for data in _drain(self.command_bytes)]

    def close(self) -> None:
        """Has nothing to close."""


def _drain(queue: deque[bytes]) -> list[bytes]:
    return [queue.popleft() for _ in range(len(queue))]
