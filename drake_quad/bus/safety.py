"""The safety machine: what a robot's drives may be told, whatever the controller wants.

    damping -> standing up -> standing -> walking -> (standing ->) sitting down -> damping

Pure: `advance` takes what was, what is known now and what is wanted, and gives what is and what the
drives are told. Any fault leads to damping in the same tick, from which nothing but arming anew, in
a sane posture, leads on. A state that is late, but not yet too late, makes the last command hold.
"""

from dataclasses import dataclass, field, replace
from enum import IntEnum
from math import cos

import numpy as np

from drake_quad.bus.drive_limits import Drives, SafetyLimits, within_limits
from drake_quad.common import FloatArray
from drake_quad.math.curves import quintic

NOT_ARMED = "not armed"
STIFFENING = 0.2  # of the time for folding, in which stiffness grows as it begins to stand up


class SafetyMode(IntEnum):
    """What the machine does; the numbers go over the bus."""

    DAMPING = 0
    STANDING_UP = 1
    STANDING = 2
    WALKING = 3
    SITTING_DOWN = 4


class Request(IntEnum):
    """What a person, or the order of a mission, asks for."""

    NOTHING = 0
    DAMP = 1
    STAND = 2
    WALK = 3
    SIT = 4


@dataclass(frozen=True, eq=False, kw_only=True)
class Known:
    """What is known at a tick.

    Attributes:
        time: The machine's clock [s].
        q: Joint angles of the newest sound state (12,) [rad]; None before there was one.
        v: Joint speeds of it (12,) [rad/s].
        up: Which way is up, in B (3,), from the IMU.
        age: How long ago that state was received [s].
        fault: What is wrong, in a few words; empty if nothing is.
        request: What is asked for.
        wanted: What the controller wants of the drives in walking; None: nothing new.
        ended: Why the controller has ended, or empty.
    """

    time: float
    q: FloatArray | None
    v: FloatArray | None = None
    up: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    age: float = 0.0
    fault: str = ""
    request: Request = Request.NOTHING
    wanted: Drives | None = None
    ended: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class Memory:
    """What the machine remembers from tick to tick.

    Attributes:
        mode: What it does.
        since: When it began to [s].
        well_since: Since when nothing was wrong [s].
        commanded: The last command to the drives.
        start: The wanted angles with which `mode` began (12,) [rad].
        reason: Why it is damped, or did not arm.
        holding: Whether the last command holds, for want of a state.
        near_since: When all joints were last near where they are wanted [s].
    """

    mode: SafetyMode = SafetyMode.DAMPING
    since: float = 0.0
    well_since: float = 0.0
    commanded: Drives
    start: FloatArray
    reason: str = NOT_ARMED
    holding: bool = False
    near_since: float = 0.0


def initial_safety_memory(limits: SafetyLimits, time: float) -> Memory:
    """Damping, with angles amid the limits until a state tells them."""
    q = np.clip(np.zeros(12), limits.q_lower, limits.q_upper)
    commanded = Drives(q, np.zeros(12), np.zeros(12), 0.0, limits.damping)
    return Memory(since=time, well_since=time, commanded=commanded, start=q)


def advance(
    memory: Memory,
    known: Known,
    limits: SafetyLimits,
    postures: FloatArray,
    bearing: FloatArray,
) -> tuple[Memory, Drives]:
    """One tick: the mode, and the command to the drives.

    Args:
        memory: Memory that the tick before returned.
        known: What is known now.
        limits: What holds of every command.
        postures: Joint angles (N, 12) from sitting to standing, evenly in time [rad].
        bearing: Torques (12,) that bear the robot when it stands, fed in as it rises [Nm].

    Returns:
        Memory of this tick, and the command to the drives, within all limits.
    """
    memory, astray = _watch_joints(memory, known, limits)
    fault = _fault_of(known, limits) or astray
    well_since = known.time if fault else memory.well_since
    if memory.holding or well_since != memory.well_since:  # to make one anew takes a while
        memory = replace(memory, well_since=well_since, holding=False)
    if fault:
        if memory.mode == SafetyMode.DAMPING and memory.reason.startswith(NOT_ARMED):
            memory = replace(memory, reason=f"{NOT_ARMED}: {fault}")
        memory = _enter(memory, SafetyMode.DAMPING, known, fault)
    elif known.request == Request.DAMP:
        memory = _enter(memory, SafetyMode.DAMPING, known, "asked to")
    elif memory.mode == SafetyMode.DAMPING:
        memory = _arm(memory, known, limits, postures)
    elif known.age > limits.hold_after:
        memory = replace(memory, holding=True, since=memory.since + limits.period)
    else:
        memory = _go_on(memory, known, limits, postures)
    commanded = within_limits(
        _wanted(memory, known, limits, postures, bearing), memory.commanded, limits
    )
    return replace(memory, commanded=commanded), commanded


def _watch_joints(memory: Memory, known: Known, limits: SafetyLimits) -> tuple[Memory, str]:
    """The memory, with when all joints were last near where they were wanted; and the fault.

    The fault is that a joint has been far from there for too long; it is empty if none has.
    """
    far = 0.0
    if memory.mode != SafetyMode.DAMPING and not memory.holding and known.q is not None:
        far = float(np.abs(memory.commanded.q - known.q).max())
    since = known.time - memory.near_since
    if far > limits.astray:
        late = since > limits.astray_time
        return memory, f"a joint is {far:.2f} rad from where it is wanted" if late else ""
    # To make a memory anew takes a while: nearness is noted often enough.
    if since > 0.5 * limits.astray_time:
        memory = replace(memory, near_since=known.time)
    return memory, ""


def _fault_of(known: Known, limits: SafetyLimits) -> str:
    """What is wrong now; empty if nothing is."""
    if known.fault:
        return known.fault
    if known.q is None:
        return "no state has come"
    if known.age > limits.damp_after:
        return f"no state for {limits.damp_after:g} s"
    if not np.isfinite(np.concatenate((known.q, known.up))).all():
        return "a value is not a number"
    if not known.up[2] > cos(limits.tilt):
        return "the trunk is tilted"
    if known.wanted is not None and not known.wanted.finite:
        return "the controller wants what is not a number"
    return ""


def _enter(memory: Memory, mode: SafetyMode, known: Known, reason: str = "") -> Memory:
    if memory.mode == mode:
        return memory
    return replace(
        memory, mode=mode, since=known.time, start=memory.commanded.q, reason=reason,
        well_since=known.time if mode == SafetyMode.DAMPING else memory.well_since,
    )  # fmt: skip


def _arm(memory: Memory, known: Known, limits: SafetyLimits, postures: FloatArray) -> Memory:
    """Begins to stand up, if that is asked for and the robot is fit for it."""
    if known.request != Request.STAND:
        return memory
    assert known.q is not None and known.v is not None
    reason = ""
    if known.age > limits.hold_after:
        reason = "the state is old"
    elif not known.up[2] > np.cos(limits.arming_tilt):
        reason = "the trunk is tilted"
    elif not np.abs(known.v).max() <= limits.arming_speed:
        reason = "a joint is moving"  # it may still be sinking to the ground, damped
    elif np.any(known.q < limits.q_lower - limits.arming_room) or np.any(
        known.q > limits.q_upper + limits.arming_room
    ):
        reason = "a joint is beyond its limits"
    elif not np.abs(postures - known.q).max(axis=1).min() <= limits.arming_posture:
        reason = "the legs are neither folded under it nor as in standing"
    if reason:
        return replace(memory, reason=f"{NOT_ARMED}: {reason}", well_since=known.time)
    if known.time - memory.well_since < limits.arming_time:
        reason = "all is not well for long enough"
    elif np.abs(memory.commanded.q - np.clip(known.q, limits.q_lower, limits.q_upper)).max() > 0.01:
        reason = "what is wanted has not come to where the joints are"
    if reason:
        return replace(memory, reason=f"{NOT_ARMED}: {reason}")
    return _enter(memory, SafetyMode.STANDING_UP, known)


def _go_on(memory: Memory, known: Known, limits: SafetyLimits, postures: FloatArray) -> Memory:
    """The mode that follows, with a sound and fresh state."""
    assert known.q is not None
    elapsed, mode = known.time - memory.since, memory.mode
    if mode == SafetyMode.STANDING_UP and elapsed >= limits.fold_time + limits.rise_time:
        arrived = (
            np.abs(memory.commanded.q - postures[-1]).max() < 1e-6
        )  # not behind, for its speed limit
        if arrived and np.abs(known.q - postures[-1]).max() <= limits.standing_error:
            return _enter(memory, SafetyMode.STANDING, known)
        if elapsed >= limits.fold_time + limits.rise_time + 1.0:
            return _enter(memory, SafetyMode.DAMPING, known, "did not come to stand")
    if mode == SafetyMode.STANDING and known.request == Request.WALK:
        return _enter(memory, SafetyMode.WALKING, known)
    if mode == SafetyMode.WALKING and known.ended:
        return _enter(memory, SafetyMode.STANDING, known, known.ended)
    if mode in (SafetyMode.STANDING, SafetyMode.WALKING) and known.request == Request.SIT:
        return _enter(memory, SafetyMode.SITTING_DOWN, known)
    if mode == SafetyMode.SITTING_DOWN and elapsed >= limits.fold_time + limits.rise_time:
        return _enter(memory, SafetyMode.DAMPING, known, "sat down")
    return memory


def _wanted(
    memory: Memory,
    known: Known,
    limits: SafetyLimits,
    postures: FloatArray,
    bearing: FloatArray,
) -> Drives:
    """What the mode wants of the drives, before limits."""
    commanded, mode, zero = memory.commanded, memory.mode, np.zeros(12)
    elapsed = max(known.time - memory.since, 0.0)
    if mode == SafetyMode.DAMPING:
        # What is wanted follows the joints, so that arming begins from where they are.
        q = commanded.q if known.q is None else known.q
        return Drives(q, zero, zero, 0.0, limits.damping)
    if memory.holding:
        return Drives(commanded.q, zero, commanded.torque, commanded.stiffness, commanded.damping)
    if mode == SafetyMode.WALKING:
        return commanded if known.wanted is None else known.wanted
    q, torque = (
        commanded.q,
        commanded.torque,
    )  # standing: as it came, from standing up or from a walk
    after = (elapsed - limits.fold_time) / limits.rise_time
    if mode == SafetyMode.STANDING_UP:
        if after < 0.0:
            q, torque = _blend(memory.start, postures[0], elapsed / limits.fold_time), zero
        else:
            q, torque = _along(postures, after), _blend(zero, bearing, after)
    elif mode == SafetyMode.SITTING_DOWN:
        if after < 0.0:  # first to the posture of standing
            q = _blend(memory.start, postures[-1], elapsed / limits.fold_time)
            torque = bearing
        else:
            q, torque = _along(postures, 1.0 - after), _blend(bearing, zero, after)
    stiffness = limits.stiffness
    if mode == SafetyMode.STANDING_UP:
        # A joint that armed beyond its limit is not where it is wanted: no torque at one stroke.
        stiffness *= quintic(min(elapsed / (STIFFENING * limits.fold_time), 1.0))
    return Drives(q, zero, torque, stiffness, limits.damping)


def _blend(start: FloatArray, end: FloatArray, share: float) -> FloatArray:
    return np.asarray(start + quintic(min(max(share, 0.0), 1.0)) * (end - start))


def _along(postures: FloatArray, share: float) -> FloatArray:
    """The posture at this share of the way [0, 1] from the first to the last, from rest to rest."""
    place = quintic(min(max(share, 0.0), 1.0)) * (len(postures) - 1)
    k = min(int(place), len(postures) - 2)
    return np.asarray(postures[k] + (place - k) * (postures[k + 1] - postures[k]))
