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
    edges_of,
    shadowed,
    smooth_field,
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
    assert not edges_of(D435.disparity_scale() / floor()).any()
    assert np.allclose(noisy(floor(), noise), floor(), rtol=1e-12)


def test_an_offset_moves_every_disparity_alike() -> None:
    """1 / z moves by offset / (f B)."""
    errors = CameraErrors(np.zeros(SHAPE), 0.2, np.zeros(3))
    seen = add_noise(
        floor(), noise=IDEAL_DEPTH, errors=errors, camera=D435, model=MODEL,
        generator=np.random.default_rng(0),
    )  # fmt: skip
    assert np.allclose(D435.disparity_scale() * (1 / seen - 1 / floor()), 0.2)


def test_near_things_grow_and_shade_what_is_behind_to_their_left() -> None:
    """A block before a wall: its sides only move outwards, and the shadow is left of it."""
    disparity = np.full((20, 60), 4.0)
    disparity[5:15, 30:40] = 12.0
    hidden = shadowed(disparity)
    assert hidden[10, 22:30].sum() >= 7 and not hidden[10, 30:].any()
    assert not hidden[:5].any()


@pytest.mark.parametrize("length", [0.5, 2.0, 20.0])
def test_smooth_fields_have_unit_deviation(length: float) -> None:
    """Over many fields, for short and long lengths."""
    drawn = [smooth_field((80, 120), length, np.random.default_rng(i)) for i in range(30)]
    assert np.sqrt(np.mean(np.square(drawn))) == pytest.approx(1.0, rel=0.12)
