"""`drake-quad inspect`: what it tells of a robot, in tables, as JSON and as a picture."""

import io
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import drake_quad, drake_quad_afresh, refused
from import_rig import write
from rich.console import Console
from rig import URL, paper_robot
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.feasibility import robot_picture as inspect_picture
from drake_quad.feasibility.inspect_robot import describe_robot, print_robot
from drake_quad.feasibility.robot_picture import (
    collision_points,
    draw_robot,
    reachable,
    save_picture,
    stand,
)
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.loader import load_robot

BARE = Quadruped(limits=((-0.5, 0.7), None, None), effort="0", roll=0.3, arm=True)


pytestmark = pytest.mark.usefixtures("own_cache")


def test_json_has_all_that_is_read(tmp_path: Path) -> None:
    """One object on stdout: the robot's figures, and whether its file was in normal form."""
    done = drake_quad("inspect", URL, "--json", "--picture", "robot.svg", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told, robot = json.loads(done.stdout), paper_robot()
    assert told["mass"] == robot.mass and told["normal_form"] == "as it is"
    assert told["knees"] == "all knees backward" and told["notes"] == []
    assert [j["name"] for leg in told["legs"].values() for j in leg["joints"]] == list(
        robot.joint_names
    )
    assert "<svg" in (tmp_path / "robot.svg").read_text()


def test_tables_mark_what_is_assumed(tmp_path: Path) -> None:
    """What the file does not give has a star, and the rule below."""
    robot = load_robot(write(tmp_path, BARE.text()))
    console = Console(width=200, record=True, file=io.StringIO())
    told = describe_robot(robot, source="robot.urdf")
    print_robot(told, console)
    text = console.export_text()
    (abduction,) = [line for line in text.splitlines() if "FL  FL_haa" in line]
    (knee,) = [line for line in text.splitlines() if "RR  RR_kfe" in line]
    assert abduction.count("*") == 1 and knee.count("*") == 2  # efforts; and a knee's limits
    assert "(q +17.2°)" in abduction or "(q -17.2°)" in abduction
    assert "locked" in text and "0.4 of the weight" in text


@pytest.mark.parametrize("arguments", [("nobody",), (URL, "--picture", "robot.doc")])
def test_wrong_arguments_get_one_line(arguments: tuple[str, ...], tmp_path: Path) -> None:
    """An unknown robot, and a picture of an unknown kind, end with status 2."""
    line = refused(drake_quad("inspect", *arguments, cwd=tmp_path))
    assert "nobody" in line or "robot.doc" in line


def test_stance_is_within_limits_with_the_feet_below_the_hips() -> None:
    """The robot of the picture stands as the model says it can."""
    robot = paper_robot()
    stance = stand(robot)
    q = stance.q.reshape(12)
    assert np.all((q >= robot.q_lower) & (q <= robot.q_upper))
    np.testing.assert_allclose(stance.feet[:, 0], robot.geometry.p_BH[:, 0], atol=1e-9)
    assert stance.height == pytest.approx(0.75 * robot.geometry.reach.min() + robot.foot_radius)


def test_reach_holds_what_the_joints_can_do_and_no_more() -> None:
    """Feet of angles within the limits are within reach; a stretched leg's next metre is not."""
    robot = paper_robot()
    low, high = robot.q_lower[:3], robot.q_upper[:3]
    middle = 0.5 * (np.maximum(low, -0.8) + np.minimum(high, 0.8))
    q = np.random.default_rng(2).uniform(
        0.9 * low + 0.1 * middle, 0.9 * high + 0.1 * middle, (300, 3)
    )
    feet = calc_feet(robot.geometry, np.repeat(q[:, None], 4, axis=1))[:, 0]
    below = feet[:, 2] < -0.3
    assert below.sum() > 50
    assert reachable(robot.geometry, 0, low, high, feet[below]).all()
    far = robot.geometry.p_BH[0] + [[0.0, 0.09, -1.3], [1.5, 0.09, 0.0]]
    assert not reachable(robot.geometry, 0, low, high, far).any()


def test_collision_shapes_are_drawn_where_they_are() -> None:
    """The feet's spheres are at the stance's feet."""
    robot = paper_robot()
    stance = stand(robot)
    spheres = [
        points
        for name, points in collision_points(robot, stance.q)
        if name.endswith("_shank") and np.ptp(points, axis=0).max() < 0.1
    ]
    centres = np.array([0.5 * (p.min(axis=0) + p.max(axis=0)) for p in spheres])
    np.testing.assert_allclose(centres, stance.feet, atol=1e-3)


def test_picture_shows_both_views_and_is_the_same_twice(tmp_path: Path) -> None:
    """Two views to one scale each, with the same bytes each time."""
    robot = load_robot(write(tmp_path, BARE.text()))
    figure = draw_robot(robot)
    assert len(figure.axes) == 2
    assert all(ax.get_aspect() == 1.0 for ax in figure.axes)
    for name in ("one.svg", "two.svg"):
        save_picture(draw_robot(robot), tmp_path / name, salt=robot.name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


@pytest.mark.parametrize("name", ["[/x]", "[red]", "[bold]a[/]", "a:dog:b", "\\[", "$x$\\foo$"])
def test_names_are_printed_and_drawn_as_they_are(name: str, tmp_path: Path) -> None:
    """Joints, links and robots may be called what rich or matplotlib take for their own."""
    text = BARE.text().replace("FL_", f"{name}_").replace('"body"', f'"{name}"')
    robot = load_robot(write(tmp_path, text, f"{name.replace('/', '')}.urdf"))
    assert robot.joint_names[0] == f"{name}_haa"
    console = Console(width=200, record=True, file=io.StringIO())
    print_robot(describe_robot(robot, source="robot.urdf"), console)
    lines = console.export_text()
    assert f"{name}_haa" in lines and f" {name}, 14.00 kg" in lines
    save_picture(draw_robot(replace(robot, name=name)), tmp_path / "robot.svg", salt=name)


def test_picture_of_shapes_without_outline_is_of_the_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Collision shapes that have no area, seen from anywhere, leave the legs to draw."""
    monkeypatch.setattr(inspect_picture, "collision_points", lambda *_: [("x", np.zeros((5, 3)))])
    save_picture(draw_robot(paper_robot()), tmp_path / "robot.svg", salt="robot")
    assert "<svg" in (tmp_path / "robot.svg").read_text()


SPOILT: dict[str, Any] = {
    "[1, 2": "not YAML",
    "": "empty",
    "- 1": "mapping",
    "joints: 3": "joints = 3",
    "joints: {FL_haa: 3}": "joints.FL_haa = 3",
    "joints: {FL_haa: {sign: x, turn: 1}}": "joints.FL_haa",
    "joints: {FL_haa: {sign: 1, turn: .inf}}": "joints.FL_haa",
    "trunk: {p_TB: [1, 2]}": "trunk",
    "notes: x": "notes = 'x'",
    "notes: [{kind: x}]": "notes",
}


@pytest.mark.parametrize("text", SPOILT)
def test_spoilt_mapping_is_named(text: str, tmp_path: Path) -> None:
    """What the importer wrote beside a robot, spoilt since: the line says which file, and what."""
    robot = load_robot(write(tmp_path, BARE.text()))
    path = Path(robot.url).parent / MAPPING
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        describe_robot(robot, source="robot.urdf")
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and SPOILT[text] in line and "\n" not in line


def test_mapping_that_is_no_text_is_named(tmp_path: Path) -> None:
    """Bytes of any kind."""
    robot = load_robot(write(tmp_path, BARE.text()))
    (Path(robot.url).parent / MAPPING).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=MAPPING):
        describe_robot(robot, source="robot.urdf")


def test_terminal_that_lacks_letters_gets_their_codes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where nothing but ASCII can be printed, degrees are a code, and nothing else changes."""
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    done = drake_quad_afresh("inspect", write(tmp_path, BARE.text()), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "\\xb0" in done.stdout and "23.93 kg" in done.stdout


def test_file_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    """Drake takes UTF-8 names alone; the line shows the byte."""
    path = os.fsencode(tmp_path) + b"/r\xff.urdf"
    Path(os.fsdecode(path)).write_text(BARE.text())
    line = refused(drake_quad("inspect", os.fsdecode(path), cwd=tmp_path))
    assert "udcff" in line and "rename it" in line
