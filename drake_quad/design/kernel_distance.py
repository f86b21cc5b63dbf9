"""The distances of `kernel`: from endless stairs, from the trunk, and of legs from each other."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.nosing_distance import from_nosing
from drake_quad.robot.shank_outline import SHANK_POINTS

SHANK, THIGH = len(SHANK_POINTS), 3  # points of a leg that are looked at
NEIGHBOURS = 2  # treads to either side that can be the nearest to a point


@compiled
def from_stairs(s: float, z: float, rise: float, run: float) -> float:
    """Signed distance of a point from a Staircase [m], negative inside it.

    Exact for what is nearer than two treads; beyond, it may be less far than it says.
    """
    middle = np.round(s / run)
    best = np.inf
    for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
        beside = abs(s - (middle + k) * run) - 0.5 * run
        above = z - (middle + k) * rise
        out_x, out_z = max(beside, 0.0), max(above, 0.0)
        best = min(best, sqrt(out_x * out_x + out_z * out_z) + min(max(beside, above), 0.0))
    return best


@compiled
def line_from_stairs(p: FloatArray, q: FloatArray, rise: float, run: float) -> float:
    """Signed distance of the line from p to q from the nosing of a Staircase next to it [m]."""
    k = np.floor(0.5 * (p[0] + q[0]) / run)
    edge = (k + 0.5) * run
    return from_nosing(p[0], p[2], q[0], q[2], edge, k * rise, (k + 1.0) * rise, run)


@compiled
def to_body(
    points: FloatArray, b: FloatArray, sway: float, cp: float, sp: float, into: FloatArray
) -> None:
    """Writes points of W (M, 3) in B, of a body that sways and does not turn."""
    for i in range(len(into)):
        dx, dz = points[i, 0] - b[0], points[i, 2] - b[2]
        into[i, 0], into[i, 2] = cp * dx - sp * dz, sp * dx + cp * dz
        into[i, 1] = points[i, 1] - b[1] - sway


@compiled
def apart(
    front: FloatArray, rear: FloatArray, front_radii: FloatArray, rear_radii: FloatArray
) -> float:
    """Room between a front leg and the rear leg of its side [m]."""
    best = np.inf
    for i in range(SHANK + THIGH):
        for j in range(SHANK + THIGH):
            x, y = front[i, 0] - rear[j, 0], front[i, 1] - rear[j, 1]
            z = front[i, 2] - rear[j, 2]
            thick = front_radii[i if i < SHANK else 0] + rear_radii[j if j < SHANK else 0]
            best = min(best, sqrt(x * x + y * y + z * z) - thick)
    return best
