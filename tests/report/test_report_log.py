"""Reading a run's files, and what follows from its log."""

import dataclasses
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from report_run import make_log, short_scenario, wave_begins, write_run

from drake_quad.errors import InputError
from drake_quad.report.axes import thin
from drake_quad.report.derived import base_motion, calc_foot_centres, margins, touchdowns
from drake_quad.report.figures_course import arc_length, distance_to, lane_starts
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog, runs_of
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario

FLOATS = st.floats(-1e3, 1e3) | st.just(float("nan"))


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    return make_log(short_scenario(), seconds=6.0, start=wave_begins() - 3.0, kinematic=True)


@pytest.fixture(scope="module")
def run(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return load_run(write_run(tmp_path_factory.mktemp("run"), log=log, simulation="kinematic"))


@given(st.lists(FLOATS, min_size=1, max_size=400), st.integers(4, 60))
def test_thinning_keeps_the_peaks_and_the_ends(values: list[float], most: int) -> None:
    """A thinned line has the least, the greatest, the first and the last of its samples."""
    t, y = np.arange(len(values), dtype=float), np.array(values)
    thin_t, thin_y = thin(t, y, most)
    assert len(thin_t) <= max(most, 4) + 2 or len(values) <= most
    assert np.all(np.diff(thin_t) > 0.0)
    assert thin_t[0] == t[0] and thin_t[-1] == t[-1]
    np.testing.assert_array_equal(thin_y, y[thin_t.astype(int)])
    if np.any(np.isfinite(y)):
        assert np.nanmin(thin_y) == np.nanmin(y) and np.nanmax(thin_y) == np.nanmax(y)


@given(st.lists(st.booleans(), max_size=50))
def test_runs_of_true_are_all_of_it(flags: list[bool]) -> None:
    """The stretches, put together again, are the flags, and no two of them touch."""
    found = runs_of(np.array(flags, dtype=bool))
    again = np.zeros(len(flags), dtype=bool)
    for first, past in found:
        again[first:past] = True
    assert again.tolist() == flags
    assert all(b[0] > a[1] for a, b in pairwise(found))


def test_a_missing_column_reads_as_not_known() -> None:
    """A log without a column gives nan, False or no word in its place, as many as samples."""
    log = RunLog({"t": np.arange(3.0), "FL_bearing": np.array([True, False, True])})
    assert np.all(np.isnan(log.number("margin"))) and log.vector("com").shape == (3, 3)
    assert log.flags("bearing")[:, 0].tolist() == [True, False, True]
    assert not log.flags("bearing")[:, 1:].any()
    assert log.text("segment") == ["", "", ""]


def test_bands_follow_one_another_over_the_whole_log(run: RecordedRun) -> None:
    """Segments share their ends, and the first and the last meet the log's."""
    bands = run.log.bands()
    assert len(bands) > 1
    assert bands[0].start == run.log.t[0] and bands[-1].end == run.log.t[-1]
    assert all(a.end == b.start for a, b in pairwise(bands))


def test_a_segment_walked_twice_is_two_bands() -> None:
    """Where one task ends and the next begins with a segment of the same name, it is cut."""
    log = RunLog(
        {"t": np.arange(4.0), "segment": np.array(["walk"] * 4, dtype=object), "task": [0, 0, 1, 1]}  # type: ignore[dict-item]
    )
    assert [(band.start, band.end) for band in log.bands()] == [(0.0, 2.0), (2.0, 3.0)]


def test_feet_of_a_robot_on_its_plan_are_where_the_plan_has_them(run: RecordedRun) -> None:
    """Forward kinematics of the logged joints gives the planned foot centres to 1e-6 m."""
    error = calc_foot_centres(run) - run.log.feet("desired")
    assert np.max(np.abs(error)) < 1e-6


def test_attitude_of_a_robot_on_its_plan_is_the_planned_one(run: RecordedRun) -> None:
    """Roll is zero, pitch and yaw are as planned."""
    rpy = base_motion(run).rpy
    planned = run.log.numbers(["base_desired_pitch", "base_desired_yaw"])
    assert np.max(np.abs(rpy[:, 0])) < 1e-9
    np.testing.assert_allclose(rpy[:, 1:], planned, atol=1e-9)


def test_footprints_are_on_the_ground(run: RecordedRun) -> None:
    """Every print lies on the course at the height of a foot that stands, one a stance."""
    prints = touchdowns(run)
    assert {p.row for p in prints} == {0, 1, 2, 3}
    places = np.array([p.p_WF for p in prints])
    ground = run.course.height(places[:, 0], places[:, 1])
    np.testing.assert_allclose(places[:, 2], ground, atol=1e-6)


def test_no_support_is_no_margin(run: RecordedRun) -> None:
    """The number that stands for no foot bearing does not count as a length."""
    columns = dict(run.log.columns)
    columns["margin"] = np.where(np.arange(len(run.log)) == 5, -9.0, columns["margin"])
    lost = dataclasses.replace(run, log=RunLog(columns))
    assert np.isnan(margins(lost)[5]) and np.isfinite(np.delete(margins(lost), 5)).all()


def test_from_the_side_a_straight_course_is_as_it_is(run: RecordedRun) -> None:
    """On one lane, how far along is x, and no foot is under the ground."""
    view = arc_length(run)
    com = run.log.vector("com")
    np.testing.assert_allclose(view.com, com[:, [0, 2]], atol=1e-12)
    feet = calc_foot_centres(run)
    ground = run.course.height(feet[..., 0], feet[..., 1])
    assert np.min(view.feet[..., 1] - ground) > -1e-6


@given(st.integers(0, 2), st.floats(0.0, 1.0), st.floats(-0.5, 0.5))
def test_a_point_beside_a_lane_is_as_far_as_its_lateral(lane: int, share: float, y: float) -> None:
    """Between a lane's ends the distance from it is |lateral|; lanes begin where others end."""
    course = course_of(TURNED)
    point = course.lanes[lane].point(share * course.lanes[lane].length, y)
    assert distance_to(course.lanes[lane], point[None])[0] == pytest.approx(abs(y), abs=1e-9)
    lengths = [each.length for each in course.lanes]
    np.testing.assert_allclose(np.diff(lane_starts(course)), lengths[:-1])


TURNED = parse_scenario(
    """
course:
  - {kind: floor, length: 3.0}
  - {kind: landing, length: 2.0, turn_deg: 90.0}
  - {kind: stairs, going: up, rise: 0.1, run: 0.4, count: 3}
  - {kind: landing, length: 2.0, turn_deg: -90.0}
  - {kind: floor, length: 2.0}
""",
    source="turned",
)


def test_a_directory_without_a_run_is_refused(tmp_path: Path) -> None:
    """The error names the directory and says what would be right, in one line."""
    for directory in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(InputError, match="drake-quad run") as caught:
            load_run(directory)
        assert str(directory) in str(caught.value) and "\n" not in str(caught.value)


def test_cut_files_make_notices_not_errors(tmp_path: Path, log: dict[str, Any]) -> None:
    """A log cut in the middle and a missing summary are said, and the scenario is still read."""
    write_run(tmp_path, log=log)
    whole = (tmp_path / "log.parquet").read_bytes()
    (tmp_path / "log.parquet").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "summary.json").unlink()
    run = load_run(tmp_path)
    assert len(run.log) == 0 and run.summary == {} and len(run.notices) == 2
    assert len(run.course.lanes) == 1


def test_every_leg_has_its_columns(log: dict[str, Any]) -> None:
    """The made-up log has what a run's log has for each foot (else these tests prove little)."""
    for leg in SHORT_NAMES:
        assert {f"{leg}_bearing", f"{leg}_force_z", f"{leg}_desired_x"} <= log.keys()
