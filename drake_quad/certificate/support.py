"""The static margin, enclosed over stretches of time.

Standing feet do not move, so the margin is the least of functions linear in the centre of mass,
one a side of the support polygon.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.enclosure import Enclosure
from drake_quad.certificate.legs import Moments
from drake_quad.certificate.pieces import IntArray, Pieces
from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import support_polygon

SIDES = 4
NO_SIDE = 1e3  # [m] stands for the margin to a side that is not there


@dataclass(frozen=True, eq=False)
class Support:
    """What each contact phase's standing feet make of the centre of mass.

    Attributes:
        normal: Inward unit normals of the polygon's sides (phases, SIDES, 2).
        offset: Margin to a side: normal . com - offset (phases, SIDES) [m]; -NO_SIDE for none.
        share: Shares of the weight: share @ (1, com) (phases, 4, 3), the least ones by squares.
        free: By what shares may be changed without a change of their balance (phases, 4).
    """

    normal: FloatArray
    offset: FloatArray
    share: FloatArray
    free: FloatArray


def find_support(pieces: Pieces) -> Support:
    """The support of every contact phase of a mission."""
    phases = int(pieces.phase[-1]) + 1
    first = np.searchsorted(pieces.phase, np.arange(phases))
    feet, standing = pieces.feet[first], pieces.standing[first]
    normal, offset = np.zeros((phases, SIDES, 2)), np.full((phases, SIDES), -NO_SIDE)
    share, free = np.zeros((phases, 4, 3)), np.zeros((phases, 4))
    for k in range(phases):
        mine = standing[k]
        hull = support_polygon(feet[k, mine, :2])
        if len(hull) < 3:  # no polygon: the margin is nowhere positive
            offset[k] = NO_SIDE
            continue
        for i in range(len(hull)):
            a, along = hull[i], hull[(i + 1) % len(hull)] - hull[i]
            normal[k, i] = np.array([-along[1], along[0]]) / np.hypot(*along)
            offset[k, i] = normal[k, i] @ a
        balance = np.vstack([np.ones(mine.sum()), feet[k, mine, :2].T])
        share[k, mine] = np.linalg.pinv(balance)
        if mine.all():
            free[k] = np.linalg.svd(balance)[2][-1]
    return Support(normal, offset, share, free)


def enclose_margin(support: Support, phase: IntArray, moments: Moments) -> Enclosure:
    """The distances of the centre of mass from the lines through the polygon's sides (N, SIDES).

    The least of a row is the static margin where it is positive, and above it elsewhere: a
    positive bound is true of the margin either way.
    """
    normal = support.normal[phase]
    x, y = moments.com
    return x * normal[..., 0] + y * normal[..., 1] - support.offset[phase]
