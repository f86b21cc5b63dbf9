"""Proofs within tolerances: whatever is drawn within them, the proven figures hold."""

from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from certificate_rig import paper_shank, prepared
from rig import paper_robot

from drake_quad.certificate.cells import cut_pieces
from drake_quad.certificate.clearance import find_footholds
from drake_quad.certificate.obstacles import find_box_obstacles
from drake_quad.certificate.robust import (
    STEPS,
    RobustProof,
    first_beyond_edge,
    foothold_room,
    prove_within,
)
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.cli.runs import certificate_lines
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.planning.clearance import shank_clearance
from drake_quad.planning.motion_plan import evaluate
from drake_quad.robot.kinematics import (
    calc_com,
    calc_feet,
    calc_holding,
    calc_jacobians,
    calc_knees,
    solve_legs,
)
from drake_quad.robot.model import SHANK_POINTS
from drake_quad.scenario.load import load_scenario, parse_scenario
from drake_quad.simulation.plan_report import certify_plan, tolerances_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.stability.support_polygon import stability_margin

NAMES = ("case_study", "descend", "spin_both_ways")


def tolerances() -> Tolerances:
    """Those of the shipped scenarios."""
    p = prepared("case_study")
    return tolerances_of(p.scenario.certify.tolerances, p.robot)


@cache
def proven(name: str) -> RobustProof:
    """What holds of a shipped scenario's plan within its tolerances."""
    p = prepared(name)
    return prove_within(p.robot, paper_shank(), p.plan.plans, p.course.boxes, tolerances())


@cache
def told_of_case_study() -> dict[str, Any]:
    """What `plan` tells of the case study's certificate."""
    told, _ = certify_plan(prepared("case_study"))
    return told


@cache
def without_tolerances() -> RobustProof:
    """What holds of the plan down the stairs where nothing is off."""
    p = prepared("descend")
    return prove_within(p.robot, paper_shank(), p.plan.plans, p.course.boxes, Tolerances())


def turned(roll: float, pitch: float, yaw: float) -> FloatArray:
    """B's axes in W: yaw about z, then pitch about y, then roll about x."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def from_box(points: FloatArray, middle: FloatArray, half: FloatArray) -> FloatArray:
    """Distances of points (K, 3) from an upright box along W's axes [m], negative inside."""
    beyond = np.abs(points - middle) - half
    inside = np.minimum(beyond.max(axis=1), 0.0)
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + inside)


def nearest_times(p: PreparedScenario, count: int) -> list[tuple[int, float]]:
    """Task and time of so many moments at which a shank is planned to be nearest to the stairs."""
    found = []
    for task, plan in enumerate(p.plan.plans):
        s = evaluate(p.robot, plan, np.arange(0.0, plan.duration, 0.05))
        lane = p.course.lanes[p.tasks[task].lane]
        room = shank_clearance(p.robot, lane, s.body[:, 0], s.feet, s.q).reshape(len(s.times), -1)
        found += [
            (float(r), task, float(t)) for r, t in zip(room.min(axis=1), s.times, strict=True)
        ]
    return [(task, time) for _, task, time in sorted(found)[:count]]


@pytest.mark.parametrize("name", NAMES)
def test_nothing_that_is_drawn_within_them_is_below_what_is_proven(name: str) -> None:
    """Body, feet, masses and stairs are off by as much as is allowed, at 1600 times.

    Every second time is one of those at which a shank is planned to be nearest to the stairs.

    Margins, joints, torques on three feet, and shanks are computed without enclosures.
    The least of these is not far above what is proven, either: the proof does not give much away.
    """
    p, found, rng = prepared(name), proven(name), np.random.default_rng(4)
    robot, within, figures = p.robot, found.asked.scaled(found.share), found.figures
    least = dict.fromkeys(figures, np.inf)

    def off(size: float, *shape: int) -> FloatArray:
        """Anything within a tolerance; its ends more often than not."""
        return np.asarray(size * np.clip(rng.uniform(-2.0, 2.0, shape), -1.0, 1.0))

    def aside(size: float) -> FloatArray:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        return size * rng.uniform(0.5, 1.0) * np.array([np.cos(angle), np.sin(angle)])

    boxes = [(box.centre, 0.5 * box.size) for box in p.course.boxes if box.yaw == 0.0]
    near = nearest_times(p, 60)
    for k in range(1600):
        plan = p.plan.plans[rng.integers(len(p.plan.plans))]
        time = float(rng.uniform(0.0, plan.duration))
        if k % 2:
            task, time = near[rng.integers(len(near))]
            plan = p.plan.plans[task]
        s = evaluate(robot, plan, np.array([time]))
        body, feet, standing = s.body[0, 0], s.feet[0].copy(), s.standing[0]
        for leg in range(4):
            if standing[leg]:
                feet[leg, :2] += aside(within.foot)
                feet[leg, 2] += off(within.foot + within.rise, 1)[0]
            else:
                way = rng.normal(size=3)
                feet[leg] += within.swing * way / np.linalg.norm(way)
        place = body[:3] + off(within.body, 3)
        R = turned(float(off(within.tilt, 1)[0]), body[3] + off(within.tilt, 1)[0],
                   body[4] + off(within.turn, 1)[0])  # fmt: skip
        q, _ = solve_legs(robot.geometry, (feet - place) @ R)
        assert np.allclose(calc_feet(robot.geometry, q), (feet - place) @ R, atol=1e-9)
        com = (place + R @ calc_com(robot, q))[:2] + aside(within.com)
        least["margin"] = min(least["margin"], stability_margin(com, feet[standing, :2]))
        flat = q.reshape(12)
        room = np.minimum(flat - robot.q_lower, robot.q_upper - flat).min()
        least["joint_room"] = min(least["joint_room"], float(room))
        if standing.sum() == 3:
            balance = np.vstack([np.ones(3), feet[standing, :2].T])
            shares = np.zeros(4)
            shares[standing] = np.linalg.solve(balance, [1.0, *com])
            mass = 1.0 + within.mass
            up = R.T @ np.array([0.0, 0.0, 1.0])
            force = shares[:, None] * (robot.mass * GRAVITY) * up
            tau = calc_holding(robot, q, up)
            tau = tau - np.einsum("lij,li->lj", calc_jacobians(robot.geometry, q), force)
            torque = 1.0 - mass * np.abs(tau).reshape(12) / robot.effort
            least["torque_room"] = min(least["torque_room"], float(torque.min()))
        shift = np.array([*aside(within.run), off(within.rise, 1)[0]])
        knees = place + calc_knees(robot.geometry, q) @ R.T
        along = np.asarray(SHANK_POINTS)[:, None]
        for middle, half in boxes:
            for leg in range(4):
                # No foot is in what it is above of, or dips deeper into what it stands on.
                beside = np.abs(feet[leg] - middle - shift)[:2] - half[:2]
                dips = middle[2] + shift[2] + half[2] - (feet[leg, 2] - robot.foot_radius)
                if beside.max() < 0.0 and dips > (within.foot if standing[leg] else 0.0):
                    continue
                shank = (1.0 - along) * knees[leg] + along * feet[leg]
                away = from_box(shank, middle + shift, half) - robot.shank_radii[leg]
                least["shank_clearance"] = min(least["shank_clearance"], float(away.min()))
    tight = {"margin": 0.025, "joint_room": 0.25, "torque_room": 0.12, "shank_clearance": 0.02}
    for figure, slack in tight.items():
        assert figures[figure] <= least[figure] + 1e-9, figure
        assert least[figure] <= figures[figure] + slack, figure


@pytest.mark.parametrize("name", [f.name for f in fields(Tolerances)])
def test_each_tolerance_takes_something(name: str) -> None:
    """With one of them alone some figure is less than without; half of it takes half or less."""
    p = prepared("descend")
    given = (p.robot, paper_shank(), p.plan.plans, p.course.boxes)
    some = replace(Tolerances(), **{name: getattr(tolerances(), name)})
    none = without_tolerances().figures
    half, whole = (prove_within(*given, some.scaled(k)).figures for k in (0.5, 1.0))
    less = {figure: none[figure] - whole[figure] for figure in none}
    assert max(less.values()) > 4e-4 and min(less.values()) >= -4e-3
    most = max(less, key=lambda figure: less[figure])
    assert -1e-3 <= none[most] - half[most] <= 0.6 * less[most] + 2e-3


@pytest.mark.parametrize("name", ["case_study", "quick"])
def test_feet_that_are_late_are_not_counted_on(name: str) -> None:
    """Until a foot has borne the other three hold the robot, with the margin that is proven."""
    p, found = prepared(name), proven(name)
    late = found.asked.scaled(found.share).late
    assert late > 0.01
    least = np.inf
    for plan in p.plan.plans:
        lifts = [step.lift_off for step in plan.contacts.steps]
        for step in plan.contacts.steps:
            after = [t for t in lifts if t > step.touchdown - 1e-9]
            until = min([step.touchdown + late, *after, plan.duration])
            s = evaluate(p.robot, plan, np.linspace(step.touchdown, until - 1e-6, 5))
            others = np.arange(4) != step.leg.row
            for com, feet in zip(s.com, s.feet, strict=True):
                least = min(least, stability_margin(com[:2], feet[others, :2]))
    assert least >= found.figures["margin"]
    # Much later than that a foot is needed: so it is not counted on for longer.
    (one,) = {len(cut_pieces(p.plan.plans).start)}
    assert len(cut_pieces(p.plan.plans, late).start) > one


def test_where_not_all_holds_the_greatest_share_is_told() -> None:
    """A twentieth more of the tolerances fails; what fails first within all is named."""
    p = prepared("case_study")
    given = (p.robot, paper_shank(), p.plan.plans, p.course.boxes)
    found = prove_within(*given, tolerances().scaled(2.0))
    assert 0.0 < found.share < 1.0 and found.failure is not None
    assert found.failure.reason and min(found.figures.values()) >= 0.0
    assert found.fails_at is not None
    assert found.fails_at == pytest.approx(found.share + 1.0 / STEPS)
    more = found.asked.scaled(found.fails_at)
    again = prove_within(*given, more)
    assert again.share < 1.0 and again.failure is not None


def test_a_plan_that_keeps_its_shanks_away_holds_within_all() -> None:
    """Without tolerances of the stairs the case study's plan holds, and it is told by `plan`."""
    p = prepared("case_study")
    stairs = replace(p.scenario.certify.tolerances, rise=0.0, run=0.0, body=0.004)
    certify = replace(p.scenario.certify, tolerances=stairs)
    told, _ = certify_plan(replace(p, scenario=replace(p.scenario, certify=certify)))
    robust = told["tolerances"]
    assert robust["share"] == 1.0 and robust["reason"] == "" and robust["time"] is None
    assert all(value >= 0.0 for value in robust["proven"].values())
    assert robust["proven"]["margin"] < told["proven"]["margin"] - 0.02


def test_feet_beyond_the_edge_of_their_tread_are_told() -> None:
    """A foothold that may be off by more than its distance from the nosing is no proof."""
    p = prepared("descend")
    pieces, obstacles = cut_pieces(p.plan.plans), find_box_obstacles(p.course.boxes)
    room = float(foothold_room(pieces, obstacles, p.robot.foot_radius).min())
    assert 0.0 < room < 0.3
    rooms = foothold_room(pieces, obstacles, p.robot.foot_radius)
    assert first_beyond_edge(pieces, rooms - 0.9 * room) is None
    told = first_beyond_edge(pieces, rooms - 1.1 * room)
    assert told is not None and -0.1 * room - 1e-9 <= told.value <= 0.0
    plan = p.plan.plans[told.task]
    feet, standing = plan.contacts.feet_at(np.array([told.time + 1e-6]))
    levels = np.array([box.top for box in p.course.boxes])
    edges = np.array([[b.centre[0] - 0.5 * b.size[0], b.centre[0] + 0.5 * b.size[0]]
                      for b in p.course.boxes])  # fmt: skip
    ground = feet[0, :, 2] - p.robot.foot_radius
    on = np.abs(levels - ground[:, None]) < 1e-6
    away = np.where(on[..., None], np.abs(edges - feet[0, :, :1, None]), np.inf).min(axis=(1, 2))
    assert away[standing[0]].min() == pytest.approx(1.1 * room + told.value, abs=5e-3)


def test_distances_of_an_arbitrary_robot_grow_with_its_legs() -> None:
    """What a scenario does not give is a share of the leg's length."""
    robot = paper_robot()
    asked = tolerances_of(load_scenario("case_study").certify.tolerances, robot)
    given = load_scenario("case_study", ["certify.tolerances.body=0.02"]).certify.tolerances
    assert asked.body == pytest.approx(0.005 * 1.22, rel=0.01)
    assert tolerances_of(given, robot).body == 0.02


FLIGHT = """
course:
  - {kind: floor, length: 4.5, width: 2.0}
  - {kind: stairs, going: up, rise: RISE, run: 0.5, count: 3, width: 2.0}
  - {kind: floor, length: 3.5, width: 2.0}
start: {distance: 1.25}
gait: {swing_clearance: CLEARANCE, tread_phase_up: PHASE}
"""


@pytest.mark.parametrize(
    ("rise", "clearance", "phase"), [(0.04, 0.08, 0.37), (0.06, 0.08, 0.35), (0.10, 0.06, 0.33)]
)
def test_swing_feet_beside_steps_are_as_far_as_is_proven(
    rise: float, clearance: float, phase: float
) -> None:
    """Of feet that come down close before the next step, or after the last: boxes and spheres.

    What is not owed to a step is decided by distances within tolerances, not by those of the plan.
    """
    text = FLIGHT.replace("RISE", str(rise)).replace("CLEARANCE", str(clearance))
    p = prepare(parse_scenario(text.replace("PHASE", str(phase)), source="test"))
    robot, shank = p.robot, paper_shank()
    found = prove_within(robot, shank, p.plan.plans, p.course.boxes, tolerances())
    within, claimed = found.asked.scaled(found.share), found.figures["foot_clearance"]
    more = np.array([within.run, within.run, within.rise])  # each box may be off by so much
    pieces, obstacles = cut_pieces(p.plan.plans), find_box_obstacles(p.course.boxes)
    footholds = find_footholds(pieces, obstacles, robot.foot_radius)
    for k in np.flatnonzero(pieces.swing >= 0):
        plan, leg, phase_of = p.plan.plans[pieces.task[k]], pieces.swing[k], pieces.phase[k]
        times = np.linspace(pieces.start[k], pieces.end[k], 15)
        foot = evaluate(robot, plan, times).feet[:, leg]
        for m, box in enumerate(p.course.boxes):
            rule = footholds.owed(np.array([phase_of]), np.array([m]))
            if rule.own[0]:
                continue
            away = from_box(foot, box.centre, 0.5 * box.size + more)
            away -= robot.foot_radius + within.swing
            assert away.min() >= min(claimed, rule.half[0]) - 1e-9


def test_standing_feet_near_the_next_step_are_told() -> None:
    """A sphere that may be in a riser is no foothold, however far the edges are."""
    text = FLIGHT.replace("RISE", "0.04").replace("CLEARANCE", "0.08").replace("PHASE", "0.38")
    p = prepare(parse_scenario(text, source="test"))
    pieces, obstacles = cut_pieces(p.plan.plans), find_box_obstacles(p.course.boxes)
    room = foothold_room(pieces, obstacles, p.robot.foot_radius)
    gaps = []
    for k, leg in np.argwhere(pieces.standing):
        foot = pieces.feet[k, leg]
        for box in p.course.boxes:
            if box.top > foot[2] - p.robot.foot_radius + 1e-6:
                gap = from_box(foot[None], box.centre, 0.5 * box.size)[0] - p.robot.foot_radius
                assert room[k, leg] <= gap + 1e-9
                gaps.append(gap)
    assert room.min() == pytest.approx(min(gaps), abs=5e-3) and min(gaps) < 0.02
    # Risers that may be farther off than that are not within what is proven.
    asked = Tolerances(run=2.0 * min(gaps))
    found = prove_within(p.robot, paper_shank(), p.plan.plans, p.course.boxes, asked)
    assert 0.0 < found.share < 1.0 and found.figures["foothold_room"] > 0.0
    assert found.share * asked.run <= min(gaps)


def test_feet_on_a_slope_have_its_sides_for_edges() -> None:
    """Beside a narrow slope there is nothing to stand on."""
    text = """
course:
  - {kind: floor, length: 3.0, width: 2.0}
  - {kind: slope, going: up, length: 3.0, height: 0.3, width: 0.9}
  - {kind: floor, length: 3.0, width: 2.0}
"""
    p = prepare(parse_scenario(text, source="test"))
    pieces, obstacles = cut_pieces(p.plan.plans), find_box_obstacles(p.course.boxes)
    room = foothold_room(pieces, obstacles, p.robot.foot_radius)
    feet = pieces.feet[pieces.standing]
    on_slope = (feet[:, 0] > 3.1) & (feet[:, 0] < 5.9)
    true = 0.45 - np.abs(feet[on_slope, 1])
    assert on_slope.sum() > 10
    np.testing.assert_allclose(room[pieces.standing][on_slope], true, atol=0.02)  # feet roll


@pytest.mark.parametrize(("share", "said"), [(1.0, False), (0.7, True), (0.0, True)])
def test_what_is_proven_within_tolerances_is_printed(share: float, said: bool) -> None:
    """All figures; where not all holds, what fails and from which share on, or that nothing is."""
    told = told_of_case_study()
    robust = {**told["tolerances"], "share": share, "fails_at": None, "reason": ""}
    if share < 1.0:
        robust |= {"fails_at": share + 0.05, "reason": "a shank is near", "time": 15.0,
                   "segment": "walk 2"}  # fmt: skip
    if share == 0.0:
        robust["proven"] = {}
    text = "\n".join(certificate_lines({**told, "tolerances": robust}))
    assert "risers 5.0 mm off, masses 10% more" in text and "bear 50 ms late" in text
    assert ("a shank is near" in text and f"{share + 0.05:.2f} of each" in text) == said
    assert ("nothing is proven beyond" in text) == (share == 0.0)
    margin = told["tolerances"]["proven"]["margin"]
    assert (f"static margin at least {margin:.4f} m" in text) == (share > 0.0)
    without = certificate_lines({**told, "tolerances": None})
    assert "also for treads" not in "\n".join(without)


@pytest.mark.parametrize("rise", [0.004, 0.012])
def test_a_standing_shank_is_as_near_to_its_own_tread_as_its_foot_lets_it_come(rise: float) -> None:
    """Foot and tread go up and down as one: half of what independent ones would take is taken.

    Below what is proven is no shank of a robot whose feet are as high as the ground under them.
    """
    p = prepared("case_study")
    robot, stand = p.robot, p.plan.plans[0]
    assert stand.segments[0].kind == "stand"

    def proof(within: Tolerances) -> float:
        boxes = p.course.boxes
        found = prove_within(robot, paper_shank(), [stand], boxes, NONE, always=within)
        return found.figures["shank_clearance"]

    as_planned, told = proof(Tolerances(run=1e-9)), proof(Tolerances(rise=rise))
    assert as_planned - rise < told < as_planned
    s = evaluate(robot, stand, np.zeros(1))
    body, along = s.body[0, 0], np.asarray(SHANK_POINTS)[:, None]
    R = turned(0.0, body[3], body[4])
    for high in (-rise, rise):
        feet = s.feet[0] + [0.0, 0.0, high]
        q, _ = solve_legs(robot.geometry, (feet - body[:3]) @ R)
        knees = body[:3] + calc_knees(robot.geometry, q) @ R.T
        for leg in range(4):
            heights = ((1.0 - along) * knees[leg] + along * feet[leg])[:, 2]
            ground = feet[leg, 2] - robot.foot_radius
            assert float(np.min(heights - robot.shank_radii[leg])) - ground >= told - 1e-9


def test_what_is_always_to_hold_is_not_shared() -> None:
    """A box that is too large is refused at any share of the others; one that is not is kept."""
    p = prepared("case_study")
    given = p.robot, paper_shank(), p.plan.plans, p.course.boxes
    some = replace(tolerances(), rise=0.0, run=0.0)
    small = prove_within(*given, some, always=Tolerances(rise=0.002, run=0.002))
    assert small.figures and small.share > 0.0
    alone = prove_within(*given, NONE, always=Tolerances(rise=0.002, run=0.002))
    assert alone.share == 1.0
    assert small.figures["shank_clearance"] < alone.figures["shank_clearance"]
    large = prove_within(*given, some, always=Tolerances(run=0.2))
    assert not large.figures and large.share == 0.0 and large.failure is not None


@pytest.mark.parametrize("name", ["case_study", "descend"])
def test_no_swing_foot_that_is_drawn_within_them_is_nearer_than_proven(name: str) -> None:
    """To any box that it passes, however feet and boxes are off, unless it need not be farther.

    A foot need not be farther than half of what its two footholds are; boxes that it steps from or
    onto, and those level with them, are not looked at here.
    """
    p, found, rng = prepared(name), proven(name), np.random.default_rng(5)
    within, radius = found.asked.scaled(found.share), p.robot.foot_radius
    boxes = [b for b in p.course.boxes if b.yaw == 0.0]
    least = np.inf
    for _ in range(2000):
        plan = p.plan.plans[rng.integers(len(p.plan.plans))]
        if not plan.contacts.steps:
            continue
        step = plan.contacts.steps[rng.integers(len(plan.contacts.steps))]
        ends = np.stack([step.swing.p_start, step.swing.p_end])
        at = step.swing.positions(rng.uniform(0.0, step.swing.duration, 1))
        way = rng.normal(size=3)
        foot = at + within.swing * way / np.linalg.norm(way)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        shift = np.array([within.run * np.cos(angle), within.run * np.sin(angle),
                          within.rise * rng.choice([-1.0, 1.0])])  # fmt: skip
        for box in boxes:
            if np.any(np.abs(box.top - (ends[:, 2] - radius)) < 0.01):
                continue
            half = 0.5 * (from_box(ends, box.centre, 0.5 * box.size).min() - radius)
            away = float(from_box(foot, box.centre + shift, 0.5 * box.size)[0]) - radius
            if away < half:
                least = min(least, away)
    assert found.figures["foot_clearance"] <= least + 1e-9
    assert least <= found.figures["foot_clearance"] + 0.03
