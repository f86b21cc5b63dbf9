"""Random stairs, and what an exact camera sees of them.

A scene is a list of boxes, each turned about the vertical by the stairs' yaw. `cast_boxes` finds
what each ray meets first; tests hold it equal to Drake's renderer.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.camera_model import CameraModel

FAR = 1e9
Numbers = NDArray[np.floating[Any]]


@jit
def cast_boxes(rays: FloatArray, boxes: FloatArray, depth: FloatArray) -> None:
    """Writes the depth (n,) at which each ray (n, 3), begun at the origin, meets a box first.

    Boxes are rows (low x, y, z, high x, y, z) in the frame of the rays, whose axes are theirs.
    """
    for k in range(rays.shape[0]):
        best = 1e9
        for b in range(boxes.shape[0]):
            near, far = 1e-6, best
            for a in range(3):
                d = rays[k, a]
                low, high = boxes[b, a], boxes[b, a + 3]
                if abs(d) < 1e-12:
                    if low > 0.0 or high < 0.0:
                        far = -1.0
                    continue
                t0, t1 = low / d, high / d
                if t0 > t1:
                    t0, t1 = t1, t0
                if t0 > near:
                    near = t0
                if t1 < far:
                    far = t1
            if near <= far and near < best:
                best = near
        depth[k] = best


@dataclass(frozen=True)
class Scene:
    """Stairs (or none), told in a level frame below the camera with x along its heading.

    Attributes:
        kind: `up`, `down`, `uneven`, `open`, `overhang` or `none`.
        places: Nosings' places along the climb, from the camera's foot point [m], (n,).
        heights: Heights of the floor and the treads over that floor [m], (n + 1,).
        yaw: Yaw of the climb, left positive [rad].
        overhang: Distance that treads reach over the risers below [m].
        width: Distances from the climb's line to the left and to the right edge [m].
        boxes: Boxes in the stairs' own axes: rows (low, high), (m, 6) [m].
    """

    kind: str
    places: Numbers
    heights: Numbers
    yaw: float
    overhang: float
    width: tuple[float, float]
    boxes: FloatArray = field(repr=False)

    @property
    def going_up(self) -> bool:
        """Whether the stairs go up."""
        return len(self.heights) > 1 and bool(self.heights[1] > self.heights[0])


def build_boxes(
    places: Numbers,
    heights: Numbers,
    *,
    left: float = 0.8,
    right: float = 0.8,
    overhang: float = 0.0,
    is_open: bool = False,
    thickness: float = 0.04,
    beyond: float = 2.0,
    ground: bool = True,
) -> FloatArray:
    """Boxes of a flight: solid steps, or slabs with nothing between them.

    Args:
        places: Nosings along x [m], (n,).
        heights: Heights of floor and treads [m], (n + 1,).
        left: Distance from the line x to the left edge [m].
        right: Distance to the right edge [m].
        overhang: Distance that treads reach over the risers below [m].
        is_open: Whether there are no risers.
        thickness: Thickness of treads with an overhang or open risers [m].
        beyond: Length of the last tread [m].
        ground: Whether a wide floor lies beside and below the stairs.
    """
    rows, n = [], len(places)
    base = float(min(heights)) - 0.5
    if ground and (n == 0 or heights[-1] > heights[0]):
        rows.append((-3.0, -6.0, base, 12.0, 6.0, float(heights[0])))
    if n and heights[-1] < heights[0]:
        rows.append((-3.0, -right - 1.0, base, float(places[0]), left + 1.0, float(heights[0])))
    ends = [*[float(p) for p in places[1:]], float(places[-1]) + beyond] if n else []
    for i in range(n):
        up = heights[i + 1] > heights[i]
        low, high, top = float(places[i]), ends[i], float(heights[i + 1])
        if i == n - 1 and not up:
            rows.append((low - 2.0, -6.0, base, high + 8.0, 6.0, top))
        elif is_open:
            rows.append((low, -right, top - thickness, high + 0.02, left, top))
        elif overhang > 0.0 and up:
            rows.append((low, -right, top - thickness, high + overhang, left, top))
            rows.append((low + overhang, -right, base, high + overhang, left, top))
        else:
            rows.append((low, -right, base, high, left, top))
    return np.array(rows, dtype=float).reshape(-1, 6)


def draw_scene(kind: str, generator: np.random.Generator, *, nearest: float = 0.5,
               farthest: float = 2.0) -> Scene:  # fmt: skip
    """Draws stairs: rise 0.10 to 0.20 m, run 0.24 to 0.35 m, 3 to 12 steps, 20 degrees of yaw.

    Args:
        kind: `up`, `down`, `uneven` (by 10 mm), `open`, `overhang` (10 to 30 mm) or `none`.
        generator: The source of what is random.
        nearest: Least distance of the first nosing from the camera's foot point [m].
        farthest: Greatest distance of it [m].
    """
    if kind == "none":
        return _draw_clutter(generator)
    rise, run = generator.uniform(0.10, 0.20), generator.uniform(0.24, 0.35)
    n = int(generator.integers(3, 13))
    yaw = float(np.radians(generator.uniform(-20.0, 20.0)))
    first = generator.uniform(nearest, farthest)
    if kind == "down":  # from farther away a landing hides what is below it
        first = generator.uniform(0.4, 1.0)
    way = -1.0 if kind == "down" else 1.0
    places = first + run * np.arange(n)
    heights = way * rise * np.arange(n + 1)
    if kind == "uneven":
        places = places + np.concatenate([[0.0], generator.uniform(-0.01, 0.01, n - 1)])
        heights = heights + np.concatenate([[0.0], generator.uniform(-0.01, 0.01, n)])
    overhang = float(generator.uniform(0.01, 0.03)) if kind == "overhang" else 0.0
    left, right = generator.uniform(0.4, 1.2, 2)
    boxes = build_boxes(
        places, heights, left=left, right=right, overhang=overhang, is_open=kind == "open"
    )
    if generator.random() < 0.5:  # a wall where the landing ends, and one beside the stairs
        end = float(places[-1]) + generator.uniform(0.9, 1.9)
        boxes = np.vstack([boxes, (end, -6.0, -6.0, end + 0.1, 6.0, 4.0)])
    if generator.random() < 0.3:
        side = left + 0.02
        boxes = np.vstack([boxes, (-3.0, side, -6.0, 10.0, side + 0.1, 4.0)])
    return Scene(kind, places, heights, yaw, overhang, (float(left), float(right)), boxes)


def _draw_clutter(generator: np.random.Generator) -> Scene:
    """A floor with walls, blocks, a kerb or a table: nothing that one climbs as stairs."""
    yaw = float(np.radians(generator.uniform(-40.0, 40.0)))
    boxes = [(-3.0, -8.0, -1.0, 14.0, 8.0, 0.0)]
    if generator.random() < 0.6:
        end = generator.uniform(1.0, 5.0)
        boxes.append((end, -8.0, -1.0, end + 0.2, 8.0, 3.0))
    for _ in range(int(generator.integers(0, 6))):
        x, y = generator.uniform(0.7, 4.0), generator.uniform(-1.5, 1.5)
        size = generator.uniform(0.1, 0.8, 3)
        boxes.append((x, y - size[1], 0.0, x + size[0], y + size[1], size[2]))
    if generator.random() < 0.3:  # a kerb: one step is no flight of stairs
        x, height = generator.uniform(0.7, 2.5), generator.uniform(0.08, 0.2)
        boxes.append((x, -8.0, -1.0, 14.0, 8.0, height))
    if generator.random() < 0.3:  # a table: a slab that stands free
        x, z = generator.uniform(0.9, 2.5), generator.uniform(0.4, 0.8)
        boxes.append((x, -0.6, z - 0.03, x + 0.8, 0.6, z))
    empty = np.zeros(0)
    return Scene("none", empty, np.zeros(1), yaw, 0.0, (8.0, 8.0), np.array(boxes))


def render(scene: Scene, model: CameraModel, R_LC: FloatArray, height: float) -> FloatArray:
    """The exact depth image of a scene.

    Args:
        scene: The scene.
        model: Intrinsics.
        R_LC: The camera's true attitude in the level frame.
        height: Height of the camera over the floor [m].

    Returns:
        Depths [m], (height, width); inf where there is nothing.
    """
    c, s = np.cos(scene.yaw), np.sin(scene.yaw)
    R_SL = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    rays = (model.rays().reshape(-1, 3) @ (R_SL @ R_LC).T).copy()
    boxes = scene.boxes - np.array([0.0, 0.0, height, 0.0, 0.0, height])
    depth = np.empty(len(rays))
    cast_boxes(rays, np.ascontiguousarray(boxes), depth)
    depth[depth >= FAR] = np.inf
    return depth.reshape(model.height, model.width)
