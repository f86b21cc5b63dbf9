"""A run: the same to the bit, whole when cut short, and honest about why it ended."""

import errno
import itertools
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from drake_quad.errors import InputError, PlanningError
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs import result as run_files
from drake_quad.runs.result import RunResult, write_files
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import count_finite, simulate

AT_ONCE = [
    "mission=[{kind: stand, duration: 0.1}, {kind: walk, distance: 2.0}]",
    "transition.shift_time=0.7",
    "transition.swing_time=0.6",
]
SECONDS = 1.75  # [s] of the level walk in which a foot is lifted, and set down


def short(overrides: list[str], seconds: float = SECONDS) -> RunResult:
    """The first seconds of the level walk."""
    chunks = itertools.count()
    return simulate(
        load_scenario("flat_walk", [*AT_ONCE, *overrides]),
        stop=lambda: next(chunks) >= 4 * seconds - 1,
    )


@pytest.fixture(scope="module")
def first() -> RunResult:
    return short([])


@pytest.fixture(scope="module")
def on_ice() -> RunResult:
    return short(["simulation.friction=0.02"])


def test_the_saved_scenario_gives_the_same_run_to_the_bit(first: RunResult, tmp_path: Path) -> None:
    """scenario.yaml, as a run leaves it, runs to an equal log, every column, every bit."""
    assert np.any(first.table["swing_leg"].to_numpy())
    write_files(first, load_scenario("flat_walk", AT_ONCE), tmp_path)
    chunks = itertools.count()
    again = simulate(
        load_scenario(tmp_path / "scenario.yaml"), stop=lambda: next(chunks) >= 4 * SECONDS - 1
    )
    assert again.table.equals(first.table)
    assert pq.read_table(tmp_path / "log.parquet").equals(first.table)
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"] == "stopped"


def test_another_friction_gives_another_run(first: RunResult, on_ice: RunResult) -> None:
    """The comparison of logs can tell runs apart."""
    assert not on_ice.table.equals(first.table)


def test_a_robot_without_strength_falls_or_stops() -> None:
    """With knees that give next to nothing the run ends early, says why, and keeps its log."""
    weak = ", ".join(f"{{joint: {leg}_knee, factor: 0.05}}" for leg in SHORT_NAMES)
    result = short([f"disturbances.motor_strength=[{weak}]"], seconds=20.0)
    assert result.outcome in ("fell", "stopped") and result.reason != "interrupted"
    assert result.table.num_rows > 10
    assert result.summary["outcome"] == result.outcome


def test_on_ice_the_feet_slip(first: RunResult, on_ice: RunResult) -> None:
    """Slip is measured: on ice the feet slide, on the floor they do not."""
    assert on_ice.summary["slip_max"] > 0.005 and first.summary["slip_max"] < 0.001


def test_stairs_out_of_reach_name_the_rise() -> None:
    """A rise that the legs cannot reach is an input error that names field and value."""
    with pytest.raises(InputError) as caught:
        prepare(load_scenario("case_study", ["course[1].rise=0.6"]), source="mine.yaml")
    assert (caught.value.field, caught.value.value) == ("course[1].rise", 0.6)
    assert "mine.yaml" in str(caught.value) and "short" in str(caught.value)


def test_a_plan_without_margin_is_refused() -> None:
    """At β = 3/4 the margin cannot stay positive with the legs' mass: no plan, and why."""
    with pytest.raises(PlanningError, match="margin"):
        prepare(load_scenario("flat_walk", ["gait.duty_factor=0.75"]))


def test_a_place_that_cannot_be_written_is_an_input_error(first: RunResult, tmp_path: Path) -> None:
    """A file where the directory should be: one error that names --out."""
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        write_files(first, load_scenario("flat_walk"), tmp_path / "file" / "run")


def test_runs_do_not_mix_in_a_directory(
    first: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk leaves the older run whole; a kill on the way leaves none that reads as one."""
    old = {name: f"old {name}" for name in ("scenario.yaml", "log.parquet", "summary.json",
                                            "report.html", "scene.lcmlog")}  # fmt: skip
    for name, text in old.items():
        (tmp_path / name).write_text(text)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(run_files, "write_log", full)
        with pytest.raises(InputError, match=r"log\.parquet.*No space left"):
            write_files(first, first.scenario, tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == old

    class Killed(BaseException): ...

    def killed(path: Path, to: Path) -> None:
        if to.name == "log.parquet":
            raise Killed
        path.rename(to)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", killed)
        with pytest.raises(Killed):
            write_files(first, first.scenario, tmp_path)
    assert not (tmp_path / "summary.json").exists() and not (tmp_path / "report.html").exists()
    write_files(first, first.scenario, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {*old} - {"report.html", "scene.lcmlog"}


def test_log_has_a_row_each_period_and_the_clock_runs_evenly_in_it() -> None:
    """Samples and ticks coincide: no row shows a tick twice, and none is left out."""
    result = short(["simulation.log_period=0.01"], seconds=1.0)
    t, gait_time = (result.table[name].to_numpy() for name in ("t", "gait_time"))
    np.testing.assert_allclose(np.diff(t), 0.01, atol=1e-9)
    task = result.table["task"].to_numpy()
    np.testing.assert_allclose(np.diff(gait_time)[np.diff(task) == 0], 0.01, atol=1e-9)
    assert t[0] < 0.03 and t[-1] == pytest.approx(1.0)


def test_stop_leaves_what_was_logged_until_then(tmp_path: Path) -> None:
    """Asked to stop at the first look, the run has the log of its first quarter of a second."""
    scenario = load_scenario("flat_walk")
    result = simulate(scenario, stop=lambda: True)
    assert (result.outcome, result.reason) == ("stopped", "interrupted")
    assert result.table.num_rows == round((0.25 - 0.015) / 0.005) + 1
    assert result.summary["simulated_time"] == pytest.approx(0.25)
    write_files(result, scenario, tmp_path / "run")
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"summary.json", "log.parquet", "scenario.yaml"}


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (KeyboardInterrupt(), "interrupted"),
        (PlanningError("no way on"), "no way on"),
        (RuntimeError("the solver gave up\nmore of it"), "simulation failed: the solver gave up"),
        (ZeroDivisionError("a fault"), "simulation failed: ZeroDivisionError: a fault"),
    ],
)
def test_an_error_on_the_way_ends_the_run_with_its_reason_and_log(
    error: BaseException, reason: str
) -> None:
    """Whatever interrupts a run, what was logged until then is there, and why it ended."""

    def progress(done: float, _total: float) -> None:
        if done >= 0.5:
            raise error

    result = simulate(load_scenario("flat_walk"), progress=progress)
    assert (result.outcome, result.reason) == ("stopped", reason)
    assert result.table["t"].to_numpy()[-1] == pytest.approx(0.5)


def test_progress_is_told_time_and_what_it_will_come_to() -> None:
    """Every so often, with the planned duration as the end."""
    told: list[tuple[float, float]] = []
    chunks = itertools.count()
    simulate(
        load_scenario("flat_walk"),
        progress=lambda done, total: told.append((done, total)),
        stop=lambda: next(chunks) >= 3,
    )
    assert [done for done, _ in told] == pytest.approx([0.25, 0.5, 0.75, 1.0])
    duration = prepare(load_scenario("flat_walk")).plan.duration
    assert all(total == pytest.approx(duration) for _, total in told)


def test_kinematic_run_replays_the_plan_and_says_so() -> None:
    """No physics: it lasts as long as the plan, measures nothing, and tells in its reason."""
    scenario = load_scenario("flat_walk", ["simulation.mode=kinematic"])
    result = simulate(scenario)
    assert result.outcome == "goal_reached" and "no physics" in result.reason
    assert result.summary["simulation"] == "kinematic"
    duration = prepare(scenario).plan.duration
    assert result.summary["simulated_time"] == pytest.approx(duration, abs=0.02)
    assert result.summary["torque_ratio_max"] is None
    assert result.summary["margin"] == result.summary["margin_planned"]


def test_summary_says_what_ran() -> None:
    """Versions, seed and pace are in it: enough to run it again and compare."""
    summary = short([], seconds=0.5).summary
    assert set(summary["versions"]) == {"drake_quad", "drake", "numpy", "python"}
    assert summary["seed"] == 0 and summary["simulation"] == "physics"
    pace = summary["simulated_time"] / summary["wall_time"]
    assert summary["real_time_factor"] == pytest.approx(pace)
    json.dumps(summary, allow_nan=False)


def test_no_sample_that_is_not_finite_is_kept() -> None:
    """Of a state that blows up what came before is logged, and neither it nor what follows."""
    states = np.ones((5, 3))
    assert count_finite(states) == 5
    states[3, 1], states[4, 0] = np.inf, np.nan
    assert count_finite(states) == 3
    assert count_finite(states[:0]) == 0
