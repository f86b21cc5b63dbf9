"""How far the ground is seen to be level beyond the last nosing: whether a flight ends there.

And whether it begins in the image: a fit tells of steps below it what is likely, not what is seen.

A count of steps is known from an image only where something is seen in the place of the next riser.
Here that is the ground itself, at the height of the last tread: strips across the climb are looked
at one after the other, until one has another height, or several have no pixels. (Rows of an image
that grazes the ground are farther apart than strips are.)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import CameraPose

STRIP = 0.05  # [m] of a strip along the climb
LEAST_PIXELS = 30  # of a strip
MOST_EMPTY = 4  # strips one after the other
OFF = 0.35  # of a rise, by which a strip's height may differ from the last tread's
MOST_OFF = 0.05  # [m]
MOST_SLOPE = float(np.tan(np.radians(1.2)))  # of what is level: of the camera's attitude, 4 sigma
BEGIN = 0.15  # [m] beyond the nosing: where that is told too near, nearer pixels are the riser's
INSET = 0.05  # [m] of the treads' sides that is left out
RUNS = 1.5  # a next riser would be seen within so many runs beyond the last nosing


class Level(NamedTuple):
    """What is seen beyond the last nosing.

    Attributes:
        length: How far it is level [m].
        ends_flight: Whether that is so far that a next riser would have been seen.
        below_view: How many nosings of the flight lie below the image, nearer than it shows.
    """

    length: float
    ends_flight: bool
    below_view: int = 0


def level_beyond(
    depth: NDArray[np.floating], model: CameraModel, pose: CameraPose, belief: StairBelief
) -> Level:
    """Looks how far the ground beyond the last nosing is level, and whether the first is in view.

    Args:
        depth: The image that the belief is of: distances along the optical axis [m], (height,
            width); 0 where there is none.
        model: Intrinsics.
        pose: Pose of the camera when it was taken.
        belief: The flight up that it shows.
    """
    along = belief.direction
    aside = np.array([-along[1], along[0]])
    known = depth > 0.0
    p_W = model.deproject(np.asarray(depth, dtype=float))[known] @ pose.R_WC.T + pose.p_WC
    flat = p_W[:, :2] - belief.origin
    s, lateral = flat @ along - float(belief.places[-1]), flat @ aside
    mine = (s > 0.0) & (lateral > belief.right + INSET) & (lateral < belief.left - INSET)
    length = _level_length(s[mine], p_W[mine, 2], belief)
    return Level(length, length >= RUNS * belief.run, steps_below_view(model, pose, belief))


def steps_below_view(model: CameraModel, pose: CameraPose, belief: StairBelief) -> int:
    """How many nosings of a flight lie below the image: what is told of them is a guess.

    Args:
        model: Intrinsics.
        pose: Pose of the camera when the image was taken.
        belief: The flight up that is told.
    """
    nosings = np.column_stack(
        [belief.origin + belief.places[:, np.newaxis] * belief.direction, belief.heights[1:]]
    )
    _, down, ahead = ((nosings - pose.p_WC) @ pose.R_WC).T
    row = model.cy + model.fy * down / np.maximum(ahead, 1e-6)
    return int(np.count_nonzero((ahead <= 0.0) | (row > model.height - 1)))


def _level_length(s: FloatArray, z: FloatArray, belief: StairBelief) -> float:
    """How far from the nosing points at `s` (n,) and heights `z` (n,) go on at its height [m]."""
    height, off = float(belief.heights[-1]), min(OFF * belief.rise, MOST_OFF)
    strip = (s / STRIP).astype(int)
    order = np.argsort(strip, kind="stable")
    strip, z = strip[order], z[order]
    k, length, empty = round(BEGIN / STRIP), 0.0, 0
    while empty <= MOST_EMPTY:
        first, past = np.searchsorted(strip, (k, k + 1))
        k += 1
        if past - first < LEAST_PIXELS:
            empty += 1
            continue
        allowed = off + MOST_SLOPE * (k - 0.5) * STRIP
        if abs(np.median(z[first:past]) - height) > allowed:
            break
        length, empty = k * STRIP, 0
    return length
