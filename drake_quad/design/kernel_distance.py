"""The distances of `kernel`: from endless stairs, and from the plane above their nosings."""

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
    inside, square = 0.0, np.inf
    for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
        beside = abs(s - (middle + k) * run) - 0.5 * run
        above = z - (middle + k) * rise
        out_x, out_z = max(beside, 0.0), max(above, 0.0)
        square = min(square, out_x * out_x + out_z * out_z)
        inside = min(inside, max(beside, above))
    return inside if inside < 0.0 else sqrt(square)


@compiled
def over_nosings(s: float, z: float, rise: float, run: float) -> float:
    """How far a point is above the plane through a Staircase's nosings [m]; -inf below it.

    All of the staircase is below that plane, so that what is above it is at least as far from any
    of the staircase.
    """
    height = z - (rise * s / run + 0.5 * abs(rise))
    return height * run / sqrt(run * run + rise * rise) if height > 0.0 else -np.inf


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
