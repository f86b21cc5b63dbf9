"""Every shipped scenario runs; the case study runs in full and keeps what is asked of it."""

import itertools

import numpy as np
import pytest

from drake_quad.scenario import load_scenario, shipped_scenarios
from drake_quad.simulation import RunResult, run

SHIPPED = [name for name, _ in shipped_scenarios()]


@pytest.fixture(scope="module")
def case_study() -> RunResult:
    return run(load_scenario("case_study"))


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenario_runs(name: str) -> None:
    """Two seconds of each: the robot stands on three feet at least, and nothing complains."""
    chunks = itertools.count()
    result = run(load_scenario(name), stop=lambda: next(chunks) >= 7)
    assert result.outcome == ("goal_reached" if name == "paper" else "stopped")
    assert result.summary["samples_under_three_feet"] == 0
    assert result.summary["simulated_time"] >= 2.0
    if name != "paper":
        assert result.summary["margin"]["minimum"] > 0.06


def test_the_case_study_reaches_its_goal(case_study: RunResult) -> None:
    """Walk, climb six stairs, spin by 90°, descend six stairs, walk on."""
    assert case_study.outcome == "goal_reached"
    com = [case_study.table[f"com_{k}"].to_numpy() for k in "xyz"]
    assert np.ptp(com[0]) > 7.0 and np.ptp(com[1]) > 6.0
    assert np.max(com[2]) - com[2][0] == pytest.approx(6 * 0.13, abs=0.02)
    assert com[2][-1] == pytest.approx(com[2][0], abs=0.01)


def test_the_case_study_keeps_its_margin(case_study: RunResult) -> None:
    """Measured over the bearing feet with the whole robot's centre of mass: 0.06 m at least."""
    assert case_study.summary["margin"]["minimum"] >= 0.06
    assert case_study.summary["margin_within_20mm"] >= 0.95


def test_the_case_study_stands_on_its_feet(case_study: RunResult) -> None:
    """Three feet bear at every sample, nothing else touches the course, and no foot slips."""
    summary = case_study.summary
    assert summary["samples_under_three_feet"] == 0
    assert summary["nonfoot_contact_samples"] == 0
    assert summary["slip_max"] <= 0.01
    assert summary["foot_roll_max"] <= 0.01


def test_the_case_study_stays_on_its_plan(case_study: RunResult) -> None:
    """The base is within 0.03 m and 2° of its plan, the joints within all their limits."""
    summary = case_study.summary
    assert summary["base_error_max"] <= 0.03
    assert summary["base_tilt_error_max_deg"] <= 2.0
    for ratio in ("torque_ratio_max", "speed_ratio_max", "position_ratio_max"):
        assert summary[ratio] <= 1.0


def test_sensed_and_planned_stance_agree(case_study: RunResult) -> None:
    """A foot in mid-swing bears nothing, and a foot in mid-stance bears: contacts are sensed."""
    table = case_study.table
    swinging = table["swing_leg"].to_numpy()
    middle = np.abs(table["swing_phase"].to_numpy() - 0.5) < 0.2
    for leg, name in enumerate(("FL", "FR", "RL", "RR"), start=1):
        bearing = table[f"{name}_bearing"].to_numpy(zero_copy_only=False)
        assert not np.any(bearing[(swinging == leg) & middle])
        assert np.mean(bearing[swinging != leg]) > 0.99
