"""Flights of the map as landmarks: an image shows by how much the estimated pose is off."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rig import course_of

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.estimation.landmark_correction import LandmarkSighting
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.landmarks import flight_ahead, sight_flight
from drake_quad.perception.stair_tracker import CameraPose, StairTracker
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element

MODEL = D435.model.decimated(2)
TILT = level_rotation(pitch=np.radians(32.0))
HEIGHT, FIRST, RISE, RUN, HALF = 0.95, 3.0, 0.15, 0.3, 0.8
TRACKER = StairTracker(model=MODEL, accuracy=stereo_accuracy(D435.disparity_scale()))


def course(going: str = "up", *, width: float = 2.0 * HALF, rise: float = RISE) -> Course:
    """A floor of 3 m, four steps, and level ground."""
    return course_of(
        Element("floor", length=FIRST, width=width),
        Element("stairs", going=going, rise=rise, run=RUN, count=4, width=width),
        Element("landing", length=3.0, width=width),
    )


def image(
    *, x: float, y: float = 0.0, yaw: float = 0.0, going: str = "up", half: float = HALF
) -> FloatArray:
    """What a camera sees of these steps from a place and a heading in W; 0 where nothing is."""
    way = 1.0 if going == "up" else -1.0
    places = FIRST - x + RUN * np.arange(4.0)
    heights = way * RISE * np.arange(5.0)
    boxes = build_boxes(places, heights, left=half - y, right=half + y)
    scene = Scene(going, places, heights, -yaw, 0.0, (half - y, half + y), boxes)
    depth = render(scene, MODEL, TILT, HEIGHT)
    return np.where(np.isfinite(depth) & (depth < 10.0), depth, 0.0)


def pose(x: float, y: float = 0.0, yaw: float = 0.0) -> CameraPose:
    """Where the camera is believed to be."""
    return CameraPose(rotation_exp(0.0, 0.0, yaw) @ TILT, np.array([x, y, HEIGHT]))


def sight(
    depth: FloatArray, believed: CameraPose, mapped: Course | None = None
) -> LandmarkSighting | None:
    """The sighting of an image taken at 2 s."""
    mapped = course() if mapped is None else mapped
    return sight_flight(TRACKER, depth, MODEL, believed, mapped, stamp=2.0)


@pytest.mark.parametrize(("going", "nearer", "most"), [("up", 0.0, 0.015), ("down", 0.5, 0.03)])
@settings(max_examples=12, deadline=None)
@given(
    x=st.floats(1.4, 2.0), y=st.floats(-0.15, 0.15), yaw=st.floats(-0.1, 0.1),
    ahead=st.floats(-0.06, 0.06), aside=st.floats(-0.06, 0.06), turned=st.floats(-0.02, 0.02),
)  # fmt: skip
def test_an_image_shows_what_is_wrong_with_the_pose(
    going: str, nearer: float, most: float, x: float, y: float, yaw: float,
    ahead: float, aside: float, turned: float,
) -> None:  # fmt: skip
    """Whatever the estimate has wrong ahead, aside and in heading, the sighting has: to 4 sigma.

    Going up to 15 mm, from 1 to 1.6 m off; going down, which shows less, from half of that, 30 mm.
    """
    x += nearer
    found = sight(
        image(x=x, y=y, yaw=yaw, going=going), pose(x + ahead, y + aside, yaw + turned),
        course(going),
    )  # fmt: skip
    assert found is not None and found.stamp == 2.0
    assert np.allclose(found.direction, [1.0, 0.0])
    assert np.allclose(found.eye, [x + ahead, y + aside, HEIGHT])
    off = found.off - [ahead, turned, aside]
    assert np.all(np.abs(off) < 4.0 * np.sqrt(np.diag(found.covariance)))
    assert abs(off[0]) < most and abs(off[1]) < np.radians(0.6)
    if np.isfinite(found.covariance[2, 2]):
        assert abs(off[2]) < 0.025


def test_the_sides_of_a_flight_are_seen_where_they_are_in_view() -> None:
    """From a metre off both sides of 1.6 m are in view: 5 mm. Of stairs 6 m wide neither is."""
    found = sight(image(x=1.8, y=0.1), pose(1.8, 0.13))
    assert found is not None
    assert abs(found.off[2] - 0.03) < 0.005
    assert found.covariance[2, 2] < 0.01**2
    wide = sight(image(x=1.8, half=3.0), pose(1.8, 0.03), course(width=6.0))
    assert wide is not None
    assert wide.covariance[2, 2] == np.inf and wide.off[2] == 0.0
    assert abs(wide.off[0]) < 0.005


def test_what_is_no_flight_of_the_map_is_no_landmark() -> None:
    """A blank image, other steps, a pose half a run off, and a camera that looks back tell none."""
    depth = image(x=1.8)
    assert sight(depth, pose(1.8)) is not None
    assert sight(np.zeros_like(depth), pose(1.8)) is None
    assert sight(depth, pose(1.8), course(rise=0.24)) is None
    assert sight(depth, pose(1.8 + 0.45 * RUN)) is None
    assert flight_ahead(course(), pose(1.8, yaw=np.pi), stamp=0.0) is None
    assert flight_ahead(course(), pose(6.0), stamp=0.0) is None
    assert flight_ahead(course(), pose(1.8, 2.5), stamp=0.0) is None


def test_a_flight_is_told_from_where_the_camera_is() -> None:
    """Of a flight that the camera stands over only the nosings ahead are looked for."""
    found = flight_ahead(course(), pose(FIRST + 0.5 * RUN, 0.1), stamp=1.0)
    assert found is not None
    assert np.allclose(found.places, FIRST + RUN * np.arange(1.0, 4.0))
    assert np.allclose(found.belief.places, RUN * (np.arange(3.0) + 0.5))
    assert np.allclose(found.belief.heights, RISE * np.arange(1.0, 5.0))
    assert found.belief.right == pytest.approx(-HALF - 0.1)
    assert found.belief.left == pytest.approx(HALF - 0.1)


def test_on_the_way_back_the_same_flight_leads_down() -> None:
    """A course that turns back has the flight twice; the camera's heading says which is ahead."""
    there_and_back = course().with_way_back(np.pi)
    end = FIRST + 4 * RUN
    found = flight_ahead(there_and_back, pose(end + 0.5, 0.0, np.pi), stamp=0.0)
    assert found is not None and not found.belief.going_up
    assert found.belief.heights[0] == pytest.approx(4 * RISE)
    assert found.belief.rise == pytest.approx(-RISE)


def test_steps_that_are_not_alike_are_no_landmark() -> None:
    """One rise 30 mm higher than the others: a fit of like steps would be off."""
    uneven = course_of(
        Element("floor", length=FIRST, width=1.6),
        Element("stairs", going="up", rises=[0.15, 0.15, 0.18, 0.15], run=RUN, width=1.6),
        Element("landing", length=3.0, width=1.6),
    )
    assert flight_ahead(uneven, pose(1.8), stamp=0.0) is None
