"""Looks from a flight's last treads, from where little of it is left to see."""

from dataclasses import replace

import numpy as np
import pytest
from growing_rig import FIRST, RISE, RUN, first_map

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import STEREO_NOISE, add_noise, draw_camera_errors
from drake_quad.perception.growing_map import grow_map
from drake_quad.perception.level_beyond import level_beyond
from drake_quad.perception.look_again import (
    BOARD,
    look_again,
    nosings_in_view,
    without_doubtful_last,
)
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.stair_tracker import CameraPose, StairTracker

STEPS = 5
MODEL = D435.model.turned()
NO_FEET = np.zeros((0, 3))


def look_from(
    known: StairMap, x: float, height: float, pitch: float, seed: int, overhang: float = 0.0
) -> tuple[StairBelief | None, FloatArray, CameraPose]:
    """What is told of the even flight of five steps by a camera over its line, and the image."""
    places, heights = FIRST + RUN * np.arange(STEPS) - x, RISE * np.arange(STEPS + 1.0)
    boxes = build_boxes(places, heights, overhang=overhang)
    scene = Scene("up", places, heights, 0.0, overhang, (0.8, 0.8), boxes)
    R_WC, generator = level_rotation(pitch=np.radians(pitch)), np.random.default_rng(seed)
    errors = draw_camera_errors(STEREO_NOISE, D435, MODEL, generator)
    depth = add_noise(
        render(scene, MODEL, R_WC, height), noise=STEREO_NOISE, errors=errors, camera=D435,
        model=MODEL, generator=generator,
    )  # fmt: skip
    pose = CameraPose(R_WC, np.array([x, 0.0, height]))
    tracker = StairTracker(model=MODEL, accuracy=stereo_accuracy(D435.disparity_scale()))
    belief = look_again(tracker, depth, MODEL, pose, known, feet=NO_FEET, stamp=0.0)
    return belief, depth, pose


@pytest.mark.parametrize("off", [0.0, -0.025])
@pytest.mark.parametrize("seed", range(6))
def test_one_last_step_is_seen_from_the_tread_before_it(seed: int, off: float) -> None:
    """None of the map's four nosings is in view: the fifth is told, and that the flight ends.

    Also where the map is 25 mm off, so that the step is first looked for that much too near.
    """
    known = first_map(4)
    known = replace(known, places=known.places + off)
    belief, depth, pose = look_from(known, FIRST + 3.0 * RUN, 4 * RISE + 0.32, 38.0, seed)
    assert not len(nosings_in_view(known, MODEL, pose))
    assert nosings_in_view(known, MODEL, pose, further=1).tolist() == [4]
    assert belief is not None and len(belief.places) == 1
    level = level_beyond(depth, MODEL, pose, belief, landing=2.0)
    grown = grow_map(known, belief, level, feet=NO_FEET, landing=2.0, reach=0.4, look=1)
    assert grown.complete and len(grown.places) == STEPS
    assert np.array_equal(grown.places[:4], known.places)
    assert abs(grown.places[4] - FIRST - 4 * RUN) < 0.015
    assert abs(grown.heights[4] - 5 * RISE) < 0.008


@pytest.mark.parametrize("seed", range(8))
def test_a_riser_higher_than_the_camera_is_no_step_yet(seed: int) -> None:
    """Nothing is seen over it: it may be a wall. A known closed flight is not taken for open."""
    known = first_map(4)
    floor, stairs, landing = known.elements
    known = replace(known, elements=(floor, replace(stairs, overhang=0.02), landing))
    x, height = FIRST + 3.0 * RUN - 0.3, 5 * RISE - 0.03
    belief, _, pose = look_from(known, x, height, 42.0, seed, overhang=0.02)
    assert nosings_in_view(known, MODEL, pose).tolist() == [3]
    assert belief is not None and not belief.is_open and len(belief.places) == 1
    assert abs(belief.places[-1] + x - FIRST - 3 * RUN) < 0.015
    assert abs(belief.heights[-1] - 4 * RISE) < 0.01


@pytest.mark.parametrize(("above", "seed"), [(0.015, 2), (0.015, 5), (0.025, 2), (0.025, 7)])
def test_a_riser_that_ends_under_a_boards_face_is_no_step(above: float, seed: int) -> None:
    """A nosing a little higher than the camera is not told where its face begins, 38 mm too low."""
    known = first_map(4)
    floor, stairs, landing = known.elements
    known = replace(known, elements=(floor, replace(stairs, overhang=0.02), landing))
    x = FIRST + 3.0 * RUN - 0.3
    belief, _, _ = look_from(known, x, 5 * RISE - above, 30.0, seed, overhang=0.02)
    assert belief is not None and len(belief.places) == 1
    assert abs(belief.heights[-1] - 4 * RISE) < 0.005


def test_a_new_last_step_is_told_from_above_alone() -> None:
    """A new step's tread has to lie a board's height below the camera; the map's steps need not.

    What is left of the belief is as it was: places, heights and all their covariances.
    """
    belief, _, pose = look_from(first_map(4), FIRST + 2.0 * RUN, 4 * RISE + 0.3, 30.0, 0)
    assert belief is not None
    n = len(belief.places)
    assert n >= 2 and belief.count_most == n
    level = CameraPose(pose.R_WC, np.array([*pose.p_WC[:2], 5 * RISE + BOARD - 0.005]))
    above = CameraPose(pose.R_WC, np.array([*pose.p_WC[:2], 5 * RISE + BOARD + 0.015]))
    assert without_doubtful_last(belief, first_map(4), above) is belief
    assert without_doubtful_last(belief, first_map(5), level) is belief
    rest = without_doubtful_last(belief, first_map(4), level)
    assert (rest.count_least, rest.count_most) == (n - 1, None)
    assert np.array_equal(rest.places, belief.places[:-1])
    assert np.array_equal(rest.heights, belief.heights[:-1])
    assert np.array_equal(rest.place_sigmas, belief.place_sigmas[:-1])
    assert np.array_equal(rest.height_sigmas, belief.height_sigmas[:-1])
    for which in ("yaw", "overhang", "rise", "run"):
        assert rest.sigma(which) == belief.sigma(which)


def test_a_further_step_elsewhere_contradicts_the_map() -> None:
    """A next step that lies half a run off is none that the map goes on with."""
    known = first_map(4)
    belief, _, _ = look_from(known, FIRST + 3.0 * RUN, 4 * RISE + 0.32, 38.0, 0)
    assert belief is not None
    for moved in (belief.places + 0.5 * RUN, belief.places - 0.5 * RUN):
        with pytest.raises(PlanningError, match=r"contradicts|none of the steps"):
            grow_map(
                known, replace(belief, places=moved), None, feet=NO_FEET, landing=2.0, reach=0.4,
                look=1,
            )  # fmt: skip
