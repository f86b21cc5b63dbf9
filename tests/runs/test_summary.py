"""A run's figures: each is what one gets by hand from the log, and says when it cannot be had."""

import json
from itertools import pairwise

import numpy as np
import pytest
from rig import GRAVITY, paper_robot
from summary_rig import (
    PERIOD,
    as_list,
    changed,
    log,
    summary,
    values,
    with_columns,
)

from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.metrics import segment_figures, stances, summarize


def q_name(joint: str) -> str:
    return f"q_{paper_robot().name}_{joint}_q"


def test_a_run_just_as_planned_has_no_errors() -> None:
    """No base error, no slip, no waiting, all feet that should bear do; they roll as planned."""
    found = summary(log())
    for key in ("base_error_max", "base_tilt_error_max_deg", "slip_max"):
        assert found[key] == pytest.approx(0.0, abs=1e-5), key
    assert 0.008 < found["foot_roll_max"] < 0.025
    for key in ("samples_under_three_feet", "time_under_three_feet", "nonfoot_contact_samples"):
        assert found[key] == 0, key
    assert found["margin_within_20mm"] == 1.0 and found["margin"] == found["margin_planned"]
    assert found["samples"] == log().num_rows


def test_feet_that_do_not_bear_are_counted_in_samples_and_seconds() -> None:
    """Two feet on the ground for 0.2 s are 20 samples of 10 ms."""
    lost = {f"{leg}_bearing": values(f"{leg}_bearing") for leg in SHORT_NAMES}
    for leg in ("FL", "RR"):
        lost[f"{leg}_bearing"][5:25] = False
    found = summary(changed(**lost))
    assert found["samples_under_three_feet"] == 20
    assert found["time_under_three_feet"] == pytest.approx(0.2)


def test_contacts_of_anything_but_feet_are_counted() -> None:
    """Samples with one, and the greatest force."""
    count, force = values("nonfoot_contacts"), values("nonfoot_force")
    count[3:6], force[4] = [1, 2, 1], 77.0
    found = summary(changed(nonfoot_contacts=count, nonfoot_force=force))
    assert found["nonfoot_contact_samples"] == 3 and found["nonfoot_force_max"] == 77.0


def test_contacts_between_samples_are_counted_where_the_monitor_saw_them() -> None:
    """Times and force are of all ticks: a contact that no sample shows is no less one."""
    n = log().num_rows
    seen = {"time_under_three_feet": 0.002, "nonfoot_contact_time": 0.004,
            "nonfoot_force_most": 55.0}  # fmt: skip
    ramp = np.minimum(np.arange(n), 1.0)
    found = summary(changed(**{name: most * ramp for name, most in seen.items()}))
    assert found["samples_under_three_feet"] == found["nonfoot_contact_samples"] == 0
    assert found["time_under_three_feet"] == 0.002 and found["nonfoot_contact_time"] == 0.004
    assert found["nonfoot_force_max"] == 55.0


def test_what_swing_feet_touch_is_counted_between_lift_off_and_touchdown() -> None:
    """Of the leg that swings, and not as it leaves the ground or finds it."""
    leg, phase = values("swing_leg"), values("swing_phase")
    row = int(leg[(phase > 0.4) & (phase < 0.6)][0])
    middle = np.flatnonzero((leg == row) & (phase > 0.4) & (phase < 0.6))
    begun = np.flatnonzero((leg == row) & (phase > 0.0) & (phase < 0.05))
    own = {f"{SHORT_NAMES[row - 1]}_force_{k}": np.zeros(len(leg)) for k in "xyz"}
    name = f"{SHORT_NAMES[row - 1]}_force"
    own[f"{name}_x"][middle[:2]], own[f"{name}_z"][middle[:1]] = -3.0, -4.0
    own[f"{name}_x"][begun] = 100.0
    found = summary(changed(**own))
    assert found["swing_contact_samples"] == 2 and found["swing_force_max"] == 5.0
    assert found["swing_hit_samples"] == 0  # a graze, of so heavy a robot
    hard = {key: force * 0.003 * GRAVITY * paper_robot().mass for key, force in own.items()}
    assert summary(changed(**hard))["swing_hit_samples"] == 1  # 5 N and 3 N became 1.5 % and 0.9 %
    assert summary(log())["swing_contact_samples"] == 0
    # In a push the clock stands still in mid-swing, and the foot bears.
    mode = np.array(["settle"] * len(leg))
    assert summary(changed(**own, gait_mode=mode))["swing_contact_samples"] == 0
    nothing = {n: np.full(len(leg), np.nan) for n in own}
    assert summary(changed(**nothing))["swing_contact_samples"] is None


def test_slip_is_the_way_slid_in_one_stance() -> None:
    """1 cm/s for 0.2 s is 2 mm, twice in one stance 4 mm, and nothing in the air."""
    speed, standing = values("FR_slip_speed"), values("FR_standing_planned")
    speed[10:30] = speed[40:60] = 0.01  # in the stand
    assert summary(changed(FR_slip_speed=speed))["slip_max"] == pytest.approx(0.004)
    in_air = np.where(standing, 0.0, 5.0)
    assert summary(changed(FR_slip_speed=in_air))["slip_max"] == 0.0


def test_roll_is_how_far_a_contact_moves_in_one_stance() -> None:
    """A contact that wanders by 3-4 mm has rolled 5 mm; a new stance begins anew."""
    still = {f"{leg}_position_{axis}": 0.0 * values("RL_position_x")
             for leg in ("FL", "FR", "RL", "RR") for axis in "xy"}  # fmt: skip
    still["RL_position_x"][20:] += 0.003
    still["RL_position_y"][20:] += 0.004
    found = summary(changed(**still))
    assert found["foot_roll_max"] == pytest.approx(0.005)
    assert found["slip_max"] == 0.0


def test_ratios_are_of_the_joints_own_limits() -> None:
    """Torque and speed by size, position from the middle of its range."""
    robot, n = paper_robot(), log().num_rows
    joint, k = robot.joint_names[8], 8
    tau = np.zeros(n)
    tau[40] = -0.7 * robot.effort[k]
    assert summary(changed(**{f"tau_{joint}": tau}))["torque_ratio_max"] == pytest.approx(0.7)
    tau = np.where(np.arange(n) < n // 2, 0.6, -0.8) * robot.effort[k]
    rms = summary(changed(**{f"tau_{joint}": tau}))["torque_ratio_rms"]
    assert rms == pytest.approx(np.sqrt(0.5 * (0.36 + 0.64)), abs=0.01)
    speed = values(f"v_{robot.name}_{joint}_w")
    speed[41] = -0.9 * robot.speed[k]
    found = summary(changed(**{f"v_{robot.name}_{joint}_w": speed}))
    assert found["speed_ratio_max"] == pytest.approx(0.9)
    for limit in (robot.q_lower, robot.q_upper):
        q = values(q_name(joint))
        q[42] = limit[k]
        found = summary(changed(**{q_name(joint): q}))
        assert found["position_ratio_max"] == pytest.approx(1.0)


def test_cost_of_transport_is_work_over_weight_and_way() -> None:
    """1 Nm at 2 rad/s in one joint for the whole run, over the way; swaying is no way."""
    robot, n = paper_robot(), log().num_rows
    joint = robot.joint_names[0]
    columns = {f"v_{robot.name}_{name}_w": np.zeros(n) for name in robot.joint_names}
    columns[f"v_{robot.name}_{joint}_w"] = np.full(n, -2.0)
    columns[f"tau_{joint}"] = np.full(n, 1.0)
    way = 2.0  # [m] that the plan walks, 2.2 m and more along its sway
    found = summary(changed(**columns))["cost_of_transport"]
    assert found == pytest.approx(2.0 * n * PERIOD / (robot.mass * GRAVITY * way), rel=1e-5)
    loaded = summarize(changed(**columns), robot, mass=2.0 * robot.mass)["cost_of_transport"]
    assert loaded == pytest.approx(0.5 * found)
    standing = log().slice(0, 40)
    assert summary(standing)["cost_of_transport"] is None  # no way, no cost of it


def test_segments_cover_the_run_with_their_smallest_margins() -> None:
    """In order, without gaps; the least of their minima is the run's."""
    found = summary(log())["segments"]
    assert isinstance(found, list)
    assert [s["kind"] for s in found] == ["stand", "transition", "wave", "stand"]
    for before, after in pairwise(found):
        assert after["start"] == pytest.approx(before["end"] + PERIOD)
    assert min(s["margin_min"] for s in found) == pytest.approx(values("margin").min())
    assert found[0]["start"] == 0.0
    margin = values("margin")
    margin[(values("t") > 1.0) & (values("t") < 1.1)] = -0.5
    worst = [s["name"] for s in segment_figures(
        {n: values(n, changed(margin=margin)) for n in log().column_names}
    ) if s["margin_min"] == -0.5]  # fmt: skip
    assert len(worst) == 1 and "transition" in worst[0]


def test_stances_are_the_stretches_in_which_a_foot_is_to_stand_and_does() -> None:
    """Half-open, in order, at the log's ends too."""
    bearing = np.array([1, 1, 0, 1, 1, 1, 0, 1], dtype=bool)
    planned = np.array([1, 1, 1, 1, 0, 1, 1, 1], dtype=bool)
    assert stances(bearing, planned) == [(0, 2), (3, 4), (5, 6), (7, 8)]
    assert stances(~bearing & False, planned) == []


def test_what_cannot_be_had_is_null_in_json() -> None:
    """No nan and no infinity ever reaches the file: JSON has none."""
    n = log().num_rows
    nothing = changed(zmp_margin=np.full(n, np.nan), margin=np.full(n, np.nan),
                      tau_FL_knee=np.full(n, np.nan))  # fmt: skip
    text = json.dumps(summary(nothing), allow_nan=False)
    found = json.loads(text)
    assert found["zmp_margin"] == {"minimum": None, "percentile_1": None, "median": None}
    assert found["margin_within_20mm"] is None and found["cost_of_transport"] is None


def test_log_without_rows_has_no_figures_and_of_one_row_some() -> None:
    """A run that ends at once still has a summary."""
    assert summary(log().slice(0, 0)) == {}
    one = summary(log().slice(0, 1))
    json.dumps(one, allow_nan=False)
    assert one["samples"] == 1


def test_a_plan_made_anew_begins_its_segments_anew() -> None:
    """Two recoveries in a row, both `recovery`, are two segments."""
    n = log().num_rows
    same = {"segment": np.array(["recovery"] * n, dtype=object), "task": np.zeros(n, dtype=int)}
    table = with_columns(log(), **same, plan_revision=(np.arange(n) > 300) + 1)
    first, second = as_list(summary(table)["segments"])
    assert first["end"] == pytest.approx(3.0) and second["start"] == pytest.approx(3.01)
