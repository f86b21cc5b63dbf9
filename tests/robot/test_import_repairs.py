"""What the importer makes of what a file lacks or has wrong, each by its stated rule and noted."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from import_rig import write
from pydrake.geometry import Box, Capsule, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.loader import AddRobot, load_robot
from drake_quad.robot.model import CameraMount, RobotModel

PLAIN = Quadruped()
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 2) for z in (0, 3))
CUBE += "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


pytestmark = pytest.mark.usefixtures("own_cache")


def notes_of(robot: RobotModel) -> list[str]:
    mapping = yaml.safe_load((Path(robot.url).parent / MAPPING).read_text())
    return [f"{note['kind']}: {note['text']}" for note in mapping["notes"]]


def same_figures(a: RobotModel, b: RobotModel) -> None:
    """Both have the same geometry, limits and masses."""
    for name in ("p_BH", "offset", "thigh", "shank", "knee_sign"):
        x, y = getattr(a.geometry, name), getattr(b.geometry, name)
        np.testing.assert_allclose(x, y, atol=1e-9)
    for name in ("q_lower", "q_upper", "effort", "speed", "link_mass", "link_com", "trunk_com"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=1e-9)


def collision_shapes(robot: RobotModel) -> dict[str, list[object]]:
    """Collision shapes by link."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, robot.url)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    links = [
        plant.get_body(i) for i in plant.GetBodyIndices(plant.GetModelInstanceByName(robot.name))
    ]
    return {
        link.name(): [inspector.GetShape(g) for g in plant.GetCollisionGeometriesForBody(link)]
        for link in links
    }


def test_limits_in_reverse_are_swapped(tmp_path: Path) -> None:
    """A file that has upper and lower the wrong way round is read as if it had not."""
    text = PLAIN.text()
    turned = re.sub(r'lower="([^"]*)" upper="([^"]*)"', r'lower="\2" upper="\1"', text)
    assert turned != text
    robot = load_robot(write(tmp_path, turned, "turned.urdf"))
    same_figures(robot, load_robot(write(tmp_path, text)))
    assert sum("reversed" in note for note in notes_of(robot)) == 12


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_robot_floats_however_its_file_ties_it(base: str, tmp_path: Path) -> None:
    """With the world told or not, floating or fixed, it is the same robot."""
    robot = load_robot(write(tmp_path, replace(PLAIN, base=base).text(), "tied.urdf"))
    same_figures(robot, load_robot(write(tmp_path, PLAIN.text())))
    assert any("floats" in note for note in notes_of(robot)) == (base == "fixed")


def test_arm_is_locked_and_weighs_with_the_trunk(tmp_path: Path) -> None:
    """The joints of an arm are no leg's: they stay at zero or their nearest limit."""
    robot = load_robot(write(tmp_path, replace(PLAIN, arm=True).text(), "arm.urdf"))
    plain = load_robot(write(tmp_path, PLAIN.text()))
    assert robot.trunk_mass == pytest.approx(plain.trunk_mass + 4 * 0.5)
    assert robot.mass == pytest.approx(plain.mass + 4 * 0.5)
    assert robot.joint_names == plain.joint_names
    (locked,) = [note for note in notes_of(robot) if "locked" in note]
    assert all(f"arm_{k}_joint" in locked for k in range(4))


def test_limits_that_are_none_are_assumed(tmp_path: Path) -> None:
    """No limits: abduction ±0.8, hip ±2.6, knee bent by 0.05 to 2.7 rad, and backward."""
    bare = replace(PLAIN, limits=(None, None, None))
    robot = load_robot(write(tmp_path, bare.text()))
    np.testing.assert_allclose(robot.q_lower.reshape(4, 3), [[-0.8, -2.6, -2.7]] * 4)
    np.testing.assert_allclose(robot.q_upper.reshape(4, 3), [[0.8, 2.6, -0.05]] * 4)
    assert sum("no limits" in note for note in notes_of(robot)) == 12


def test_knee_points_as_at_the_files_zero_or_where_its_limits_reach(tmp_path: Path) -> None:
    """Without limits, or with such to both sides, what the file shows of the knee decides."""
    bent = replace(PLAIN, shank=(-0.15, -0.3), limits=(None, None, None), rear=-1)
    sides = load_robot(write(tmp_path, bent.text(), "bent.urdf")).geometry.knee_sign
    np.testing.assert_array_equal(sides, [1, 1, -1, -1])
    both = replace(PLAIN, limits=((-1, 1), (-1, 1), (-1.2, 2.0)))
    robot = load_robot(write(tmp_path, both.text(), "both.urdf"))
    np.testing.assert_array_equal(robot.geometry.knee_sign, 1)
    np.testing.assert_allclose(robot.q_upper[2::3], 2.0)
    np.testing.assert_allclose(robot.q_lower[2::3], 0.05)


def standing(name: str, front: float, rear: float) -> str:
    """A SRDF for a robot of this name with a standing pose: the angles of its knees."""
    joints = "".join(
        f'<joint name="{leg}_kfe" value="{front if leg[0] == "F" else rear}"/>'
        for leg in ("FL", "FR", "RL", "RR")
    )
    pose = f'<group_state name="standing">{joints}</group_state>'
    return f'<robot name="{name}">{pose}</robot>'


@pytest.mark.parametrize("name", ["robot.srdf", "beast.srdf", "../srdf/robot.srdf", "x.srdf"])
def test_standing_pose_beside_the_file_decides_the_knees(name: str, tmp_path: Path) -> None:
    """A SRDF's pose `standing` says to which side knees without limits point.

    It has the file's name, or the robot's, or is the only one and of a robot of that name.
    """
    bare = replace(PLAIN, limits=(None, None, None))
    for folder in ("urdf", "srdf"):
        (tmp_path / folder).mkdir()
    (tmp_path / "urdf" / name).write_text(standing("beast", -0.8, 0.8))
    robot = load_robot(write(tmp_path / "urdf", bare.text()))
    np.testing.assert_array_equal(robot.geometry.knee_sign, [-1, -1, 1, 1])


def test_standing_pose_of_another_robot_decides_nothing(tmp_path: Path) -> None:
    """Files of several robots in one folder: each has the knees of its own SRDF, or of none."""
    bare = replace(PLAIN, limits=(None, None, None)).text()
    other = bare.replace('name="beast"', 'name="other"')
    for name, text in (("a", bare), ("b", other), ("c", other.replace("other", "third"))):
        write(tmp_path, text, f"{name}.urdf")
    (tmp_path / "a.srdf").write_text(standing("beast", -0.8, -0.8))
    without = load_robot(write(tmp_path, bare.replace("beast", "fourth"), "d.urdf"))
    assert any("for want of anything" in note for note in notes_of(without))
    (tmp_path / "b.srdf").write_text(standing("other", 0.8, 0.8))
    knees = [
        load_robot(str(tmp_path / f"{name}.urdf")).geometry.knee_sign.tolist() for name in "abc"
    ]
    assert knees == [[-1] * 4, [1] * 4, [-1] * 4]


@pytest.mark.parametrize("effort", ["0", "inf", "100000"])
def test_effort_that_is_none_follows_from_weight_and_legs(effort: str, tmp_path: Path) -> None:
    """None, infinite or absurd: 0.4 of the weight times the leg's length; speed 10 rad/s."""
    robot = load_robot(write(tmp_path, replace(PLAIN, effort=effort, speed="1e6").text()))
    np.testing.assert_allclose(robot.effort, 0.4 * robot.mass * 9.81 * robot.geometry.reach.min())
    np.testing.assert_allclose(robot.speed, 10.0)
    told = notes_of(robot)
    assert sum("effort" in note for note in told) == sum("speed" in note for note in told) == 12


@pytest.mark.parametrize(("foot", "radius"), [("cylinder", 0.0263), ("link", 0.0224)])
def test_foot_without_a_sphere_gets_one(foot: str, radius: float, tmp_path: Path) -> None:
    """Its radius is 7 % of the shank within 15 to 30 mm; it stands in the foot's lowest shape."""
    robot = load_robot(write(tmp_path, replace(PLAIN, foot=foot).text()))
    lowest = robot.geometry.shank + robot.foot_radius
    tip = 0.32 + (0.03 if foot == "cylinder" else robot.foot_radius)
    np.testing.assert_allclose(lowest, tip, atol=3e-3)
    assert robot.foot_radius == pytest.approx(radius, rel=0.1)
    assert sum("foot of" in note for note in notes_of(robot)) == 4


SHINS = {  # the one shape of a shank, from the knee down
    "capsule": '<capsule radius="0.02" length="0.28"/>',
    "thick capsule": '<capsule radius="0.05" length="0.24"/>',
    "box": '<box size="0.016 0.016 0.32"/>',
    "cylinder": '<cylinder radius="0.012" length="0.32"/>',
    "mesh": '<mesh filename="cube.obj" scale="0.016 0.008 0.107"/>',
}


@pytest.mark.parametrize("shin", SHINS)
def test_a_shank_of_one_shape_is_more_than_a_foot(shin: str, tmp_path: Path) -> None:
    """The foot is a ball in its tip; the rest is no thicker, and may touch something, too."""
    write(tmp_path, CUBE, "cube.obj")
    at = "-0.008 -0.008 -0.321" if shin == "mesh" else "0 0 -0.16"
    text = f'<collision><origin xyz="{at}"/><geometry>{SHINS[shin]}</geometry></collision>'
    bare = re.sub(r'(<link name="\w+_shank">)', rf"\1{text}", replace(PLAIN, foot="none").text())
    robot = load_robot(write(tmp_path, bare))
    shapes = collision_shapes(robot)
    for leg, shank in zip(("FL", "FR", "RL", "RR"), robot.geometry.shank, strict=True):
        kinds: dict[Any, Any] = {type(shape): shape for shape in shapes[f"{leg}_shank"]}
        assert set(kinds) == {Sphere, Capsule}
        assert kinds[Capsule].length() == pytest.approx(shank, rel=0.1)
        assert kinds[Capsule].radius() <= robot.foot_radius
        assert shin != "capsule" or kinds[Capsule].radius() == 0.02


def test_a_foot_of_another_form_is_a_foot(tmp_path: Path) -> None:
    """A short cylinder at a shank's end is what the ball stands for, and is not there beside it."""
    robot = load_robot(write(tmp_path, replace(PLAIN, foot="cylinder").text()))
    assert all(
        [type(s) for s in collision_shapes(robot)[f"{leg}_shank"]] == [Sphere]
        for leg in ("FL", "FR", "RL", "RR")
    )


def test_missing_meshes_are_dropped_and_stood_in_for(tmp_path: Path) -> None:
    """Trunk: a box from hip to hip. Thigh, shank: a capsule. A picture is left out."""
    text = PLAIN.text()
    text = re.sub(r'<collision name="body">.*?</collision>', MESH.format("gone.stl"), text)
    text = re.sub(r'(<link name="FL_thigh">)', rf"\1{MESH.format('package://no/gone.dae')}", text)
    text = text.replace(
        '<link name="RL_shank">', f'<link name="RL_shank">{MESH.format("gone.stl")}'
    )
    visual = '<visual><geometry><mesh filename="gone.obj"/></geometry></visual>'
    text = text.replace('<link name="FR_hip">', f'<link name="FR_hip">{visual}')
    robot = load_robot(write(tmp_path, text))
    shapes = collision_shapes(robot)
    (box,) = shapes["body"]
    assert isinstance(box, Box)
    np.testing.assert_allclose(box.size()[:2], [0.6, 0.2], atol=1e-9)
    (capsule,) = shapes["FL_thigh"]
    assert isinstance(capsule, Capsule) and capsule.length() == pytest.approx(0.3)
    (shin,) = [shape for shape in shapes["RL_shank"] if isinstance(shape, Capsule)]
    assert 0.0 < shin.radius() < robot.foot_radius
    assert sum("not there" in note for note in notes_of(robot)) == 4


@pytest.mark.parametrize(("ahead", "missing"), [(0.01, False), (0.05, True)])
def test_a_shank_that_bows_out_of_its_capsule_is_told(
    ahead: float, missing: bool, tmp_path: Path
) -> None:
    """By how much the capsule is too thin: clearances and certificates are of the capsule."""
    corners = [(x, y, z) for z in (0.0, -0.1, -0.2) for x, y in ((0.0, 0.005), (0.0, -0.005))]
    corners[2:4] = [(ahead, 0.005, -0.1), (ahead, -0.005, -0.1)]  # it bows in its middle
    mesh = (
        "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 6\n"
    )
    (tmp_path / "bowed.obj").write_text(mesh)
    shank = f'<link name="FL_shank">{MESH.format("bowed.obj")}'
    text = PLAIN.text().replace('<link name="FL_shank">', shank)
    robot = load_robot(write(tmp_path, text))
    (capsule,) = [s for s in collision_shapes(robot)["FL_shank"] if isinstance(s, Capsule)]
    (note,) = [n for n in notes_of(robot) if "as a capsule of radius" in n]
    told = re.search(r"(\d+) mm thinner than it is where it is thickest", note)
    assert (told is not None) == missing
    if told is not None:
        reach = np.hypot(ahead, 0.005) - capsule.radius()
        assert float(told[1]) == pytest.approx(1e3 * reach, abs=0.6)


def test_collision_meshes_become_primitives_that_hold_them(tmp_path: Path) -> None:
    """A trunk's mesh becomes its box, a shank's a capsule no thicker than the foot."""
    (tmp_path / "cube.obj").write_text(CUBE)
    text = re.sub(r'<collision name="body">.*?</collision>', MESH.format("cube.obj"), PLAIN.text())
    small = MESH.format("cube.obj").replace("/></g", ' scale="0.04 0.02 -0.1"/></g')
    text = text.replace('<link name="RR_shank">', f'<link name="RR_shank">{small}')
    shapes = collision_shapes(load_robot(write(tmp_path, text)))
    (box,) = shapes["body"]
    assert isinstance(box, Box)
    np.testing.assert_allclose(box.size(), [1.0, 2.0, 3.0], atol=1e-9)
    kinds: dict[Any, Any] = {type(shape): shape for shape in shapes["RR_shank"]}
    assert set(kinds) == {Sphere, Capsule}
    assert kinds[Capsule].radius() <= kinds[Sphere].radius()


@pytest.mark.parametrize(
    ("field", "check"),
    [
        ("foot_radius: 0.04", lambda r: r.foot_radius == 0.04),
        ("foot_radius: 4e-2", lambda r: r.foot_radius == 0.04),  # text by YAML 1.1
        ("effort: [11, 12, 13]", lambda r: r.effort[:3].tolist() == [11, 12, 13]),
        ("speed: [1, 2, 3]", lambda r: r.speed[-3:].tolist() == [1, 2, 3]),
        ("abduction: [-0.2, 0.5]", lambda r: r.q_lower[[0, 3]].tolist() == [-0.2, -0.5]),
        ("hip: [-1, 2]", lambda r: r.q_upper[[1, 4, 7, 10]].tolist() == [2, 2, 2, 2]),
        ("knee: [0.2, 2]", lambda r: (r.q_lower[2], r.q_upper[2]) == (-2.0, -0.2)),
        ("knees: forward", lambda r: r.geometry.knee_sign.tolist() == [1, 1, 1, 1]),
        ("knees: {RL: forward}", lambda r: r.geometry.knee_sign.tolist() == [-1, -1, 1, -1]),
        ("name: rex", lambda r: r.name == "rex"),
        (
            "camera: {x: 0.3, y: 0, z: 5e-2, pitch_deg: 40}",
            lambda r: r.camera == CameraMount(x=0.3, y=0.0, z=0.05, pitch_deg=40.0),
        ),
        ("forward_deg: 180", lambda r: r.joint_names[0] == "RR_haa"),
    ],
)  # fmt: skip
def test_robot_yaml_overrules_the_file(
    field: str, check: Callable[[RobotModel], bool], tmp_path: Path
) -> None:
    """What a person says in a .robot.yaml holds, whatever the file has."""
    write(tmp_path, PLAIN.text())
    said = write(tmp_path, f"model: robot.urdf\n{field}\n", "mine.robot.yaml")
    assert check(load_robot(said))


@pytest.mark.parametrize(
    "limits", [(None,) * 3, ((-30.0, 45.0), (-70.0, 85.0), (-143.0, -20.0)), ((-1.0, 1.0),) * 3]
)
@pytest.mark.parametrize(
    ("field", "role"),
    [("abduction: [-1, 1]", "haa"), ("hip: [-1, 2]", "hfe"), ("knee: [1, 2]", "kfe")],
)
def test_no_note_tells_of_limits_that_are_overruled(
    field: str, role: str, limits: tuple[tuple[float, float] | None, ...], tmp_path: Path
) -> None:
    """Whatever the file has of them, what was assumed in their place does not hold any more.

    Notes of the other joints stay.
    """
    before = load_robot(write(tmp_path, replace(PLAIN, limits=limits).text()))
    said = load_robot(write(tmp_path, f"model: robot.urdf\n{field}\n", "mine.robot.yaml"))
    kept = [note for note in notes_of(before) if f"_{role}: " not in note]
    assert notes_of(said) == kept


def test_robot_yaml_says_which_are_the_legs(tmp_path: Path) -> None:
    """With five chains that could be legs, the person's four are; the fifth is locked."""
    fifth = PLAIN.text(legs="FL FR RL RR").replace("FL_", "fifth_").replace('xyz="0.3', 'xyz="0.1')
    fifth = fifth[fifth.index('<joint name="fifth_haa"') : fifth.index('<joint name="FR_haa"')]
    five = write(tmp_path, replace(PLAIN, extra=fifth).text(), "five.urdf")
    with pytest.raises(InputError, match="5 of its chains"):
        load_robot(five)
    legs = "".join(
        f"  {leg}: [{leg}_haa, {leg}_hfe, {leg}_kfe]\n" for leg in ("FL", "FR", "RL", "RR")
    )
    robot = load_robot(write(tmp_path, f"model: five.urdf\nlegs:\n{legs}", "five.robot.yaml"))
    assert robot.joint_names[0] == "FL_haa"
    assert any("fifth_haa" in note for note in notes_of(robot))


def test_boxes_of_hips_do_not_collide_with_each_other(tmp_path: Path) -> None:
    """Hips turn in place side by side: corners that their meshes do not have may overlap."""
    (tmp_path / "cube.obj").write_text(CUBE)
    text = PLAIN.text()
    for leg in ("FL", "FR"):
        link = f'<link name="{leg}_hip">'
        assert link in text
        text = text.replace(link, link + MESH.format("cube.obj"))
    robot = load_robot(write(tmp_path, text))
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, robot.url)
    plant.Finalize()
    left, right, shank = (
        plant.GetCollisionGeometriesForBody(plant.GetBodyByName(name))
        for name in ("FL_hip", "FR_hip", "RR_shank")
    )
    filtered = scene_graph.model_inspector().CollisionFiltered
    assert left and right and all(filtered(a, b) for a in left for b in right)
    assert shank and not any(filtered(a, b) for a in left for b in shank)


def test_a_thigh_that_tapers_is_thick_only_where_it_is(tmp_path: Path) -> None:
    """Two capsules: as thick as the mesh is at the hip and at the knee, and not beyond its end."""
    (tmp_path / "wedge.obj").write_text(WEDGE)
    mesh = MESH.format("wedge.obj")
    text = PLAIN.text().replace('<link name="RR_thigh">', f'<link name="RR_thigh">{mesh}')
    robot = load_robot(write(tmp_path, text))
    capsules = [s for s in collision_shapes(robot)["RR_thigh"] if isinstance(s, Capsule)]
    upper, lower = sorted(capsules, key=lambda s: -s.radius())
    assert upper.radius() == pytest.approx(0.08, rel=0.1)
    assert lower.radius() == pytest.approx(0.02, rel=0.1)
    # The knee is as thick as the thigh's lower end about it, shank or not.
    assert robot.shank_radii[3, 0] <= 0.02 + 1e-9


# A thigh of 0.3 m: 80 mm to every side at the hip, 20 mm below its middle.
WEDGE = "".join(
    f"v {x * w} {y * w} {z}\n"
    for z, w in ((0.0, 0.08), (-0.14, 0.08), (-0.16, 0.02), (-0.3, 0.02))
    for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))
) + "".join(
    f"f {4 * r + a + 1} {4 * r + (a + 1) % 4 + 1} {4 * r + 4 + a + 1}\n"
    f"f {4 * r + (a + 1) % 4 + 1} {4 * r + 4 + (a + 1) % 4 + 1} {4 * r + 4 + a + 1}\n"
    for r in range(3)
    for a in range(4)
)
