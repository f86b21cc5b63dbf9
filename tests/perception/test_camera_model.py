"""Laws of the pinhole model."""

import numpy as np
import pytest

from drake_quad.errors import InputError
from drake_quad.perception.camera_model import D435, CameraModel, level_rotation, make_camera


def test_decimation_keeps_what_the_image_shows() -> None:
    """A large pixel looks along the middle of the pixels that it is made of, for every factor."""
    model = D435.model
    for k in (2, 4):
        rays = model.rays().reshape(model.height // k, k, model.width // k, k, 3)
        assert np.allclose(rays.mean(axis=(1, 3)), model.decimated(k).rays(), atol=1e-12)


def test_a_camera_held_upright_sees_the_same_rays_turned() -> None:
    """What was left in its image is below: each ray's x is -y of the same pixel, its y is x."""
    model = CameraModel(width=64, height=48, fx=50.0, fy=40.0, cx=30.0, cy=25.0)
    rays, upright = model.rays(), model.turned().rays()
    turned = np.stack([rays[..., 1], -rays[..., 0], rays[..., 2]], axis=-1)
    assert np.allclose(upright, np.rot90(turned), atol=1e-12)


def test_drakes_principal_point_is_half_a_pixel_on() -> None:
    """A camera with its axis in the middle of the image has w / 2 there, w / 2 - 1 / 2 here."""
    model = make_camera(width=640, height=480, horizontal_view=1.2)
    assert model.drake_principal_point == (320.0, 240.0)
    assert model.rays()[:, :, 0].sum() == pytest.approx(0.0, abs=1e-9)


def test_a_level_camera_sees_ahead_left_and_up() -> None:
    """R_LC is a rotation; at no tilt the optical axis is x, the image's right is -y, down is -z."""
    assert np.allclose(level_rotation(pitch=0.0), [[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    R = level_rotation(pitch=0.6, roll=0.3)
    assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1.0)
    assert R[2, 2] == pytest.approx(-np.sin(0.6))


@pytest.mark.parametrize("field", ["fx", "fy", "cx", "cy"])
def test_absurd_intrinsics_are_refused(field: str) -> None:
    """A figure that is not finite, or far out of bounds, is named with its bounds."""
    for value in (float("nan"), -1.0, 1e9):
        figures = {"fx": 400.0, "fy": 400.0, "cx": 320.0, "cy": 240.0, field: value}
        with pytest.raises(InputError, match=field):
            CameraModel(width=640, height=480, **figures).check(source="--intrinsics")
