"""Bounds of all certified quantities over cells of time, and the branch and bound on them.

Whatever a cell's bound says holds at every time in it, so the least over all cells of a segment
holds throughout the segment. Halving goes on until that is as near as demanded to the least value
that any cell has in its middle, which no bound can be above.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells, Pieces, join_cells, make_cells, pick
from drake_quad.certificate.clearance import (
    Footholds,
    enclose_foot_clearance,
    enclose_shank_clearance,
    find_footholds,
)
from drake_quad.certificate.ground import find_ground, find_ground_below
from drake_quad.certificate.kinematics import (
    Legs,
    enclose_feet,
    enclose_frame,
    enclose_knees,
    enclose_legs,
    enclose_moments,
    enclose_shank_axes,
    make_chain,
)
from drake_quad.certificate.obstacles import CAP, Obstacles
from drake_quad.certificate.statics import enclose_margin, enclose_statics, find_support
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.robot.model import RobotModel, ShankProfile

# What is bounded from below, a column each: first what a claim gives figures of, then what has to
# be so for it to mean anything. Units: m, m, m, rad, part of the limit; m, m, part of the weight.
MARGIN, FOOT, SHANK, JOINTS, TORQUE, REACH, GROUND, SHARES = range(8)
FIGURES = 5
COLUMNS = 8
GROUND_SLACK = 1e-6  # [m] that a foot may dip into the ground as it lifts off
MOST_CELLS = 8192  # that are bounded in one go, whatever the plan's length: some 100 MB


@dataclass(frozen=True, eq=False)
class Problem:
    """Whose plan it is, and what is around it.

    Attributes:
        robot: The robot.
        shank: Its shanks.
        pieces: The plan.
        obstacles: The course.
        footholds: Where the swings begin and end.
        ground: The box that each foot is on, by pieces (P, 4), see `find_ground`.
        within: How far all may be from the plan.
    """

    robot: RobotModel
    shank: ShankProfile
    pieces: Pieces
    obstacles: Obstacles
    footholds: Footholds
    ground: IntArray
    within: Tolerances = NONE


def pose_problem(
    robot: RobotModel,
    shank: ShankProfile,
    pieces: Pieces,
    obstacles: Obstacles,
    within: Tolerances = NONE,
) -> Problem:
    """Puts together what bounds are found with."""
    return Problem(
        robot=robot,
        shank=shank,
        pieces=pieces,
        obstacles=obstacles,
        footholds=find_footholds(pieces, obstacles, robot.foot_radius),
        ground=find_ground(pieces, obstacles, robot.foot_radius),
        within=within,
    )


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds over N cells.

    Attributes:
        low: Bounds below over each cell (N, COLUMNS); -inf where nothing is known.
        sample: Values in its middle (N, COLUMNS).
        where: Index of the side, obstacle, leg or joint that `low` is about (N, COLUMNS).
        witness: Shares of the weight in its middle (N, 4).
    """

    low: FloatArray
    sample: FloatArray
    where: IntArray
    witness: FloatArray


def bound_cells(
    problem: Problem,
    cells: Cells,
    *,
    best: FloatArray,
    tolerance: FloatArray,
    demand: FloatArray,
) -> Bounds:
    """Bounds everything over every cell.

    Args:
        problem: The plan and what is around it.
        cells: The cells (N,).
        best: Least known value of each segment (segments, COLUMNS); made less by what is found.
        tolerance: How far below those bounds may be (COLUMNS,).
        demand: Demanded values (COLUMNS,).
    """
    size = MOST_CELLS
    parts = []
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, len(cells.half), size):
            some = pick(cells, slice(first, first + size))
            parts.append(_bound(problem, some, best, tolerance, demand))
    return join_cells(parts)


def _bound(
    problem: Problem,
    cells: Cells,
    best: FloatArray,
    tolerance: FloatArray,
    demand: FloatArray,
) -> Bounds:
    robot, pieces, within = problem.robot, problem.pieces, problem.within
    segment = pieces.segment[cells.piece]
    frame, feet = enclose_frame(cells, within), enclose_feet(pieces, cells, within)
    legs = enclose_legs(robot, frame, feet)
    moments = enclose_moments(robot, frame, legs)
    N = len(cells.half)
    low, sample = np.empty((N, COLUMNS)), np.empty((N, COLUMNS))
    where = np.zeros((N, COLUMNS), dtype=int)

    def put(column: int, lows: FloatArray, samples: FloatArray) -> None:
        """Takes the least of each row (N, n), and notes which it is; a nan is the worst."""
        lows = np.where(np.isnan(lows), -np.inf, lows)
        where[:, column] = np.argmin(lows, axis=1)
        low[:, column] = lows.min(axis=1)
        sample[:, column] = np.where(np.isnan(samples), np.inf, samples).min(axis=1)

    support = find_support(pieces, cells, within)
    margin = enclose_margin(support, moments)
    put(MARGIN, margin.lower, margin.lower_here)
    put(JOINTS, *_joint_slack(robot, legs))
    put(REACH, *_reach_slack(robot, legs))
    statics = enclose_statics(robot, support, frame, legs, moments)
    effort = robot.effort.reshape(4, 3).T / (1.0 + within.mass)
    left = [
        1.0 - np.maximum(t.upper, -t.lower) / e
        for t, e in zip(statics.torques, effort, strict=True)
    ]
    here = [
        1.0 - np.maximum(t.upper_here, -t.lower_here) / e
        for t, e in zip(statics.torques, effort, strict=True)
    ]
    put(TORQUE, np.stack(left, axis=-1).reshape(N, 12), np.stack(here, axis=-1).reshape(N, 12))
    stands = pieces.standing[cells.piece]
    shares = statics.shares
    put(SHARES, np.where(stands, shares.lower, 1.0), np.where(stands, shares.lower_here, 1.0))
    foot = enclose_foot_clearance(
        pieces, cells, problem.obstacles, problem.footholds, robot.foot_radius, within
    )  # fmt: skip
    low[:, FOOT], sample[:, FOOT], where[:, FOOT] = foot.low, foot.sample, foot.obstacle
    low[:, GROUND], sample[:, GROUND] = foot.ground_low, foot.ground_sample
    where[:, GROUND] = where[:, FOOT]
    known = best[:, SHANK].copy()
    knees, ahead = enclose_knees(robot, frame, legs), enclose_shank_axes(frame, legs)
    below = None
    if within.rise > 0.0:
        below = find_ground_below(
            pieces, cells, problem.obstacles, problem.ground, radius=robot.foot_radius,
            within=within,
        )  # fmt: skip
    shank = enclose_shank_clearance(
        cells,
        make_chain(problem.shank, knees, feet, ahead),
        problem.obstacles,
        group=segment,
        best=known,
        tolerance=float(tolerance[SHANK]),
        demand=float(demand[SHANK]),
        ground=below,
        run=within.run,
        rise=within.rise,
    )
    low[:, SHANK], sample[:, SHANK], where[:, SHANK] = shank.low, shank.sample, shank.leg
    if within != NONE:  # a foot may touch its own ground sooner or later than planned
        low[:, GROUND] = sample[:, GROUND] = CAP
    np.minimum.at(best, segment, sample)
    return Bounds(low, sample, where, statics.witness)


def _joint_slack(robot: RobotModel, legs: Legs) -> tuple[FloatArray, FloatArray]:
    """How far the angles are from the nearer of their limits, bound and value, (N, 12) each."""
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)

    def slack(low: FloatArray, high: FloatArray, j: int) -> FloatArray:
        return np.minimum(low - lower[:, j], upper[:, j] - high)

    low = [slack(angle.lower, angle.upper, j) for j, angle in enumerate(legs.angles)]
    here = [slack(angle.lower_here, angle.upper_here, j) for j, angle in enumerate(legs.angles)]
    # A knee that is nearly straight is known better by its cosine, which falls as it bends.
    sign, cosine = robot.geometry.knee_sign, legs.cos_knee
    for values, most, least in (
        (low, cosine.upper, cosine.lower),
        (here, cosine.upper_here, cosine.lower_here),
    ):
        ends = np.sort([sign * np.arccos(most), sign * np.arccos(least)], axis=0)
        values[2] = np.fmax(values[2], slack(ends[0], ends[1], 2))
    count = len(low[0])
    return np.stack(low, axis=-1).reshape(count, 12), np.stack(here, axis=-1).reshape(count, 12)


def _reach_slack(robot: RobotModel, legs: Legs) -> tuple[FloatArray, FloatArray]:
    """How far the feet are from where a leg is straight, or folded: bound and value (N, 4) each."""
    g, far = robot.geometry, legs.extension
    folded = np.abs(g.thigh - g.shank)
    low = np.minimum(g.reach - far.upper, far.lower - folded)
    here = np.minimum(g.reach - far.upper_here, far.lower_here - folded)
    return low, np.where(np.isnan(here), -1.0, here)


# How far below the least value a claim is, of margin, foot, shank, joints, torque: [m], [m], [m],
# [rad], part of the limit. Half of it is for bounds, half is left for who checks them again.
TOLERANCE = np.array([2e-4, 2e-4, 2e-4, 2e-3, 2e-3])
ROUNDING = 1e-9  # covers what the robot's constants and the polygons' sides are rounded by
ROUNDS = 24
SHORTEST = 1e-5  # [s]; half the length of a cell that is not halved any more
COARSE = 5e-3  # [s]; the same in a segment that is known not to meet the demand
DIGITS = 1e-6  # claims are rounded down to whole ones


@dataclass(frozen=True, eq=False)
class Proof:
    """What is proven of a plan.

    Attributes:
        cells: The partition of time, in order.
        bounds: The bounds over each cell.
        low: The least over each segment (segments, COLUMNS): true at every time.
        best: The least value found in each segment (segments, COLUMNS).
        claims: What a certificate claims of each segment (segments, FIGURES).
        demand: Demanded values (COLUMNS,).
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
    """Demanded values by column [m]; that joints and torques keep their limits always is."""
    demand = np.zeros(COLUMNS)
    demand[:3] = margin, foot, shank
    demand[GROUND] = -GROUND_SLACK
    return demand


def prove(problem: Problem, demand: FloatArray, *, fine: bool = True) -> Proof:
    """Finds bounds of everything for every segment of a plan.

    Args:
        problem: The plan, its robot and course.
        demand: What `make_demand` returned; bounds are made good enough to meet it where values do.
        fine: Whether bounds are to be near to the values, too, for claims.
    """
    pieces = problem.pieces
    count, segments = len(pieces.start), int(pieces.segment[-1]) + 1
    near = 0.5 * TOLERANCE if fine else np.full(FIGURES, np.inf)
    slack = np.concatenate([near, np.full(COLUMNS - FIGURES, np.inf)])
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
    cells = join_cells([c for c, _ in done])
    order = np.lexsort((cells.middle, pieces.task[cells.piece]))
    cells, bounds = pick(cells, order), pick(join_cells([b for _, b in done]), order)
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

    As near to those as `slack`, or the demand if that is in between.
    """
    # Where no value is known yet, and any bound would do, it is the demand.
    near = np.where(np.isinf(slack), -np.inf, best - np.where(np.isinf(slack), 0.0, slack))
    return np.fmax(near, np.minimum(best, demand + 2.0 * ROUNDING))


def halves(problem: Problem, cells: Cells) -> Cells:
    """Both halves of every cell."""
    middle = 0.5 * (cells.low + cells.high)
    return make_cells(
        problem.pieces,
        np.concatenate([cells.piece, cells.piece]),
        np.concatenate([cells.low, middle]),
        np.concatenate([middle, cells.high]),
    )
