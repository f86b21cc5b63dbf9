"""The map keeper alone, through its ports and its own Context."""

from dataclasses import replace

import numpy as np
from growing_rig import DEEP, FEET, NOT_SEEN, first_map, flight
from pydrake.systems.analysis import Simulator
from rig import fix_inputs, stand_plan

from drake_quad.control.ports import SIZE, GaitPhase
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.sight import MapRevision, with_reason
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.planning.onward import LOOK_AGAIN
from drake_quad.systems.depth_camera import NO_IMAGE
from drake_quad.systems.map_keeper import LONGEST_WAIT, MapKeeper, MapSettings
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
        self.task(1, name="walk 1")

    def task(self, index: int, *, name: str = LOOK_AGAIN, planned: int | None = None) -> None:
        """Sets the clock's task, and the plan under way."""
        plan = stand_plan(index=index if planned is None else planned)
        segment = replace(plan.segments[0], name=name)
        phase = np.zeros(SIZE)
        phase[GaitPhase.TASK] = index
        plan = replace(plan, segments=(segment,), goes_on=True)
        fix_inputs(self.system, self.context, gait_phase=phase, motion_plan=plan)

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
