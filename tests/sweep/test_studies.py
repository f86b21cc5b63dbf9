"""The robustness studies count what they say, lose nothing, and push as a scenario pushes."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import Segment
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.sweep.study import Base
from drake_quad.sweep.trials import work

ROOT = Path(__file__).resolve().parents[2]
CONTROL = ("controller.kind=whole_body", "controller.period=0.002")
WALK = "mission=[{kind: stand, duration: 1.0}, {kind: walk, distance: 2.0}]"
STAND = "mission=[{kind: stand, duration: 0.4}]"
LONGER = "mission=[{kind: stand, duration: 4.0}]"


def push(when: float, speed: float, direction: float, **more: Any) -> dict[str, Any]:
    return {"time": when, "duration": 0.1, "speed": speed,
            "direction_deg": direction, "to_goal": False, **more}  # fmt: skip


def test_a_section_leaves_the_rest_of_the_page(load: Any, tmp_path: Path) -> None:
    """A section written twice is there once, in its place; all else stays as it was."""
    study, page = load("page"), tmp_path / "page.md"
    study.write_section(page, "disturbances", "before")
    study.write_section(page, "pushes", r"first \1")
    page.write_text(page.read_text() + "A person's words.\n")
    earlier = page.read_text()
    study.write_section(page, "disturbances", "after")
    assert page.read_text() == earlier.replace("\nbefore\n", "\nafter\n")
    marks = (r"first \1", "\nbefore\n", "A person's words.")
    assert sorted(marks, key=earlier.index) == list(marks)


def test_moments_are_in_every_segment(load: Any) -> None:
    """As many as asked for, rising, whole steps, and in time with no stretch of the run."""
    push_moments = load("push_moments")
    plan = prepare(load_scenario("case_study")).plan
    times = push_moments.moments(plan, 40, time_step=0.001)
    assert len(times) == 40 and times == sorted(times)
    assert times[0] >= 1.0 and times[-1] <= plan.duration - 2.0 + 1e-9
    assert all(abs(t / 0.001 - round(t / 0.001)) < 1e-6 for t in times)
    stretches = push_moments._stretches(plan)
    for start, end in stretches:
        assert any(start <= t <= end for t in times)
    start, end = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    inside = [t for t in times if start < t < end]
    assert np.max(np.diff(inside)) < 2.0 * (end - start) / len(inside)


@pytest.mark.parametrize("cells", [0.25, 0.5, 1.0, 2.0])
def test_moments_are_in_step_with_no_gait(load: Any, cells: float) -> None:
    """Even where a cell is the gait's cycle, or a simple part of it, no eighth of it is missed."""
    plan = prepare(load_scenario("flat_walk")).plan
    count, (start, end) = 48, (1.0, plan.duration - 2.0)
    push_moments = load("push_moments")
    whole = SimpleNamespace(
        duration=plan.duration,
        plans=[SimpleNamespace(duration=plan.duration, segments=[Segment("", "", 0.0, 1e9)])],
    )
    times = np.array(push_moments.moments(whole, count, time_step=0.001))
    cycle = (end - start) / count / cells
    phases = np.sort((times - start) / cycle % 1.0)
    assert np.max(np.diff(phases, append=phases[0] + 1.0)) < 0.125


def test_some_of_every_direction_go_on_to_the_goal(load: Any) -> None:
    """One in eight does, and no direction is left out."""
    trials = load("push_moments").make_pushes(
        [float(k) for k in range(40)], speeds=[0.3], directions=8, to_goal=8
    )
    far = [one for one in trials if one["to_goal"]]
    assert len(trials) == 320 and len(far) == pytest.approx(40, abs=1)
    assert {one["direction_deg"] for one in far} == {45.0 * k for k in range(8)}


@pytest.mark.long
def test_a_trial_is_a_run_with_that_push(load: Any) -> None:
    """To the bit, also after other trials from the same moment; without a push it is the run."""
    overrides = (*CONTROL, WALK)
    bench = load("push_trials").PushBench(Base("flat_walk"), overrides)
    for when, speed, direction in ((2.3, 0.5, 135.0), (2.3, 0.3, 45.0), (2.801, 0.0, 0.0)):
        result = bench.try_push(push(when, speed, direction), tail=0.7)
        assert result["outcome"] in ("ok", "stopped"), result
        text = f"{{time: {when}, speed: {speed}, direction_deg: {direction}}}"
        with_push = [*overrides, *([f"disturbances.pushes=[{text}]"] if speed else [])]
        climb = stair_climb_of(prepare(load_scenario("flat_walk", with_push)))
        simulator = Simulator(climb.diagram)
        simulator.AdvanceTo(when + result["simulated"])
        context = climb.plant.GetMyContextFromRoot(simulator.get_context())
        np.testing.assert_array_equal(climb.plant.GetPositionsAndVelocities(context), bench.state())


def test_what_comes_of_a_push(load: Any) -> None:
    """A kick that no robot survives fells it; the next trial knows nothing of that; no way back."""
    bench = load("push_trials").PushBench(Base("flat_walk"), (*CONTROL, WALK))
    fell = bench.try_push(push(2.0, 5.0, 90.0), tail=1.0)
    assert fell["outcome"] == "fell" and 0.0 < fell["simulated"] < 2.0
    calm = bench.try_push(push(2.0, 0.0, 0.0), tail=0.5)
    assert calm["outcome"] == "ok" and calm["base_error_max"] < 0.01
    assert calm["simulated"] == pytest.approx(0.5, abs=0.06)
    assert calm["segment"] == "transition to the wave gait" and calm["ground"] == "level"
    with pytest.raises(ValueError, match="before"):
        bench.try_push(push(1.5, 0.3, 0.0), tail=0.5)


def test_a_kick_in_a_trot_is_told_with_both_legs(load: Any) -> None:
    """Of two legs in the air both are named, in the first swing of a pair."""
    short = ("monitor.margins=hull", "course=[{kind: floor, length: 5.0}]",
             "transition.shift_time=0.8", "transition.swing_time=0.6",
             "mission=[{kind: stand, duration: 0.1}, {kind: walk, distance: 1.0}]")  # fmt: skip
    plans = prepare(load_scenario("trot", short)).plan.plans
    first = next(phase for phase in plans[1].contacts.phases if len(phase.steps) == 2)
    when = round(plans[0].duration + 0.5 * (first.start + first.end), 3)
    bench = load("push_trials").PushBench(Base("trot"), short)
    told = bench.try_push(push(when, 0.0, 0.0), tail=0.05)
    assert told["outcome"] == "ok" and told["leg"] in ("FL and RR", "FR and RL")


def test_a_run_that_ends_before_its_push_says_so(load: Any) -> None:
    """It is a trial that was stopped, with the undisturbed run's own end."""
    bench = load("push_trials").PushBench(Base("flat_walk"), (*CONTROL, STAND))
    far = bench.try_push(push(0.1, 0.0, 0.0, to_goal=True), tail=0.1)
    assert far["outcome"] == "goal_reached"
    late = bench.try_push(push(3.0, 0.3, 0.0), tail=0.5)
    assert late["outcome"] == "stopped" and "goal_reached" in late["reason"]


def test_where_no_way_back_is_found_the_robot_has_stopped(load: Any) -> None:
    """As in a run: that is a finding about the push, and no error of the study."""
    bench = load("push_trials").PushBench(Base("flat_walk"), (*CONTROL, STAND))

    class Lost:
        """A simulator whose planner finds no way back."""

        def __init__(self, simulator: Simulator) -> None:
            self._simulator = simulator

        def __getattr__(self, name: str) -> Any:
            return getattr(self._simulator, name)

        def AdvanceTo(self, time: float) -> None:
            raise PlanningError(f"no way back at {time:g} s")

    bench._branch = Lost(bench._branch)
    found = bench.try_push(push(0.1, 0.1, 0.0), tail=0.1)
    assert found["outcome"] == "stopped" and "no way back" in found["reason"]


def test_scenarios_with_pushes_of_their_own_are_refused(load: Any) -> None:
    """One line that says what to do; nothing is simulated."""
    own = "disturbances.pushes=[{time: 1.0, speed: 0.1}]"
    with pytest.raises(SystemExit, match=r"disturbances\.pushes"):
        load("pushes").main(["--scenario", "flat_walk", "--set", own])


@pytest.mark.long
def test_the_push_study(load: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Table, curve, figures and lines agree; what is done is not done again."""
    lines, out, figures = tmp_path / "p.jsonl", tmp_path / "page.md", tmp_path / "p.json"
    words = ["--scenario", "flat_walk", "--set", LONGER, "--speed", "0.1", "6.0", "--moments", "2",
             "--directions", "2", "--workers", "1", "--tail", "0.3", "--to-goal", "1000000",
             "--lines", str(lines), "--out", str(out), "--json", str(figures)]  # fmt: skip
    pushes = load("pushes")
    pushes.main(words)
    rates = json.loads(figures.read_text())["rates"]
    trials = [json.loads(line) for line in lines.read_text().splitlines()[1:]]
    for rate in rates:
        outcomes = [one["outcome"] for one in trials if one["speed"] == rate["speed"]]
        assert len(outcomes) == rate["trials"] == 4
        assert sum(o in ("ok", "goal_reached") for o in outcomes) == rate["ok"]
    assert rates[0]["ok"] == rates[0]["trials"] and rates[1]["ok"] == 0
    page, curve = out.read_text(), (tmp_path / "figures" / "push_curve.svg").read_bytes()
    n = rates[1]["trials"]
    assert f"| 6 | {n} | 0 | {n} | 0 | 0.0 % (0.0 to {100 * rates[1]['high']:.1f} %) |" in page
    assert "drake-quad run flat_walk --set" in page and "speed: 6.0" in page
    lines.write_text("\n".join(lines.read_text().splitlines()[:-1]) + "\n")
    capsys.readouterr()
    pushes.main([*words, "--resume"])
    told = [line for line in capsys.readouterr().err.splitlines() if "trials, " in line]
    assert len(told) == 1 and told[0].startswith("8 of 8 trials")
    again = [json.loads(line) for line in lines.read_text().splitlines()[1:]]
    # A clock says how a trial fared on the machine, which the one that is done again may not share.
    for one in [*again, *trials]:
        assert one.pop("clock")["held"] > 0.0
    assert sorted(map(json.dumps, again)) == sorted(map(json.dumps, trials))
    assert (tmp_path / "figures" / "push_curve.svg").read_bytes() == curve


def test_the_blind_stairs_study(load: Any, tmp_path: Path) -> None:
    """A run a seed; the rate and its bounds are those of the runs; failures can be repeated."""
    stairs = load("blind_stairs")
    out, figures = tmp_path / "page.md", tmp_path / "b.json"
    words = ["--scenario", "flat_walk", "--set", STAND, "--seeds", "2", "--first", "5",
             "--workers", "2", "--recycle", "1", "--lines", str(tmp_path / "b.jsonl"),
             "--out", str(out), "--json", str(figures)]  # fmt: skip
    stairs.main(words)
    result = json.loads(figures.read_text())
    assert [run["seed"] for run in result["runs"]] == [5, 6]
    assert all(run["outcome"] == "goal_reached" for run in result["runs"])
    assert result["rate"]["low"] == pytest.approx(0.025**0.5) and result["rate"]["high"] == 1.0
    assert "| 2 | 2 | 0 | 0 | 0 | 100.0 % (15.8 to 100.0 %) |" in out.read_text()
    command = stairs.repeat("blind_errors", (), {"seed": 7})
    assert command == "drake-quad run blind_errors --seed 7"


def test_a_world_that_cannot_be_counts_against_the_rate(load: Any) -> None:
    """A run that is refused is an outcome with its reason, and no exception."""
    study = load("study")
    made, base = study.study_of("descend", ())
    more = ["world={rise_error: -0.5}"]
    result = work(study.make_trial(made, base, 0, [0], more=more, figures=["slip_max"]))
    assert result["outcome"] == "refused" and "rise_error" in result["reason"]
    assert not result["success"] and result["outcome"] not in study.GOOD


def test_what_took_too_long_is_among_the_stopped(load: Any) -> None:
    """Of the tables' columns; no trial is left out of them."""
    pushes, stairs = load("pushes"), load("blind_stairs")
    late = {"outcome": "timeout", "reason": "not done after 9 s of wall time", "time": 1.0}
    late |= {"duration": 0.1, "speed": 0.3, "direction_deg": 0.0, "to_goal": False, "seed": 3}
    late |= dict.fromkeys([*load("push_trials").FIGURES, "nonfoot_contact_samples"])
    options = pushes.parse([])
    options.overrides = ()
    written = pushes.section(options, [late])
    assert "| 0.3 | 1 | 0 | 0 | 1 | 0.0 %" in written and "timeout: not done after 9 s" in written
    options = stairs.parse([])
    options.overrides = ()
    written = stairs.section(options, load_scenario("blind_errors"), [late])
    assert "| 1 | 0 | 0 | 1 | 0 | 0.0 %" in written and "timeout: not done after 9 s" in written


def test_the_study_of_disturbances(load: Any, tmp_path: Path) -> None:
    """A row a run, in the table's order, with the run's figures, for both controllers."""
    disturbed = load("disturbed")
    out, figures = tmp_path / "page.md", tmp_path / "d.json"
    disturbed.main(["--scenario", "flat_walk", "--set", STAND, "--only", "rear left", "--workers",
                    "1", "--lines", str(tmp_path / "d.jsonl"), "--out", str(out),
                    "--json", str(figures)])  # fmt: skip
    runs = json.loads(figures.read_text())["runs"]
    assert [run["controller"] for run in runs] == ["whole_body", "ik"]
    rows = [line for line in out.read_text().splitlines() if line.startswith("| payload")]
    for run, line in zip(runs, rows, strict=True):
        assert run["outcome"] == "goal_reached"
        assert f"| {run['controller']} | goal_reached | {run['margin']:.3f} |" in line
    assert runs[0]["base_error_max"] != runs[1]["base_error_max"]


@pytest.mark.parametrize("quick", [False, True])
def test_all_disturbances_can_be_asked_for(load: Any, quick: bool) -> None:
    """Every row's scenario is one that loads, and no two are alike; the short course is planned."""
    disturbed = load("disturbed")
    overrides = (*CONTROL, *(disturbed.QUICK if quick else ()))
    trials = disturbed.make_trials(*load("study").study_of("case_study", overrides))
    names = [trial.values for trial in trials]
    assert len(set(names)) == len(names) and sum(" at 60 %" in name for name, _ in names) == 12
    scenarios = [load_scenario("case_study", trial.overrides) for trial in trials]
    assert all(a != b for k, a in enumerate(scenarios) for b in scenarios[:k])
    if quick:
        assert prepare(scenarios[0]).plan.duration < 60.0


def test_common_settings_are_given_only_where_they_differ(load: Any) -> None:
    """They come before the user's own, and not at all where the scenario has them of itself."""
    study = load("study")
    assert study.with_common("flat_walk", ("a=1",)) == (*study.COMMON, "a=1")
    assert study.with_common("case_study", ("a=1",)) == ("a=1",)
