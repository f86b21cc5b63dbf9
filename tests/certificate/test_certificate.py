"""Certificates of plans: what they claim is true at every time, and what is not true has none."""

from dataclasses import replace

import numpy as np
import pytest
from certificate_rig import certified, paper_shank, prepared, with_body
from rig import flat_course, paper_robot, stairs_course, walk_plan

from drake_quad.certificate.bounds import TOLERANCE, make_demand, pose_problem, prove
from drake_quad.certificate.cells import cut_pieces
from drake_quad.certificate.certify import CLAIMS, Certificate, certify_plans
from drake_quad.certificate.failure import check_joins, first_failure
from drake_quad.certificate.obstacles import find_box_obstacles
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

SCENARIOS = ("case_study", "flat_walk", "spin_both_ways", "descend")


def certificate_of(plan: MotionPlan, course: Course, **asked: float) -> Certificate:
    """The certificate of one task of the shipped robot."""
    return certify_plans(paper_robot(), paper_shank(), [plan], course.boxes, **asked)


@pytest.mark.parametrize("name", SCENARIOS)
def test_no_sample_is_below_what_is_claimed_of_its_segment(name: str) -> None:
    """Margin and joint angles, 200 times a second; and no claim is far below the least of them."""
    p, certificate = prepared(name), certified(name)
    assert certificate.failure is None
    segment_claims = iter(certificate.proof.claims)
    for plan in p.plan.plans:
        times = np.linspace(0.0, plan.duration, int(200 * plan.duration) + 1)
        s = evaluate(p.robot, plan, times)
        q = s.q.reshape(-1, 12)
        room = np.minimum(q - p.robot.q_lower, p.robot.q_upper - q).min(axis=1)
        for segment in plan.segments:
            mine = (times >= segment.start) & (times < segment.end)
            claims = dict(zip(CLAIMS, next(segment_claims), strict=True))
            assert claims["margin"] <= s.margin[mine].min() <= claims["margin"] + 2e-3
            assert claims["joint_room"] <= room[mine].min() <= claims["joint_room"] + 2e-2


@pytest.mark.parametrize("demand", [0.12, 0.16, 0.2, 0.21, 0.22, 0.23, 0.24, 0.24942, 0.2495])
def test_all_before_a_failure_is_proven(demand: float) -> None:
    """No sample before it is below what is demanded; and where none is told, the demand is met."""
    p = prepared("flat_walk")
    plans = p.plan.plans[:2]
    problem = pose_problem(
        p.robot, paper_shank(), cut_pieces(plans), find_box_obstacles(p.course.boxes)
    )
    proof = prove(problem, make_demand(margin=demand))
    failure = first_failure(problem, proof)
    assert (failure is None) == bool(np.all(proof.met))
    for task, plan in enumerate(plans):
        times = np.arange(0.0, plan.duration, 2e-3)
        margins = evaluate(p.robot, plan, times).margin
        if failure is not None and task == failure.task:
            margins = margins[times < failure.time]
        if failure is None or task <= failure.task:
            assert np.all(margins >= demand)


def test_claims_are_as_near_to_the_truth_as_said() -> None:
    """No claim is further below a value that was found than TOLERANCE, rounding aside."""
    proof = certified("case_study").proof
    assert np.all(proof.best[:, : len(TOLERANCE)] - proof.claims <= TOLERANCE + 2e-6)


def test_cells_cover_every_task_without_a_gap() -> None:
    """From 0 to the end, each where the one before stops."""
    p, cells = prepared("case_study"), certified("case_study").proof.cells
    owner = cut_pieces(p.plan.plans).task[cells.piece]
    for index, plan in enumerate(p.plan.plans):
        middle, half = cells.middle[owner == index], cells.half[owner == index]
        ends = np.concatenate([[0.0], middle + half])
        assert np.allclose(ends[:-1], middle - half, atol=1e-9)
        assert ends[-1] == pytest.approx(plan.duration, abs=1e-9)


def test_a_body_pushed_aside_fails_where_it_is_pushed() -> None:
    """The earliest time told is within 20 ms of the first sample without the margin asked for."""
    course = flat_course()
    plan = walk_plan(course, goal=3.0)
    asked = 0.05
    assert certificate_of(plan, course, margin=asked).failure is None
    control = np.array(plan.body.control)
    bump = np.exp(-(((np.arange(len(control)) - 1) * plan.body.knot - 17.0) ** 2))
    control[:, 1] += 0.15 * bump
    spoiled = with_body(plan, control)
    failure = certificate_of(spoiled, course, margin=asked).failure
    times = np.arange(0.0, plan.duration, 1e-3)
    low = evaluate(paper_robot(), spoiled, times).margin < asked
    assert failure is not None and "margin" in failure.reason
    assert failure.time == pytest.approx(times[low][0], abs=0.02)


JUMPS = {  # of the first three control points of the second task, and of a coordinate
    "height": (2, (1e-5, 1e-5, 1e-5), "z jumps by 1e-05 m"),
    "pitch": (3, (0.0885, 0.0885, 0.0885), "pitch jumps by 0.0885 rad"),
    "speed": (0, (-1e-4, 0.0, 1e-4), "x's rate jumps by"),
    "acceleration": (4, (1e-5, -0.5e-5, 1e-5), "yaw's acceleration jumps by"),
}


@pytest.mark.parametrize("kind", JUMPS)
def test_a_body_that_jumps_between_tasks_has_no_certificate(kind: str) -> None:
    """Nor one whose speed or acceleration does; it is told when, and which coordinate."""
    axis, by, told = JUMPS[kind]
    p = prepared("flat_walk")
    plans = list(p.plan.plans)
    assert check_joins(plans).failure is None
    control = np.array(plans[1].body.control)
    control[:3, axis] += by
    plans[1] = with_body(plans[1], control)
    certificate = certify_plans(p.robot, paper_shank(), plans, p.course.boxes)
    failure = certificate.failure
    assert failure is not None and told in failure.reason and certificate.record is None
    assert (failure.task, failure.time) == (1, 0.0)


def test_a_foot_that_jumps_or_does_not_rest_has_no_certificate() -> None:
    """A swing that begins off the foot's place, and one cut short at its touchdown."""
    plan = walk_plan(flat_course(), goal=3.0)
    step = plan.contacts.steps[3]
    off = replace(step.swing, p_start=step.swing.p_start + np.array([1e-3, 0.0, 0.0]))
    for spoiled in (replace(step, swing=off), replace(step, touchdown=step.touchdown - 0.1)):
        steps = list(plan.contacts.steps)
        steps[3] = spoiled
        contacts = ContactPlan(plan.contacts.feet, tuple(steps), plan.duration)
        failure = check_joins([replace(plan, contacts=contacts)]).failure
        assert failure is not None and f"foot {step.leg.short} jumps" in failure.reason
        assert failure.time == step.lift_off


def test_a_body_too_high_fails_for_the_legs() -> None:
    """And not for anything that presumes that they reach."""
    course = flat_course()
    plan = walk_plan(course, goal=3.0)
    lift = np.zeros_like(plan.body.control)
    lift[60:70, 2] = 0.4
    failure = certificate_of(with_body(plan, plan.body.control + lift), course).failure
    assert failure is not None and ("reach" in failure.reason or "knee" in failure.reason)
    assert failure.time == pytest.approx(57 * plan.body.knot, abs=2.0)


def test_a_swing_too_low_for_the_nosing_fails() -> None:
    """A foot that would pass a nosing at half of its clearance has no certificate for all of it."""
    course = stairs_course()
    plan = walk_plan(course, goal=5.5)
    good = certificate_of(plan, course)
    assert good.failure is None
    clearance = float(good.proof.claims[:, 1].min())
    steps = list(plan.contacts.steps)
    highest = max(
        range(len(steps)), key=lambda k: float(steps[k].swing.p_end[2] - steps[k].swing.p_start[2])
    )
    step = steps[highest]
    low = replace(step.swing, apex_z=float(step.swing.apex_z) - 0.015)
    steps[highest] = replace(step, swing=low)
    spoiled = replace(plan, contacts=ContactPlan(plan.contacts.feet, tuple(steps), plan.duration))
    left = float(certificate_of(spoiled, course).proof.claims[:, 1].min())
    assert left < clearance - 5e-3
    pieces = cut_pieces([spoiled])
    problem = pose_problem(paper_robot(), paper_shank(), pieces, find_box_obstacles(course.boxes))
    failure = first_failure(problem, prove(problem, make_demand(foot=left + 2e-3)))
    assert failure is not None and "swing foot" in failure.reason
    assert step.lift_off < failure.time < step.touchdown


def test_a_box_where_a_knee_goes_is_found() -> None:
    """A block that no foot steps on, but a shank passes through."""
    course = flat_course()
    plan = walk_plan(course, goal=3.0)
    middle = evaluate(paper_robot(), plan, np.array([15.0]))
    foot = middle.feet[0, 0]
    block = replace(
        course.boxes[0],
        name="block",
        centre=np.array([foot[0] - 0.05, foot[1], 0.35]),
        size=np.array([0.4, 0.4, 0.1]),
    )
    failure = certify_plans(paper_robot(), paper_shank(), [plan], (*course.boxes, block)).failure
    assert failure is not None and ("shank" in failure.reason or "foot" in failure.reason)


def test_paper_gait_at_three_quarters_is_told_what_it_lacks() -> None:
    """The whole robot's margin is below 0 where the paper's own gait switches diagonals."""
    failure = certified("paper").failure
    assert failure is not None and "static margin" in failure.reason
    assert certified("paper").record is None


def test_what_is_asked_for_is_proven_if_it_is_true() -> None:
    """Asked for a hair less than the least that was found, the bounds are made good enough."""
    course = flat_course()
    plan = walk_plan(course, goal=3.0)
    best = certificate_of(plan, course).proof.best[:, 0].min()
    assert certificate_of(plan, course, margin=best - 2e-5).failure is None
    assert certificate_of(plan, course, margin=best + 2e-5).failure is not None


def test_faces_are_the_sides_without_ground_before_them() -> None:
    """A flight of three has the fronts of three treads, not where ground of its height goes on."""
    obstacles = find_box_obstacles(stairs_course().boxes)
    across = obstacles.face & (obstacles.half[:, 0] == 0.0) & (obstacles.centre[:, 0] > 0.1)
    ends = across & (obstacles.centre[:, 0] < 7.0)
    assert np.allclose(np.sort(obstacles.centre[ends, 0]), [3.0, 3.5, 4.0])


def test_distance_is_that_of_a_dense_cloud() -> None:
    """From a turned box: to its nearest of many points, and along its gradient by just as much."""
    course = build_course(
        [
            Element("floor", length=3.0),
            Element("landing", length=3.0, turn_deg=30.0),
            Element("floor", length=3.0),
        ]
    )
    obstacles = find_box_obstacles(course.boxes)
    rng = np.random.default_rng(7)
    box = int(np.flatnonzero(~obstacles.face)[-1])
    points = obstacles.centre[box] + rng.uniform(-2.5, 2.5, (200, 3))
    which = np.full(len(points), box)
    distance, normal = obstacles.distance(points, which)
    outside = distance > 0.05
    foot = points[outside] - distance[outside, None] * normal[outside]
    assert np.allclose(obstacles.distance(foot, which[outside])[0], 0.0, atol=1e-9)
    unit = rng.uniform(-1.0, 1.0, (40000, 3))
    cloud = obstacles.centre[box] + (unit * obstacles.half[box]) @ obstacles.axes[box]
    for p, d in zip(points[outside][:40], distance[outside][:40], strict=True):
        assert np.linalg.norm(cloud - p, axis=1).min() >= d - 1e-9
