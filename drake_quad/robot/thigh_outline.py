"""Where a thigh's collision shapes are: the edges of its boxes, the middles of what is round."""

import numpy as np
from pydrake.geometry import Box
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_quad.gait.legs import FloatArray
from drake_quad.robot.shank_outline import SPECK, half_sizes, rod

# A way along a box's edges, by corners: round one side, round the other.
ROUND = np.array(
    [[1, 1, 1], [1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1],
     [1, -1, 1], [1, -1, -1], [-1, -1, -1], [-1, -1, 1], [1, -1, 1]]
)  # fmt: skip


def read_thighs(
    plant: MultibodyPlant, inspector: object, thighs: list[RigidBody]
) -> tuple[FloatArray, FloatArray]:
    """Lines along the shapes of all thighs, and how thick what is around them is.

    Returns:
        points: Of K shapes each, the points that lines join, in the thighs' frames (4, K, 10, 3)
            [m]; of what is less or fewer, some are the same.
        radii: (4, K) [m].
    """
    points: list[list[FloatArray]] = []
    radii: list[list[float]] = []
    for thigh in thighs:
        mine, thick = [np.zeros((len(ROUND), 3))], [0.0]  # the hip, if there is nothing else
        for g in plant.GetCollisionGeometriesForBody(thigh):
            shape = inspector.GetShape(g)  # type: ignore[attr-defined]
            half = half_sizes(shape)
            if half.max() < SPECK:
                continue
            if isinstance(shape, Box):
                line, radius = ROUND * half, 0.0
            else:
                axis, reach, radius = rod(shape)
                line = np.outer(np.linspace(-reach, reach, len(ROUND)), axis)
            X = inspector.GetPoseInFrame(g)  # type: ignore[attr-defined]
            mine.append(np.asarray(X.multiply(line.T)).T)
            thick.append(radius)
        points.append(mine)
        radii.append(thick)
    most = max(len(mine) for mine in points)
    for mine, thick in zip(points, radii, strict=True):
        mine += [mine[-1]] * (most - len(mine))
        thick += [thick[-1]] * (most - len(thick))
    return np.array(points), np.array(radii)
