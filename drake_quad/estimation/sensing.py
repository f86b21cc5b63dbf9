"""The sensors' ticks, compiled: what they show of a state.

`ImuErrors.apply` and `JointErrors.apply` say what the errors are; tests hold these equal to them.
"""

from math import floor

import numpy as np

from drake_quad.compiled import compiled, copy_vector
from drake_quad.estimation.increments import imu_increments
from drake_quad.estimation.outputs import IntArray
from drake_quad.gait.legs import FloatArray


@compiled
def sense_imu(
    state: FloatArray,
    q_base: int,
    v_base: int,
    before: FloatArray,
    tick: int,
    white: FloatArray,
    bias: FloatArray,
    limit: FloatArray,
    period: float,
    shown: FloatArray,
) -> None:
    """What an IMU shows (6,), and what it has to remember.

    Args:
        state: [q; v], the truth.
        q_base: Where the base's quaternion is.
        v_base: Where its angular velocity is, its velocity after it.
        before: (7,) quaternion and velocity at the last sample; then those of this.
        tick: Number of the sample.
        white: See ImuErrors.
        bias: See there.
        limit: See there.
        period: See there.
        shown: Result.
    """
    now = np.empty(7)
    copy_vector(now[:4], state[q_base : q_base + 4])
    copy_vector(now[4:], state[v_base + 3 : v_base + 6])
    ideal = imu_increments(before, now, period)
    copy_vector(before, now)
    second = tick * period
    row = int(second)
    part = second - row
    here, there = bias[row % len(bias)], bias[(row + 1) % len(bias)]
    noise = white[tick % len(white)]
    for i in range(6):
        value = ideal[i] + noise[i] + (here[i] + part * (there[i] - here[i]))
        shown[i] = min(max(value, -limit[i]), limit[i])


@compiled
def sense_joints(
    state: FloatArray,
    places: IntArray,
    tick: int,
    white: FloatArray,
    zero: FloatArray,
    count: float,
    shown: FloatArray,
) -> None:
    """What the joints' encoders show (24,).

    Args:
        state: [q; v], the truth.
        places: Where the angles, then the speeds, are in it (24,).
        tick: Number of the sample.
        white: See JointErrors.
        zero: See there.
        count: See there.
        shown: Result.
    """
    noise = white[tick % len(white)]
    for i in range(24):
        shown[i] = state[places[i]] + noise[i]
    for i in range(12):
        shown[i] += zero[i]
        if count > 0.0:
            shown[i] = floor(shown[i] / count + 0.5) * count
