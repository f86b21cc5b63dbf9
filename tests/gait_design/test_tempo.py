"""A gait's times are chosen as is preferred, and what they promise is the plan's own."""

import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from design_rig import COUNT, RUN, designed, found
from hypothesis import given, settings, strategies as st
from rig import URL, paper_robot

from drake_quad.common import FloatArray
from drake_quad.errors import InputError, PlanningError
from drake_quad.feasibility.check_report import feasibility_report
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design import quicken as quicken_module, tempo_planner, tempo_search
from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.choose_gait import choose_longer_gaits
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.foot_speeds import NO_SPEEDS, PEAK
from drake_quad.gait_design.pace import measure_pace
from drake_quad.gait_design.preference import (
    BALANCE,
    KEPT,
    USUAL,
    GaitPreference,
    RequiredMargins,
    required_margins,
)
from drake_quad.gait_design.quicken import (
    Proven,
    design_preferred,
    fastest,
    quicken,
    run_error,
)
from drake_quad.gait_design.search import Search
from drake_quad.gait_design.tempo import (
    MOST_PEAK,
    Tempo,
    TempoTrial,
    try_tempo,
    usual_tempo,
)
from drake_quad.gait_design.tempo_planner import PLANS, GaitChoice
from drake_quad.gait_design.tempo_search import STRETCHES, TempoSearch
from drake_quad.gait_design.tempo_trials import Trials
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.mission import initial_stance
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.step_builder import peak_speed
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.model import link_outline_of
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import parse_scenario
from drake_quad.scenario.motion_config import PREFER
from drake_quad.stability.safety import safe_margin


@settings(max_examples=30)
@given(
    swing=st.floats(0.1, 3.0),
    gap=st.floats(0.01, 3.0),
    wait=st.floats(0.0, 3.0),
)
def test_times_put_into_a_scenario_come_out_of_it(swing: float, gap: float, wait: float) -> None:
    """The gait's fields say the same times, to their four digits."""
    told = Tempo(swing, gap, gap + wait)
    put = told.put(Scenario(), guard=0.1)
    got = Tempo.of(put.gait)
    assert put.body.guard == 0.1 and got.speeds == NO_SPEEDS
    assert got.cycle == pytest.approx(told.cycle, rel=2e-3)
    assert got.swing == pytest.approx(swing, rel=1e-2, abs=2e-3)
    assert got.switch - got.gap == pytest.approx(wait, rel=1e-3, abs=1e-6)


@given(
    st.tuples(*[st.floats(0.0, 0.1)] * 2), st.tuples(*[st.floats(0.0, 0.1)] * 2),
    st.floats(0.0, 0.05),
)  # fmt: skip
def test_what_is_spared_is_of_the_margin_that_has_less(
    kept: tuple[float, float], left: tuple[float, float], more: float
) -> None:
    """Neither margin falls short of what is to be kept if something is spared; more leaves less."""
    wanted = RequiredMargins(*kept)
    spare = wanted.spare(*left)
    assert (spare >= 0.0) == (left[0] >= kept[0] and left[1] >= kept[1])
    assert wanted.more(more).spare(*left) == pytest.approx(spare - more, abs=1e-12)


@given(
    st.sampled_from([None, *PREFER]), st.none() | st.floats(0.01, 1.0),
    st.none() | st.floats(0.001, 0.1), st.sampled_from(BALANCE),
)  # fmt: skip
def test_where_nothing_is_asked_for_a_gait_is_balanced(
    prefer: str | None, speed: float | None, min_margin: float | None, balance: str
) -> None:
    """What is given stays; a speed, a margin or a balance alone needs a safe margin only."""
    asked = GaitPreference.asked(prefer, speed, min_margin, balance)
    alone = GaitPreference("margin", speed, min_margin, balance)
    if prefer is None:
        assert asked == (alone if alone.quick else GaitPreference(USUAL)) and asked.quick
    else:
        assert asked == replace(alone, prefer=prefer)


def test_a_balance_that_there_is_not_is_kept_to_be_refused() -> None:
    """It does not turn into what is usual."""
    with pytest.raises(InputError, match="balance = 'moving'"):
        GaitPreference.asked(balance="moving").check()


@pytest.mark.parametrize(
    ("quick", "slow", "taken"),
    [
        ({"foot_clearance": 0.010}, {"foot_clearance": 0.020}, True),
        ({"foot_clearance": 0.001}, {"foot_clearance": 0.020}, False),  # a run may touch
        ({"foot_clearance": 0.001}, {"foot_clearance": 0.001}, True),  # as it may already
        (None, {"foot_clearance": 0.020}, False),  # not proven
        (None, None, True),  # neither is
        ({"foot_clearance": None}, {"foot_clearance": None}, True),  # no stairs
    ],
)
def test_no_quick_gait_costs_a_proof_or_touches_the_stairs(
    quick: dict[str, float | None] | None,
    slow: dict[str, float | None] | None,
    *,
    taken: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its clearances are as much as a run may be off its plan, or as those of the slow gait."""
    before = designed()
    found = replace(before)
    proved: list[Designed] = []

    def prove(_: Proven, of: Designed) -> object:
        proved.append(of)
        least = slow if of is before else quick
        figures = {"shank_clearance": 0.03, **(least or {})}
        return SimpleNamespace(failure=None if least else "no", least=figures)

    monkeypatch.setattr(Proven, "certificate", prove)
    robot = paper_robot()
    course = course_of(before.scenario, foot_radius=robot.foot_radius)
    assert 0.001 < run_error(robot) < 0.010
    assert Proven(before, robot, course).as_good(found) == taken
    clear = quick is not None and (quick["foot_clearance"] or 1.0) >= run_error(robot)
    assert (before in proved) == (not clear)  # it takes a second, where nobody asks


def test_a_quick_gait_that_is_not_proven_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer is the gait that was found for margin, where no other is as good."""
    slow = designed()
    course = course_of(slow.scenario, foot_radius=paper_robot().foot_radius)
    quick = replace(slow, margin=2.0 * slow.margin)
    trial = SimpleNamespace(designed=quick, speed=9.0)
    monkeypatch.setattr(TempoSearch, "quickest", lambda *_: trial)
    for good, answer in ((True, quick), (False, slow)):
        monkeypatch.setattr(Proven, "as_good", lambda *_, good=good: good)
        found = quicken(slow, paper_robot(), GaitPreference("balanced"))
        assert found.margin == answer.margin and found.scenario is answer.scenario
        assert (found.certificate is not None) == good  # so that nobody makes it again
    assert Proven(slow, paper_robot(), course).certificate(slow).failure is None


def test_a_balanced_gait_is_twice_as_quick_with_nearly_the_margin() -> None:
    """The plan keeps 0.8 of either margin, no joint is near its limit, the flight is walked so."""
    robot, slow = paper_robot(), designed()
    notes: list[str] = []
    quick = quicken(slow, robot, GaitPreference("balanced"), note=notes.append)
    assert notes
    course = course_of(quick.scenario, foot_radius=robot.foot_radius)
    tasks = mission_of(quick.scenario, course)
    before, after = (measure_pace(robot, course, tasks, d.plan) for d in (slow, quick))
    assert before.slowest is not None and after.slowest is not None and after.peak is not None
    assert after.slowest.speed > 2.0 * before.slowest.speed
    assert quick.margin >= KEPT * slow.margin
    assert after.zmp_margin >= KEPT * min(slow.margin, before.zmp_margin)
    assert after.peak.share <= MOST_PEAK
    least = np.inf
    for plan in quick.plan.plans:
        times = np.arange(1e-3, plan.duration, 2e-3)
        if plan.contacts.steps:
            least = min(least, float(evaluate(robot, plan, times).margin.min()))
    assert quick.margin <= least + 1e-3  # also between the times at which plans are sampled


def test_a_search_that_is_stopped_has_the_best_so_far() -> None:
    """Before the first trial that is the gait found for margin, and then one that keeps enough."""
    robot, slow, notes = paper_robot(), designed(), list[str]()
    balanced = GaitPreference("balanced")
    assert quicken(slow, robot, balanced, stop=lambda: True, note=notes.append) is slow
    assert not notes
    some = quicken(slow, robot, balanced, stop=lambda: bool(notes), note=notes.append)
    assert len(notes) == 1 and some is not slow and some.margin >= KEPT * slow.margin
    assert some.certificate is not None and some.certificate.failure is None


def test_a_scenario_says_what_its_gait_is_to_be_good_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """`prefer` of a scenario that asks for a design reaches the choice of times."""
    slow, asked = designed(), []
    monkeypatch.setattr(quicken_module, "design_scenario", lambda *_, **__: slow)

    def quick(found: Designed, robot: object, preference: GaitPreference, **_: object) -> Designed:
        asked.append((found, preference))
        return found

    monkeypatch.setattr(quicken_module, "quicken", quick)
    for line, prefer in (("", "margin"), ("prefer: balanced", "balanced")):
        text = f"robot: {{model: '{URL}'}}\ncourse: [{{kind: floor, length: 4}}]\n{line}"
        assert design_preferred(parse_scenario(text, source="a"), robot=paper_robot()) is slow
        assert asked[-1] == (slow, GaitPreference(prefer))


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ("gait: {stride: 0.3}\nprefer: speed", "design is auto"),
        ("perception: {map: seen}\ndesign: auto\nprefer: speed", "perception.map seen"),
        ("prefer: fast", "margin, balanced"),
    ],
)
def test_a_preference_that_no_design_reads_is_refused(lines: str, why: str) -> None:
    """A gait that is given has its own times, and what is seen gets no quick gait."""
    text = f"robot: {{model: '{URL}'}}\ncourse: [{{kind: floor, length: 4}}]\n{lines}"
    with pytest.raises(InputError, match=f"prefer = .*{why}"):
        parse_scenario(text, source="a")


@pytest.mark.parametrize("planned", [False, True])
def test_a_gait_whose_footprints_are_refused_is_planned_once(
    planned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No times help where feet stand too near each other, unless there was a plan before."""
    slow, tried = designed(), []

    def refuse(*_: object, **__: object) -> None:
        tried.append(1)
        raise PlanningError("the feet FR and RR would be 0.003 m too near", footprints_apart=-3e-3)

    monkeypatch.setattr(tempo_planner, "try_tempo", refuse)
    gait = GaitChoice(slow.scenario, slow.design, planned=planned)
    kept = RequiredMargins(0.5 * slow.margin, 0.0)
    search = TempoSearch(gait, slow, paper_robot(), kept, "check")
    assert search.quickest(None, 0.01) is None
    assert len(tried) > 6 if planned else len(tried) == 1


@pytest.mark.long
def test_much_speed_is_no_less_than_a_balanced_gait_has() -> None:
    """A gait for speed is sought from the balanced one on, and keeps the margin of a safe run."""
    robot, slow = paper_robot(), designed()
    course = course_of(slow.scenario, foot_radius=robot.foot_radius)
    tasks = mission_of(slow.scenario, course)
    found = [quicken(slow, robot, GaitPreference(prefer)) for prefer in ("balanced", "speed")]
    paces = [measure_pace(robot, course, tasks, d.plan) for d in found]
    assert paces[0].slowest is not None and paces[1].slowest is not None
    assert paces[1].slowest.speed >= paces[0].slowest.speed
    assert min(found[1].margin, paces[1].zmp_margin) >= safe_margin(robot)


def test_a_gait_for_speed_has_a_balanced_one_to_begin_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where less margin finds nothing, a balanced gait is the answer, if it keeps enough itself."""
    robot, slow = paper_robot(), designed()
    before = measure_pace(
        robot, (course := course_of(slow.scenario, foot_radius=robot.foot_radius)),
        mission_of(slow.scenario, course), slow.plan,
    )  # fmt: skip
    asked: list[RequiredMargins] = []

    def quickest(
        self: TempoSearch, enough: float | None, than: float, kept: RequiredMargins
    ) -> None:
        asked.append(kept)

    monkeypatch.setattr(TempoSearch, "quickest", quickest)
    assert quicken(slow, robot, GaitPreference("speed")) is slow
    wanted = [
        required_margins(GaitPreference(p), robot, slow.margin, before.zmp_margin)
        for p in ("balanced", "speed")
    ]
    assert asked == wanted and asked[0].margin > asked[1].margin
    # A gait that has hardly more than a safe run's margin: 0.8 of it are not enough.
    asked.clear()
    quicken(replace(slow, margin=1.1 * safe_margin(robot)), robot, GaitPreference("speed"))
    assert [k.margin for k in asked] == [safe_margin(robot)]


@pytest.mark.parametrize(
    ("zmp_margin", "waits", "tried"),
    [(0.005, None, 4), (0.02, None, 1), (0.005, 3.0, 4), (0.005, 1.0, 1), (0.02, 3.0, 1)],
)
def test_longer_swings_are_tried_where_quick_ones_throw_the_body_about(
    zmp_margin: float, waits: float | None, tried: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where there is no gait, or one that mostly waits, and the zero-moment point is short."""
    robot, slow = paper_robot(), designed()
    seen: list[float] = []
    usual = usual_tempo(slow.scenario.gait, robot, 1.25)
    tempo = usual if waits is None else replace(usual, switch=2.0 * waits * usual.swing)
    trial: Any = SimpleNamespace(
        tempo=tempo,
        designed=replace(slow, margin=0.01),
        pace=SimpleNamespace(zmp_margin=zmp_margin),
    )

    def seek(self: TempoSearch, enough: float | None, than: float) -> Any:
        seen.append(self._stretch)
        self._rooms_known[0.0, 0.1] = {self._stretch: Trials(known={0.5: trial})}
        trial.speed = 2.0 * than
        return None if waits is None else trial

    choice = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(choice, slow, robot, RequiredMargins(0.01, 0.01), "test")
    monkeypatch.setattr(TempoSearch, "_quickest_so", seek)
    found = search.quickest(None, 0.05)
    assert (found is None) == (waits is None)
    assert seen == list(STRETCHES[:tried])


def test_swings_that_throw_the_body_far_are_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Longer swings are tried at once: time at the switches does not bring the point back."""
    robot, slow = paper_robot(), designed()
    choice = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(choice, slow, robot, RequiredMargins(0.01, 0.01), "test")
    tried: list[tuple[float, float]] = []

    def trial(stretch: float, switch: float) -> Any:
        tried.append((stretch, switch))
        pace = SimpleNamespace(zmp_margin=-0.02)
        return SimpleNamespace(tempo=None, designed=slow, pace=pace, suits=NO_SPEEDS, walks=None)

    monkeypatch.setattr(search, "trial", trial)
    for module in (tempo_planner, tempo_search):
        monkeypatch.setattr(module, "keeps_all_else", lambda *_: True)
    monkeypatch.setattr(search, "_throws_body", lambda _: True)
    assert search.quickest(None, 0.01) is None
    assert [stretch for stretch, _ in tried] == list(STRETCHES)


def test_no_more_is_tried_than_is_needed() -> None:
    """The usual swings have a gait, and no time at the switches is shorter than nothing."""
    robot, slow = paper_robot(), designed()
    choice = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(choice, slow, robot, RequiredMargins(0.01, 0.01), "test")
    found = search.quickest(None, 0.01)
    assert found is not None and search._stretch == STRETCHES[0]
    assert search.quickest(None, 100.0) is None


def test_no_times_are_quicker_than_the_fastest() -> None:
    """The speed by which gaits are left out is one that no plan exceeds, whatever it is asked."""
    robot, slow = paper_robot(), designed()
    course = course_of(slow.scenario, foot_radius=robot.foot_radius)
    quick = try_tempo(
        slow.scenario,
        slow.design,
        robot,
        replace(usual_tempo(slow.scenario.gait, robot), switch=0.45),
    )
    assert 0.0 < quick.speed <= fastest(slow.scenario, robot, course)


def test_gaits_that_go_farther_in_a_cycle_do() -> None:
    """Gaits to be tried for speed go farther than the one that was found, the farthest first."""
    robot, slow = paper_robot(), designed()
    flights = flights_of(course_of(slow.scenario, foot_radius=robot.foot_radius))
    short = FootholdPattern(1, 1, 2)
    found = list(choose_longer_gaits(robot, link_outline_of(robot), flights, short))
    ways = [d.gait.pattern.treads / d.gait.pattern.per_tread for d in found]
    assert ways and min(ways) > 0.5 and ways == sorted(ways, reverse=True)
    assert all(d.score > 0.0 for d in found)
    # As far, by another pattern, only where that is asked for.
    outline, longest = link_outline_of(robot), found[0].gait.pattern
    as_far = choose_longer_gaits(robot, outline, flights, longest, as_long=True)
    plain = choose_longer_gaits(robot, outline, flights, longest)
    mine = longest.treads / longest.per_tread
    more = [
        d.gait.pattern for d in as_far if d.gait.pattern.treads / d.gait.pattern.per_tread == mine
    ]
    assert more and longest not in more
    assert all(d.gait.pattern.treads / d.gait.pattern.per_tread > mine for d in plain)


def test_gaits_that_are_of_no_interest_are_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each search is made when it is needed, from the gaits that go farthest on."""
    robot, slow = paper_robot(), designed()
    flights = flights_of(course_of(slow.scenario, foot_radius=robot.foot_radius))
    short, outline = FootholdPattern(1, 1, 2), link_outline_of(robot)
    whole = [d.gait.pattern for d in choose_longer_gaits(robot, outline, flights, short)]
    times = [p.treads / p.per_tread / 0.5 for p in whole]
    assert len(set(times)) > 1
    searched: list[float] = []
    least = Search.least

    def spy(self: Search, *given: Any, **more: Any) -> FloatArray:
        searched.append(self._pattern.treads / self._pattern.per_tread / 0.5)
        return least(self, *given, **more)

    monkeypatch.setattr(Search, "least", spy)
    asked = choose_longer_gaits(robot, outline, flights, short, worth=lambda t: t > times[-1])
    first = next(asked).gait.pattern
    assert first == whole[0] and set(searched) == {times[0]}
    rest = [d.gait.pattern for d in asked]
    assert [first, *rest] == [p for p, t in zip(whole, times, strict=True) if t > times[-1]]
    assert times[-1] not in searched


def test_only_wishes_for_less_margin_look_at_gaits_that_go_as_far() -> None:
    """A balanced gait keeps most of the margin: others are looked at where it need not."""
    assert not GaitPreference().less_margin and not GaitPreference("balanced").less_margin
    for preference in (
        GaitPreference("speed"),
        GaitPreference(speed=0.1),
        GaitPreference("balanced", min_margin=0.01),
    ):
        assert preference.less_margin


def test_a_gait_that_goes_farther_is_taken_for_its_speed() -> None:
    """Of two gaits the quicker is taken, and the one that cannot be as quick is not planned."""
    robot, slow = paper_robot(), designed()
    gait = slow.scenario.gait
    half = copy.deepcopy(slow.scenario)
    half.gait.treads, half.gait.places_per_tread = 1, 2
    course = course_of(slow.scenario, foot_radius=robot.foot_radius)
    own = GaitChoice(slow.scenario, slow.design)
    assert gait.treads / gait.places_per_tread > 0.5
    quick = quicken(
        replace(slow, scenario=half), robot, GaitPreference("balanced"), others=lambda _: [own]
    )
    assert quick.scenario.gait.treads == gait.treads
    tasks = mission_of(quick.scenario, course)
    pace = measure_pace(robot, course, tasks, quick.plan)
    assert pace.slowest is not None and pace.slowest.speed > fastest(half, robot, course)


def test_feet_are_made_slower_where_a_joint_would_turn_too_fast(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By how much too fast it would be, at the speed of the foot that a refused plan tells."""
    robot, slow = paper_robot(), designed()
    asked: list[float] = []

    def refuse(*_: object, **__: object) -> TempoTrial:
        tempo = _[3]
        assert isinstance(tempo, Tempo)
        asked.append(tempo.speeds.level)
        assert set(tempo.speeds.values) == {tempo.speeds.level}
        raise PlanningError("too fast", too_fast=2.0, foot_speed=3.0 / len(asked))

    monkeypatch.setattr(tempo_planner, "try_tempo", refuse)
    gait = GaitChoice(slow.scenario, slow.design, planned=True)
    search = TempoSearch(gait, slow, robot, RequiredMargins(0.01, 0.01), "test")
    assert search.trial(1.0, 0.5) is None
    assert asked[1:] == pytest.approx([3.0 / k * PEAK / 2.0 for k in range(1, PLANS)])


def test_tall_swings_last_as_long_as_their_feet_take() -> None:
    """With a speed of the feet no swing of the gait exceeds it, and none is shorter than before.

    What lies between the swings, and so the room for margin, lasts as long as without.
    """
    robot, scenario = paper_robot(), designed().scenario
    course = course_of(scenario, foot_radius=robot.foot_radius)
    walk = next(t for t in mission_of(scenario, course) if t.kind == "walk")
    settings = plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    most = 0.5
    plain, slower = (
        plan_walk_footsteps(robot, course, replace(settings, swing_speed=v), walk, stance)[0]
        for v in (0.0, most)
    )
    assert len(plain.steps) == len(slower.steps)
    pairs = list(zip(plain.steps, slower.steps, strict=True))
    # Transitions' swings last as long as they are told to.
    mine = [(a, b) for a, b in pairs if a.swing.duration != settings.swing_time]
    assert any(b.swing.duration > a.swing.duration for a, b in mine)
    for a, b in mine:
        assert b.swing.duration >= a.swing.duration
        assert peak_speed(b.swing) <= most * (1.0 + 1e-9)
        at = np.linspace(0.0, b.swing.duration, 400)
        speed = np.abs(np.diff(b.swing.positions(at), axis=0)) / (at[1] - at[0])
        assert speed.max() <= most * (1.0 + 1e-6)
    longer = sum(b.swing.duration - a.swing.duration for a, b in pairs)
    assert slower.duration - plain.duration == pytest.approx(longer)


def test_what_is_not_asked_for_is_not_changed() -> None:
    """For margin, or for less speed than there is, the gait is the very same."""
    slow = designed()
    assert quicken(slow, paper_robot(), GaitPreference()) is slow
    assert quicken(slow, paper_robot(), GaitPreference(speed=0.001)) is slow
    answer = Feasibility(slow.scenario, slow, "", {}, paper_robot())
    speed = answer.speed
    assert speed is not None  # what counts as met is not made worse
    assert quicken(slow, paper_robot(), GaitPreference(speed=1.02 * speed)) is slow
    assert found().preference == GaitPreference() and found().slow is found().designed


@pytest.mark.long
def test_a_margin_that_no_gait_has_changes_nothing() -> None:
    """All that there is to try is tried, and the gait is the very same."""
    slow = designed()
    assert quicken(slow, paper_robot(), GaitPreference(min_margin=10.0 * slow.margin)) is slow


def test_wishes_say_which_margin_is_kept() -> None:
    """A share of the gait's for balance, a safe one for speed, or the one that was given."""
    robot = paper_robot()
    assert GaitPreference("balanced").least_margin(robot, 0.1) == pytest.approx(0.8 * 0.1)
    assert GaitPreference("speed").least_margin(robot, 0.1) == pytest.approx(safe_margin(robot))
    assert GaitPreference("speed").least_margin(robot, 0.01) == 0.01
    assert GaitPreference("speed", min_margin=0.05).least_margin(robot, 0.1) == 0.05


@pytest.mark.parametrize(
    ("preference", "named"),
    [
        (GaitPreference("fast"), "--prefer: prefer = 'fast'"),
        (GaitPreference(speed=0.0), "--speed: speed = 0.0"),
        (GaitPreference(speed=float("nan")), "--speed: speed = nan"),
        (replace(GaitPreference(), min_margin=-0.1), "--min-margin: min_margin = -0.1"),
    ],
)
def test_a_preference_that_cannot_be_used_is_an_error_that_names_it(
    preference: GaitPreference, named: str
) -> None:
    """One line with option, value and what would be right."""
    with pytest.raises(InputError) as error:
        preference.check()
    assert named in str(error.value) and "give" in str(error.value)


def test_a_wish_that_is_not_met_is_said_so() -> None:
    """The answer's first words say what of it is not met, and its end has the speed."""
    question = {"rise": 0.12, "run": RUN, "count": COUNT}

    def answer(preference: GaitPreference) -> str:
        check = replace(found(), preference=preference)
        told = feasibility_report(check, paper_robot(), source=URL, asked=question)
        return str(told["answer"])

    speed = found().speed
    assert speed is not None
    assert answer(GaitPreference(speed=9.0)).startswith("Yes, but not at 9 m/s: ")
    assert answer(GaitPreference(speed=9.0)).endswith(f"at {speed:.3f} m/s")
    assert answer(GaitPreference(min_margin=1.0)).startswith("Yes, but not with a margin of 1 m: ")
    both = GaitPreference(speed=9.0, min_margin=1.0)
    assert answer(both).startswith("Yes, but not at 9 m/s or with a margin of 1 m: ")
    slow = answer(GaitPreference(speed=0.9 * speed))
    assert slow.startswith("Yes: ") and slow.endswith(f"at {speed:.3f} m/s")
    assert "m/s" not in answer(GaitPreference())


def test_a_path_that_seeks_less_is_tried_if_it_begins_with_more_margin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of each amount of margin that paths may seek: first one plan, then a search if it is better.

    A gait without any plan at the usual times is tried with longer ones.
    """
    search = object.__new__(TempoSearch)
    trial = SimpleNamespace(tempo=Tempo(0.5, 0.1, 0.85), speed=0.1)
    spares = {0.5: [], 0.85: [-0.02, -0.03, -0.01]}
    sought: list[tuple[float, float]] = []
    begun: list[float] = []

    def rooms(switch: float) -> object:
        for spare in spares[round(switch, 3)]:
            begun.append(spare)
            yield spare

    def quickest_here(_enough: object, _faster: object, first: float) -> object:
        sought.append((round(first, 3), begun[-1]))
        return trial if begun[-1] == -0.01 else None

    planner: Any = SimpleNamespace(usual=lambda _: Tempo(0.5, 0.1, 0.5), spare=lambda trial: trial)
    search._planner, search._parts = planner, True
    monkeypatch.setattr(search, "_longest_switch", lambda *_: 1.5, raising=False)
    monkeypatch.setattr(search, "_rooms", rooms, raising=False)
    monkeypatch.setattr(search, "_far_off", lambda _: False, raising=False)
    monkeypatch.setattr(search, "_quickest_here", quickest_here, raising=False)
    assert search.quickest(None, 0.05) is trial  # type: ignore[comparison-overlap]
    assert begun == [-0.02, -0.03, -0.01] and sought == [(0.85, -0.02), (0.85, -0.01)]
