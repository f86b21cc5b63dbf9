"""How far a run is from its plan, as the tolerances of the plan's certificate count it."""

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import flat_walk, paper_robot, stand_plan
from summary_rig import base_columns, changed, log, values

from drake_quad.certificate.tolerances import Tolerances
from drake_quad.common import FloatArray
from drake_quad.math.rotations import quaternion_of
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.log import columns_of
from drake_quad.runs.summary_lines import summary_lines
from drake_quad.runs.tracking import DRIFT, TOLERATED, track, tracking_figures

WITHIN = Tolerances(
    rise=0.005,
    body=0.006,
    tilt=np.radians(0.3),
    turn=np.radians(0.3),
    foot=0.004,
    swing=0.006,
    late=0.05,
)


def figures(**columns: np.ndarray) -> dict[str, Any]:
    found = tracking_figures(changed(**columns), paper_robot(), WITHIN)
    assert found is not None
    return found


def test_a_motion_just_as_planned_is_within_everything() -> None:
    """All distances are rounding's; nothing is left."""
    found = figures()
    assert max(found[name] for name in TOLERATED) < 1e-9
    assert found["left"] == [] and found["left_at"] is None
    assert tracking_figures(log().slice(0, 0), paper_robot(), WITHIN) is None


@pytest.mark.parametrize(("by", "left"), [(0.005, []), (0.007, ["body"])])
def test_a_body_off_its_plan_is_told_as_that(by: float, left: list[str]) -> None:
    """Beside its plan it is off, and so are its feet; with feet planned there, it alone."""
    _, places = base_columns()
    y = places[1]
    found = figures(**{y: values(y) + by})
    assert found["body_max"] == pytest.approx(by) and found["foot_max"] == pytest.approx(by)
    assert found["swing_max"] == pytest.approx(by)
    feet = {f"{leg}_desired_y": values(f"{leg}_desired_y") + by for leg in SHORT_NAMES}
    found = figures(**{y: values(y) + by, **feet})
    assert found["foot_max"] < 1e-9 and found["body_max"] == pytest.approx(by)
    assert found["left"] == left and (found["left_at"] is None) == (not left)
    assert found["share"] == pytest.approx(by / WITHIN.body)


PLANS = (stand_plan(0.5), flat_walk())


def test_a_run_is_held_against_the_plan_that_is_proven() -> None:
    """Not against what a controller made of it, which follows feet that slip or roll elsewhere."""
    wanted = [f"{leg}_desired_{k}" for leg in SHORT_NAMES for k in "xyz"]
    wanted += [f"base_desired_{k}" for k in ("x", "y", "z", "pitch", "yaw")]
    other = changed(**{name: values(name) + 0.01 for name in wanted})
    found = tracking_figures(other, paper_robot(), WITHIN, PLANS, PLANS)
    assert found is not None and found["left"] == []
    assert max(found[name] for name in TOLERATED) < 1e-9
    found = tracking_figures(other, paper_robot(), WITHIN)
    assert found is not None and found["body_max"] == pytest.approx(0.01)


def test_a_plan_made_anew_on_the_way_is_not_proven() -> None:
    """However near to it a run keeps: no share of the tolerances says that a proof holds."""
    copies = tuple(copy.copy(plan) for plan in PLANS)  # as a Context has them
    found = tracking_figures(log(), paper_robot(), WITHIN, copies, PLANS)
    assert found is not None and found["left"] == []
    found = tracking_figures(log(), paper_robot(), WITHIN, copies, PLANS[:1])
    assert found is not None and found["left"] == ["plan"] and found["share"] is None
    t, task = values("t"), values("task")
    assert found["left_at"] == pytest.approx(t[task == 1][0])


def test_the_plan_is_taken_at_the_time_of_the_sample() -> None:
    """The clock in a log is that of the end of a tick, until when a swing foot goes on."""
    t, period = values("t"), 0.02
    to_go = np.ceil(t / period - 1e-6) * period - t
    run = changed(gait_time=values("gait_time") + to_go)
    early, found = (
        tracking_figures(run, paper_robot(), WITHIN, PLANS, PLANS, p) for p in (0.0, period)
    )
    assert early is not None and found is not None
    assert early["swing_max"] > 0.005 and early["body_max"] > 0.0005
    assert max(found[name] for name in TOLERATED) < 1e-9


def test_ground_that_lifts_feet_and_body_alike_counts_for_nothing() -> None:
    """A robot that stands 5 cm higher than mapped, in the same pose, is on its plan."""
    _, places = base_columns()
    found = figures(**{places[2]: values(places[2]) + 0.05})
    assert max(found[name] for name in TOLERATED) < 1e-9 and found["share"] < 1e-6


def test_angles_are_of_their_own_axes() -> None:
    """A yaw of the plan's is turn alone, a pitch tilt alone; yaw may pass half a turn."""
    yaw = values("base_desired_yaw")
    found = figures(base_desired_yaw=yaw + np.radians(0.2) + 2.0 * np.pi)
    assert found["turn_max_deg"] == pytest.approx(0.2) and found["tilt_max_deg"] < 1e-6
    found = figures(base_desired_pitch=values("base_desired_pitch") - np.radians(0.4))
    assert found["tilt_max_deg"] == pytest.approx(0.4) and found["turn_max_deg"] < 1e-6
    assert found["left"] == ["tilt"]
    quaternion, _ = base_columns()
    rolled = quaternion_of(np.full_like(yaw, np.radians(0.5)), 0.0 * yaw, yaw)
    found = figures(**dict(zip(quaternion, rolled.T, strict=True)))
    assert found["tilt_max_deg"] == pytest.approx(0.5)


def test_a_foot_of_each_kind_has_its_own_tolerance() -> None:
    """A standing foot higher than it may be is told as `rise`, a swing foot as `swing`."""
    stands = values("FL_standing_planned").astype(bool)
    z = values("FL_desired_z")
    # The feet's mean height is what they share: of four feet one is off by three quarters.
    found = figures(FL_desired_z=z + 0.013 * stands)
    assert found["left"] == ["rise"] and found["foot_height_max"] == pytest.approx(0.013 * 0.75)
    assert figures(FL_desired_z=z + 0.008 * stands)["left"] == []  # 5 of the tread, 4 of the foot
    found = figures(FL_desired_z=z + 0.007 * ~stands)
    first = values("t")[np.flatnonzero(~stands)[0]]
    assert found["left"] == ["swing"] and found["left_at"] == pytest.approx(first)
    told = dict(summary_lines({"tracking": found}))
    assert told["tolerances asked of a certificate"] == f"left from {first:.2f} s on: swing"


def test_a_foot_that_bears_late_is_told_by_the_gait_clock() -> None:
    """By its time, that is: while the clock waits for the foot no time is lost."""
    stands, bears = (values(f"FL_{n}").astype(bool) for n in ("standing_planned", "bearing"))
    t, waited = values("t"), values("gait_waited")
    landing = int(np.flatnonzero(np.diff(stands.astype(int)) == 1)[0]) + 1
    missed = bears.copy()
    missed[landing : landing + 8] = False
    late = t[landing + 7] - t[landing - 1]
    found = figures(FL_bearing=missed)
    assert found["late_max"] == pytest.approx(late) and "late" in found["left"]
    stopped = waited + np.clip(t - t[landing], 0.0, t[landing + 7] - t[landing])
    found = figures(FL_bearing=missed, gait_waited=stopped)
    assert found["late_max"] == pytest.approx(t[landing] - t[landing - 1])


def test_a_robot_on_fewer_than_three_feet_is_beyond_all_tolerances() -> None:
    """However near to its plan it is: no proof is of two feet."""
    bears = values("RL_bearing").astype(bool)
    swings = ~values("FL_standing_planned").astype(bool)
    lost = bears.copy()
    first = int(np.flatnonzero(swings)[2])
    lost[first] = False
    found = figures(RL_bearing=lost)
    assert found["left"] == ["support"] and found["share"] is None
    assert found["left_at"] == pytest.approx(values("t")[first])
    told = dict(summary_lines({"tracking": found}))
    assert "support" in told["tolerances asked of a certificate"]


@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_what_the_whole_robot_is_off_along_the_ground_is_drift(
    x: float, y: float, yaw: float
) -> None:
    """Turned by some angle and moved, in the same pose, it is on its plan; it drifted so far."""

    def moved(p: FloatArray) -> FloatArray:
        c, s = np.cos(yaw), np.sin(yaw)
        return np.stack([x + c * p[0] - s * p[1], y + s * p[0] + c * p[1]])

    quaternion, places = base_columns()
    pitch, heading = values("base_desired_pitch"), values("base_desired_yaw")
    turned = quaternion_of(0.0 * pitch, pitch, heading + yaw)
    base = moved(np.stack([values(name) for name in places[:2]]))
    names = (*quaternion, *places[:2])
    columns = dict(zip(names, (*turned.T, *base), strict=True))
    found = track(columns_of(changed(**columns)), paper_robot(), (), 0.0, drifts=True)
    assert max(found[name].max() for name in TOLERATED) < 1e-6
    feet = np.stack([[values(f"{leg}_desired_{k}") for leg in SHORT_NAMES] for k in "xy"])
    assert np.all(found[DRIFT] >= np.linalg.norm(moved(feet) - feet, axis=0).max(axis=0) - 1e-9)
