"""Designs are tried no longer than their answer needs, and the answer stays what it was."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from rig import paper_robot

from drake_quad import designer, designer_lower
from drake_quad.check_stairs import check_stairs, stairs_scenario
from drake_quad.design.choose import Design
from drake_quad.design.refuse import refuse_touching
from drake_quad.design.search import AGAIN, QUICK, THOROUGH, Way
from drake_quad.design.shape import read_shape
from drake_quad.designer import design_scenario
from drake_quad.designer_lower import ANY_LOWER, LOWER, Gait, plan_any, plan_lower
from drake_quad.designer_plan import POOR, Designed, plan_design
from drake_quad.errors import PlanningError
from drake_quad.planning.plan_mission import (
    check_plan,
    initial_stance,
    join_plans,
    plan_mission,
    plan_tasks,
)
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario import course_of, load_scenario, mission_of, plan_settings
from drake_quad.scenario_config import Scenario

MODEL = "package://drake_quad_models/paper_quadruped.urdf"


@pytest.fixture(autouse=True, scope="module")
def design_first() -> None:
    """Made before any test replaces what designs are made by, in whatever order tests are run."""
    designed()


@cache
def designed() -> Designed:
    scenario = stairs_scenario(paper_robot(), model=MODEL, rise=0.1, run=0.3, count=2)
    return design_scenario(scenario, robot=paper_robot())


def tried_against(beat: Designed | None) -> Designed | None:
    found, robot = designed(), paper_robot()
    shape = read_shape(robot)
    return plan_design(
        found.scenario, design=found.design, robot=robot, shape=shape, source="test", beat=beat
    )


def test_a_design_is_no_better_than_itself() -> None:
    """With its own plan at hand it is given up; with none it is planned, and is the same again."""
    assert tried_against(designed()) is None
    again = tried_against(None)
    assert again is not None
    assert again.margin == designed().margin and again.room == designed().room
    assert again.quality == designed().quality


def test_a_plan_at_which_the_clock_would_stop_is_refused() -> None:
    """A HyQReal was told yes with 7 mm, and stopped before a lift-off that asks for 14 mm."""
    found, robot = designed(), paper_robot()
    strict = replace(found.scenario, controller=replace(found.scenario.controller))
    plan = partial(
        plan_design, design=found.design, robot=robot, shape=read_shape(robot), source="test"
    )
    strict.controller.lift_off_margin = 0.9 * found.margin
    assert plan(strict, beat=None) is not None
    strict.controller.lift_off_margin = 1.01 * found.margin
    with pytest.raises(PlanningError, match="no foot is lifted with less than") as caught:
        plan(strict, beat=None)
    assert found.margin <= caught.value.data["margin"] < 1.1 * 1.01 * found.margin


def test_hopeless_stairs_are_told_without_what_would_work_if_not_asked() -> None:
    """The figures behind the answer are there all the same."""
    check = check_stairs(MODEL, rise=0.9, run=0.25, count=2, nearest=False)
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


@pytest.mark.parametrize(
    ("qualities", "heights", "kept"),
    [
        ((0.6,), 1, 0.6),  # good enough: no other is tried
        ((0.3, 0.4), 2, 0.4),  # poor: the next lower one too, and it is better
        ((0.3, 0.2), 2, 0.3),  # or it is not
        ((None, 0.3, 0.4), 3, 0.4),  # one that cannot be planned is no plan
        ((None, 0.6), 2, 0.6),
        ((None,) * len(LOWER), len(LOWER), None),
    ],
)
def test_of_a_poor_plan_the_next_lower_body_is_tried(
    monkeypatch: pytest.MonkeyPatch,
    qualities: tuple[float | None, ...],
    heights: int,
    kept: float | None,
) -> None:
    """And the better of the two is kept, which is never the worse."""
    tried: list[float] = []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def plan(scenario: Scenario, beat: Designed | None) -> Designed | None:
        quality = qualities[len(tried)]
        tried.append(scenario.gait.body_height)
        if quality is None:
            raise PlanningError("no plan")
        if beat is not None and quality <= beat.quality:
            return None
        return replace(designed(), margin=quality)

    best, refused = plan_lower(Gait(1.0, Scenario(), plan), 0.5, None)
    height = Scenario().gait.body_height
    assert tried == pytest.approx([height - 0.5 * share for share in LOWER[:heights]])
    assert (best and best.quality) == kept
    assert (refused is None) == (None not in qualities)


@pytest.mark.parametrize(("data", "touches", "heights"), [("room", 1, 1), ("apart", 2, 2),
                                                         ("excess", 1, 6)])  # fmt: skip
def test_where_parts_touch_lower_bodies_are_tried_as_often_as_told(
    data: str, touches: int, heights: int
) -> None:
    """They are for legs that are too short."""
    tried = []

    def plan(scenario: Scenario, beat: Designed | None) -> Designed | None:
        tried.append(scenario.gait.body_height)
        raise PlanningError("no plan", **{data: -0.01})

    best, refused = plan_lower(Gait(1.0, Scenario(), plan), 0.5, None, touches)
    assert best is None and refused is not None and len(tried) == heights


def test_a_lower_body_is_as_slow_as_the_higher_one_had_to_be() -> None:
    """What a higher body was refused for once is not tried again lower."""
    asked: list[float] = []

    def plan(scenario: Scenario, beat: Designed | None) -> Designed | None:
        asked.append(scenario.gait.cycle_time)
        if len(asked) == 1:
            raise PlanningError("too fast", too_fast=1.3)
        if len(asked) == 2:
            raise PlanningError("no plan")
        return replace(designed(), margin=1.0)

    best, _ = plan_lower(Gait(1.0, Scenario(), plan), 0.5, None)
    assert best is not None and len(asked) == 3
    assert asked[0] < asked[1] == asked[2]


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
    refuse_touching(robot, task, samples)
    large = np.array([[[-1.0, -1.0, -0.6], [1.0, 1.0, 0.2]]])
    with pytest.raises(PlanningError, match=r"the shank of [FR][LR] would be .* inside the trunk"):
        refuse_touching(replace(robot, trunk_boxes=large), task, samples)


def test_a_plan_that_sets_a_foot_against_another_is_refused() -> None:
    """A Mini Cheetah's rear feet landed on its front ones, going down."""
    robot, found = paper_robot(), designed()
    task = mission_of(found.scenario, course_of(found.scenario))[0]
    samples = check_plan(robot, found.plan.plans[0], dynamic=False)
    refuse_touching(robot, task, samples)
    with pytest.raises(PlanningError, match=r"the feet .* would be .* too near each other"):
        refuse_touching(replace(robot, foot_radius=0.4), task, samples)


def test_no_design_is_taken_that_folds_a_shank_into_the_trunk() -> None:
    """The designer asks it of every task, and refuses at the first."""
    found, large = designed(), np.array([[[-1.0, -1.0, -0.6], [1.0, 1.0, 0.2]]])
    robot = replace(paper_robot(), trunk_boxes=large)
    with pytest.raises(PlanningError, match="inside the trunk"):
        plan_design(
            found.scenario, design=found.design, robot=robot, shape=read_shape(robot),
            source="test", beat=None,
        )  # fmt: skip


def test_no_design_is_taken_that_leans_a_thigh_on_the_stairs() -> None:
    """The designer asks it of every task, too."""
    found, robot = designed(), paper_robot()
    thick = replace(robot, thigh_radii=robot.thigh_radii + 0.6)
    with pytest.raises(PlanningError, match=r"the thigh of [FR][LR] would be .* inside the stairs"):
        plan_design(
            found.scenario, design=found.design, robot=thick, shape=read_shape(robot),
            source="test", beat=None,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("score", "quality", "sought"),
    [
        (0.8, 0.9, ["quick"]),  # good enough
        (0.8, POOR, ["quick"]),
        (0.8, 0.3, ["quick", "again", "thorough"]),  # poor
        (0.8, None, ["quick", "again", "thorough"]),  # no plan of it
        (-0.1, None, ["quick", "again", "thorough"]),  # nearly a gait
        (-2.0, None, ["quick"]),  # hopeless
    ],
)
def test_gaits_are_sought_thoroughly_where_it_may_help(
    monkeypatch: pytest.MonkeyPatch, score: float, quality: float | None, sought: list[str]
) -> None:
    """If the quick search leads to no plan or a poor one, and came near to a gait at all."""
    ways, names = [], {QUICK: "quick", AGAIN: "again", THOROUGH: "thorough"}
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def gaits(
        robot: RobotModel, shape: object, flights: object, way: Way, **_: object
    ) -> Iterator[Design]:
        ways.append(names[way])
        yield replace(designed().design, score=score)

    def lower(*_: object) -> tuple[Designed | None, PlanningError | None]:
        assert score > 0.0
        return None if quality is None else replace(designed(), margin=quality), None

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    monkeypatch.setattr(designer, "plan_lower", lower)
    scenario = stairs_scenario(paper_robot(), model=MODEL, rise=0.1, run=0.3, count=2)
    if quality is None:
        with pytest.raises(PlanningError):
            design_scenario(scenario, robot=paper_robot(), nearest=False)
    else:
        assert design_scenario(scenario, robot=paper_robot()).margin == quality
    assert ways == sought


def test_where_any_plan_will_do_no_other_way_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """However poor it is, and of the quick search's gaits no more are looked for than are tried."""
    ways, scores = [], []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def gaits(
        robot: RobotModel, shape: object, flights: object, way: Way, **_: object
    ) -> Iterator[Design]:
        ways.append(way)
        for score in (0.8, 0.7, 0.6):
            scores.append(score)
            yield replace(designed().design, score=score)

    def plan(scenario: Scenario, *, design: Design, **_: object) -> Designed:
        if design.score == 0.8:
            raise PlanningError("no plan")
        return replace(designed(), margin=-0.1)

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    monkeypatch.setattr(designer, "plan_design", plan)
    scenario = stairs_scenario(paper_robot(), model=MODEL, rise=0.1, run=0.3, count=2)
    assert design_scenario(scenario, robot=paper_robot(), thorough=False).margin == -0.1
    assert ways == [QUICK] and scores == [0.8, 0.7]


def test_any_plan_is_sought_of_all_gaits_before_their_bodies_are_lowered() -> None:
    """Height by height; with none, why the first was refused."""
    tried: list[tuple[str, float]] = []

    def gait(name: str) -> Gait:
        def plan(scenario: Scenario, beat: None) -> Designed | None:
            tried.append((name, scenario.gait.body_height))
            raise PlanningError(f"{name} cannot")

        return Gait(1.0, Scenario(), plan)

    found, refused = plan_any(iter([gait("a"), gait("b")]), 0.5)
    height = Scenario().gait.body_height
    assert found is None and refused is not None and refused.reason == "a cannot"
    assert [name for name, _ in tried] == ["a", "b"] * len(ANY_LOWER)
    assert [h for _, h in tried[::2]] == pytest.approx([height - 0.5 * s for s in ANY_LOWER])
    assert plan_any(iter(()), 0.5) == (None, None)


@pytest.mark.parametrize(
    ("first", "planned"),
    [(0.3, [0.8, 0.2, 0.2, 0.2]), (0.6, [0.8])],  # the less promising is kept out by a fair one
)
def test_a_poor_plan_keeps_no_other_gait_from_being_planned(
    monkeypatch: pytest.MonkeyPatch, first: float, planned: list[float]
) -> None:
    """A gait with less room on endless stairs may be the better one on the course."""
    scores: list[float] = []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def gaits(*asked: object, **_: object) -> Iterator[Design]:
        for score in (0.8, 0.2) if asked[-1] is QUICK else (0.2,):
            yield replace(designed().design, score=score)

    def lower(gait: Gait, *_: object) -> tuple[Designed, None]:
        scores.append(gait.score)
        return replace(designed(), margin=first), None

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    monkeypatch.setattr(designer, "plan_lower", lower)
    scenario = stairs_scenario(paper_robot(), model=MODEL, rise=0.1, run=0.3, count=2)
    design_scenario(scenario, robot=paper_robot())
    assert scores == planned


@pytest.mark.parametrize(
    ("run", "found", "asked", "kept"),
    [
        (0.4, {100.0: 0.1}, [100.0], 0.1),  # no tread is like a floor
        (2.0, {100.0: 0.9, 1.217: 0.8}, [100.0], 0.9),  # a good gait with places on each tread
        (2.0, {100.0: 0.1, 1.217: 0.3}, [100.0, 1.217], 0.3),  # a poor one: the better of two
        (2.0, {100.0: 0.2, 1.217: 0.1}, [100.0, 1.217], 0.2),
        (2.0, {100.0: 0.2}, [100.0, 1.217], 0.2),
        (2.0, {1.217: 0.1}, [100.0, 1.217], 0.1),  # none
        (2.0, {}, [100.0, 1.217], None),
    ],
)
def test_deep_treads_are_walked_like_floors_where_no_gait_suits_them(
    monkeypatch: pytest.MonkeyPatch,
    run: float,
    found: dict[float, float],
    asked: list[float],
    kept: float | None,
) -> None:
    """And the better of both is kept; that treads are deep is told with a no."""
    depths: list[float] = []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def design(scenario: Scenario, *_: object, **__: object) -> Designed:
        depths.append(scenario.gait.deep_tread)
        if depths[-1] not in found:
            raise PlanningError("no plan", excess=0.1)
        return replace(designed(), margin=found[depths[-1]])

    monkeypatch.setattr(designer, "_design", design)
    scenario = stairs_scenario(paper_robot(), model=MODEL, rise=0.1, run=run, count=2)
    if kept is None:
        with pytest.raises(PlanningError) as caught:
            design_scenario(scenario, robot=paper_robot())
        assert caught.value.data == {"excess": 0.1, "deep": True}
    else:
        assert design_scenario(scenario, robot=paper_robot()).margin == kept
    assert depths == asked
