"""Pictures' meshes: coarser without moving, smooth but for edges, written as Drake shows them."""

from pathlib import Path

import numpy as np
import pytest

from drake_quad.robot.importer.meshes import (
    coarsen,
    corner_normals,
    have_trimesh,
    hull_as_obj,
    read_points,
    write_surface,
)


def ball(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A sphere of radius 1 of 2 rings² triangles, its vertices told twice along a seam."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, rings + 1), np.linspace(0, np.pi, rings + 1))
    points = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], -1).reshape(-1, 3)
    k = (np.arange(rings)[:, None] * (rings + 1) + np.arange(rings)).ravel()
    faces = np.concatenate(
        [np.stack([k, k + rings + 1, k + 1], 1), np.stack([k + 1, k + rings + 1, k + rings + 2], 1)]
    )
    return points, faces


def test_coarser_mesh_has_few_faces_and_the_same_shape() -> None:
    """No more faces than asked for, and no vertex far from the surface."""
    points, faces = coarsen(*ball(100), most=2000)
    assert 500 < len(faces) <= 2000
    assert np.abs(np.linalg.norm(points, axis=1) - 1.0).max() < 0.05
    assert faces.max() == len(points) - 1 and faces.min() == 0


def test_small_mesh_stays() -> None:
    """What has few faces keeps its vertices, told once."""
    points, faces = ball(12)
    found, kept = coarsen(points, faces, most=2000)
    assert len(kept) == 2 * 12 * 11  # without those of no area at the poles
    assert np.abs(np.linalg.norm(found, axis=1) - 1.0).max() < 1e-9


def test_normals_of_a_ball_point_outward_and_those_of_a_cube_stay_apart() -> None:
    """Smooth where faces meet at small angles; at right angles each face has its own."""
    points, faces = coarsen(*ball(24), most=10**6)
    normals = corner_normals(points, faces)
    assert np.sum(normals * points[faces], axis=2).min() > 0.97
    corners = np.array(np.meshgrid(*3 * [[0.0, 1.0]], indexing="ij")).reshape(3, -1).T
    square = np.array([[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1]])  # x = 0 and y = 0
    own = corner_normals(corners, square)
    np.testing.assert_allclose(own[:2], np.tile([-1.0, 0.0, 0.0], (2, 3, 1)), atol=1e-12)
    np.testing.assert_allclose(own[2:], np.tile([0.0, -1.0, 0.0], (2, 3, 1)), atol=1e-12)


def test_written_surface_is_read_back(tmp_path: Path) -> None:
    """The file holds the same points; its hull is the ball's."""
    points, faces = coarsen(*ball(16), most=10**6)
    write_surface(tmp_path / "ball.obj", points, faces)
    found = read_points(tmp_path / "ball.obj")
    assert found is not None
    np.testing.assert_allclose(found, points, atol=1e-5)
    hull = hull_as_obj(tmp_path / "ball.obj", tmp_path)
    assert hull is not None
    corners = read_points(hull)
    assert corners is not None and np.abs(np.linalg.norm(corners, axis=1) - 1).max() < 1e-5


def test_broken_mesh_is_none(tmp_path: Path) -> None:
    """What holds no surface, or none that can be read, gives None instead of an error."""
    for name, data in (
        ("a.obj", b"nothing"),
        ("b.stl", b"\0" * 90),
        ("c.dae", b"<x"),
        ("d.xyz", b""),
    ):
        (tmp_path / name).write_bytes(data)
        assert hull_as_obj(tmp_path / name, tmp_path) is None


@pytest.mark.skipif(not have_trimesh(), reason="trimesh is not installed")
def test_stl_is_read(tmp_path: Path) -> None:
    """A binary .stl has the vertices of its triangles."""
    record = np.zeros(1, dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    record["v"][0] = [[0, 0, 0], [1, 0, 0], [0, 2, 0]]
    header = b"\0" * 80 + np.uint32(1).tobytes()
    (tmp_path / "t.stl").write_bytes(header + record.tobytes())
    points = read_points(tmp_path / "t.stl")
    assert points is not None
    np.testing.assert_allclose(np.unique(points, axis=0), [[0, 0, 0], [0, 2, 0], [1, 0, 0]])
