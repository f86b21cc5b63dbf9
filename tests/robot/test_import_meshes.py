"""Meshes of any kind on a robot: those that cannot be read are dropped, and it stands without."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from import_rig import write
from pydrake.geometry import Box
from robot_formats import mjcf, sdf
from test_import_repairs import CUBE, collision_shapes, notes_of

from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel

CONVEX = "<drake:declare_convex/>"


pytestmark = pytest.mark.usefixtures("own_cache")


def with_cube(folder: Path, kind: str = "collision", more: str = "") -> RobotModel:
    """The sample SDF, its trunk with a mesh that is in the folder."""
    mesh = f"<geometry><mesh><uri>cube.obj</uri>{more}</mesh></geometry>"
    text = sdf().replace("</inertial>", f'</inertial><{kind} name="p">{mesh}</{kind}>', 1)
    return load_robot(write(folder, text, "r.sdf"))


@pytest.mark.parametrize("kind", ["collision", "visual"])
def test_mesh_declared_convex_is_a_mesh(kind: str, tmp_path: Path) -> None:
    """On the trunk its box is as great as that of the mesh; as a picture it is the mesh."""
    write(tmp_path, CUBE, "cube.obj")
    robot = with_cube(tmp_path, kind, CONVEX)
    if kind == "visual":
        assert "cube" in Path(robot.url).read_text()
        return
    (box,) = collision_shapes(robot)["body"]
    assert isinstance(box, Box)
    np.testing.assert_allclose(box.size(), (1.0, 2.0, 3.0))


@pytest.mark.parametrize("line", ["v a b c", "v 1 2", "v 1 2 nan", "v 1 2 1e300"])
def test_mesh_with_a_bad_vertex_is_dropped(line: str, tmp_path: Path) -> None:
    """It cannot be read, which is told."""
    write(tmp_path, f"{CUBE}{line}\n", "cube.obj")
    robot = with_cube(tmp_path)
    assert "mesh cube.obj cannot be read" in "\n".join(notes_of(robot))
    asset = '<asset><mesh name="cube" file="cube.obj"/></asset><worldbody>'
    text = mjcf().replace("<worldbody>", asset)
    text = text.replace("<freejoint/>", '<freejoint/><geom type="mesh" mesh="cube"/>')
    robot = load_robot(write(tmp_path, text, "r.xml"))
    assert "mesh cube.obj cannot be read" in "\n".join(notes_of(robot))


def test_mesh_that_may_not_be_read_is_no_fault_of_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever keeps one from a mesh, the robot stands without."""
    path = write(tmp_path, CUBE, "cube.obj")
    opened = os.open

    def forbidden(given: Any, *options: Any, **more: Any) -> int:
        if str(given) == path:
            raise PermissionError(13, "Permission denied")
        return opened(given, *options, **more)

    monkeypatch.setattr(os, "open", forbidden)
    robot = with_cube(tmp_path)
    assert "mesh cube.obj cannot be read" in "\n".join(notes_of(robot))
