"""What a stereo camera gets wrong at edges: shadows, near sides that grow, pixels in between.

All of it is told in disparity, of which a slanted plane has no second difference: an edge is where
there is one.
"""

import math

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.jit import jit

EDGE_JUMP = 1.0  # [px] of disparity between the two sides of an edge
Mask = NDArray[np.uint8]


@jit
def mark_shadows(disparity: FloatArray, lost: Mask) -> None:
    """Marks pixels of the left imager that the right one does not see.

    Args:
        disparity: Disparity in pixels of this image, (height, width).
        lost: Receives 1 where a pixel is hidden, (height, width); others stay as they are.
    """
    for v in range(disparity.shape[0]):
        nearest = np.inf  # column of the right imager, of all that is farther right
        for u in range(disparity.shape[1] - 1, -1, -1):
            seen_at = u - disparity[v, u]
            if seen_at > nearest + 0.5:
                lost[v, u] = 1
            nearest = min(nearest, seen_at)


@jit
def mark_edges(disparity: FloatArray, reach: int, beside: Mask) -> None:
    """Marks pixels that lie at an edge or near one.

    Args:
        disparity: Disparity in pixels of the camera, (height, width).
        reach: How many rows and columns from an edge count as near it.
        beside: Zeros; receives 1 where a pixel is, (height, width).
    """
    rows, columns = disparity.shape
    for v in range(rows):
        for u in range(columns):
            middle = 2.0 * disparity[v, u]
            bent = 0.0
            if 0 < v < rows - 1:
                bent = abs(disparity[v - 1, u] + disparity[v + 1, u] - middle)
            if 0 < u < columns - 1:
                bent = max(bent, abs(disparity[v, u - 1] + disparity[v, u + 1] - middle))
            if bent > EDGE_JUMP:
                for i in range(max(0, v - reach), min(rows, v + reach + 1)):
                    for j in range(max(0, u - reach), min(columns, u + reach + 1)):
                        beside[i, j] = 1


@jit
def extremes(disparity: FloatArray, v: int, u: int, reach: int) -> tuple[float, float]:
    """The least and the greatest disparity around a pixel.

    Args:
        disparity: Disparity, (height, width).
        v: The pixel's row.
        u: Its column.
        reach: How many rows and columns from it are looked at.
    """
    least = greatest = disparity[v, u]
    for i in range(max(0, v - reach), min(disparity.shape[0], v + reach + 1)):
        for j in range(max(0, u - reach), min(disparity.shape[1], u + reach + 1)):
            least = min(least, disparity[i, j])
            greatest = max(greatest, disparity[i, j])
    return least, greatest


@jit
def between_nodes(field: FloatArray, skip: int, v: int, u: int) -> float:
    """A field's value at a pixel, bilinear between nodes that are `skip` pixels apart.

    Args:
        field: The values at the nodes, (rows, columns).
        skip: Pixels from one node to the next.
        v: The pixel's row.
        u: Its column.
    """
    i, j = v // skip, u // skip
    if skip == 1:
        return float(field[i, j])
    a, b = v / skip - i, u / skip - j
    above = (1.0 - b) * field[i, j] + b * field[i, j + 1]
    below = (1.0 - b) * field[i + 1, j] + b * field[i + 1, j + 1]
    return float((1.0 - a) * above + a * below)


@jit
def grow_near_sides(
    disparity: FloatArray, reach: float, field: FloatArray, skip: int, grown: FloatArray, lost: Mask
) -> None:
    """Moves edges outwards: what is near takes pixels of what is behind it.

    Args:
        disparity: Disparity in pixels of the camera, (height, width).
        reach: By how many pixels an edge moves at most.
        field: A field of unit deviation, which tells where edges move; see `between_nodes`.
        skip: Pixels from one of its nodes to the next.
        grown: Receives the disparities, (height, width).
        lost: Pixels that grow are not lost any more: receives 0 there, (height, width).
    """
    window = math.ceil(reach)
    chance = reach / window  # less than a pixel's growth happens to a share of an edge's pixels
    beside = np.zeros(disparity.shape, dtype=np.uint8)
    mark_edges(disparity, window, beside)
    for v in range(disparity.shape[0]):
        for u in range(disparity.shape[1]):
            grown[v, u] = disparity[v, u]
            if beside[v, u] == 0:
                continue
            greatest = extremes(disparity, v, u, window)[1]
            if greatest - disparity[v, u] <= EDGE_JUMP:
                continue
            share = 0.5 + 0.5 * between_nodes(field, skip, v, u)
            if min(max(share, 0.0), 1.0) < chance:
                grown[v, u] = greatest
                lost[v, u] = 0


@jit
def list_flying(disparity: FloatArray, rows: FloatArray) -> int:
    """Writes pixels at edges, which may lie on neither side, as rows (v, u, least, greatest).

    Args:
        disparity: Disparity in pixels of the camera, (height, width).
        rows: Receives a row for each, (height width, 4); the disparities are those of the two
            sides.

    Returns:
        How many there are.
    """
    beside = np.zeros(disparity.shape, dtype=np.uint8)
    mark_edges(disparity, 1, beside)
    count = 0
    for v in range(disparity.shape[0]):
        for u in range(disparity.shape[1]):
            if beside[v, u] == 0:
                continue
            least, greatest = extremes(disparity, v, u, 1)
            if greatest - least > EDGE_JUMP:
                rows[count, 0], rows[count, 1] = v, u
                rows[count, 2], rows[count, 3] = least, greatest
                count += 1
    return count
