"""The paper's swing leg on stairs (Fig. 5): two risers under one swing."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait.swing import Swing, paper_swing
from drake_quad.math.quintic import quintic_inverse
from drake_quad.report.paper_study import TABLE_I


@dataclass(frozen=True, eq=False)
class StairSwing:
    """A swing over two risers, from and to the middle of a tread.

    Attributes:
        swing: Equations (1) to (3), of a point foot.
        nosings: (2, 2) rows (x, z) of the two nosings passed, in order [m].
        chosen: Which of the two is d_s, h_s of the equations.
    """

    swing: Swing
    nosings: FloatArray
    chosen: int

    @property
    def heights(self) -> FloatArray:
        """(2,) height of the foot over each nosing as it passes [m]; negative is through it."""
        x_f = self.swing.p_end[0]
        times = [self.swing.duration * quintic_inverse(x / x_f) for x in self.nosings[:, 0]]
        return np.asarray(self.swing.positions(times)[:, 2] - self.nosings[:, 1])

    @property
    def nearest(self) -> float:
        """Least distance of the foot's path from a nosing [m]."""
        path = self.swing.positions(np.linspace(0.0, self.swing.duration, 4001))[:, [0, 2]]
        apart = np.linalg.norm(path[:, None] - self.nosings, axis=-1)
        return float(apart.min())


def stair_swing(*, going: int, chosen: int) -> StairSwing:
    """Returns the swing with Table I's values.

    Args:
        going: +1 up, -1 down.
        chosen: The riser that d_s and h_s belong to: 0 the first, 1 the last.
    """
    W, H = TABLE_I.W, TABLE_I.H
    z = np.array([1.0, 2.0]) if going > 0 else np.array([0.0, -1.0])
    nosings = np.column_stack([[0.5 * W, 1.5 * W], H * z])
    swing = paper_swing(
        x_f=2.0 * W,
        z_f=2.0 * H * going,
        duration=TABLE_I.swing_time,
        d_s=float(nosings[chosen, 0]),
        h_s=float(nosings[chosen, 1]),
        delta_h=TABLE_I.delta_h,
    )
    return StairSwing(swing, nosings, chosen)
