"""Triangle surfaces for pictures: made coarser, given normals, written as .obj."""

from pathlib import Path

import numpy as np

from drake_quad.gait.legs import FloatArray

Faces = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
FINEST = 400  # cells along a surface's greatest extent, at first
CREASE = np.cos(np.deg2rad(35.0))  # faces that meet at a greater angle keep their edge


def coarsen(points: FloatArray, faces: Faces, *, most: int) -> tuple[FloatArray, Faces]:
    """Merges vertices in ever larger cells until at most `most` faces are left.

    Args:
        points: (n, 3) [m].
        faces: (m, 3) indices.
        most: Number of faces.

    Returns:
        Points and faces, none of them without area.
    """
    size = float(np.ptp(points, axis=0).max())
    points, faces = _merged(points, faces, 1e-6 * max(size, 1e-9))
    cells = FINEST
    while len(faces) > most and cells > 4:
        points, faces = _merged(points, faces, size / cells)
        cells = int(0.85 * cells)
    return points, faces


def _merged(points: FloatArray, faces: Faces, cell: float) -> tuple[FloatArray, Faces]:
    """Vertices of one cell become one, at their mean; faces that vanish are dropped."""
    _, to, count = np.unique(
        np.floor((points - points.min(axis=0)) / cell + 0.5).astype(np.int64),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    to = to.reshape(-1)
    means = np.stack([np.bincount(to, points[:, k]) for k in range(3)], axis=1) / count[:, None]
    mapped = to[faces]
    a, b, c = mapped.T
    mapped = mapped[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(mapped, axis=1), axis=0, return_index=True)
    mapped = mapped[np.sort(first)]
    used, again = np.unique(mapped, return_inverse=True)
    return means[used], again.reshape(-1, 3).astype(np.int64)


def corner_normals(points: FloatArray, faces: Faces) -> FloatArray:
    """Normals (m, 3, 3) of each face's corners: smooth, but for creases."""
    edges = points[faces[:, 1:]] - points[faces[:, :1]]
    area = np.cross(edges[:, 0], edges[:, 1])
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-30)
    # All pairs (corner, face) that share a vertex: faces sorted by vertex, and for each corner
    # the run of its own vertex.
    flat = faces.reshape(-1)
    order = np.argsort(flat, kind="stable")
    counts = np.bincount(flat, minlength=len(points))
    starts = np.cumsum(counts) - counts
    runs = counts[flat]
    corner = np.repeat(np.arange(len(flat)), runs)
    within = np.arange(len(corner)) - np.repeat(np.cumsum(runs) - runs, runs)
    other = order[starts[flat[corner]] + within] // 3
    near = np.sum(unit[corner // 3] * unit[other], axis=1) >= CREASE
    total = np.stack(
        [np.bincount(corner[near], area[other[near], k], len(flat)) for k in range(3)], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    smooth = np.where(length > 1e-30, total / np.maximum(length, 1e-30), [0.0, 0.0, 1.0])
    return smooth.reshape(-1, 3, 3)


def write_surface(path: Path, points: FloatArray, faces: Faces) -> None:
    """Writes a surface with its normals, to a hundredth of a millimetre."""
    normals, which = np.unique(
        np.round(corner_normals(points, faces).reshape(-1, 3), 3), axis=0, return_inverse=True
    )
    which = which.reshape(-1, 3) + 1
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in points.tolist()]
    lines += [f"vn {x:g} {y:g} {z:g}" for x, y, z in normals.tolist()]
    lines += [
        f"f {a}//{n} {b}//{m} {c}//{o}"
        for (a, b, c), (n, m, o) in zip((faces + 1).tolist(), which.tolist(), strict=True)
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
