"""Where the sides of a flight are in a depth image: how far aside of it the camera is.

The flight is taken to be endlessly wide. Pixels that show it then lie within its sides, and those
that show nothing, or something farther, beyond them. So each side is where the share of pixels that
show the flight falls from nearly all to nearly none.

Where the sides do not run along the climb, each step ends elsewhere: `step_ends` looks at each by
itself, over wider cells.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.pixel_tally import explain
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_profile import NOTHING, NUISANCES, OVERHANG, inverse_depth, meet
from drake_quad.perception.stair_tracker import CameraPose

ROWS = 3  # of so many rows of an image one is looked at
AROUND = 0.25  # [m] around where a side is expected, within which it is looked for
CELL = 0.005  # [m] across of the cells in which pixels are counted
AGREES = 0.06  # of an inverse depth, by which a pixel of the flight may be off
LEAST_PIXELS = 40  # inside of a side, and as many beyond it
BESIDE = 0.1  # [m] inside of a side and beyond it, where these have to be
SHARE = 0.7  # of the pixels inside that have to show the flight; beyond it so many may not
FARTHEST = 3.0  # [m] ahead
THICKNESS = 0.04  # [m] of treads over open risers
ONE_SIGMA = 0.008  # [m] deviation of one side: near surfaces seem to grow by up to 3 pixels
BOTH_SIGMA = 0.004  # [m] of the middle between two, which grow alike
WIDE_CELL = 0.08  # [m] across of the cells in which one step's end is looked for
WIDEST = 1.6  # [m] to each side, beyond which it is not looked for
STEP_AGREES = 0.1  # of an inverse depth, by which a pixel of a step may be off
STEP_ERROR = 0.03  # [1/m] by which it may be off in any case: 3 deviations of disparity
STEP_PIXELS = 12  # of a cell
GONE = 0.7  # of the pixels of a cell that have to show nothing, or something farther


@dataclass(frozen=True)
class FlightSides:
    """The sides that were seen.

    Attributes:
        right: The right side, across the climb from the camera, left positive [m]; nan if unseen.
        left: The left side.
        distance: How far ahead they were seen, in the mean [m].
    """

    right: float
    left: float
    distance: float

    @property
    def sigma(self) -> float:
        """Deviation of `off` [m]."""
        both = np.isfinite(self.right) and np.isfinite(self.left)
        return BOTH_SIGMA if both else ONE_SIGMA

    def off(self, expected: StairBelief) -> float:
        """How far to the left of where it is expected the flight is, by the sides seen [m]."""
        sides = np.array([self.right - expected.right, self.left - expected.left])
        return float(np.nanmean(sides))


@jit
def count_pixels(
    depth: FloatArray,
    rays: FloatArray,
    theta: FloatArray,
    shape: FloatArray,
    expected: FloatArray,
    counts: FloatArray,
) -> None:
    """Counts the pixels about each side of a flight, and those of them that show the flight.

    Args:
        depth: Distances along the optical axis [m] (rows, columns); 0 where there is none.
        rays: Rays of unit depth, x along the climb, y to the left, z up (rows, columns, 3).
        theta: The flight's parameters, see `stair_profile`.
        shape: Steps, up, open, thickness, last: see `stair_profile.meet`.
        expected: Where the right and the left side are expected (2,) [m].
        counts: Result: of each side and each of its cells pixels, those that show the flight,
            and the sum of their distances ahead (2, cells, 3).
    """
    n, cells = int(shape[0]), counts.shape[1]
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            c, across, z = rays[v, u, 0], rays[v, u, 1], rays[v, u, 2]
            if c <= 0.05:
                continue
            surface = meet(z / c, theta, n, shape[1], shape[2], shape[3], shape[4])
            if surface == NOTHING or surface == 0:  # the floor before it may be wider
                continue
            rho = inverse_depth(surface, c, z, theta, n)
            if rho <= 0.0 or c > FARTHEST * rho:
                continue
            lateral = across / rho
            for side in range(2):
                cell = int((lateral - expected[side] + AROUND) / CELL)
                if lateral - expected[side] < -AROUND or cell >= cells:
                    continue
                counts[side, cell, 0] += 1.0
                counts[side, cell, 2] += c / rho
                if depth[v, u] > 0.0 and abs(1.0 / depth[v, u] - rho) < AGREES * rho:
                    counts[side, cell, 1] += 1.0


def find_side(counts: FloatArray) -> float | None:
    """Where the flight ends among the cells from its inside outwards, in cells; None if unseen.

    Args:
        counts: Pixels, and those of them that show the flight, by cell (cells, 2).
    """
    gain = np.concatenate([[0.0], np.cumsum(counts[:, 1] - 0.5 * counts[:, 0])])
    best = np.flatnonzero(gain == gain.max())
    end, width = int(best[len(best) // 2]), round(BESIDE / CELL)
    inside = counts[max(end - width, 0) : end].sum(axis=0)
    beyond = counts[end : end + width].sum(axis=0)
    if min(inside[0], beyond[0]) < LEAST_PIXELS:
        return None
    if inside[1] < SHARE * inside[0] or beyond[1] > (1.0 - SHARE) * beyond[0]:
        return None
    return float(end)


def find_sides(
    depth: NDArray[np.floating],
    model: CameraModel,
    pose: CameraPose,
    seen: StairBelief,
    expected: StairBelief,
) -> FlightSides | None:
    """Looks for the sides of a flight that was found in an image.

    Args:
        depth: Distances along the optical axis [m], (height, width); 0 where there is none.
        model: Intrinsics.
        pose: Pose of the camera when it was taken.
        seen: The flight as the image shows it.
        expected: The same flight by the map, its sides across the climb from the camera.

    Returns:
        The sides; None if neither is in view.
    """
    theta, shape, rays, image = _flight_rays(depth, model, pose, seen)
    cells = round(2.0 * AROUND / CELL)
    counts = np.zeros((2, cells, 3))
    count_pixels(image, rays, theta, shape, np.array([expected.right, expected.left]), counts)
    right, left = find_side(counts[0, ::-1]), find_side(counts[1])
    if right is None and left is None:
        return None
    return FlightSides(
        np.nan if right is None else expected.right + AROUND - right * CELL,
        np.nan if left is None else expected.left - AROUND + left * CELL,
        float(counts[:, :, 2].sum() / counts[:, :, 0].sum()),
    )


def step_ends(
    depth: NDArray[np.floating], model: CameraModel, pose: CameraPose, seen: StairBelief
) -> FloatArray:
    """Where each step of a flight is seen to end, to the right and to the left of the climb.

    Args:
        depth: Distances along the optical axis [m], (height, width); 0 where there is none.
        model: Intrinsics.
        pose: Pose of the camera when the image was taken.
        seen: The flight as the image shows it.

    Returns:
        The right and the left end of each step, as a belief's `right` and `left`, (n, 2) [m];
        infinite where none is seen, because the image ends before, or something stands before it.
    """
    n = len(seen.places)
    theta, shape, rays, image = _flight_rays(depth, model, pose, seen)
    rays, image = rays.reshape(-1, 3), image.ravel()
    surface, rho = np.empty(len(rays)), np.empty(len(rays))
    explain(rays, theta, shape, surface, rho)
    known = image > 0.0
    measured = np.divide(1.0, image, out=np.zeros_like(image), where=known)
    allowed = np.maximum(STEP_AGREES * rho, STEP_ERROR)
    mine = (surface >= 3) & (rho > 0.0) & (measured < rho + allowed)
    lateral = rays[mine, 1] / rho[mine]
    step = surface[mine].astype(int) // 3 - 1  # a riser is the step's that it leads to
    gone = measured[mine] < (rho - allowed)[mine]
    cells = round(WIDEST / WIDE_CELL)
    within = np.abs(lateral) < WIDEST
    cell = np.minimum((np.abs(lateral[within]) / WIDE_CELL).astype(int), cells - 1)
    at = (step[within], (lateral[within] > 0.0).astype(int), cell)
    counts = np.zeros((2, n, 2, cells))
    np.add.at(counts[0], at, 1.0)
    np.add.at(counts[1], at, gone[within])
    ended = (counts[0] >= STEP_PIXELS) & (counts[1] >= GONE * counts[0])
    ended[..., :-1] &= ended[..., 1:] | (counts[0, ..., 1:] < STEP_PIXELS)  # a hole is no end
    first = np.where(ended.any(axis=-1), ended.argmax(axis=-1) * WIDE_CELL, np.inf)
    return np.asarray(first * np.array([-1.0, 1.0]))


def _flight_rays(
    depth: NDArray[np.floating], model: CameraModel, pose: CameraPose, seen: StairBelief
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A flight's parameters and shape, and rays along its climb with the depths of their pixels."""
    n = len(seen.places)
    theta = np.zeros(2 * n + 1 + NUISANCES)
    theta[:n], theta[n : 2 * n + 1] = seen.places, seen.heights - pose.p_WC[2]
    theta[2 * n + 1 + OVERHANG] = seen.overhang
    shape = np.array(
        [n, float(seen.going_up), float(seen.is_open), THICKNESS, 0.85 * abs(seen.run)]
    )
    c, s = seen.direction
    R_SC = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ pose.R_WC
    some = slice(ROWS // 2, None, ROWS)
    rays = np.ascontiguousarray(model.rays()[some] @ R_SC.T)
    return theta, shape, rays, np.ascontiguousarray(depth[some], dtype=np.float64)
