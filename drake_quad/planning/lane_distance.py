"""How far points, and the lines that join them, are from the ground of a lane and its nosings."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.ground_distance import ground_distance
from drake_quad.planning.nosing_distance import nosing_distance
from drake_quad.terrain import Lane


def from_ground(lane: Lane, points: FloatArray) -> FloatArray:
    """Signed distance of points (..., 3) in W from a lane's ground [m], negative inside it.

    Along the lane and upwards; the ground goes on beyond the lane's ends.
    """
    s, z, ends, heights = _profile(lane, points)
    return ground_distance(s.ravel(), z.ravel(), ends, heights).reshape(s.shape)


def from_nosings(lane: Lane, points: FloatArray) -> FloatArray:
    """Signed distance of lines that join points (..., M, 3) in W from nosings (..., M - 1) [m]."""
    s, z, ends, heights = _profile(lane, points)
    rows = (-1, points.shape[-2])
    found = nosing_distance(s.reshape(rows), z.reshape(rows), ends, heights)
    return found.reshape(*s.shape[:-1], rows[1] - 1)


def _profile(
    lane: Lane, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Points along a lane and upwards, and its level stretches' ends and heights [m]."""
    s, _ = lane.coordinates(points[..., :2])
    ends = np.concatenate([[-np.inf], np.array(lane.breaks)[1:-1], [np.inf]])
    z = np.ascontiguousarray(points[..., 2])
    return np.ascontiguousarray(s), z, ends, np.array(lane.heights, dtype=float)
