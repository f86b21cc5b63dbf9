"""Plans on a map that was seen are proven for all stairs that the map takes for possible."""

import copy
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from drake_quad.cli.runs import belief_lines
from drake_quad.common import FloatArray
from drake_quad.planning.clearance import shank_clearance
from drake_quad.planning.motion_plan import evaluate
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.result import RunResult
from drake_quad.runs.seen import seen_figures
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.belief_proof import (
    believed_box,
    hold_against,
    inside_box,
    prove_believed,
    stretches_of,
)
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.simulation.run import replay_plan
from drake_quad.terrain.course import Course, build_course

TEXT = """
course:
  - {kind: floor, length: 2.3}
  - {kind: stairs, going: up, rise: 0.13, run: 0.5, count: 3}
  - {kind: landing, length: 3.0}
start: {distance: 1.0}
gait: {swing_clearance: 0.04, shank_room: 0.04}
controller: {kind: whole_body, period: 0.002}
monitor: {margins: hull}
perception: {map: seen, look_time: 0.5, camera_hold: portrait, camera_pitch_deg: 35.0}
simulation: {seed: 1}  # with seed 0 a tread is 1.2 times its 95 % interval off, as 5 of 100 may be
"""


@cache
def seen() -> PreparedScenario:
    """A robot that has looked at three steps."""
    return prepare(parse_scenario(TEXT, source="test"), source="test")


def moved(world: Course, *, run: float, rise: float) -> Course:
    """The map's course with its first riser elsewhere and all treads higher [m]."""
    known = seen().sight.map  # type: ignore[union-attr]
    assert known is not None
    floor, stairs, *rest = known.elements
    assert floor.length is not None and stairs.rises is not None
    rises = [stairs.rises[0] + rise, *stairs.rises[1:]]
    elements = (replace(floor, length=floor.length + run), replace(stairs, rises=rises), *rest)
    course = build_course(elements, foot_radius=seen().robot.foot_radius)
    return course


def test_a_plan_is_proven_for_the_whole_box() -> None:
    """Static margin, clearances and footholds hold for every stair in the 95 % intervals."""
    p = seen()
    (told,) = prove_believed(p, p.plan.plans)
    assert told["inside"] and told["proven"] and told["share"] >= 0.0
    assert told["place"] > 0.003 and told["height"] > 0.002
    assert 0.03 < told["proven"]["margin"] <= p.plan.plans[1].margin
    assert all(told["proven"][name] > 0.0 for name in ("shank_clearance", "foothold_room"))
    (line, *_) = belief_lines([told])
    assert f"risers within {1e3 * told['place']:.1f} mm" in line


@pytest.mark.parametrize(("run", "rise"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (1.0, -1.0)])
def test_shanks_keep_what_is_proven_at_the_ends_of_the_box(run: float, rise: float) -> None:
    """Of stairs at the box's ends the plan's own shanks are as far off as was proven."""
    p = seen()
    (told,), (stretch,) = prove_believed(p, p.plan.plans), stretches_of(p, p.plan.plans)
    place, height = believed_box(stretch.map)
    lane = moved(p.world, run=run * place, rise=rise * height).lanes[0]
    plan = stretch.plans[1]
    samples = evaluate(p.robot, plan, np.linspace(0.0, plan.duration, 400))
    feet = samples.feet
    mapped = stretch.course.lanes[0]
    lane = replace(lane, p_WL=mapped.p_WL, yaw=mapped.yaw)
    found = shank_clearance(p.robot, lane, samples.body[:, 0], feet, samples.q)
    assert found.min() >= told["proven"]["shank_clearance"]


def test_stairs_outside_the_box_are_told_as_such() -> None:
    """Of a world whose treads are 20 mm higher than seen the box is not true."""
    p = seen()
    known = stretches_of(p, p.plan.plans)[0].map
    assert inside_box(known, p.world)
    assert not inside_box(replace(known, heights=known.heights + 0.02), p.world)
    assert not inside_box(replace(known, places=known.places + 0.05), p.world)


def test_a_box_that_is_too_large_is_not_proven_and_says_why() -> None:
    """With places known to 0.15 m a shank or a foot may be in the stairs."""
    p = seen()
    assert p.sight is not None and p.sight.map is not None
    vague = replace(p, sight=replace(p.sight, map=replace(p.sight.map, error_place=0.15)))
    (told,) = prove_believed(vague, vague.plan.plans)
    assert not told["proven"] and told["reason"]
    assert belief_lines([told])[0].startswith("not for all stairs")


@cache
def replayed() -> RunResult:
    """A replay of its plan."""
    return replay_plan(seen())


@cache
def proven() -> list[dict[str, Any]]:
    """What is proven of its plan."""
    return prove_believed(seen(), seen().plan.plans)


def with_more(table: pa.Table, name: str, by: float) -> pa.Table:
    """The log with more in the column whose name ends so."""
    full = next(n for n in table.column_names if n.endswith(name))
    return table.set_column(*_column(table, full, table[full].to_numpy() + by))


def held(table: pa.Table | None = None, **changes: Any) -> dict[str, Any]:
    """What a replay of the plan shows of its proof, had it been a run on stairs just as mapped.

    Args:
        table: Its log, if that is to be another one.
        changes: What is to be otherwise in what was prepared.
    """
    mapped = stretches_of(seen(), seen().plan.plans)[0].course
    p, log = replace(seen(), **{"world": mapped, **changes}), replayed().table
    assert proven()[0]["share"] > 0.0
    (told,) = hold_against(proven(), p, p.plan.plans, log if table is None else table, period=0.0)
    return told


def test_a_motion_that_is_the_plan_is_covered_and_has_the_proven_margin() -> None:
    """It is off by nothing; its least margin is no less than the proven one."""
    told = held()
    assert told["covered"] is True and told["kept"] is True
    assert told["drift"] < 1e-9 and told["run_share"] < 0.01
    assert told["margin"] >= told["proven"]["margin"]


def test_a_robot_that_is_elsewhere_as_a_whole_is_on_a_map_that_is_as_much_off() -> None:
    """As long as the stairs are in the box from there, the proof is about the run."""
    place, _ = believed_box(stretches_of(seen(), seen().plan.plans)[0].map)
    log = replayed().table
    for ahead, covered in ((0.9 * place, True), (-1.1 * place, False)):
        told = held(with_more(log, "trunk_x", ahead))
        assert told["drift"] == pytest.approx(abs(ahead)) and told["run_share"] < 0.01
        assert told["covered"] is covered


def test_a_run_farther_off_its_plan_than_was_proven_is_not_covered() -> None:
    """With a foot some cm elsewhere the proof says nothing of it, whatever its margin."""
    told = held(with_more(replayed().table, "FL_knee_q", 0.05))
    assert told["run_share"] > 1.0 and told["covered"] is False and told["kept"] is None


def test_a_robot_that_carries_a_load_is_not_covered() -> None:
    """The proof is about a robot as its file says: its mass, where that is, and its drives."""
    light = {"payload_mass": 0.5 * seen().robot.mass, "mass_factor": 0.5}
    weak = {"motor_strength": {seen().robot.joint_names[0]: 0.5}}
    for change in ({"payload_mass": 1.0}, {"com_offset": (0.01, 0.0, 0.0)}, light, weak):
        loaded = replace(seen().disturbances, **change)
        assert held(disturbances=loaded)["covered"] is False


def test_a_run_on_a_plan_that_was_made_anew_is_not_covered() -> None:
    """No proof is of that plan; nor of a run that stands on two feet."""
    log = replayed().table
    anew = log.set_column(*_column(log, "plan_revision", np.ones(log.num_rows)))
    assert held(anew)["run_share"] is None and held(anew)["covered"] is False
    for leg in ("FL", "FR"):
        log = log.set_column(*_column(log, f"{leg}_bearing", np.zeros(log.num_rows)))
    assert held(log)["run_share"] is None and held(log)["covered"] is False


def test_a_robot_that_is_higher_as_a_whole_sees_all_stairs_lower() -> None:
    """On stairs as mapped it may be so by what treads may be off, and by no more."""
    _, height = believed_box(stretches_of(seen(), seen().plan.plans)[0].map)
    log = replayed().table
    for up, covered in ((0.0, True), (0.05, False), (-1.5 * height, False)):
        told = held(with_more(log, "trunk_z", up))
        assert told["covered"] is covered


def test_stairs_are_in_the_box_at_both_sides_and_to_their_end() -> None:
    """Not if they are turned, too narrow for the feet, or have a further step."""
    known = stretches_of(seen(), seen().plan.plans)[0].map
    place, _ = believed_box(known)
    course = known.course(foot_radius=0.02)
    assert inside_box(known, course, reach=0.35)
    turned = replace(known, yaw=known.yaw + 1.5 * place / 0.35)
    assert inside_box(turned, course) and not inside_box(turned, course, reach=0.35)
    floor, stairs, landing = known.elements
    narrow = replace(known, elements=(floor, replace(stairs, width=0.8), landing))
    assert not inside_box(known, narrow.course(foot_radius=0.02), reach=0.45)
    assert stairs.rises is not None and stairs.runs is not None
    more = replace(stairs, rises=[*stairs.rises, 0.1], runs=[*stairs.runs, 0.4])
    longer = replace(known, elements=(floor, more, landing))
    assert not inside_box(known, longer.course(foot_radius=0.02))


def test_tolerances_of_nothing_are_left_by_anything() -> None:
    """And a run that has none of it keeps within them: no figure is divided by nothing."""
    strict = copy.deepcopy(seen().scenario)
    strict.certify.tolerances.late = 0.0
    assert held(scenario=strict)["covered"] is True
    strict.certify.tolerances.foot = 0.0
    off = with_more(replayed().table, "FL_knee_q", 0.001)
    assert held(off, scenario=strict)["run_share"] is None
    assert held(replayed().table.slice(0, 0))["covered"] is False


def test_of_times_at_which_a_foot_does_not_bear_that_is_to_stand_nothing_is_proven() -> None:
    """They are told, and what margin there was then is no matter of the proof."""
    log = replayed().table
    bears = log["RR_bearing"].to_numpy().astype(float).copy()
    stands = np.stack([log[f"{leg}_standing_planned"].to_numpy() for leg in SHORT_NAMES]) > 0.5
    at = int(np.flatnonzero(stands.all(axis=0))[-20])
    bears[at] = 0.0
    margin = log["margin"].to_numpy().copy()
    margin[at] = -0.01
    log = log.set_column(*_column(log, "RR_bearing", bears))
    log = log.set_column(*_column(log, "margin", margin))
    told = held(log)
    period = float(np.median(np.diff(log["t"].to_numpy())))
    assert told["unproven_time"] == pytest.approx(period) and held()["unproven_time"] == 0.0
    assert told["covered"] is True and told["kept"] is True and told["margin"] < 0.0


def test_a_covered_run_with_less_margin_than_was_proven_is_a_violation() -> None:
    """It is told as one, and the summary's verdict is no."""
    log = replayed().table
    told = held(log.set_column(*_column(log, "margin", log["margin"].to_numpy() - 0.05)))
    assert told["covered"] is True and told["kept"] is False
    assert _verdict([told]) == (1, False) and _verdict([held(), told]) == (2, False)
    assert _verdict([held()]) == (1, True)
    assert _verdict([{**held(), "covered": False, "kept": None}]) == (0, None)


def _column(table: pa.Table, name: str, values: FloatArray) -> tuple[int, str, pa.Array]:
    """What `set_column` takes for other values of a column."""
    return table.column_names.index(name), name, pa.array(values)


def _verdict(proofs: list[dict[str, Any]]) -> tuple[int, bool | None]:
    told = replayed().seen
    assert told is not None
    figures = seen_figures({**told.told, "proofs": proofs})
    return figures["box_covered"], figures["box_kept"]


def test_a_replay_has_the_proof_among_its_figures() -> None:
    """And seen.json has it for each stretch."""
    result = replayed()
    figures = result.summary["seen"]
    assert figures["box_proven"] is True and figures["box_inside"] is True
    assert figures["box_margin"] > 0.03
    assert figures["box_covered"] == 0 and figures["box_kept"] is None  # nothing was measured
    assert result.seen is not None and len(result.seen.told["proofs"]) == 1
