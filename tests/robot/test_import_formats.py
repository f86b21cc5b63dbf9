"""The same robot told as URDF, SDF and MJCF is the same robot."""

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
