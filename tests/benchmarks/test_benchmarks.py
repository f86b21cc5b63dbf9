"""The benchmarks run, and what they compare is comparable; how fast is not asked here."""

import importlib
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SHORT = "mission=[{kind: stand, duration: 0.3}]"


def test_margin_is_shapelys(load: Any) -> None:
    """On 3000 random stances our margins are shapely's to rounding, inside and outside."""
    margin = load("margin")
    points, feet, standing = margin.random_samples(3000, seed=7)
    ours = margin.stability_margins(points, feet, standing)
    assert np.min(ours) < -0.05 and np.max(ours) > 0.05
    np.testing.assert_allclose(ours, margin.shapely_margins(points, feet, standing), atol=1e-12)
    result = margin.measure(count=200, singles=20, repeats=1)
    assert result["largest_difference"] < 1e-12
    assert all(seconds > 0.0 for key in ("one", "many") for seconds in result[key].values())


def test_bindings_are_timed(load: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every call is timed; more idle systems take no less time."""
    bindings = load("bindings")
    monkeypatch.setattr(bindings, "STEPS", 300)
    times = bindings.measure()
    assert len(times) == 4 and all(t > 0.0 for t in times.values())


def test_planning_is_split_without_remainder(load: Any) -> None:
    """The parts of the planning time are not negative, and make up the whole."""
    planning = load("planning")
    planner = planning.Planner("spin_both_ways")
    plan, parts = planning.split_time(planner)
    assert min(parts.values()) >= 0.0
    assert sum(parts.values()) == pytest.approx(plan.planning_time, rel=1e-9)
    assert parts["body: the QPs' solver"] > 0.0 and parts["transitions"] > 0.0


def test_measuring_leaves_planning_as_it_was(load: Any) -> None:
    """After a measurement the plan is the same, and no stopwatch or recorder is left behind."""
    planning, piqp = load("planning"), importlib.import_module("piqp")
    planner = planning.Planner("spin_both_ways")
    before, solver, function = planner.plan(), piqp.SparseSolver, planning.plan_task.plan_body
    result = planning.measure(planner, repeats=1)
    after = planner.plan()
    assert piqp.SparseSolver is solver and planning.plan_task.plan_body is function
    assert result["planned_duration"] == before.duration == after.duration
    for a, b in zip(before.plans, after.plans, strict=True):
        np.testing.assert_array_equal(a.end.body, b.end.body)


def test_clarabel_agrees_with_our_solver(load: Any) -> None:
    """On the programs that planning sets up, another solver finds the same optimum."""
    planning, quadratic = load("planning"), load("quadratic")
    programs = planning.programs(planning.Planner("spin_both_ways"))
    assert programs
    for p in programs:
        x, program = quadratic.variables(p)
        result = quadratic.ClarabelSolver().Solve(program)
        assert result.is_success()
        found = result.GetSolution(x)
        assert p.violation(p.x) < 1e-4 and p.violation(found) < 1e-4
        assert p.cost(p.x) == pytest.approx(p.cost(found), rel=1e-4)


def test_a_program_notices_what_breaks_it(load: Any) -> None:
    """`violation` sees a broken equality, inequality and bound, each by its amount."""
    quadratic = load("quadratic")
    sparse, row = quadratic.sparse, np.array([[1.0, 0.0]])
    program = quadratic.QuadraticProgram(
        P=sparse.eye(2, format="csc"),
        c=np.zeros(2),
        A=sparse.csc_matrix(row),
        b=np.array([1.0]),
        G=sparse.csc_matrix(row[:, ::-1]),
        h_lower=np.array([0.0]),
        x_lower=np.full(2, -np.inf),
        x_upper=np.array([np.inf, 3.0]),
        x=np.zeros(2),
        seconds=0.0,
    )
    for x, broken in (((1, 0), 0.0), ((1.5, 0), 0.5), ((1, -0.25), 0.25), ((1, 5), 2.0)):
        assert program.violation(np.array(x, dtype=float)) == pytest.approx(broken)


def test_the_bare_plant_follows_to_the_bit(load: Any) -> None:
    """Fed with the commands recorded, the plant alone steps the same states as the whole."""
    climbs, real_time = load("stair_climbs"), load("real_time")
    prepared = real_time.prepare(real_time.load_scenario("flat_walk"))
    commands, _ = climbs.record(prepared, duration=1.5)  # the first step begins at 1.3 s
    assert commands.duration == pytest.approx(1.5)
    pair = climbs.make_pair(prepared, commands)
    start = pair.state_difference()
    turns = real_time.take_turns(pair, duration=1.5, turn=0.25)
    assert start == 0.0 and turns.difference == 0.0
    assert turns.wall.shape == (6, 2) and np.all(turns.wall > 0.0)
    moved = climbs.make_pair(prepared, commands)
    moved.whole.AdvanceTo(1.5)
    assert moved.state_difference() > 1e-3  # the comparison would notice


@pytest.mark.long
def test_real_time_reports_every_system(load: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """As JSON: both factors, their ratio, and as many ticks of each system as its rate asks for."""
    load("real_time").main(
        ["--scenarios", "flat_walk", "flat_walk:everything", "--durations", "0.5", "0.5",
         "--repeats", "1", "--set", "controller.period=0.002", "--json"]
    )  # fmt: skip
    plain, everything = json.loads(capsys.readouterr().out)["scenarios"]
    for result, systems in ((plain, 5), (everything, 8)):
        for key in ("wall", "cpu", "total"):
            assert set(result[key]) == {"whole", "bare", "ratio"}
        assert result["state_difference"] == 0.0
        ticks = {name: w["ticks"] for name, w in result["ticks"]["systems"].items()}
        assert len(ticks) == systems
        assert ticks.pop("TransitionPlanner") in (10, 11)
        assert 124 <= ticks.pop("ContactMonitor") <= 127  # it stands for sensors of 250 Hz
        assert all(249 <= n <= 252 for n in ticks.values())


def test_solvers_agree_on_the_programs_of_a_walk(
    load: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every tick's program is kept, and others find DAQP's forces to within their tolerance."""
    qp = load("whole_body_qp")
    soon = "mission=[{kind: stand, duration: 0.1}, {kind: walk, distance: 2.0}]"
    qp.main(["--scenario", "flat_walk", "--set", soon, "--begin", "1.4", "--end", "1.8", "--json"])
    result = json.loads(capsys.readouterr().out)
    assert 199 <= result["ticks"] <= 201
    assert sum(result["feet"].values()) == result["ticks"]
    assert result["feet"]["3"] > 50  # a foot is in the air
    assert result["left_out"] < 0.1 * result["ticks"]
    for solver in result["solvers"].values():
        assert solver["solved"] == solver["programs"] == result["ticks"] - result["left_out"]
        assert solver["difference"] < 5.0 and 0.0 < solver["median"] <= solver["p99"]
    assert result["solvers"]["daqp"]["difference"] == 0.0


def test_contact_solver_table(
    load: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page has a row a run, in order, with the run's figures; a person's remarks stay."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    solvers, out = load("contact_solvers"), tmp_path / "page.md"
    remarks = solvers.REMARKS + "\nA person's own words.\n"
    out.write_text("| an old row |\n" + remarks)
    solvers.main(["--scenario", "flat_walk", "--cenic-scenario", "flat_walk", "--set", SHORT,
                  "--approximations", "sap", "--time-steps", "0.002", "--accuracies", "1e-3",
                  "--out", str(out), "--json"])  # fmt: skip
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert [run["case"]["solver"] for run in runs] == ["sap", "lagged", "cenic", solvers.RAW]
    assert all(run["summary"]["outcome"] == "goal_reached" for run in runs)
    assert out.read_text().endswith(remarks) and "an old row" not in out.read_text()
    rows = [line for line in out.read_text().splitlines() if "goal_reached" in line]
    for run, line in zip(runs, rows, strict=True):
        assert f"| {run['summary']['margin']['minimum']:.4f} |" in line


@pytest.mark.parametrize("step", [0.0005, 0.001, 0.002, 0.0025, 0.003])
def test_periods_are_whole_steps(load: Any, step: float) -> None:
    """The controller's period is whole steps, at most 5 ms, and as near it as can be."""
    period = load("contact_solvers").Case("flat_walk", "sap", step).period
    assert period / step == pytest.approx(round(period / step), abs=1e-9)
    assert period <= 0.005 + 1e-12 and period + step > 0.005


def test_a_run_that_cannot_be_is_a_row(load: Any) -> None:
    """A case that the scenario's checks refuse gives a row that says why, and no exception."""
    solvers = load("contact_solvers")
    case = solvers.Case("flat_walk", "tamsi", 0.001)
    summary = solvers.measure(case)
    assert summary["outcome"] == "error"
    assert "tamsi" in " ".join(solvers.row(case, summary))


def test_drake_moves_a_joint_as_documented_but_for_cenic(load: Any) -> None:
    """Told a velocity, a joint rests at +d v_d / p; where CENIC has it at minus that, we know."""
    cenic = load("cenic")
    rest = cenic.D / cenic.P
    assert cenic.resting_place("runge_kutta3", time_step=0.001) == pytest.approx(rest, rel=1e-3)
    assert cenic.resting_place("implicit_euler") == pytest.approx(rest, rel=1e-3)
    assert cenic.resting_place("cenic") == pytest.approx(cenic.velocity_sign() * rest, rel=1e-3)


@pytest.mark.long
def test_corrected_cenic_tracks_as_the_discrete_solver(load: Any) -> None:
    """Against lagged, the joints are off by -2 d v_d / p where CENIC has the fault, else not."""
    solvers, climbs, cenic = load("contact_solvers"), load("stair_climbs"), load("cenic")
    simulation, scenario = load("real_time"), "flat_walk"

    def joints(solver: str, setting: float) -> tuple[Any, Any, float]:
        overrides = solvers.Case(scenario, solver, setting).all_overrides
        prepared = simulation.prepare(simulation.load_scenario(scenario, overrides))
        climb, simulator = climbs.make_whole(prepared)
        q, v = [], []
        for t in np.arange(2.3, 3.5, 0.1):  # the first swing after the stand
            simulator.AdvanceTo(t)
            context = climb.plant.GetMyContextFromRoot(simulator.get_context())
            state = climb.plant.GetPositionsAndVelocities(context)
            q.append(state[climb.layout.q_joints])
            v.append(state[climb.layout.v_joints])
        gains = prepared.scenario.controller
        return np.array(q), np.array(v), gains.kd / gains.kp

    discrete, speed, ratio = joints("lagged", 0.001)
    raw, _, _ = joints("cenic", 1e-3)
    with cenic.corrected():
        right, _, _ = joints("cenic", 1e-3)
    moving = np.max(np.abs(speed), axis=0) > 0.1  # the speeds as they are stand for v_d
    lag = (-2.0 * ratio * speed[:, moving]).ravel()

    def share(q: Any) -> float:
        return float(np.polyfit(lag, (q - discrete)[:, moving].ravel(), 1)[0])

    assert np.max(np.abs(lag)) > 0.01  # a leg did swing
    assert share(raw) == pytest.approx(1.0 if cenic.velocity_sign() < 0.0 else 0.0, abs=0.25)
    assert share(right) == pytest.approx(0.0, abs=0.1)
    assert np.max(np.abs(right - discrete)) < 2e-3


@pytest.mark.long
def test_benchmark_of_checks_gives_the_checks_answers(
    load: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One row a staircase, with its answer and times that are not nothing."""
    check = load("check")
    monkeypatch.setattr(
        check, "check_flight", partial(check.check_flight, nearest=False)
    )  # is slow
    rows = check.measure_checks(
        check.ROBOT, [check.Stairs(0.1, 0.3, 1), check.Stairs(0.2, 0.12, 2)], repeats=1
    )
    assert [row["feasible"] for row in rows] == [True, False]
    assert all(row["wall"] > 0.0 and row["processor"] > 0.0 for row in rows)


@pytest.mark.long
def test_benchmark_of_robots_times_the_command(load: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A yes and a no in processes of their own; robots that are not installed have no row."""
    check = load("check")
    monkeypatch.setitem(check.STEEPEST, "paper_quadruped", (0.1, 0.3))
    monkeypatch.setattr(check, "TEN", 1)
    row = check.measure_robot("paper_quadruped")
    assert row["yes"]["feasible"] and not row["no"]["feasible"]
    for kind in ("yes", "no", "warm"):
        assert row[kind]["wall"] > 0.0 and row[kind]["processor"] > 0.0
    assert "| paper_quadruped | 0.1 × 0.3 m | yes |" in check.robots_table([row])
    assert check.measure_robot("not_a_robot") is None
