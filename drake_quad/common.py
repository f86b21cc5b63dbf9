"""Array types and constants that every module needs and none should define again."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

GRAVITY = 9.81  # [m/s^2], as in Drake's plants

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.integer[Any]]
ByteArray = NDArray[np.uint8]


def read_only(array: FloatArray) -> FloatArray:
    """Returns a float copy of `array` that cannot be written to."""
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


# Plain floats, for the control loop: with three numbers they beat numpy's call overhead.
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # rows
