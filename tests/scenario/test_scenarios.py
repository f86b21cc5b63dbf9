"""Every shipped scenario runs; the case study runs in full and keeps what is asked of it.

The case study is one test, not one a claim: it takes a minute or more, and pytest's workers would
each run it again. The others in full are slow: `pytest -m slow tests/scenario/test_scenarios.py`.
"""

import itertools
import operator
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from rig import GRAVITY, paper_robot

from drake_quad.errors import InputError
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import leg_length
from drake_quad.runs.result import RunResult
from drake_quad.runs.summary_lines import summary_lines
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import load_scenario, shipped_scenarios
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course

README = Path(__file__).resolve().parents[2] / "README.md"
Comparison = Callable[[Any, Any], bool]
Bounds = tuple[tuple[str, Comparison, object], ...]

# The bounds that a run of the case study is asked to keep, by the summary's keys.
BOUNDS: Bounds = (
    ("outcome", operator.eq, "goal_reached"),
    ("margin.minimum", operator.ge, 0.068),
    ("margin_within_20mm", operator.ge, 0.95),
    ("samples_under_three_feet", operator.eq, 0),
    ("nonfoot_contact_samples", operator.eq, 0),
    ("slip_max", operator.le, 0.001),
    # A ball of 20 mm rolls by its radius times the shank's turn, 1.2 rad at the most.
    ("foot_roll_max", operator.le, 0.025),
    ("base_error_max", operator.le, 0.008),
    ("base_tilt_error_max_deg", operator.le, 2.0),
    ("torque_ratio_max", operator.le, 0.8),
    ("speed_ratio_max", operator.le, 1.0),
    ("position_ratio_max", operator.le, 1.0),
)

# Those of the other long runs, each beside its scenario's name. Three feet bear throughout where
# the gait is static, nobody pushes, and the map is right.
LIMITS: Bounds = (
    ("outcome", operator.eq, "goal_reached"),
    ("nonfoot_contact_samples", operator.eq, 0),
    ("torque_ratio_max", operator.le, 0.8),  # commands end at 1
    ("speed_ratio_max", operator.le, 1.0),
    ("position_ratio_max", operator.le, 1.0),
)
LONG: dict[str, Bounds] = {
    "paper_physics": (
        *LIMITS,
        ("margin.minimum", operator.ge, 0.06),
        ("samples_under_three_feet", operator.eq, 0),
        ("base_error_max", operator.le, 0.03),
        ("slip_max", operator.le, 0.01),
    ),
    # 83 % of 200 Nm at the hips: as much as 66 % of the 250 Nm that the robot had before.
    "fast": (
        *(bound for bound in LIMITS if bound[0] != "torque_ratio_max"),
        ("torque_ratio_max", operator.le, 0.9),
        ("zmp_inside", operator.ge, 0.995),
    ),
    "quick": (
        *LIMITS,
        ("margin.minimum", operator.ge, 0.055),
        ("samples_under_three_feet", operator.eq, 0),
    ),
    "estimated_state": (
        *LIMITS,
        ("margin.minimum", operator.ge, 0.04),
        ("samples_under_three_feet", operator.eq, 0),
        ("estimate.drift_ratio", operator.le, 0.01),
        ("estimate.samples_unhealthy", operator.eq, 0),
    ),
    "blind_errors": LIMITS,
    # 98 % of the torque, as planned; without landmarks it is 0.1 m off in the end.
    "ten_flights": (
        *(bound for bound in LIMITS if bound[0] != "torque_ratio_max"),
        ("margin.minimum", operator.ge, 0.07),
        ("samples_under_three_feet", operator.eq, 0),
        ("estimate.position_error_max", operator.le, 0.02),
        ("estimate.yaw_error_max_deg", operator.le, 1.0),
    ),
}


def figure(result: RunResult, key: str) -> object:
    """A value of the summary by its dotted key."""
    value: object = result.summary
    for part in key.split("."):
        assert isinstance(value, dict)
        value = value[part]
    return value


def broken(result: RunResult, bounds: Bounds) -> list[str]:
    """Which of the bounds the run does not keep, in words."""
    return [
        f"{key} = {figure(result, key)}, asked {kept.__name__} {bound}"
        for key, kept, bound in bounds
        if not kept(figure(result, key), bound)
    ]


# Whose designs, or plans, take a while.
LONG_STARTS = {"unmapped_go2", "unmapped_house", "fast_a1", "fast_b1", "fast_spot"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] if name in LONG_STARTS else [])
        for name, _ in shipped_scenarios()
    ],
)
def test_a_shipped_scenario_runs(name: str) -> None:
    """Two seconds of each: the robot stands on three feet at least, and nothing complains."""
    scenario, chunks = load_scenario(name), itertools.count()
    try:
        robot = load_robot(scenario.robot.model)
    except InputError as error:
        pytest.skip(str(error))  # its package is not installed
    kinematic = scenario.simulation.mode == "kinematic"
    result = simulate(scenario, stop=lambda: next(chunks) >= 7)
    assert result.outcome == ("goal_reached" if kinematic else "stopped")
    assert result.summary["samples_under_three_feet"] == 0
    assert result.summary["nonfoot_contact_samples"] == 0
    assert result.summary["simulated_time"] >= 2.0
    if not kinematic:
        assert result.summary["margin"]["minimum"] > 0.05 * leg_length(robot)
        assert result.summary["base_error_max"] < 0.01


def test_the_case_study_in_full_keeps_all_that_is_asked_of_it() -> None:
    """Walk, climb six stairs, turn, descend six stairs, walk on: within every bound."""
    scenario = load_scenario("case_study")
    result = simulate(scenario)
    assert not broken(result, BOUNDS), result.reason
    assert result.summary["tracking"]["left"] == []  # what the certificate of its plan tolerates
    check_way(result.table, rise=6 * 0.13)
    check_contacts_are_sensed(result.table)
    check_margin_is_measured(result.table)
    check_readme(result)
    check_footprints(result.table, course_of(scenario))
    check_forecasts(result)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_a_long_scenario_in_full_keeps_its_bounds(name: str) -> None:
    """To the goal, within what is asked of it."""
    result = simulate(load_scenario(name))
    assert not broken(result, LONG[name]), result.reason


@pytest.mark.slow
def test_the_pushed_run_recovers_from_every_push_and_reaches_the_goal() -> None:
    """Of 0.3 and of 0.6 m/s: walking, climbing, spinning on the landing, and descending."""
    result = simulate(load_scenario("pushed"))
    pushes = result.summary["pushes"]
    assert result.outcome == "goal_reached", result.reason
    assert [push["recovered"] for push in pushes] == [True] * 8
    assert [push["speed"] for push in pushes] == [0.3, 0.6] * 4
    t, task, z = (result.table[name].to_numpy() for name in ("t", "task", "base_desired_z"))
    at = np.searchsorted(t, [push["time"] for push in pushes])
    height = (z[at] - z[0]) / (6 * 0.13)
    assert task[at].tolist() == [1, 1, 1, 1, 2, 2, 3, 3]
    assert set(result.table["segment_kind"].take(at[4:6]).to_pylist()) == {"spin"}
    assert np.all(np.abs(height[:2]) < 0.01) and np.all(np.abs(height[4:6] - 1.0) < 0.01)
    assert np.all((height[[2, 3, 6, 7]] > 0.02) & (height[[2, 3, 6, 7]] < 0.98))


def check_forecasts(result: RunResult) -> None:
    """The plan knew how far feet would roll, to 2 mm, and the peak torque, to a fifth."""
    plans = prepare(load_scenario("case_study")).plan.plans
    rolls = [np.hypot(*p.contacts.roll.offset.T).max() for p in plans if p.contacts.roll]
    assert figure(result, "foot_roll_max") == pytest.approx(max(rolls), abs=0.002)
    planned = figure(result, "torque_ratio_planned_max")
    assert figure(result, "torque_ratio_max") == pytest.approx(planned, rel=0.2)


def check_way(table: pa.Table, *, rise: float) -> None:
    """Up by all risers and down again, along both lanes."""
    x, y, z = (table[f"com_{k}"].to_numpy() for k in "xyz")
    assert np.ptp(x) > 7.0 and np.ptp(y) > 6.0
    assert np.max(z) - z[0] == pytest.approx(rise, abs=0.02)
    assert z[-1] == pytest.approx(z[0], abs=0.01)


def check_contacts_are_sensed(table: pa.Table) -> None:
    """A foot in mid-swing bears nothing, and a foot in stance nearly always bears."""
    swinging = table["swing_leg"].to_numpy()
    middle = np.abs(table["swing_phase"].to_numpy() - 0.5) < 0.2
    for leg, name in enumerate(SHORT_NAMES, start=1):
        bearing = table[f"{name}_bearing"].to_numpy(zero_copy_only=False)
        assert not np.any(bearing[(swinging == leg) & middle])
        assert np.mean(bearing[swinging != leg]) > 0.99
        # The plan has it otherwise: feet come to the ground sooner, and so leave it later.
        planned = table[f"{name}_standing_planned"].to_numpy(zero_copy_only=False)
        assert np.sum(bearing != planned) > 100
        # Bearing is to carry a hundredth of the weight, by the contact solver's forces.
        force = table[f"{name}_force_z"].to_numpy()
        assert np.mean(bearing == (force > 0.01 * paper_robot().mass * GRAVITY)) > 0.999


def check_margin_is_measured(table: pa.Table) -> None:
    """It is that of the feet that bear, where they touch, and of the whole robot's centre of mass.

    Not the planned one, which is a quarter of a millimetre off in the median and up to 0.18 m.
    """
    bearing = np.column_stack([table[f"{n}_bearing"].to_numpy(False) for n in SHORT_NAMES])
    feet = np.stack(
        [[table[f"{n}_position_{k}"].to_numpy() for n in SHORT_NAMES] for k in "xy"], axis=-1
    ).swapaxes(0, 1)
    com = np.column_stack([table[f"com_{k}"].to_numpy() for k in "xy"])
    off = np.abs(stability_margins(com, feet, bearing) - table["margin"].to_numpy())
    assert np.quantile(off, 0.95) < 1e-4  # the monitors run one after the other, a tick apart
    planned = np.abs(table["margin_planned"].to_numpy() - table["margin"].to_numpy())
    assert np.median(planned) > 1e-4 and planned.max() > 0.05


def check_readme(result: RunResult) -> None:
    """What README shows of this run is what is printed of it, but for the last digit."""
    shown = re.findall(
        r"^(.+?)  +([0-9.]+)(.*)$", README.read_text().split("carried out\n")[1], re.M
    )
    found = {
        label: re.match(r"([0-9.]+)(.*)", text) for label, text in summary_lines(result.summary)
    }
    compared = 0
    for label, number, unit in shown:
        text = found.get(label)
        if text is not None:
            digit = 10.0 ** -len(number.partition(".")[2])
            assert text[2] == unit and abs(float(text[1]) - float(number)) < 1.5 * digit, label
            compared += 1
    assert compared == 10


def check_footprints(table: pa.Table, course: Course) -> None:
    """Wherever a foot bears in stance, it is on the ground that the course has there."""
    for name in SHORT_NAMES:
        stands = table[f"{name}_bearing"].to_numpy(zero_copy_only=False)
        stands &= table[f"{name}_standing_planned"].to_numpy(zero_copy_only=False)
        x, y, z = (table[f"{name}_position_{k}"].to_numpy()[stands] for k in "xyz")
        ground = course.height(x, y)
        assert np.nanmax(np.abs(z - ground)) < 2e-3 and not np.any(np.isnan(ground))
