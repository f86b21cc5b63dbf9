"""What a spin is: footprints that go round the pivot, whole cycles, and the angle asked for."""

from dataclasses import replace

import numpy as np
import pytest
from rig import flat_course, paper_robot, rotations, spin_plan, stairs_course, stance_at

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.workspace import (
    Workspace,
    spin_cycles,
    spin_desired_configuration,
    spin_phi_max,
)
from drake_quad.math.rotations import rotations as body_rotations
from drake_quad.planning.clearance import trunk_clearance
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.mission import check_plan
from drake_quad.planning.motion_plan import MotionPlan, Segment, evaluate
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.task import plan_task
from drake_quad.robot.legs import SPIN_ORDER_CLOCKWISE, SPIN_ORDER_COUNTERCLOCKWISE
from drake_quad.stability.support_polygon import stability_margins

PIVOT = np.array([3.0, 0.0])
DEFAULT = PlanSettings()
TABLE_I = PlanSettings(
    workspace=Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54),
    stance_stagger=0.0,
    spin_duty_factor=0.75,
    body_still=True,
    via_centres=True,
    uniform_body=True,
)
ANGLES = [np.radians(a) for a in (90.0, -90.0, 45.0, -30.0, 180.0)]


def spin_of(plan: MotionPlan) -> Segment:
    return next(s for s in plan.segments if s.kind == "spin")


def spin_steps(plan: MotionPlan) -> list[Step]:
    """The steps of the spin alone."""
    return [s for s in plan.contacts.steps if s.lift_off >= spin_of(plan).start - 1e-9]


def polar(p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
    d = p_W[..., :2] - PIVOT
    return np.hypot(*d.T), np.arctan2(d[..., 1], d[..., 0])


def test_shanks_keep_off_the_trunk_in_a_spin() -> None:
    """The body shifts and rises for it: HyQReal's plans folded a shank 4 cm into its trunk."""
    keel = np.array([[[-0.5, -0.1, -0.5], [0.5, 0.1, 0.1]]])
    robot, course = replace(paper_robot(), trunk_boxes=keel), flat_course()
    task, least = Task(kind="spin", name="spin", lane=0, angle=np.pi / 2.0), []
    for room in (0.0, 0.02):
        settings = PlanSettings(shank_room=room)
        plan = plan_task(robot, course, settings, task, stance_at(course, settings, 3.0), index=0)
        samples = check_plan(robot, plan, dynamic=False)
        body = samples.body[:, 0]
        away = samples.feet - body[:, None, :3]
        p_BF = np.einsum("nji,nlj->nli", body_rotations(body), away)
        least.append(trunk_clearance(robot, p_BF, samples.q).min())
        assert plan.margin > 0.09
    assert least[0] < -0.02 < 0.01 < least[1]


@pytest.mark.parametrize("angle", ANGLES)
def test_body_turns_by_the_angle_on_the_spot(angle: float) -> None:
    """It ends over the pivot, turned by just the angle, and never far from the pivot between."""
    plan = spin_plan(angle)
    np.testing.assert_allclose(plan.end.body[[0, 1, 4]], [*PIVOT, angle], atol=5e-3)
    body = plan.body.samples(np.linspace(0.0, plan.duration, 500))[:, 0]
    away = np.abs(body[:, :2] - PIVOT).max()
    assert away <= DEFAULT.max_shift + 5e-3
    assert np.all(np.diff(np.sign(angle) * body[:, 4]) >= -1e-9)  # never back


@pytest.mark.parametrize("angle", ANGLES)
def test_footprints_go_round_the_pivot_by_the_angle(angle: float) -> None:
    """Each foot stays at its distance from the pivot and turns as the body does, cycle by cycle."""
    plan = spin_plan(angle)
    cycles = spin_of(plan).details["cycles"]
    for step in spin_steps(plan):
        (r0, a0), (r1, a1) = polar(step.swing.p_start), polar(step.swing.p_end)
        assert r1 == pytest.approx(float(r0), abs=1e-9)
        turned = (a1 - a0 - angle / cycles + np.pi) % (2 * np.pi) - np.pi
        assert turned == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_legs_lift_in_the_papers_order_for_the_sense(angle: float) -> None:
    """1-3-4-2 counterclockwise and 1-2-4-3 clockwise, each once a cycle."""
    plan = spin_plan(angle)
    order = SPIN_ORDER_COUNTERCLOCKWISE if angle > 0 else SPIN_ORDER_CLOCKWISE
    steps, cycles = spin_steps(plan), spin_of(plan).details["cycles"]
    assert [s.leg for s in steps] == list(order) * cycles
    swing_time = (1 - DEFAULT.spin_duty_factor) * DEFAULT.spin_cycle_time
    np.testing.assert_allclose([s.touchdown - s.lift_off for s in steps], swing_time)


@pytest.mark.parametrize("angle", ANGLES)
def test_spin_takes_the_fewest_cycles_and_says_so(angle: float) -> None:
    """Cycles and φ are those of `gait.workspace` for the legs' boxes."""
    details = spin_of(spin_plan(angle)).details
    cycles, phi = spin_cycles(abs(angle), 0.85, spin_phi_max(DEFAULT.workspace))
    assert details["cycles"] == cycles
    assert details["phi_deg"] == pytest.approx(np.degrees(phi))
    assert details["angle_deg"] == pytest.approx(np.degrees(angle))


@pytest.mark.parametrize("angle", ANGLES)
def test_spin_begins_and_ends_in_its_desired_configuration(angle: float) -> None:
    """Seen from the body, the feet are in the same places before and after it."""
    plan = spin_plan(angle)
    _, phi = spin_cycles(abs(angle), 0.85, spin_phi_max(DEFAULT.workspace))
    wanted = spin_desired_configuration(
        DEFAULT.workspace, phi=phi, duty_factor=0.85, sense=1 if angle > 0 else -1
    )
    begin = spin_steps(plan)[0].lift_off
    for feet, yaw in ((plan.sample(begin).feet, 0.0), (plan.end.feet, angle)):
        R = rotations(np.array([0.0, 0.0, 0.0, 0.0, yaw]))[:2, :2]
        np.testing.assert_allclose((feet[:, :2] - PIVOT) @ R, wanted, atol=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_spin_keeps_a_margin_and_the_ground(angle: float) -> None:
    """The whole robot's margin is 5 cm at least, and every footprint is on the ground."""
    plan = spin_plan(angle)
    s = evaluate(paper_robot(), plan, np.linspace(0.0, plan.duration, 2000))
    assert s.margin.min() >= 0.05 and s.reach_excess.max() == 0.0
    for step in plan.contacts.steps:
        assert step.swing.p_end[2] == pytest.approx(paper_robot().foot_radius)


def test_left_and_right_spins_are_alike() -> None:
    """They last as long; margins differ by what leg 1 lifting first in both makes, 2 cm at most."""
    left, right = spin_plan(np.pi / 2), spin_plan(-np.pi / 2)
    assert left.duration == pytest.approx(right.duration)
    assert left.margin == pytest.approx(right.margin, abs=0.02)


def test_papers_quarter_turn_is_one_cycle_of_67_5_degrees_with_a_margin_of_185_mm() -> None:
    """Table I at β = 0.75: φ = β 90°, and the massless-legged robot's margin in the spin."""
    plan = spin_plan(np.pi / 2, settings=TABLE_I)
    spin = spin_of(plan)
    assert spin.details["cycles"] == 1
    assert spin.details["phi_deg"] == pytest.approx(67.5)
    times = np.linspace(spin_steps(plan)[0].lift_off, spin.end, 4001)[:-1]
    points = replace(plan.contacts, roll=None)  # the paper's feet are points
    feet, standing = points.feet_at(times)
    body = plan.body.samples(times)[:, 0, :2]
    margin = stability_margins(body, feet[..., :2], standing)
    assert margin.min() == pytest.approx(0.185, abs=1e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_swings_go_round_the_body_if_asked(angle: float) -> None:
    """With arcs a swing foot keeps its distance from the pivot; straight it does not by far."""
    for arcs in (True, False):
        plan = spin_plan(angle, settings=replace(DEFAULT, spin_arcs=arcs))
        off = []
        for step in spin_steps(plan):
            r, _ = polar(step.swing.positions(np.linspace(0.0, step.swing.duration, 21)))
            off.append(np.ptp(r))
            assert np.ptp(r[[0, -1]]) < 1e-9
        assert max(off) < 1e-9 if arcs else min(off) > 1e-3


def test_an_arc_over_stairs_is_refused() -> None:
    """A swing round the body needs level ground under all of it."""
    course = stairs_course()
    riser = float(course.lanes[0].risers()[0][0])
    task = Task(kind="spin", name="spin", lane=0, angle=np.pi / 2)
    settings = replace(DEFAULT, spin_arcs=True, body_still=False)
    stance = stance_at(course, settings, riser - 0.45)
    with pytest.raises(PlanningError, match="level"):
        plan_task(paper_robot(), course, settings, task, stance, index=0)


def test_spin_there_and_back_ends_where_it_began() -> None:
    """A spin to the left and one to the right leave the body as it was."""
    left = spin_plan(np.pi / 3)
    task = Task(kind="spin", name="back", lane=0, angle=-np.pi / 3)
    back = plan_task(paper_robot(), flat_course(), DEFAULT, task, left.end, index=1)
    expected = stance_at(flat_course(), DEFAULT, 3.0).body
    np.testing.assert_allclose(back.end.body, expected, atol=1e-2)
    assert back.margin > 0.05
