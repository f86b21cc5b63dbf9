"""The shapes of links as entities of Foxglove's scene, each in the frame of its link."""

from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    Mesh,
    Rgba,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.common import FloatArray
from drake_quad.robot.loader import AddRobot
from drake_quad.runs.foxglove_messages import GREY, WORLD, Message, entity, point, turn

MEDIA = {
    ".obj": "model/obj", ".stl": "model/stl", ".dae": "model/vnd.collada+xml",
    ".gltf": "model/gltf+json", ".glb": "model/gltf-binary",
}  # fmt: skip
MOST_MESH = 4 << 20  # [bytes] of a mesh that is sent


def link_entities(url: str, time: float) -> list[Message]:
    """The robot's links that have shapes to be seen.

    Args:
        url: The robot.
        time: Time of the messages [s].
    """
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, url)
    plant.Finalize()
    return shown_entities(plant, scene_graph.model_inspector(), time)


def shown_entities(
    plant: MultibodyPlant, inspector: SceneGraphInspector, time: float
) -> list[Message]:
    """Every body of a plant that has shapes to be seen, the world as `course`.

    Args:
        plant: The plant, finalized.
        inspector: Inspector of the scene that it is registered with.
        time: Time of the messages [s].
    """
    found: dict[str, dict[str, list[Any]]] = {}
    for shape_id in inspector.GetAllGeometryIds(Role.kIllustration):
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(shape_id))
        if body is None:
            continue
        name = WORLD if body.index() == plant.world_body().index() else body.name()
        X, colour = inspector.GetPoseInFrame(shape_id), _colour(inspector, shape_id)
        parts = found.setdefault(name, {})
        for kind, primitive in _primitives(inspector.GetShape(shape_id), X, colour):
            parts.setdefault(kind, []).append(primitive)
    return [
        entity(time, "course" if name == WORLD else name, name, **parts)
        for name, parts in found.items()
        if parts
    ]


def _colour(inspector: SceneGraphInspector, shape_id: Any) -> dict[str, float]:
    """The shape's own colour; grey without one."""
    properties = inspector.GetIllustrationProperties(shape_id)
    if properties is None or not properties.HasProperty("phong", "diffuse"):
        return GREY
    rgba: Rgba = properties.GetProperty("phong", "diffuse")
    return {"r": rgba.r(), "g": rgba.g(), "b": rgba.b(), "a": rgba.a()}


def _primitives(
    shape: Shape, X: RigidTransform, colour: dict[str, float]
) -> list[tuple[str, Message]]:
    """A shape as primitives, each with the list of the entity that it is in."""

    def at(
        kind: str, size: FloatArray | list[float], p: FloatArray | None = None, **more: Any
    ) -> tuple[str, Message]:
        place = X.translation() if p is None else X @ np.array(p)
        pose = {"position": point(place), "orientation": turn(X.rotation().ToQuaternion().wxyz())}
        return kind, {"pose": pose, "size": point(np.array(size)), "color": colour, **more}

    if isinstance(shape, Box):
        return [at("cubes", shape.size())]
    if isinstance(shape, Sphere):
        return [at("spheres", [2.0 * shape.radius()] * 3)]
    if isinstance(shape, Ellipsoid):
        return [at("spheres", [2.0 * shape.a(), 2.0 * shape.b(), 2.0 * shape.c()])]
    if isinstance(shape, Cylinder | Capsule):
        wide, length = 2.0 * shape.radius(), shape.length()
        straight = at("cylinders", [wide, wide, length], bottom_scale=1.0, top_scale=1.0)
        if isinstance(shape, Cylinder):
            return [straight]
        ends = (np.array([0.0, 0.0, sign * 0.5 * length]) for sign in (-1.0, 1.0))
        return [straight, *(at("spheres", [wide] * 3, end) for end in ends)]
    if isinstance(shape, Mesh | Convex):
        model = _model(shape, X, colour)
        return [] if model is None else [("models", model)]
    return []  # a half space has no end


def _model(shape: Mesh | Convex, X: RigidTransform, colour: dict[str, float]) -> Message | None:
    """A mesh's file with its pose; None where it is too large, or of a kind without a name."""
    media = MEDIA.get(shape.extension().lower())
    if media is None or not shape.source().is_path():
        return None
    path = Path(shape.source().path())
    if not path.is_file() or path.stat().st_size > MOST_MESH:
        return None
    return {
        "pose": {"position": point(X.translation()),
                 "orientation": turn(X.rotation().ToQuaternion().wxyz())},
        "scale": point(shape.scale3()), "color": colour, "override_color": True, "url": "",
        "media_type": media, "data": b64encode(path.read_bytes()).decode(),
    }  # fmt: skip
