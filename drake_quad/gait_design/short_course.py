"""A course with its long flights cut short, on which plans of a gait are made sooner.

The plan of a flight takes time in proportion to its steps. A gait at the robot's limits is refused
where the flight begins or ends as often as between, and its margin and speed are much the same:
some steps show what ten do. So gaits are tried on it that may have no plan, and times of gaits.
"""

import copy
from collections.abc import Callable
from math import gcd

from drake_quad.errors import PlanningError
from drake_quad.gait_design.designed import Designed
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.course import Course

FEWEST = 4  # steps of a flight that is cut short, at least


def fewer_steps(scenario: Scenario) -> Scenario:
    """The scenario with its long flights cut short, to as many steps as show what the others do.

    Feet come to the flight's other end in the same turn, and all stand on the flight at a time. It
    is the same scenario if no flight is long, if its mission says how far to walk, or if the robot
    starts on a long flight or beyond.

    Args:
        scenario: With its gait. It stays as it is.
    """
    gait = scenario.gait
    # Treads after which feet come to a nosing in the same turn again.
    turn = gait.treads // gcd(gait.treads, gait.places_per_tread)
    most = max(-(-(gait.treads + gait.lag) // gait.places_per_tread), FEWEST)
    long = [
        e for e in scenario.course
        if e.count is not None and e.rises is None and e.runs is None and e.count >= most + turn
    ]  # fmt: skip
    if scenario.mission or not long or _starts_beyond(scenario, scenario.course.index(long[0])):
        return scenario
    fewer = copy.deepcopy(scenario)
    for element, cut in zip(scenario.course, fewer.course, strict=True):
        if element in long:
            assert element.count is not None
            cut.count = most + (element.count - most) % turn
    return fewer


def _starts_beyond(scenario: Scenario, element: int) -> bool:
    """Whether a run starts beyond the first riser of one of its course's elements, or may."""
    before = 0.0
    for e in scenario.course[:element]:
        if e.length is not None:
            before += e.length
        elif e.count is not None and e.run is not None:
            before += e.count * e.run
        else:
            return True
    return scenario.start.distance > before


class ShortFirst:
    """Plans gaits on a course; once one has had no plan, others on the course cut short first.

    Most robots' first gait has a plan, and is planned once.
    """

    def __init__(
        self,
        course: Course,
        build: Callable[[Scenario], Course],
        plan: Callable[..., Designed | None],
        note: Callable[[str], object] = lambda _: None,
    ) -> None:
        """Takes the course, and what plans on one.

        Args:
            course: The course.
            build: Builds the course of a scenario.
            plan: Makes a `Designed` of a scenario; see `plan_design`.
            note: Receives a line before each plan.
        """
        self._course, self._build, self._plan = course, build, plan
        self._note, self._planned, self._refused = note, 0, False

    def plan(
        self, scenario: Scenario, *, beat: Designed | None, **given: object
    ) -> Designed | None:
        """See `plan_design`.

        Args:
            scenario: With the design's fields filled in.
            beat: A plan that has to be bettered, if there is one.
            given: Passed on.

        Raises:
            PlanningError: If there is no plan, on the course or on the one that is cut short.
        """
        self._planned += 1
        better = "" if beat is None else f"; the best so far keeps {1e3 * beat.margin:.0f} mm"
        self._note(f"planning gaits on the course: number {self._planned}{better}")
        short, course = self.shorten(scenario)
        if self._refused and short is not scenario:
            found = self._plan(short, course=course, beat=beat, **given)
            if found is None:  # nor would more steps be better
                return None
        try:
            return self._plan(scenario, course=self._course, beat=beat, **given)
        except PlanningError:
            self._refused = True
            raise

    def shorten(self, scenario: Scenario) -> tuple[Scenario, Course]:
        """The scenario with its flights cut short, and its course; both as they are if none are."""
        short = fewer_steps(scenario)
        return short, self._course if short is scenario else self._build(short)
