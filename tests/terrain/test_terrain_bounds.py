"""A course that nobody could walk on is refused: the field, its value, and what would be right."""

import dataclasses
import math
from typing import Any

import pytest
from terrain_rig import CASE_STUDY

from drake_quad.errors import InputError
from drake_quad.terrain.course import build_course
from drake_quad.terrain.element_checks import check_elements
from drake_quad.terrain.elements import Element

ANY: dict[str, Any] = {"text": "0.13", "float": 2.5, "none": None}  # what types forbid
STAIRS = CASE_STUDY[1]
FLOOR = CASE_STUDY[0]
LANDING = CASE_STUDY[2]
WRONG = [
    (dataclasses.replace(STAIRS, rise=-0.13), "rise", "negative rise"),
    (dataclasses.replace(STAIRS, rise=0.0), "rise", "more than 0 m"),
    (dataclasses.replace(STAIRS, rise=None), "rise", "must say its rise"),
    (dataclasses.replace(STAIRS, rise=ANY["text"]), "rise", "must be a number"),
    (dataclasses.replace(STAIRS, rise=True), "rise", "must be a number"),
    (dataclasses.replace(STAIRS, run=0.09), "run", "shorter than a foot"),
    (dataclasses.replace(STAIRS, run=math.nan), "run", "finite"),
    (dataclasses.replace(STAIRS, count=0), "count", "at least 1"),
    (dataclasses.replace(STAIRS, count=1001), "count", "at most 1000 steps"),
    (dataclasses.replace(STAIRS, count=ANY["float"]), "count", "whole number"),
    (dataclasses.replace(STAIRS, count=None), "count", "whole number"),
    (dataclasses.replace(STAIRS, going="upp"), "going", "did you mean up?"),
    (dataclasses.replace(STAIRS, going=None), "going", "up or down"),
    (dataclasses.replace(STAIRS, turn_deg=90.0), "turn_deg", "only a landing turns"),
    (dataclasses.replace(STAIRS, length=3.0), "length", "stairs has no length"),
    (dataclasses.replace(STAIRS, rises=[0.1]), "rises", "not both"),
    (dataclasses.replace(STAIRS, run=None, runs=[]), "runs", "a step at least"),
    (dataclasses.replace(STAIRS, run=None, runs=[0.5, ANY["none"]]), "runs[1]", "a number"),
    (dataclasses.replace(STAIRS, rise=None, rises=[0.1, -0.1]), "rises[1]", "negative rise"),
    (dataclasses.replace(STAIRS, rise=None, rises=[0.1, 0.1]), "count", "2 steps"),
    (
        Element("stairs", going="up", rises=[0.1, 0.1], runs=[0.5]),
        "runs",
        "has 1 steps but rises has 2",
    ),
    (dataclasses.replace(FLOOR, kind="flor"), "kind", "did you mean floor?"),
    (dataclasses.replace(FLOOR, length=0.0), "length", "more than 0 m"),
    (dataclasses.replace(FLOOR, length=math.inf), "length", "finite"),
    (dataclasses.replace(FLOOR, length=None), "length", "must say its length"),
    (dataclasses.replace(FLOOR, width=0.79), "width", "at least 0.8 m"),
    (dataclasses.replace(FLOOR, turn_deg=90.0), "turn_deg", "only a landing turns"),
    (dataclasses.replace(LANDING, length=1.4), "length", "too short to turn on"),
    (dataclasses.replace(LANDING, turn_deg=181.0), "turn_deg", "-180 and 180"),
    (dataclasses.replace(LANDING, turn_deg=math.nan), "turn_deg", "finite"),
    (dataclasses.replace(LANDING, width=2.0), "width", "as wide as long"),
    (dataclasses.replace(LANDING, width=4.0, turn_deg=30.0), "width", "as wide as long"),
]


@pytest.mark.parametrize(("element", "field", "remedy"), WRONG)
def test_a_wrong_field_is_named_with_its_value(element: Element, field: str, remedy: str) -> None:
    """The error names file, path and value of the wrong field and says what would be right."""
    with pytest.raises(InputError) as caught:
        build_course([FLOOR, element, FLOOR], source="mine.yaml")
    error = caught.value
    assert error.source == "mine.yaml" and error.field == f"course[1].{field}"
    assert remedy in error.remedy
    plain = getattr(element, field.split("[")[0])
    assert error.value is plain or error.value in plain


def test_a_course_begins_and_ends_where_the_robot_can_stand() -> None:
    """No elements, or stairs at either end, are refused."""
    with pytest.raises(InputError, match="needs a floor"):
        build_course([])
    with pytest.raises(InputError, match=r"course\[0\]\.kind"):
        build_course([STAIRS, FLOOR])
    with pytest.raises(InputError, match=r"course\[1\]\.kind"):
        build_course([FLOOR, STAIRS])


def test_a_course_that_runs_into_itself_is_refused() -> None:
    """Four right turns around too small a yard come back over the first floor."""
    landing = dataclasses.replace(LANDING, length=2.0)
    with pytest.raises(InputError, match=r"course\[8\].*runs into course\[0\]"):
        build_course([FLOOR, *[landing, FLOOR] * 4])


def test_a_tread_must_be_deeper_than_the_robots_foot() -> None:
    """A larger foot needs a deeper tread: 2 r + 0.04 m once that is more than 0.10 m."""
    elements = [FLOOR, dataclasses.replace(STAIRS, run=0.15), FLOOR]
    assert build_course(elements, foot_radius=0.05).lanes
    with pytest.raises(InputError, match=r"at least 0\.16 m"):
        build_course(elements, foot_radius=0.06)


def test_a_course_of_very_many_elements_is_refused() -> None:
    """At once: each would be looked at with those beside it, and laid in a plant."""
    floors = [Element(kind="floor", length=0.5)] * 1001
    with pytest.raises(InputError, match="'1001 elements': may have 1000 elements at most"):
        check_elements(floors)
