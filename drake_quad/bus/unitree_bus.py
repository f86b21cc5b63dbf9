"""The bus of Unitree's Go2 and B2: DDS with the maker's messages, `rt/lowstate`, `rt/lowcmd`."""

from collections.abc import Callable
from functools import partial
from typing import Any

from drake_quad.bus.joint_map import SAME, JointMap
from drake_quad.bus.messages import CommandMessage, Received, StateMessage
from drake_quad.bus.unitree_messages import (
    decode_low_cmd,
    encode_low_cmd,
    encode_low_state,
)
from drake_quad.bus.unitree_states import LowStateReader
from drake_quad.errors import InputError

STATE_TOPIC, COMMAND_TOPIC = "rt/lowstate", "rt/lowcmd"
MOST = 64  # messages taken at a time
CONFIG = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface name="{interface}" priority="default" multicast="default"/>
</Interfaces></General></Domain></CycloneDDS>"""
# A process has one of each number, made by its first bus and kept.
_DOMAINS: dict[int, Any] = {}


class UnitreeBus:
    """One end of the bus: a robot's or a controller's.

    A LowCmd does not say whose it is. Others' commands are told from one's own, and from each
    other, by DDS's own number of their writer.

    Args:
        interface: The machine's network interface.
        domain: DDS's; Unitree's robots are in 0, its simulator in 1.
        now_ns: The receiver's clock [ns].
        robot: Whether it is the robot's end.
        joints: How the robot's own file means its joints.

    Raises:
        InputError: The package `cyclonedds` is not installed, or DDS refuses.
    """

    def __init__(
        self, interface: str, domain: int, now_ns: Callable[[], int], *, robot: bool,
        joints: JointMap = SAME,
    ) -> None:  # fmt: skip
        try:
            from cyclonedds.core import DDSException, Policy, Qos
            from cyclonedds.domain import Domain, DomainParticipant
            from cyclonedds.pub import DataWriter
            from cyclonedds.sub import DataReader
            from cyclonedds.topic import Topic

            from drake_quad.bus.unitree_types import LowCmd_, LowState_, message_of
        except ImportError:
            remedy = "needs the package cyclonedds: pip install cyclonedds"
            raise InputError(source="--bus", field="bus", value="unitree", remedy=remedy) from None
        self._now_ns, self._joints, self._sequence = now_ns, joints, 0
        self._reader = LowStateReader(joints)
        self._state: Any = partial(message_of, LowState_)
        self._command: Any = partial(message_of, LowCmd_)
        many = Qos(Policy.History.KeepLast(MOST))
        others = Qos(Policy.History.KeepLast(MOST), Policy.IgnoreLocal.Participant)
        try:
            if domain not in _DOMAINS:
                _DOMAINS[domain] = Domain(domain, CONFIG.format(interface=interface))
            self._participant: Any = DomainParticipant(domain)
            states = Topic(self._participant, STATE_TOPIC, LowState_)
            commands = Topic(self._participant, COMMAND_TOPIC, LowCmd_)
            self._commands: Any = DataReader(self._participant, commands, qos=others)
            if robot:
                self._writer: Any = DataWriter(self._participant, states)
                self._states: Any = None
            else:
                self._writer = DataWriter(self._participant, commands)
                self._states = DataReader(self._participant, states, qos=many)
        except DDSException as problem:
            remedy = f"DDS refuses it: {problem}"
            raise InputError(
                source="--interface", field="interface", value=interface, remedy=remedy
            ) from None

    def publish_state(self, state: StateMessage) -> None:
        """Sends a LowState."""
        self._writer.write(self._state(encode_low_state(state, self._joints)))

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a LowCmd."""
        self._writer.write(self._command(encode_low_cmd(command, self._joints)))

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states since the last call, oldest first."""
        now = self._now_ns()
        return [
            self._reader.read(
                one.data, now, sender=session_of(one.sample_info.publication_handle),
                sent_ns=int(one.sample_info.source_timestamp),
            )
            for one in _take(self._states)
        ]  # fmt: skip

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """Others' commands since the last call, oldest first."""
        now, found = self._now_ns(), []
        for one in _take(self._commands):
            self._sequence += 1
            session = session_of(one.sample_info.publication_handle)
            found.append(decode_low_cmd(one.data, now, self._joints, session=session,
                                        sequence=self._sequence))  # fmt: skip
        return found

    def close(self) -> None:
        """Leaves the bus."""
        del self._writer, self._states, self._commands, self._participant


def session_of(writer: int) -> int:
    """A writer's number as a session: DDS's have 64 bits, and half of them fit no signed number."""
    return int(writer) % 2**63


def _take(reader: Any) -> list[Any]:
    """The messages that have come; what DDS says of writers that left is passed over."""
    return [one for one in reader.take(N=MOST) if hasattr(one, "data")]
