"""A robot that is known to start on level ground: its feet's heights show how it is tilted.

The specific force shows the tilt no better than the accelerometer's bias lets it; three contrasts
of the four feet's heights show it to what the ground's own evenness is.
"""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.estimation.correct import retract
from drake_quad.estimation.memory import COVARIANCE, E_FEET, ERRORS, FEET, FIRM, LEVELLED
from drake_quad.estimation.settings import GATE, LEVEL_START
from drake_quad.gait.legs import FloatArray


@compiled
def level_start(m: FloatArray, s: FloatArray) -> None:
    """Once, when all four feet are firm for the first time: they stand at one height.

    In right-invariant errors a foot's height is off by ξ_z + θ_x y - θ_y x.
    """
    if s[LEVEL_START] <= 0.0 or m[LEVELLED] > 0.5:
        return
    if m[FIRM] + m[FIRM + 1] + m[FIRM + 2] + m[FIRM + 3] < 3.5:
        return
    m[LEVELLED] = 1.0
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    noise = s[LEVEL_START] ** 2
    sign, h, column, delta = np.empty(4), np.empty(ERRORS), np.empty(ERRORS), np.empty(ERRORS)
    # Orthonormal contrasts, so that their noises are independent: front, left, and diagonal.
    for contrast in range(3):
        for k in range(4):
            front, left = (0.5 if k < 2 else -0.5), (1.0 if k % 2 == 0 else -1.0)
            sign[k] = front if contrast == 0 else 0.5 * left if contrast == 1 else front * left
        h[:] = 0.0
        y = 0.0
        for k in range(4):
            d = FEET + 3 * k
            y += sign[k] * m[d + 2]
            h[0] += sign[k] * m[d + 1]
            h[1] -= sign[k] * m[d]
            h[E_FEET + 3 * k + 2] = sign[k]
        S = noise
        for a in range(ERRORS):
            column[a] = 0.0
            for b in range(ERRORS):
                column[a] += P[a, b] * h[b]
        for a in range(ERRORS):
            S += h[a] * column[a]
        if y * y / S > s[GATE]:
            continue  # not level after all
        for a in range(ERRORS):
            delta[a] = column[a] * y / S
            for b in range(ERRORS):
                P[a, b] -= column[a] * column[b] / S
        retract(m, delta)
