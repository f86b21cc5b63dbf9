"""How far the ground is seen to be level beyond the last nosing: whether a flight ends there.

And whether it begins in the image: a fit tells of steps below it what is likely, not what is seen.

A count of steps is known from an image only where something is seen in the place of the next riser.
Here that is the ground itself, at the height of the last tread: strips across the climb are looked
at one after the other, until one has another height, or several have no pixels. (Rows of an image
that grazes the ground are farther apart than strips are.)

Treads are seen over a width that is the nearer one's. Ground beyond them is farther away, and a
camera sees more of it to the sides: so where a robot turns its width is looked at by itself. Near a
nosing the image is narrower than the flight. Then its sides are where the treads end to be seen.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.flight_sides import step_ends
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import CameraPose

STRIP = 0.05  # [m] of a strip along the climb
LEAST_PIXELS = 30  # of a strip
MOST_EMPTY = 4  # strips one after the other
OFF = 0.35  # of a rise, by which a strip's height may differ from the last tread's
MOST_OFF = 0.05  # [m]
MOST_TILT = float(np.radians(1.2))  # [rad] of what is level: of the camera's mounting, 4 sigma
TILTS = 4.0  # deviations of the robot's attitude, by which what is level may be tilted as well
# Where a nosing is told too near, or pixels are farther than they say (0.1 px at 4 m is 80 mm),
# pixels just beyond it are its riser's. A next riser would be a run beyond it.
BEGIN = 0.15  # [m] beyond the nosing, at least
BEGIN_RUNS = 0.5  # the same in runs
INSET = 0.05  # [m] of the treads' sides, and of the ground's to turn on, that is left out
RUNS = 1.5  # a next riser would be seen within so many runs beyond the last nosing
AROUND = 0.3  # [m] ahead of and behind the place to turn on, within which its width is looked at
WIDEST = 3.0  # [m] to each side, beyond which nobody looks
CELL = 0.1  # [m] of a side of the cells that are looked at there
FEW_PIXELS = 3  # of a cell
SHARE = 0.9  # of a row of cells, and of their pixels, that are to be level
MOST_UNSEEN = 1  # rows of cells one after the other
SIDE = 0.06  # [m] by which the side of what is seen of treads is known


class Level(NamedTuple):
    """What is seen beyond the last nosing.

    Attributes:
        length: How far it is level [m].
        ends_flight: Whether that is so far that a next riser would have been seen.
        below_view: How many nosings of the flight lie below the image, nearer than it shows.
        right: Where the ground to turn on is seen to be level, across the climb as a belief's
            `right` is: the right end [m].
        left: The left end [m]; both 0 where it is not seen.
        cut_right: Whether treads are seen as far to the right as the image shows the last nosing:
            then they may go on there.
        cut_left: The same to the left.
        ends: Where each step ends to the right and to the left, see `flight_sides.step_ends`,
            (n, 2) [m]; None if nobody has looked.
    """

    length: float
    ends_flight: bool
    below_view: int = 0
    right: float = 0.0
    left: float = 0.0
    cut_right: bool = False
    cut_left: bool = False
    ends: FloatArray | None = None


def turning_place(belief: StairBelief, landing: float) -> float:
    """How far beyond the last nosing a robot turns: in the middle of the landing that is told [m].

    A landing begins where the last tread ends.

    Args:
        belief: The flight.
        landing: How far the ground is level beyond the last nosing [m].
    """
    return 0.5 * (landing + belief.run)


def level_beyond(
    depth: NDArray[np.floating],
    model: CameraModel,
    pose: CameraPose,
    belief: StairBelief,
    *,
    landing: float,
) -> Level:
    """Looks how far the ground beyond the last nosing is level, and whether the first is in view.

    Args:
        depth: The image that the belief is of: distances along the optical axis [m], (height,
            width); 0 where there is none.
        model: Intrinsics.
        pose: Pose of the camera when it was taken, and how well its tilt is known.
        belief: The flight up that it shows.
        landing: How far the ground is told to be level beyond the last nosing [m].
    """
    along = belief.direction
    aside = np.array([-along[1], along[0]])
    known = depth > 0.0
    p_W = model.deproject(np.asarray(depth, dtype=float))[known] @ pose.R_WC.T + pose.p_WC
    flat = p_W[:, :2] - belief.origin
    s, lateral = flat @ along - float(belief.places[-1]), flat @ aside
    mine = (s > 0.0) & (lateral > belief.right + INSET) & (lateral < belief.left - INSET)
    slope = float(np.tan(np.hypot(MOST_TILT, TILTS * pose.tilt_sigma)))
    length = _level_length(s[mine], p_W[mine, 2], belief, slope)
    middle = turning_place(belief, landing)
    right, left = _level_sides(
        s, lateral, p_W[:, 2], belief, middle=middle, length=length, slope=slope
    )
    below_view = steps_below_view(model, pose, belief)
    image_right, image_left = image_sides(model, pose, belief)
    return Level(
        length, length >= RUNS * belief.run, below_view, right, left,
        cut_right=belief.right < image_right + SIDE, cut_left=belief.left > image_left - SIDE,
        ends=step_ends(depth, model, pose, belief),
    )  # fmt: skip


def image_sides(model: CameraModel, pose: CameraPose, belief: StairBelief) -> tuple[float, float]:
    """Where the image's sides cut the line of the last nosing, as a belief's `right` and `left`.

    Args:
        model: Intrinsics.
        pose: Pose of the camera when the image was taken.
        belief: The flight up that is told.

    Returns:
        The right and the left end [m]; infinite where that side does not cut the line.
    """
    middle = np.append(belief.origin + belief.places[-1] * belief.direction, belief.heights[-1])
    aside = np.array([-belief.direction[1], belief.direction[0], 0.0])
    (x, _, z), (x_by, _, z_by) = (middle - pose.p_WC) @ pose.R_WC, aside @ pose.R_WC
    ends = []
    for column, way in ((model.width - 1, -1.0), (0, 1.0)):
        slope = (column - model.cx) / model.fx
        closing = slope * z_by - x_by
        # A point `s` aside is at x + s x_by, z + s z_by; it is in view while x / z is within.
        leaves = closing > 0.0 and z > 0.0
        ends.append(float((x - slope * z) / closing) if leaves else way * np.inf)
    return ends[0], ends[1]


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


def _level_length(s: FloatArray, z: FloatArray, belief: StairBelief, slope: float) -> float:
    """How far from the nosing points at `s` (n,) and heights `z` (n,) go on at its height [m]."""
    height = float(belief.heights[-1])
    strip = (s / STRIP).astype(int)
    order = np.argsort(strip, kind="stable")
    strip, z = strip[order], z[order]
    k, length, empty = round(max(BEGIN, BEGIN_RUNS * belief.run) / STRIP), 0.0, 0
    while empty <= MOST_EMPTY:
        first, past = np.searchsorted(strip, (k, k + 1))
        k += 1
        if past - first < LEAST_PIXELS:
            empty += 1
            continue
        if abs(np.median(z[first:past]) - height) > _allowed((k - 0.5) * STRIP, belief, slope):
            break
        length, empty = k * STRIP, 0
    return length


def _allowed(s: float, belief: StairBelief, slope: float) -> float:
    """By how much level ground may be off the last tread's height, `s` beyond its nosing [m]."""
    return min(OFF * belief.rise, MOST_OFF) + slope * s


def _level_sides(
    s: FloatArray,
    lateral: FloatArray,
    z: FloatArray,
    belief: StairBelief,
    *,
    middle: float,
    length: float,
    slope: float,
) -> tuple[float, float]:
    """From where to where across the climb the ground about the place to turn on is level [m].

    Cells are looked at row by row, from the climb's line outwards, until one row is not level
    throughout, or two rows are not seen throughout. A hole of the image may take the pixels of a
    single row, so what is no wider than that and gives no depth is overlooked. What is beyond
    `length` nobody has seen.

    Args:
        s: How far beyond the last nosing points are, (n,) [m].
        lateral: How far to the left of the climb's line, (n,) [m].
        z: Their heights in W, (n,) [m].
        belief: The flight.
        middle: The place to turn on, beyond the last nosing [m].
        length: How far the ground is level [m].
        slope: By how much what is level may seem to slope.
    """
    begin, cells = middle - AROUND, int((min(middle + AROUND, length) - middle + AROUND) / CELL)
    if cells < 1:
        return 0.0, 0.0
    mine = (s >= begin) & (s < begin + cells * CELL) & (np.abs(lateral) < WIDEST)
    rows = 2 * round(WIDEST / CELL)
    row = np.minimum(((lateral[mine] + WIDEST) / CELL).astype(int), rows - 1)
    cell = np.minimum(((s[mine] - begin) / CELL).astype(int), cells - 1)
    off = np.abs(z[mine] - belief.heights[-1]) > _allowed(middle, belief, slope)
    every = np.zeros((rows, cells))
    wrong = np.zeros(rows)
    np.add.at(every, (row, cell), 1.0)
    np.add.at(wrong, row, off)
    seen = np.mean(every >= FEW_PIXELS, axis=1) >= SHARE
    level = wrong <= (1.0 - SHARE) * every.sum(axis=1)
    ends = [0, 0]
    for side, way in enumerate((range(rows // 2 - 1, -1, -1), range(rows // 2, rows))):
        for count, k in enumerate(way, start=1):
            if seen[k] and level[k]:
                ends[side] = count
            elif not level[k] or count > ends[side] + MOST_UNSEEN:
                break
    # A cell that the ground's edge divides may still count.
    right, left = (max(CELL * count - INSET, 0.0) for count in ends)
    return -right, left
