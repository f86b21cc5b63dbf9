"""Encloses the clearances of feet and shanks from the course's obstacles.

A box is where nothing may be. A face is what a foot may not come near, although it steps onto the
box behind it: the part of a box's side that has no ground of its own height before it.

The distance from a convex obstacle is convex in the point, so it is nowhere below its tangent: with
n its gradient where the foot is in the middle of a stretch, distance(p) >= distance(p_m) +
n . (p - p_m). That is a quintic in time, and its least Bernstein coefficient is below it.

As for feet: with n the gradient of the distance where a part of a shank is nearest in the middle of
a stretch, distance(p) >= distance(p_m) + n . (p - p_m). That is linear along the part, so that the
lesser bound of its two ends is below all of it.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import FOOT, Cells, Pieces
from drake_quad.certificate.enclosure import bernstein
from drake_quad.certificate.ground import GroundBelow, TiedHeights
from drake_quad.certificate.kinematics import Chain, Points
from drake_quad.certificate.obstacles import CAP, LEVEL, Obstacles
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.common import BoolArray, FloatArray, IntArray

TILTED = 5e-3  # [m] from a slope within which a foot stands on it: its sphere dips into it


_BERNSTEIN = bernstein(FOOT - 1)


@dataclass(frozen=True, eq=False)
class SwingRule:
    """What a swing owes each obstacle: of K pairs of a swing and an obstacle.

    Attributes:
        own: Boxes that it steps from or onto, or that are level with those (K,).
        least: Least distance from those (K,) [m]: 0, or as deep as it stands in a slope.
        half: Half the distance that its two footholds have from the rest (K,) [m]: in a swing
            the foot need not be farther from it.
        edge: Faces that end at the level of one of its footholds (K,).
    """

    own: BoolArray
    edge: BoolArray
    least: FloatArray
    half: FloatArray


@dataclass(frozen=True, eq=False)
class Footholds:
    """Where swings begin and end; what they owe is found when it is asked for.

    A table of all phases and obstacles would grow with the square of a course's length.

    Attributes:
        ends: The foot's centre at lift-off and at touchdown of each contact phase (2, phases, 3)
            in W [m]; of those without a swing it means nothing.
        obstacles: The course.
        radius: Radius of the feet [m].
    """

    ends: FloatArray
    obstacles: Obstacles
    radius: float

    def owed(self, phase: IntArray, which: IntArray) -> SwingRule:
        """The rule for pairs of a phase (K,) and an obstacle (K,)."""
        obstacles, count = self.obstacles, len(self.obstacles.top)
        keys, of = np.unique(phase * count + which, return_inverse=True)
        phase, which = np.divmod(keys, count)
        stands = np.zeros(len(keys), dtype=np.bool_)
        least = np.full(len(keys), np.inf)
        for ends in self.ends[:, phase]:
            distance = obstacles.distance(ends, which)[0] - self.radius
            level = np.abs(ends[:, 2] - self.radius - obstacles.top[which]) <= LEVEL
            tilted = obstacles.axes[which, 2, 2] < 1.0
            stands |= np.where(tilted, distance <= TILTED, level)
            least = np.minimum(least, distance)
        face = obstacles.face[which]
        deepest = np.minimum(least, 0.0)
        return SwingRule(
            own=(stands & ~face)[of], edge=(stands & face)[of], least=deepest[of],
            half=(0.5 * least)[of],
        )  # fmt: skip


def find_footholds(pieces: Pieces, obstacles: Obstacles, radius: float) -> Footholds:
    """The footholds of every contact phase."""
    phases = int(pieces.phase[-1]) + 1
    first = np.searchsorted(pieces.phase, np.arange(phases))
    leg = np.maximum(pieces.swing[first], 0)
    ends = np.stack([pieces.feet[first, leg], pieces.landing[first]])
    return Footholds(ends, obstacles, radius)


@dataclass(frozen=True, eq=False)
class FootClearance:
    """Clearances of the swing feet, one of each cell (N,) [m].

    Attributes:
        low: Lower bound of the clearance from obstacles that the foot passes; CAP where it passes
            none.
        sample: Clearance in the middle of the cell.
        ground_low: Lower bound of the excess clearance above the foot's own footholds.
        ground_sample: Excess clearance in the middle of the cell.
        obstacle: The obstacle that `low` is about.
    """

    low: FloatArray
    sample: FloatArray
    ground_low: FloatArray
    ground_sample: FloatArray
    obstacle: IntArray


def enclose_foot_clearance(
    pieces: Pieces,
    cells: Cells,
    obstacles: Obstacles,
    footholds: Footholds,
    radius: float,
    within: Tolerances = NONE,
) -> FootClearance:
    """The clearance of the swing feet's spheres over each cell.

    Args:
        pieces: The plan.
        cells: The cells (N,).
        obstacles: The course.
        footholds: Where the swings begin and end.
        radius: Radius of the feet [m].
        within: How far feet and course may be off. What that takes is taken before it is asked what
            a foot owes, but for the edge of its own ground while the foot is above that: it may
            come down there sooner or later than planned.
    """
    count = len(cells.half)
    clearance = FootClearance(
        low=np.full(count, CAP),
        sample=np.full(count, CAP),
        ground_low=np.full(count, CAP),
        ground_sample=np.full(count, CAP),
        obstacle=np.zeros(count, dtype=int),
    )
    swinging = np.flatnonzero(pieces.swing[cells.piece] >= 0)
    at = cells.foot[swinging, :, 0]
    moves = np.abs(cells.foot[swinging, :, 1:]).sum(axis=(1, 2)) + radius + CAP
    grown = obstacles.off_by(within.run, within.rise)
    near, which = grown.may_be_near(at, moves)
    distance, normal = grown.distance(at[near], which)
    taken = within.swing + obstacles.distance(at[near], which)[0] - distance
    cell = swinging[near]
    powers = np.einsum("ki,kij->kj", normal, cells.foot[cell])
    powers[:, 0] = 0.0
    sample = distance - radius - within.swing
    low = sample + (powers @ _BERNSTEIN.T).min(axis=1)
    bottom = (cells.foot[:, 2] @ _BERNSTEIN.T).min(axis=1) - radius
    phase = pieces.phase[cells.piece[cell]]
    rule = footholds.owed(phase, which)
    own, deepest, half = rule.own, rule.least, rule.half
    np.minimum.at(clearance.ground_low, cell[own], (low - deepest)[own])
    np.minimum.at(clearance.ground_sample, cell[own], (sample - deepest)[own])
    above = rule.edge & (bottom[cell] >= obstacles.top[which] - LEVEL)
    owed = half - np.where(above, taken, 0.0)
    passed = np.where(sample < owed, sample, CAP)
    np.minimum.at(clearance.sample, cell[~own], passed[~own])
    bound = np.where(low < owed, low, CAP)
    np.minimum.at(clearance.low, cell[~own], bound[~own])
    worst = ~own & (bound <= clearance.low[cell])
    clearance.obstacle[cell[worst]] = which[worst]
    return clearance


_HALVINGS = 24  # of a part of a shank, in search of its nearest point


@dataclass(frozen=True, eq=False)
class ShankClearance:
    """Of each cell (N,): a bound below over the cell, and a value in its middle [m]; the leg."""

    low: FloatArray
    sample: FloatArray
    leg: IntArray


def enclose_shank_clearance(
    cells: Cells,
    chain: Chain,
    obstacles: Obstacles,
    *,
    group: IntArray,
    best: FloatArray,
    tolerance: float,
    demand: float,
    ground: GroundBelow | None = None,
    run: float = 0.0,
    rise: float = 0.0,
) -> ShankClearance:
    """The clearance of all shanks over each cell, knees included.

    A shank is a chain of rounded parts, each as thick as the thicker of its ends.

    Nor can what is below a foot be higher than the foot: see `GroundBelow`.

    Args:
        cells: The cells (N,).
        chain: The shanks.
        obstacles: The course; faces do not count, for they are sides of boxes.
        group: Group of each cell (N,); the least clearance of a group is what matters.
        best: Least clearance known of each group [m]; made less where a smaller one is found.
        tolerance: How far below the least of the group bounds may be [m].
        demand: Demanded clearance [m]: bounds have to be good enough to show that it is met.
        ground: What each foot is on or above of; None if nothing is known of that.
        run: How far each box may be from its mapped place, along the ground [m].
        rise: How much higher or lower it may be [m]; feet in `chain` may be, too.
    """
    N, own = len(cells.half), len(obstacles.top)  # with `own` added, a foot's own ground
    if run > 0.0 or rise > 0.0:
        obstacles = obstacles.off_by(run, rise).with_others(obstacles.off_by(run, 0.0))
    clearance = ShankClearance(np.full(N, CAP), np.full(N, CAP), np.zeros(N, dtype=int))
    low_end, high_end, thick = chain.parts()
    parts = thick.shape[1]
    K, F = chain.points.centre[:, :, 0], chain.points.centre[:, :, 1]
    length = np.linalg.norm(F - K, axis=-1)
    moves = chain.moves()
    reach = np.where(np.isfinite(moves), moves + 0.5 * length, 10.0) + chain.thickest() + CAP
    boxes = np.flatnonzero(~obstacles.face[:own])
    middle = 0.5 * (K + F)
    row, which = obstacles.may_be_near(middle.reshape(-1, 3), reach.ravel(), boxes)
    cell, leg = np.divmod(row, middle.shape[1])
    which = boxes[which]
    distance, _ = obstacles.distance(middle[cell, leg], which)
    near = ~(distance >= reach[cell, leg])
    cell, leg, which = (np.repeat(v[near], parts) for v in (cell, leg, which))
    part = np.tile(np.arange(parts), int(near.sum()))
    ends = np.stack([low_end[leg, part], high_end[leg, part]])
    thick = thick[leg, part]
    below = np.zeros(len(thick), dtype=bool)
    if ground is not None and len(obstacles.top) > own:
        below = ground.box[cell, leg] == which
        which = np.where(below, which + own, which)
    here = np.einsum("eks,ksi->eki", ends, chain.points.centre[cell, leg])
    distance, _ = obstacles.distance(0.5 * (here[0] + here[1]), which)
    sample = distance - thick
    low = sample - 0.5 * np.linalg.norm(here[1] - here[0], axis=-1) - moves[cell, leg]
    low = low - np.where(below, rise, 0.0)
    low = np.where(np.isnan(low), -np.inf, low)
    np.minimum.at(best, group[cell], sample)
    wanted = np.maximum(best - tolerance, np.minimum(best, demand))
    fine = np.flatnonzero(low < np.minimum(wanted[group[cell]], CAP))
    points = chain.points.pick(cell[fine], leg[fine])
    heights = None
    if ground is not None:
        heights = ground.heights(cell[fine], leg[fine], rise).only(below[fine])
    low[fine], sample[fine] = _refine(
        points, ends[:, fine], obstacles, which[fine], thick[fine], heights
    )
    np.minimum.at(best, group[cell], sample)
    np.minimum.at(clearance.sample, cell, sample)
    np.minimum.at(clearance.low, cell, low)
    worst = low <= clearance.low[cell]
    clearance.leg[cell[worst]] = leg[worst]
    return clearance


def _refine(
    points: Points,
    ends: FloatArray,
    obstacles: Obstacles,
    which: IntArray,
    thick: FloatArray,
    heights: TiedHeights | None,
) -> tuple[FloatArray, FloatArray]:
    """Bounds and values of K parts of shanks from their nearest points in the middle of a cell."""
    here = np.einsum("eks,ksi->eki", ends, points.centre)
    way = here[1] - here[0]
    count = len(which)
    a, b = np.zeros(count), np.ones(count)
    for _ in range(_HALVINGS):  # convex along the part: the slope's sign says where the least is
        s = 0.5 * (a + b)
        _, normal = obstacles.distance(here[0] + s[:, None] * way, which)
        falls = np.einsum("ki,ki->k", normal, way) < 0.0
        a, b = np.where(falls, s, a), np.where(falls, b, s)
    low, sample = np.full(count, -np.inf), np.full(count, np.inf)
    for s in (a, b):
        distance, normal = obstacles.distance(here[0] + s[:, None] * way, which)
        bound = np.full(count, np.inf)
        still = distance.copy()
        for end, at in zip(ends, (0.0, 1.0), strict=True):
            leans = np.einsum("ki,ki->k", normal, way) * (at - s)
            tied = 0.0 if heights is None else heights.correction(points, end, normal)
            bound = np.minimum(bound, distance + leans - points.moves(end, normal) - tied)
            still = np.minimum(still, distance + leans - points.unsure(end, normal) - tied)
        low = np.fmax(low, bound - thick)
        sample = np.fmin(sample, still - thick)
    return low, sample
