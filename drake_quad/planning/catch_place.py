"""Whether the ground can take a foot: whole on one level, and nothing in the way there."""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.terrain import Course
from drake_quad.terrain_lane import EDGE

FOOTING = 0.015  # [m] of level ground around the foot's sphere
APART = 0.08  # [m] between feet
CLEARANCE = 0.02  # [m] of a foot on its way above whatever it passes that is above its own ground
LEVEL = 1e-3  # [m] of height within which ground is level
RING = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi * np.arange(8) / 8.0])
ALONG = np.linspace(0.0, 1.0, 13)[1:]  # samples on the way


class CatchGround:
    """The course as a foot that must be put down at once sees it: made once, asked at any time.

    Args:
        course: The ground.
        foot_radius: Of the foot's sphere [m].
    """

    def __init__(self, course: Course, foot_radius: float) -> None:
        self.foot_radius = foot_radius
        self._nosings = course.nosings()[:, :, :2]
        boxes = course.boxes
        self._boxes = np.array(
            [
                [*b.axes[0], *b.axes[1], *b.middle, *(0.5 * b.extent), b.top, b.gradient]
                for b in boxes
            ]
        )

    def height(self, places: FloatArray) -> FloatArray:
        """Height of the ground in W at `places` (..., 2) [m]; nan where there is none."""
        flat = np.ascontiguousarray(places.reshape(-1, 2))
        return _heights(flat, self._boxes, EDGE).reshape(places.shape[:-1])

    def whole(self, places: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) have level ground, or one slope, all around the foot, (N,)."""
        room = self.foot_radius + FOOTING
        around = self.height(places[:, None, :] + room * RING) - self.height(places)[:, None]
        half = len(RING) // 2
        bend = around[:, :half] + around[:, half:]  # of opposite points: on a plane they cancel
        level = np.all(np.abs(bend) <= 2.0 * LEVEL, axis=1)  # nan: no
        if not len(self._nosings):
            return np.asarray(level)
        a, b = self._nosings[:, 0], self._nosings[:, 1]
        edge = _distance(places[:, None, :], a, b).min(axis=1)
        return np.asarray(level & (edge >= room))

    def open_way(self, foot: FloatArray, places: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) the foot's centre, now at `foot` (3,), can go to straight.

        It passes nothing that is higher than its own ground and higher than it is itself.
        """
        points = foot[:2] + ALONG[:, None] * (places - foot[:2])[:, None, :]
        passed = np.nan_to_num(self.height(points), nan=-np.inf)
        own = np.nan_to_num(self.height(foot[None, :2]), nan=-np.inf)[0]
        return np.asarray(
            passed.max(axis=1) <= max(own, foot[2] - self.foot_radius - CLEARANCE) + LEVEL
        )

    def free_of(self, places: FloatArray, foot: FloatArray, others: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) are clear of the `others` (m, 3), and on the way there too.

        A foot that is already nearer to another than is liked comes no nearer on its way.
        """
        other = others[:, :2]
        there = np.linalg.norm(places[:, None, :] - other, axis=-1)
        here = np.linalg.norm(foot[:2] - other, axis=-1)
        way = _distance(other, np.broadcast_to(foot[:2], (len(places), 1, 2)), places[:, None, :])
        near = way < np.minimum(APART, here) - 1e-9
        return np.asarray(np.all((there >= APART) & ~near, axis=1))


@compiled
def _heights(points: FloatArray, boxes: FloatArray, edge: float) -> FloatArray:
    """`Course.height` of points (N, 2).

    The boxes are one a row: of its top the axes, middle, half sizes, height and gradient.
    """
    found = np.full(len(points), np.nan)
    for k in range(len(points)):
        for i in range(len(boxes)):
            x, y = points[k, 0] - boxes[i, 4], points[k, 1] - boxes[i, 5]
            along = boxes[i, 0] * x + boxes[i, 1] * y
            inside = (
                abs(along) <= boxes[i, 6] + edge
                and abs(boxes[i, 2] * x + boxes[i, 3] * y) <= boxes[i, 7] + edge
            )
            z = boxes[i, 8] + boxes[i, 9] * along
            if inside and not found[k] >= z:
                found[k] = z
    return found


def _distance(p: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Distances (...) of points p (..., 2) from the segments a-b (..., 2) [m], broadcast."""
    ab = b - a
    length = np.maximum(np.sum(ab * ab, axis=-1), 1e-12)
    t = np.clip(np.sum((p - a) * ab, axis=-1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - a - t[..., None] * ab, axis=-1))
