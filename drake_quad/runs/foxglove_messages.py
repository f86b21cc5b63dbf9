"""Messages for Foxglove: a robot's links, joints, feet and margins at one time, as plain values.

They have the names and fields of Foxglove's own schemas (FrameTransforms, SceneUpdate), and of two
of ours (JointStates, Margins), and are sent as JSON: the same in a file and live.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from drake_quad.common import FloatArray

Message = dict[str, Any]
WORLD = "world"
NEWTONS_PER_METRE = 500.0  # of a force's arrow
GREY, GREEN, RED = (
    {"r": r, "g": g, "b": b, "a": 1.0}
    for r, g, b in ((0.6, 0.6, 0.6), (0.1, 0.6, 0.2), (0.8, 0.2, 0.1))
)

_TIME = {
    "type": "object",
    "title": "time",
    "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": 999999999},
    },
}
_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_POINT = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_POINT, orientation=_TURN)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_ANY = _list({"type": "object"})
_ENTITY = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_TIME, frame_locked={"type": "boolean"},
    metadata=_ANY,
    arrows=_list(_object(pose=_POSE, shaft_length=_NUMBER, shaft_diameter=_NUMBER,
                         head_length=_NUMBER, head_diameter=_NUMBER, color=_COLOUR)),
    cubes=_list(_object(pose=_POSE, size=_POINT, color=_COLOUR)),
    spheres=_ANY, cylinders=_ANY,
    lines=_list(_object(type={"type": "integer"}, pose=_POSE, thickness=_NUMBER,
                        scale_invariant={"type": "boolean"}, points=_list(_POINT), color=_COLOUR,
                        colors=_ANY, indices=_ANY)),
    triangles=_ANY, texts=_ANY, models=_ANY,
)  # fmt: skip
SCHEMAS: dict[str, tuple[str, dict[str, Any]]] = {
    "/tf": ("foxglove.FrameTransforms", _object(transforms=_list(_object(
        timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_POINT,
        rotation=_TURN)))),
    "/scene": ("foxglove.SceneUpdate", _object(deletions=_ANY, entities=_list(_ENTITY))),
    "/joint_states": ("drake_quad.JointStates", _object(
        timestamp=_TIME, name=_list(_TEXT), position=_list(_NUMBER), velocity=_list(_NUMBER),
        effort=_list(_NUMBER))),
    "/margins": ("drake_quad.Margins", _object(timestamp=_TIME)),
}  # fmt: skip
NONE = {"x": 0.0, "y": 0.0, "z": 0.0}
AROUND = (0, 1, 3, 2)  # the feet in the order in which a line goes around them


def nanoseconds(time: float) -> int:
    """A time [s] in ns, to the microsecond."""
    return round(time * 1e6) * 1000


def stamp(time: float) -> dict[str, int]:
    """A time [s] as Foxglove has it."""
    sec, nsec = divmod(nanoseconds(time), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def number_or_null(value: float) -> float | None:
    """A number to six places; null for none, which JSON does not know."""
    return round(float(value), 6) if np.isfinite(value) else None


def point(p: FloatArray) -> dict[str, float]:
    """A place (3,) [m] to five places."""
    return {axis: round(float(x), 5) for axis, x in zip("xyz", p, strict=True)}


def turn(wxyz: FloatArray) -> dict[str, float]:
    """A quaternion (4,), w first, to six places."""
    w, x, y, z = (round(float(part), 6) for part in wxyz)
    return {"x": x, "y": y, "z": z, "w": w}


def transforms_message(time: float, poses: Iterable[tuple[str, FloatArray, FloatArray]]) -> Message:
    """Poses of links in the world.

    Args:
        time: Time of the message [s].
        poses: Of each link its name, its place (3,) [m] and its quaternion (4,), w first.
    """
    at = stamp(time)
    return {"transforms": [
        {"timestamp": at, "parent_frame_id": WORLD, "child_frame_id": name,
         "translation": point(p), "rotation": turn(wxyz)}
        for name, p, wxyz in poses
    ]}  # fmt: skip


def joints_message(
    time: float, names: Sequence[str], q: FloatArray, v: FloatArray, torque: FloatArray
) -> Message:
    """The joints' angles [rad], speeds [rad/s] and torques [Nm], (12,) each."""
    parts = (("position", q), ("velocity", v), ("effort", torque))
    return {"timestamp": stamp(time), "name": list(names),
            **{word: [number_or_null(x) for x in part] for word, part in parts}}  # fmt: skip


def margins_message(time: float, values: Mapping[str, float]) -> Message:
    """Margins by their names in the log."""
    return {"timestamp": stamp(time), **{name: number_or_null(x) for name, x in values.items()}}


def scene_message(*entities: Message) -> Message:
    """Entities to be shown; an older one of the same name is replaced."""
    return {"deletions": [], "entities": list(entities)}


def entity(time: float, name: str, frame: str = WORLD, **parts: Any) -> Message:
    """An entity of the scene; primitives that are not given are none."""
    empty: Message = {
        key: [] for key in ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines",
                            "triangles", "texts", "models")
    }  # fmt: skip
    return {"timestamp": stamp(time), "frame_id": frame, "id": name,
            "lifetime": {"sec": 0, "nsec": 0}, "frame_locked": True, **empty, **parts}  # fmt: skip


def feet_entity(
    time: float, bearing: FloatArray, places: FloatArray, forces: FloatArray, margin: float
) -> Message:
    """Forces on the feet that bear, and a line around these, red where the margin is negative.

    Args:
        time: Time of the message [s].
        bearing: Which feet bear (4,).
        places: Where they touch the ground (4, 3) [m].
        forces: Forces on them (4, 3) [N].
        margin: Static margin [m].
    """
    stand = [i for i in AROUND if bearing[i] and np.isfinite(places[i]).all()]
    arrows = [_arrow(places[i], forces[i]) for i in stand if np.isfinite(forces[i]).all()]
    line = {
        "type": 1, "pose": {"position": NONE, "orientation": NONE | {"w": 1.0}},
        "thickness": 0.01, "scale_invariant": False, "points": [point(places[i]) for i in stand],
        "color": RED if margin < 0.0 else GREEN, "colors": [], "indices": [],
    }  # fmt: skip
    return entity(time, "feet", arrows=arrows, lines=[line] if len(stand) > 1 else [])


def _arrow(p: FloatArray, f: FloatArray) -> Message:
    """An arrow along x, turned onto the force."""
    size = float(np.linalg.norm(f))
    n = f / max(size, 1e-9)
    wxyz = np.array([1.0 + n[0], 0.0, -n[2], n[1]])  # from x onto n by the shortest way
    norm = float(np.linalg.norm(wxyz))
    wxyz = wxyz / norm if norm > 1e-6 else np.array([0.0, 0.0, 0.0, 1.0])
    length = size / NEWTONS_PER_METRE
    return {
        "pose": {"position": point(p), "orientation": turn(wxyz)}, "color": GREEN,
        "shaft_length": round(0.8 * length, 4), "shaft_diameter": 0.015,
        "head_length": round(0.2 * length, 4), "head_diameter": 0.03,
    }  # fmt: skip
