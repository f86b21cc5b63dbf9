"""Room between knees and shanks and the course, bounded over stretches of time.

As for feet: with n the gradient of the distance where a part of a shank is nearest in the middle of
a stretch, distance(p) >= distance(p_m) + n . (p - p_m). That is linear along the part, so that the
lesser bound of its two ends is below all of it.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells
from drake_quad.certificate.chain import Chain, Points
from drake_quad.certificate.obstacles import CAP, Obstacles
from drake_quad.certificate.pieces import IntArray
from drake_quad.gait.legs import FloatArray

_HALVINGS = 24  # of a part of a shank, in search of its nearest point


@dataclass(frozen=True, eq=False)
class ShankRoom:
    """Of each cell (N,): a bound below over the cell, and a value in its middle [m]; the leg."""

    low: FloatArray
    sample: FloatArray
    leg: IntArray


def shank_room(
    cells: Cells,
    chain: Chain,
    obstacles: Obstacles,
    *,
    group: IntArray,
    best: FloatArray,
    tolerance: float,
    demand: float,
) -> ShankRoom:
    """The room of all shanks over each cell, knees included.

    A shank is a chain of rounded parts, each as thick as the thicker of its ends.

    Args:
        cells: The cells (N,).
        chain: The shanks.
        obstacles: Of which the faces do not count: they are sides of boxes.
        group: A number of each cell (N,): how small the room of its group is, is what matters.
        best: The least room that is known of each group; made less where a smaller one is found.
        tolerance: Bounds need not be better than this below the least of the group [m],
        demand: unless this is asked for, and is in between [m].
    """
    N = len(cells.half)
    room = ShankRoom(np.full(N, CAP), np.full(N, CAP), np.zeros(N, dtype=int))
    low_end, high_end, thick = chain.parts()
    parts = thick.shape[1]
    K, F = chain.points.centre[:, :, 0], chain.points.centre[:, :, 1]
    length = np.linalg.norm(F - K, axis=-1)
    moves = chain.moves()
    reach = np.where(np.isfinite(moves), moves + 0.5 * length, 10.0) + chain.thickest() + CAP
    boxes = np.flatnonzero(~obstacles.face)
    middle = 0.5 * (K + F)
    size = np.linalg.norm(obstacles.half[boxes], axis=1)
    apart = np.linalg.norm(middle[:, :, None] - obstacles.centre[boxes], axis=-1) - size
    cell, leg, which = np.nonzero(apart < reach[..., None])
    which = boxes[which]
    distance, _ = obstacles.distance(middle[cell, leg], which)
    near = ~(distance >= reach[cell, leg])
    cell, leg, which = (np.repeat(v[near], parts) for v in (cell, leg, which))
    part = np.tile(np.arange(parts), int(near.sum()))
    ends = np.stack([low_end[leg, part], high_end[leg, part]])
    thick = thick[leg, part]
    here = np.einsum("eks,ksi->eki", ends, chain.points.centre[cell, leg])
    distance, _ = obstacles.distance(0.5 * (here[0] + here[1]), which)
    sample = distance - thick
    low = sample - 0.5 * np.linalg.norm(here[1] - here[0], axis=-1) - moves[cell, leg]
    low = np.where(np.isnan(low), -np.inf, low)
    np.minimum.at(best, group[cell], sample)
    wanted = np.maximum(best - tolerance, np.minimum(best, demand))
    fine = np.flatnonzero(low < np.minimum(wanted[group[cell]], CAP))
    points = chain.points.pick(cell[fine], leg[fine])
    low[fine], sample[fine] = _refine(
        points, ends[:, fine], obstacles, which[fine], cells.half[cell[fine]], thick[fine]
    )
    np.minimum.at(best, group[cell], sample)
    np.minimum.at(room.sample, cell, sample)
    np.minimum.at(room.low, cell, low)
    worst = low <= room.low[cell]
    room.leg[cell[worst]] = leg[worst]
    return room


def _refine(
    points: Points,
    ends: FloatArray,
    obstacles: Obstacles,
    which: IntArray,
    half: FloatArray,
    thick: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Bounds and values of K parts of shanks from their nearest points in the middle of a cell."""
    here = np.einsum("eks,ksi->eki", ends, points.centre)
    way = here[1] - here[0]
    a, b = np.zeros(len(half)), np.ones(len(half))
    for _ in range(_HALVINGS):  # convex along the part: the slope's sign says where the least is
        s = 0.5 * (a + b)
        _, normal = obstacles.distance(here[0] + s[:, None] * way, which)
        falls = np.einsum("ki,ki->k", normal, way) < 0.0
        a, b = np.where(falls, s, a), np.where(falls, b, s)
    low, sample = np.full(len(half), -np.inf), np.full(len(half), np.inf)
    for s in (a, b):
        distance, normal = obstacles.distance(here[0] + s[:, None] * way, which)
        bound = np.full(len(half), np.inf)
        for end, at in zip(ends, (0.0, 1.0), strict=True):
            leans = np.einsum("ki,ki->k", normal, way) * (at - s)
            bound = np.minimum(bound, distance + leans - points.moves(end, normal, half) - thick)
        low = np.fmax(low, bound)
        sample = np.minimum(sample, distance - thick)
    return low, sample
