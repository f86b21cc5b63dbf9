"""A run as MCAP, which Foxglove shows: transforms, joints, markers and margins over time.

Messages are JSON under the names and fields of Foxglove's own schemas (FrameTransforms,
SceneUpdate), and under two of ours (JointStates, Margins). For ROS there is `ros2_bag`.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.runs.reader import LOG, RecordedRun
from drake_quad.util.files import write_whole

RATES = {"/tf": 50.0, "/joint_states": 200.0, "/scene": 25.0, "/margins": 200.0}  # [Hz] at most
NEWTONS_PER_METRE = 500.0  # of a force's arrow
WORLD = "world"
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
MARGINS = ("margin", "margin_planned", "zmp_margin", "margin_friction", "margin_capture",
           "push_budget", "gait_rate")  # fmt: skip


def write_mcap(run: RecordedRun, path: Path, *, option: str = "--mcap") -> dict[str, int]:
    """Writes the run, and returns how many messages each topic has.

    Raises:
        InputError: The package `mcap` is not installed, the log has no sample, or the file cannot
            be written.
    """
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError:
        remedy = "needs the package mcap: pip install 'drake_quad[mcap]'"
        raise InputError(source=option, field="mcap", value=str(path), remedy=remedy) from None
    if not len(run.log):
        raise InputError(
            source=str(run.directory),
            field=LOG,
            value=0,
            remedy="holds no sample: nothing to export",
        )
    messages = {
        topic: _TOPICS[topic](run, picked(run.log.t, rate)) for topic, rate in RATES.items()
    }

    def write(to: Path) -> None:
        with to.open("wb") as file:
            writer = Writer(file, compression=CompressionType.ZSTD)
            writer.start(profile="", library="drake_quad")
            ready = []
            for topic, rows in messages.items():
                name, schema = SCHEMAS[topic]
                number = writer.register_schema(
                    name, "jsonschema", json.dumps({"title": name, **schema}).encode()
                )
                channel = writer.register_channel(topic, "json", number)
                ready += [(time, channel, body) for time, body in rows]
            counts: dict[int, int] = {}
            for time, channel, body in sorted(ready, key=lambda one: one[:2]):
                counts[channel] = counts.get(channel, 0) + 1
                data = json.dumps(body, separators=(",", ":"), allow_nan=False).encode()
                writer.add_message(channel, time, data, time, counts[channel])
            for name in ("scenario.yaml", "summary.json"):
                given = run.directory / name
                if given.is_file():
                    kind = "application/json" if name.endswith("json") else "application/yaml"
                    writer.add_attachment(0, 0, name, kind, given.read_bytes())
            writer.finish()

    write_whole(path, write, option=option)
    return {topic: len(rows) for topic, rows in messages.items()}


Rows = list[tuple[int, dict[str, Any]]]


def picked(times: FloatArray, rate: float) -> list[int]:
    """The samples to write, at most so many a second [Hz]."""
    steps = np.floor((times - times[0]) * rate + 1e-6)
    return [0, *(np.flatnonzero(np.diff(steps) > 0) + 1).tolist()]


def _ns(time: float) -> int:
    return round(time * 1e6) * 1000


def _time(time: float) -> dict[str, int]:
    sec, nsec = divmod(_ns(time), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def _number(value: float) -> float | None:
    """A number to six places; null for none, which JSON does not know."""
    return round(float(value), 6) if np.isfinite(value) else None


def _point(p: FloatArray) -> dict[str, float]:
    return {axis: round(float(x), 5) for axis, x in zip("xyz", p, strict=True)}


def _turn(wxyz: FloatArray) -> dict[str, float]:
    w, x, y, z = (round(float(part), 6) for part in wxyz)
    return {"x": x, "y": y, "z": z, "w": w}


def _transforms(run: RecordedRun, rows: list[int]) -> Rows:
    """Each link's pose in the world."""
    plant = MakeModelPlant(run.robot.url)
    context = plant.CreateDefaultContext()
    bodies = [plant.get_body(b) for b in plant.GetBodyIndices(
        plant.GetModelInstanceByName(run.robot.name))]  # fmt: skip
    found: Rows = []
    for k in rows:
        if not np.isfinite(run.positions[k]).all():
            continue
        plant.SetPositions(context, run.positions[k])
        stamp, transforms = _time(run.log.t[k]), []
        for body in bodies:
            X = plant.EvalBodyPoseInWorld(context, body)
            transforms.append({
                "timestamp": stamp, "parent_frame_id": WORLD, "child_frame_id": body.name(),
                "translation": _point(X.translation()),
                "rotation": _turn(X.rotation().ToQuaternion().wxyz()),
            })  # fmt: skip
        found.append((_ns(run.log.t[k]), {"transforms": transforms}))
    return found


def _joint_states(run: RecordedRun, rows: list[int]) -> Rows:
    """Angles, speeds and torques by the joints' names, in the robot's normal form."""
    names, layout = list(run.robot.joint_names), run.layout
    q = run.positions[:, layout.q_joints]
    v = run.velocities[:, layout.v_joints - layout.num_positions]
    torque = run.log.numbers([f"tau_{name}" for name in names])
    return [
        (_ns(run.log.t[k]), {
            "timestamp": _time(run.log.t[k]), "name": names,
            **{word: [_number(x) for x in part[k]]
               for word, part in (("position", q), ("velocity", v), ("effort", torque))},
        })
        for k in rows
    ]  # fmt: skip


def margin_messages(run: RecordedRun, rows: list[int]) -> Rows:
    """The margins that the run has."""
    names = [name for name in MARGINS if name in run.log.columns]
    values = run.log.numbers(names)
    return [
        (_ns(run.log.t[k]), {
            "timestamp": _time(run.log.t[k]),
            **{name: _number(x) for name, x in zip(names, values[k], strict=True)},
        })
        for k in rows
    ]  # fmt: skip


def _entity(time: float, name: str, **parts: Any) -> dict[str, Any]:
    empty: dict[str, Any] = {
        key: [] for key in ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines",
                            "triangles", "texts", "models")
    }  # fmt: skip
    return {"timestamp": _time(time), "frame_id": WORLD, "id": name,
            "lifetime": {"sec": 0, "nsec": 0}, "frame_locked": True, **empty, **parts}  # fmt: skip


def marker_messages(run: RecordedRun, rows: list[int]) -> Rows:
    """The course once; then the feet's forces and the lines between the feet that bear."""
    t = run.log.t
    cubes = [
        {"pose": {"position": _point(box.centre), "orientation": _turn(_box_turn(box))},
         "size": _point(box.size), "color": GREY}
        for box in run.world.boxes
    ]  # fmt: skip
    found: Rows = [(_ns(t[0]), {"deletions": [], "entities": [
        _entity(t[0], "course", cubes=cubes)]})]  # fmt: skip
    bears, force, place = run.log.flags("bearing"), run.log.feet("force"), run.log.feet("position")
    low = run.log.number("margin") < 0.0
    for k in rows:
        stand = [i for i in (0, 1, 3, 2) if bears[k, i] and np.isfinite(place[k, i]).all()]
        arrows = [_arrow(place[k, i], force[k, i]) for i in stand if np.isfinite(force[k, i]).all()]
        line = {
            "type": 1, "pose": {"position": _point(np.zeros(3)),
                                "orientation": _turn(np.array([1.0, 0.0, 0.0, 0.0]))},
            "thickness": 0.01, "scale_invariant": False,
            "points": [_point(place[k, i]) for i in stand], "color": RED if low[k] else GREEN,
            "colors": [], "indices": [],
        }  # fmt: skip
        entity = _entity(t[k], "feet", arrows=arrows, lines=[line] if len(stand) > 1 else [])
        found.append((_ns(t[k]), {"deletions": [], "entities": [entity]}))
    return found


def _box_turn(box: Any) -> FloatArray:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_euler("ZY", [box.yaw, box.pitch]).as_quat()
    return np.array([w, x, y, z])


def _arrow(p: FloatArray, f: FloatArray) -> dict[str, Any]:
    """An arrow along x, turned onto the force."""
    size = float(np.linalg.norm(f))
    n = f / max(size, 1e-9)
    wxyz = np.array([1.0 + n[0], 0.0, -n[2], n[1]])  # from x onto n by the shortest way
    norm = float(np.linalg.norm(wxyz))
    wxyz = wxyz / norm if norm > 1e-6 else np.array([0.0, 0.0, 0.0, 1.0])
    length = size / NEWTONS_PER_METRE
    return {
        "pose": {"position": _point(p), "orientation": _turn(wxyz)}, "color": GREEN,
        "shaft_length": round(0.8 * length, 4), "shaft_diameter": 0.015,
        "head_length": round(0.2 * length, 4), "head_diameter": 0.03,
    }  # fmt: skip


_TOPICS = {
    "/tf": _transforms, "/joint_states": _joint_states, "/scene": marker_messages,
    "/margins": margin_messages,
}  # fmt: skip
