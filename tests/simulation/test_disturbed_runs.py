"""Runs in a world that is not as the controller believes: small disturbances are survived."""

import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest
from rig import paper_robot

from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.metrics import summarize
from drake_quad.runs.result import RunResult
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation import run as run_module
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate

SOON = "course=[{kind: floor, length: 2.1}, {kind: stairs, going: up, rise: 0.13, run: 0.5, "
SOON += "count: 2}, {kind: landing, length: 2.6}]"
# The walk begins at once, and its first step is made from 0.8 to 1.4 s.
SOON_SWUNG = ("transition.shift_time=0.7", "transition.swing_time=0.6")
AT_ONCE = "mission=[{kind: stand, duration: 0.1}, {kind: walk, distance: 2.0}]"


def run_for(seconds: float, *overrides: str) -> RunResult:
    """The first seconds of the level walk."""
    chunks = itertools.count()
    scenario = load_scenario("flat_walk", overrides)
    return simulate(scenario, stop=lambda: next(chunks) >= 4 * seconds - 1)


@cache
def undisturbed() -> RunResult:
    return run_for(0.5, AT_ONCE, *SOON_SWUNG)


def test_a_small_kick_is_seen_and_survived() -> None:
    """At 0.1 m/s from the side the base sways and comes back; the log has the force."""
    push = "disturbances.pushes=[{time: 0.6, speed: 0.1, direction_deg: 90}]"
    result = run_for(2.0, AT_ONCE, push)
    (figures,) = result.summary["pushes"]
    assert result.reason == "interrupted" and figures["recovered"] is True
    assert 0.002 < figures["base_error_max"] < 0.05
    t, force = (result.table[name].to_numpy() for name in ("t", "push_force_y"))
    during = (t > 0.6 + 1e-6) & (t < 0.7 - 1e-6)
    assert force[during] == pytest.approx(figures["force"])
    assert np.all(force[(t < 0.6 - 1e-6) | (t > 0.7 + 1e-6)] == 0.0)


def test_a_kick_that_no_robot_survives_ends_the_run() -> None:
    """At 4 m/s it falls, and the summary says that it did not recover."""
    push = "disturbances.pushes=[{time: 0.6, speed: 4.0, direction_deg: 90}]"
    result = run_for(6.0, AT_ONCE, push)
    assert result.outcome == "fell"
    assert result.summary["pushes"][0]["recovered"] is False


def test_a_push_that_would_not_tip_it_takes_no_foot_off_the_ground() -> None:
    """At 0.15 m/s, a foot in the air: the light foot keeps its ground, and the walk goes on."""
    push = "disturbances.pushes=[{time: 4.3, speed: 0.15, direction_deg: 270}]"
    result = run_for(5.6, AT_ONCE, push, "controller.kind=whole_body")
    t, margin, swing = (result.table[n].to_numpy() for n in ("t", "margin", "swing_leg"))
    assert np.all(swing[(t > 4.3) & (t < 4.4)] > 0)
    assert margin[t > 4.1].min() > 0.08
    assert set(result.table["gait_mode"].to_pylist()) == {"run"}


@pytest.mark.long
def test_a_push_that_would_tip_it_is_caught_with_a_foot() -> None:
    """At 0.6 m/s between two steps: it puts a foot where it falls to, stands, and walks on.

    Without that, it falls: the same push, `catch_pushes: false`.
    """
    pushed = ["disturbances.pushes=[{time: 4.5, speed: 0.6, direction_deg: 90}]"]
    pushed += ["controller.kind=whole_body"]
    lost = run_for(8.0, *pushed, "controller.catch_pushes=false")
    assert lost.outcome == "fell" and lost.summary["recoveries"] == []
    result = run_for(8.0, *pushed)
    assert result.reason == "interrupted" and result.summary["pushes"][0]["recovered"] is True
    ((leg,),) = [recovery["legs"] for recovery in result.summary["recoveries"]]
    t, margin, y, swing = (
        result.table[name].to_numpy() for name in ("t", "margin", f"{leg}_position_y", "swing_leg")
    )
    assert y[t > 5.5][0] > y[t < 4.5][-1] + 0.1  # the way that it was pushed
    assert margin[(t > 4.5) & (t < 5.0)].min() < 0.0 < 0.1 < margin[t > 5.5].min()
    assert np.any(swing[t > 6.0]) and result.table["plan_revision"].to_numpy()[-1] == 1
    assert result.summary["nonfoot_contact_samples"] == 0


@pytest.mark.parametrize(
    "override",
    [
        "disturbances.payload={mass: 5, z: 0.1}",
        "disturbances.com_offset={x: 0.02, y: 0.01}",
        "disturbances.motor_strength=[{joint: FL_knee, factor: 0.6}]",
        "disturbances.sensor_delay=0.004",
        "disturbances.command_delay=0.004",
    ],
)
def test_what_the_controller_is_not_told_of_is_survived_if_small(override: str) -> None:
    """Through the first step of the walk the base stays with its plan, other than without it."""
    result = run_for(1.75, AT_ONCE, *SOON_SWUNG, override)
    assert result.reason == "interrupted"
    assert {*result.table["swing_leg"].to_numpy()} > {0}
    assert result.summary["base_error_max"] < 0.02
    assert result.summary["nonfoot_contact_samples"] == 0
    plain = undisturbed()
    assert not result.table.slice(0, plain.table.num_rows).equals(plain.table)


@pytest.mark.long
@pytest.mark.parametrize("landing_speed", [0.05, 0.15])
def test_feet_stand_on_the_world_and_not_on_the_map(landing_speed: float) -> None:
    """On the first tread the bearing feet are at its real height, and the run goes on, with margin.

    The clock waits for them at least as long as a foot takes for the 8 mm that the tread is lower.

    A foot that finds its tread lower than mapped holds the clock up. A body that is stopped with it
    at once lifts another foot: the margin was -0.06 m here before it was braked (see
    `control/base_tracking.py`).
    """
    errors = ["world={rise_error: -0.008, position_error: 0.02, tread_error: 0.002}", SOON]
    errors += ["gait.swing_clearance=0.04", "start.distance=1.1"]
    errors += [f"controller.landing_speed={landing_speed}"]
    prepared = prepare(load_scenario("flat_walk", errors))
    result = run_for(22.0, *errors)
    assert result.reason == "interrupted"
    found = 0
    for leg in SHORT_NAMES:
        x, y, z = (result.table[f"{leg}_position_{k}"].to_numpy() for k in "xyz")
        bears = result.table[f"{leg}_bearing"].to_numpy(zero_copy_only=False)
        real, planned = prepared.world.height(x, y), prepared.course.height(x, y)
        on_tread = bears & (planned > 0.01)
        assert np.all(np.abs(z - real)[bears] < 0.002)
        assert np.all(np.abs(z - planned)[on_tread] > 0.002)
        found += int(on_tread.sum())
    assert found > 100
    assert 0.008 / landing_speed < result.summary["clock_waited"] < 4 * 0.008 / landing_speed
    assert result.summary["margin"]["minimum"] > 0.03


def test_energy_is_told_of_the_mass_that_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """A load and heavier links are in the cost of transport, though no plan knows of them."""
    told: list[float] = []

    def noted(*given: Any, mass: float, **rest: Any) -> dict[str, Any]:
        told.append(mass)
        return summarize(*given, mass=mass, **rest)

    monkeypatch.setattr(run_module, "summarize", noted)
    run_for(0.25, "disturbances={mass_factor: 1.1, payload: {mass: 5, z: 0.1}}")
    nominal = paper_robot().mass
    assert told == [pytest.approx(1.1 * nominal + 5.0)]


def test_a_replay_of_the_plan_is_not_pushed() -> None:
    """Without physics there is no push to recover from, and the log has no force."""
    push = "disturbances.pushes=[{time: 3.0, speed: 1.0}]"
    result = simulate(load_scenario("flat_walk", [push, "simulation.mode=kinematic"]))
    assert result.summary["pushes"] == []
    assert np.all(result.table["push_force_x"].to_numpy() == 0.0)
