"""Stairs drawn and rendered exactly, with a camera's errors or without, come back as they are."""

import numpy as np
import pytest

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.calibration import EVEN, deviation_factors
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import (
    IDEAL_DEPTH,
    STEREO_NOISE,
    StereoNoise,
    add_noise,
    draw_camera_errors,
)
from drake_quad.perception.stair_tracker import CameraPose, StairTracker

MODEL = D435.model.decimated(2)


def flight(*, rise: float, run: float, first: float, count: int, yaw: float = 0.0) -> Scene:
    places = first + run * np.arange(count)
    heights = rise * np.arange(count + 1)
    boxes = build_boxes(places, heights)
    return Scene("up" if rise > 0 else "down", places, heights, yaw, 0.0, (0.8, 0.8), boxes)


def look(
    scene: Scene, *, height: float, pitch: float, noise: StereoNoise = STEREO_NOISE, seed: int = 0
) -> tuple[FloatArray, CameraPose]:
    generator = np.random.default_rng(seed)
    errors = draw_camera_errors(noise, D435, MODEL, generator)
    R_LC = level_rotation(pitch=np.radians(pitch))
    depth = render(scene, MODEL, R_LC @ rotation_exp(*errors.tilt), height)
    seen = add_noise(
        depth, noise=noise, errors=errors, camera=D435, model=MODEL, generator=generator
    )
    return seen, CameraPose(R_LC, np.array([0.0, 0.0, height]))


def tracker() -> StairTracker:
    return StairTracker(model=MODEL, accuracy=stereo_accuracy(D435.disparity_scale()))


FEET = np.array([[0.1, 0.2, 0.0], [0.1, -0.2, 0.0]])


@pytest.mark.parametrize(("height", "pitch"), [(0.95, 35.0), (0.32, 15.0)])
def test_an_ideal_camera_gives_the_stairs_to_millimetres(height: float, pitch: float) -> None:
    """Without noise, the next nosings are found to 6 mm, rise and run to 3 mm, from both robots."""
    scene = flight(rise=0.17, run=0.29, first=0.9, count=6, yaw=np.radians(8.0))
    belief = tracker().update(
        *look(scene, height=height, pitch=pitch, noise=IDEAL_DEPTH), feet=FEET
    )
    assert belief is not None and belief.going_up
    assert np.abs(belief.places[:2] - scene.places[:2]).max() < 0.006
    assert np.abs(belief.heights[:2] - scene.heights[:2]).max() < 0.004
    assert abs(belief.rise - 0.17) < 0.003 and abs(belief.run - 0.29) < 0.003
    assert abs(belief.yaw - scene.yaw) < np.radians(0.2)


def test_a_flight_down_is_seen_from_its_landing() -> None:
    """With a D435's noise, the first edge and the rise come out within four stated deviations."""
    scene = flight(rise=-0.17, run=0.29, first=0.7, count=5)
    belief = tracker().update(*look(scene, height=0.95, pitch=45.0), feet=FEET)
    assert belief is not None and not belief.going_up
    assert abs(belief.places[0] - 0.7) < 4.0 * belief.place_sigmas[0]
    assert abs(belief.rise + 0.17) < 4.0 * belief.sigma("rise")


def test_no_more_steps_are_told_than_there_are() -> None:
    """What lies beyond the landing is no step."""
    scene = flight(rise=0.16, run=0.30, first=0.8, count=3)
    belief = tracker().update(*look(scene, height=0.95, pitch=30.0), feet=FEET)
    assert belief is not None and belief.count_least == 3
    assert belief.count_most in (3, None)


def test_a_floor_with_a_wall_is_no_stairs() -> None:
    """Level ground, a wall and a box on it are refused."""
    boxes = np.array(
        [
            (-3.0, -8.0, -1.0, 14.0, 8.0, 0.0),
            (2.0, -8.0, -1.0, 2.2, 8.0, 3.0),
            (1.2, -0.3, 0.0, 1.5, 0.4, 0.25),
        ]
    )
    scene = Scene("none", np.zeros(0), np.zeros(1), 0.2, 0.0, (8.0, 8.0), boxes)
    assert tracker().update(*look(scene, height=0.95, pitch=35.0), feet=FEET) is None


def test_the_same_image_gives_the_same_belief_to_the_bit() -> None:
    """Nothing is drawn but from a fixed seed."""
    scene = flight(rise=0.15, run=0.30, first=0.8, count=5)
    image = look(scene, height=0.95, pitch=35.0)
    one, other = (tracker().update(*image, feet=FEET) for _ in range(2))
    assert one is not None and other is not None
    assert np.array_equal(one.places, other.places)
    assert np.array_equal(one.covariance, other.covariance)


def test_tracking_follows_the_camera_past_steps() -> None:
    """As the camera climbs, steps behind it count as passed, and the next ones stay in place."""
    scene = flight(rise=0.15, run=0.30, first=0.8, count=6)
    depth, pose = look(scene, height=0.95, pitch=35.0)
    belief = tracker().update(depth, pose, feet=FEET)
    assert belief is not None
    for k in range(1, 7):
        x, z = 0.15 * k, 0.95 + 0.06 * k
        moved = Scene("up", scene.places - x, scene.heights, 0.0, 0.0, (0.8, 0.8),
                      scene.boxes - np.array([x, 0, 0, x, 0, 0]))  # fmt: skip
        depth, pose = look(moved, height=z, pitch=35.0, seed=k)
        pose = CameraPose(pose.R_WC, np.array([x, 0.0, z]))
        belief = tracker().update(depth, pose, stamp=0.1 * k, last=belief)
        assert belief is not None
        n = min(2, len(belief.places))
        true = scene.places[belief.passed :][:n] - x
        assert np.abs(belief.places[:n] - true).max() < 0.04
    assert belief.passed >= 1 and belief.count_least == 6


def test_tracking_goes_along_with_a_camera_that_moves_aside() -> None:
    """The sides of the flight stay where they are in W, so the pixels that count are its own."""
    scene = flight(rise=0.15, run=0.30, first=0.8, count=4)
    depth, pose = look(scene, height=0.95, pitch=35.0)
    before = tracker().update(depth, pose, feet=FEET)
    assert before is not None
    y = 0.3
    moved = Scene("up", scene.places, scene.heights, 0.0, 0.0, (0.8 - y, 0.8 + y),
                  scene.boxes - np.array([0, y, 0, 0, y, 0]))  # fmt: skip
    depth, pose = look(moved, height=0.95, pitch=35.0)
    pose = CameraPose(pose.R_WC, np.array([0.0, y, 0.95]))
    after = tracker().update(depth, pose, stamp=0.1, last=before)
    assert after is not None
    assert (after.right + y, after.left + y) == pytest.approx((before.right, before.left), abs=0.02)
    assert np.abs(after.places - scene.places[: len(after.places)]).max() < 0.02


def test_feet_say_nothing_of_the_height_of_camera_and_robot() -> None:
    """Both have the base's error: a foot on a tread leaves it in all heights as it is."""
    image, pose = look(flight(rise=0.15, run=0.30, first=0.8, count=4), height=0.95, pitch=35.0)
    unsure = CameraPose(pose.R_WC, pose.p_WC, place_sigmas=np.array([0.0, 0.0, 0.03]))
    feet = np.array([*FEET, [0.95, 0.1, 0.15]])
    belief = tracker().update(image, unsure, feet=feet)
    assert belief is not None and np.all(belief.height_sigmas >= 0.03)


@pytest.mark.parametrize("off", [-1.0, 1.0])
def test_an_attitude_that_is_an_estimate_may_be_off_by_its_deviation(off: float) -> None:
    """Pitch off by 1 deg and known to 0.56: nosings to 3 mm of an exact image; by 12 mm if untold.

    The filter errs by up to 0.56 deg where nobody tells it that it stands on level ground. The fit
    takes the tilt from the image, if it may; else it puts the stairs where they are not.
    """
    scene = flight(rise=0.15, run=0.30, first=0.8, count=5)
    image, true = look(scene, height=0.95, pitch=35.0, noise=IDEAL_DEPTH)
    R = rotation_exp(0.0, float(np.radians(off)), 0.0)
    feet = (FEET - true.p_WC) @ R.T + true.p_WC
    error = {}
    for told in (0.0, 0.56):
        sigmas = np.radians([told, told, 0.0])
        belief = tracker().update(image, CameraPose(R @ true.R_WC, true.p_WC, sigmas), feet=feet)
        assert belief is not None and len(belief.places) == 5
        error[told] = float(np.abs(belief.places - scene.places).max())
    assert error[0.56] < 0.003 and error[0.0] > 0.012


def test_what_the_place_and_heading_of_the_camera_lack_is_added_to_the_belief() -> None:
    """Places and heights err together by the camera's place, yaw by its heading; nothing else."""
    image, pose = look(flight(rise=0.15, run=0.30, first=0.8, count=4), height=0.95, pitch=35.0)
    unsure = CameraPose(
        pose.R_WC, pose.p_WC, np.array([0.0, 0.0, 3e-3]), np.array([0.01, 0.5, 0.02])
    )
    known, other = (tracker().update(image, p, feet=FEET) for p in (pose, unsure))
    assert known is not None and other is not None
    assert np.array_equal(known.places, other.places)
    n = len(known.places)
    more = other.covariance - known.covariance
    along = (0.01 * np.cos(known.yaw)) ** 2 + (0.5 * np.sin(known.yaw)) ** 2
    expected = np.zeros_like(more)
    expected[:n, :n], expected[n : 2 * n + 1, n : 2 * n + 1] = along, 0.02**2
    at, factors = 2 * n + 1, deviation_factors(EVEN, camera_height=0.95)
    assert more[at, at] == pytest.approx((3e-3 * factors["yaw"]) ** 2)
    expected[at, at] = more[at, at]
    assert np.allclose(more, expected, atol=1e-12)
