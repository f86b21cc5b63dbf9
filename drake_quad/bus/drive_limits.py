"""A command to the twelve drives, its limits, and those of how fast it may change."""

from dataclasses import dataclass
from functools import cached_property
from math import isfinite

import numpy as np

from drake_quad.common import FloatArray

# [s] of silence after which the last message holds, and after which there is damping: both sides'
# watchdogs. The second leaves time for ticks, so that damping is there within 100 ms.
HOLD_AFTER, DAMP_AFTER = 0.02, 0.09
SLOW = 1.25  # periods between states from which on drives are taken to be slower than that


@dataclass(frozen=True, eq=False, kw_only=True)
class SafetyLimits:
    """What drives may be told, and when nothing may be told any more.

    Attributes:
        q_lower: Joint position limits (12,) [rad].
        q_upper: Joint position limits (12,) [rad].
        speed: Joint speed limits (12,) [rad/s].
        effort: Joint torque limits (12,) [Nm].
        stiffness: Greatest stiffness of a drive, and that of standing [Nm/rad].
        damping: Greatest damping of a drive, and that of standing and of damping [Nm s/rad].
        period: Time between commands [s].
        q_step: Farthest that a wanted angle may go from one command to the next [rad].
        torque_time: Time in which a fed torque, or a wanted speed, may go from nothing to its limit
            [s].
        tilt: Tilt of the trunk beyond which the robot is damped [rad].
        hold_after: Age of the state beyond which the last command holds [s].
        damp_after: Age of the state beyond which the robot is damped [s].
        arming_tilt: Tilt beyond which it does not arm [rad].
        arming_speed: Joint speed beyond which it does not arm [rad/s].
        arming_room: How far beyond its limits a joint may be when it arms [rad].
        arming_time: How long all must have been well, and no joint faster, before it arms [s].
        arming_posture: Farthest that any joint may be from a posture between sitting and standing
            when it arms [rad].
        astray: Farthest from its wanted angle that a joint may be while it is driven [rad].
        astray_time: For how long it may be farther [s].
        standing_error: Farthest from its angle that a joint may be to count as standing [rad].
        fold_time: Time from the posture found to the lowest of the postures [s].
        rise_time: Time from there to standing, and back [s].
    """

    q_lower: FloatArray
    q_upper: FloatArray
    speed: FloatArray
    effort: FloatArray
    stiffness: float
    damping: float
    period: float = 0.002
    q_step: float = 0.05
    torque_time: float = 0.02
    tilt: float = 0.6
    hold_after: float = HOLD_AFTER
    damp_after: float = DAMP_AFTER
    arming_tilt: float = 0.35
    arming_speed: float = 0.3
    arming_room: float = 0.1
    arming_time: float = 0.5
    arming_posture: float = 1.0
    astray: float = 0.3
    astray_time: float = 0.1
    standing_error: float = 0.2
    fold_time: float = 1.5
    rise_time: float = 2.0

    @cached_property
    def step(self) -> FloatArray:
        """How far each wanted angle may go in a period (12,) [rad]: no faster than its joint."""
        return np.minimum(self.q_step, self.speed * self.period)

    @cached_property
    def torque_step(self) -> FloatArray:
        """By how much each fed torque may change in a period (12,) [Nm]."""
        return self.effort * min(1.0, self.period / self.torque_time)

    @cached_property
    def speed_step(self) -> FloatArray:
        """By how much each wanted speed may change in a period (12,) [rad/s]."""
        return self.speed * min(1.0, self.period / self.torque_time)

    @cached_property
    def lowest_speed(self) -> FloatArray:
        """Joint speed limits backwards (12,) [rad/s]."""
        return -self.speed

    @cached_property
    def lowest_effort(self) -> FloatArray:
        """Joint torque limits backwards (12,) [Nm]."""
        return -self.effort


def gain_share(period: float, interval: float) -> float:
    """Which share of their gains drives can have that sense as seldom as states come.

    A drive whose loop runs every T makes a leg in the air unstable from d T / I = 2 on, with d its
    damping and I the least inertia that it moves. Gains that are right for the controller's period
    are too high by as much as the drives are slower; how slow they are, their states tell.

    Args:
        period: The controller's [s].
        interval: Time between the robot's states [s].
    """
    return period / interval if interval > SLOW * period else 1.0


@dataclass(frozen=True, eq=False)
class Drives:
    """What the twelve drives are told: τ + k (q_d - q) + d (v_d - v).

    Attributes:
        q: q_d (12,) [rad].
        v: v_d (12,) [rad/s].
        torque: τ (12,) [Nm].
        stiffness: k, of every drive [Nm/rad].
        damping: d, of every drive [Nm s/rad].
    """

    q: FloatArray
    v: FloatArray
    torque: FloatArray
    stiffness: float
    damping: float

    @property
    def finite(self) -> bool:
        """Whether all of it is numbers."""
        whole = np.isfinite(np.concatenate((self.q, self.v, self.torque))).all()
        return bool(whole) and isfinite(self.stiffness) and isfinite(self.damping)


def within_limits(wanted: Drives, before: Drives, limits: SafetyLimits) -> Drives:
    """The wanted command within the limits of place, speed, torque, and of how fast they change.

    A value of it that is no finite number is taken as it was before.
    """
    q, v, torque = wanted.q, wanted.v, wanted.torque
    if not np.isfinite(np.concatenate((q, v, torque))).all():
        q = np.where(np.isfinite(q), q, before.q)
        v = np.where(np.isfinite(v), v, 0.0)
        torque = np.where(np.isfinite(torque), torque, 0.0)
    step = limits.step
    q = _within(_within(q, limits.q_lower, limits.q_upper), before.q - step, before.q + step)
    change = limits.torque_step
    torque = _within(torque, before.torque - change, before.torque + change)
    return Drives(
        q,
        _within(
            _within(v, limits.lowest_speed, limits.speed),
            before.v - limits.speed_step,
            before.v + limits.speed_step,
        ),
        _within(torque, limits.lowest_effort, limits.effort),
        _between(wanted.stiffness, limits.stiffness),
        _between(wanted.damping, limits.damping),
    )


def _within(values: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """As `np.clip`, whose checks take several times as long as twelve comparisons."""
    return np.minimum(np.maximum(values, least), most)


def _between(value: float, most: float) -> float:
    return min(max(value, 0.0), most) if isfinite(value) else 0.0
