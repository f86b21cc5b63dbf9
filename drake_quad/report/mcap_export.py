"""A run as MCAP, which Foxglove shows: transforms, joints, markers and margins over time.

The messages are those of `runs/foxglove_messages`. For ROS there is `ros2_bag`.
"""

import json
from pathlib import Path

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.runs.foxglove_messages import (
    GREY,
    SCHEMAS,
    Message,
    entity,
    feet_entity,
    joints_message,
    margins_message,
    nanoseconds,
    point,
    scene_message,
    transforms_message,
    turn,
)
from drake_quad.runs.foxglove_shapes import link_entities
from drake_quad.runs.reader import LOG, RecordedRun, run_of
from drake_quad.util.files import user_path, write_whole

RATES = {"/tf": 50.0, "/joint_states": 200.0, "/scene": 25.0, "/margins": 200.0}  # [Hz] at most
MARGINS = ("margin", "margin_planned", "zmp_margin", "margin_friction", "margin_capture",
           "push_budget", "gait_rate")  # fmt: skip


def write_mcap(
    run: RecordedRun | str | Path, path: str | Path, *, option: str = "--mcap"
) -> dict[str, int]:
    """Writes the run, and returns how many messages each topic has.

    Raises:
        InputError: The package `mcap` is not installed, the log has no sample, or the file cannot
            be written.
    """
    run, path = run_of(run), user_path(path)
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError:
        remedy = "needs the package mcap: pip install mcap"
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


Rows = list[tuple[int, Message]]  # time [ns], message


def picked(times: FloatArray, rate: float) -> list[int]:
    """The samples to write, at most so many a second [Hz]."""
    steps = np.floor((times - times[0]) * rate + 1e-6)
    return [0, *(np.flatnonzero(np.diff(steps) > 0) + 1).tolist()]


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
        poses = [(body.name(), plant.EvalBodyPoseInWorld(context, body)) for body in bodies]
        message = transforms_message(run.log.t[k], [
            (name, X.translation(), X.rotation().ToQuaternion().wxyz()) for name, X in poses
        ])  # fmt: skip
        found.append((nanoseconds(run.log.t[k]), message))
    return found


def _joint_states(run: RecordedRun, rows: list[int]) -> Rows:
    """Angles, speeds and torques by the joints' names, in the robot's normal form."""
    names, layout, t = list(run.robot.joint_names), run.layout, run.log.t
    q = run.positions[:, layout.q_joints]
    v = run.velocities[:, layout.v_joints - layout.num_positions]
    torque = run.log.numbers([f"tau_{name}" for name in names])
    return [(nanoseconds(t[k]), joints_message(t[k], names, q[k], v[k], torque[k])) for k in rows]


def margin_messages(run: RecordedRun, rows: list[int]) -> Rows:
    """The margins that the run has."""
    names, t = [name for name in MARGINS if name in run.log.columns], run.log.t
    values = run.log.numbers(names)
    return [
        (nanoseconds(t[k]), margins_message(t[k], dict(zip(names, values[k], strict=True))))
        for k in rows
    ]


def marker_messages(run: RecordedRun, rows: list[int]) -> Rows:
    """The course once; then the feet's forces and the lines between the feet that bear."""
    t = run.log.t
    cubes = []
    for box in run.world.boxes:
        pose = {"position": point(box.centre), "orientation": turn(_box_turn(box.yaw, box.pitch))}
        cubes.append({"pose": pose, "size": point(box.size), "color": GREY})
    found: Rows = [(nanoseconds(t[0]), scene_message(entity(t[0], "course", cubes=cubes)))]
    bears, force, place = run.log.flags("bearing"), run.log.feet("force"), run.log.feet("position")
    margin = run.log.number("margin")
    for k in rows:
        feet = feet_entity(t[k], bears[k], place[k], force[k], margin[k])
        found.append((nanoseconds(t[k]), scene_message(feet)))
    return found


def _scene(run: RecordedRun, rows: list[int]) -> Rows:
    """The robot's shapes, the course, and the markers."""
    first = run.log.t[0]
    shapes = scene_message(*link_entities(run.robot.url, first))
    return [(nanoseconds(first), shapes), *marker_messages(run, rows)]


def _box_turn(yaw: float, pitch: float) -> FloatArray:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_euler("ZY", [yaw, pitch]).as_quat()
    return np.array([w, x, y, z])


_TOPICS = {
    "/tf": _transforms, "/joint_states": _joint_states, "/scene": _scene,
    "/margins": margin_messages,
}  # fmt: skip
