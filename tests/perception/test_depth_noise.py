"""What the noise model does to images whose truth is known."""

import numpy as np
import pytest

from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import D435
from drake_quad.perception.depth_noise import (
    IDEAL_DEPTH,
    CameraErrors,
    StereoNoise,
    add_noise,
    draw_camera_errors,
    draw_field,
)

MODEL = D435.model.decimated(4)
SHAPE = (MODEL.height, MODEL.width)


def noisy(depth: FloatArray, noise: StereoNoise, seed: int = 0) -> FloatArray:
    generator = np.random.default_rng(seed)
    errors = draw_camera_errors(noise, D435, MODEL, generator)
    return add_noise(
        depth, noise=noise, errors=errors, camera=D435, model=MODEL, generator=generator
    )


def floor() -> FloatArray:
    """A slanted plane whose disparity grows by some 0.4 px of the camera from row to row."""
    rows = np.linspace(8.0, 20.0, SHAPE[0])[:, np.newaxis] * np.ones(SHAPE)
    return np.asarray(D435.disparity_scale() / rows)


def test_the_ideal_camera_changes_nothing_within_its_range() -> None:
    """Depths come back to rounding; what is out of range has none."""
    depth = floor()
    depth[0, 0], depth[0, 1], depth[0, 2] = 50.0, 0.05, np.inf
    seen = noisy(depth, IDEAL_DEPTH)
    assert np.all(seen[0, :3] == 0.0)
    assert np.allclose(seen[1:], depth[1:], rtol=1e-12)


def test_a_slanted_plane_has_no_edges() -> None:
    """Neither growth nor flying pixels touch it, however fast its disparity changes."""
    noise = StereoNoise(white=0.0, pattern=0.0, offset=0.0, tilt=0.0, holes=0.0, step=0.0)
    assert np.allclose(noisy(floor(), noise), floor(), rtol=1e-12)


def test_an_offset_moves_every_disparity_alike() -> None:
    """1 / z moves by offset / (f B)."""
    errors = CameraErrors(np.zeros(SHAPE), 0.2, np.zeros(3))
    seen = add_noise(
        floor(), noise=IDEAL_DEPTH, errors=errors, camera=D435, model=MODEL,
        generator=np.random.default_rng(0),
    )  # fmt: skip
    assert np.allclose(D435.disparity_scale() * (1 / seen - 1 / floor()), 0.2)


def test_a_share_of_pixels_has_no_depth() -> None:
    """Over many images, that share in the mean."""
    noise = StereoNoise(
        white=0.0, pattern=0.0, offset=0.0, tilt=0.0, fattening=0.0, flying=0.0, shadow=False,
        holes=0.05, step=0.0,
    )  # fmt: skip
    share = np.mean([np.mean(noisy(floor(), noise, seed) == 0.0) for seed in range(40)])
    assert share == pytest.approx(0.05, rel=0.1)


def test_white_noise_errs_alike_in_disparity_wherever_the_surface_is() -> None:
    """Its deviation is that of the camera's figure, near and far."""
    noise = StereoNoise(
        white=0.08, pattern=0.0, offset=0.0, tilt=0.0, fattening=0.0, flying=0.0, shadow=False,
        holes=0.0, step=0.0,
    )  # fmt: skip
    scale = D435.disparity_scale()
    errors = np.array([scale / noisy(floor(), noise, i) - scale / floor() for i in range(20)])
    for part in (errors[:, :40], errors[:, -40:]):
        assert np.sqrt(np.mean(part**2)) == pytest.approx(0.08, rel=0.05)


@pytest.mark.parametrize("length", [0.5, 2.0, 4.0, 7.0, 20.0])
def test_smooth_fields_have_unit_deviation(length: float) -> None:
    """Over many fields, for short and long lengths."""
    drawn = [
        draw_field((80, 120), length, np.random.default_rng(i)).at_pixels(80, 120)
        for i in range(120)
    ]
    assert np.sqrt(np.mean(np.square(drawn))) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("length", [2.0, 4.0, 8.0])
def test_smooth_fields_are_alike_over_their_length(length: float) -> None:
    """Smoothed white noise is correlated by exp(-d^2 / (4 length^2)) at distance d."""
    fields = [
        draw_field((160, 160), length, np.random.default_rng(i)).at_pixels(160, 160)
        for i in range(40)
    ]
    distance = int(2 * length)
    alike = np.mean([np.mean(f[:, distance:] * f[:, :-distance]) for f in fields])
    assert alike == pytest.approx(np.exp(-1.0), abs=0.06)
