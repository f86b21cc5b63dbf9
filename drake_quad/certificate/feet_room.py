"""Room between swing feet and the course, bounded over stretches of time.

The distance from a convex obstacle is convex in the point, so it is nowhere below its tangent: with
n its gradient where the foot is in the middle of a stretch, distance(p) >= distance(p_m) +
n . (p - p_m). That is a quintic in time, and its least Bernstein coefficient is below it.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells
from drake_quad.certificate.obstacles import CAP, LEVEL, MOST_PAIRS, Obstacles
from drake_quad.certificate.pieces import FOOT, IntArray, Pieces
from drake_quad.certificate.polynomials import bernstein
from drake_quad.gait.legs import BoolArray, FloatArray

TILTED = 5e-3  # [m] from a slope within which a foot stands on it: its sphere dips into it


_BERNSTEIN = bernstein(FOOT - 1)


@dataclass(frozen=True, eq=False)
class SwingRule:
    """What a swing owes each obstacle.

    Attributes:
        own: Boxes that it steps from or onto, or that are level with those (phases, M).
        floor: Least distance from those (phases, M) [m]: 0, or as deep as it stands in a slope.
        half: Half the distance that its two footholds have from the rest (phases, M) [m]: in a
            swing the foot need not be farther from it.
    """

    own: BoolArray
    floor: FloatArray
    half: FloatArray


def find_swing_rule(pieces: Pieces, obstacles: Obstacles, radius: float) -> SwingRule:
    """The rule of every contact phase; of those without a swing it means nothing."""
    phases, count = int(pieces.phase[-1]) + 1, len(obstacles.top)
    first = np.searchsorted(pieces.phase, np.arange(phases))
    leg = np.maximum(pieces.swing[first], 0)
    ends = np.stack([pieces.feet[first, leg], pieces.landing[first]])
    distance = _distances(ends.reshape(-1, 3), obstacles).reshape(2, phases, count) - radius
    level = np.abs(ends[..., 2:] - radius - obstacles.top) <= LEVEL
    tilted = obstacles.axes[:, 2, 2] < 1.0
    stands = np.where(tilted, distance <= TILTED, level)
    least = distance.min(axis=0)
    return SwingRule(
        own=stands.any(axis=0) & ~obstacles.face,
        floor=np.minimum(least, 0.0),
        half=0.5 * least,
    )


def _distances(points: FloatArray, obstacles: Obstacles) -> FloatArray:
    """Signed distances of points (K, 3) from all obstacles (K, M) [m]: some points at a time."""
    count = len(obstacles.top)
    size = max(1, MOST_PAIRS // count)
    found = np.empty((len(points), count))
    for first in range(0, len(points), size):
        some = points[first : first + size]
        which = np.tile(np.arange(count), len(some))
        distance = obstacles.distance(np.repeat(some, count, axis=0), which)[0]
        found[first : first + size] = distance.reshape(len(some), count)
    return found


@dataclass(frozen=True, eq=False)
class FeetRoom:
    """Of each cell (N,): bounds below over the cell, and values in its middle [m].

    Attributes:
        low: Of the swing foot's room to obstacles that it passes; CAP where there is none.
        sample: The same in the middle.
        ground_low: Of what it has over its own ground more than it needs.
        ground_sample: The same in the middle.
        obstacle: The obstacle that `low` is about.
    """

    low: FloatArray
    sample: FloatArray
    ground_low: FloatArray
    ground_sample: FloatArray
    obstacle: IntArray


def feet_room(
    pieces: Pieces, cells: Cells, obstacles: Obstacles, rule: SwingRule, radius: float
) -> FeetRoom:
    """The room of the swing feet's spheres over each cell."""
    count = len(cells.half)
    room = FeetRoom(
        low=np.full(count, CAP),
        sample=np.full(count, CAP),
        ground_low=np.full(count, CAP),
        ground_sample=np.full(count, CAP),
        obstacle=np.zeros(count, dtype=int),
    )
    swinging = np.flatnonzero(pieces.swing[cells.piece] >= 0)
    at = cells.foot[swinging, :, 0]
    moves = np.abs(cells.foot[swinging, :, 1:]).sum(axis=(1, 2)) + radius + CAP
    size = np.linalg.norm(obstacles.half, axis=1)
    apart = np.linalg.norm(at[:, None] - obstacles.centre, axis=-1) - size
    near, which = np.nonzero(apart < moves[:, None])
    distance, normal = obstacles.distance(at[near], which)
    cell = swinging[near]
    powers = np.einsum("ki,kij->kj", normal, cells.foot[cell])
    powers[:, 0] = 0.0
    sample = distance - radius
    low = sample + (powers @ _BERNSTEIN.T).min(axis=1)
    phase = pieces.phase[cells.piece[cell]]
    own, floor, half = rule.own[phase, which], rule.floor[phase, which], rule.half[phase, which]
    np.minimum.at(room.ground_low, cell[own], (low - floor)[own])
    np.minimum.at(room.ground_sample, cell[own], (sample - floor)[own])
    passed = np.where(sample < half, sample, CAP)
    np.minimum.at(room.sample, cell[~own], passed[~own])
    bound = np.where(low < half, low, CAP)
    np.minimum.at(room.low, cell[~own], bound[~own])
    worst = ~own & (bound <= room.low[cell])
    room.obstacle[cell[worst]] = which[worst]
    return room
