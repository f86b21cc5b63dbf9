"""The static margin, enclosed over stretches of time.

While feet do not move, the margin is the least of functions linear in the centre of mass, one a
side of the support polygon. Standing feet roll, evenly over a piece of the plan: by `away` at most
from where they are in the middle of a stretch. The margin is the least over directions of how far
the feet reach beyond the centre of mass, so that it is off by no more than that.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells
from drake_quad.certificate.enclosure import Enclosure, widen
from drake_quad.certificate.legs import Moments
from drake_quad.certificate.pieces import Pieces
from drake_quad.gait.legs import BoolArray, FloatArray

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
        free: By what shares may be changed without a change of their balance (N, 4).
        away: How far a standing foot may be from its place in the cell, at most (N,) [m].
    """

    normal: FloatArray
    offset: FloatArray
    share: FloatArray
    free: FloatArray
    away: FloatArray


def find_support(pieces: Pieces, cells: Cells) -> Support:
    """The support in every cell."""
    feet, away = cells.standing_feet(pieces)
    standing = pieces.standing[cells.piece]
    normal, offset = _sides(feet, standing)
    share, free = _shares(feet, standing)
    return Support(normal, offset, share, free, np.where(standing, away, 0.0).max(axis=1))


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
    return widen(still, away, away / still.half)
