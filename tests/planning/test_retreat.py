"""The way back from a tread: the walk there, backwards, with swings of its own."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from growing_rig import eyes, first_map, gait, standing
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.planning.mission import plan_mission
from drake_quad.planning.motion_plan import MotionPlan, Stance, evaluate
from drake_quad.planning.onward import Onward, plan_onward
from drake_quad.planning.retreat import BACK_DOWN, plan_backwards, plan_retreat
from drake_quad.robot.legs import LEGS


@cache
def onward() -> Onward:
    known = first_map(8)
    return plan_onward(paper_robot(), gait(), known, standing(known), eyes(), lift_off_margin=0.02)


@cache
def there_and_back() -> tuple[MotionPlan, MotionPlan]:
    """A walk up to a tread, and the way back from its end."""
    robot, found = paper_robot(), onward()
    walk = plan_mission(
        robot, found.course, found.settings, found.tasks, standing(first_map(8))
    ).plans[0]
    back = plan_backwards(robot, found.course, found.settings, walk, walk.end, index=2)
    return walk, back


def test_the_body_goes_back_the_way_it_came() -> None:
    """The same poses at mirrored times, at rest at both ends, to rounding."""
    walk, back = there_and_back()
    times = np.linspace(0.0, back.duration, 200)
    ahead, backwards = walk.body.samples(back.duration - times), back.body.samples(times)
    assert np.allclose(backwards[:, 0], ahead[:, 0], atol=1e-9)
    assert np.allclose(backwards[:, 1], -ahead[:, 1], atol=1e-9)
    assert np.allclose(backwards[:, 2], ahead[:, 2], atol=1e-8)
    assert 0.0 <= back.duration - walk.duration < walk.body.knot


def test_each_foot_goes_back_to_where_it_stood_when_it_left() -> None:
    """Steps in the opposite order, from where they ended to where the foot had rolled to."""
    walk, back = there_and_back()
    there, returns = walk.contacts.steps, back.contacts.steps
    assert [s.leg for s in returns] == [s.leg for s in reversed(there)]
    for one, other in zip(reversed(there), returns, strict=True):
        left, _ = walk.contacts.feet_at(np.array([one.lift_off]))
        assert np.allclose(other.swing.p_end, left[0, one.leg.row], atol=2e-3)
        assert other.lift_off == pytest.approx(back.duration - one.touchdown)
        assert other.touchdown == pytest.approx(back.duration - one.lift_off)
    assert np.allclose(back.end.feet, walk.contacts.feet, atol=0.03)


def test_its_margins_are_those_of_the_walk() -> None:
    """The least of them to 5 mm: feet that roll the other way are where they were."""
    walk, back = there_and_back()
    least = [
        float(evaluate(paper_robot(), p, np.arange(0.0, p.duration, 0.02)).margin.min())
        for p in (walk, back)
    ]
    assert least[1] == pytest.approx(least[0], abs=0.005)
    assert back.margin == pytest.approx(least[1], abs=0.005)


def test_swings_back_clear_the_nosings() -> None:
    """No swing foot comes nearer to the ground under it than its radius, but at its ends."""
    _, back = there_and_back()
    course, radius = onward().course, paper_robot().foot_radius
    for step in back.contacts.steps:
        points = step.swing.positions(np.linspace(0.0, step.swing.duration, 60))[3:-3]
        above = points[:, 2] - course.height(points[:, 0], points[:, 1])
        assert above.min() > radius - 1e-3, step.leg.short


def test_a_retreat_ends_where_the_robot_started_and_is_checked() -> None:
    """One task a walk, to the start's place; without margin, or after a push, there is none."""
    walk, _ = there_and_back()
    robot, found = paper_robot(), onward()
    start = standing(first_map(8))

    def retreat(walk: MotionPlan, stance: Stance, margin: float) -> tuple[str, float]:
        (task,) = plan_retreat(
            robot, found.course, found.settings, [walk], stance, first_index=3,
            lift_off_margin=margin,
        )  # fmt: skip
        return task.name, task.goal

    name, goal = retreat(walk, walk.end, 0.02)
    along = float(found.course.lanes[0].coordinates(start.body[:2])[0])
    assert name == BACK_DOWN and goal == pytest.approx(along, abs=1e-6)
    with pytest.raises(PlanningError, match="margin"):
        retreat(walk, walk.end, 0.5)
    with pytest.raises(PlanningError, match="anew"):
        retreat(replace(walk, revision=1), walk.end, 0.02)


def test_it_begins_from_the_feet_as_they_stand() -> None:
    """A foot 8 mm off where the walk put it steps from there."""
    walk, _ = there_and_back()
    robot, found = paper_robot(), onward()
    feet = np.array(walk.end.feet)
    feet[LEGS[0].row, 0] += 0.008
    back = plan_backwards(
        robot, found.course, found.settings, walk, Stance(walk.end.body, feet), index=2
    )
    first = next(s for s in back.contacts.steps if s.leg is LEGS[0])
    assert np.array_equal(first.swing.p_start, feet[LEGS[0].row])
