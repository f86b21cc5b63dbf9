"""Encloses contact forces, joint torques and the static margin over a cell.

While feet do not move, the margin is the least of functions linear in the centre of mass, one a
side of the support polygon. Standing feet roll, evenly over a piece of the plan: by `away` at most
from where they are in the middle of a stretch. The margin is the least over directions of how far
the feet reach beyond the centre of mass, so that it is off by no more than that.

Vertical forces that balance the robot's weight are linear in its centre of mass: shares of the
weight f(t) = witness + K (com(t) - com at the stretch's middle) balance it at every time, if the
feet stay. Where they roll, by D(t) from the matrix B of their balance (B K = 1), the shares

    f - K (1 + D K)^-1 D f

balance the weight: with no foot off by more than `away`, |D f| <= away |f|, the sum of shares, and
|D K| <= k = away times the sum of K's rows, they are off by at most |K_i| away |f| / (1 - k). Of
K's rows the part counts that is of the centre of mass, for D leaves the sum of shares as it is.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells, Pieces
from drake_quad.certificate.enclosure import Enclosure, Number, blur, widen
from drake_quad.certificate.kinematics import Frame, Legs, Moments
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.robot.model import RobotModel

NO_SIDE = 1e3  # [m] stands for the margin to a side that is not there
_PAIRS = np.array([(i, j) for i in range(4) for j in range(4) if i != j])
SIDES = len(_PAIRS)


@dataclass(frozen=True, eq=False)
class Support:
    """What the standing feet make of the centre of mass, as they are in the middle of N cells.

    Attributes:
        normal: Inward unit normals of the polygon's sides (N, SIDES, 2).
        offset: Margin to a side: normal . com - offset (N, SIDES) [m]; -NO_SIDE for none.
        share: Shares of the weight: share @ (1, com) (N, 4, 3), the least ones by squares.
        free: Change of the shares that does not change their balance (N, 4).
        away: How far a standing foot rolls from its place in the cell, at most (N,) [m].
        off: How far besides it may be from its planned place, at most [m].
        com: How far the centre of mass may be from the model's, at most [m].
    """

    normal: FloatArray
    offset: FloatArray
    share: FloatArray
    free: FloatArray
    away: FloatArray
    off: float = 0.0
    com: float = 0.0


def find_support(pieces: Pieces, cells: Cells, within: Tolerances = NONE) -> Support:
    """The support in every cell, with what tolerances allow."""
    feet, away = cells.standing_feet(pieces)
    standing = pieces.standing[cells.piece]
    normal, offset = _sides(feet, standing)
    share, free = _shares(feet, standing)
    rolls = np.where(standing, away, 0.0).max(axis=1)
    return Support(normal, offset, share, free, rolls, within.foot, within.com)


def _sides(feet: FloatArray, standing: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Of every two feet that have all others to their left."""
    a, b = feet[:, _PAIRS[:, 0]], feet[:, _PAIRS[:, 1]]
    along = b - a
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        normal /= np.hypot(along[..., 0], along[..., 1])[..., None]
    left = np.einsum("nsi,nski->nsk", normal, feet[:, None] - a[:, :, None])
    side = standing[:, _PAIRS].all(axis=-1)
    side &= np.all((left >= -1e-12) | ~standing[:, None], axis=-1)
    offset = np.where(side, np.einsum("nsi,nsi->ns", normal, a), -NO_SIDE)
    flat = np.max(np.where(standing[:, None], left, 0.0), axis=(1, 2)) < 1e-9
    offset[flat | (side.sum(axis=1) < 3)] = NO_SIDE  # no polygon: the margin is nowhere positive
    return np.where(side[..., None], normal, 0.0), offset


def _shares(feet: FloatArray, standing: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Shares that balance a centre of mass, and what may be added to them."""
    weight = standing / standing.sum(axis=1)[:, None]
    middle = np.einsum("nk,nki->ni", weight, feet)  # about which the numbers are small
    away = (feet - middle[:, None]) * standing[..., None]
    balance = np.stack([standing.astype(float), away[..., 0], away[..., 1]], axis=1)
    square = balance @ np.swapaxes(balance, 1, 2)
    square[np.abs(np.linalg.det(square)) < 1e-12] = np.eye(3)  # in a line: there is no margin
    share = np.swapaxes(np.linalg.solve(square, balance), 1, 2)
    share[..., 0] -= np.einsum("nki,ni->nk", share[..., 1:], middle)
    # What changes no balance: by Cramer's rule, the others' determinants in turn.
    free = np.zeros((len(feet), 4))
    for k in range(4):
        rest = [j for j in range(4) if j != k]
        free[:, k] = (-1.0) ** k * np.linalg.det(balance[:, :, rest])
    free[~standing.all(axis=1)] = 0.0
    size = np.linalg.norm(free, axis=1)
    return share, free / np.where(size > 0.0, size, 1.0)[:, None]


def enclose_margin(support: Support, moments: Moments) -> Enclosure:
    """The distances of the centre of mass from the lines through the polygon's sides (N, SIDES).

    The least of a row is the static margin where it is positive, and above it elsewhere: a
    positive bound is true of the margin either way.
    """
    x, y = moments.com
    still = x * support.normal[..., 0] + y * support.normal[..., 1] - support.offset
    away = support.away[:, None]
    return widen(blur(still, support.off + support.com), away)


_CHOICES = np.linspace(0.02, 0.98, 25)  # of a force distribution over four feet


@dataclass(frozen=True, eq=False)
class Statics:
    """Forces and torques that hold the robot still, over each cell.

    Attributes:
        witness: Shares of the weight, upwards, at the middle of each cell (N, 4).
        shares: The shares over the cell (N, 4).
        torques: Torques of abduction, hip pitch and knee, (N, 4) each [Nm].
    """

    witness: FloatArray
    shares: Enclosure
    torques: tuple[Enclosure, Enclosure, Enclosure]


def enclose_statics(
    robot: RobotModel,
    support: Support,
    frame: Frame,
    legs: Legs,
    moments: Moments,
) -> Statics:
    """Vertical forces of the standing feet that balance the weight, and the torques they ask for.

    Where four feet stand one of the forces may be chosen: it is so that the torques are the
    smallest part of their limits.
    """
    share, free = support.share, support.free
    x, y = moments.com
    shares = x * share[..., 1] + y * share[..., 2] + share[..., 0]
    shares = blur(shares, support.com * np.hypot(share[..., 1], share[..., 2]))
    empty, loaded = _torques(robot, frame, legs, moments)
    freedom = _choose(robot, _moved(shares, support), free, empty, loaded)
    shares = _moved(shares + freedom[:, None] * free, support)
    torques = (
        empty[0] + loaded[0] * shares,
        empty[1] + loaded[1] * shares,
        empty[2] + loaded[2] * shares,
    )
    return Statics(shares.centre, shares, torques)


def _moved(shares: Enclosure, support: Support) -> Enclosure:
    """The shares with feet that roll, or are off their places, see above."""
    off, away = support.off, support.away[:, None] + support.off
    # Of K's rows, without the first column: feet that are off leave the sum of shares as it is.
    size = np.hypot(support.share[..., 1], support.share[..., 2])
    rows = size.sum(axis=1, keepdims=True)

    def moved(distance: Number, sizes: FloatArray) -> FloatArray:
        total, k = sizes.sum(axis=1, keepdims=True), distance * rows
        return np.asarray(size * distance * total / np.where(k < 1.0, 1.0 - k, np.nan))

    middle = np.abs(shares.centre)
    here = moved(off, middle + shares.here)
    return widen(blur(shares, here), moved(away, middle + shares.radius) - here)


def _torques(
    robot: RobotModel, frame: Frame, legs: Legs, moments: Moments
) -> tuple[tuple[Enclosure, ...], tuple[Enclosure, ...]]:
    """Torques of unloaded legs, and what the whole weight on a foot adds to its leg's (N, 4).

    A joint holds up what hangs on it: the links' first moments beyond it, less the ground's force
    times the foot's place. Gravity in B is -g (-sin pitch, 0, cos pitch).
    """
    g, M, shank = GRAVITY, robot.mass, robot.geometry.shank
    aside, ahead = frame.cos_pitch, -frame.sin_pitch
    upward = legs.cos_abduction * aside
    leg_across, across = moments.leg_across, legs.across
    if frame.roll is not None:  # gravity has a part along B's y then
        s, c = frame.roll
        upward = (legs.cos_abduction * c - legs.sin_abduction * s) * aside
        leg_across = leg_across * c - moments.leg_height * s
        across = across * c - legs.height * s
    x, z = legs.foot
    knee_x, knee_z = legs.sin_shank * -shank, legs.cos_shank * -shank

    def pitch(px: Enclosure, pz: Enclosure) -> Enclosure:
        return pz * ahead - px * upward

    empty = (
        leg_across * aside * g,
        pitch(*moments.thigh) * g,
        pitch(*moments.shank) * g,
    )
    loaded = (
        across * aside * (-g * M),
        pitch(x, z) * (-g * M),
        pitch(knee_x, knee_z) * (-g * M),
    )
    return empty, loaded


def _choose(
    robot: RobotModel,
    shares: Enclosure,
    free: FloatArray,
    empty: tuple[Enclosure, ...],
    loaded: tuple[Enclosure, ...],
) -> FloatArray:
    """How much of `free` to add to the shares (N,), 0 where there is no freedom."""
    left = shares.centre - shares.radius  # what has to stay at least 0
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = -left / free
    low = np.where(free > 0.0, limit, -np.inf).max(axis=1)
    high = np.where(free < 0.0, limit, np.inf).min(axis=1)
    chosen = np.zeros(len(free))
    mine = np.any(free != 0.0, axis=1) & np.isfinite(low) & np.isfinite(high)
    if not np.any(mine):
        return chosen
    narrow = low[mine] > high[mine]
    middle = 0.5 * (low[mine] + high[mine])
    least, most = np.where(narrow, middle, low[mine]), np.where(narrow, middle, high[mine])
    tries = least[:, None] + (most - least)[:, None] * _CHOICES
    worst = np.zeros_like(tries)
    for j in range(3):
        for row in range(4):
            share = shares.centre[mine, row, None] + tries * free[mine, row, None]
            torque = empty[j].centre[mine, row, None] + loaded[j].centre[mine, row, None] * share
            worst = np.fmax(worst, np.abs(torque) / robot.effort[3 * row + j])
    best = np.argmin(worst, axis=1)
    chosen[mine] = tries[np.arange(len(tries)), best]
    return chosen
