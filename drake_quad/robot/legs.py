"""Leg ids, their order, and every table of legs, defined here once.

The numbering is the paper's: 1 front left, 2 front right, 3 rear left, 4 rear right. Arrays with
one row a leg are always in this order, so the row of a leg is `leg.row`.

Frames: B is the body frame at the body's centre, +x forward, +y left, +z up.
"""

from enum import IntEnum

import numpy as np

from drake_quad.common import FloatArray, read_only


class Leg(IntEnum):
    """A leg by the paper's number; `leg.short` is its name in logs and files."""

    FRONT_LEFT = 1
    FRONT_RIGHT = 2
    REAR_LEFT = 3
    REAR_RIGHT = 4

    @property
    def short(self) -> str:
        """Two letters: `FL`, `FR`, `RL` or `RR`."""
        return SHORT_NAMES[self.row]

    @property
    def row(self) -> int:
        """The leg's row in any array with one row a leg."""
        return int(self) - 1

    @property
    def mirrored(self) -> "Leg":
        """The leg on the other side (left/right)."""
        return Leg((2, 1, 4, 3)[self.row])

    @property
    def reversed(self) -> "Leg":
        """The leg at the other end of the same side (front/rear)."""
        return Leg((3, 4, 1, 2)[self.row])


SHORT_NAMES = ("FL", "FR", "RL", "RR")
LEGS: tuple[Leg, ...] = tuple(Leg)
WAVE_ORDER: tuple[Leg, ...] = (Leg(1), Leg(4), Leg(2), Leg(3))
DIAGONALS: tuple[tuple[Leg, ...], ...] = ((Leg(1), Leg(4)), (Leg(2), Leg(3)))
SPIN_ORDER_COUNTERCLOCKWISE: tuple[Leg, ...] = (Leg(1), Leg(3), Leg(4), Leg(2))
SPIN_ORDER_CLOCKWISE: tuple[Leg, ...] = (Leg(1), Leg(2), Leg(4), Leg(3))


# Signs of a leg's workspace centre in B: column 0 is x (front +), column 1 is y (left +).
SIGNS: FloatArray = read_only(np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]))
