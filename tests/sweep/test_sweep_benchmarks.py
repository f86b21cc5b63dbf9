"""What the benchmarks of sweeps measure is what they say they measure."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sweep_rig as rig

from drake_quad.sweep.study import Base
from drake_quad.sweep.study_loading import load_study_and_base

ROOT = Path(__file__).resolve().parents[2]
SHORT = "mission=[{kind: stand, duration: 0.3}]"


def test_every_engine_has_the_same_trials(load: Any) -> None:
    """Scenario, draws and seed are the same under each, and another for each draw."""
    check = load("cross_check")
    study, base = load_study_and_base(ROOT / "studies" / "solvers.yaml")
    engines = list(check.ENGINES)
    trials = check.trials_of(study, base, 12, engines)
    assert [trial.index for trial in trials] == list(range(12 * len(engines)))
    by_draw = [trials[k : k + len(engines)] for k in range(0, len(trials), len(engines))]
    for draw, same in enumerate(by_draw):
        assert [trial.values for trial in same] == [
            (draw, same[0].values[1], engine) for engine in engines
        ]
        assert all(trial.overrides == same[0].overrides for trial in same)
        assert not any(check.SOLVER in text for text in same[0].overrides)
    assert len({same[0].values[1] for same in by_draw}) == 12
    assert trials[: 3 * len(engines)] == check.trials_of(study, base, 3, engines)


def test_a_short_stand_is_the_same_under_every_engine(load: Any) -> None:
    """All reach the goal, with the same margin to 0.1 mm."""
    pytest.importorskip("mujoco")
    check, trials = load("cross_check"), load("cross_trials")
    study, base = load_study_and_base(ROOT / "studies" / "solvers.yaml")
    margins = []
    for trial in check.trials_of(study, base, 1, ["lagged", "CENIC", "MuJoCo"]):
        result = trials.work(replace(trial, overrides=(*trial.overrides, SHORT)))
        assert result["outcome"] == "goal_reached", result
        margins.append(result["figures"]["margin"])
    assert max(margins) - min(margins) < 1e-4


def test_a_moment_is_no_lasting_margin(load: Any) -> None:
    """What is undercut for fewer samples than asked for does not count; what lasts does."""
    lasting = load("cross_trials").lasting_minimum
    values = np.array([0.08, 0.07, -0.1, 0.075, 0.09, -0.2, -0.2, 0.08, 0.05, 0.06, 0.055, 0.09])
    assert lasting(values, 1) == -0.2 and lasting(values, 3) == 0.06 and lasting(values, 13) is None


def test_mujoco_refuses_what_it_does_not_simulate(load: Any) -> None:
    """A push, a delay, an estimate: no run without them is passed off as one with them."""
    pytest.importorskip("mujoco")
    trials = load("cross_trials")
    for override in (
        "estimator.kind=ekf",
        "disturbances.command_delay=0.002",
        "disturbances.pushes=[{time: 1.0, speed: 0.1, direction_deg: 0.0}]",
    ):
        assert trials.run_in_mujoco(Base("flat_walk"), [SHORT, override])["outcome"] == "refused"


def test_agreement_is_counted(load: Any) -> None:
    """Of four trials: one failed in both, one in one of them, two reached the goal 2 mm apart."""
    check = load("cross_check")
    outcomes = {
        "lagged": [("goal_reached", 0.050), ("fell", None), ("fell", None), ("goal_reached", 0.06)],
        "sap": [("goal_reached", 0.052), ("fell", None), ("goal_reached", 0.01),
                ("goal_reached", 0.058)],
    }  # fmt: skip
    results = [
        {
            "engine": engine,
            "draw": k,
            "friction": 0.1 * k,
            "outcome": outcome,
            "margin": margin,
            "margin_at_once": margin,
        }
        for engine, told in outcomes.items()
        for k, (outcome, margin) in enumerate(told)
    ]
    unfinished = {"engine": "sap", "draw": 4, "friction": 0.4, "outcome": "fell", "margin": None}
    written = check.section([*results, unfinished], ["lagged", "sap"], ["--trials", "5"])
    assert "The same 4 trials" in written
    row = next(line for line in written.splitlines() if line.startswith("| lagged, sap"))
    assert "3 of 4: 75.0 %" in row and "| 1 of 2 | 2.0 | 2.0 |" in row
    assert "| 1 | 0.100 | fell | fell |" in written and "| 0.050 | 0.052 |" in written


def test_overhead_is_what_is_no_simulation(load: Any, tmp_path: Path) -> None:
    """Of two workers' 2 x 10 s, 16 s of simulation leave a quarter; a real sweep adds up."""
    throughput = load("sweep_throughput")
    taken = throughput.Taken(2, wall=10.0, processor=19.0, simulating=16.0, trials=18.0, good=3)
    assert taken.overhead == pytest.approx(0.25) and taken.in_trials == pytest.approx(0.125)
    study = throughput.shrink(rig.study_file(tmp_path), 1, tmp_path / "small.yaml")
    real = throughput.sweep(study, 1, tmp_path / "out")
    assert real.good == 2 and 0.0 < real.simulating < real.trials < real.wall
    assert real.processor > 0.0


@pytest.mark.slow
def test_a_killed_sweep_is_compared(load: Any, tmp_path: Path) -> None:
    """Kills of the group and of the command alone, nothing lost or twice; memory is measured."""
    kills = load("sweep_kills")
    (tmp_path / "study.yaml").write_text(kills.STUDY.format(task=kills.STAND, trials=9))
    found = kills.kill_often(tmp_path, 2, 1.0, 1)
    told = json.loads(json.dumps(found))
    assert told["trials"] == 9 and told["equal"] and not told["lost"] and not told["twice"]
    with pytest.raises(RuntimeError, match="before all kills"):
        kills.kill_once(tmp_path, new=0, after=60.0, group=True)
    memory = kills.measure_memory(tmp_path)
    assert memory["trials"] == 9 and 50.0 < memory["after_first_trial"] <= memory["greatest"]


def test_a_study_of_ones_own_has_a_section_of_its_own(
    load: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the file's name; the usual study has the usual section, by whatever path it is given."""
    check = load("cross_check")
    monkeypatch.chdir(ROOT)
    assert check.name_of(Path("studies/solvers.yaml")) == check.NAME
    assert check.name_of(check.SOLVERS) == check.NAME
    assert check.name_of(Path("studies/engines_rough.yaml")) == "engines_rough"
    own = ["--study", "studies/engines_rough.yaml"]
    assert check.parse(["--study", "studies/solvers.yaml"]).words == check.parse([]).words
    assert check.parse(own).words == [*check.parse([]).words, *own]
