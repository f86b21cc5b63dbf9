"""Where to begin: attitudes, yaws, floors and even stairs that points of an image speak for."""

from math import floor
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.depth_frame import DepthFrame
from drake_quad.perception.stair_fit import StairPriors

LEVEL_KNOWN = float(np.radians(0.5))  # an attitude known so well is not looked for


class ProfilePoints(NamedTuple):
    """Points from the side.

    Attributes:
        s: Places along the climb (k,) [m].
        h: Heights (k,) [m].
        tolerance: Distance from the profile that costs 1, as any farther one does (k,) [m].
    """

    s: FloatArray
    h: FloatArray
    tolerance: FloatArray


class StairGrid(NamedTuple):
    """Even stairs that are tried.

    Attributes:
        firsts: Places of the first nosing (f,) [m].
        rises: (r,) [m].
        runs: (q,) [m].
    """

    firsts: FloatArray
    rises: FloatArray
    runs: FloatArray


@jit
def score_profile(
    points: ProfilePoints,
    floor_height: float,
    way: float,
    grid: StairGrid,
    steps: int,
    costs: FloatArray,
) -> None:
    """Writes the cost of points against even stairs over a grid.

    Args:
        points: The points.
        floor_height: Height of the floor [m].
        way: 1 for up, -1 for down.
        grid: The stairs.
        steps: How many are looked at.
        costs: Receives mean costs, (f, r, q).
    """
    s, h, tolerance = points
    firsts, rises, runs = grid
    for f in range(firsts.shape[0]):
        for r in range(rises.shape[0]):
            for q in range(runs.shape[0]):
                rise, run, total = way * rises[r], runs[q], 0.0
                for k in range(s.shape[0]):
                    x = (s[k] - firsts[f]) / run
                    i = floor(x) + 1
                    cost = 1.0
                    i = max(i, 0)
                    if i <= steps:
                        d = (h[k] - floor_height - i * rise) / tolerance[k]
                        cost = min(1.0, d * d)
                    if way > 0.0:
                        j = floor(x + 0.5)
                        y = (h[k] - floor_height) / rise - j
                        if j >= 0 and j < steps and y > 0.0 and y < 1.0:
                            d = (x - j) * run / tolerance[k]
                            cost = min(cost, d * d)
                    total += cost
                costs[f, r, q] = total / s.shape[0]


def _correlate(
    values: FloatArray, weights: FloatArray, *, axis: int = -1, mode: str = "reflect"
) -> FloatArray:
    # Loaded at its first use: most runs have no camera, and need not wait for scipy.ndimage.
    found: FloatArray = scipy.ndimage.correlate1d(values, weights, axis=axis, mode=mode)
    return found


def surface_normals(frame: DepthFrame) -> tuple[FloatArray, NDArray[np.int64]]:
    """Normals of local planes of 5 by 5 pixels, in L, and the places of their pixels in `index`.

    In inverse depth a plane is linear in the pixel's place, so its normal comes of two slopes.
    """
    model = frame.model
    flat = np.zeros(model.height * model.width)
    flat[frame.index] = frame.rho
    image = flat.reshape(model.height, model.width)
    whole = _correlate(
        _correlate((image > 0).astype(float), np.ones(5), axis=0), np.ones(5), axis=1
    )
    slope, mean = np.arange(-2.0, 3.0) / 10.0, np.ones(5) / 5.0
    a = _correlate(_correlate(image, slope, axis=1), mean, axis=0).ravel()[frame.index]
    b = _correlate(_correlate(image, slope, axis=0), mean, axis=1).ravel()[frame.index]
    rho = _correlate(_correlate(image, mean, axis=0), mean, axis=1).ravel()[frame.index]
    u, v = frame.index % model.width, frame.index // model.width
    normal = np.stack(
        [a * model.fx, b * model.fy, rho - a * (u - model.cx) - b * (v - model.cy)], axis=-1
    )
    # rays = R (x, y, 1): R comes back from the rays of three pixels
    camera = model.rays().reshape(-1, 3)[frame.index]
    R_T, *_ = np.linalg.lstsq(camera, frame.rays, rcond=None)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    good = np.flatnonzero((whole.ravel()[frame.index] > 24.5) & (length[:, 0] > 1e-9))
    return np.asarray((normal[good] / length[good]) @ R_T), good


def candidate_levels(frame: DepthFrame) -> list[tuple[float, float]]:
    """Errors of the camera's attitude, roll and pitch [rad], that level surfaces speak for.

    The attitude as it is believed to be comes first. If it is known badly, a tread 2 m away would
    be a step off, and no even stairs would fit. Then the normals of most local planes that may be
    level tell what level is: the mode of those that lie within three deviations of upright.
    """
    found = [(0.0, 0.0)]
    if frame.tilt <= LEVEL_KNOWN:
        return found
    normals, _ = surface_normals(frame)
    down = -normals[:, 2]
    near = np.abs(down) > np.cos(3.0 * frame.tilt + np.radians(2.0))
    if np.count_nonzero(near) < 30:
        return found
    lean = normals[near, :2] / -normals[near, 2:]  # of what would be (0, 0, -1)
    centre = np.median(lean, axis=0)
    for reach in np.radians([8.0, 4.0, 3.0, 2.0, 2.0, 2.0]):  # mean shift, to the mode
        inside = np.linalg.norm(lean - centre, axis=1) < reach
        if np.count_nonzero(inside) < 20:
            break
        centre = lean[inside].mean(axis=0)
    # Turned by (roll, pitch, 0), (lean x, lean y, -1) is upright.
    found.append((float(-centre[1]), float(centre[0])))
    return found


def candidate_yaws(frame: DepthFrame) -> list[float]:
    """The few yaws [rad] that upright surfaces, and rows of silhouette edges, speak for."""
    normals, _ = surface_normals(frame)
    found: list[float] = [0.0]
    upright = np.abs(normals[:, 2]) < 0.35
    bins = np.radians(np.arange(-50.0, 51.0, 2.0))
    if np.count_nonzero(upright) > 30:
        azimuth = np.arctan2(normals[upright, 1], normals[upright, 0])
        votes, _ = np.histogram(azimuth, bins)
        found += _peaks(votes.astype(float), bins, 3)
    if len(frame.edges) > 10:
        points = frame.edges / frame.edge_rho[:, np.newaxis]
        centres = 0.5 * (bins[1:] + bins[:-1])
        votes = np.zeros(len(centres))
        for i, yaw in enumerate(centres):
            s = points[:, 0] * np.cos(yaw) + points[:, 1] * np.sin(yaw)
            counts, _ = np.histogram(s, np.arange(0.0, 4.0, 0.02))
            votes[i] = float((counts.astype(float) ** 2).sum())
        found += _peaks(votes, bins, 2)
    apart: list[float] = []
    for yaw in found[1:] + found[:1]:
        if all(abs(yaw - other) > np.radians(3.0) for other in apart):
            apart.append(yaw)
    return apart


def _peaks(votes: FloatArray, bins: FloatArray, most: int) -> list[float]:
    smooth = _correlate(votes, np.array([0.5, 1.0, 0.5]), mode="constant")
    centres = 0.5 * (bins[1:] + bins[:-1])
    found: list[float] = []
    for i in np.argsort(-smooth, kind="stable"):
        if smooth[i] <= 0.15 * smooth.max() or len(found) == most:
            break
        if all(abs(centres[i] - c) > np.radians(6.0) for c in found):
            window = slice(max(0, i - 2), i + 3)
            weight = votes[window]
            found.append(float((weight * centres[window]).sum() / max(weight.sum(), 1e-9)))
    return found


def candidate_floors(frame: DepthFrame, priors: StairPriors) -> list[float]:
    """Heights of the floor over the camera [m] that are worth a try."""
    mean, sigma = priors.floor
    if sigma < 0.05:
        return [mean]
    normals, good = surface_normals(frame)
    flat = np.abs(normals[:, 2]) > 0.9
    heights = frame.points[good[flat], 2]
    if len(heights) < 20:
        return []
    bins = np.arange(-2.5, 0.5, 0.02)
    votes, _ = np.histogram(heights, bins)
    smooth = _correlate(votes.astype(float), np.ones(3), mode="constant")
    centres = 0.5 * (bins[1:] + bins[:-1])
    found: list[float] = []
    for i in np.argsort(-smooth, kind="stable"):
        if smooth[i] < max(12.0, 0.02 * len(heights)) or len(found) == 6:
            break
        if all(abs(centres[i] - c) > 0.05 for c in found):
            found.append(float(centres[i]))
    return found
