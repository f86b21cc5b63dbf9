"""What was seen against what there is: crossings, intervals, figures, and the files of a run."""

from pathlib import Path

import numpy as np
import pytest

from drake_quad.perception.level_beyond import Level
from drake_quad.perception.see import read_depth_image
from drake_quad.perception.sight import MapRevision, Sight
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_map import StairMap, make_stair_map
from drake_quad.runs.seen import (
    MILLIMETRE,
    SeenRecord,
    record_sight,
    seen_figures,
    true_crossings,
)
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

FIRST, RUN, RISE, COUNT = 2.0, 0.4, 0.15, 3


def world(yaw: float = 0.0) -> Course:
    elements = (
        Element(kind="floor", length=FIRST),
        Element(kind="stairs", going="up", rise=RISE, run=RUN, count=COUNT),
        Element(kind="landing", length=2.0),
    )
    return build_course(elements, yaw=yaw)


def sight(*, places: list[float], sigma: float = 0.01, camera: float = 1.5) -> Sight:
    """Steps of exact heights at these places from the camera, on the course's middle line."""
    n = len(places)
    belief = StairBelief(
        stamp=0.9, origin=np.array([camera, 0.0]), passed=0, places=np.array(places),
        heights=RISE * np.arange(n + 1, dtype=np.float64), yaw=0.0, overhang=0.0, rise=RISE,
        run=RUN, covariance=sigma**2 * np.eye(2 * n + 5), count_least=n, count_most=n,
        is_open=False, right=-0.8, left=0.8,
    )  # fmt: skip
    return Sight(belief, 0.9, 10, np.full((16, 20), 1.25), Level(1.0, ends_flight=True))


def test_a_line_crosses_nosings_where_they_are() -> None:
    """By distance, with their heights; and farther on by 1 / cos where the course is turned."""
    places = FIRST - 1.5 + RUN * np.arange(COUNT)
    heights = RISE * np.arange(1, COUNT + 1)
    straight = true_crossings(world(), np.array([1.5, 0.0]), np.array([1.0, 0.0]))
    assert straight == pytest.approx(np.column_stack([places, heights]))
    yaw = np.radians(10.0)
    origin = 1.5 * np.array([np.cos(yaw), np.sin(yaw)])
    turned = true_crossings(world(yaw), origin, np.array([1.0, 0.0]))
    assert turned[:, 0] == pytest.approx(places / np.cos(yaw))
    assert len(true_crossings(world(), np.array([9.0, 0.0]), np.array([1.0, 0.0]))) == 0


def test_errors_are_those_of_nosings_of_the_same_number() -> None:
    """A nosing 12 mm off is in an interval of 20 mm; one 30 mm off is not, and shares say so."""
    told = record_sight(sight(places=[0.512, 0.93, 1.3]), world()).told
    errors = [row["place"]["error"] for row in told["nosings"]]
    assert errors == pytest.approx([0.012, 0.03, 0.0], abs=1e-9)
    assert [row["place"]["inside"] for row in told["nosings"]] == [True, False, True]
    figures = seen_figures(told)
    assert figures["place_error_max"] == pytest.approx(0.03)
    assert figures["places_inside"] == pytest.approx(2 / 3)
    assert figures["height_error_max"] == pytest.approx(0.0) and figures["heights_inside"] == 1.0
    assert figures["count_true"] == COUNT and figures["level_seen"] == 1.0
    assert figures["rise_error"] == pytest.approx(0.0) and figures["run_inside"] is True
    assert figures["yaw_error_deg"] == pytest.approx(0.0)


def test_a_step_that_is_not_there_is_in_no_interval() -> None:
    """Of four steps that were seen where three are, a quarter is outside."""
    figures = seen_figures(record_sight(sight(places=[0.5, 0.9, 1.3, 1.7]), world()).told)
    assert figures["places_inside"] == 0.75 and figures["count_least"] == 4


def test_nothing_seen_has_no_figures_of_stairs() -> None:
    """Without a belief the errors are null, and it is said that no stairs were seen."""
    nothing = Sight(None, 0.9, 10, np.zeros((16, 20)), refused="stands still")
    figures = seen_figures(record_sight(nothing, world()).told)
    assert figures["stairs"] is False and figures["climbed"] is False
    assert figures["place_error_max"] is None and figures["places_inside"] is None


def test_the_image_comes_back_to_a_millimetre(tmp_path: Path) -> None:
    """The file is what `drake-quad see` reads; what has no depth stays without."""
    path = tmp_path / "depth.png"
    depth = np.random.default_rng(0).uniform(0.3, 6.0, (20, 30))
    depth[:3] = 0.0
    SeenRecord({}, depth).write_image(path)
    again = read_depth_image(path, scale=MILLIMETRE)
    assert np.abs(again - depth).max() <= 0.5 * MILLIMETRE + 1e-12
    assert np.all(again[:3] == 0.0)


def test_a_map_that_grew_has_figures_of_its_end_beside_those_of_the_first_look() -> None:
    """Two looks: three steps in the end, of which the last is 30 mm off its place."""
    assert seen_figures(record_sight(sight(places=[0.5]), world()).told)["looks"] == 1
    first = made_map(sight(places=[0.5, 0.9]))
    last = made_map(sight(places=[0.5, 0.9, 1.33]))
    revisions = [MapRevision(k, 0.9 + k, None, None, m) for k, m in enumerate((first, last))]
    told = record_sight(sight(places=[0.5, 0.9]), world(), revisions).told
    figures = seen_figures(told)
    assert figures["looks"] == 2 and figures["map_steps"] == COUNT
    assert figures["map_place_error_max"] == pytest.approx(0.03)
    assert figures["map_places_inside"] == pytest.approx(2 / 3)
    assert figures["map_heights_inside"] == 1.0 and figures["place_error_max"] < 1e-9
    assert told["map"] == last.describe() and len(told["revisions"]) == 2


def made_map(seen: Sight) -> StairMap:
    """The map of a sight, of a robot whose body is 1 m along."""
    return make_stair_map(
        seen.belief, seen.level, standing=np.array([1.0, 0.0]), floor=0.0, behind=1.0,
        landing=2.0, reach=0.4,
    )  # fmt: skip
