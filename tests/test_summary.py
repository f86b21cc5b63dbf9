"""A run's figures: each is what one gets by hand from the log, and says when it cannot be had."""

import json
import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pydrake.math import RollPitchYaw
from rig import GRAVITY, flat_walk, model_layout, model_plant, paper_robot, stand_plan

from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.run_log import kinematic_logs, make_table, state_names
from drake_quad.summary import base_error, segment_figures, stances, summarize

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


def summary(table: pa.Table) -> dict[str, object]:
    return summarize(table, paper_robot())


def q_name(joint: str) -> str:
    return f"q_{paper_robot().name}_{joint}_q"


def base_columns() -> tuple[list[str], list[str]]:
    """Names of the base's quaternion and place."""
    names = log().column_names
    quaternion = [next(n for n in names if n.endswith(f"trunk_q{k}")) for k in "wxyz"]
    return quaternion, [next(n for n in names if n.endswith(f"trunk_{k}")) for k in "xyz"]


def test_a_run_just_as_planned_has_no_errors() -> None:
    """No base error, no slip, no waiting, all feet that should bear do."""
    found = summary(log())
    for key in ("base_error_max", "base_tilt_error_max_deg", "slip_max", "foot_roll_max"):
        assert found[key] == pytest.approx(0.0, abs=1e-5), key
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


def test_slip_is_the_way_slid_in_one_stance() -> None:
    """1 cm/s for 0.2 s is 2 mm, twice in one stance 4 mm, and nothing in the air."""
    speed, standing = values("FR_slip_speed"), values("FR_standing_planned")
    speed[10:30] = speed[40:60] = 0.01  # in the stand
    assert summary(changed(FR_slip_speed=speed))["slip_max"] == pytest.approx(0.004)
    in_air = np.where(standing, 0.0, 5.0)
    assert summary(changed(FR_slip_speed=in_air))["slip_max"] == 0.0


def test_roll_is_how_far_a_contact_moves_in_one_stance() -> None:
    """A contact that wanders by 3-4 mm has rolled 5 mm; a new stance begins anew."""
    x, y = values("RL_position_x"), values("RL_position_y")
    x[20:] += 0.003
    y[20:] += 0.004
    found = summary(changed(RL_position_x=x, RL_position_y=y))
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
    """docs/log_format.md has each of the summary's keys."""
    text = DOCS.read_text().split("## summary.json")[1]
    keys = set(re.findall(r"`([^`]+)`", text))
    assert [key for key in summary(log()) if key not in keys] == []
