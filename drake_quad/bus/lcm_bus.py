"""The bus over LCM: UDP multicast, with the messages that `quad_bus.lcm` defines.

The `lcm` package is used, and not Drake's DrakeLcm, which keeps one message of a channel: of a
burst all but the last would be lost, and with them what the IMU felt meanwhile.
"""

from collections import deque
from collections.abc import Callable

from drake_quad.bus.messages import (
    CommandMessage,
    Received,
    StateMessage,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)
from drake_quad.errors import InputError

STATE_CHANNEL, COMMAND_CHANNEL = "QUAD_STATE", "QUAD_COMMAND"
GROUP, PORT = "239.255.76.67", 7667  # LCM's own; a domain is a port further on
LOOPBACK = "lo"


def lcm_url(interface: str, domain: int) -> str:
    """LCM's address: messages leave the machine only if the interface is not loopback.

    Which interface they leave by the machine's route to the multicast group decides.
    """
    return f"udpm://{GROUP}:{PORT + domain}?ttl={0 if interface == LOOPBACK else 1}"


class LcmBus:
    """One end of the bus: a robot's or a controller's.

    Args:
        url: LCM's, for example of `lcm_url`.
        now_ns: The receiver's clock [ns].
        hears_states: Whether it receives states.
        hears_commands: Whether it receives commands.

    Raises:
        InputError: The package `lcm` is not installed, or the address cannot be used.
    """

    def __init__(
        self, url: str, now_ns: Callable[[], int], *, hears_states: bool, hears_commands: bool
    ) -> None:
        try:
            import lcm
        except ImportError:
            remedy = "needs the package lcm: pip install lcm"
            raise InputError(source="--bus", field="bus", value="lcm", remedy=remedy) from None
        try:
            self._lcm = lcm.LCM(url)
        except RuntimeError as problem:
            remedy = f"LCM cannot use it ({problem}); is there a multicast route?"
            raise InputError(source="--bus", field="bus", value=url, remedy=remedy) from None
        self._now_ns = now_ns
        self._states: deque[Received[StateMessage]] = deque(maxlen=100)
        self._commands: deque[Received[CommandMessage]] = deque(maxlen=100)
        if hears_states:
            self._lcm.subscribe(STATE_CHANNEL, self._take_state)
        if hears_commands:
            self._lcm.subscribe(COMMAND_CHANNEL, self._take_command)
        self._hears = hears_states or hears_commands

    def publish_state(self, state: StateMessage) -> None:
        """Sends a state."""
        self._lcm.publish(STATE_CHANNEL, encode_state(state))

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a command."""
        self._lcm.publish(COMMAND_CHANNEL, encode_command(command))

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states since the last call, oldest first."""
        self._handle()
        return [self._states.popleft() for _ in range(len(self._states))]

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """The commands since the last call, oldest first."""
        self._handle()
        return [self._commands.popleft() for _ in range(len(self._commands))]

    def close(self) -> None:
        """Leaves the bus."""
        del self._lcm

    def _handle(self) -> None:
        for _ in range(100):
            if not (self._hears and self._lcm.handle_timeout(0)):
                return

    def _take_state(self, _channel: str, data: bytes) -> None:
        self._states.append(decode_state(data, self._now_ns()))

    def _take_command(self, _channel: str, data: bytes) -> None:
        self._commands.append(decode_command(data, self._now_ns()))
