"""Plans on a map that was seen are proven for all stairs that the map takes for possible."""

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


def with_more(table: pa.Table, name: str, by: float) -> pa.Table:
    """The log with more in the column whose name ends so."""
    full = next(n for n in table.column_names if n.endswith(name))
    return table.set_column(*_column(table, full, table[full].to_numpy() + by))


def held(table: pa.Table | None = None, **changes: Any) -> dict[str, Any]:
    """What a replay of the plan shows of its proof.

    Args:
        table: Its log, if that is to be another one.
        changes: What is to be otherwise in what was prepared.
    """
    p, log = replace(seen(), **changes), replay_plan(seen()).table
    proofs = prove_believed(p, p.plan.plans)
    assert proofs[0]["share"] > 0.0
    (told,) = hold_against(proofs, p, p.plan.plans, log if table is None else table, period=0.0)
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
    log = replay_plan(seen()).table
    for ahead, covered in ((0.1 * place, True), (-place, False)):
        told = held(with_more(log, "trunk_x", ahead))
        assert told["drift"] == pytest.approx(abs(ahead)) and told["run_share"] < 0.01
        assert told["covered"] is covered


def test_a_run_farther_off_its_plan_than_was_proven_is_not_covered() -> None:
    """With a foot some cm elsewhere the proof says nothing of it, whatever its margin."""
    told = held(with_more(replay_plan(seen()).table, "FL_knee_q", 0.05))
    assert told["run_share"] > 1.0 and told["covered"] is False and told["kept"] is None


def test_a_robot_that_carries_a_load_is_not_covered() -> None:
    """The proof is about a robot as heavy as its file says, and with its centre of mass there."""
    for change in ({"payload_mass": 1.0}, {"com_offset": (0.01, 0.0, 0.0)}):
        loaded = replace(seen().disturbances, **change)
        assert held(disturbances=loaded)["covered"] is False


def test_a_run_on_a_plan_that_was_made_anew_is_not_covered() -> None:
    """No proof is of that plan; nor of a run that stands on two feet."""
    log = replay_plan(seen()).table
    anew = log.set_column(*_column(log, "plan_revision", np.ones(log.num_rows)))
    assert held(anew)["run_share"] is None and held(anew)["covered"] is False
    for leg in ("FL", "FR"):
        log = log.set_column(*_column(log, f"{leg}_bearing", np.zeros(log.num_rows)))
    assert held(log)["run_share"] is None and held(log)["covered"] is False


def test_a_covered_run_with_less_margin_than_was_proven_is_a_violation() -> None:
    """It is told as one, and the summary's verdict is no."""
    log = replay_plan(seen()).table
    told = held(log.set_column(*_column(log, "margin", log["margin"].to_numpy() - 0.05)))
    assert told["covered"] is True and told["kept"] is False
    assert _verdict([told]) == (1, False) and _verdict([held(), told]) == (2, False)
    assert _verdict([held()]) == (1, True)
    assert _verdict([{**held(), "covered": False, "kept": None}]) == (0, None)


def _column(table: pa.Table, name: str, values: FloatArray) -> tuple[int, str, pa.Array]:
    """What `set_column` takes for other values of a column."""
    return table.column_names.index(name), name, pa.array(values)


def _verdict(proofs: list[dict[str, Any]]) -> tuple[int, bool | None]:
    told = replay_plan(seen()).seen
    assert told is not None
    figures = seen_figures({**told.told, "proofs": proofs})
    return figures["box_covered"], figures["box_kept"]


def test_a_replay_has_the_proof_among_its_figures() -> None:
    """And seen.json has it for each stretch."""
    result = replay_plan(seen())
    figures = result.summary["seen"]
    assert figures["box_proven"] is True and figures["box_inside"] is True
    assert figures["box_margin"] > 0.03
    assert figures["box_covered"] == 1 and figures["box_kept"] is True
    assert result.seen is not None and len(result.seen.told["proofs"]) == 1
