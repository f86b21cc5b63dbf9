"""A gait that has no plan on a long flight is refused on a short one, which takes less time."""

import copy
from typing import Any

import pytest
from design_rig import MODEL, designed
from hypothesis import given, strategies as st
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.feasibility.flight import make_stairs_scenario
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.short_course import FEWEST, ShortFirst, fewer_steps
from drake_quad.scenario.build import course_of
from drake_quad.scenario.config import MissionElement, Scenario
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Stairs


def _scenario(count: int, *, treads: int = 1, lag: int = 1, places: int = 1) -> Scenario:
    """So many steps up and down, with a gait that goes so many places in a cycle."""
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, 0.3, count), model=MODEL)
    scenario.gait.treads, scenario.gait.lag = treads, lag
    scenario.gait.places_per_tread = places
    return scenario


def _counts(scenario: Scenario) -> list[int]:
    return [element.count for element in scenario.course if element.count is not None]


@given(st.integers(1, 100), st.integers(1, 3), st.integers(1, 3), st.integers(1, 2))
def test_feet_come_to_the_end_of_a_cut_flight_in_the_same_turn(
    count: int, treads: int, lag: int, places: int
) -> None:
    """What is cut is whole cycles of the gait; a flight on which all feet stand at once remains."""
    scenario = _scenario(count, treads=treads, lag=lag, places=places)
    before = copy.deepcopy(scenario)
    short = fewer_steps(scenario)
    assert scenario == before
    for cut in _counts(short):
        assert (count - cut) * places % treads == 0
        assert cut == count or cut >= max(FEWEST, (treads + lag) / places)
        assert cut < max(FEWEST, (treads + lag) / places) + 1 + treads
    assert (short is scenario) == (_counts(short) == _counts(scenario))
    for element, other in zip(short.course, scenario.course, strict=True):
        assert element.kind == other.kind and element.length == other.length


def test_what_a_mission_or_irregular_steps_say_is_not_cut() -> None:
    """Lengths of a mission are of the course as it is; an irregular step is there but once."""
    scenario = _scenario(10)
    scenario.mission = [MissionElement()]
    assert fewer_steps(scenario) is scenario
    scenario = _scenario(10)
    for element in scenario.course:
        if element.count is not None:
            element.rises = [0.1] * 10
    assert fewer_steps(scenario) is scenario


class Planner:
    """Stands for `plan_design`: refuses what it is told to, by the number of steps, and counts."""

    def __init__(self, refuses: set[int], made: Designed | None) -> None:
        self.refuses, self.made, self.asked = refuses, made, list[int]()

    def __call__(self, scenario: Scenario, *, course: Course, **_: Any) -> Designed | None:
        """Plans."""
        count = _counts(scenario)[0]
        assert len(course.boxes) == len(course_of(scenario).boxes)
        self.asked.append(count)
        if count in self.refuses:
            raise PlanningError("no")
        return self.made


def test_a_run_that_starts_on_a_long_flight_or_beyond_has_the_course_itself() -> None:
    """With the flight cut short, the ground would move away under it."""
    scenario = _scenario(10)
    before = scenario.course[0].length
    assert before is not None and fewer_steps(scenario) is not scenario
    for start, same in ((before - 0.1, False), (before + 0.1, True)):
        scenario.start.distance = start
        assert (fewer_steps(scenario) is scenario) is same


def _short_first(planner: Planner, notes: list[str] | None = None) -> ShortFirst:
    note = (lambda _: None) if notes is None else notes.append
    return ShortFirst(course_of(_scenario(10)), course_of, planner, note)


def test_the_first_gait_is_planned_once() -> None:
    """Most robots' first gait has a plan; nothing is planned twice until one has none."""
    planner, notes = Planner(set(), designed()), list[str]()
    on_course = _short_first(planner, notes)
    for _ in range(2):
        assert on_course.plan(_scenario(10), beat=None) is designed()
    assert planner.asked == [10, 10] and len(set(notes)) == 2


@pytest.mark.parametrize(
    ("refuses", "asked"), [({10}, [10, 4, 10]), ({10, 4}, [10, 4])], ids=["long alone", "both"]
)
def test_after_a_refusal_gaits_are_tried_on_the_short_course_first(
    refuses: set[int], asked: list[int]
) -> None:
    """One that is refused there is not planned on the whole; one that is not, is."""
    planner = Planner(refuses, designed())
    on_course = _short_first(planner)
    for _ in range(2):
        with pytest.raises(PlanningError):
            on_course.plan(_scenario(10), beat=None)
    assert planner.asked == asked


def test_what_is_no_better_on_the_short_course_is_left() -> None:
    """More steps do not make a plan better than another."""
    planner = Planner({10}, None)
    on_course = _short_first(planner)
    with pytest.raises(PlanningError):
        on_course.plan(_scenario(10), beat=designed())
    assert on_course.plan(_scenario(10), beat=designed()) is None
    assert planner.asked == [10, 4]
