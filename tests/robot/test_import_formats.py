"""The same robot told as URDF, SDF and MJCF is the same robot."""

import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from import_rig import compare, write
from robot_formats import FORMATS, figures, mjcf, sdf, urdf

from drake_quad.errors import InputError
from drake_quad.robot.loader import load_robot

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize("name", FORMATS)
def test_format_does_not_matter(name: str, tmp_path: Path) -> None:
    """Geometry, limits, efforts, masses: the same from each format, and the dynamics exact."""
    path = write(tmp_path, FORMATS[name](), name)
    robot = load_robot(path)
    expected = load_robot(write(tmp_path, urdf(), "plain.urdf"))
    np.testing.assert_allclose(figures(robot), figures(expected), atol=1e-9)
    assert robot.joint_names == expected.joint_names
    assert np.all(robot.speed == (10.0 if name == "r.xml" else 9.0))
    (tmp_path / "normal").mkdir()
    own, made = compare(path, tmp_path / "normal", np.random.default_rng(8))
    np.testing.assert_allclose(made.matrix, own.matrix, atol=1e-9)


FRICTION = {  # of every shank's joint, in each format
    "r.urdf": ('effort="70" velocity="9"/>', '<dynamics friction="{}"/>'),
    "r.sdf": (
        "<effort>70</effort><velocity>9</velocity></limit>",
        "<dynamics><friction>{}</friction></dynamics>",
    ),
    "r.xml": ('<joint range="-150 -20"', ' frictionloss="{}"'),
}


def with_friction(name: str, value: str) -> str:
    """The robot in a format, with this friction in its shanks' joints."""
    text, (after, more) = FORMATS[name](), FRICTION[name]
    assert after in text
    return text.replace(after, after + more.format(value))


@pytest.mark.parametrize("name", FORMATS)
def test_friction_of_joints_is_read_and_changes_nothing_else(
    name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Each format's own way to say it; and Drake, which simulates none, is not heard to warn."""
    robot = load_robot(write(tmp_path, with_friction(name, "0.7"), name))
    assert np.array_equal(robot.joint_friction, np.tile([0.0, 0.0, 0.7], 4))
    without = load_robot(write(tmp_path, FORMATS[name](), f"plain_{name}"))
    assert not without.joint_friction.any()
    np.testing.assert_array_equal(figures(robot), figures(without))
    assert not [record for record in caplog.records if "friction" in record.getMessage()]


@pytest.mark.parametrize("value", ["-0.7", "much", "1e9"])
@pytest.mark.parametrize("name", FORMATS)
def test_a_friction_that_no_joint_has_is_refused(name: str, value: str, tmp_path: Path) -> None:
    """One line names the joint, the value and what would be right."""
    with pytest.raises(InputError, match="friction") as refusal:
        load_robot(write(tmp_path, with_friction(name, value), name))
    assert value in str(refusal.value)


def test_a_robot_in_normal_form_has_its_friction_checked_too(tmp_path: Path) -> None:
    """A file that is parsed as it is, without being imported, is not believed more."""
    text = resources.files("drake_quad_models").joinpath("paper_quadruped.urdf").read_text()
    fine = load_robot(write(tmp_path, text.replace('friction="0"', 'friction="0.5"')))
    assert np.all(fine.joint_friction == 0.5)
    with pytest.raises(InputError, match="friction"):
        load_robot(write(tmp_path, text.replace('friction="0"', 'friction="-0.5"', 1), "bad.urdf"))


@pytest.mark.parametrize("actuator", ["motor", "position", "general"])
@pytest.mark.parametrize("default", ["motor", "position", "velocity", "general"])
def test_actuators_of_a_class_share_its_defaults(
    default: str, actuator: str, tmp_path: Path
) -> None:
    """As in MuJoCo: whatever kind of actuator a class tells a limit for, all kinds of it have it.

    What only one kind knows, such as a gain, does no harm to another.
    """
    gain = ' kp="30"' if default == "position" else ""
    text = mjcf().replace("<motor ctrlrange", f"<{default}{gain} forcerange")
    text = text.replace("<motor class", f"<{actuator} class")
    robot = load_robot(write(tmp_path, text, "r.xml"))
    expected = load_robot(write(tmp_path, mjcf(), "plain.xml"))
    np.testing.assert_array_equal(robot.effort, expected.effort)


def test_two_joints_of_a_body_are_those_of_two_bodies(tmp_path: Path) -> None:
    """As MuJoCo reads it: abduction turns outermost, and both are where the body is.

    The other file has the same joints in two bodies, the inner one of which has all the mass.
    """
    apart, legs = re.subn(
        r'(<body name="\w+_hip" pos="[^"]*")><inertial[^>]*>(<joint[^>]*>)'
        r'(<body name="\w+_thigh") pos="[^"]*">',
        r'\1 axisangle="1 0 0 20">\2\3>',
        mjcf(),
    )
    together = re.sub(
        r'<body name="\w+_hip"([^>]*)>(<joint[^>]*>)(<body name="\w+_thigh")>', r"\3\1>\2", apart
    ).replace("</body></body></body>", "</body></body>")
    assert legs == 4 and together.count("<body") == 9
    robot = load_robot(write(tmp_path, together, "r.xml"))
    expected = load_robot(write(tmp_path, apart, "apart.xml"))
    np.testing.assert_allclose(figures(robot), figures(expected), atol=1e-12)
    assert robot.joint_names == expected.joint_names
    np.testing.assert_allclose(np.abs(robot.geometry.p_BH[:, :2]), [[0.3, 0.1]] * 4, atol=1e-9)


def test_mjcf_that_includes_another_is_one(tmp_path: Path) -> None:
    """A scene that includes the robot is the robot; the scene's own floor is not its."""
    write(tmp_path, mjcf(), "r.xml")
    scene = '<mujoco><include file="r.xml"/><worldbody><light pos="0 0 3"/></worldbody></mujoco>'
    robot = load_robot(write(tmp_path, scene, "scene.xml"))
    expected = load_robot(str(tmp_path / "r.xml"))
    np.testing.assert_array_equal(figures(robot), figures(expected))


def test_world_with_other_things_in_it_is_the_robots(tmp_path: Path) -> None:
    """Of several models in an SDF world that of most links is the robot; a ball alone is none."""
    ball = (
        f'<model name="ball">{sdf()[sdf().index("<link") : sdf().index("</link>")]}</link></model>'
    )
    world = (
        sdf().replace("<model", '<world name="w"><model').replace("</sdf>", f"{ball}</world></sdf>")
    )
    robot = load_robot(write(tmp_path, world, "world.sdf"))
    assert robot.mass == pytest.approx(9.0 + 4 * 2.4)
    with pytest.raises(InputError, match="four legs"):
        load_robot(write(tmp_path, f'<sdf version="1.9">{ball}</sdf>', "ball.sdf"))
