"""How far standing feet have rolled from where they were set down, along a plan."""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import FloatArray


@dataclass(frozen=True, eq=False)
class FootRoll:
    """Displacements of the feet from where they were set down.

    Attributes:
        times: (N,) [s].
        offset: (N, 4, 2) in W [m], linear in between.
    """

    times: FloatArray
    offset: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """The displacements (M, 4, 2) [m] at `times` (M,) [s]."""
        flat = self.offset.reshape(len(self.times), 8)
        columns = [np.interp(times, self.times, flat[:, k]) for k in range(8)]
        return np.stack(columns, axis=-1).reshape(-1, 4, 2)
