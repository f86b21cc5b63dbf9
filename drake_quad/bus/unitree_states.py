"""LowStates as states in their order, whatever of clock and CRC their sender leaves out.

A robot fills in LowState's `tick` and `crc`. Simulators are known that leave them at zero, and
whether a sender is one of these is seen from its messages alone.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from drake_quad.bus.joint_map import JointMap
from drake_quad.bus.messages import DRIVES_FOLLOW, Received, StateMessage
from drake_quad.bus.real_time import NS
from drake_quad.bus.unitree_messages import decode_low_state, has_crc
from drake_quad.common import FloatArray

NO_CLOCK = "LowState has no clock (tick is 0): the time stamps of DDS are taken"
NO_CRC = "LowState has no CRC (crc is 0): none is checked"
SLOW = "the robot's joints move slower than they say: its time is taken to go slower, too"

MOVING = 0.1  # [rad/s] from which on a joint's speed tells
EVIDENCE = 2.0  # [rad^2/s] of squared speeds times time, over which a pace is averaged
FIRST = 0.05  # [rad^2/s] of it that a pace of 1 counts as in the beginning
SLOWEST, FASTEST = 0.2, 1.25
BEHIND = 0.9  # pace below which a person is told


@dataclass
class PaceByJoints:
    """A robot's own time beside its time stamps, by how far its joints go at the speeds they have.

    A simulator that sends no clock is stamped by the machine's, and may run slower than that, or
    stand for a moment. Its joints' angles and speeds are of its own time: their ratio tells. Each
    ratio counts by the speed of a sample before both (an instrumental variable): by its own speed
    it would count less where that was too low by noise, and the robot's time would run slow.

    Attributes:
        pace: Seconds of the robot's time in one of the time stamps'.
    """

    pace: float = 1.0
    _begun_ns: int = 0  # the first time stamp, and what has passed since then
    _passed_ns: float = 0.0
    _total: float = FIRST
    _last: tuple[int, StateMessage] | None = None
    _earlier: FloatArray = field(default_factory=lambda: np.zeros(12))  # speeds before the last's

    def take(self, stamp_ns: int, state: StateMessage) -> int:
        """The robot's time at a state [ns].

        Args:
            stamp_ns: The state's time stamp.
            state: The state.
        """
        if self._last is None:
            self._begun_ns = stamp_ns
        else:
            before_ns, before = self._last
            gap = (stamp_ns - before_ns) / NS
            speed, known = 0.5 * (state.velocity + before.velocity), self._earlier
            moving = np.abs(known) > MOVING
            weight = float(known[moving] @ speed[moving]) * gap
            if weight > 0.0:
                went = float(known[moving] @ (state.position - before.position)[moving])
                self._total = min(self._total + weight, EVIDENCE)
                pace = self.pace + (went - self.pace * weight) / max(self._total, weight)
                self.pace = min(max(pace, SLOWEST), FASTEST)
            self._passed_ns += self.pace * (stamp_ns - before_ns)
            self._earlier = before.velocity
        self._last = stamp_ns, state
        return self._begun_ns + round(self._passed_ns)


HALF_WRAP = 2**31  # [ms] of a tick that goes back: it has begun again at zero


@dataclass
class _Sender:
    """What is known of a sender.

    Attributes:
        count: How many sound messages have come of it.
        crc: Whether one of them had a CRC.
        driven: Whether one of them had a motor that is driven.
        ticking: Whether one of them had a tick.
        time_ns: What its clock is ahead of its ticks [ns].
        sequence: What its sequence is ahead of its ticks.
        pace: Its time, as long as it has no clock.
        raw: Its last tick [ms], a number of 32 bits that begins again at zero.
    """

    count: int = 0
    crc: bool = False
    driven: bool = False
    ticking: bool = False
    time_ns: int = 0
    sequence: int = 0
    pace: PaceByJoints = field(default_factory=PaceByJoints)
    raw: int = 0


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
        known.driven = known.driven or state.drives == DRIVES_FOLLOW
        if not known.driven:  # it may never tell
            state = replace(state, drives=DRIVES_FOLLOW)
        if state.sequence + HALF_WRAP < known.raw:  # after 49.7 days
            known.sequence += 2 * HALF_WRAP
            known.time_ns += 2 * HALF_WRAP * 1_000_000
        tick = known.raw = state.sequence
        if tick and not known.ticking:
            known.ticking = True
            if known.count > 1:  # its clock began at zero: it goes on from the time stamps
                now_ns = known.pace.take(sent_ns, state)
                known.time_ns, known.sequence = now_ns - state.time_ns, known.count - tick
        if known.ticking:
            sequence, at_ns = tick + known.sequence, state.time_ns + known.time_ns
        else:
            sequence, at_ns = known.count, known.pace.take(sent_ns, state)
        state = replace(state, session=sender, sequence=sequence, time_ns=at_ns)
        clockless = not known.ticking and known.count > 1
        remarks = (
            *((NO_CLOCK,) * clockless),
            *((SLOW,) * (clockless and known.pace.pace < BEHIND)),
            *((NO_CRC,) * (not known.crc)),
        )
        return Received(state, time_ns, remarks=remarks)
