"""The landmark finder alone, through its ports and its own Context."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from rig import course_of

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray, read_only
from drake_quad.estimation.landmark_correction import NO_SIGHTING, LandmarkSighting
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.systems.depth_camera import DepthImage
from drake_quad.systems.landmark_finder import LandmarkFinder
from drake_quad.terrain.elements import Element

MODEL = D435.model.decimated(2)
R_BC, P_BC = level_rotation(pitch=np.radians(32.0)), np.array([0.4, 0.0, 0.2])
COURSE = course_of(
    Element("floor", length=3.0, width=1.6),
    Element("stairs", going="up", rise=0.15, run=0.3, count=4, width=1.6),
    Element("landing", length=3.0, width=1.6),
)


def image_from(x: float) -> FloatArray:
    """What a level base at `x` on the course's line sees [m]."""
    places, heights = 3.0 - x - P_BC[0] + 0.3 * np.arange(4.0), 0.15 * np.arange(5.0)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, R_BC, 0.75 + P_BC[2])
    return np.where(np.isfinite(depth) & (depth < 10.0), depth, 0.0)


class Alone:
    """The finder by itself."""

    def __init__(self, alike: float = 1.0) -> None:
        self.system = LandmarkFinder(
            model=MODEL, R_BC=R_BC, p_BC=P_BC, course=COURSE, period=0.1, alike=alike,
            accuracy=stereo_accuracy(D435.disparity_scale()),
        )  # fmt: skip
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()

    def shown(self, depth: FloatArray, *, stamp: float, x: float, until: float) -> LandmarkSighting:
        """What it says at `until` where this image is the newest, of a base believed at `x`."""
        pose = read_only(np.array([1.0, 0.0, 0.0, 0.0, x, 0.0, 0.75]))
        image = DepthImage(stamp, read_only(depth), pose)
        self.system.GetInputPort("depth_measured").FixValue(self.context, AbstractValue.Make(image))
        self.simulator.AdvanceTo(until)
        sighting: LandmarkSighting = self.system.GetOutputPort("landmark_sighted").Eval(
            self.context
        )
        return sighting


def test_an_image_of_the_flight_ahead_becomes_a_sighting() -> None:
    """A base believed 40 mm too far ahead is told so, once; then an image of nothing tells none."""
    alone = Alone()
    port = alone.system.GetOutputPort("landmark_sighted")
    assert port.Eval(alone.context) is NO_SIGHTING or port.Eval(alone.context).stamp == -np.inf
    depth = image_from(1.5)
    first = alone.shown(depth, stamp=0.0, x=1.54, until=0.05)
    assert first.stamp == 0.0
    assert abs(first.off[0] - 0.04) < 0.006
    assert abs(first.off[1]) < np.radians(0.3) and abs(first.off[2]) < 0.006
    blank = alone.shown(np.zeros_like(depth), stamp=0.1, x=1.54, until=0.15)
    assert blank.stamp == 0.0
    again = alone.shown(depth, stamp=0.2, x=1.5, until=0.25)
    assert again.stamp == 0.2 and abs(again.off[0]) < 0.006


def test_a_sighting_of_many_that_err_alike_counts_for_less() -> None:
    """Its covariance is multiplied; what it says is the same."""
    one, five = (
        Alone(alike).shown(image_from(1.5), stamp=0.0, x=1.54, until=0.05) for alike in (1.0, 5.0)
    )
    assert np.array_equal(one.off, five.off)
    assert np.allclose(five.covariance, 5.0 * one.covariance)


def test_an_image_is_looked_at_once() -> None:
    """The same image still there at the next look is left alone, whatever pose is told with it."""
    alone = Alone()
    depth = image_from(1.5)
    first = alone.shown(depth, stamp=0.0, x=1.5, until=0.05)
    later = alone.shown(depth, stamp=0.0, x=1.6, until=0.35)
    assert np.array_equal(first.off, later.off)
