"""Array types and constants that every module needs and none should define again.

The numbering is the paper's: 1 front left, 2 front right, 3 rear left, 4 rear right. Arrays with
one row a leg are always in this order, so the row of a leg is `leg.row`.

Frames: B is the body frame at the body's centre, +x forward, +y left, +z up.

With three numbers a leg, plain floats beat numpy's call overhead several times, and the loop runs
hundreds of times a second. The array versions define the leg; a test holds the two equal.
"""

import numpy as np
from numpy.typing import NDArray

# ------------------------------------------------------------------------------------------------
# How heavy things are.
# ------------------------------------------------------------------------------------------------


GRAVITY = 9.81  # [m/s^2], as in Drake's plants


# ------------------------------------------------------------------------------------------------
# Leg ids, their order, and every table of legs, defined here once.
# ------------------------------------------------------------------------------------------------


FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def read_only(array: FloatArray) -> FloatArray:
    """Returns a float copy of `array` that cannot be written to."""
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


# ------------------------------------------------------------------------------------------------
# The same leg as in `leg_kinematics`, one at a time in plain floats: for the control loop.
# ------------------------------------------------------------------------------------------------


Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # rows
