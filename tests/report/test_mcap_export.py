"""A run as MCAP: what its own reader finds is what the run had."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import drake_quad, refused
from mcap.reader import make_reader
from report_run import make_log, short_scenario, write_run
from scipy.spatial.transform import Rotation

from drake_quad.report.mcap_export import RATES
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.runs.foxglove_messages import SCHEMAS
from drake_quad.runs.reader import load_run


def test_the_file_holds_the_run(tmp_path: Path) -> None:
    """By mcap's own reader: all topics, in time's order, with poses and angles as logged."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=3.0), versions={})
    done = drake_quad("export", "run", "--mcap", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    run = load_run(tmp_path / "run")
    plant = MakeModelPlant(run.robot.url)
    context, names = plant.CreateDefaultContext(), list(run.robot.joint_names)
    counts: dict[str, int] = {}
    last = 0
    with (tmp_path / "run" / "run.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            assert schema is not None and schema.name == SCHEMAS[channel.topic][0]
            assert schema.encoding == "jsonschema" and json.loads(schema.data)["type"] == "object"
            assert message.log_time >= last
            last, body = message.log_time, json.loads(message.data)
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            row = int(np.argmin(np.abs(run.log.t - message.log_time * 1e-9)))
            if channel.topic == "/joint_states":
                assert body["name"] == names
                q = run.positions[row][run.layout.q_joints]
                np.testing.assert_allclose(body["position"], q, atol=1e-6)
            if channel.topic == "/tf":
                plant.SetPositions(context, run.positions[row])
                for one in body["transforms"]:
                    X = plant.EvalBodyPoseInWorld(
                        context, plant.GetBodyByName(one["child_frame_id"])
                    )
                    p = [one["translation"][axis] for axis in "xyz"]
                    np.testing.assert_allclose(p, X.translation(), atol=1e-5)
                    R = Rotation.from_quat([one["rotation"][axis] for axis in "xyzw"]).as_matrix()
                    np.testing.assert_allclose(R, X.rotation().matrix(), atol=1e-5)
            if channel.topic == "/margins":
                assert body["margin"] == pytest.approx(run.log.number("margin")[row], abs=1e-6)
        assert {one.name for one in reader.iter_attachments()} == {"scenario.yaml", "summary.json"}
    assert counts == told["messages"] and set(counts) == set(RATES)
    assert counts["/tf"] == pytest.approx(3.0 * RATES["/tf"], abs=2)


def test_arrows_point_along_the_forces(tmp_path: Path) -> None:
    """Each arrow lies along the force on its foot, at the foot, as long as it is great."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=0.5), versions={})
    assert drake_quad("export", "run", "--mcap", cwd=tmp_path).returncode == 0
    run, seen = load_run(tmp_path / "run"), 0
    with (tmp_path / "run" / "run.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/scene"]):
            body = json.loads(message.data)
            row = int(np.argmin(np.abs(run.log.t - message.log_time * 1e-9)))
            forces, places = run.log.feet("force")[row], run.log.feet("position")[row]
            for arrow in body["entities"][0]["arrows"]:
                place = np.array([arrow["pose"]["position"][axis] for axis in "xyz"])
                foot = int(np.argmin(np.linalg.norm(places - place, axis=1)))
                turn = Rotation.from_quat([arrow["pose"]["orientation"][axis] for axis in "xyzw"])
                length = arrow["shaft_length"] + arrow["head_length"]
                np.testing.assert_allclose(
                    500.0 * length * turn.apply([1.0, 0.0, 0.0]), forces[foot], atol=0.2
                )
                seen += 1
    assert seen > 20


def test_two_files_at_once_are_refused(tmp_path: Path) -> None:
    """--csv with --mcap: a line that names the option."""
    write_run(tmp_path / "run", log=make_log(short_scenario(), seconds=0.1), versions={})
    assert "--csv" in refused(drake_quad("export", "run", "--mcap", "--csv", "x", cwd=tmp_path))
