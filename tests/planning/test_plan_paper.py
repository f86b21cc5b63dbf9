"""The shipped scenario `paper` is the paper's robot, step by step, by the paper's own equations."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from command import drake_quad
from paper_rig import CENTRES, RADIUS, WAVE, margin, paper_height, quintic, step_margins
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.kinematics import calc_feet, solve_legs
from drake_quad.robot.loader import load_robot
from drake_quad.robot.variants import with_foot_radius
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.simulation.run import simulate

ZERO = 1e-9  # [m]
UP, DOWN = 1, 3  # the walks that climb and descend


@cache
def paper() -> PreparedScenario:
    return prepare(load_scenario("paper"))


def plans() -> tuple[MotionPlan, ...]:
    return paper().plan.plans


def test_the_plan_is_stable_throughout_as_the_paper_says() -> None:
    """Shapely finds the body's centre inside or on the border of the feet at every moment."""
    least = np.inf
    for plan in plans():
        switches = [t for s in plan.contacts.steps for t in (s.lift_off, s.touchdown)]
        near = np.ravel(np.add.outer(switches, [-1e-9, 0.0, 1e-9]))
        times = np.concatenate([np.linspace(0.0, plan.duration, 601), near])
        times = np.clip(times, 0.0, plan.duration)
        feet, standing = plan.contacts.feet_at(times)
        body = plan.body.samples(times)[:, 0, :2]
        least = min(
            least,
            *(margin(b, f[s, :2]) for b, f, s in zip(body, feet, standing, strict=True)),
        )
    assert -ZERO <= least <= ZERO  # zero, as in the paper's Fig. 12


def test_plan_says_so(tmp_path: Path) -> None:
    """`drake-quad plan paper` gives a smallest margin of zero, to rounding, of every segment."""
    result = json.loads(drake_quad("plan", "paper", "--json", cwd=tmp_path).stdout)
    assert result["planned_margin_min"] >= -ZERO
    for segment in result["segments"]:
        assert segment["margin_min"] >= -ZERO, segment["name"]


def transitions(to: str) -> list[tuple[FloatArray, list[Step]]]:
    """The body's pose and the steps of every transition whose name ends so."""
    found = []
    for plan in plans():
        for segment in plan.segments:
            if segment.name.endswith(to):
                inside = [
                    s
                    for s in plan.contacts.steps
                    if segment.start - ZERO <= s.lift_off and s.touchdown <= segment.end + ZERO
                ]
                found.append((plan.body.samples(np.array([segment.start]))[0, 0], inside))
    return found


def seen_from(body: FloatArray, p_W: FloatArray) -> FloatArray:
    """A place in the body's frame."""
    c, s = np.cos(body[4]), np.sin(body[4])
    return np.array([[c, s], [-s, c]]) @ (p_W[:2] - body[:2])


def test_the_transition_to_the_wave_gait_is_the_papers() -> None:
    """Legs 2-3-4-1-3, leg 3 first to R/6 behind its centre: margins 0, 0, 0, 0, 0.175 m."""
    both = transitions("wave gait")
    assert len(both) == 2  # at the start, and after the spin
    R = 2 * 0.50 * 0.75
    for body, steps in both:
        assert [int(step.leg) for step in steps] == [2, 3, 4, 1, 3]
        moves = [(int(step.leg), seen_from(body, step.swing.p_end)) for step in steps]
        expected = [WAVE[1], CENTRES[2] - [R / 6, 0.0], WAVE[3], WAVE[0], WAVE[2]]
        np.testing.assert_allclose([place for _, place in moves], expected, atol=1e-8)
        starts = [seen_from(body, step.swing.p_start) for step in steps[:4]]
        np.testing.assert_allclose(starts, CENTRES[[1, 2, 3, 0]], atol=1e-8)
        assert step_margins(moves) == pytest.approx([0, 0, 0, 0, 0.175], abs=2e-4)
        assert min(step_margins(moves)) >= -ZERO


def test_our_own_order_is_on_offer_and_better() -> None:
    """Without an order the plan takes 2-1-3-4-3, of which four steps have 0.03 m and more."""
    ours = prepare(load_scenario("paper", ["transition.wave_order=[]"])).plan.plans[UP]
    segment = next(s for s in ours.segments if s.kind == "transition")
    steps = [s for s in ours.contacts.steps if s.touchdown <= segment.end + ZERO]
    assert [int(step.leg) for step in steps] == [2, 1, 3, 4, 3]
    body = ours.body.samples(np.zeros(1))[0, 0]
    found = step_margins([(int(s.leg), seen_from(body, s.swing.p_end)) for s in steps])
    assert found[0] == pytest.approx(0.0, abs=ZERO)
    assert min(found[1:]) > 0.03


@pytest.mark.parametrize("field", ["wave_order", "spin_order"])
def test_an_order_that_is_not_stable_is_told_with_its_field(field: str) -> None:
    """Four steps in a row do not lead to either gait with the body still."""
    with pytest.raises(PlanningError, match=rf"1-2-3-4 has .* take another transition\.{field}"):
        prepare(load_scenario("paper", [f"transition.{field}=[1, 2, 3, 4]"]))


def test_the_desired_configuration_is_the_papers() -> None:
    """As a cycle begins, legs 1, 4, 2, 3 are -R/2, -R/6, R/6, R/2 from their centres (Fig. 2)."""
    for index in (UP, DOWN):
        plan = plans()[index]
        wave = next(s for s in plan.segments if s.kind == "wave")
        begin = next(s.lift_off for s in plan.contacts.steps if s.lift_off > wave.start)
        before = begin - 0.05  # at rest: a spline cannot start at once
        body = plan.body.samples(np.array([before]))[0, 0]
        for row, place in enumerate(WAVE):
            foot = seen_from(body, plan.sample(before).feet[row])
            np.testing.assert_allclose(foot, place, atol=1e-6)


def test_the_spin_goes_along_arcs_about_the_body() -> None:
    """Each foot stays on the circle through the workspaces' centres, as the body turns (Fig. 9).

    By the paper's numbers alone: r = 0.4826 m, φ = 67.5°, all within the longest arc of 85.25°.
    """
    plan = next(p for p in plans() if any(s.kind == "spin" for s in p.segments))
    spin = next(s for s in plan.segments if s.kind == "spin")
    begin = next(s.lift_off for s in plan.contacts.steps if s.lift_off > spin.start)
    assert [int(s.leg) for s in plan.contacts.steps if s.lift_off >= begin] == [1, 3, 4, 2]
    times = np.linspace(begin + 0.03, begin + 8.0 - 0.03, 400)
    feet, standing = plan.contacts.feet_at(times)
    body = plan.body.samples(times)[:, 0]
    away = feet[..., :2] - body[:, None, :2]
    np.testing.assert_allclose(np.hypot(*np.moveaxis(away, -1, 0)), RADIUS, atol=1e-8)
    angle = np.degrees(np.arctan2(away[..., 1], away[..., 0]) - body[:, None, 4])
    middles = np.array([45.0, -45.0, 135.0, -135.0])
    off = (angle - middles + 180.0) % 360.0 - 180.0
    on_ground = off[standing]
    assert np.abs(on_ground).max() == pytest.approx(67.5 / 2, abs=0.6)
    assert np.abs(off).max() < 85.25 / 2
    # Standing feet turn back at the body's rate; a swing is equation (1) in angle, over the ground.
    rate = 90.0 / 8.0
    for k, t in enumerate((times - begin).tolist()):
        row = int(np.flatnonzero(~standing[k])[0])
        s = (t % 2.0) / 2.0
        expected = -67.5 / 2 + 90.0 * float(quintic(s)) - rate * (t % 2.0)
        assert off[k, row] == pytest.approx(expected, abs=1e-6)


def test_chords_leave_the_arcs_by_far() -> None:
    """Straight over the ground, a swing of the quarter turn cuts r (1 - cos 45°) off its circle."""
    chords = prepare(load_scenario("paper", ["spin.swing_path=chord"])).plan.plans
    nearest = np.inf
    for plan in chords:
        for step in plan.contacts.steps:
            segment = plan.segments[plan.segment_index(step.lift_off)]
            if segment.kind == "spin":
                pivot = plan.body.samples(np.array([segment.start]))[0, 0, :2]
                p = step.swing.positions(np.linspace(0.0, 2.0, 201))[:, :2] - pivot
                nearest = min(nearest, float(np.hypot(*p.T).min()))
    assert RADIUS - nearest == pytest.approx(RADIUS * (1 - np.cos(np.pi / 4)), abs=1e-4)
    assert RADIUS - nearest == pytest.approx(0.141, abs=5e-4)


def test_a_replay_finds_the_margin_and_nothing_that_touches() -> None:
    """Replayed, the robot touches the stairs with its feet alone, and is as stable as planned."""
    result = simulate(load_scenario("paper", ["simulation.log_period=0.02"]))
    assert -ZERO <= result.summary["margin"]["minimum"] <= ZERO
    assert result.summary["nonfoot_contact_samples"] == 0
    assert result.summary["nonfoot_depth_max"] == 0.0
    # The point is the pole of the shipped robot's ball, which tilts into the ground around it.
    assert result.summary["foot_depth_max"] <= load_robot("paper_quadruped").foot_radius


def test_point_feet_stand_still_on_the_ground() -> None:
    """A foot that stands stays where it is, on the course's own surface."""
    for plan in plans():
        times = np.linspace(0.0, plan.duration, 400)
        feet, standing = plan.contacts.feet_at(times)
        for row in range(4):
            on = standing[:-1, row] & standing[1:, row]
            same = [
                plan.contacts.phase(a).feet[row, 0] == plan.contacts.phase(b).feet[row, 0]
                for a, b in zip(times[:-1][on], times[1:][on], strict=True)
            ]
            moved = np.abs(np.diff(feet[:, row], axis=0)[on][np.array(same, dtype=bool)])
            assert not np.any(moved)
            for p in feet[standing[:, row], row]:
                assert p[2] == pytest.approx(paper().course.height(p[0], p[1]), abs=1e-12)


def stair_steps(index: int) -> list[Step]:
    """The steps of a walk that climb or descend by two treads."""
    steps = plans()[index].contacts.steps
    return [s for s in steps if abs(abs(s.swing.p_end[2] - s.swing.p_start[2]) - 0.26) < 1e-9]


@pytest.mark.parametrize(("index", "sign"), [(UP, 1.0), (DOWN, -1.0)])
def test_swings_on_the_stairs_are_equations_one_to_three(index: int, sign: float) -> None:
    """With d_s of the last riser going up, of the first going down, and Δh = 0.02 m."""
    steps = stair_steps(index)
    # Left legs pass the six risers in three strides, right ones the first and last on their own.
    assert len(steps) == 3 + 3 + 2 + 2
    along, riser = (0, 0.0) if index == UP else (1, 0.25)  # risers are at multiples of W, or beside
    for step in steps:
        start, end = step.swing.p_start, step.swing.p_end
        first = riser + 0.5 * np.ceil((start[along] - riser) / 0.5)
        d_s = (first + 0.5 if sign > 0 else first) - start[along]
        h_s = 0.26 if sign > 0 else 0.0
        for s in (0.1, 0.3, 0.5, 0.7, 0.9):
            x = float(quintic(s))
            p = step.swing.positions([s * step.swing.duration])[0] - start
            assert p[along] == pytest.approx(x * (end - start)[along], abs=1e-9)
            height = paper_height(x, z_f=sign * 0.26, d_s=float(d_s), h_s=h_s)
            assert p[2] == pytest.approx(height, abs=1e-7)


def test_a_point_foot_is_the_lowest_point_of_its_ball() -> None:
    """The leg ends a radius farther from the knee; the joints that put it there are the same."""
    ball, point = paper_robot(), with_foot_radius(paper_robot(), 0.0)
    assert point.foot_radius == 0.0
    q = np.tile([0.1, 0.6, -1.1], (4, 1))
    upright = np.zeros((4, 3))
    apart = calc_feet(ball.geometry, upright) - calc_feet(point.geometry, upright)
    np.testing.assert_allclose(apart, np.tile([0.0, 0.0, ball.foot_radius], (4, 1)), atol=1e-12)
    away = np.linalg.norm(calc_feet(ball.geometry, q) - calc_feet(point.geometry, q), axis=-1)
    np.testing.assert_allclose(away, ball.foot_radius)
    feet = calc_feet(point.geometry, q)
    again, excess = solve_legs(point.geometry, feet)
    assert excess.max() == 0.0
    np.testing.assert_allclose(calc_feet(point.geometry, again), feet, atol=1e-12)


@pytest.mark.parametrize(
    ("mode", "gait", "remedy"),
    [("physics", "gait: {duty_factor: 0.8}", "physics"), ("kinematic", "", "auto")],
)
def test_point_feet_are_refused_where_feet_have_a_size(
    mode: str, gait: str, remedy: str, tmp_path: Path
) -> None:
    """Physics and designs are for real feet: the error names the field and why."""
    (tmp_path / "mine.yaml").write_text(
        "robot: {model: go1, point_feet: true}\n"
        "course: [{kind: floor, length: 4.0}]\n"
        f"simulation: {{mode: {mode}}}\n{gait}"
    )
    with pytest.raises(InputError, match=rf"robot\.point_feet.*{remedy}"):
        load_scenario(tmp_path / "mine.yaml")
