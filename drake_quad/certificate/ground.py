"""What is below a foot: the box that it stands on, or that it is above of in a swing.

Where stairs are only known to be within tolerances, that box cannot be higher than the foot is: the
foot would stand on it. So its height and the foot's are not independent of each other.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.cells import Cells, Pieces
from drake_quad.certificate.kinematics import Points
from drake_quad.certificate.obstacles import ASIDE, LEVEL, Obstacles
from drake_quad.certificate.tolerances import Tolerances
from drake_quad.common import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class GroundBelow:
    """What is below the feet of N cells.

    Attributes:
        box: The box (N, 4); -1 where none is known to be.
        above: How high a foot may be above it over the cell, as planned; of a standing foot, how
            far it may dip into it (N, 4) [m].
        off: How much higher or lower than planned a foot may be in all (N, 4) [m].
    """

    box: IntArray
    above: FloatArray
    off: FloatArray

    def heights(self, cell: IntArray, leg: IntArray, rise: float) -> "TiedHeights":
        """Those of some feet (K,), where boxes may be higher or lower by `rise` [m]."""
        above, off = self.above[cell, leg], self.off[cell, leg]
        return TiedHeights(above, off, np.full(len(cell), rise))


@dataclass(frozen=True, eq=False)
class TiedHeights:
    """By how much K feet, and what is below them, may be higher than planned, both together.

    The foot is higher by u, the box by r: |u| is at most `off`, |r| at most `rise`, and as the foot
    is not in the box, u + `above` is at least r.

    Attributes:
        above: (K,) [m].
        off: (K,) [m].
        rise: (K,) [m]; 0 of feet whose box is not what is asked about.
    """

    above: FloatArray
    off: FloatArray
    rise: FloatArray

    def only(self, some: BoolArray) -> "TiedHeights":
        """The same, of which only `some` (K,) are tied."""
        return TiedHeights(self.above, self.off, np.where(some, self.rise, 0.0))

    def correction(self, points: Points, end: FloatArray, normal: FloatArray) -> FloatArray:
        """What is to be taken from a distance that knows nothing of the box's height [m].

        That distance was made less by all that the foot may be higher or lower, by itself.

        Args:
            points: Knee, foot and axis of the shanks; the foot's height is the last unknown.
            end: The point as a combination of these (K, 3).
            normal: The direction of the distance (K, 3).

        Returns:
            (K,) [m], negative where the distance is more than it was taken for.
        """
        tied = self.rise > 0.0
        moved = np.einsum("ks,ksi,ki->k", end, points.spread[..., -1], normal)
        by = np.divide(moved, self.off, out=np.zeros_like(moved), where=self.off > 0.0)
        up, off, g, rise = normal[:, 2], self.off, self.above, self.rise
        least = np.full(len(by), np.inf)
        # The least of a linear function is at a corner of the polygon in which u and r are.
        lowest = np.clip(g - off, -rise, rise)
        for u, r in (
            (off, rise), (off, -rise), (np.maximum(-off, rise - g), rise),
            (np.maximum(-off, -rise - g), -rise), (np.maximum(-off, lowest - g), lowest),
        ):  # fmt: skip
            least = np.minimum(least, by * u - up * r)
        return np.where(tied, -least - np.abs(moved), 0.0)


def find_ground(pieces: Pieces, obstacles: Obstacles, radius: float) -> IntArray:
    """The box that each foot is on, by pieces (P, 4); -1 of a foot in the air, or on a slope.

    A foot that may touch down later than planned is on it, too, although it does not bear.

    Args:
        pieces: The plan.
        obstacles: The course.
        radius: Radius of the feet [m].
    """
    ground = np.full(pieces.standing.shape, -1)
    piece, leg = np.nonzero(np.arange(4) != pieces.swing[:, None])
    lowest = pieces.feet[piece, leg] - [0.0, 0.0, radius]
    boxes = np.flatnonzero(~obstacles.face & (obstacles.axes[:, 2, 2] >= 1.0))
    point, which = obstacles.may_be_near(lowest, np.full(len(lowest), ASIDE), boxes)
    which = boxes[which]
    level = np.abs(lowest[point, 2] - obstacles.top[which]) <= LEVEL
    on = level & (obstacles.distance(lowest[point], which)[0] <= LEVEL)
    ground[piece[point[on]], leg[point[on]]] = which[on]
    return ground


def find_ground_below(
    pieces: Pieces,
    cells: Cells,
    obstacles: Obstacles,
    stands: IntArray,
    *,
    radius: float,
    within: Tolerances,
) -> GroundBelow:
    """The box below each foot, whatever within tolerances is the case.

    A swing foot is above a box if it is within its edges all over the cell, by as much as both may
    be off.

    Args:
        pieces: The plan.
        cells: The cells (N,).
        obstacles: The course, as mapped.
        stands: The box that each foot is on, by pieces (P, 4), see `find_ground`.
        radius: Radius of the feet [m].
        within: How far feet and boxes may be off.
    """
    box = np.array(stands[cells.piece])
    standing = pieces.standing[cells.piece]
    off = np.where(
        standing, within.foot + within.rise, max(within.swing, within.foot + within.rise)
    )
    above = np.full(box.shape, within.foot)
    aside = within.run + max(within.swing, within.foot)
    leg = pieces.swing[cells.piece]
    swinging = np.flatnonzero(leg >= 0)
    if not len(swinging):
        return GroundBelow(box, above, off)
    lowest = cells.foot[swinging, :, 0] - [0.0, 0.0, radius]
    moves = np.abs(cells.foot[swinging, :, 1:]).sum(axis=-1)  # along each axis of W
    boxes = np.flatnonzero(~obstacles.face & (obstacles.axes[:, 2, 2] >= 1.0))
    high = np.full(len(swinging), -np.inf)
    for k in boxes:
        axes = obstacles.axes[k]
        away = np.abs((lowest - obstacles.centre[k]) @ axes[:2].T) + moves @ np.abs(axes[:2]).T
        inside = np.all(away <= obstacles.half[k, :2] - aside, axis=1)
        over = (lowest[:, 2] >= obstacles.top[k] - LEVEL) & (obstacles.top[k] > high)
        mine = np.flatnonzero(inside & over)
        high[mine] = obstacles.top[k]
        box[swinging[mine], leg[swinging[mine]]] = k
        height = lowest[mine, 2] + moves[mine, 2] - obstacles.top[k]
        above[swinging[mine], leg[swinging[mine]]] = np.maximum(height, 0.0)
    return GroundBelow(box, above, off)
