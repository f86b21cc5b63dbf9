"""Which bodies and gaits the designer tries, how often, and when any plan will do."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from design_rig import MODEL, designed
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.feasibility.flight import make_stairs_scenario
from drake_quad.gait_design import designer
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.designed import FAIR_MARGIN, POOR, Designed
from drake_quad.gait_design.designer import design_scenario
from drake_quad.gait_design.plan_candidates import ANY_LOWER, LOWER, Gait, plan_any, plan_gaits
from drake_quad.gait_design.search import AGAIN, QUICK, THOROUGH, SearchSettings
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.elements import Stairs


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

    best, refused = plan_gaits([Gait(1.0, Scenario(), plan)], 0.5, None)
    height = Scenario().gait.body_height
    assert tried == pytest.approx([height - 0.5 * share for share in LOWER[:heights]])
    assert (best and best.quality) == kept
    assert (refused is None) == (None not in qualities)


def test_a_good_gait_is_found_before_the_bodies_of_others_are_lowered() -> None:
    """A gait that cannot be planned as high as it can be waits until the others have been tried."""
    tried: list[str] = []

    def gait(name: str, found: Designed | None) -> Gait:
        def plan(scenario: Scenario, beat: Designed | None) -> Designed:
            tried.append(name)
            if found is None:
                raise PlanningError(f"{name} cannot")
            return found

        return Gait(1.0, Scenario(), plan)

    good = designed()
    assert good.quality >= POOR
    best, refused = plan_gaits([gait("a", None), gait("b", good)], 0.5, None)
    assert tried == ["a", "b"] and best is good
    assert refused is not None and refused.reason == "a cannot"


@pytest.mark.parametrize(("share", "tried"), [(0.5, "abab"), (0.9, "ab")])
def test_a_thin_margin_has_the_bodies_of_other_gaits_lowered(share: float, tried: str) -> None:
    """ANYmal C was told 17 mm, of 31 mm wanted, where a gait with a lower body keeps 51 mm."""
    asked: list[str] = []
    good = designed()
    thin = replace(good, margin=share * good.design.wanted["margin"])
    assert thin.quality >= POOR and good.quality > thin.quality

    def plan_a(scenario: Scenario, beat: Designed | None) -> Designed:
        asked.append("a")
        if beat is not None:
            raise PlanningError("no lower body")
        return thin

    def plan_b(scenario: Scenario, beat: Designed | None) -> Designed:
        asked.append("b")
        if asked.count("b") == 1:
            raise PlanningError("its legs are too short")
        return good

    best, _ = plan_gaits([Gait(1.0, Scenario(), plan_a), Gait(1.0, Scenario(), plan_b)], 0.5, None)
    assert "".join(asked) == tried
    assert best is (good if share < FAIR_MARGIN else thin)


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

    best, refused = plan_gaits([Gait(1.0, Scenario(), plan)], 0.5, None, touches=touches)
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

    best, _ = plan_gaits([Gait(1.0, Scenario(), plan)], 0.5, None)
    assert best is not None and len(asked) == 3
    assert asked[0] < asked[1] == asked[2]


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
        robot: RobotModel, shape: object, flights: object, way: SearchSettings, **_: object
    ) -> Iterator[Design]:
        ways.append(names[way])
        yield replace(designed().design, score=score)

    def plan(scenario: Scenario, **_: object) -> Designed:
        assert score > 0.0
        if quality is None:
            raise PlanningError("no plan")
        return replace(designed(), margin=quality)

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    monkeypatch.setattr(designer, "plan_design", plan)
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, 0.3, 2), model=MODEL)
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
        robot: RobotModel, shape: object, flights: object, way: SearchSettings, **_: object
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
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, 0.3, 2), model=MODEL)
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
    [
        (0.3, [0.8, 0.2, 0.8, 0.2, 0.2, 0.2, 0.2, 0.2]),
        (0.6, [0.8]),
    ],  # the less promising is kept out by a fair one
)
def test_a_poor_plan_keeps_no_other_gait_from_being_planned(
    monkeypatch: pytest.MonkeyPatch, first: float, planned: list[float]
) -> None:
    """A gait with less room on endless stairs may be the better one on the course.

    All gaits of a search are planned before any body is lowered.
    """
    scores: list[float] = []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def gaits(*asked: object, **_: object) -> Iterator[Design]:
        for score in (0.8, 0.2) if asked[-1] is QUICK else (0.2,):
            yield replace(designed().design, score=score)

    def plan(scenario: Scenario, *, design: Design, **_: object) -> Designed:
        scores.append(design.score)
        return replace(designed(), margin=first)

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    monkeypatch.setattr(designer, "plan_design", plan)
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, 0.3, 2), model=MODEL)
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
    base = designed()  # before the design is replaced
    depths: list[float] = []
    monkeypatch.setattr(Designed, "quality", property(lambda found: found.margin))

    def design(scenario: Scenario, *_: object, **__: object) -> Designed:
        depths.append(scenario.gait.deep_tread)
        if depths[-1] not in found:
            raise PlanningError("no plan", excess=0.1)
        return replace(base, margin=found[depths[-1]])

    monkeypatch.setattr(designer, "_design", design)
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, run, 2), model=MODEL)
    if kept is None:
        with pytest.raises(PlanningError) as caught:
            design_scenario(scenario, robot=paper_robot())
        assert caught.value.data == {"excess": 0.1, "deep": True}
    else:
        assert design_scenario(scenario, robot=paper_robot()).margin == kept
    assert depths == asked
