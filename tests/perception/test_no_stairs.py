"""What is not taken for stairs: kerbs, walls behind them, blocks, and steps unlike the others."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.perception.scenes import Scene, build_boxes, draw_scene, render
from benchmarks.perception.stairs import see
from drake_quad.common import FloatArray
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import DepthFrame, prepare_frame, stereo_accuracy
from drake_quad.perception.depth_noise import STEREO_NOISE, add_noise, draw_camera_errors
from drake_quad.perception.stair_evidence import wall_from
from drake_quad.perception.stair_fit import StairFit, StairPriors, StairShape, first_guess
from drake_quad.perception.stair_search import FoundStairs, alike_steps, find_stairs

MODEL = D435.model.decimated(2)
LOW, HIGH = (0.32, np.radians(15.0)), (0.95, np.radians(35.0))  # height, pitch
FLOOR = (-3.0, -8.0, -1.0, 14.0, 8.0, 0.0)
Camera = tuple[float, float]


def frame_of(boxes: FloatArray, camera: Camera, seed: int | None = None) -> DepthFrame:
    """The image of boxes: exact, or with a D435's noise."""
    height, pitch = camera
    R_LC = level_rotation(pitch=pitch)
    scene = Scene("none", np.zeros(0), np.zeros(1), 0.0, 0.0, (0.8, 0.8), boxes)
    depth = render(scene, MODEL, R_LC, height)
    if seed is not None:
        generator = np.random.default_rng(seed)
        errors = draw_camera_errors(STEREO_NOISE, D435, MODEL, generator)
        depth = add_noise(
            depth, noise=STEREO_NOISE, errors=errors, camera=D435, model=MODEL,
            generator=generator,
        )  # fmt: skip
    return prepare_frame(depth, MODEL, R_LC, stereo_accuracy(D435.disparity_scale()))


def search(
    boxes: FloatArray, camera: Camera, seed: int | None = None, least: int = 3
) -> FoundStairs | None:
    priors = replace(StairPriors(), floor=(-camera[0], 0.005))
    frame = frame_of(boxes, camera, seed)
    return find_stairs(frame, priors, np.random.default_rng(0), least=least)


def kerb(place: float, height: float) -> tuple[float, ...]:
    return (place, -8.0, -1.0, 14.0, 8.0, height)


def wall(place: float) -> tuple[float, ...]:
    return (place, -8.0, -1.0, place + 0.2, 8.0, 3.0)


@pytest.mark.parametrize("least", [2, 3])
def test_a_wall_behind_a_kerb_is_no_step(least: int) -> None:
    """A low camera sees a wall 0.36 m behind a kerb to the height of two steps, and no more."""
    assert search(np.array([FLOOR, kerb(0.79, 0.15), wall(1.15)]), LOW, least=least) is None


def test_two_steps_are_no_flight_unless_a_flight_is_known_to_be_there() -> None:
    """A block on a kerb has the shape of two steps; of three there is no doubt."""
    for count, least, told in ((2, 3, False), (2, 2, True), (3, 3, True)):
        places = 0.9 + 0.29 * np.arange(count)
        boxes = build_boxes(places, 0.16 * np.arange(count + 1))
        assert (search(boxes, HIGH, least=least) is not None) == told


def test_a_flight_that_ends_at_a_wall_ends_there() -> None:
    """Of four steps and a wall as deep as a run behind the last nosing, four are told at most."""
    boxes = build_boxes(0.9 + 0.29 * np.arange(4), 0.15 * np.arange(5))
    found = search(np.vstack([boxes, wall(0.9 + 0.29 * 4)]), HIGH)
    assert found is not None and 3 <= found.fit.shape.steps <= 4


def _even(camera: Camera, frame: DepthFrame, count: int) -> StairFit:
    shape = StairShape(count, up=True)
    theta = first_guess(
        shape, first=0.9, floor=-camera[0], rise=0.15, run=0.29, yaw=0.0, priors=StairPriors(),
        nodes=frame.grid[0] * frame.grid[1],
    )  # fmt: skip
    theta[2 * count + 2] = 0.0  # no overhang
    return StairFit(shape, theta, np.eye(len(theta)), 0.0, 1.0)


def test_a_wall_is_told_from_the_steps_before_it() -> None:
    """Steps that are there are free of walls; the first that a wall stands for is named."""
    boxes = build_boxes(0.9 + 0.29 * np.arange(3), 0.15 * np.arange(4))
    frame = frame_of(boxes, HIGH)
    assert wall_from(frame, _even(HIGH, frame, 3), StairPriors()) is None
    frame = frame_of(np.vstack([boxes, wall(0.9 + 0.29 * 3)]), HIGH)
    assert wall_from(frame, _even(HIGH, frame, 4), StairPriors()) == 4


def test_a_step_unlike_the_others_ends_what_is_one_flight() -> None:
    """Rises, and runs, that differ by more than 50 mm are of two things."""
    frame = frame_of(np.array([FLOOR]), HIGH)
    fit = _even(HIGH, frame, 5)
    assert alike_steps(fit) == 5
    for index, by, steps in ((8, 0.06, 2), (3, 0.06, 3), (9, 0.02, 5)):
        theta = np.array(fit.theta)
        theta[index] += by  # heights begin with index 5: 8 is that of the third tread
        assert alike_steps(replace(fit, theta=theta)) == steps


@pytest.mark.parametrize("camera", [LOW, HIGH])
def test_clutter_is_no_stairs(camera: Camera) -> None:
    """In twelve drawn scenes of walls, blocks, kerbs and tables nothing is found."""
    for seed in range(12):
        scene = draw_scene("none", np.random.default_rng([77, seed]))
        assert search(scene.boxes, camera, seed) is None


def test_on_a_known_flight_steps_may_be_unlike_each_other() -> None:
    """A third step 80 mm higher than the others is told there; elsewhere it is no step."""
    boxes = build_boxes(0.8 + 0.29 * np.arange(3), np.array([0.0, 0.12, 0.24, 0.44]))
    known = search(boxes, HIGH, least=2)
    assert known is not None and known.fit.shape.steps == 3
    assert search(boxes, HIGH, least=3) is None


def test_a_step_too_many_is_not_added_to_a_flight_that_is_tracked() -> None:
    """Nine steps down, 3 m away at their end: with a tenth the others would be bent to fit.

    Of 4056 drawn images this is the one in which too many steps were told.
    """
    generator = np.random.default_rng([2, 1399])
    scene = draw_scene("down", generator)
    told = see(scene, "paper", generator)
    assert told["found"] and len(scene.places) == 9
    assert not told["over"] and not told["under"] and not told["gross"]
