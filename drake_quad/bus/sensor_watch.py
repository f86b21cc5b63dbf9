"""Says when a part of a robot's sensors shows what cannot be: the same without end, or too much.

Pure of clocks and sockets. A robot of which only one sensor fails goes on sending sound messages.
"""

from collections.abc import Sequence

import numpy as np

from drake_quad.bus.drive_limits import SafetyLimits
from drake_quad.bus.messages import StateMessage
from drake_quad.bus.real_time import NS

FROZEN = 0.05  # [s] for which a sound gyroscope or accelerometer never shows the same to the bit
# [rad] that a joint turns by its own speed while its angle stays the same to the bit. Encoders of a
# joint at rest may do that for ever, so that time alone says nothing.
TURNED = 0.05
MOVING = 0.1  # [rad/s] below which a joint's speed may be an error of its own, and does not count
LONGEST = 0.1  # [s] for which a joint's speed is taken to have lasted
# Of a joint's limits, beyond which nothing moves: three times as fast, or as strong. Half a radian
# beyond the ends of its range a joint is at its mechanical stops, or its zero is another.
TOO_FAST, TOO_STRONG, TOO_FAR = 3.0, 3.0, 0.5
MOST_TURN = 40.0  # [rad/s] of a trunk; the gyroscopes of such robots end at 35 rad/s
MOST_FORCE = 500.0  # [m/s²] of an accelerometer; those of such robots end at 300 m/s² or before
INERTIAL = {"angular_rate": "gyroscope", "specific_force": "accelerometer"}


class SensorWatch:
    """Looks at each sound state, one after the other.

    Args:
        limits: The joints' limits.
        names: The joints' names, for people, 12 of them.
    """

    def __init__(self, limits: SafetyLimits, names: Sequence[str]) -> None:
        self._lower, self._upper = limits.q_lower - TOO_FAR, limits.q_upper + TOO_FAR
        self._speed, self._effort = TOO_FAST * limits.speed, TOO_STRONG * limits.effort
        self._names = names
        self._last: StateMessage | None = None
        self._changed_ns = dict.fromkeys(INERTIAL, 0)
        self._turned = np.zeros(12)  # by speed, since the angle was another [rad]

    def take(self, state: StateMessage) -> str:
        """What is wrong with the sensors, in a few words; empty if nothing is."""
        last, self._last = self._last, state
        if last is None or last.session != state.session or state.time_ns <= last.time_ns:
            self._changed_ns = dict.fromkeys(INERTIAL, state.time_ns)
            self._turned = np.zeros(12)
            return self._beyond(state)
        for name, sensor in INERTIAL.items():
            if not np.array_equal(getattr(state, name), getattr(last, name)):
                self._changed_ns[name] = state.time_ns
            elif state.time_ns - self._changed_ns[name] > FROZEN * NS:
                return f"the {sensor} shows the same without end"
        dt = min((state.time_ns - last.time_ns) / NS, LONGEST)
        same = state.position == last.position
        speed = np.where(np.abs(state.velocity) > MOVING, state.velocity, 0.0)
        self._turned = np.where(same, self._turned + dt * speed, 0.0)
        stuck = np.abs(self._turned)
        if stuck.max() > TURNED:
            joint = self._names[int(stuck.argmax())]
            return f"the angle of {joint} stays the same, although by its speed it turns"
        return self._beyond(state)

    def _beyond(self, state: StateMessage) -> str:
        """Which value is one that nothing can have measured."""
        for words, unit, values, least, most in (
            ("is at", "rad", state.position, self._lower, self._upper),
            ("turns at", "rad/s", state.velocity, -self._speed, self._speed),
            ("gives", "Nm", state.effort, -self._effort, self._effort),
        ):
            wrong = (values < least) | (values > most)
            if wrong.any():
                k = int(wrong.argmax())
                return f"{self._names[k]} {words} {values[k]:.4g} {unit}, which cannot be"
        turn = float(np.abs(state.angular_rate).max())
        if turn > MOST_TURN:
            return f"the gyroscope shows {turn:.4g} rad/s, which cannot be"
        force = float(np.abs(state.specific_force).max())
        if force > MOST_FORCE:
            return f"the accelerometer shows {force:.4g} m/s², which cannot be"
        return ""
