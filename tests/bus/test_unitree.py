"""Unitree's messages: the maker's own bytes and CRC, there and back, and over DDS on loopback."""

import os
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.bus.joint_map import SAME, JointMap, joint_map
from drake_quad.bus.messages import (
    CommandMessage,
    Received,
    StateMessage,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.unitree_bus import session_of
from drake_quad.bus.unitree_messages import (
    LOW_CMD,
    LOW_STATE,
    MOTOR_OF,
    decode_low_cmd,
    decode_low_state,
    encode_low_cmd,
    encode_low_state,
    unitree_crc,
)
from drake_quad.bus.unitree_states import NO_CLOCK, NO_CRC
from drake_quad.robot.loader import load_robot

RNG = np.random.default_rng(5)
YAW = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
OWN = JointMap(RNG.choice([-1.0, 1.0], 12), RNG.normal(size=12), YAW)
STATE = StateMessage(
    0, 4242, 4_242_000_000, 1, RNG.normal(size=12), RNG.normal(size=12), RNG.normal(size=12),
    RNG.normal(size=3), RNG.normal(size=3), np.array([11.0, 22.0, 33.0, 44.0]),
)  # fmt: skip
COMMAND = CommandMessage(9, 1, 2, int(SafetyMode.WALKING), 0, *np.abs(RNG.normal(size=(5, 12))))


def crc_of_the_maker(structure: bytes) -> int:
    """The maker's own loop over words and bits (`_crc_py` of its `utils/crc.py`)."""
    crc = 0xFFFFFFFF
    for word in np.frombuffer(structure[:-4], dtype="<u4").tolist():
        for bit in range(31, -1, -1):
            crc = ((crc << 1) & 0xFFFFFFFF) ^ (0x04C11DB7 if crc & 0x80000000 else 0)
            if word & (1 << bit):
                crc ^= 0x04C11DB7
    return crc


def test_structures_are_as_long_as_the_makers() -> None:
    """812 and 1180 bytes, as the maker's `crc.py` says."""
    assert (LOW_CMD.itemsize, LOW_STATE.itemsize) == (812, 1180)


@given(st.binary(min_size=8, max_size=64).filter(lambda data: len(data) % 4 == 0))
def test_the_crc_is_the_makers(data: bytes) -> None:
    """Whatever the words, zlib's CRC turned round is what the maker's loop gives."""
    assert unitree_crc(data) == crc_of_the_maker(data)


@pytest.mark.parametrize("joints", [SAME, OWN])
def test_messages_come_as_they_were_sent(joints: JointMap) -> None:
    """To the precision of the maker's 32 bits, whatever the file's signs, zeros and heading."""
    come = decode_low_state(encode_low_state(STATE, joints), 3, joints)
    assert come.message is not None and not come.fault
    assert (come.message.sequence, come.message.time_ns) == (4242, 4_242_000_000)
    for name in ("position", "velocity", "effort", "angular_rate", "specific_force", "foot_force"):
        np.testing.assert_allclose(getattr(come.message, name), getattr(STATE, name), atol=1e-6)
    told = decode_low_cmd(encode_low_cmd(COMMAND, joints), 3, joints, session=9, sequence=1)
    assert told.message is not None and told.message.mode == SafetyMode.WALKING
    for name in ("position", "velocity", "effort", "stiffness", "damping"):
        np.testing.assert_allclose(getattr(told.message, name), getattr(COMMAND, name), atol=1e-6)


def test_motors_are_in_the_makers_order() -> None:
    """FR, FL, RR, RL: our front right leg is motors 0 to 2, the rear left 9 to 11."""
    assert MOTOR_OF[3:6].tolist() == [0, 1, 2] and MOTOR_OF[6:9].tolist() == [9, 10, 11]
    assert sorted(MOTOR_OF.tolist()) == list(range(12))


def test_spoilt_messages_are_found() -> None:
    """A byte changed, or some missing, is told of."""
    data = bytearray(encode_low_state(STATE, SAME))
    data[120] ^= 8
    assert "CRC" in decode_low_state(bytes(data), 0, SAME).fault
    assert "cut short" in decode_low_state(bytes(data[:200]), 0, SAME).fault
    assert decode_low_state(b"", 0, SAME).message is None


def test_cyclonedds_reads_the_same_bytes() -> None:
    """The fields that its own reading of the declared type finds are those that we wrote."""
    pytest.importorskip("cyclonedds")
    from cyclonedds.idl import IdlStruct

    from drake_quad.bus.unitree_types import LowCmd_, LowState_

    data = encode_low_state(STATE, SAME)
    read = IdlStruct.deserialize.__func__(LowState_, data)
    assert read.tick == 4242 and read.foot_force == [22, 11, 44, 33]
    assert read.motor_state[3].q == pytest.approx(STATE.position[0], abs=1e-6)
    assert read.motor_state[11].tau_est == pytest.approx(STATE.effort[8], abs=1e-6)
    assert read.imu_state.accelerometer == pytest.approx(STATE.specific_force, abs=1e-6)
    assert IdlStruct.serialize(read) == data
    told = IdlStruct.deserialize.__func__(LowCmd_, encode_low_cmd(COMMAND, SAME))
    assert bytes(told.head) == b"\xfe\xef" and told.level_flag == 0xFF
    assert told.motor_cmd[0].kp == pytest.approx(COMMAND.stiffness[3], abs=1e-6)
    assert told.motor_cmd[15].q == pytest.approx(2.146e9) and told.motor_cmd[15].kp == 0.0


@given(st.integers(0, 2**64 - 1))
def test_every_writer_of_dds_is_a_session_that_can_be_kept(writer: int) -> None:
    """A log of the bus has signed numbers of 64 bits, and DDS's go to twice as far."""
    session = session_of(writer)
    state = decode_state(encode_state(replace(STATE, session=session)), 0).message
    command = decode_command(encode_command(replace(COMMAND, session=session)), 0).message
    assert state is not None and state.session == session
    assert command is not None and command.session == session


def test_states_and_commands_go_over_dds_and_a_second_commander_is_heard() -> None:
    """On loopback: the robot hears both commanders, a controller the robot and the other."""
    pytest.importorskip("cyclonedds")
    from drake_quad.bus.unitree_bus import UnitreeBus

    domain = 20 + os.getpid() % 200
    robot = UnitreeBus("lo", domain, time.monotonic_ns, robot=True)
    controller = UnitreeBus("lo", domain, time.monotonic_ns, robot=False)
    second = UnitreeBus("lo", domain, time.monotonic_ns, robot=False)
    heard: dict[str, set[int]] = {"robot": set(), "controller": set(), "second": set()}
    seen = None
    until = time.monotonic() + 20.0
    while time.monotonic() < until and not (len(heard["robot"]) == 2 and heard["controller"]):
        robot.publish_state(STATE)
        for bus in (controller, second):
            bus.publish_command(COMMAND)
        time.sleep(0.01)
        for one in controller.receive_states():
            seen = one
        for name, bus in (("robot", robot), ("controller", controller)):
            for told in bus.receive_commands():
                assert told.message is not None and not told.fault
                assert told.message.session < 2**63
                heard[name].add(told.message.session)
    assert seen is not None and seen.message is not None and seen.message.sequence == 4242
    assert len(heard["robot"]) == 2  # two commanders, told apart by DDS's own numbers
    assert len(heard["controller"]) == 1  # the second's, and not one's own
    for bus in (robot, controller, second):
        bus.close()


def test_a_robot_without_a_clock_is_timed_by_dds() -> None:
    """On loopback: a LowState whose tick is 0 comes with the time at which it was sent."""
    pytest.importorskip("cyclonedds")
    from drake_quad.bus.unitree_bus import UnitreeBus

    domain = 20 + (os.getpid() + 1) % 200
    robot = UnitreeBus("lo", domain, time.monotonic_ns, robot=True)
    controller = UnitreeBus("lo", domain, time.monotonic_ns, robot=False)
    come: list[Received[StateMessage]] = []
    begun, until = time.time_ns(), time.monotonic() + 20.0
    while time.monotonic() < until and len(come) < 3:
        robot.publish_state(replace(STATE, time_ns=0))
        time.sleep(0.01)
        come += controller.receive_states()
    times = [one.message.time_ns for one in come if one.message is not None]
    assert len(times) >= 3 and begun <= times[0] < times[1] < times[2] <= time.time_ns()
    assert NO_CLOCK in come[-1].remarks and NO_CRC not in come[-1].remarks
    for bus in (robot, controller):
        bus.close()


def test_a_file_that_was_never_imported_means_joints_as_we_do() -> None:
    """The shipped robot is in its normal form: signs of one, no turns."""
    found = joint_map(load_robot("package://drake_quad_models/paper_quadruped.urdf"))
    assert np.all(found.sign == 1.0) and not found.turn.any() and np.allclose(found.R_BT, np.eye(3))
