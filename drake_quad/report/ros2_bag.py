"""A run as a ROS 2 bag, which `ros2 bag`, RViz, PlotJuggler and Foxglove read.

Joints and trunk are those of the robot's own file, as in its CSV (`joint_table`): with
robot_state_publisher and that file RViz shows the robot. The markers are those of the MCAP for
Foxglove. The package rosbags writes the bag; no ROS has to be installed.
"""

import shutil
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.errors import InputError
from drake_quad.report.joint_table import BASE, SPEED, TORQUE, joint_table
from drake_quad.report.mcap_export import RATES, margin_messages, marker_messages, picked
from drake_quad.runs.foxglove_messages import WORLD, nanoseconds
from drake_quad.runs.reader import RecordedRun, run_of
from drake_quad.util.files import user_path, write_together

TF, JOINTS, COURSE, MARKERS = "/tf", "/joint_states", "/course", "/markers"
MARGIN = "/margins/"  # before a margin's name
TYPES = {
    TF: "tf2_msgs/msg/TFMessage",
    JOINTS: "sensor_msgs/msg/JointState",
    COURSE: "visualization_msgs/msg/MarkerArray",
    MARKERS: "visualization_msgs/msg/MarkerArray",
    MARGIN: "std_msgs/msg/Float64",
}
ARROWS = 4  # markers for the feet's forces; those of feet in the air are taken away
# Of visualization_msgs/Marker: its types and actions.
ARROW, CUBE, LINE_STRIP = 0, 1, 4
ADD, DELETE = 0, 2
_NO_BYTES = np.zeros(0, dtype=np.uint8)

Message = tuple[str, int, Any]  # topic, time [ns], message
Make = Callable[..., Any]  # makes a message of a type of ROS by the type's name


def write_ros2_bag(
    run: RecordedRun | str | Path, path: str | Path, *, option: str = "--ros2"
) -> dict[str, int]:
    """Writes the run, and returns how many messages each topic has.

    Args:
        run: The run, or its directory.
        path: Directory of the bag; two files in it are written, `metadata.yaml` and one of MCAP.
        option: Command-line option that asked for it, for the error.

    Raises:
        InputError: The package rosbags is not installed, the log has no sample of the robot's
            joints, or the files cannot be written.
    """
    run, path = run_of(run), user_path(path)
    try:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        remedy = "needs the package rosbags: pip install rosbags"
        raise InputError(source=option, field="rosbags", value=str(path), remedy=remedy) from None
    store = get_typestore(Stores.ROS2_HUMBLE)

    def make(name: str, /, **fields: Any) -> Any:
        return store.types[name.replace("/", "/msg/", 1)](**fields)

    ready = sorted(_messages(run, make), key=lambda message: message[1])
    counts: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / path.name  # the bag calls its file by its directory's name
        bag = Writer(made, version=9, storage_plugin=StoragePlugin.MCAP)
        bag.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)  # by chunks
        with bag as writer:
            connections = {}
            for topic, time, message in ready:
                if topic not in connections:
                    kind = TYPES.get(topic, TYPES[MARGIN])
                    qos = [_kept_for_late_comers()] if topic == COURSE else []
                    connections[topic] = writer.add_connection(
                        topic, kind, typestore=store, offered_qos_profiles=qos
                    )
                data = store.serialize_cdr(message, connections[topic].msgtype)
                writer.write(connections[topic], time, data)
                counts[topic] = counts.get(topic, 0) + 1
        files = {path / one.name: partial(_copy, one) for one in sorted(made.iterdir())}
        write_together(files, option=option)
    return counts


def _copy(source: Path, to: Path) -> None:
    shutil.copyfile(source, to)


def _kept_for_late_comers() -> Any:
    """The quality of service of what is published once (`transient_local`)."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    return Qos(
        QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
        QosTime(0, 0), QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0),
        avoid_ros_namespace_conventions=False,
    )  # fmt: skip


def _messages(run: RecordedRun, make: Make) -> Iterator[Message]:
    """All messages, topic by topic."""
    yield from _joints_and_trunk(run, make)
    for time, body in marker_messages(run, picked(run.log.t, RATES["/scene"])):
        (entity,) = body["entities"]
        topic = COURSE if entity["id"] == "course" else MARKERS
        yield topic, time, make("visualization_msgs/MarkerArray", markers=_markers(entity, make))
    for time, body in margin_messages(run, picked(run.log.t, RATES["/margins"])):
        for name, value in body.items():
            if isinstance(value, float):
                yield MARGIN + name, time, make("std_msgs/Float64", data=value)


def _joints_and_trunk(run: RecordedRun, make: Make) -> Iterator[Message]:
    """The joints' states and the trunk's pose, as the robot's own file means them."""
    names, values = joint_table(run)
    column = {name: k for k, name in enumerate(names)}
    joints = list(run.robot.joint_names)
    place = {kind: [column[f"{name}{kind}"] for name in joints] for kind in ("", SPEED, TORQUE)}
    base = [column[name] for name in BASE]
    for k in picked(run.log.t, RATES[JOINTS]):
        time, row = nanoseconds(run.log.t[k]), values[k]
        yield JOINTS, time, make(
            "sensor_msgs/JointState", header=_header(time, make), name=joints,
            position=row[place[""]], velocity=row[place[SPEED]], effort=row[place[TORQUE]],
        )  # fmt: skip
    for k in picked(run.log.t, RATES[TF]):
        time, (x, y, z, w, *turn) = nanoseconds(run.log.t[k]), values[k, base].tolist()
        if not np.isfinite(w):
            continue
        pose = make(
            "geometry_msgs/Transform",
            translation=make("geometry_msgs/Vector3", x=x, y=y, z=z),
            rotation=_quaternion(dict(zip("xyzw", (*turn, w), strict=True)), make),
        )
        stamped = make(
            "geometry_msgs/TransformStamped", header=_header(time, make),
            child_frame_id=run.robot.trunk, transform=pose,
        )  # fmt: skip
        yield TF, time, make("tf2_msgs/TFMessage", transforms=[stamped])


def _markers(entity: dict[str, Any], make: Make) -> list[Any]:
    """An entity of Foxglove's as markers; arrows that it has not are taken away."""
    stamp = entity["timestamp"]
    time = stamp["sec"] * 1_000_000_000 + stamp["nsec"]
    marker = partial(_marker, make, time)
    found = [
        marker("course", k, CUBE, pose=cube["pose"], scale=cube["size"], color=cube["color"])
        for k, cube in enumerate(entity["cubes"])
    ]
    if entity["id"] == "course":
        return found
    for k in range(ARROWS):
        if k >= len(entity["arrows"]):
            found.append(marker("forces", k, ARROW, action=DELETE))
            continue
        arrow = entity["arrows"][k]
        length, thick = arrow["shaft_length"] + arrow["head_length"], arrow["shaft_diameter"]
        found.append(
            marker("forces", k, ARROW, pose=arrow["pose"], color=arrow["color"],
                   scale={"x": length, "y": thick, "z": thick})
        )  # fmt: skip
    if not entity["lines"]:
        return [*found, marker("support", 0, LINE_STRIP, action=DELETE)]
    (line,) = entity["lines"]
    points = [make("geometry_msgs/Point", **p) for p in [*line["points"], line["points"][0]]]
    scale = {"x": line["thickness"], "y": 0.0, "z": 0.0}
    return [*found, marker("support", 0, LINE_STRIP, scale=scale, color=line["color"],
                           points=points)]  # fmt: skip


def _marker(
    make: Make,
    time: int,
    ns: str,
    number: int,
    kind: int,
    *,
    action: int = ADD,
    pose: dict[str, Any] | None = None,
    scale: dict[str, float] | None = None,
    color: dict[str, float] | None = None,
    points: list[Any] | None = None,
) -> Any:
    """A marker; what is not given is zero or empty."""
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    pose = pose or {"position": zero, "orientation": zero | {"w": 1.0}}
    never = make("builtin_interfaces/Duration", sec=0, nanosec=0)
    header = _header(time, make)
    image = make("sensor_msgs/CompressedImage", header=header, format="", data=_NO_BYTES)
    named = make("visualization_msgs/MeshFile", filename="", data=_NO_BYTES)
    return make(
        "visualization_msgs/Marker", header=header, ns=ns, id=number, type=kind, action=action,
        pose=make(
            "geometry_msgs/Pose", position=make("geometry_msgs/Point", **pose["position"]),
            orientation=_quaternion(pose["orientation"], make),
        ),
        scale=make("geometry_msgs/Vector3", **(scale or zero)),
        color=make("std_msgs/ColorRGBA", **(color or dict.fromkeys("rgba", 0.0))), lifetime=never,
        frame_locked=False, points=points or [], colors=[], texture_resource="", texture=image,
        uv_coordinates=[], text="", mesh_resource="", mesh_file=named,
        mesh_use_embedded_materials=False,
    )  # fmt: skip


def _header(time: int, make: Make) -> Any:
    sec, nanosec = divmod(time, 1_000_000_000)
    stamp = make("builtin_interfaces/Time", sec=sec, nanosec=nanosec)
    return make("std_msgs/Header", stamp=stamp, frame_id=WORLD)


def _quaternion(xyzw: dict[str, float], make: Make) -> Any:
    return make("geometry_msgs/Quaternion", **xyzw)
