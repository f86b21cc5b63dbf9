"""What a candidate's three feet and joints bear in one pose, and the margin that it keeps."""

from math import cos, sin, sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

SWAYS = 9  # that are tried, evenly from side to side
LEAST_AREA = 1e-9


@compiled
def _others(air: int, k: int) -> tuple[int, int]:
    """The other two of three feet that stand."""
    i, j = -1, -1
    for m in range(4):
        if m != air and m != k:
            if i < 0:
                i = m
            else:
                j = m
    return i, j


@compiled
def best_sway(
    com: FloatArray, feet: FloatArray, air: int, widest: float, wanted: float
) -> tuple[float, float]:
    """The least sway that gives the margin wanted, or that of the best margin; and the margin.

    A margin is the distance from the sides of three feet's triangle, inside positive [m].
    """
    margins = np.full(SWAYS, np.inf)
    for k in range(4):
        if k == air:
            continue
        i, j = _others(air, k)  # the side between them, and which way is in
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        length = max(sqrt(ex * ex + ey * ey), 1e-9)
        inward = ex * (feet[k, 1] - feet[i, 1]) - ey * (feet[k, 0] - feet[i, 0])
        for s in range(SWAYS):
            y = com[1] + (-1.0 + 2.0 * s / (SWAYS - 1)) * widest
            here = (ex * (y - feet[i, 1]) - ey * (com[0] - feet[i, 0])) / length
            margins[s] = min(margins[s], here if inward > 0.0 else -here)
    best, best_value, best_margin = 0.0, -np.inf, -np.inf
    for s in range(SWAYS):
        share = -1.0 + 2.0 * s / (SWAYS - 1)
        value = min(margins[s], wanted) - 1e-3 * abs(share)
        if value > best_value:
            best, best_value, best_margin = share * widest, value, margins[s]
    return best, best_margin


@compiled
def share_weight(
    x: float, y: float, feet: FloatArray, air: int, weight: float, forces: FloatArray
) -> None:
    """Writes the vertical forces (4,) of three feet that carry the weight at x, y [N]."""
    for k in range(4):
        forces[k] = 0.0
        if k == air:
            continue
        i, j = _others(air, k)
        ax, ay = feet[i, 0] - x, feet[i, 1] - y
        bx, by = feet[j, 0] - x, feet[j, 1] - y
        cx, cy = feet[k, 0] - feet[i, 0], feet[k, 1] - feet[i, 1]
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        whole = ex * cy - ey * cx
        area = ax * by - ay * bx
        forces[k] = weight * area / (whole if abs(whole) > LEAST_AREA else LEAST_AREA)


@compiled
def torque_used(
    leg: FloatArray, q: FloatArray, force: float, cp: float, sp: float, effort: FloatArray
) -> float:
    """The greatest share of its limit that a joint needs for a vertical force at the foot."""
    sa, ca = sin(q[0]), cos(q[0])
    both = q[1] + q[2]
    xk, zk = -leg[5] * sin(both), -leg[5] * cos(both)
    x, z = -leg[4] * sin(q[1]) + xk, -leg[4] * cos(q[1]) + zk
    y_up = ca * leg[3] - sa * (z + leg[7])
    fx, fz = sp * force, -cp * force  # what the foot pushes down with, in B
    t0 = y_up * fz
    t1 = z * fx - ca * x * fz
    t2 = zk * fx - ca * xk * fz
    return max(abs(t0) / effort[0], max(abs(t1) / effort[1], abs(t2) / effort[2]))
