"""The map keeper alone, through its ports and its own Context."""

from dataclasses import replace

import numpy as np
import pytest
from growing_rig import (
    DEEP,
    FEET,
    FIRST as FIRST_NOSING,
    NOT_SEEN,
    RISE,
    RUN,
    first_map,
    flight,
    phase_of,
)
from pydrake.systems.analysis import Simulator
from rig import fix_inputs, stand_plan

from drake_quad.common import FloatArray
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.sight import MapRevision, with_reason
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.touchdown_heights import TouchdownHeights
from drake_quad.planning.onward import LOOK_AGAIN
from drake_quad.systems.depth_camera import NO_IMAGE
from drake_quad.systems.map_keeper import LONGEST_WAIT, MapKeeper, MapMemory, MapSettings
from drake_quad.systems.stair_estimator import StairReport
from drake_quad.terrain.elements import Element

LOOK = 2  # the task of the look
FIRST = MapRevision(0, 0.9, flight(0, 5), NOT_SEEN, first_map())


class Keeper:
    """A map keeper in a simulator of its own; its robot walks in task 1 and then looks."""

    def __init__(self, landing: float = 2.0) -> None:
        settings = MapSettings(
            landing=landing, reach=0.4, foot_radius=0.02, back=(Element("return"),)
        )
        self.system = MapKeeper(first=FIRST, settings=settings)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        fix_inputs(
            self.system, self.context, feet=FEET.ravel(), contacts=np.ones(4),
            depth_measured=NO_IMAGE, stairs=StairReport(0.9, FIRST.belief),
        )  # fmt: skip
        self.feet = FEET.copy()
        self.task(1, name="walk 1")

    def task(
        self, index: int, *, name: str = LOOK_AGAIN, planned: int | None = None,
        revises_map: bool = False,
    ) -> None:  # fmt: skip
        """Sets the clock's task, and the plan under way."""
        plan = stand_plan(index=index if planned is None else planned)
        segment = replace(plan.segments[0], name=name)
        plan = replace(plan, segments=(segment,), goes_on=True, revises_map=revises_map)
        fix_inputs(self.system, self.context, gait_phase=phase_of(index), motion_plan=plan)

    def step(self, row: int, tread: int, *, higher: float) -> None:
        """A foot lifts, and stands on a tread that is so much higher than mapped."""
        self.feet = self.feet.copy()
        self.feet[row] = [FIRST_NOSING + (tread - 0.5) * RUN, self.feet[row, 1], tread * RISE]
        self.feet[row, 2] += higher if tread else 0.0
        contacts = np.ones(4)
        contacts[row] = 0.0
        for now in (contacts, np.ones(4)):
            fix_inputs(self.system, self.context, contacts=now, feet=self.feet.ravel())
            self.run(self.context.get_time() + 0.5)

    def see(self, stamp: float, belief: StairBelief | None, level: Level = NOT_SEEN) -> None:
        """Hands it a report."""
        fix_inputs(self.system, self.context, stairs=StairReport(stamp, belief, level))

    def run(self, until: float) -> MapRevision:
        """Lets simulated time pass, and returns the newest revision."""
        self.simulator.AdvanceTo(until)
        newest = self.system.GetOutputPort("map_known").Eval(self.context)
        assert isinstance(newest, MapRevision)
        return newest

    @property
    def heights(self) -> TouchdownHeights:
        """What feet have told."""
        kept: MapMemory = self.context.get_abstract_state(0).get_value()
        assert kept.heights is not None
        return kept.heights

    @property
    def looking(self) -> bool:
        """Whether images are wanted."""
        return bool(self.system.GetOutputPort("looking").Eval(self.context)[0])


def looked_again(
    belief: StairBelief | None, level: Level = NOT_SEEN, *, stamp: float = 1.8,
    landing: float = 2.0,
) -> tuple[Keeper, MapRevision]:  # fmt: skip
    """A keeper whose robot has walked, and looked from 1 s to 2 s."""
    keeper = Keeper(landing)
    keeper.run(1.0)
    keeper.task(LOOK)
    keeper.run(1.1)
    keeper.see(stamp, belief, level)
    keeper.run(2.0)
    keeper.task(LOOK + 1, planned=LOOK)
    return keeper, keeper.run(2.1)


def test_images_are_wanted_while_it_looks_and_at_no_other_time() -> None:
    """Not on its walk; from the look's beginning on; and not once the map is revised."""
    keeper = Keeper()
    keeper.run(1.0)
    assert not keeper.looking
    keeper.task(LOOK)
    assert keeper.run(1.1) is FIRST and keeper.looking
    keeper.see(1.8, flight(3, 4))
    assert keeper.run(2.0) is FIRST and keeper.looking
    keeper.task(LOOK + 1, planned=LOOK)
    assert keeper.run(2.1).number == 1 and not keeper.looking


def test_a_look_grows_the_map_and_all_revisions_are_kept() -> None:
    """Five steps become seven; the one of the start stays in the record."""
    keeper, newest = looked_again(flight(3, 4))
    assert newest.number == 1 and not newest.reason and len(newest.map.places) == 7
    assert keeper.system.revisions(keeper.context) == (FIRST, newest)


def test_an_image_of_before_the_look_does_not_count() -> None:
    """It waits for one that was taken at rest."""
    keeper, newest = looked_again(flight(3, 4), stamp=1.2)
    assert newest is FIRST and keeper.looking
    keeper.see(2.2, flight(3, 4))
    assert keeper.run(2.4).number == 1


def test_without_an_image_it_gives_up_after_a_while() -> None:
    """The robot does not stand there until the run's time is over: the revision says why."""
    keeper, newest = looked_again(flight(3, 4), stamp=1.2)
    assert newest is FIRST and keeper.run(1.0 + LONGEST_WAIT) is FIRST
    newest = keeper.run(1.2 + LONGEST_WAIT)
    assert newest.number == 1 and newest.map is FIRST.map and newest.reason == "no image has come"


def test_a_map_that_nothing_was_planned_on_says_why() -> None:
    """By the reason of the run's end; a revision that has one of its own, or was used, keeps it."""
    last = replace(FIRST, number=1)
    refused = with_reason((FIRST, last), 0, "no way on")
    assert refused[0] is FIRST and (refused[1].number, refused[1].reason) == (1, "no way on")
    assert with_reason((FIRST, last), 1, "fell later")[1] is last
    own = replace(last, reason="ends after 4 steps")
    assert with_reason((FIRST, own), 0, "no way on")[1] is own


def test_what_contradicts_the_map_leaves_it_and_says_why() -> None:
    """The revision has the map of before, and a reason."""
    _, newest = looked_again(flight(2, 2, most=2), DEEP)
    assert newest.number == 1 and newest.map is FIRST.map
    assert "ends after 4 steps" in newest.reason
    assert "no steps are seen" in looked_again(None)[1].reason


def test_a_map_that_is_no_course_is_not_taken_over() -> None:
    """A landing too short to turn back on: the revision has the map of before, and a reason."""
    keeper, newest = looked_again(flight(3, 4, most=4), DEEP, landing=1.2)
    assert newest.number == 1 and newest.map is FIRST.map
    assert "too small to turn back on" in newest.reason and not keeper.looking


def test_two_contexts_of_one_keeper_are_two_keepers() -> None:
    """What one has seen the other has not."""
    keeper, newest = looked_again(flight(3, 4))
    other = Simulator(keeper.system).get_mutable_context()
    assert keeper.system.revisions(other) == (FIRST,)
    assert keeper.system.revisions(keeper.context)[-1] is newest


ERRORS = np.array([0.003, -0.004, 0.004, -0.003, 0.004])  # [m] of treads, higher than mapped


def walked_up(errors: FloatArray = ERRORS, deviation: FloatArray | None = None) -> Keeper:
    """A keeper whose robot has walked from the floor to the fifth step, foot by foot.

    Args:
        errors: How much higher the treads are than mapped [m].
        deviation: The estimator's (9,); None where the state is true.
    """
    keeper = Keeper()
    if deviation is not None:
        fix_inputs(keeper.system, keeper.context, estimator_deviation=deviation)
    keeper.feet[:, 2] = 0.0
    keeper.feet[:, 0] = 1.5
    fix_inputs(keeper.system, keeper.context, feet=keeper.feet.ravel())
    keeper.run(0.5)
    for tread in range(1, 6):
        for row in range(4):
            keeper.step(row, tread, higher=errors[tread - 1])
    return keeper


def test_before_the_way_back_the_map_has_the_heights_that_feet_found() -> None:
    """Not on the way up; once the clock is past that walk; from then on feet change nothing."""
    keeper = walked_up()
    assert keeper.run(21.0) is FIRST
    keeper.task(1, name="walk 1", revises_map=True)
    assert keeper.run(21.1) is FIRST
    keeper.task(2, name="walk 1", planned=1, revises_map=True)
    newest = keeper.run(21.2)
    assert newest.number == 1 and not newest.looked and not newest.reason
    assert newest.belief is FIRST.belief and 19.5 < newest.stamp < 20.6
    off = newest.map.heights - FIRST.map.heights - ERRORS
    assert np.abs(off).max() < 0.0012 < np.abs(ERRORS).min()
    assert newest.map.height_errors.max() < FIRST.map.height_errors.min()
    np.testing.assert_array_equal(newest.map.places, FIRST.map.places)
    told = keeper.heights
    keeper.step(0, 3, higher=0.003)
    assert keeper.run(23.0) is newest and len(keeper.system.revisions(keeper.context)) == 2
    assert keeper.heights is told


def test_a_look_builds_on_what_feet_have_found() -> None:
    """Treads behind the camera have the heights that feet found; those that it adds, its own."""
    keeper = walked_up()
    keeper.task(LOOK)
    keeper.run(20.6)
    keeper.see(21.5, flight(5, 2, up=ERRORS[-1]))
    keeper.run(22.0)
    keeper.task(LOOK + 1, planned=LOOK)
    newest = keeper.run(22.1)
    assert newest.looked and not newest.reason and len(newest.map.heights) == 7
    assert newest.map.touched_treads.tolist() == [True] * 5 + [False] * 2
    higher = newest.map.heights - RISE * np.arange(1.0, 8.0)
    assert np.abs(higher[:5] - ERRORS).max() < 0.0012


def test_what_feet_tell_is_kept_from_look_to_look() -> None:
    """After a look that adds two steps, feet on these make them better, and forget no others."""
    keeper = walked_up()
    keeper.task(LOOK)
    keeper.run(20.6)
    keeper.see(21.5, flight(5, 2, up=ERRORS[-1] + 0.002))
    keeper.run(22.0)
    keeper.task(LOOK + 1, planned=LOOK)
    grown = keeper.run(22.1)
    before = keeper.heights
    assert before.touchdowns.tolist() == [4] * 5 + [0] * 2
    keeper.task(LOOK + 1, name="walk 2")
    for row in (0, 1):
        keeper.step(row, 6, higher=ERRORS[-1])
    keeper.task(LOOK + 2, name="walk 2", planned=LOOK + 1, revises_map=True)
    newest = keeper.run(25.0)
    assert newest.number == 2 and newest.map.touched_treads.tolist() == [True] * 6 + [False]
    assert np.abs(newest.map.heights[:5] - grown.map.heights[:5]).max() < 0.0005
    off = [abs(m.map.heights[5] - 6 * RISE - ERRORS[-1]) for m in (grown, newest)]
    assert off[1] < 0.5 * off[0]


@pytest.mark.parametrize(("entry", "matters"), [(0, True), (1, True), (2, False), (4, False)])
def test_a_tilt_that_is_not_known_makes_what_feet_tell_less_certain(
    entry: int, matters: bool
) -> None:
    """By what the estimator says of roll and pitch; of a true state nothing is said."""
    widths = []
    for deviation in (None, 0.05 * (np.arange(9) == entry)):
        keeper = walked_up(deviation=deviation)
        keeper.task(2, name="walk 1", planned=1, revises_map=True)
        widths.append(keeper.run(21.0).map.height_errors[-1])
    assert bool(widths[1] > 1.05 * widths[0]) is matters


@pytest.mark.parametrize("entry", [6, 7])
def test_a_robot_that_does_not_know_its_place_tells_nothing(entry: int) -> None:
    """With a place known to 60 mm, feet may be on the next tread."""
    keeper = walked_up(deviation=0.06 * (np.arange(9) == entry))
    keeper.task(2, name="walk 1", planned=1, revises_map=True)
    newest = keeper.run(21.0)
    assert newest.map is FIRST.map and not newest.reason


def test_a_foot_counts_once_it_stands_firmly_and_once_a_step() -> None:
    """Not one that touches for a tenth of a second, nor one that touches again where it stood."""
    keeper = Keeper()
    keeper.run(0.5)
    begun = int(keeper.heights.touchdowns.sum())
    lifted = np.array([0.0, 1.0, 1.0, 1.0])
    contacts = ((lifted, 0.6), (np.ones(4), 1.2), (lifted, 1.3), (np.ones(4), 1.4), (lifted, 1.5))
    for now, until in contacts:
        fix_inputs(keeper.system, keeper.context, contacts=now)
        keeper.run(until)
        assert keeper.heights.touchdowns.sum() == begun
    keeper.feet[0, 0] += 0.02
    fix_inputs(keeper.system, keeper.context, feet=keeper.feet.ravel(), contacts=np.ones(4))
    for until, more in ((1.65, 0), (1.8, 1), (3.0, 1)):
        keeper.run(until)
        assert keeper.heights.touchdowns.sum() == begun + more


def test_a_foot_that_has_just_touched_is_no_measure_for_others() -> None:
    """Two feet stand firmly; a third one that has come down 50 ms ago, 30 mm too high, does not."""
    keeper = Keeper()
    keeper.run(0.5)
    before = keeper.heights.state[:5].copy()
    two = np.array([0.0, 1.0, 0.0, 1.0])
    fix_inputs(keeper.system, keeper.context, contacts=two)
    keeper.run(0.7)
    keeper.feet[0, 0] += 0.02
    fix_inputs(
        keeper.system,
        keeper.context,
        feet=keeper.feet.ravel(),
        contacts=np.array([1.0, 1.0, 0.0, 1.0]),
    )
    keeper.run(0.85)
    keeper.feet[2, 2] += 0.03
    fix_inputs(keeper.system, keeper.context, feet=keeper.feet.ravel(), contacts=np.ones(4))
    begun = int(keeper.heights.touchdowns.sum())
    keeper.run(1.02)
    assert keeper.heights.touchdowns.sum() == begun + 1
    np.testing.assert_allclose(keeper.heights.state[:5], before, atol=1e-6)


def test_a_tread_far_from_where_it_was_seen_is_said() -> None:
    """The revision has the map of before, and names the step that contradicts it."""
    keeper = walked_up(np.array([0.0, 0.0, -0.06, -0.06, -0.06]))
    keeper.task(2, name="walk 1", planned=1, revises_map=True)
    newest = keeper.run(21.0)
    assert newest.map is FIRST.map and not newest.looked and newest.stood_on > 0
    assert newest.reason == "the feet contradict the map: step 3 is 0.06 m lower than it has"


def test_feet_that_would_leave_no_course_leave_the_map() -> None:
    """Where steps would be in no order, the revision has the map of before, and says so."""
    keeper = walked_up()
    told = keeper.heights
    state = told.state.copy()
    state[2] = state[1] - 0.01
    kept: MapMemory = keeper.context.get_abstract_state(0).get_value()
    kept = replace(kept, heights=replace(told, state=state))
    keeper.context.get_mutable_abstract_state(0).set_value(kept)
    keeper.task(2, name="walk 1", planned=1, revises_map=True)
    newest = keeper.run(21.0)
    assert newest.map is FIRST.map and newest.reason


def test_a_robot_whose_feet_stood_on_no_tread_keeps_its_map() -> None:
    """It is asked to revise it all the same, and does not keep anybody waiting."""
    keeper = Keeper()
    fix_inputs(keeper.system, keeper.context, contacts=np.zeros(4))
    keeper.task(2, name="walk 1", planned=1, revises_map=True)
    newest = keeper.run(0.2)
    assert newest.number == 1 and newest.map is FIRST.map and not newest.reason
