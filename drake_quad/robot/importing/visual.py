"""Visual shapes of the normal form: meshes of any format as plain .obj files beside the URDF.

A mesh comes apart by colour, and is made coarser where it has more triangles than a picture of a
robot needs: reports hold them all. Without `trimesh` only meshes that Drake shows as they are stay.
"""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydrake.geometry import Convex, Mesh, Sphere

from drake_quad.gait.legs import FloatArray
from drake_quad.robot.importing.catalogue import EXTRA
from drake_quad.robot.importing.mesh_files import have_trimesh, load_parts
from drake_quad.robot.importing.normal_form import NormalRobot
from drake_quad.robot.importing.records import ASSUMED, DROPPED, Note, Piece
from drake_quad.robot.importing.surface import Faces, coarsen, write_surface

FOLDER = "meshes"
MOST_FACES = 6000  # of one mesh file
SHOWN = frozenset({".obj", ".gltf"})  # formats that Drake shows
COLOURED = frozenset({".dae", ".gltf", ".glb"})  # whose own colours go before the robot's file's
Colour = tuple[float, ...]
PLAIN: Colour = (0.6, 0.6, 0.62, 1.0)  # of a link that the file gives no picture


class MeshFile(NamedTuple):
    """A mesh as the URDF is to name it: a path, and its scale along x, y, z."""

    path: str
    scale: tuple[float, float, float]


class _Part(NamedTuple):
    """One colour of a mesh: the file that it is in, and the colour if the mesh has one."""

    file: str
    colour: Colour | None


def write_visuals(
    robot: NormalRobot, folder: Path, collision: dict[str, list[Piece]]
) -> tuple[dict[str, list[Piece]], list[Note]]:
    """Writes the meshes into `folder`; returns the shapes by link, and what was dropped.

    Args:
        robot: Whose visual shapes they are.
        folder: Where the URDF is to be.
        collision: Collision shapes by link: a link without any other picture shows these.
    """
    done: dict[Path, list[_Part]] = {}
    made: dict[str, list[Piece]] = {}
    notes: list[Note] = []
    for link in (robot.trunk, *(link for leg in robot.legs for link in leg.links)):
        pieces = made.setdefault(link.name, [])
        for piece in link.visual:
            if not isinstance(piece.shape, (Mesh, Convex)):
                pieces.append(piece)
                continue
            path = Path(piece.shape.source().path())
            if path not in done:
                done[path] = _convert(path, folder)
                if not done[path]:
                    hint = "" if have_trimesh() else f"; pip install '{EXTRA}' reads it"
                    notes.append(Note(DROPPED, f"visual mesh {path.name} cannot be shown{hint}"))
            scale = tuple(float(x) for x in piece.shape.scale3())
            for part in done[path]:
                mesh = MeshFile(part.file, (scale[0], scale[1], scale[2]))
                own, given = part.colour, piece.colour
                colour = own or given if path.suffix.lower() in COLOURED else given or own
                pieces.append(replace(piece, shape=mesh, colour=colour))
    shanks = {leg.links[2].name: leg.foot.radius for leg in robot.legs}
    bare = []
    for name, pieces in made.items():
        sizes = [p.shape.radius() if isinstance(p.shape, Sphere) else np.inf for p in pieces]
        if max(sizes, default=0.0) <= 2.0 * shanks.get(name, 0.0) and collision.get(name):
            bare.append(name)
            made[name] = [replace(piece, colour=PLAIN) for piece in collision[name]]
    if bare:
        notes.append(Note(ASSUMED, f"shown by their collision shapes: {', '.join(bare)}"))
    return made, notes


def _convert(path: Path, folder: Path) -> list[_Part]:
    """A mesh's parts by colour, each in a file of its own; none if it cannot be read."""
    loaded = load_parts(path)
    if not loaded:
        return [_Part(str(path), None)] if path.suffix.lower() in SHOWN else []
    parts: dict[Colour | None, list[tuple[FloatArray, Faces]]] = {}
    for part in loaded:
        surface = (np.asarray(part.vertices, dtype=float), np.asarray(part.faces))
        parts.setdefault(_colour(part), []).append(surface)
    total = sum(len(faces) for surfaces in parts.values() for _, faces in surfaces)
    (folder / FOLDER).mkdir(exist_ok=True)
    stem = f"{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:6]}"
    found = []
    for number, (colour, surfaces) in enumerate(parts.items()):
        points, faces = _joined(surfaces)
        share = MOST_FACES * max(len(faces) / total, 0.05)
        points, faces = coarsen(points, faces, most=int(share))
        if len(faces):
            name = f"{stem}_{number}.obj"
            write_surface(folder / FOLDER / name, points, faces)
            found.append(_Part(f"{FOLDER}/{name}", colour))
    return found


def _joined(surfaces: list[tuple[FloatArray, Faces]]) -> tuple[FloatArray, Faces]:
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    faces = [f + start for (_, f), start in zip(surfaces, starts, strict=False)]
    return np.concatenate([points for points, _ in surfaces]), np.concatenate(faces)


def _colour(geometry: Any) -> Colour | None:
    """The one colour of a surface, of a texture its mean; None if the file gives none."""
    visual = geometry.visual
    material = getattr(visual, "material", None)
    if material is None:
        if not getattr(visual, "defined", False):
            return None
        rgba = np.asarray(visual.main_color, dtype=float)
    else:
        image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
        if image is not None:
            pixels = np.asarray(image.convert("RGB").resize((32, 32)), dtype=float)
            rgba = np.array([*pixels.reshape(-1, 3).mean(axis=0), 255.0])
        else:
            rgba = np.asarray(material.main_color, dtype=float)
    # Half a shade is no other colour. Opaque: exporters often write 0 for opacity.
    return (*(round(float(c) / 255.0, 2) for c in rgba[:3]), 1.0)
