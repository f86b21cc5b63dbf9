"""Unitree's LowState and LowCmd (`unitree_go`, of Go2 and B2) as rows of numpy, and as CDR.

Field by field as Unitree publishes them (unitree_sdk2_python, BSD-3-Clause). A message is a row
laid out as the maker's C structure, over which its CRC is; CDR, which goes over DDS, has the same
values with other gaps between them. No cyclonedds is needed here, nor the maker's package.
"""

from zlib import crc32

import numpy as np

from drake_quad.bus.joint_map import JointMap
from drake_quad.bus.messages import (
    DRIVES_DAMP,
    DRIVES_FOLLOW,
    NOT_A_NUMBER,
    CommandMessage,
    Received,
    StateMessage,
)
from drake_quad.bus.safety import SafetyMode
from drake_quad.common import ByteArray, IntArray

LOW_STATE_TYPE = "unitree_go.msg.dds_.LowState_"
LOW_CMD_TYPE = "unitree_go.msg.dds_.LowCmd_"
MOTORS, JOINTS = 20, 12
# Where our legs' joints are among the motors, which are FR, FL, RR, RL.
MOTOR_OF = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8])
FOOT_OF = np.array([1, 0, 3, 2])
HEAD, LOW_LEVEL, DRIVEN = (0xFE, 0xEF), 0xFF, 0x01
NO_PLACE, NO_SPEED = 2.146e9, 16000.0  # what motors that are not there are told

_HEAD = [("head", "u1", 2), ("level_flag", "u1"), ("frame_reserve", "u1"), ("sn", "<u4", 2),
         ("version", "<u4", 2), ("bandwidth", "<u2")]  # fmt: skip
MOTOR_CMD = np.dtype(
    [("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("tau", "<f4"), ("kp", "<f4"), ("kd", "<f4"),
     ("reserve", "<u4", 3)], align=True,
)  # fmt: skip
MOTOR_STATE = np.dtype(
    [("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("ddq", "<f4"), ("tau_est", "<f4"),
     ("q_raw", "<f4"), ("dq_raw", "<f4"), ("ddq_raw", "<f4"), ("temperature", "u1"),
     ("lost", "<u4"), ("reserve", "<u4", 2)], align=True,
)  # fmt: skip
IMU_STATE = np.dtype(
    [("quaternion", "<f4", 4), ("gyroscope", "<f4", 3), ("accelerometer", "<f4", 3),
     ("rpy", "<f4", 3), ("temperature", "u1")], align=True,
)  # fmt: skip
BMS_STATE = np.dtype(
    [("version_high", "u1"), ("version_low", "u1"), ("status", "u1"), ("soc", "u1"),
     ("current", "<i4"), ("cycle", "<u2"), ("bq_ntc", "u1", 2), ("mcu_ntc", "u1", 2),
     ("cell_vol", "<u2", 15)], align=True,
)  # fmt: skip
BMS_CMD = np.dtype([("off", "u1"), ("reserve", "u1", 3)], align=True)
LOW_CMD = np.dtype(
    [*_HEAD, ("motor_cmd", MOTOR_CMD, MOTORS), ("bms_cmd", BMS_CMD), ("wireless_remote", "u1", 40),
     ("led", "u1", 12), ("fan", "u1", 2), ("gpio", "u1"), ("reserve", "<u4"), ("crc", "<u4")],
    align=True,
)  # fmt: skip
LOW_STATE = np.dtype(
    [*_HEAD, ("imu_state", IMU_STATE), ("motor_state", MOTOR_STATE, MOTORS),
     ("bms_state", BMS_STATE), ("foot_force", "<i2", 4), ("foot_force_est", "<i2", 4),
     ("tick", "<u4"), ("wireless_remote", "u1", 40), ("bit_flag", "u1"), ("adc_reel", "<f4"),
     ("temperature_ntc1", "u1"), ("temperature_ntc2", "u1"), ("power_v", "<f4"),
     ("power_a", "<f4"), ("fan_frequency", "<u2", 4), ("reserve", "<u4"), ("crc", "<u4")],
    align=True,
)  # fmt: skip


def _places(kind: np.dtype, start: int, at: int) -> tuple[list[tuple[int, int]], int]:
    """Each byte's place in the C structure and in CDR, and the place in CDR behind them."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        pairs: list[tuple[int, int]] = []
        for k in range(int(np.prod(shape))):
            more, at = _places(base, start + k * base.itemsize, at)
            pairs += more
        return pairs, at
    if kind.fields is not None:
        pairs = []
        for name in kind.names or ():
            field, offset = kind.fields[name][:2]
            more, at = _places(field, start + offset, at)
            pairs += more
        return pairs, at
    size = kind.itemsize
    at += -at % size  # a value begins at a multiple of its size, and a structure anywhere
    return [(start + k, at + k) for k in range(size)], at + size


class Wire:
    """A message's way between the bytes of its C structure and those of CDR.

    Args:
        kind: The structure's dtype; its CRC is its last word.
    """

    HEADER = b"\x00\x01\x00\x00"  # plain CDR, little-endian

    def __init__(self, kind: np.dtype) -> None:
        pairs, size = _places(kind, 0, 0)
        self._in_row, self._in_cdr = np.array(pairs).T
        self._kind, self._size = kind, size + -size % 4

    def encode(self, whole: ByteArray) -> bytes:
        """The CDR of a structure's bytes, into which its CRC is put."""
        whole.view("<u4")[-1] = unitree_crc(whole.tobytes())
        cdr = np.zeros(self._size, dtype=np.uint8)
        cdr[self._in_cdr] = whole[self._in_row]
        return self.HEADER + cdr.tobytes()

    def decode(self, data: bytes, *, unsigned: bool = False) -> tuple[ByteArray | None, str]:
        """The bytes of the structure that came as CDR, or what is wrong with them.

        Args:
            data: Bytes that came.
            unsigned: Whether a CRC of zero means that there is none.
        """
        if len(data) < 4 or data[1] not in (0x01, 0x07):
            return None, "a message that is not plain little-endian CDR"
        cdr = np.frombuffer(data, dtype=np.uint8)[4:]
        if len(cdr) <= self._in_cdr[-1]:
            return None, "a message cut short"
        whole = np.zeros(self._kind.itemsize, dtype=np.uint8)
        whole[self._in_row] = cdr[self._in_cdr]
        crc = int(whole.view("<u4")[-1])
        if not (unsigned and crc == 0) and crc != unitree_crc(whole.tobytes()):
            return None, "a message whose CRC is wrong"
        return whole, ""


_TURNED = bytes(int(f"{k:08b}"[::-1], 2) for k in range(256))


def unitree_crc(structure: bytes) -> int:
    """The maker's CRC over all of a structure's 32-bit words but the last, which holds it.

    Its polynomial is zlib's, but each word's highest bit comes first, and nothing is inverted in
    the end: with the words' bytes turned round, and the bits of each, it is zlib's turned round.
    """
    words = np.frombuffer(structure[:-4], dtype="<u4").byteswap().tobytes()
    reflected = crc32(words.translate(_TURNED)) ^ 0xFFFFFFFF
    return int(f"{reflected:032b}"[::-1], 2)


# ------------------------------------------------------------------------------------------------
# Between the maker's messages and ours.
# ------------------------------------------------------------------------------------------------


# Field by field numpy takes a tenth of a tick for a message: all of its floats go at once.


def _begins(kind: np.dtype, name: str) -> int:
    """The first byte of a field."""
    assert kind.fields is not None
    return int(kind.fields[name][1])


def _motor_bytes(kind: np.dtype, motors: str, names: tuple[str, ...]) -> IntArray:
    """The first bytes of these fields of our joints' motors (len(names), 12), leg by leg."""
    one = kind[motors].base
    first = _begins(kind, motors) + one.itemsize * MOTOR_OF
    return np.array([first + _begins(one, name) for name in names])


def _blank(kind: np.dtype) -> ByteArray:
    """The bytes of a structure in which nothing is filled in but its head."""
    row = np.zeros(1, kind)
    row["head"], row["level_flag"] = HEAD, LOW_LEVEL
    if "motor_cmd" in (kind.names or ()):
        motors = row["motor_cmd"]
        motors["q"], motors["dq"], motors["mode"] = NO_PLACE, NO_SPEED, DRIVEN
    return row.view(np.uint8)


_STATE, _CMD = Wire(LOW_STATE), Wire(LOW_CMD)
_BLANK_STATE, _BLANK_CMD = _blank(LOW_STATE), _blank(LOW_CMD)
_IMU = _begins(LOW_STATE, "imu_state") + np.array(
    [
        [_begins(IMU_STATE, name) + 4 * k for k in range(3)]
        for name in ("gyroscope", "accelerometer")
    ]
)
# Words: position, velocity, effort, angular rate, specific force; and those of a command.
_STATE_WORDS = (
    np.concatenate([_motor_bytes(LOW_STATE, "motor_state", ("q", "dq", "tau_est")).ravel(),
                    _IMU.ravel()]) // 4
)  # fmt: skip
_CMD_WORDS = _motor_bytes(LOW_CMD, "motor_cmd", ("q", "dq", "tau", "kp", "kd")).ravel() // 4
_MODES = _motor_bytes(LOW_STATE, "motor_state", ("mode",))[0]
_FEET = _begins(LOW_STATE, "foot_force") // 2 + FOOT_OF
_TICK = _begins(LOW_STATE, "tick") // 4


def encode_low_state(state: StateMessage, joints: JointMap) -> bytes:
    """A state as LowState; its quaternion and its raw readings are left at zero."""
    whole = _BLANK_STATE.copy()
    whole.view("<u4")[_TICK] = (state.time_ns // 1_000_000) & 0xFFFFFFFF
    own = joints.signs[:36] * np.concatenate(
        [state.position + joints.turn, state.velocity, state.effort]
    )
    R_TB = joints.R_BT.T
    whole.view("<f4")[_STATE_WORDS] = np.concatenate(
        [own, R_TB @ state.angular_rate, R_TB @ state.specific_force]
    )
    whole[_MODES] = 0 if state.drives == DRIVES_DAMP else DRIVEN
    whole.view("<i2")[_FEET] = np.minimum(np.maximum(state.foot_force, -1), 32767)
    return _STATE.encode(whole)


def has_crc(data: bytes) -> bool:
    """Whether the message that these bytes are has a CRC: it is the last of its fields."""
    return any(data[-4:])


def decode_low_state(
    data: bytes, time_ns: int, joints: JointMap, *, unsigned: bool = False
) -> Received[StateMessage]:
    """A LowState as a state. Its clock and its number are both its tick, in whole ms.

    Its drives damp if no motor is driven, as far as one message tells: a sender may leave the
    motors' mode at zero always.

    Args:
        data: As it came.
        time_ns: When, by the receiver's clock [ns].
        joints: How the robot's own file means its joints.
        unsigned: Whether a CRC of zero means that there is none.
    """
    whole, fault = _STATE.decode(data, unsigned=unsigned)
    if whole is None:
        return Received(None, time_ns, fault)
    tick = int(whole.view("<u4")[_TICK])
    values = whole.view("<f4")[_STATE_WORDS].astype(np.float64)
    own = joints.signs[:36] * values[:36]
    state = StateMessage(
        0, tick, tick * 1_000_000, DRIVES_FOLLOW if whole[_MODES].any() else DRIVES_DAMP,
        own[:12] - joints.turn, own[12:24], own[24:],
        joints.R_BT @ values[36:39], joints.R_BT @ values[39:],
        whole.view("<i2")[_FEET].astype(np.float64),
    )  # fmt: skip
    return Received(state, time_ns, "" if np.isfinite(values).all() else NOT_A_NUMBER)


def encode_low_cmd(command: CommandMessage, joints: JointMap) -> bytes:
    """A command as LowCmd."""
    whole = _BLANK_CMD.copy()
    whole.view("<f4")[_CMD_WORDS] = joints.signs * np.concatenate(
        [command.position + joints.turn, command.velocity, command.effort, command.stiffness,
         command.damping]
    )  # fmt: skip
    return _CMD.encode(whole)


def decode_low_cmd(
    data: bytes, time_ns: int, joints: JointMap, *, session: int, sequence: int
) -> Received[CommandMessage]:
    """A LowCmd as a command, which is of damping if no motor has any stiffness.

    Args:
        data: As it came.
        time_ns: When, by the receiver's clock [ns].
        joints: How the robot's own file means its joints.
        session: DDS's number of the writer that sent it.
        sequence: How many had come before it.
    """
    whole, fault = _CMD.decode(data)
    if whole is None:
        return Received(None, time_ns, fault)
    values = joints.signs * whole.view("<f4")[_CMD_WORDS].astype(np.float64)
    parts = values.reshape(5, 12)
    mode = SafetyMode.WALKING if (parts[3] > 0.0).any() else SafetyMode.DAMPING
    command = CommandMessage(
        session, sequence, time_ns, int(mode), -1, parts[0] - joints.turn, *parts[1:]
    )
    return Received(command, time_ns, "" if np.isfinite(values).all() else NOT_A_NUMBER)
