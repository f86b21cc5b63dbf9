"""Designs are tried no longer than their answer needs, and the answer stays what it was."""

from dataclasses import replace
from functools import partial
from typing import NoReturn

import numpy as np
import pytest
from design_rig import MODEL, designed
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.feasibility.check import check_flight
from drake_quad.gait_design import (
    designed as designed_module,
    designer,
    plan_candidates as designer_lower,
)
from drake_quad.gait_design.designed import Designed, plan_design
from drake_quad.planning.clearance import check_self_collision
from drake_quad.planning.mission import (
    check_plan,
    initial_stance,
    join_plans,
    plan_mission,
    plan_tasks,
)
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import link_outline_of
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.terrain.course import Course
from drake_quad.terrain.elements import Element, Stairs


@pytest.fixture(autouse=True, scope="module")
def design_first() -> None:
    """Made before any test replaces what designs are made by, in whatever order tests are run."""
    designed()


def course() -> Course:
    """The design's course."""
    return course_of(designed().scenario, foot_radius=paper_robot().foot_radius)


def tried_against(beat: Designed | None) -> Designed | None:
    found, robot = designed(), paper_robot()
    shape = link_outline_of(robot)
    return plan_design(
        found.scenario, design=found.design, robot=robot, shape=shape, course=course(),
        source="test", beat=beat,
    )  # fmt: skip


def test_a_design_is_no_better_than_itself() -> None:
    """With its own plan at hand it is given up; with none it is planned, and is the same again."""
    assert tried_against(designed()) is None
    again = tried_against(None)
    assert again is not None
    assert again.margin == designed().margin and again.clearance == designed().clearance
    assert again.quality == designed().quality


def test_a_plan_at_which_the_clock_would_stop_is_refused() -> None:
    """A HyQReal was told yes with 7 mm, and stopped before a lift-off that asks for 14 mm."""
    found, robot = designed(), paper_robot()
    strict = replace(found.scenario, controller=replace(found.scenario.controller))
    plan = partial(
        plan_design, design=found.design, robot=robot, shape=link_outline_of(robot),
        course=course(), source="test",
    )  # fmt: skip
    strict.controller.lift_off_margin = 0.9 * found.margin
    assert plan(strict, beat=None) is not None
    strict.controller.lift_off_margin = 1.01 * found.margin
    with pytest.raises(PlanningError, match="no foot is lifted with less than") as caught:
        plan(strict, beat=None)
    assert found.margin <= caught.value.data["margin"] < 1.1 * 1.01 * found.margin


def test_a_design_is_refused_on_slopes_that_friction_does_not_hold(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its plans are looked at with the friction that its controller counts on."""

    def refuse(ground: Course, plan: MotionPlan, friction: float) -> NoReturn:
        assert friction == designed().scenario.controller.friction
        raise PlanningError("a slope")

    monkeypatch.setattr(designed_module, "check_slopes", refuse)
    with pytest.raises(PlanningError, match="a slope"):
        tried_against(None)


def test_hopeless_stairs_are_told_without_what_would_work_if_not_asked() -> None:
    """The figures behind the answer are there all the same."""
    check = check_flight(MODEL, Stairs(0.9, 0.25, 2), nearest=False)
    assert not check.feasible and "nearest_rise" not in check.data
    assert min(check.data["slacks"].values()) < 0.0
    assert "quick search" not in check.reason


def test_tasks_planned_one_by_one_make_the_mission() -> None:
    """Whoever stops early has the same first plans; who does not has all of them."""
    scenario, robot = load_scenario("spin_both_ways"), paper_robot()
    course, settings = course_of(scenario), plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    tasks = mission_of(scenario, course)
    whole = plan_mission(robot, course, settings, tasks, stance)
    plans = list(plan_tasks(robot, course, settings, tasks, stance))
    joined = join_plans(plans, 0.0)
    assert joined.starts == whole.starts and joined.duration == whole.duration
    assert next(plan_tasks(robot, course, settings, tasks, stance)).index == 0
    for a, b in zip(joined.plans, whole.plans, strict=True):
        np.testing.assert_array_equal(a.body.control, b.body.control)
    assert joined.starts[-1] == pytest.approx(sum(p.duration for p in plans[:-1]))


@pytest.mark.parametrize(("ratio", "slower"), [(1.3, True), (5.0, False)])
def test_joints_that_would_turn_too_fast_are_given_time(ratio: float, slower: bool) -> None:
    """Planned once more, slower by more than asked for; but not many times as slow."""
    asked = []

    def plan(scenario: Scenario) -> None:
        asked.append((scenario.gait.cycle_time, scenario.transition.swing_time))
        if len(asked) == 1:
            raise PlanningError("too fast", too_fast=ratio)

    if slower:
        designer_lower._or_slower(Scenario(), plan)
        (cycle, swing), (cycle_after, swing_after) = asked
        assert ratio < cycle_after / cycle < 1.5 * ratio
        assert swing_after / swing == pytest.approx(cycle_after / cycle)
    else:
        with pytest.raises(PlanningError, match="too fast"):
            designer_lower._or_slower(Scenario(), plan)
        assert len(asked) == 1


def test_a_plan_that_folds_a_shank_into_the_trunk_is_refused() -> None:
    """HyQReal's spin did, 4 cm deep, and it fell; the plan says which leg, where and how far."""
    robot, found = paper_robot(), designed()
    task = mission_of(found.scenario, course_of(found.scenario))[0]
    samples = check_plan(robot, found.plan.plans[0], dynamic=False)
    check_self_collision(robot, task, samples)
    large = np.array([[[-1.0, -1.0, -0.6], [1.0, 1.0, 0.2]]])
    with pytest.raises(PlanningError, match=r"the shank of [FR][LR] would be .* inside the trunk"):
        check_self_collision(replace(robot, trunk_boxes=large), task, samples)


def test_a_plan_that_sets_a_foot_against_another_is_refused() -> None:
    """A Mini Cheetah's rear feet landed on its front ones, going down."""
    robot, found = paper_robot(), designed()
    task = mission_of(found.scenario, course_of(found.scenario))[0]
    samples = check_plan(robot, found.plan.plans[0], dynamic=False)
    check_self_collision(robot, task, samples)
    with pytest.raises(PlanningError, match=r"the feet .* would be .* too near each other"):
        check_self_collision(replace(robot, foot_radius=0.4), task, samples)


def test_no_design_is_taken_that_folds_a_shank_into_the_trunk() -> None:
    """The designer asks it of every task, and refuses at the first."""
    found, large = designed(), np.array([[[-1.0, -1.0, -0.6], [1.0, 1.0, 0.2]]])
    robot = replace(paper_robot(), trunk_boxes=large)
    with pytest.raises(PlanningError, match="inside the trunk"):
        plan_design(
            found.scenario, design=found.design, robot=robot, shape=link_outline_of(robot),
            course=course(), source="test", beat=None,
        )  # fmt: skip


def test_no_design_is_taken_that_leans_a_thigh_on_the_stairs() -> None:
    """The designer asks it of every task, too."""
    found, robot = designed(), paper_robot()
    thick = replace(robot, thigh_radii=robot.thigh_radii + 0.6)
    with pytest.raises(PlanningError, match=r"the thigh of [FR][LR] would be .* inside the stairs"):
        plan_design(
            found.scenario, design=found.design, robot=thick, shape=link_outline_of(robot),
            course=course(), source="test", beat=None,
        )  # fmt: skip


@pytest.mark.parametrize(("share", "tried"), [(0.9, 2), (1.0, 1)])
def test_a_gait_with_less_margin_than_is_wanted_does_not_keep_others_from_being_tried(
    share: float, tried: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Go2 on 0.07 m had 13 mm with one place to a tread, on 0.08 m 32 mm with two."""
    found = designed()
    design = replace(found.design, score=1.0)
    less = replace(found, margin=share * design.wanted["margin"])
    assert less.quality >= designer.TAKEN and less.has_margin == (tried == 1)
    plans = [less, found]
    monkeypatch.setattr(designer, "choose_gaits", lambda *_, **__: iter([design, design]))
    monkeypatch.setattr(designer, "plan_design", lambda *_, **__: plans.pop(0))
    told = designer.design_scenario(found.scenario)
    assert told is (found if tried == 2 else less) and len(plans) == 2 - tried


@pytest.mark.parametrize(
    ("slope", "told", "counted"),
    [(0.4, 0.5, 0.5), (0.6, 0.5, 0.733), (0.7, 0.5, 0.5), (0.6, 0.55, 0.55)],
)
def test_a_design_counts_on_the_friction_that_slopes_take(
    slope: float, told: float, counted: float
) -> None:
    """As far as the ground has it (0.8 here), and only where nobody has said what to count on."""
    elements = [
        Element("floor", length=2.0),
        Element("slope", going="up", height=2.0 * slope, length=2.0),
        Element("floor", length=2.0),
    ]
    scenario = Scenario(course=elements)
    scenario.controller.friction = told
    ground = course_of(scenario, foot_radius=paper_robot().foot_radius)
    asked = designer.count_on_slopes(scenario, ground)
    assert asked.controller.friction == pytest.approx(counted, abs=1e-3)
    assert scenario.controller.friction == told
