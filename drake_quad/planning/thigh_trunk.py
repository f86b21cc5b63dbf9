"""Clearance between thighs and the trunk.

A thigh's shapes are paths, and how thick they are around these. The clearance is asked for at every
moment of every path of the body that is tried: most shapes are far apart, which balls around the
paths show, and along a path that is near, places are left out that cannot be the nearest.
"""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.math.distance import (
    box_distance_of_path,
    point_to_box,
    point_to_rod,
    rod_distance_of_path,
)
from drake_quad.robot.model import RobotModel

CUTOFF = 0.02  # [m]; larger clearances are reported as this


def thigh_trunk_clearance(robot: RobotModel, q: FloatArray) -> FloatArray:
    """Between thighs and the trunk, at most CUTOFF, negative inside [m].

    Of the shapes of `ThighStops`: CUTOFF of a thigh that passes through the trunk in physics, as
    its file's shapes want it.

    Args:
        robot: The robot.
        q: (N, 4, 3) the joints' angles [rad].

    Returns:
        (N, 4) [m].
    """
    stops, g = robot.thigh_stops, robot.geometry
    if stops.empty:
        return np.full(q.shape[:2], CUTOFF)
    # Copies: kernels are compiled anew for arrays that are read-only.
    hips = np.column_stack([g.p_BH, g.offset, g.raised])
    paths, radii, boxes = (np.array(a, order="C") for a in (stops.paths, stops.radii, stops.boxes))
    rods = np.column_stack([stops.rods.mean(axis=1), _axes(stops.rods), stops.rod_radii])
    return _clearance(_turns(q), hips, paths, _lengths(paths), _balls(paths), radii, boxes, rods)


def _turns(q: FloatArray) -> FloatArray:
    """Cosine and sine of abduction, then of hip pitch (N, 4, 4), at angles (N, 4, 3) [rad]."""
    a, h = np.ascontiguousarray(q[..., 0]), np.ascontiguousarray(q[..., 1])
    return np.stack([np.cos(a), np.sin(a), np.cos(h), np.sin(h)], axis=-1)


def _lengths(paths: FloatArray) -> FloatArray:
    """Lengths of the lines of paths (4, S, K, 3), (4, S, K - 1) [m]."""
    return np.asarray(np.linalg.norm(np.diff(paths, axis=2), axis=-1))


def _balls(paths: FloatArray) -> FloatArray:
    """Centres of balls around paths (4, S, K, 3), then their radii, (4, S, 4) [m]."""
    centres = 0.5 * (paths.min(axis=2) + paths.max(axis=2))
    radii = np.linalg.norm(paths - centres[:, :, None], axis=-1).max(axis=2)
    return np.concatenate([centres, radii[..., None]], axis=-1)


def _axes(rods: FloatArray) -> FloatArray:
    """Unit vectors along cylinders (R, 2, 3), then half their lengths [m], (R, 4)."""
    along = rods[:, 1] - rods[:, 0]
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    return np.concatenate([along / length, 0.5 * length], axis=-1)


@jit
def _clearance(
    turns: FloatArray, hips: FloatArray, paths: FloatArray, lengths: FloatArray, balls: FloatArray,
    radii: FloatArray, boxes: FloatArray, rods: FloatArray,
) -> FloatArray:  # fmt: skip
    """See `thigh_trunk_clearance`.

    Args:
        turns: See `_turns`.
        hips: Places of the hips in B, then the legs' offset and how far the hip pitch axis is
            raised (4, 5) [m].
        paths: See ThighStops (4, S, K, 3) [m].
        lengths: See `_lengths`.
        balls: See `_balls`.
        radii: See ThighStops (4, S) [m].
        boxes: The trunk's boxes (B, 2, 3) [m].
        rods: Its cylinders, see `point_to_rod` (R, 8).
    """
    found = np.full(turns.shape[:2], CUTOFF)
    path, c = np.empty(paths.shape[2:]), np.empty(3)
    for n in range(turns.shape[0]):
        for leg in range(turns.shape[1]):
            turn, hip = turns[n, leg], hips[leg]
            for s in range(paths.shape[1]):
                far, way, placed = balls[leg, s, 3], lengths[leg, s], False
                bound = at_first = found[n, leg] + radii[leg, s]
                _turn(turn, hip, balls[leg, s], c)
                for k in range(len(boxes)):
                    lower, upper = boxes[k, 0], boxes[k, 1]
                    if point_to_box(c, lower, upper) - far < bound:
                        placed = placed or _place(turn, hip, paths[leg, s], path)
                        bound = box_distance_of_path(path, way, lower, upper, bound)
                for k in range(len(rods)):
                    if point_to_rod(c[0], c[1], c[2], rods[k]) - far < bound:
                        placed = placed or _place(turn, hip, paths[leg, s], path)
                        bound = rod_distance_of_path(path, way, rods[k], bound)
                if bound < at_first:
                    found[n, leg] = bound - radii[leg, s]
    return found


@jit
def _place(turn: FloatArray, hip: FloatArray, points: FloatArray, found: FloatArray) -> bool:
    """Writes where points (K, 3) of a thigh are in B (K, 3) [m]; returns that it has."""
    for k in range(len(points)):
        _turn(turn, hip, points[k], found[k])
    return True


def thighs_in_body(robot: RobotModel, q: FloatArray, points: FloatArray) -> FloatArray:
    """Points of the thighs (4, S, K, 3) in B, (N, 4, S, K, 3) [m], at angles (N, 4, 3) [rad]."""
    g = robot.geometry
    hips = np.column_stack([g.p_BH, g.offset, g.raised])
    return _turn_all(_turns(q), hips, np.array(points, order="C"))


@jit
def _turn_all(turns: FloatArray, hips: FloatArray, points: FloatArray) -> FloatArray:
    """See `thighs_in_body`, and `_clearance` for what it takes."""
    found = np.empty((turns.shape[0], *points.shape))
    for n in range(turns.shape[0]):
        for leg in range(points.shape[0]):
            for s in range(points.shape[1]):
                _place(turns[n, leg], hips[leg], points[leg, s], found[n, leg, s])
    return found


@jit
def _turn(turn: FloatArray, hip: FloatArray, p: FloatArray, found: FloatArray) -> None:
    """Writes where a point p of a thigh is in B (3,) [m]; see `_clearance` for the others."""
    cos_a, sin_a, cos_h, sin_h = turn[0], turn[1], turn[2], turn[3]
    down = cos_h * p[2] - sin_h * p[0] + hip[4]
    across = hip[3] + p[1]
    found[0] = hip[0] + cos_h * p[0] + sin_h * p[2]
    found[1] = hip[1] + cos_a * across - sin_a * down
    found[2] = hip[2] + sin_a * across + cos_a * down
