"""A fit comes to rest at the truth where images are exact, whatever it began from."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.perception.scenes import Scene, build_boxes, render
from benchmarks.perception.upright import HEIGHT, MODEL, PITCH, errors_of, look
from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import prepare_frame, stereo_accuracy
from drake_quad.perception.depth_noise import IDEAL_DEPTH
from drake_quad.perception.stair_belief import NORMAL_95
from drake_quad.perception.stair_evidence import crop
from drake_quad.perception.stair_fit import (
    StairFit,
    StairPriors,
    StairShape,
    first_guess,
    fit_stairs,
)
from drake_quad.perception.stair_profile import NUISANCES, OVERHANG

N, FIRST, RISE, RUN = 6, 0.22, 0.13, 0.49
PRIORS = replace(StairPriors(), floor=(-HEIGHT, 0.005))


def fitted(overhang: float, passes: int) -> tuple[FloatArray, FloatArray, float]:
    """Errors of places and heights [m], and the overhang, of an exact image of six deep steps."""
    places, heights = FIRST + RUN * np.arange(N), RISE * np.arange(N + 1)
    boxes = build_boxes(places, heights, left=1.0, right=1.0)
    scene = Scene("up", places, heights, 0.0, 0.0, (1.0, 1.0), boxes)
    R_LC = level_rotation(pitch=PITCH)
    depth = render(scene, MODEL, R_LC, HEIGHT)
    frame = prepare_frame(depth, MODEL, R_LC, stereo_accuracy(D435.disparity_scale()))
    shape = StairShape(N, up=True)
    theta = first_guess(
        shape, first=FIRST, floor=-HEIGHT, rise=RISE, run=RUN, yaw=0.0, priors=PRIORS,
        nodes=frame.grid[0] * frame.grid[1],
    )  # fmt: skip
    theta[2 * N + 1 + OVERHANG] = overhang
    assert len(theta) == 2 * N + 1 + NUISANCES + frame.grid[0] * frame.grid[1]
    guess = StairFit(shape, theta, np.eye(len(theta)), 0.0, 1.0)
    fit = fit_stairs(crop(frame, guess, (-0.7, 0.7)), shape, theta, PRIORS, (6.0,) * passes)
    assert fit is not None
    return fit.places - places, fit.heights - heights + HEIGHT, fit.other(OVERHANG)


@pytest.mark.parametrize("overhang", [0.0, 0.008])
@pytest.mark.parametrize("passes", [3, 4])
def test_an_exact_image_is_fitted_exactly(overhang: float, passes: int) -> None:
    """Places to 2 mm, heights to 0.3 mm, no overhang: after odd and even passes alike.

    What is left is the pull of the priors, of which the run is far from this flight's.
    """
    places, heights, found = fitted(overhang, passes)
    assert np.abs(places).max() < 0.002 and np.abs(heights).max() < 3e-4
    assert found < 5e-4


def test_beliefs_of_exact_images_have_no_bias() -> None:
    """Of four drawn flights places err by 0.2 deviations at most, and heights by 0.15."""
    for i in range(4):
        scene, belief = look(np.random.default_rng([5, i]), IDEAL_DEPTH)
        assert belief is not None
        rows = errors_of(scene, belief)
        for name, most in (("place", 0.2), ("height", 0.15)):
            error, sigma = np.array(rows[name]).T
            assert np.abs(error / sigma).max() < most


@pytest.mark.slow
def test_intervals_of_a_camera_held_upright_hold() -> None:
    """Of 40 drawn flights at least 90 % of places and heights lie within their 95 % intervals."""
    inside: dict[str, list[bool]] = {"place": [], "height": []}
    for i in range(40):
        scene, belief = look(np.random.default_rng([11, i]))
        assert belief is not None and belief.count_least <= len(scene.places)
        rows = errors_of(scene, belief)
        for name, found in inside.items():
            found += [abs(error) <= NORMAL_95 * sigma for error, sigma in rows[name]]
    assert np.mean(inside["place"]) >= 0.9 and np.mean(inside["height"]) >= 0.9
