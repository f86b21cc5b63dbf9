"""Bounds of a whole plan by branch and bound: cells are halved where a bound has to be better.

Whatever a cell's bound says holds at every time in it, so the least over all cells of a segment
holds throughout the segment. Halving goes on until that is as near as asked for to the least value
that any cell has in its middle, which no bound can be above.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cell_bounds import (
    COLUMNS,
    FIGURES,
    GROUND,
    GROUND_SLACK,
    Bounds,
    Problem,
    bound_cells,
)
from drake_quad.certificate.cells import Cells, join, make_cells, pick
from drake_quad.gait.legs import BoolArray, FloatArray

# How far below the least value a claim is, of margin, foot, shank, joints, torque: [m], [m], [m],
# [rad], part of the limit. Half of it is for bounds, half is room for who checks them again.
TOLERANCE = np.array([2e-4, 2e-4, 2e-4, 2e-3, 2e-3])
ROUNDING = 1e-9  # covers what the robot's constants and the polygons' sides are rounded by
ROUNDS = 24
SHORTEST = 1e-5  # [s]; half the length of a cell that is not halved any more
COARSE = 5e-3  # [s]; the same in a segment that is known not to be as asked for
DIGITS = 1e-6  # claims are rounded down to whole ones


@dataclass(frozen=True, eq=False)
class Proof:
    """What is proven of a plan.

    Attributes:
        cells: The partition of time, in order.
        bounds: Over each.
        low: The least over each segment (segments, COLUMNS): true at every time.
        best: The least value found in each segment (segments, COLUMNS).
        claims: What a certificate claims of each segment (segments, FIGURES).
        demand: What was asked for (COLUMNS,).
        met: Whether `low` meets the demand (segments, COLUMNS).
    """

    cells: Cells
    bounds: Bounds
    low: FloatArray
    best: FloatArray
    claims: FloatArray
    demand: FloatArray
    met: BoolArray


def make_demand(*, margin: float = 0.0, foot: float = 0.0, shank: float = 0.0) -> FloatArray:
    """What is asked of a plan, by column [m]; no joint or torque beyond its limit goes unasked."""
    demand = np.zeros(COLUMNS)
    demand[:3] = margin, foot, shank
    demand[GROUND] = -GROUND_SLACK
    return demand


def prove(problem: Problem, demand: FloatArray) -> Proof:
    """Finds bounds of everything for every segment of a plan.

    Args:
        problem: The plan, its robot and course.
        demand: See `make_demand`: bounds are made good enough to meet it where values do.
    """
    pieces = problem.pieces
    count, segments = len(pieces.start), int(pieces.segment[-1]) + 1
    slack = np.concatenate([0.5 * TOLERANCE, np.full(COLUMNS - FIGURES, np.inf)])
    best = np.full((segments, COLUMNS), np.inf)
    todo = make_cells(pieces, np.arange(count), np.zeros(count), np.ones(count))
    done: list[tuple[Cells, Bounds]] = []
    for _ in range(ROUNDS):
        bounds = bound_cells(problem, todo, best=best, tolerance=slack, demand=demand)
        target = wanted(best, slack, demand)[pieces.segment[todo.piece]]
        hopeless = np.any(best < demand, axis=1)[pieces.segment[todo.piece]]
        again = np.any(bounds.low < target, axis=1)
        again &= todo.half > np.where(hopeless, COARSE, SHORTEST)
        done.append((pick(todo, ~again), pick(bounds, ~again)))
        if not np.any(again):
            break
        last = todo, bounds, again
        todo = halves(problem, pick(todo, again))
    else:
        done.append((pick(last[0], last[2]), pick(last[1], last[2])))
    cells = join([c for c, _ in done])
    order = np.lexsort((cells.middle, pieces.task[cells.piece]))
    cells, bounds = pick(cells, order), pick(join([b for _, b in done]), order)
    low = np.full((segments, COLUMNS), np.inf)
    np.minimum.at(low, pieces.segment[cells.piece], bounds.low)
    low -= ROUNDING
    claims = np.minimum(
        np.maximum(best[:, :FIGURES] - TOLERANCE, demand[:FIGURES]), low[:, :FIGURES]
    )
    claims = np.round(np.floor(claims / DIGITS) * DIGITS, 6)
    return Proof(cells, bounds, low, best, claims, demand, low >= demand)


def wanted(best: FloatArray, slack: FloatArray, demand: FloatArray) -> FloatArray:
    """How good bounds have to be (segments, COLUMNS), given the least values known.

    As near to those as `slack`, or what is asked for if that is in between.
    """
    return np.maximum(best - slack, np.minimum(best, demand + 2.0 * ROUNDING))


def halves(problem: Problem, cells: Cells) -> Cells:
    """Both halves of every cell."""
    middle = 0.5 * (cells.low + cells.high)
    return make_cells(
        problem.pieces,
        np.concatenate([cells.piece, cells.piece]),
        np.concatenate([cells.low, middle]),
        np.concatenate([middle, cells.high]),
    )
