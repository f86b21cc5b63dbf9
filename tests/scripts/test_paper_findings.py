"""The numbers on the page on the paper: right by other means.

The other means are in `paper_rig`; the whole robot's centre of mass is Drake's.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import drake_quad
from paper.finding import Finding, Verdict
from paper.margins import beta_rows
from paper.study import DOWN, TABLE_I, UP, CaseStudy, Samples
from paper_findings_rig import (
    all_findings,
    samples_of_it,
    samples_out_of_phase,
    study_of_the_paper,
)
from paper_rig import (
    RADIUS,
    SPIN,
    WAVE,
    best_four_shifting_steps,
    best_four_steps,
    margin,
    paper_height,
    quintic,
    quintic_time,
    step_margins,
)

from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.scenario.load import load_scenario


@pytest.fixture(scope="module")
def study() -> CaseStudy:
    return study_of_the_paper()


@pytest.fixture(scope="module")
def samples() -> Samples:
    return samples_of_it()


@pytest.fixture(scope="module")
def out_of_phase() -> Samples:
    return samples_out_of_phase()


@pytest.fixture(scope="module")
def findings() -> dict[str, Finding]:
    return all_findings()


def test_scenario_is_the_papers() -> None:
    """The shipped scenario `paper` has Table I's values."""
    scenario, w = load_scenario("paper"), TABLE_I.workspace
    gait = scenario.gait
    sizes = (gait.workspace_length, gait.workspace_width, gait.stance_length, gait.stance_width)
    assert sizes == (w.R_x, w.R_y, w.P_x, w.P_y) == (0.76, 0.5, 0.8, 0.54)
    assert (gait.duty_factor, scenario.spin.duty_factor) == (TABLE_I.beta,) * 2 == (0.75,) * 2
    assert (gait.cycle_time, scenario.spin.cycle_time) == (TABLE_I.T,) * 2 == (8.0,) * 2
    assert gait.swing_clearance == TABLE_I.delta_h == 0.02
    flights = [(e.rise, e.run) for e in scenario.course if e.kind == "stairs"]
    assert flights == [(TABLE_I.H, TABLE_I.W)] * 2 == [(0.13, 0.5)] * 2
    assert gait.stance_stagger == 0.0


def test_one_tread_against_two(findings: dict[str, Finding]) -> None:
    """By footprints written out by hand: the least margin of a cycle, the body where it is best."""
    swings = {1: 0.0, 4: 0.25, 2: 0.5, 3: 0.75}

    def least(start: Any, stride: float, beta: float) -> float:
        """Over bodies as far ahead as is tried, at the switches: there the least margins are."""
        best = -np.inf
        for ahead in np.linspace(-0.3, 0.3, 241):
            found = np.inf
            for leg, lift_off in swings.items():
                for t in (lift_off + 1e-9, lift_off + 1.0 - beta - 1e-9):
                    feet = [
                        [x + stride * (t > swings[k]), y]
                        for k, (x, y) in enumerate(start, start=1)
                        if k != leg
                    ]
                    found = min(found, margin((ahead + stride * t, 0.0), feet))
            best = max(best, found)
        return best

    n = findings["one_tread"].numbers
    side = [0.27, -0.27, 0.27, -0.27]
    # Strokes of 0.375 m whose middles are P_x apart in the mean: as legs 1 and 2 (or 4 and 3) lift
    # 0 and 1/2 (1/4 and 3/4) into the cycle, they begin at 0.4 - 0.1875 + 0.125, and as far behind.
    beside = np.column_stack([[0.3375, 0.3375, -0.3375, -0.3375], side])
    for key, start, stride in (("one", beside, 0.5), ("two", WAVE, 1.0)):
        assert n[key] == pytest.approx(least(start, stride, 0.75), abs=2e-3)
        assert n[f"{key}_high"] == pytest.approx(least(start, stride, 0.95), abs=2e-3)
    spread = np.column_stack([[0.4, 0.65, -0.4 + 0.375, -0.4 + 0.125], side])
    assert n["spread"] == pytest.approx(least(spread, 0.5, 0.75), abs=2e-3)
    assert n["spread_high"] == pytest.approx(least(spread, 0.5, 0.95), abs=2e-3)
    assert n["one_high"] < 0.0 <= n["two"]
    assert 0.0 < n["spread_high"] < 0.5 * n["two_high"]
    assert (n["speed"], n["half_speed"]) == (0.125, 0.0625)
    # Footprints of one stair a cycle at 0, 1/4, 1/8 and 3/8 m, but for P_x: all within a tread.
    assert n["aside"] == pytest.approx(0.1625)


def test_stroke(findings: dict[str, Finding]) -> None:
    """R = 2 W beta, and the vertical stroke, stride and advance a swing that go with it."""
    n = findings["stroke"].numbers
    assert n["stroke"] == pytest.approx(0.75)
    assert n["rise"] == pytest.approx(0.195)
    assert n["stride"] == pytest.approx(1.0)
    assert n["advance"] == pytest.approx(0.25)


def test_swinging_foot_leaves_its_workspace(findings: dict[str, Finding]) -> None:
    """After lift-off the ground has moved back by more than the foot has come forward."""
    s = np.linspace(0.0, 1.0, 20001)
    trail = float((0.25 * s - quintic(s)).max())
    n = findings["workspace_use"].numbers
    assert n["trail"] == pytest.approx(trail, abs=1e-6)
    assert n["excess"] == pytest.approx(0.375 + trail - 0.38, abs=1e-6)
    assert n["excess"] > 0.0
    assert n["needed"] == pytest.approx(0.75 + 2 * trail, abs=1e-6)
    assert n["spare"] == pytest.approx(0.005)


def test_paper_transition(findings: dict[str, Finding]) -> None:
    """Legs 2-3-4-1-3 have margins 0, 0, 0, 0, 0.175 m by way of -R/6, and less elsewhere."""

    def by_way_of(x: float) -> list[float]:
        return step_margins(
            [(2, WAVE[1]), (3, (x, 0.27)), (4, WAVE[3]), (1, WAVE[0]), (3, WAVE[2])]
        )

    n = findings["transition_wave"].numbers
    assert [n[f"m{k}"] for k in range(1, 6)] == pytest.approx(by_way_of(-0.525), abs=1e-9)
    assert n["m5"] == pytest.approx(0.175, abs=5e-4)
    aside = max(min(by_way_of(-0.525 + d)) for d in (-0.01, 0.01))
    assert n["aside"] == pytest.approx(aside, abs=1e-9)
    assert aside < 0.0
    grid = [min(by_way_of(-0.4 + d)) for d in np.linspace(-0.38, 0.38, 305)]
    assert max(grid) <= 1e-9
    assert "2-1-3-4-3" in findings["transition_wave"].found
    assert min(n[f"b{k}"] for k in range(2, 6)) > 0.0


@pytest.mark.parametrize(
    ("key", "goal", "rounded"), [("fewest_wave", WAVE, 0.105), ("transition_spin", SPIN, 0.048)]
)
def test_fewest_steps(findings: dict[str, Finding], key: str, goal: Any, rounded: float) -> None:
    """No order of four steps is stable with the body still; with shifts the best has 0.1 or so."""
    n = findings[key].numbers
    assert n["four"] == pytest.approx(best_four_steps(goal), abs=1e-9)
    assert n["four"] < 0.0
    assert n["shifted"] == pytest.approx(best_four_shifting_steps(goal), abs=1e-6)
    assert n["shifted"] == pytest.approx(rounded, abs=5e-4)


def test_spin_transition_steps_are_stable(findings: dict[str, Finding]) -> None:
    """The fifth margin is that of the desired configuration without leg 2, the first is zero."""
    n = findings["transition_spin"].numbers
    assert n["m1"] == pytest.approx(0.0, abs=1e-9)
    assert n["m5"] == pytest.approx(margin((0, 0), np.delete(SPIN, 1, axis=0)), abs=1e-9)


def test_swing_is_at_rest_and_smooth(findings: dict[str, Finding]) -> None:
    """Nothing jumps, and t_s solves equation (2)."""
    n = findings["rest_to_rest"].numbers
    assert n["t_s"] == pytest.approx(2.0 * quintic_time(0.75), abs=1e-8)
    assert (n["speed"], n["acceleration"], n["jump"]) == pytest.approx((0, 0, 0), abs=1e-6)


def test_two_risers(findings: dict[str, Finding]) -> None:
    """By the paper's polynomials: the right choice clears the other riser, the wrong one hits."""
    n = findings["two_risers"].numbers
    up = paper_height(0.25, z_f=0.26, d_s=0.75, h_s=0.26) - 0.13
    down = paper_height(0.75, z_f=-0.26, d_s=0.25, h_s=0.0) + 0.13
    assert (n["up"], n["down"]) == pytest.approx((up, down), abs=1e-7)
    assert up == pytest.approx(0.042, abs=5e-4)
    assert n["up_wrong"] == pytest.approx(
        0.26 - paper_height(0.75, z_f=0.26, d_s=0.25, h_s=0.13), abs=1e-7
    )
    assert n["down_wrong"] == pytest.approx(
        -paper_height(0.25, z_f=-0.26, d_s=0.75, h_s=-0.13), abs=1e-7
    )
    assert min(n["up_wrong"], n["down_wrong"]) > 0.0


def test_point_foot_is_near_the_nosing(findings: dict[str, Finding]) -> None:
    """The path of the paper's point foot is at most delta_h from a nosing."""
    path = np.array([[x, paper_height(x, z_f=0.26, d_s=0.75, h_s=0.26)]
                     for x in np.linspace(0.6, 0.9, 601)])  # fmt: skip
    nearest = np.hypot(*(path - [0.75, 0.26]).T).min()
    n = findings["foot_radius"].numbers
    assert n["nearest"] == pytest.approx(nearest, abs=1e-5)
    assert n["overlap"] == pytest.approx(0.035 - nearest, abs=1e-5)


def test_table_contradicts_equation_6(findings: dict[str, Finding]) -> None:
    """The radicand is negative, and the arc inside the box is what sampling the circle finds."""
    n = findings["table_against_6"].numbers
    assert n["radicand"] == pytest.approx(0.64 - 0.54 - 0.25)
    angles = np.radians(np.linspace(-10.0, 100.0, 1_100_001))
    x, y = RADIUS * np.cos(angles), RADIUS * np.sin(angles)
    inside = np.degrees(angles[(abs(x - 0.4) <= 0.38) & (abs(y - 0.27) <= 0.25)])
    assert (n["lo"], n["hi"]) == pytest.approx((inside.min(), inside.max()), abs=2e-4)
    assert n["phi_max"] == pytest.approx(85.25, abs=5e-3)
    assert n["radius"] < n["outer"]
    assert findings["table_against_6"].verdict == Verdict.CONTRADICTED


def test_equations_4_to_6_hold_in_narrow_boxes(findings: dict[str, Finding]) -> None:
    """With R_y = 0.3 the equations, typed out here, and the arc agree."""
    P_x, P_y, R_y = 0.8, 0.54, 0.3
    delta = np.arctan((P_y - R_y) / np.sqrt(P_x**2 + 2 * P_y * R_y - R_y**2))
    gamma = np.arctan(np.sqrt(P_x**2 - 2 * P_y * R_y - R_y**2) / (P_y + R_y))
    n = findings["equations_4_to_6"].numbers
    phi = np.degrees(np.pi / 2 - (delta + gamma))
    assert (n["phi"], n["arc"]) == pytest.approx((phi, phi), abs=1e-8)


def test_spin_numbers(findings: dict[str, Finding]) -> None:
    """90° is one cycle of 67.5°; turns of the body add up; the stroke is the arc's chord."""
    n = findings["equations_8_9"].numbers
    assert (n["swing"], n["stand"]) == pytest.approx((67.5 / 3, 0.0))
    assert (n["total"], n["cycle"]) == pytest.approx((90.0, 90.0))
    stroke = findings["equation_7"].numbers
    ends = np.radians([45 - 33.75, 45 + 33.75])
    chord = RADIUS * np.array([np.diff(np.cos(ends))[0], np.diff(np.sin(ends))[0]])
    assert (stroke["s_x"], stroke["s_y"]) == pytest.approx(tuple(chord), abs=1e-8)
    assert (stroke["x"], stroke["y"]) == pytest.approx(tuple(chord), abs=1e-8)


def test_spin_margin(findings: dict[str, Finding]) -> None:
    """Turning the footprints under three feet at a time never gives less than 0.185 m."""
    feet = {leg: SPIN[leg - 1] @ np.eye(2) for leg in (1, 2, 3, 4)}
    c, s = np.cos(np.radians(90.0)), np.sin(np.radians(90.0))
    quarter = np.array([[c, -s], [s, c]])
    least = []
    for leg in (1, 3, 4, 2):  # at beta = 0.75 one after the other; a spin keeps distances
        least.append(margin((0, 0), [place for k, place in feet.items() if k != leg]))
        feet[leg] = quarter @ feet[leg]
    n = findings["spin_stable"].numbers
    assert n["margin"] == pytest.approx(min(least), abs=1e-8)
    assert n["margin"] == pytest.approx(0.185, abs=5e-4)
    assert (n["cycles"], n["phi"]) == pytest.approx((1, 67.5))


def test_direct_transition(findings: dict[str, Finding]) -> None:
    """Straight from wave to spin takes half the steps, and with a margin, unlike by the centres."""
    n = findings["via_centres"].numbers
    assert (n["via"], n["direct"]) == (10, 5)
    assert n["via_margin"] == pytest.approx(0.0, abs=1e-9)
    assert 0.05 < n["direct_margin"] <= margin((0, 0), np.delete(WAVE, 2, axis=0))


def test_margins_of_the_study(
    findings: dict[str, Finding], samples: Samples, out_of_phase: Samples
) -> None:
    """Shapely finds the same least margins of the body's centre over the feet."""
    for data, key in ((samples, "margin"), (out_of_phase, "other")):
        worst = np.argsort(data.margin)[:: max(len(data.margin) // 300, 1)]
        by_shapely = [margin(data.body[k, :2], data.feet[k, data.standing[k], :2]) for k in worst]
        assert data.margin[worst] == pytest.approx(by_shapely, abs=1e-9)
        assert findings["one_stride"].numbers[key] == pytest.approx(by_shapely[0], abs=1e-8)
    assert findings["one_stride"].numbers["other"] < -0.01


def test_zeros_of_the_study(findings: dict[str, Finding], study: CaseStudy) -> None:
    """Two a cycle, and the steps of transitions that the plan itself says have none."""
    n = findings["zeros"].numbers
    steps = [step for s in study.segments for step in s.details.get("steps", [])]
    assert n["transitions"] == sum(abs(step["margin"]) < 1e-9 for step in steps)
    assert n["cycles"] == 8 + 7  # metres, at one a cycle
    assert n["waves"] == 2 * n["cycles"]
    assert findings["definition"].numbers["zeros"] == n["waves"] + n["transitions"]
    assert n["steps_time"] == pytest.approx(n["transitions"] * study.settings.swing_time)


def height_of_stairs(x: float, *, first: float, going: int) -> float:
    """Height of the ground [m] where six risers of 0.13 m begin at `first`, 0.5 m apart."""
    passed = min(max(int(np.floor((x - first) / 0.5)) + 1, 0), 6)
    return 0.13 * (passed if going > 0 else 6 - passed)


def foot_on_stairs(t: float, leg: int, *, start: float, first: float, going: int) -> list[float]:
    """Place along the walk and height of a foot, `t` [s] into the wave gait of Table I.

    Equations (1) to (3) from where the foot has been put down last, 1 m on in 2 s of every 8.
    """
    lift_off = {1: 0.0, 4: 2.0, 2: 4.0, 3: 6.0}[leg]
    cycle, since = divmod(t - lift_off, 8.0)
    x = start + cycle
    if since >= 2.0:
        x += 1.0
        return [x, height_of_stairs(x, first=first, going=going)]
    ends = [height_of_stairs(at, first=first, going=going) for at in (x, x + 1.0)]
    z_f = ends[1] - ends[0]
    risers = [r - x for r in first + 0.5 * np.arange(6) if x < r < x + 1.0]
    d_s, h_s = (risers[-1 if going > 0 else 0], max(z_f, 0.0)) if risers else (0.5, 0.0)
    t, t_s, top = since / 2.0, quintic_time(d_s), h_s + 0.02
    z = top * quintic(t / t_s)
    if t > t_s:
        z = top + (z_f - top) * quintic((t - t_s) / (1.0 - t_s))
    return [x + float(quintic(t)), ends[0] + float(z)]


@pytest.mark.parametrize("index", [UP, DOWN])
def test_figures_11_and_12_are_the_papers_equations(
    study: CaseStudy, samples: Samples, index: int
) -> None:
    """Both walks from Table I alone: body and legs (Fig. 11), and their margin (Fig. 12).

    The body at λ/T, the feet by equations (1) to (3) on footprints λ apart, the margin by shapely;
    on the stairs the body rises, or sinks, by 2H a cycle.
    """
    begin = study.starts[index] + (12.0 if index == UP else 23.0)  # 5 steps, or by the centres 10
    cycles, going = (8, 1) if index == UP else (7, -1)
    start, first = (1.25, 4.5) if index == UP else (0.0, 1.75)
    within = (samples.times > begin + 0.05) & (samples.times < begin + 8.0 * cycles - 0.05)
    rows = np.flatnonzero(within)[::7]
    assert len(rows) > 100
    for k in rows:
        t = float(samples.times[k] - begin)
        along = samples.feet[k] if index == UP else samples.feet[k][:, [1, 0, 2]] * [1, -1, 1]
        body = samples.body[k, :2] if index == UP else samples.body[k, [1, 0]] * [1, -1]
        across = 0.0 if index == UP else -9.25
        assert body == pytest.approx([start + 0.125 * t, across], abs=1e-6)
        feet = []
        for leg in (1, 2, 3, 4):
            begun = start + WAVE[leg - 1, 0]
            x, z = foot_on_stairs(t, leg, start=begun, first=first, going=going)
            feet.append([x, across + WAVE[leg - 1, 1], z])
        standing = samples.standing[k]
        np.testing.assert_allclose(along, feet, atol=1e-6)
        expected = margin(body, np.array(feet)[standing, :2])
        assert samples.margin[k] == pytest.approx(expected, abs=1e-6)
        if first + 0.9 < body[0] < first + 1.6:
            level = 0.90 + 0.13 * (2.0 * (body[0] - first) + 0.5)
            z = level if going > 0 else 2 * 0.90 + 0.78 - level
            assert samples.body[k, 2] == pytest.approx(z, abs=1e-4)


def test_margin_beyond_beta_three_quarters() -> None:
    """Half the way that the body goes on four feet, across the diagonal of the feet; as planned."""
    across = 0.54 / np.hypot(0.54, 0.55)
    rows = beta_rows()
    assert [row.beta for row in rows] == [0.75, 0.80, 0.85, 0.90]
    for row in rows:
        expected = (row.beta - 0.75) / 2.0 * across
        found = (row.equations, row.up, row.down)
        assert found == pytest.approx((expected,) * 3, abs=1e-8)
    assert rows[1].up == pytest.approx(0.0175, abs=5e-5)


@pytest.mark.parametrize("beta", [0.80, 0.90])
def test_plan_gives_the_margin_of_the_table(beta: float, tmp_path: Path) -> None:
    """`drake-quad plan` with another β has the wave's margin by the equations, up and down."""
    told = drake_quad("plan", "paper", "--set", f"gait.duty_factor={beta}", "--json", cwd=tmp_path)
    waves = [s for s in json.loads(told.stdout)["segments"] if s["kind"] == "wave"]
    expected = (beta - 0.75) / 2.0 * 0.54 / np.hypot(0.54, 0.55)
    assert [s["margin_min"] for s in waves] == pytest.approx([expected] * 2, abs=1e-8)


def test_margin_of_the_whole_robot(
    findings: dict[str, Finding], study: CaseStudy, samples: Samples
) -> None:
    """Drake's own centre of mass, at the worst time, is outside of the support polygon as far."""
    k = int(np.argmin(samples.margin_robot))
    body, feet = samples.body[k], samples.feet[k]
    q = pose_robot(study.robot, body[None], feet[None])[0][0]
    plant = MakeModelPlant(study.robot.url)
    context = plant.CreateDefaultContext()
    trunk = plant.GetBodyByName(study.robot.trunk)
    turn = np.array([np.cos(body[4] / 2), 0.0, 0.0, np.sin(body[4] / 2)])  # yaw alone
    positions = plant.GetPositions(context)
    start = trunk.floating_positions_start()
    positions[start : start + 7] = [*turn, *body[:3]]
    for name, angle in zip(study.robot.joint_names, q.ravel(), strict=True):
        positions[plant.GetJointByName(name).position_start()] = angle
    plant.SetPositions(context, positions)
    com = plant.CalcCenterOfMassPositionInWorld(context)
    n = findings["massless_legs"].numbers
    assert body[3] == 0.0
    assert n["margin"] == pytest.approx(margin(com[:2], feet[samples.standing[k], :2]), abs=1e-6)
    assert n["margin"] < -0.01
    assert n["mass"] == pytest.approx(plant.CalcTotalMass(context))


def test_case_study_goes_where_the_paper_does(
    findings: dict[str, Finding], study: CaseStudy, samples: Samples
) -> None:
    """Six stairs up, a quarter turn, six down; on the treads as in Fig. 4; within reach."""
    n = findings["descent"].numbers
    assert (n["up"], n["down"]) == pytest.approx((0.78, 0.78), abs=1e-6)
    assert n["turn"] == pytest.approx(90.0)
    stairs = findings["stairs_of_a_cycle"].numbers
    assert [stairs[key] for key in ("from4", "to4", "from3", "to3")] == [1, 3, 2, 4]
    treads = findings["footprints"].numbers
    assert (treads["low"], treads["high"]) == pytest.approx((0.025, 0.025), abs=1e-6)
    assert treads["count"] == 4 * 3 * 2  # each leg on every other of six treads, twice
    assert samples.reach_excess.max() == 0.0
    assert study.duration == pytest.approx(samples.times[-1])


def test_stairs_change_no_margin(findings: dict[str, Finding]) -> None:
    """With a level body a cycle has the same margins on the floor and on the stairs."""
    n = findings["level_body"].numbers
    assert n["difference"] < 1e-6
    assert (n["low"], n["high"]) == pytest.approx(
        (0.0, margin((0, 0), np.delete(WAVE, 0, axis=0))), abs=1e-4
    )


@pytest.mark.parametrize("mirror", [lambda p: p * [1, -1], lambda p: p * [-1, 1]])
def test_independent_search_is_symmetric(mirror: Callable[[Any], Any]) -> None:
    """The check itself: mirrored goals, legs exchanged to match, are as hard to reach."""
    rows = [1, 0, 3, 2] if mirror(np.ones(2))[1] < 0 else [2, 3, 0, 1]
    assert best_four_steps(mirror(SPIN)[rows]) == pytest.approx(best_four_steps(SPIN))
