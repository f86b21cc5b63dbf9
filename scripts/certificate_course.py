"""The course of a certificate for `check_certificate.py`: boxes, bare faces, distances from them.

numpy alone, and nothing of drake_quad.
"""

from collections.abc import Iterator
from types import SimpleNamespace as Bag

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LEVEL = 1e-6  # [m] of height within which ground goes on
ASIDE = 1e-4  # [m] before a side, where it is asked what ground there is


def make_course(centre: Floats, size: Floats, yaw: Floats, pitch: Floats) -> Bag:
    """The obstacles of M boxes: these, and behind them the bare parts of their sides.

    Attributes of the result: centre (n, 3), half (n, 3) [m], axes (n, 3, 3) in rows, face (n,)
    whether it is a part of a side, without thickness, and of the boxes' tops alone: middle (M, 3),
    extent (M, 2) seen from above, gradient (M,).
    """
    c, s = (
        np.where(np.abs(v - np.round(v)) < 1e-15, np.round(v), v)
        for v in (np.cos(yaw), np.sin(yaw))
    )
    cp, sp, zero = np.cos(pitch), np.sin(pitch), np.zeros(len(yaw))
    rows = [[c * cp, s * cp, -sp], [-s, c, zero], [c * sp, s * sp, cp]]
    axes = np.moveaxis(np.array(rows), 2, 0)
    half = 0.5 * size
    course = Bag(
        centre=centre, half=half, axes=axes, face=np.zeros(len(yaw), dtype=bool),
        middle=centre + half[:, 2, None] * axes[:, 2],
        ahead=np.stack([c, s], axis=1),
        extent=np.stack([half[:, 0] * cp, half[:, 1]], axis=1),
        gradient=-sp / cp,
    )  # fmt: skip
    faces = [f for k in range(len(yaw)) for a in (0, 1) for f in bare_faces(course, k, a)]
    course.centre = np.array([*centre, *(f[0] for f in faces)])
    course.half = np.array([*half, *(f[1] for f in faces)])
    course.axes = np.array([*axes, *(f[2] for f in faces)])
    course.face = np.arange(len(course.half)) >= len(yaw)
    course.top = np.append(course.middle[:, 2], np.full(len(faces), np.inf))
    return course


def from_above(course: Bag, p: Floats) -> Floats:
    """Where points (n, 2) are in the boxes' own axes seen from above, (n, M, 2)."""
    d = p[:, None] - course.middle[:, :2]
    x, y = course.ahead.T
    return np.stack([d[..., 0] * x + d[..., 1] * y, d[..., 1] * x - d[..., 0] * y], axis=-1)


def bare_faces(course: Bag, k: int, axis: int) -> Iterator[tuple[Floats, Floats, Floats]]:
    """The parts of two opposite sides of box k that have no ground of their height before them."""
    axes, half, other = course.axes[k], course.half[k], 1 - axis
    others = np.arange(len(course.middle)) != k
    for sign in (-1.0, 1.0):
        side = course.centre[k] + sign * half[axis] * axes[axis]
        ends = side + half[2] * axes[2] + sign * ASIDE * axes[axis]
        ends = ends + np.array([[-1.0], [1.0]]) * half[other] * axes[other]
        start, end = from_above(course, ends[:, :2])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = [(s * course.extent - start) / (end - start) for s in (-1.0, 1.0)]
        cuts = np.concatenate([[0.0, 1.0], np.ravel(crossed)])
        cuts = np.unique(cuts[(cuts >= 0.0) & (cuts <= 1.0)])
        middle = (0.5 * (cuts[1:] + cuts[:-1]))[:, None]
        p = ends[0] + middle * (ends[1] - ends[0])
        local = from_above(course, p[:, :2])
        on = np.all(np.abs(local) <= course.extent + LEVEL, axis=-1) & others
        ground = course.middle[:, 2] + course.gradient * local[..., 0]
        slack = LEVEL + 2.0 * ASIDE * (np.abs(course.gradient) + abs(course.gradient[k]))
        bare = ~np.any(on & (ground >= p[:, 2:] - slack), axis=1)
        for low, high in zip(cuts[:-1][bare], cuts[1:][bare], strict=True):
            size = half.copy()
            size[axis], size[other] = 0.0, (high - low) * half[other]
            yield side + (low + high - 1.0) * half[other] * axes[other], size, axes


def distance(course: Bag, which: Ints, p: Floats) -> tuple[Floats, Floats]:
    """Signed distance of points (K, 3) from obstacles `which` (K,) [m]; its gradient along z."""
    axes = course.axes[which]
    local = np.einsum("kij,kj->ki", axes, p - course.centre[which])
    beyond = np.abs(local) - course.half[which]
    out = np.maximum(beyond, 0.0)
    away, face = np.linalg.norm(out, axis=1), beyond.max(axis=1)
    push = np.where((away > 0.0)[:, None], out, beyond == face[:, None]) * np.sign(local)
    length = np.maximum(np.linalg.norm(push, axis=1), 1e-300)
    return np.where(away > 0.0, away, face), np.einsum("ki,ki->k", push, axes[:, :, 2]) / length
