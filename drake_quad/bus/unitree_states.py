"""LowStates as states in their order, whatever of clock and CRC their sender leaves out.

A robot fills in LowState's `tick` and `crc`. Simulators are known that leave them at zero, and
whether a sender is one of these is seen from its messages alone.
"""

from dataclasses import dataclass, replace

from drake_quad.bus.messages import Received, StateMessage
from drake_quad.bus.unitree_messages import JointMap, decode_low_state, has_crc

NO_CLOCK = "LowState has no clock (tick is 0): the time stamps of DDS are taken"
NO_CRC = "LowState has no CRC (crc is 0): none is checked"


@dataclass
class _Sender:
    """What is known of a sender.

    Attributes:
        count: How many sound messages have come of it.
        crc: Whether one of them had a CRC.
        ticking: Whether one of them had a tick.
        time_ns: What its clock is ahead of its ticks [ns].
        sequence: What its sequence is ahead of its ticks.
    """

    count: int = 0
    crc: bool = False
    ticking: bool = False
    time_ns: int = 0
    sequence: int = 0


class LowStateReader:
    """Takes LowStates in, and keeps apart whose they are.

    A sender that has once given a CRC, or a tick, has to go on: then a zero is a fault, or late.

    Args:
        joints: How the robot's own file means its joints.
    """

    def __init__(self, joints: JointMap) -> None:
        self._joints = joints
        self._senders: dict[int, _Sender] = {}

    def read(
        self, data: bytes, time_ns: int, *, sender: int, sent_ns: int
    ) -> Received[StateMessage]:
        """A LowState as a state.

        Args:
            data: As it came.
            time_ns: When, by the receiver's clock [ns].
            sender: DDS's number of the writer that sent it.
            sent_ns: When it was sent, by the sender's machine [ns].
        """
        known = self._senders.setdefault(sender, _Sender())
        come = decode_low_state(data, time_ns, self._joints, unsigned=not known.crc)
        state = come.message
        if state is None or come.fault:
            return replace(come, message=None if state is None else replace(state, session=sender))
        known.count += 1
        known.crc = known.crc or has_crc(data)
        tick = state.sequence
        if tick and not known.ticking:
            known.ticking = True
            if known.count > 1:  # its clock began at zero: it goes on from the time stamps
                known.time_ns, known.sequence = sent_ns - state.time_ns, known.count - tick
        if known.ticking:
            sequence, at_ns = tick + known.sequence, state.time_ns + known.time_ns
        else:
            sequence, at_ns = known.count, sent_ns
        state = replace(state, session=sender, sequence=sequence, time_ns=at_ns)
        remarks = (NO_CLOCK,) * (not known.ticking and known.count > 1) + (NO_CRC,) * (
            not known.crc
        )
        return Received(state, time_ns, remarks=remarks)
