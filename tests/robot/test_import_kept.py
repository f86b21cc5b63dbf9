"""What of a file is left out or put right, and that the rest of the robot stays as it was."""

import re
from pathlib import Path

import numpy as np
import pytest
from import_rig import write
from pydrake.geometry import Box
from robot_formats import figures, mjcf, sdf, urdf
from test_import_impossible import changed, file_of
from test_import_repairs import CUBE, collision_shapes, notes_of

from drake_quad.errors import InputError
from drake_quad.robot.importer import parse as parse_source
from drake_quad.robot.loader import load_robot

S, M, U = sdf(), mjcf(), urdf()
BODY = '<body name="body" pos="0 0 1">'
SHAPE = '</inertial><{} name="p"><geometry>{}</geometry></{}>'


pytestmark = pytest.mark.usefixtures("own_cache")


def shaped(kind: str, geometry: str) -> str:
    """The sample SDF, its trunk with a shape."""
    return changed(S, "</inertial>", SHAPE.format(kind, geometry, kind))


PLANES = {
    "SDF collision": shaped("collision", "<plane><normal>0 0 1</normal></plane>"),
    "SDF visual": shaped("visual", "<plane><normal>0 0 1</normal></plane>"),
    "MJCF": changed(M, BODY, f'{BODY}<geom type="plane" size="1 1 1"/>'),
}


@pytest.mark.parametrize("where", PLANES)
def test_plane_on_a_robot_is_dropped(where: str, tmp_path: Path) -> None:
    """No part of a robot is endless; the line says whose it was."""
    robot = load_robot(file_of(tmp_path, PLANES[where]))
    assert "dropped: link body" in "\n".join(notes_of(robot))
    assert robot.mass == pytest.approx(18.6)


IMPOSSIBLE = {
    "SDF below zero": (S, "<ixx>0.004<", "<ixx>-0.004<"),
    "SDF unlike a triangle": (S, "<ixx>0.004<", "<ixx>4<"),
    "URDF below zero": (U, 'ixx="0.004"', 'ixx="-0.004"'),
    "URDF unlike a triangle": (U, 'ixx="0.004"', 'ixx="4"'),
}


@pytest.mark.parametrize("how", IMPOSSIBLE)
def test_inertia_that_no_body_has_is_told(how: str, tmp_path: Path) -> None:
    """Drake takes a ball of water instead: masses stay, and the robot's notes say so."""
    robot = load_robot(file_of(tmp_path, changed(*IMPOSSIBLE[how])))
    assert "repaired: link body: no body has its inertia" in "\n".join(notes_of(robot))
    assert robot.mass == pytest.approx(18.6)


def test_inertia_without_mass_is_nothing(tmp_path: Path) -> None:
    """A link of mass 0 weighs nothing, whatever its inertia: it does not become 1 kg."""
    link = '<inertial><mass value="0"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    joint = '<joint name="x" type="fixed"><parent link="body"/><child link="x"/></joint>'
    more = f'<link name="x">{link}</inertial></link>{joint}</robot>'
    robot = load_robot(file_of(tmp_path, changed(U, "</robot>", more)))
    assert "link x: an inertia without mass" in "\n".join(notes_of(robot))
    assert robot.mass == pytest.approx(18.6)


def test_sdf_link_without_inertial_has_no_mass(tmp_path: Path) -> None:
    """It is a frame with a name, as in a URDF, and not the 1 kg of the format's default."""
    more = '<link name="x"/><joint name="x_joint" type="fixed"><parent>body</parent>'
    text = changed(S, "</model>", f"{more}<child>x</child></joint></model>")
    robot = load_robot(file_of(tmp_path, text))
    assert robot.mass == pytest.approx(18.6)
    assert "link x: no inertial" in "\n".join(notes_of(robot))


def meshed(more: str, mesh: str = "") -> str:
    """The sample MJCF, with a cube as asset, more in its trunk and `mesh` as default of meshes."""
    asset = '<asset><mesh name="cube" file="cube.obj"/></asset><worldbody>'
    text = changed(changed(M, "<worldbody>", asset), BODY, f"{BODY}{more}")
    return changed(text, "<default>", f"<default>{mesh}")


def test_default_scale_of_meshes_counts(tmp_path: Path) -> None:
    """An MJCF's meshes are as great as their class says."""
    write(tmp_path, CUBE, "cube.obj")
    text = meshed('<geom type="mesh" mesh="cube"/>', '<mesh scale="0.1 0.2 0.3"/>')
    (box,) = collision_shapes(load_robot(file_of(tmp_path, text)))["body"]
    assert isinstance(box, Box)
    np.testing.assert_allclose(box.size(), [0.1, 0.4, 0.9])


@pytest.mark.parametrize(("mass", "fine"), [("", False), ('mass="2"', False), ('mass="0"', True)])
def test_mesh_that_a_body_has_mass_of_is_needed(mass: str, fine: bool, tmp_path: Path) -> None:
    """One that is missing is dropped from what weighs without it, and refused elsewhere."""
    geom = f'<geom type="mesh" mesh="cube" {mass}/>'
    light = f'<body name="pack">{geom}<geom type="box" size=".1 .1 .1" mass="2"/></body>'
    path = file_of(tmp_path, meshed(light))
    if fine:
        assert load_robot(path).mass == pytest.approx(20.6)
    else:
        with pytest.raises(InputError, match="'cube': cannot be read, and the body has mass of it"):
            load_robot(path)


BOX = '<geom type="box" size=".1 .1 .1" {}/>'
GROUPS = '<compiler inertiagrouprange="0 1"/>'
UNREAD = {  # of a body: what is in the file before, its geom, and words of the line
    "group": (GROUPS, BOX.format('group="2"'), "geom.group outside compiler.inertiagrouprange"),
    "shell": ("", BOX.format('shellinertia="true"'), "geom.shellinertia"),
    "mesh": (
        '<asset><mesh name="c" file="cube.obj" inertia="shell"/></asset>',
        '<geom type="mesh" mesh="c"/>',
        "inertia of mesh c",
    ),
    "class": (
        '<default class="shells"><geom shellinertia="true"/></default>',
        BOX.format('class="shells"'),
        "geom.shellinertia",
    ),
}


@pytest.mark.parametrize("what", UNREAD)
def test_inertia_that_drake_would_make_otherwise_is_refused(what: str, tmp_path: Path) -> None:
    """Where a body has it of its geoms; what has no mass, or an inertial beside it, is let be."""
    write(tmp_path, CUBE, "cube.obj")
    before, geom, words = UNREAD[what]
    sample = changed(M, "<worldbody>", f"{before}<worldbody>")
    inertial = '<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>'
    massless = geom.replace("/>", ' mass="0"/>')
    for more, fine in (
        (f'<body name="pack">{geom}</body>', False),
        (f'<body name="pack">{geom}{inertial}</body>', True),
        (f'<body name="pack">{BOX.format("")}{massless}</body>', True),
    ):
        path = file_of(tmp_path, changed(sample, BODY, f"{BODY}{more}"))
        if fine:
            assert load_robot(path).mass > 18.6
        else:
            with pytest.raises(InputError, match=f"pack: {words} = .* is not read"):
                load_robot(path)
    geoms = '<compiler inertiafromgeom="true"/><worldbody>'
    text = changed(changed(sample, "<worldbody>", geoms), BODY, f"{BODY}{geom}")
    with pytest.raises(InputError, match=f"body: {words}"):
        load_robot(file_of(tmp_path, text))


@pytest.mark.parametrize(
    "free", ["<freejoint/>", '<joint type="free"/>', '<joint name="f" type="free"/>']
)
def test_keyframe_counts_the_free_joint(free: str, tmp_path: Path) -> None:
    """However the trunk floats, knees that may bend both ways point as in the standing pose."""
    pose = "0 0 1 1 0 0 0 " + "0 0.5 1 " * 4
    text = re.sub('range="-150 -20"', 'range="-150 150"', changed(M, "<freejoint/>", free))
    text = changed(text, "</mujoco>", f'<keyframe><key qpos="{pose}"/></keyframe></mujoco>')
    robot = load_robot(file_of(tmp_path, text))
    assert "points forward as in the file's standing pose" in "\n".join(notes_of(robot))


def test_keyframe_of_other_joints_is_dropped(tmp_path: Path) -> None:
    """It is no pose of this robot's, which is told."""
    key = '<keyframe><key qpos="0 0 1"/></keyframe></mujoco>'
    robot = load_robot(file_of(tmp_path, changed(M, "</mujoco>", key)))
    assert "keyframe: 3 positions where the joints have 19" in "\n".join(notes_of(robot))
    np.testing.assert_array_equal(figures(robot), figures(load_robot(file_of(tmp_path, M))))


def test_parser_that_gives_no_reason_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error without a text is a line, too."""

    def fail(_: object) -> object:
        raise RuntimeError

    monkeypatch.setattr(parse_source, "Parser", fail)
    with pytest.raises(InputError, match="gives no reason"):
        load_robot(file_of(tmp_path, U))
