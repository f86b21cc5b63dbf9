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
        t = np.clip(times, self.times[0], self.times[-1])
        index = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        slope = np.diff(self.offset, axis=0) / np.diff(self.times)[:, None, None]
        found = slope[index] * (t - self.times[index])[:, None, None] + self.offset[index]
        found[t == self.times[-1]] = self.offset[-1]
        return np.asarray(found)
