"""The paper's numbers by other means than ours.

Margins are computed by shapely, swings by the roots of the paper's polynomials, optima by a linear
program or over all orders.
"""

from itertools import pairwise, permutations
from typing import Any

import numpy as np
from scipy.optimize import linprog
from shapely import MultiPoint, Point

# The paper's own numbers, and the places that follow from them, written out by hand.
CENTRES = np.array([[0.4, 0.27], [0.4, -0.27], [-0.4, 0.27], [-0.4, -0.27]])
WAVE = np.array([[0.025, 0.27], [0.525, -0.27], [-0.025, 0.27], [-0.525, -0.27]])
RADIUS = float(np.hypot(0.4, 0.27))
# Arcs of 67.5° about 45° in each quadrant; legs 1, 3, 4, 2 are 0, 1/3, 2/3, 1 of an arc ahead.
SPIN = RADIUS * np.array(
    [[np.cos(a), np.sin(a)] for a in np.radians([11.25, -45 + 33.75, 135 - 11.25, 225 + 11.25])]
)


def margin(point: Any, feet: Any) -> float:
    """Returns the signed margin of a point over some feet, by shapely."""
    polygon, at = MultiPoint(np.asarray(feet)).convex_hull, Point(point)
    if polygon.geom_type != "Polygon":
        return -float(polygon.distance(at))
    inside = polygon.covers(at)
    return float(polygon.exterior.distance(at)) * (1.0 if inside else -1.0)


def step_margins(moves: Any, start: Any = CENTRES) -> list[float]:
    """Returns the margins of moves (leg, place) from a stance, the body being at the origin."""
    feet, margins = np.array(start), []
    for leg, place in moves:
        margins.append(margin((0.0, 0.0), np.delete(feet, leg - 1, axis=0)))
        feet[leg - 1] = place
    return margins


def best_four_steps(goal: Any) -> float:
    """Returns the largest least margin of all orders of four steps, the body still."""
    orders = permutations((1, 2, 3, 4))
    return max(min(step_margins([(leg, goal[leg - 1]) for leg in order])) for order in orders)


def best_four_shifting_steps(goal: Any, shift: float = 0.1) -> float:
    """Returns the same where the body may shift before each lift: a linear program a lift.

    Over (x, y, m): as large an m as possible, so that the body at (x, y) is m inside of each side
    of the support triangle and every foot, also where it is put down, is in its workspace.
    """
    known: dict[Any, float] = {}

    def lift(moved: frozenset[int], leg: int) -> float:
        if (moved, leg) in known:
            return known[moved, leg]
        feet = np.array([goal[k] if k in moved else CENTRES[k] for k in range(4)])
        standing = np.delete(feet, leg, axis=0)
        a, b, c = standing
        if np.cross(np.append(b - a, 0), np.append(c - a, 0))[2] < 0:
            standing = standing[::-1]
        rows, bounds = [], []
        for p, q in pairwise([*standing, standing[0]]):
            n = np.array([p[1] - q[1], q[0] - p[0]]) / np.hypot(*(q - p))  # inward
            rows.append([-n[0], -n[1], 1.0])
            bounds.append(-n @ p)
        offsets = np.array([*(feet - CENTRES), goal[leg] - CENTRES[leg]])
        half = np.array([0.38, 0.25])
        low = np.maximum(-shift, (offsets - half).max(axis=0))
        high = np.minimum(shift, (offsets + half).min(axis=0))
        limits = [(low[0], high[0]), (low[1], high[1]), (None, None)]
        found = linprog([0, 0, -1], A_ub=rows, b_ub=bounds, bounds=limits)
        known[moved, leg] = float(found.x[2])
        return known[moved, leg]

    return max(
        min(lift(frozenset(order[:k]), order[k]) for k in range(4))
        for order in permutations(range(4))
    )


def quintic_time(fraction: float) -> float:
    """Returns when in [0, 1] the paper's quintic has come this far, from its roots."""
    roots = np.roots([6.0, -15.0, 10.0, 0.0, 0.0, -fraction])
    return next(float(r.real) for r in roots if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0)


def quintic(s: Any) -> Any:
    """Returns the paper's swing, from 0 to 1 in a time of 1."""
    return np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], s)


def paper_height(x: float, *, z_f: float, d_s: float, h_s: float) -> float:
    """Returns equation (3) over the place x of a swing of 1 m, with delta_h = 0.02 m."""
    t, t_s, top = quintic_time(x), quintic_time(d_s), h_s + 0.02
    if t <= t_s:
        return float(top * quintic(t / t_s))
    return float(top + (z_f - top) * quintic((t - t_s) / (1.0 - t_s)))
