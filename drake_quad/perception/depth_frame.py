"""A depth image made ready for stairs to be fitted: fewer pixels, inverse depths, silhouette edges.

Inverse depth is what a stereo camera measures with an error that is alike everywhere, and in it
every plane is linear in the pixel's place. A silhouette edge is where, going up a column, what
is near ends and something farther begins: a nosing against what lies behind it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import BoolArray, FloatArray
from drake_quad.jit import jit
from drake_quad.perception.camera_model import CameraModel

EDGE_REACH = 4  # rows over which an edge may be smeared by pixels that lie on neither side


@dataclass(frozen=True, kw_only=True)
class DepthAccuracy:
    """How well a camera's depths are believed to be known: 1 / z errs by sigma.

    Attributes:
        stereo: Deviation of 1 / z of a pixel, wherever it is [1/m]; of stereo cameras.
        depth: Deviation of z of a pixel, wherever it is [m]; of time-of-flight cameras.
        stereo_offset: Deviation of the offset of 1 / z that all pixels share [1/m].
        depth_offset: Deviation of the offset of z that all pixels share [m].
        tilt: Deviation of the camera's attitude about the level axes [rad].
        pattern: Deviation of the smooth pattern, in units of the offset that pixels share.
        pattern_share: Distance over which the pattern changes, of the image's longer side.
    """

    stereo: float = 0.0
    depth: float = 0.0
    stereo_offset: float = 0.0
    depth_offset: float = 0.0
    tilt: float = float(np.radians(0.25))
    pattern: float = 0.0
    pattern_share: float = 0.13


def stereo_accuracy(
    disparity_scale: float,
    *,
    noise: float = 0.08,
    offset: float = 0.1,
    pattern: float = 0.05,
    tilt: float = float(np.radians(0.25)),
) -> DepthAccuracy:
    """The accuracy of a stereo camera.

    Args:
        disparity_scale: f B [px m].
        noise: Deviation of a pixel's disparity [px].
        offset: Deviation of the offset of disparity that all pixels share [px].
        pattern: Deviation of the smooth pattern [px].
        tilt: Deviation of the camera's attitude about each axis [rad].
    """
    return DepthAccuracy(
        stereo=noise / disparity_scale,
        stereo_offset=offset / disparity_scale,
        pattern=pattern / disparity_scale,
        tilt=tilt,
    )


@dataclass(frozen=True)
class DepthFrame:
    """What is fitted of one image; vectors are in the level frame L as the camera's pose says.

    Attributes:
        rays: Rays of pixels with a depth, of unit depth, (n, 3).
        rho: Their inverse depths [1/m], (n,).
        sigma: Deviations of these [1/m], (n,).
        gain: What the shared offset adds to each, per unit of it, (n,).
        offset_sigma: Deviation of the shared offset.
        edges: Rays of silhouette edges, (m, 3).
        edge_rho: Inverse depths of their near sides [1/m], (m,).
        row_step: Change of a ray from one row to the next below, (3,).
        tilt: Deviation of the attitude about L's axes [rad].
        model: Intrinsics of the pixels that are fitted.
        index: Place of each pixel in that image, counted row by row, (n,).
        nodes: The pattern's node up and left of each pixel, and the shares of the next column and
            the next row, (n, 3).
        grid: Rows and columns of the pattern's nodes; (0, 0) for no pattern.
        pattern_sigma: Deviation of the pattern, in units of the shared offset.
    """

    rays: FloatArray
    rho: FloatArray
    sigma: FloatArray
    gain: FloatArray
    offset_sigma: float
    edges: FloatArray
    edge_rho: FloatArray
    row_step: FloatArray
    tilt: float
    model: CameraModel
    index: NDArray[np.int64]
    nodes: FloatArray
    grid: tuple[int, int]
    pattern_sigma: float

    @property
    def points(self) -> FloatArray:
        """The pixels' points in L [m], (n, 3)."""
        return np.asarray(self.rays / self.rho[:, np.newaxis])


@jit
def reduce_depth(depth: FloatArray, rho: FloatArray, near: float, far: float) -> None:
    """Writes the middle one of each block's inverse depths; 0 where fewer than half have one."""
    k = depth.shape[0] // rho.shape[0]
    values = np.empty(k * k)
    for i in range(rho.shape[0]):
        for j in range(rho.shape[1]):
            count = 0
            for a in range(k):
                for b in range(k):
                    z = depth[i * k + a, j * k + b]
                    if z >= near and z <= far:
                        x = 1.0 / z
                        at = count
                        while at > 0 and values[at - 1] > x:
                            values[at] = values[at - 1]
                            at -= 1
                        values[at] = x
                        count += 1
            if 2 * count < k * k or count == 0:
                rho[i, j] = 0.0
                continue
            middle = values[count // 2]
            if count % 2 == 0:  # between the two middle ones, unless an edge lies between them
                other = values[count // 2 - 1]
                if middle - other < 0.06 * middle:
                    middle = 0.5 * (middle + other)
            rho[i, j] = middle


@jit
def find_edges(
    depth: FloatArray, near: float, far: float, jump: float, step: int, found: FloatArray
) -> int:
    """Writes silhouette edges as rows (column, row, inverse depth of the near side).

    Args:
        depth: The image [m].
        near: Shortest distance that counts [m].
        far: Longest [m]; what is farther, or has no depth, is no far side.
        jump: Least difference of the inverse depths of both sides [1/m].
        step: Columns from one that is searched to the next.
        found: Receives the rows, (most, 3).

    Returns:
        How many there are. A row is counted at the border between the two sides.
    """
    count, rows = 0, depth.shape[0]
    for u in range(0, depth.shape[1], step):
        v = rows - 3
        while v > EDGE_REACH + 2 and count < found.shape[0]:
            z0, z1 = depth[v, u], depth[v + 1, u]
            if not (z0 >= near and z0 <= far and z1 >= near and z1 <= far):
                v -= 1
                continue
            near_side = 1.0 / z0
            # the surface goes on from the row below: the last pixel of it is v
            slope = near_side - 1.0 / z1
            if abs(slope) > 0.5 * jump:
                v -= 1
                continue
            at = -1
            for reach in range(1, EDGE_REACH + 1):
                za, zb = depth[v - reach, u], depth[v - reach - 1, u]
                if not (za >= near and za <= far and zb >= near and zb <= far):
                    continue
                if (
                    near_side + slope * reach - 1.0 / za > jump
                    and abs(1.0 / za - 1.0 / zb) < 0.5 * jump
                ):
                    at = reach
                    break
            next_z = depth[v - 1, u]
            goes_on = (
                next_z >= near and next_z <= far and near_side + slope - 1.0 / next_z < 0.3 * jump
            )
            if at > 0 and not goes_on:
                found[count, 0] = u
                found[count, 1] = v - 0.5 * at
                found[count, 2] = near_side
                count += 1
                v -= at
            v -= 1
    return count


NEAREST_DEPTH, FARTHEST_DEPTH = 0.15, 4.0  # [m] between which depths are used


def prepare_frame(
    depth: NDArray[np.floating],
    model: CameraModel,
    R_LC: FloatArray,
    accuracy: DepthAccuracy,
    *,
    rows: int = 120,
    nearest: float = NEAREST_DEPTH,
    farthest: float = FARTHEST_DEPTH,
) -> DepthFrame:
    """Makes an image ready.

    Args:
        depth: Distances along the optical axis [m], (height, width); 0, inf or nan where none.
        model: Intrinsics.
        R_LC: The camera's attitude in L, as it is believed to be.
        accuracy: How well depths are known.
        rows: About how many pixels of the shorter side are fitted: the image is made smaller by
            a whole factor.
        nearest: Shortest distance that is used [m].
        farthest: Longest distance that is used [m].
    """
    image = np.ascontiguousarray(depth, dtype=np.float64)
    factor = max(1, round(min(model.width, model.height) / rows))
    small = model.decimated(factor)
    rho = np.empty((small.height, small.width))
    reduce_depth(
        image[: small.height * factor, : small.width * factor].copy(), rho, nearest, farthest
    )
    rays = small.rays().reshape(-1, 3) @ R_LC.T
    flat = rho.ravel()
    index = np.flatnonzero(flat)
    kept = flat[index]
    sigma = np.hypot(accuracy.stereo, accuracy.depth * kept**2)
    if accuracy.stereo_offset > 0.0:
        gain, offset_sigma = np.ones_like(kept), accuracy.stereo_offset
    else:
        gain, offset_sigma = -(kept**2), max(accuracy.depth_offset, 1e-6)
    nodes, grid = _pattern_nodes(small, index, accuracy)
    typical = accuracy.stereo if accuracy.stereo > 0.0 else 4.0 * accuracy.depth
    found = np.empty((4096, 3))
    count = find_edges(image, nearest, farthest, max(0.06, 10.0 * typical), max(1, factor), found)
    u, v = found[:count, 0], found[:count, 1]
    edge_rays = np.stack(
        [(u - model.cx) / model.fx, (v - model.cy) / model.fy, np.ones(count)], axis=-1
    )
    return DepthFrame(
        rays=np.ascontiguousarray(rays[index]),
        rho=kept,
        sigma=sigma,
        gain=gain,
        offset_sigma=offset_sigma,
        edges=np.ascontiguousarray(edge_rays @ R_LC.T),
        edge_rho=np.ascontiguousarray(found[:count, 2]),
        row_step=R_LC[:, 1] / small.fy,
        tilt=accuracy.tilt,
        model=small,
        index=index,
        nodes=nodes,
        grid=grid,
        pattern_sigma=accuracy.pattern,
    )


def _pattern_nodes(
    model: CameraModel, index: NDArray[np.int64], accuracy: DepthAccuracy
) -> tuple[FloatArray, tuple[int, int]]:
    """Where pixels lie in the pattern's grid of nodes, between which it is bilinear."""
    if accuracy.pattern <= 0.0:
        return np.zeros((len(index), 3)), (0, 0)
    spacing = accuracy.pattern_share * max(model.width, model.height)
    rows, columns = int(model.height / spacing) + 2, int(model.width / spacing) + 2
    v, u = (index // model.width) / spacing, (index % model.width) / spacing
    i, j = np.floor(v), np.floor(u)
    return np.stack([i * columns + j, u - j, v - i], axis=-1), (rows, columns)


def keep_pixels(frame: DepthFrame, kept: BoolArray, edges: BoolArray | None = None) -> DepthFrame:
    """The frame with some of its pixels, and some of its edges, alone."""
    edge = np.ones(len(frame.edges), dtype=bool) if edges is None else edges
    return replace(
        frame,
        rays=np.ascontiguousarray(frame.rays[kept]),
        rho=frame.rho[kept],
        sigma=frame.sigma[kept],
        gain=frame.gain[kept],
        index=frame.index[kept],
        nodes=np.ascontiguousarray(frame.nodes[kept]),
        edges=np.ascontiguousarray(frame.edges[edge]),
        edge_rho=frame.edge_rho[edge],
    )
