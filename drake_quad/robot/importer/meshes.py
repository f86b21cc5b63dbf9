"""Reads, simplifies and writes meshes.

`trimesh` (in the extra `robots`) reads .stl, .dae and the rest; without it only .obj is read.
"""

import hashlib
import importlib.util
import io
import os
import re
import xml.etree.ElementTree as ET
from functools import cache, lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.util.files import (
    MOST_JSON,
    MOST_MESH,
    MOST_TEXT,
    check_given,
    is_given,
    plain_of,
    read_given,
)

FARTHEST = 1e9  # in a mesh's own units


@cache
def have_trimesh() -> bool:
    """Whether the library that reads most meshes is installed."""
    return importlib.util.find_spec("trimesh") is not None


def load_parts(path: Path) -> list[Any]:
    """The triangle surfaces of a file as trimesh objects, in metres; none if it cannot be read."""
    if not have_trimesh():
        return []
    import trimesh

    try:
        check_given(path, most=MOST_MESH)
        parts = _surfaces(trimesh.load_scene(path, resolver=_careful_resolver(path)))
        if not parts and path.suffix.lower() == ".dae":  # what breaks them is mostly materials
            bare = io.BytesIO(_without_materials(read_given(path, most=MOST_MESH)))
            parts = _surfaces(trimesh.load_scene(bare, file_type="dae"))
    except Exception:  # whatever the parsers of broken files may raise
        return []
    return parts if all(_are_points(part.vertices) for part in parts) else []


def _careful_resolver(path: Path) -> Any:
    """What reads the files that a mesh names, for trimesh: regular ones, MOST_MESH bytes in all."""
    from trimesh.resolvers import FilePathResolver

    class CarefulResolver(FilePathResolver):  # type: ignore[misc]
        left = MOST_MESH

        def get(self, name: str) -> Any:
            name = name.strip()
            for word in (name, name.lstrip("/"), Path(name).name):  # where trimesh looks for it
                file = Path(self.parent) / word
                if file.exists():
                    check_given(file, most=self.left)
            data = super().get(name)
            self.left -= len(data)
            return data

    return CarefulResolver(str(path))


def files_of_mesh(path: Path) -> list[Path]:
    """The files that a mesh of a kind that Drake shows names itself, as far as they are there.

    Materials of an .obj and their pictures, and buffers and pictures of a .gltf.

    Raises:
        OSError: One that has to be read for that is no regular file, or too large.
    """
    kind = path.suffix.lower()
    if kind not in (".obj", ".gltf"):
        return []
    stat = path.stat()
    names = _names_in_obj if kind == ".obj" else _names_in_gltf
    named = [path.parent / name for name in names(path, stat.st_size, stat.st_mtime_ns)]
    materials = [file for file in named if kind == ".obj" and is_given(file)]
    pictures = [
        file.parent / name
        for file in materials
        for name in _NAMED_IN_MTL.findall(os.fsdecode(read_given(file, most=MOST_TEXT)))
    ]
    # A picture's name comes after options: `map_Kd -s 1 1 1 wood.png`.
    last = [file.parent / file.name.split()[-1] for file in pictures if file.name.split()]
    return [file for file in dict.fromkeys([*named, *pictures, *last]) if is_given(file)]


_NAMED_IN_OBJ = re.compile(r"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_NAMED_IN_MTL = re.compile(
    r"^[ \t]*(?:map_|bump|disp|decal|refl|norm)\S*[ \t]+(.+?)[ \t\r]*$", re.MULTILINE
)


@lru_cache(maxsize=256)
def _names_in_obj(path: Path, size: int, time: int) -> tuple[str, ...]:
    """Names of the materials' files in an .obj, at a time and of a size."""
    found = _NAMED_IN_OBJ.findall(os.fsdecode(read_given(path, most=MOST_MESH)))
    return tuple(dict.fromkeys(name for line in found for name in (line, *line.split())))


@lru_cache(maxsize=256)
def _names_in_gltf(path: Path, size: int, time: int) -> tuple[str, ...]:
    """Names of the files that a .gltf names, at a time and of a size; none if it is no JSON."""
    whole = plain_of(read_given(path, most=MOST_JSON)) or {}
    lists = [whole.get(key) for key in ("buffers", "images")]
    found = [one.get("uri") for many in lists if isinstance(many, list) for one in many
             if isinstance(one, dict)]  # fmt: skip
    uris = [uri for uri in found if isinstance(uri, str) and not uri.startswith("data:")]
    return tuple(dict.fromkeys(name for uri in uris for name in (uri, unquote(uri))))


def _surfaces(scene: Any) -> list[Any]:
    """The surfaces of a trimesh Scene where they are in it, in metres."""
    found = []
    for part in scene.dump():
        if len(getattr(part, "faces", ())):
            unit = str(part.metadata.get("units", "")).partition(" * meters")
            if unit[1]:
                part.apply_scale(float(unit[0]))
            found.append(part)
    return found


def _without_materials(dae: bytes) -> bytes:
    """A Collada file without its colours, cameras and lights."""
    root = ET.fromstring(dae)
    drop = ("images", "effects", "materials", "cameras", "lights")
    tags = {*(f"library_{what}" for what in drop), "bind_material", "instance_camera"}
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag.rpartition("}")[2] in tags | {"instance_light"}:
                parent.remove(child)
    return ET.tostring(root)


def read_points(path: Path) -> FloatArray | None:
    """All vertices of a mesh, (n, 3), not to be written to, or None if it cannot be read."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return _points_in(path, stat.st_size, stat.st_mtime_ns)


@lru_cache(maxsize=64)
def _points_in(path: Path, size: int, time: int) -> FloatArray | None:
    """The vertices of a mesh, at a time and of a size: a robot's file names some several times."""
    if path.suffix.lower() == ".obj":
        try:
            text = read_given(path, most=MOST_MESH).decode(errors="replace")
            lines = text.splitlines()
            rows = [line.split()[1:4] for line in lines if line.startswith("v ")]
            points = np.array(rows, dtype=float).reshape(-1, 3)
        except (OSError, ValueError):
            return None
    else:
        parts = [np.asarray(part.vertices, dtype=float) for part in load_parts(path)]
        points = np.concatenate(parts) if parts else np.zeros((0, 3))
    points.flags.writeable = False
    return points if len(points) and _are_points(points) else None


def _are_points(points: Any) -> bool:
    """Whether vertices are numbers, none of them far beyond any robot."""
    return bool(np.all(np.abs(np.asarray(points, dtype=float)) <= FARTHEST))


def hull_as_obj(path: Path, scratch: Path) -> Path | None:
    """The convex hull of a mesh as an .obj in `scratch`, or None if there is none."""
    made = scratch / f"{_stem(path)}_hull.obj"
    if made.is_file():
        return made
    points = read_points(path)
    if points is None:
        return None
    from scipy.spatial import ConvexHull, QhullError  # a third of a second, and few robots need it

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):  # flat, or too few points
        return None
    _write_obj(made, points, hull.simplices)
    return made


def whole_as_obj(path: Path, scratch: Path) -> Path | None:
    """The mesh itself as an .obj: where it is if it is one, in `scratch` if not."""
    if path.suffix.lower() == ".obj":
        return path if read_points(path) is not None else None
    made = scratch / f"{_stem(path)}.obj"
    parts = load_parts(path)
    if not parts:
        return None
    starts = np.cumsum([0, *(len(g.vertices) for g in parts)])
    faces = np.concatenate([np.asarray(g.faces) + k for g, k in zip(parts, starts, strict=False)])
    _write_obj(made, np.concatenate([np.asarray(g.vertices) for g in parts]), faces)
    return made


def _stem(path: Path) -> str:
    """A name for what is made of a file, like no other file's."""
    return f"{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:8]}"


def _write_obj(path: Path, points: FloatArray, faces: Any) -> None:
    """Writes vertices and triangles."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in np.asarray(faces).tolist()]
    path.write_text("\n".join(lines) + "\n")


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
