"""Reads meshes of any common format and writes those that Drake takes.

`trimesh` (in the extra `robots`) reads .stl, .dae and the rest; without it only .obj is read.
"""

import hashlib
import importlib.util
import io
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.given_files import MOST_MESH, check_given, read_given

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
        parts = _surfaces(trimesh.load_scene(path))
        if not parts and path.suffix.lower() == ".dae":  # what breaks them is mostly materials
            bare = io.BytesIO(_without_materials(read_given(path, most=MOST_MESH)))
            parts = _surfaces(trimesh.load_scene(bare, file_type="dae"))
    except Exception:  # whatever the parsers of broken files may raise
        return []
    return parts if all(_are_points(part.vertices) for part in parts) else []


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
    """All vertices of a mesh, (n, 3), or None if it cannot be read."""
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
