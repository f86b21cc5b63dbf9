"""Cells: stretches of a plan's pieces, with their polynomials about the middle of each."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from drake_quad.certificate.enclosure import UNIT, Enclosure
from drake_quad.certificate.pieces import IntArray, Pieces
from drake_quad.certificate.polynomials import compose
from drake_quad.gait.legs import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Cells:
    """N stretches of pieces, with their polynomials in tau, which runs from -1 to 1 in each.

    Attributes:
        piece: Which piece (N,).
        low: Where it begins in its piece, in w (N,).
        high: Where it ends (N,).
        half: Half its length (N,) [s].
        middle: Its middle in its task's time (N,) [s].
        body: Coefficients (N, 5, BODY).
        foot: Coefficients (N, 3, FOOT).
    """

    piece: IntArray
    low: FloatArray
    high: FloatArray
    half: FloatArray
    middle: FloatArray
    body: FloatArray
    foot: FloatArray

    def body_enclosure(self, k: int) -> Enclosure:
        """The k-th of x, y, z, pitch, yaw, (N, 1)."""
        return self._enclose(self.body[:, k])

    def feet_enclosure(self, pieces: Pieces, axis: int) -> Enclosure:
        """One coordinate of all four feet, (N, 4)."""
        swing = np.arange(4) == pieces.swing[self.piece][:, None]
        moving = self._enclose(self.foot[:, axis])
        place, rate = pieces.feet[self.piece][:, :, axis], np.zeros((len(self.piece), 4))
        if axis < 2:
            on, lasts = pieces.roll[self.piece][:, :, axis], pieces.end - pieces.start
            place = place + 0.5 * (self.low + self.high)[:, None] * on
            rate = on / lasts[self.piece][:, None]
        pad = 8.0 * UNIT * (1.0 + np.abs(place))
        return Enclosure(
            np.where(swing, moving.centre, place),
            np.where(swing, moving.error, pad),
            np.where(swing, moving.radius, pad + np.abs(rate) * moving.half),
            np.where(swing, moving.rate, rate),
            np.where(swing, moving.rate_radius, 8.0 * UNIT * np.abs(rate)),
            moving.half,
        )

    def standing_feet(self, pieces: Pieces) -> tuple[FloatArray, FloatArray]:
        """Where the feet are in the middle (N, 4, 2), and how far off they may be (N, 4) [m]."""
        on = pieces.roll[self.piece]
        middle = 0.5 * (self.low + self.high)[:, None, None]
        away = 0.5 * (self.high - self.low)[:, None] * np.linalg.norm(on, axis=-1)
        return pieces.feet[self.piece][..., :2] + middle * on, away

    def _enclose(self, powers: FloatArray) -> Enclosure:
        """Polynomials (N, n) in tau as enclosures (N, 1)."""
        size, degrees = np.abs(powers), np.arange(powers.shape[-1])
        pad = 64.0 * UNIT * (1.0 + size.sum(axis=-1))
        half = self.half
        radius = size[:, 1:].sum(axis=-1) + pad
        bend = (size[:, 2:] * degrees[2:]).sum(axis=-1) / half + pad / half
        columns = (powers[:, 0], pad, radius, powers[:, 1] / half, bend, half)
        return Enclosure(*(column[:, None] for column in columns))


T = TypeVar("T")


def pick(values: T, which: IntArray | BoolArray | slice) -> T:
    """Some of the cells, or of their bounds."""
    return type(values)(**{k: v[which] for k, v in vars(values).items()})


def join(parts: list[T]) -> T:
    """All of them as one."""
    return type(parts[0])(
        **{k: np.concatenate([vars(part)[k] for part in parts]) for k in vars(parts[0])}
    )


def make_cells(pieces: Pieces, piece: IntArray, low: FloatArray, high: FloatArray) -> Cells:
    """The stretches from `low` to `high` (N,), in w, of pieces `piece` (N,)."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    length = (pieces.end - pieces.start)[piece]
    return Cells(
        piece=piece,
        low=low,
        high=high,
        half=half * length,
        middle=pieces.start[piece] + middle * length,
        body=compose(pieces.body[piece], middle[:, None], half[:, None]),
        foot=compose(pieces.foot[piece], middle[:, None], half[:, None]),
    )
