"""What goes over a robot's bus: a state from the robot, a command to it, both with time stamps.

Joints are leg by leg (FL, FR, RL, RR): abduction, hip pitch, knee, with the zeros and senses of the
robot's normal form. On LCM a message is as `quad_bus.lcm` defines it; whatever bus it comes from,
a receiver gets it as a `Received`, with what was wrong with it.
"""

from dataclasses import dataclass
from typing import Generic, TypeVar
from zlib import crc32

import numpy as np

from drake_quad.common import FloatArray

VERSION = 1
NO_SENSOR = -1.0  # foot force of a foot without a sensor
DRIVES_DAMP, DRIVES_FOLLOW, DRIVES_HOLD = 0, 1, 2
NOT_A_NUMBER = "a value is not a number"  # what is wrong with a message


@dataclass(frozen=True, eq=False, slots=True)
class StateMessage:
    """What a robot senses at one time.

    Attributes:
        session: Number of the sender, drawn when it begins.
        sequence: One more with each message.
        time_ns: The robot's clock, which never goes back [ns].
        drives: What the drives do: DRIVES_DAMP, DRIVES_FOLLOW or DRIVES_HOLD.
        position: Joint angles (12,) [rad].
        velocity: Joint speeds (12,) [rad/s].
        effort: Joint torques (12,) [Nm].
        angular_rate: Angular velocity of the trunk in B (3,), mean over the period [rad/s].
        specific_force: Specific force at B's origin in B (3,), mean over the period [m/s²].
        foot_force: Normal force on each foot (4,) [N]; NO_SENSOR where there is no sensor.
    """

    session: int
    sequence: int
    time_ns: int
    drives: int
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray
    angular_rate: FloatArray
    specific_force: FloatArray
    foot_force: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class CommandMessage:
    """What the drives are to do; each drive's torque is τ + k (q_d - q) + d (v_d - v).

    Attributes:
        session: Number of the sender, drawn when it begins.
        sequence: One more with each message.
        time_ns: The sender's own clock [ns].
        mode: A `drake_quad.bus.safety.SafetyMode`.
        state_sequence: Sequence of the newest state that this answers; -1 of none.
        position: Wanted joint angles q_d (12,) [rad].
        velocity: Wanted joint speeds v_d (12,) [rad/s].
        effort: Torques τ fed forward (12,) [Nm].
        stiffness: k (12,) [Nm/rad].
        damping: d (12,) [Nm s/rad].
    """

    session: int
    sequence: int
    time_ns: int
    mode: int
    state_sequence: int
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray
    stiffness: FloatArray
    damping: FloatArray


Message = TypeVar("Message", StateMessage, CommandMessage)


@dataclass(frozen=True, eq=False, slots=True)
class Received(Generic[Message]):
    """A message as it came.

    Attributes:
        message: The message; None if it could not be read.
        time_ns: When it was received, by the receiver's clock [ns].
        fault: What was wrong with it in a few words; empty if nothing was.
        remarks: What a person should know of its sender.
    """

    message: Message | None
    time_ns: int
    fault: str = ""
    remarks: tuple[str, ...] = ()


# ------------------------------------------------------------------------------------------------
# The messages as LCM has them on the wire: big-endian, packed, behind their type's fingerprint.
# ------------------------------------------------------------------------------------------------

# Of lcm-gen from quad_bus.lcm; a test holds them together.
STATE_FINGERPRINT, COMMAND_FINGERPRINT = "f93c6f5610b525fc", "c3702ec08fcdb490"
_HEAD = [("fingerprint", "S8"), ("version", ">i4"), ("session", ">i8"), ("sequence", ">i8"),
         ("time_ns", ">i8")]  # fmt: skip
_STATE_VECTORS = (("position", 12), ("velocity", 12), ("effort", 12), ("angular_rate", 3),
                  ("specific_force", 3), ("foot_force", 4))  # fmt: skip
_COMMAND_VECTORS = tuple(
    (name, 12) for name in ("position", "velocity", "effort", "stiffness", "damping")
)
STATE = np.dtype(
    [*_HEAD, ("drives", ">i4"), *((n, ">f8", k) for n, k in _STATE_VECTORS), ("crc", ">u4")]
)
COMMAND = np.dtype(
    [*_HEAD, ("mode", ">i4"), ("state_sequence", ">i8"),
     *((n, ">f8", k) for n, k in _COMMAND_VECTORS), ("crc", ">u4")]
)  # fmt: skip
_BODY = slice(8, -4)  # what the CRC is of: all but the fingerprint and itself


def encode_state(message: StateMessage) -> bytes:
    """The message as `drake_quad_lcm.quad_state_t`."""
    head = (bytes.fromhex(STATE_FINGERPRINT), VERSION, message.session, message.sequence,
            message.time_ns, message.drives)  # fmt: skip
    return _encode(STATE, head, [getattr(message, name) for name, _ in _STATE_VECTORS])


def encode_command(message: CommandMessage) -> bytes:
    """The message as `drake_quad_lcm.quad_command_t`."""
    head = (bytes.fromhex(COMMAND_FINGERPRINT), VERSION, message.session, message.sequence,
            message.time_ns, message.mode, message.state_sequence)  # fmt: skip
    return _encode(COMMAND, head, [getattr(message, name) for name, _ in _COMMAND_VECTORS])


def decode_state(data: bytes, time_ns: int) -> Received[StateMessage]:
    """The message that these bytes are, or what is wrong with them."""
    row, fault = _decode(STATE, STATE_FINGERPRINT, data)
    if row is None:
        return Received(None, time_ns, fault)
    vectors = [row[name].astype(np.float64) for name, _ in _STATE_VECTORS]
    head = (int(row["session"]), int(row["sequence"]), int(row["time_ns"]), int(row["drives"]))
    return Received(StateMessage(*head, *vectors), time_ns, _finite(vectors))


def decode_command(data: bytes, time_ns: int) -> Received[CommandMessage]:
    """The same of a command."""
    row, fault = _decode(COMMAND, COMMAND_FINGERPRINT, data)
    if row is None:
        return Received(None, time_ns, fault)
    vectors = [row[name].astype(np.float64) for name, _ in _COMMAND_VECTORS]
    head = (int(row["session"]), int(row["sequence"]), int(row["time_ns"]), int(row["mode"]),
            int(row["state_sequence"]))  # fmt: skip
    return Received(CommandMessage(*head, *vectors), time_ns, _finite(vectors))


def _finite(vectors: list[FloatArray]) -> str:
    return "" if all(np.isfinite(v).all() for v in vectors) else NOT_A_NUMBER


def _encode(kind: np.dtype, head: tuple[object, ...], vectors: list[FloatArray]) -> bytes:
    row = np.zeros((), kind)
    row[()] = (*head, *vectors, 0)
    row["crc"] = crc32(row.tobytes()[_BODY])
    return row.tobytes()


def _decode(kind: np.dtype, fingerprint: str, data: bytes) -> tuple[np.void | None, str]:
    if len(data) != kind.itemsize or data[:8] != bytes.fromhex(fingerprint):
        return None, "a message of another type or version"
    row = np.frombuffer(data, kind)[0]
    if int(row["crc"]) != crc32(data[_BODY]):
        return None, "a message whose CRC is wrong"
    if int(row["version"]) != VERSION:
        return None, f"a message of version {int(row['version'])}, not {VERSION}"
    return row, ""
