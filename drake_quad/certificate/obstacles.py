"""What feet and shanks have to keep clear of: a course's boxes, and their faces.

A box is where nothing may be. A face is what a foot may not come near, although it steps onto the
box behind it: the part of a box's side that has no ground of its own height before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import hypot

import numpy as np

from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.terrain.boxes import Box

CAP = 0.1  # [m]; larger clearances are reported as this
LEVEL = 1e-6  # [m] of height within which ground goes on
IN_A_ROW = 256  # points that are asked about together
ASIDE = 1e-4  # [m] before a side, where it is asked what ground there is


@dataclass(frozen=True, eq=False)
class Obstacles:
    """M boxes, some of them without thickness.

    Attributes:
        centre: (M, 3) in W [m].
        axes: Unit axes of each in W, in rows (M, 3, 3).
        half: Half sizes along its axes (M, 3) [m].
        top: Height of the top's middle (M,) [m].
        face: Which are faces, not boxes (M,).
    """

    centre: FloatArray
    axes: FloatArray
    half: FloatArray
    top: FloatArray
    face: BoolArray

    def off_by(self, run: float, rise: float) -> "Obstacles":
        """The same grown by so much that they hold those that are elsewhere.

        Args:
            run: How far each may be elsewhere along the ground [m].
            rise: How much higher or lower each may be [m].
        """
        level = self.axes[:, 2, 2] >= 1.0
        more = np.where(level[:, None], [run, run, rise], hypot(run, rise))
        return replace(self, half=self.half + more)

    def with_others(self, others: "Obstacles") -> "Obstacles":
        """These, and others behind them."""
        return Obstacles(
            *(
                np.concatenate([getattr(self, f.name), getattr(others, f.name)])
                for f in fields(Obstacles)
            )
        )

    @cached_property
    def around(self) -> FloatArray:
        """Radii of circles about the centres that hold them, seen from above (M,) [m]."""
        flat = np.linalg.norm(self.axes[..., :2], axis=-1) * self.half  # of each axis
        return np.asarray(np.hypot(flat[:, 0], flat[:, 1]) + flat[:, 2])

    def may_be_near(
        self, points: FloatArray, reach: FloatArray, among: IntArray | slice = slice(None)
    ) -> tuple[IntArray, IntArray]:
        """Pairs of a point and an obstacle that may be nearer than the point's reach.

        Stairs are high boxes far apart from above: from there most are left out at once. Points
        that follow each other are near each other: so many in a row are asked about together.

        Args:
            points: (K, 3) in W [m].
            reach: (K,) [m].
            among: Which of the obstacles are asked about.

        Returns:
            Indices of points, and of the obstacles among those asked about.
        """
        centre, around = self.centre[among], self.around[among]
        size = np.linalg.norm(self.half[among], axis=1)
        pairs = [(np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp))]
        for first in range(0, len(points), IN_A_ROW):
            some, far = points[first : first + IN_A_ROW], reach[first : first + IN_A_ROW]
            room = np.max(far) + around[:, None]
            low, high = some[:, :2].min(axis=0), some[:, :2].max(axis=0)
            beside = (centre[:, :2] > low - room) & (centre[:, :2] < high + room)
            there = np.flatnonzero(beside.all(axis=1))
            flat = np.linalg.norm(some[:, None, :2] - centre[there, :2], axis=-1) - around[there]
            point, column = np.nonzero(flat < far[:, None])
            which = there[column]
            apart = np.linalg.norm(some[point] - centre[which], axis=-1) - size[which]
            near = apart < far[point]
            pairs.append((point[near] + first, which[near]))
        found, obstacle = (np.concatenate(column) for column in zip(*pairs, strict=True))
        return found, obstacle

    def distance(self, points: FloatArray, which: IntArray) -> tuple[FloatArray, FloatArray]:
        """Signed distance of points (K, 3) from obstacles `which` (K,) [m], and its gradient.

        The gradient (K, 3) is the normal of a plane that has the obstacle behind it, and the
        point as far before it as the distance says.
        """
        axes = self.axes[which]
        local = np.einsum("kij,kj->ki", axes, points - self.centre[which])
        beyond = np.abs(local) - self.half[which]
        outside = np.maximum(beyond, 0.0)
        away = np.sqrt(np.einsum("ki,ki->k", outside, outside))
        nearest = np.argmax(beyond, axis=-1)
        inside = np.take_along_axis(beyond, nearest[:, None], axis=-1)[:, 0]
        out = away > 0.0
        one = (np.arange(3) == nearest[:, None]).astype(float)
        normal = np.where(out[:, None], outside / np.where(out, away, 1.0)[:, None], one)
        normal = normal * np.where(local < 0.0, -1.0, 1.0)
        return np.where(out, away, inside), np.einsum("ki,kij->kj", normal, axes)


def find_box_obstacles(boxes: Sequence[Box]) -> Obstacles:
    """The obstacles that a course's boxes make."""
    rows = [(b.centre, _axes(b), 0.5 * b.size, b.top, False) for b in boxes]
    middles = np.array([box.middle for box in boxes])
    radii = np.array([0.5 * np.linalg.norm(box.extent) for box in boxes])
    for box, middle, radius in zip(boxes, middles, radii, strict=True):
        apart = np.linalg.norm(middles - middle, axis=1) - radii - radius
        near = [boxes[int(k)] for k in np.flatnonzero(apart <= 10.0 * ASIDE)]
        rows += [(*face, box.top, True) for face in _faces(box, near)]
    centre, axes, half, top, face = zip(*rows, strict=True)
    return Obstacles(*(np.array(column) for column in (centre, axes, half, top, face)))


def _axes(box: Box) -> FloatArray:
    """A box's unit axes in W, in rows (3, 3)."""
    ahead, left = np.array([*box.axes[0], 0.0]), np.array([*box.axes[1], 0.0])
    c, s, up = np.cos(box.pitch), np.sin(box.pitch), np.array([0.0, 0.0, 1.0])
    return np.stack([c * ahead - s * up, left, s * ahead + c * up])


def _faces(box: Box, boxes: Sequence[Box]) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """The parts of a box's four sides that have no ground of their height before them."""
    axes, half = _axes(box), 0.5 * box.size
    found = []
    for axis in (0, 1):
        other = 1 - axis
        for sign in (-1.0, 1.0):
            middle = box.centre + sign * half[axis] * axes[axis]
            edge = middle + half[2] * axes[2] + sign * ASIDE * axes[axis]
            ends = edge + np.outer([-half[other], half[other]], axes[other])
            for low, high in _uncovered(ends, box, boxes):
                size = half.copy()
                size[axis], size[other] = 0.0, 0.5 * (high - low) * 2.0 * half[other]
                at = middle + (low + high - 1.0) * half[other] * axes[other]
                found.append((at, axes, size))
    return found


def _uncovered(ends: FloatArray, own: Box, boxes: Sequence[Box]) -> list[tuple[float, float]]:
    """Where between two points (2, 3) no other box is as high as they are: parts of [0, 1]."""
    free = [(0.0, 1.0)]
    for box in boxes:
        if box is own:
            continue
        p = (ends[:, :2] - box.middle) @ box.axes.T
        low, high = 0.0, 1.0
        for k in (0, 1):
            at, way, reach = p[0, k], p[1, k] - p[0, k], 0.5 * box.extent[k] + LEVEL
            if abs(way) < 1e-12:
                high = high if abs(at) <= reach else -1.0
            else:
                a, b = sorted(((-reach - at) / way, (reach - at) / way))
                low, high = max(low, a), min(high, b)
        if high <= low:
            continue
        ground = box.top + box.gradient * (p[0, 0] + np.array([low, high]) * (p[1, 0] - p[0, 0]))
        edge = ends[0, 2] + np.array([low, high]) * (ends[1, 2] - ends[0, 2])
        slack = LEVEL + 2.0 * ASIDE * (abs(box.gradient) + abs(own.gradient))
        if np.all(ground >= edge - slack):
            free = [
                part
                for a, b in free
                for part in ((a, min(b, low)), (max(a, high), b))
                if part[1] - part[0] > 1e-9
            ]
    return free
