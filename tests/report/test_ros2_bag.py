"""A run as a ROS 2 bag: what other readers of such bags find is what the run had."""

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import drake_quad, refused
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from report_run import make_log, short_scenario, write_run
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from drake_quad.report.joint_table import joint_table
from drake_quad.report.mcap_export import RATES, marker_messages
from drake_quad.report.ros2_bag import ARROW, COURSE, DELETE, JOINTS, MARKERS, TF
from drake_quad.runs.reader import load_run


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag of a run of three seconds."""
    folder = tmp_path_factory.mktemp("bag")
    write_run(folder / "run", log=make_log(short_scenario(), seconds=3.0), versions={})
    done = drake_quad("export", "run", "--ros2", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "told.json").write_text(done.stdout)
    return folder / "run" / "ros2_bag"


def test_another_reader_finds_the_joints_and_the_trunk(bag: Path) -> None:
    """By mcap's own decoder for ROS 2, from the definitions in the file alone."""
    run = load_run(bag.parent)
    names, values = joint_table(run)
    joints = list(run.robot.joint_names)
    first, base = names.index(joints[0]), names.index("base_x")
    counts = {JOINTS: 0, TF: 0}
    reader = make_reader(
        BytesIO((bag / "ros2_bag.mcap").read_bytes()), decoder_factories=[DecoderFactory()]
    )
    for _, channel, message, body in reader.iter_decoded_messages(topics=[JOINTS, TF]):
        row = int(np.argmin(np.abs(run.log.t - message.log_time * 1e-9)))
        counts[channel.topic] += 1
        if channel.topic == JOINTS:
            stamp = body.header.stamp
            assert stamp.sec * 10**9 + stamp.nanosec == message.log_time
            assert list(body.name) == joints
            parts = body.position, body.velocity, body.effort
            np.testing.assert_array_equal(np.concatenate(parts), values[row, first : first + 36])
        else:
            (stamped,) = body.transforms
            assert (stamped.header.frame_id, stamped.child_frame_id) == ("world", run.robot.trunk)
            p, q = stamped.transform.translation, stamped.transform.rotation
            found = [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
            np.testing.assert_array_equal(found, values[row, base : base + 7])
    assert counts[JOINTS] == pytest.approx(3.0 * RATES[JOINTS], abs=2)
    assert counts[TF] == pytest.approx(3.0 * RATES[TF], abs=2)


def test_markers_are_those_for_foxglove(bag: Path) -> None:
    """The course once, for whoever comes late, too; an arrow for each foot that bears."""
    run = load_run(bag.parent)
    with AnyReader([bag]) as reader:
        course = [c for c in reader.connections if c.topic == COURSE]
        (seen,) = reader.messages(course)
        array: Any = reader.deserialize(seen[2], seen[0].msgtype)
        boxes = array.markers
        assert [(m.scale.x, m.scale.y, m.scale.z) for m in boxes] == [
            pytest.approx(tuple(box.size), abs=1e-5) for box in run.world.boxes
        ]
        moving = [c for c in reader.connections if c.topic == MARKERS]
        bears = run.log.flags("bearing")
        for connection, time, data in reader.messages(moving):
            row = int(np.argmin(np.abs(run.log.t - time * 1e-9)))
            array = reader.deserialize(data, connection.msgtype)
            arrows = [m for m in array.markers if m.type == ARROW]
            assert len(arrows) == 4
            assert sum(m.action != DELETE for m in arrows) == bears[row].sum()
    with Reader(bag) as opened:
        exts: dict[str, Any] = {c.topic: c.ext for c in opened.connections}
    offered = exts[COURSE].offered_qos_profiles
    assert [one.durability.name for one in offered] == ["TRANSIENT_LOCAL"]


def test_margins_are_a_topic_each(bag: Path) -> None:
    """As logged; and the command tells how many messages there are of what."""
    run, told = load_run(bag.parent), json.loads((bag.parents[1] / "told.json").read_text())
    counts: dict[str, int] = {}
    with AnyReader([bag]) as reader:
        for connection, time, data in reader.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            if connection.topic.startswith("/margins/"):
                row = int(np.argmin(np.abs(run.log.t - time * 1e-9)))
                name = connection.topic.removeprefix("/margins/")
                number: Any = reader.deserialize(data, connection.msgtype)
                assert number.data == pytest.approx(run.log.number(name)[row], abs=1e-6)
    assert counts == told["messages"] and counts["/margins/margin"] > 300
    assert told["bytes"] == sum(file.stat().st_size for file in bag.iterdir())
    assert len(list(marker_messages(run, [0]))) == 2  # the course, and one sample


def test_a_bag_is_written_anew(bag: Path) -> None:
    """The same bag, byte for byte; nothing else is left beside its two files."""
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    assert drake_quad("export", "run", "--ros2", cwd=bag.parents[1]).returncode == 0
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before
    assert set(before) == {"metadata.yaml", "ros2_bag.mcap"}


def test_only_one_kind_of_file_is_written_at_a_time(bag: Path) -> None:
    """One line that names the options, and status 2."""
    folder = bag.parents[1]
    told = refused(drake_quad("export", "run", "--ros2", "--mcap", cwd=folder))
    assert "--mcap, --ros2" in told
    told = refused(drake_quad("export", "run", "--ros2", "--csv", "x.csv", cwd=folder))
    assert "--csv, --ros2" in told


def test_a_place_that_cannot_be_is_refused(tmp_path: Path) -> None:
    """A file where the bag's directory would be: one line, and the file stays."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=0.2), versions={})
    (tmp_path / "run" / "ros2_bag").write_text("mine")
    assert "--ros2" in refused(drake_quad("export", "run", "--ros2", cwd=tmp_path))
    assert (tmp_path / "run" / "ros2_bag").read_text() == "mine"
