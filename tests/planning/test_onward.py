"""The next stretch on a map that grows: to where more is seen, on known steps, or to the goal."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from growing_rig import DEEP, FIRST, RUN, eyes, first_map, flight, gait, standing
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.perception.growing_map import grow_map
from drake_quad.perception.look_again import nosings_in_view
from drake_quad.perception.stair_map import StairMap, unfinished
from drake_quad.planning import onward as onward_module
from drake_quad.planning.mission import plan_mission
from drake_quad.planning.onward import (
    GOOD_VIEW,
    LOOK_AGAIN,
    SHANK_ROOM,
    Onward,
    doubtful_foothold,
    plan_onward,
    with_map_errors,
)


def onward(known: StairMap) -> Onward:
    return plan_onward(paper_robot(), gait(), known, standing(known), eyes(), lift_off_margin=0.02)


@cache
def onward_on(steps: int) -> Onward:
    """The next stretch on the first map of so many steps."""
    return onward(first_map(steps))


@pytest.mark.parametrize("trusted", [4, 6, 8])
def test_feet_are_put_down_on_steps_alone_that_are_known_well(trusted: int) -> None:
    """None is beyond the last trusted nosing, and where it stops nosings of the map are in view."""
    known = replace(first_map(8), trusted=trusted)
    found = onward(known)
    assert found.goes_on and [task.kind for task in found.tasks] == ["walk", "stand"]
    assert found.tasks[-1].name == LOOK_AGAIN
    robot, lane = paper_robot(), found.course.lanes[0]
    plan = plan_mission(robot, found.course, found.settings, found.tasks, standing(known))
    places = [lane.coordinates(s.swing.p_end)[0] for s in plan.plans[0].contacts.steps]
    assert np.max(places) < FIRST + (trusted - 1) * RUN
    camera = eyes().pose(plan.plans[-1].end.body)
    assert len(nosings_in_view(known, eyes().model, camera)) >= GOOD_VIEW


def test_of_all_treads_it_takes_the_one_farthest_up() -> None:
    """The more steps are known, the farther it goes."""
    goals = [onward_on(n).tasks[0].goal for n in (6, 8, 10)]
    assert goals == sorted(goals) and goals[2] > goals[0] + RUN


def test_a_camera_far_ahead_of_the_feet_may_see_one_known_nosing_alone() -> None:
    """The robot then climbs to there, and stays on the floor no longer than it has to."""
    known, ahead = first_map(6), replace(eyes(), p_BC=np.array([1.1, 0.0, 0.12]))
    found = plan_onward(paper_robot(), gait(), known, standing(known), ahead, lift_off_margin=0.02)
    assert found.goes_on and found.tasks[0].goal > FIRST
    plan = plan_mission(paper_robot(), found.course, found.settings, found.tasks, standing(known))
    assert len(nosings_in_view(known, ahead.model, ahead.pose(plan.plans[-1].end.body))) == 1


def test_a_stretch_in_which_joints_would_turn_too_fast_is_walked_slower() -> None:
    """By as much as the joints ask for; the gait is as fast again on the next stretch."""
    known, usual = first_map(8), gait()
    fast = replace(usual, cycle_time=usual.cycle_time / 3.5, swing_time=0.3, shift_time=0.3)
    found = plan_onward(paper_robot(), fast, known, standing(known), eyes(), lift_off_margin=-1.0)
    slower = found.settings.cycle_time / fast.cycle_time
    assert 1.1 < slower < 1.1 * 3.0
    assert found.settings.swing_time == pytest.approx(slower * fast.swing_time)


def test_it_goes_nearer_on_the_floor_where_there_is_no_tread_to_stop_on() -> None:
    """With two known steps it stops before the flight, its feet on the floor."""
    found = onward(replace(first_map(8), trusted=2))
    assert found.goes_on and found.tasks[0].goal < FIRST - 0.4


def test_a_map_that_is_complete_is_walked_to_its_end() -> None:
    """From the floor: up, and it stands on the landing."""
    known = grow_map(
        first_map(), flight(3, 4, most=4), DEEP, feet=np.zeros((0, 3)), landing=3.0, reach=0.4,
        look=1,
    )  # fmt: skip
    found = onward(known)
    assert not found.goes_on and [task.kind for task in found.tasks] == ["walk", "stand"]
    assert found.tasks[0].goal > known.places[-1] + 1.0


def test_where_what_is_seen_runs_out_it_says_so() -> None:
    """A robot that is as far up as it may go, and knows no more, has no way on.

    Before that it goes to where no known nosing is in view any more, but a further one would be.
    """
    known, found = first_map(8), onward_on(8)
    plan = plan_mission(paper_robot(), found.course, found.settings, found.tasks, standing(known))
    end = plan.plans[-1].end
    with pytest.raises(PlanningError, match=r"0.84 m of the landing are seen"):
        plan_onward(
            paper_robot(), gait(), replace(known, doubt="0.84 m of the landing are seen"), end,
            eyes(), lift_off_margin=0.02,
        )  # fmt: skip
    last = plan_onward(paper_robot(), gait(), known, end, eyes(), lift_off_margin=0.02)
    assert last.goes_on
    plan = plan_mission(paper_robot(), last.course, last.settings, last.tasks, end)
    places = [s.swing.p_end[0] for s in plan.plans[0].contacts.steps]
    assert np.max(places) < FIRST + 7 * RUN
    end = plan.plans[-1].end
    camera = eyes().pose(end.body)
    assert not len(nosings_in_view(known, eyes().model, camera))
    assert nosings_in_view(known, eyes().model, camera, further=1).tolist() == [8]
    with pytest.raises(PlanningError, match="how many steps there are is not known"):
        plan_onward(paper_robot(), gait(), known, end, eyes(), lift_off_margin=0.02)


def test_errors_of_the_map_are_allowed_for() -> None:
    """Those of the steps that are planned on, and never less than what is asked for on any map."""
    known = first_map(8)
    assert onward_on(8).settings.map_error_place >= known.error_place
    careful = replace(gait(), map_error_place=0.02)
    found = plan_onward(
        paper_robot(), careful, known, standing(known), eyes(), lift_off_margin=0.02
    )
    assert found.settings.map_error_place == 0.02


def test_a_path_that_leads_a_shank_into_the_stairs_is_looked_for_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With further searches; if these find none either, the stretch is refused with the reason."""
    tried: list[int] = []
    usual = onward_module._checked

    def checked(*given: Any) -> Any:
        tried.append(given[2].searches)
        if given[2].searches < onward_module.SEARCHES:
            raise PlanningError("the knee or shank of FR would be inside the stairs", room=-0.02)
        return usual(*given)

    monkeypatch.setattr(onward_module, "_checked", checked)
    found = onward(first_map(6))
    assert tried[:2] == [1, onward_module.SEARCHES]
    assert found.settings.searches == onward_module.SEARCHES

    def never(*given: Any) -> Any:
        raise PlanningError("the knee or shank of FR would be inside the stairs", room=-0.02)

    monkeypatch.setattr(onward_module, "_checked", never)
    with pytest.raises(PlanningError, match="inside the stairs"):
        onward(first_map(6))


def test_a_stretch_with_too_little_margin_is_walked_with_longer_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The body gets more time to shift, until the margin suffices; if it never does, it says so."""
    tried: list[tuple[float, float, float]] = []
    usual = onward_module._checked

    def checked(*given: Any) -> Any:
        tried.append((given[2].cycle_time, given[2].switch_wait, given[2].shift_time))
        if len(tried) < 3:
            raise PlanningError("the static margin would be -0.003 m", margin=-0.003)
        return usual(*given)

    monkeypatch.setattr(onward_module, "_checked", checked)
    known = replace(first_map(6), complete=True)
    waiting = replace(gait(), switch_wait=0.4)
    found = plan_onward(
        paper_robot(), waiting, known, standing(known), eyes(), lift_off_margin=0.02
    )
    for before, after in pairwise(tried):
        assert after == pytest.approx(tuple(onward_module.PATIENCE * x for x in before))
    got = found.settings
    assert (got.cycle_time, got.switch_wait, got.shift_time) == tried[2]

    def never(*given: Any) -> Any:
        raise PlanningError("the static margin would be -0.003 m", margin=-0.003)

    monkeypatch.setattr(onward_module, "_checked", never)
    with pytest.raises(PlanningError, match="static margin would be"):
        onward(first_map(6))


def test_shanks_keep_farther_from_stairs_that_are_known_less_well() -> None:
    """By more than place and height may be off; a gait that asks for more keeps that."""
    known = replace(first_map(6), error_place=0.03, error_height=0.04)
    assert with_map_errors(gait(), known).shank_room == pytest.approx(0.05 + SHANK_ROOM)
    wide = replace(gait(), shank_room=0.2)
    assert with_map_errors(wide, known).shank_room == 0.2


def test_a_nosing_that_is_not_known_well_enough_for_a_foot_is_looked_at_again() -> None:
    """Of a whole flight whose last nosing is known to 0.2 m: to a place where two are seen."""
    known = grow_map(
        first_map(), flight(3, 4, most=4), DEEP, feet=np.zeros((0, 3)), landing=3.0, reach=0.4,
        look=1,
    )  # fmt: skip
    assert not onward(known).goes_on
    errors = np.array(known.place_errors)
    errors[-1] = 0.2
    vague = replace(known, place_errors=errors, error_place=0.2)
    whole = onward(known)
    plans = plan_mission(
        paper_robot(), whole.course, whole.settings, whole.tasks, standing(known)
    ).plans
    assert doubtful_foothold(known, whole.course, plans) == ""
    assert "nosing of step 7 is known to 200 mm" in doubtful_foothold(vague, whole.course, plans)
    nearer = onward(replace(known, place_errors=errors))  # other nosings are known as before
    assert nearer.goes_on and nearer.tasks[0].goal < known.places[-1]
    first_steps = unfinished(known, "a doubt")
    assert not first_steps.complete and first_steps.doubt == "a doubt"
    assert [element.kind for element in first_steps.elements] == ["floor", "stairs", "landing"]
    found = onward(replace(first_steps, trusted=6))
    camera = eyes().pose(
        plan_mission(paper_robot(), found.course, found.settings, found.tasks, standing(known))
        .plans[-1]
        .end.body
    )
    assert found.goes_on and len(nosings_in_view(known, eyes().model, camera)) >= GOOD_VIEW
