"""A run's figures: each is what one gets by hand from the log, and says when it cannot be had."""

import json
import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RollPitchYaw
from rig import GRAVITY, flat_walk, model_layout, model_plant, paper_robot, stand_plan

from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.run_log import kinematic_logs, make_table, state_names
from drake_quad.summary import base_error, push_figures, segment_figures, stances, summarize
from drake_quad.summary_estimate import way_of
from drake_quad.summary_pose import angle_between, quaternion_of
from drake_quad.systems.disturbances import Push

DOCS = Path(__file__).resolve().parents[1] / "docs" / "log_format.md"
PERIOD = 0.01  # [s]


@cache
def log() -> pa.Table:
    """A stand and a walk just as planned, with the weight on the standing feet."""
    plant, robot = model_plant(), paper_robot()
    plans = (stand_plan(0.5), flat_walk())
    times, logs = kinematic_logs(robot, model_layout(), plans, PERIOD, massless_legs=False)
    n = len(times)
    logs["torque"] = np.zeros((n, 12))
    logs["force"] = np.zeros((n, 12))
    logs["zmp_margin"] = np.array(logs["margin"])
    return make_table(
        robot,
        model_layout(),
        times=times,
        logs=logs,
        plans=plans,
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
    )


def values(name: str, table: pa.Table | None = None) -> np.ndarray:
    column = (table or log()).column(name).to_numpy(zero_copy_only=False)
    return np.array(column)


def changed(**columns: np.ndarray) -> pa.Table:
    """The log with other values in these columns."""
    table = log()
    for name, new in columns.items():
        table = table.set_column(table.column_names.index(name), name, pa.array(new))
    return table


def summary(table: pa.Table) -> dict[str, Any]:
    return summarize(table, paper_robot())


def q_name(joint: str) -> str:
    return f"q_{paper_robot().name}_{joint}_q"


def base_columns() -> tuple[list[str], list[str]]:
    """Names of the base's quaternion and place."""
    names = log().column_names
    quaternion = [next(n for n in names if n.endswith(f"trunk_q{k}")) for k in "wxyz"]
    return quaternion, [next(n for n in names if n.endswith(f"trunk_{k}")) for k in "xyz"]


def test_a_run_just_as_planned_has_no_errors() -> None:
    """No base error, no slip, no waiting, all feet that should bear do; they roll as planned."""
    found = summary(log())
    for key in ("base_error_max", "base_tilt_error_max_deg", "slip_max"):
        assert found[key] == pytest.approx(0.0, abs=1e-5), key
    assert 0.003 < found["foot_roll_max"] < 0.012
    for key in ("samples_under_three_feet", "time_under_three_feet", "nonfoot_contact_samples"):
        assert found[key] == 0, key
    assert found["margin_within_20mm"] == 1.0 and found["margin"] == found["margin_planned"]
    assert found["samples"] == log().num_rows


def test_margins_are_told_by_minimum_percentile_and_median() -> None:
    """And when the smallest was, however many samples are not numbers."""
    margin = np.linspace(0.3, 0.1, log().num_rows)
    margin[7], margin[11] = 0.01, np.nan
    found = summary(changed(margin=margin))["margin"]
    rest = margin[np.isfinite(margin)]
    assert found == {
        "minimum": 0.01,
        "percentile_1": pytest.approx(np.percentile(rest, 1)),
        "median": pytest.approx(np.median(rest)),
    }
    at = summary(changed(margin=margin))["margin_minimum_at"]
    assert at == pytest.approx(7 * PERIOD)


def test_share_of_samples_near_the_plan() -> None:
    """Half a log that is 2.1 cm off counts as half, one that is 1.9 cm off as whole."""
    half = np.arange(log().num_rows) % 2 == 0
    for off, share in ((0.021, 1 - half.mean()), (-0.021, 1 - half.mean()), (0.019, 1.0)):
        margin = values("margin") + off * half
        assert summary(changed(margin=margin))["margin_within_20mm"] == pytest.approx(share)


def test_base_error_is_the_distance_and_the_angle_from_the_plan() -> None:
    """3-4-0 cm off is 5 cm off; rolled by 3° is 3° off, whichever sign the quaternion has."""
    quaternion, place = base_columns()
    at = values(place[0])
    moved = changed(**{place[0]: at + 0.03, place[1]: values(place[1]) - 0.04})
    assert summary(moved)["base_error_max"] == pytest.approx(0.05)
    turned = RollPitchYaw(np.radians(3.0), 0.0, 0.0).ToQuaternion().wxyz()
    for sign in (1.0, -1.0):
        columns = {n: np.full(len(at), sign * v) for n, v in zip(quaternion, turned, strict=True)}
        zero = {"base_desired_yaw": np.zeros(len(at)), "base_desired_pitch": np.zeros(len(at))}
        found = summary(changed(**columns, **zero))
        assert found["base_tilt_error_max_deg"] == pytest.approx(3.0, abs=1e-3)


def test_base_error_at_each_sample() -> None:
    """`base_error` has a row a sample, and sees yaw and pitch of the plan."""
    c = {name: values(name) for name in log().column_names}
    c["base_desired_yaw"] = c["base_desired_yaw"] + 0.1
    place, tilt = base_error(c)
    assert place.shape == tilt.shape == (log().num_rows,)
    np.testing.assert_allclose(tilt, 0.1, atol=1e-6)


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
    """1 Nm at 2 rad/s in one joint for the whole run, over the way that the base was to go."""
    robot, n = paper_robot(), log().num_rows
    joint = robot.joint_names[0]
    columns = {f"v_{robot.name}_{name}_w": np.zeros(n) for name in robot.joint_names}
    columns[f"v_{robot.name}_{joint}_w"] = np.full(n, -2.0)
    columns[f"tau_{joint}"] = np.full(n, 1.0)
    way = np.sum(np.hypot(np.diff(values("base_desired_x")), np.diff(values("base_desired_y"))))
    found = summary(changed(**columns))["cost_of_transport"]
    assert found == pytest.approx(2.0 * n * PERIOD / (robot.mass * GRAVITY * way))
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


def test_every_figure_is_documented() -> None:
    """docs/log_format.md has each of the summary's keys, and each key of those within."""
    text = DOCS.read_text().split("## summary.json")[1]
    keys = set(re.findall(r"`([^`]+)`", text))
    found = summary(estimated(interrupted()))
    inner = {"estimate", "carried", "clock_waited_for", "margin"}
    nested = [key for name in inner for key in as_dict(found[name])]
    (recovery,) = as_list(found["recoveries"])
    assert [key for key in (*found, *nested, *recovery) if key not in keys] == []


def as_dict(value: object) -> dict[str, Any]:
    assert isinstance(value, dict)
    return value


def as_list(value: object) -> list[Any]:
    assert isinstance(value, list)
    return value


def with_columns(table: pa.Table, **columns: np.ndarray) -> pa.Table:
    """The table with columns changed or added."""
    for name, new in columns.items():
        if name in table.column_names:
            table = table.drop_columns([name])
        table = table.append_column(name, pa.array(new))
    return table


def interrupted(*, cut: bool = False) -> pa.Table:
    """The log, but from 1 s on caught with FR, then RL, calm by 1.6 s; the clock runs at 1.7 s."""
    t = values("t")
    mode = np.array(["run"] * len(t), dtype=object)
    leg = np.zeros(len(t), dtype=int)
    for start, end, word, caught in (
        (1.0, 1.2, "catch", 2), (1.2, 1.3, "settle", 0), (1.3, 1.4, "catch", 3),
        (1.4, 1.6, "settle", 0), (1.6, 1.7, "replan", 0),
    ):  # fmt: skip
        mine = (t > start - 1e-9) & (t < end - 1e-9)
        mode[mine], leg[mine] = word, caught
    waited = np.cumsum(np.where(mode == "run", 0.0, PERIOD))
    table = with_columns(log(), gait_mode=mode, catch_leg=leg, gait_waited=waited)
    return table.slice(0, int(np.searchsorted(t, 1.5))) if cut else table


def estimated(table: pa.Table, *, ahead: float = 0.0, yaw: float = 0.0) -> pa.Table:
    """The table with estimates: the truth, moved along x [m], turned about z [rad]."""
    quaternion, place = base_columns()
    w, x, y, z = (values(name, table) for name in quaternion)
    n = table.num_rows
    rpy = np.array([RollPitchYaw(Quaternion(q)).vector() for q in np.column_stack([w, x, y, z])])
    columns: dict[str, np.ndarray] = {"estimator_healthy": np.ones(n, dtype=bool)}
    for k, axis in enumerate("xyz"):
        columns[f"base_estimated_{axis}"] = values(place[k], table) + ahead * (axis == "x")
    for k, name in enumerate(("roll", "pitch", "yaw")):
        columns[f"base_estimated_{name}"] = rpy[:, k] + yaw * (name == "yaw")
    columns |= {f"{leg}_slip_estimated": np.zeros(n, dtype=bool) for leg in SHORT_NAMES}
    columns |= {"qp_unsolved": np.arange(n) // 100, "carried_force": np.full(n, 49.05)}
    columns |= {"carried_moment_x": np.full(n, 2.4525), "carried_moment_y": np.full(n, -4.905)}
    columns |= {f"{leg}_friction_estimated": np.full(n, 0.5) for leg in SHORT_NAMES}
    return with_columns(table, **columns)


def test_a_recovery_is_told_from_its_beginning_until_the_clock_runs() -> None:
    """When, with which legs in order, how long; one that the run did not outlast has no end."""
    (found,) = as_list(summary(interrupted())["recoveries"])
    assert found["time"] == pytest.approx(1.0) and found["legs"] == ["FR", "RL"]
    assert found["duration"] == pytest.approx(0.7)
    (cut,) = as_list(summary(interrupted(cut=True))["recoveries"])
    assert cut["legs"] == ["FR", "RL"] and cut["duration"] is None
    assert summary(log())["recoveries"] == []


def test_a_fall_right_after_the_plan_was_made_is_a_recovery_of_its_own() -> None:
    """Though no sample shows the clock running between the two."""
    table = interrupted()
    mode, leg, t = values("gait_mode", table), values("catch_leg", table), values("t")
    later = (t > 1.7 - 1e-9) & (t < 1.9)
    mode[later] = "catch"
    leg[later] = 4
    first, second = as_list(
        summary(with_columns(table, gait_mode=mode, catch_leg=leg))["recoveries"]
    )
    assert first["legs"] == ["FR", "RL"] and second["legs"] == ["RR"]
    assert first["duration"] == pytest.approx(second["time"] - first["time"])


def waiting(*, at: int, samples: int, swing: list[int], bears: bool) -> dict[str, float]:
    """What a clock waited for that waits `samples` from row `at` on; `swing` is row by row."""
    n = len(swing)
    waited = np.zeros(n)
    waited[at : at + samples] = PERIOD
    rate = np.where(waited > 0.0, 0.0, 1.0)
    table = log().slice(0, n)
    bearing = {f"{leg}_bearing": np.full(n, bears) for leg in SHORT_NAMES}
    changes = {"gait_waited": np.cumsum(waited), "gait_rate": rate, "swing_leg": np.array(swing)}
    return as_dict(summary(with_columns(table, **changes, **bearing))["clock_waited_for"])


def test_what_the_clock_waits_for_is_told_by_where_it_stands() -> None:
    """At a swing's end for the touchdown, on four feet for the lift-off, else for the recovery."""
    wait = 10 * PERIOD
    for swing, bears, reason in (
        ([1] * 25 + [0] * 15, False, "touchdown"),
        ([1] * 25 + [0] * 15, True, "touchdown"),  # the foot bears, but the controller is told late
        ([0] * 25 + [3] * 15, True, "lift_off"),
        ([1] * 25 + [3] * 15, False, "touchdown"),  # one leg lifts off as the other lands
        ([1] * 25 + [3] * 15, True, "lift_off"),
    ):
        found = waiting(at=15, samples=10, swing=swing, bears=bears)
        assert found.pop(reason) == pytest.approx(wait), (swing, bears)
        assert list(found.values()) == [0.0, 0.0]
    whole = summary(interrupted())
    parts = as_dict(whole["clock_waited_for"])
    assert parts["recovery"] == pytest.approx(whole["clock_waited"]) == pytest.approx(0.7)


@pytest.mark.parametrize(("ahead", "yaw"), [(0.0, 0.0), (-0.03, 0.002), (0.01, -0.05)])
def test_errors_of_the_estimate_are_its_distances_from_the_truth(ahead: float, yaw: float) -> None:
    """Place in metres and as a part of the way, heading and attitude in degrees."""
    found = as_dict(summary(estimated(log(), ahead=ahead, yaw=yaw))["estimate"])
    for key in ("drift", "position_error_max"):
        assert found[key] == pytest.approx(abs(ahead), abs=1e-9)
    assert found["drift_ratio"] == pytest.approx(abs(ahead) / found["way"], abs=1e-9)
    for key in ("yaw_error_max_deg", "attitude_error_max_deg"):
        assert found[key] == pytest.approx(np.degrees(abs(yaw)), abs=1e-6)
    assert found["slips_flagged"] == found["samples_unhealthy"] == 0
    assert summary(log())["estimate"] is None


def test_drift_is_that_at_the_end_and_the_greatest_error_that_of_any_time() -> None:
    """An error that comes and goes is no drift; flags are counted as they come."""
    table = estimated(log())
    x, slip = values("base_estimated_x", table), values("RL_slip_estimated", table)
    x[100] += 0.05
    slip[20:30] = slip[50:51] = True
    changes = {"base_estimated_x": x, "RL_slip_estimated": slip}
    found = as_dict(summary(with_columns(table, **changes))["estimate"])
    assert found["position_error_max"] == pytest.approx(0.05) and found["drift"] < 1e-9
    assert found["slips_flagged"] == 2


def test_the_way_is_walked_and_not_swayed() -> None:
    """That of each task from rest to rest, whatever the body does between; a stand has none."""
    c = {name: values(name) for name in log().column_names}
    x, y = (c[name] for name in base_columns()[1][:2])
    assert way_of(c) == pytest.approx(2.0, abs=1e-6)  # that much the plan walks, and sways
    assert np.sum(np.hypot(np.diff(x), np.diff(y))) > 2.2
    # There in one task and back in the next is twice the way, though it ends where it began.
    whole = {name: np.concatenate([column, column[::-1]]) for name, column in c.items()}
    whole["task"] = np.repeat([0, 1], len(x))
    assert way_of(whole) == pytest.approx(2 * np.hypot(x[-1] - x[0], y[-1] - y[0]))
    stand = as_dict(summary(estimated(log().slice(0, 40)))["estimate"])
    assert stand["drift_ratio"] is None


def test_the_load_is_told_in_kilograms_and_where_it_is() -> None:
    """5 kg 0.1 m ahead and 0.05 m to the left; next to nothing is nowhere."""
    table = estimated(log())
    found = as_dict(summary(table)["carried"])
    assert found["mass"] == pytest.approx(5.0)
    assert (found["ahead"], found["left"]) == (pytest.approx(0.1), pytest.approx(0.05))
    light = with_columns(table, carried_force=np.full(log().num_rows, 1.0))
    found = as_dict(summary(light)["carried"])
    assert found["ahead"] is None and found["left"] is None and found["moment_y"] == -4.905
    assert summary(log())["carried"] is None and summary(log())["qp_unsolved"] is None
    assert summary(table)["qp_unsolved"] == (log().num_rows - 1) // 100


def test_share_of_samples_with_the_pressure_inside() -> None:
    """Of the samples that have a margin; the edge counts as inside; without any there is none."""
    zmp = np.full(log().num_rows, 0.01)
    zmp[:10], zmp[10:15], zmp[15:20] = -0.01, 0.0, np.nan
    share = 1.0 - 10 / (log().num_rows - 5)
    assert summary(changed(zmp_margin=zmp))["zmp_inside"] == pytest.approx(share)
    assert summary(changed(zmp_margin=np.full(len(zmp), np.nan)))["zmp_inside"] is None


def test_a_plan_made_anew_begins_its_segments_anew() -> None:
    """Two recoveries in a row, both `recovery`, are two segments."""
    n = log().num_rows
    same = {"segment": np.array(["recovery"] * n, dtype=object), "task": np.zeros(n, dtype=int)}
    table = with_columns(log(), **same, plan_revision=(np.arange(n) > 300) + 1)
    first, second = as_list(summary(table)["segments"])
    assert first["end"] == pytest.approx(3.0) and second["start"] == pytest.approx(3.01)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, 3.0])
def test_angle_between_orientations(angle: float) -> None:
    """That of the turn from one to the other, about any axis, to the last digit near zero too."""
    a = quaternion_of(np.array([0.4]), np.array([-0.2]), np.array([2.0]))
    turn = AngleAxis(angle, np.array([0.6, 0.0, 0.8])).quaternion()
    b = turn.multiply(Quaternion(a[0] / np.linalg.norm(a[0]))).wxyz()[None]
    for sign in (1.0, -1.0):
        assert angle_between(a, sign * b)[0] == pytest.approx(angle, abs=1e-12)


def kicked(*, base: np.ndarray, pushes: list[float], failed: bool = False) -> list[dict[str, Any]]:
    """Figures of pushes of 0.3 m/s at these times, the base this far off its plan."""
    place = base_columns()[1][0]
    table = changed(**{place: values(place) + base})
    given = [
        Push(time=time, duration=0.1, force_H=(0.0, 180.0, 0.0), body="trunk", speed=0.3)
        for time in pushes
    ]
    return push_figures(table, given, failed=failed)


def test_a_push_is_recovered_from_when_the_base_is_back_and_stays() -> None:
    """0.4 s after a push of 0.1 s the base is calm for good: recovered, in 0.3 s."""
    t = values("t")
    off = np.where((t >= 2.0) & (t < 2.4), 0.08, 0.0)
    (found,) = kicked(base=off, pushes=[2.0])
    assert found["recovered"] is True
    assert found["recovery_time"] == pytest.approx(0.3, abs=2 * PERIOD)
    assert found["base_error_max"] == pytest.approx(0.08)
    assert (found["time"], found["duration"], found["speed"]) == (2.0, 0.1, 0.3)
    assert found["force"] == pytest.approx(180.0)
    (unmoved,) = kicked(base=0.0 * off, pushes=[2.0])
    assert unmoved["recovered"] is True and unmoved["recovery_time"] == 0.0


def test_a_push_that_the_robot_does_not_get_over_is_not_recovered_from() -> None:
    """Off to the end; calm but for the last moment; or a run that failed after it."""
    t = values("t")
    for off in (np.where(t >= 2.0, 0.08, 0.0), np.where(t >= t[-1] - 0.2, 0.08, 0.0)):
        (found,) = kicked(base=off, pushes=[2.0])
        assert found["recovered"] is False and found["recovery_time"] is None
    (found,) = kicked(base=0.0 * t, pushes=[2.0], failed=True)
    assert found["recovered"] is False


def test_each_push_is_judged_until_the_next() -> None:
    """What a second push does is not blamed on the first, nor a fall at the end."""
    t = values("t")
    off = np.where(t >= 4.0, 0.08, 0.0)
    first, second = kicked(base=off, pushes=[4.0, 2.0], failed=True)
    assert (first["time"], second["time"]) == (2.0, 4.0)
    assert first["recovered"] is True and second["recovered"] is False


def test_a_push_that_the_run_did_not_reach_is_not_judged() -> None:
    """A run that ended before has nothing to say of it; no pushes, no figures."""
    t = values("t")
    (found,) = kicked(base=0.0 * t, pushes=[t[-1] + 1.0], failed=True)
    assert [found[k] for k in ("base_error_max", "recovered", "recovery_time")] == [None] * 3
    assert kicked(base=0.0 * t, pushes=[]) == []
    json.dumps(found, allow_nan=False)
