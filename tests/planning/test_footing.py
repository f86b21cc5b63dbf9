"""Plans whose margin is that of the true region of balance: on tilted ground, on weak drives."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given, settings as hypothesis_settings, strategies as st
from rig import (
    course_of,
    flat_course,
    paper_robot,
    rotations,
    stairs_course,
    stance_at,
    walk_plan,
)  # fmt: skip

from drake_quad.common import FloatArray
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.mission import join_plans
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.replan import replan_task
from drake_quad.planning.stance_margin import Footing, footing_of
from drake_quad.planning.task import plan_task
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.plan_report import describe_plan
from drake_quad.stability.equilibrium_region import (
    are_hulls,
    find_region,
    is_hull,
    joint_limits,
    leg_limits,
    make_contacts,
)
from drake_quad.stability.margin_kinds import FEASIBLE, FRICTION, HULL, KINDS, stricter
from drake_quad.terrain.course import Course, ground_normals
from drake_quad.terrain.elements import Element

FEW = hypothesis_settings(max_examples=40, deadline=None)
SEEDS = st.integers(0, 2**32 - 1)
SHORT = PlanSettings(cycle_time=6.0)


def walk(
    kind: str,
    *,
    course: Course | None = None,
    robot: RobotModel | None = None,
    goal: float = 2.25,
    settings: PlanSettings = SHORT,
) -> MotionPlan:
    """A short walk planned for a margin of that kind."""
    course, robot = course or flat_course(), robot or paper_robot()
    asked = replace(settings, margin=kind)
    task = Task(kind="walk", name="walk", lane=0, goal=goal)
    return plan_task(robot, course, asked, task, stance_at(course, asked), index=0)


@cache
def level_walk(kind: str) -> MotionPlan:
    """The same of the shipped robot on level ground."""
    return walk(kind)


def weakened(*legs: int, share: float) -> RobotModel:
    """The shipped robot with so much of its torque left in some legs' hips and knees."""
    robot = paper_robot()
    effort = np.array(robot.effort).reshape(4, 3)
    effort[list(legs), 1:] *= share
    return replace(robot, effort=effort.ravel())


def gutter(places: FloatArray, *, slope: float) -> FloatArray:
    """Normals of two planes that meet in the x axis, each so steep; a ridge if negative."""
    found = np.zeros((*places.shape[:-1], 3))
    found[..., 1] = -slope * np.sign(places[..., 1])
    found[..., 2] = 1.0
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def side_slope(places: FloatArray, *, slope: float) -> FloatArray:
    """Normals of one plane that rises to the left."""
    found = np.tile([0.0, -slope, 1.0], (*places.shape[:-1], 1))
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def body_over(footing: Footing | None) -> tuple[FloatArray, float]:
    """Times and poses (6, N) of a path planned for a footing, and its least margin by that."""
    contacts, route, _ = plan_walk_footsteps(
        paper_robot(), flat_course(), SHORT, Task(kind="walk", name="walk", lane=0, goal=2.25),
        stance_at(flat_course(), SHORT),
    )  # fmt: skip
    spline, contacts, margin = plan_body(paper_robot(), contacts, route, SHORT, footing)
    times = sample_times(contacts)
    return np.array([times, *spline.samples(times)[:, 0].T]), margin


@pytest.mark.parametrize("course", [flat_course(), stairs_course()], ids=["floor", "stairs"])
def test_on_level_treads_the_friction_path_is_the_hulls(course: Course) -> None:
    """There the region is the hull by the theorem, so that not even rounding differs."""
    goal = 2.25 if course is flat_course() else 6.25
    hull, friction = (walk(kind, course=course, goal=goal) for kind in (HULL, FRICTION))
    np.testing.assert_allclose(friction.body.control, hull.body.control, atol=1e-9)
    assert friction.margin == pytest.approx(hull.margin, abs=1e-9)


def test_strong_drives_take_no_margin() -> None:
    """Feasible and hull agree on level ground where no torque is in the way."""
    assert level_walk(FEASIBLE).margin == pytest.approx(level_walk(HULL).margin, abs=1e-3)


@pytest.mark.parametrize(
    ("normals", "friction", "more"),
    [
        (partial(gutter, slope=0.7), 0.6, 2e-3),
        (partial(gutter, slope=-0.7), 0.6, 2e-3),
        # It is the hull of where the feet touch, a little beside that of their middles.
        (partial(side_slope, slope=0.45), 0.5, 2e-4),
    ],
    ids=["gutter", "ridge", "side slope"],
)
def test_path_for_the_region_has_no_less_of_its_margin_than_the_hulls(
    normals: Callable[[FloatArray], FloatArray], friction: float, more: float
) -> None:
    """Where ground is tilted, and more where no foot could carry its load alone."""
    footing = Footing(paper_robot(), normals, friction, drives=False)
    planned = body_over(footing)[1]
    times, *body = body_over(None)[0]
    contacts, _, _ = plan_walk_footsteps(
        paper_robot(), flat_course(), SHORT, Task(kind="walk", name="walk", lane=0, goal=2.25),
        stance_at(flat_course(), SHORT),
    )  # fmt: skip
    feet, standing = contacts.feet_at(times)
    other = footing.stances(np.array(body).T.copy(), feet, standing).margins().min()
    assert planned > other + more


@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_weak_legs_are_leant_away_from(side: int) -> None:
    """Where the hull's path has the least feasible margin the other is farther from weak feet."""
    weak = (0, 2) if side > 0 else (1, 3)
    robot = weakened(*weak, share=0.5)
    hull, feasible = (walk(kind, robot=robot) for kind in (HULL, FEASIBLE))
    times = sample_times(hull.contacts)
    footing = footing_of(robot, flat_course(), replace(SHORT, margin=FEASIBLE))
    assert footing is not None
    feet, standing = hull.contacts.feet_at(times)
    bodies = [plan.body.samples(times)[:, 0] for plan in (hull, feasible)]
    stances = [footing.stances(body, feet, standing) for body in bodies]
    margins = [s.margins() for s in stances]
    worst = int(np.argmin(margins[0]))
    near = [
        min(
            np.hypot(*(s.com[worst] - feet[worst, leg])[:2]) for leg in weak if standing[worst, leg]
        )
        for s in stances
    ]
    assert near[1] > near[0] + 2e-3
    assert margins[1].min() > margins[0].min() + 2e-3


@pytest.mark.parametrize("kind", [FRICTION, FEASIBLE])
def test_margin_of_a_plan_is_what_the_regions_give(kind: str) -> None:
    """Measured anew, pose by pose, from contacts and torque limits made by hand."""
    course, robot = ramp(), weakened(0, 1, share=0.5)
    plan = walk(kind, course=course, robot=robot, goal=3.25)
    times = sample_times(plan.contacts)[::7]
    feet, standing = plan.contacts.feet_at(times)
    body = plan.body.samples(times)[:, 0]
    q, _, com = pose_robot(robot, body, feet)
    found = []
    for k, who in enumerate(standing):
        normals = ground_normals(course, feet[k, who, :2])
        contacts = make_contacts(feet[k, who] - robot.foot_radius * normals, normals, 0.5)
        limits = joint_limits(robot, rotations(body)[k], q[k], who) if kind == FEASIBLE else None
        found.append(find_region(contacts, limits=limits).margin(*com[k, :2]))
    footing = footing_of(robot, course, replace(SHORT, margin=kind))
    assert footing is not None
    theirs = footing.stances(body, feet, standing).margins()
    np.testing.assert_allclose(theirs, found, atol=1e-6)
    assert plan.margin <= min(found) + 1e-6 and plan.margin_kind == kind


@cache
def ramp() -> Course:
    """Two floors with a short steep ramp between, on which only one or two feet are at a time."""
    return course_of(
        Element("floor", length=2.4), Element("slope", going="up", length=0.6, height=0.3),
        Element("floor", length=3.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("robot", "kind", "course", "helps"),
    [
        (weakened(0, 1, 2, 3, share=0.1), FEASIBLE, flat_course(), "stronger drives"),
        (None, FRICTION, None, "controller.friction"),
    ],
    ids=["weak", "slippery"],
)
def test_a_robot_that_cannot_stand_is_told_what_would_help(
    robot: RobotModel | None, kind: str, course: Course | None, helps: str
) -> None:
    """In one line, and never with a plan."""
    steep = course_of(
        Element("floor", length=2.0), Element("slope", going="up", length=3.0, height=1.8),
        Element("floor", length=2.0),
    )  # fmt: skip
    with pytest.raises(PlanningError, match=helps) as caught:
        walk(kind, robot=robot, course=course or steep, goal=2.4)
    assert "\n" not in caught.value.reason and "nothing holds the robot" in caught.value.reason


def test_a_stand_is_looked_at_too() -> None:
    """A mission that only stands is refused as well, if the drives cannot hold it."""
    settings = replace(SHORT, margin=FEASIBLE)
    task = Task(kind="stand", name="stand", lane=0, duration=1.0)
    stance = stance_at(flat_course(), settings)
    weak = weakened(0, 1, 2, 3, share=0.1)
    plan_task(paper_robot(), flat_course(), settings, task, stance, index=0)
    with pytest.raises(PlanningError, match="FL, FR, RL, RR"):
        plan_task(weak, flat_course(), settings, task, stance, index=0)


def test_a_plan_made_anew_keeps_the_kind() -> None:
    """After a push the margin asked for, and told, is still the same."""
    settings = replace(SHORT, margin=FRICTION)
    plan = level_walk(FRICTION)
    sample = plan.sample(plan.contacts.steps[2].lift_off)
    again = replan_task(
        paper_robot(), flat_course(), settings, plan, plan.contacts.steps[2].lift_off,
        type(stance_at(flat_course(), settings))(sample.body[0], sample.feet),
    )  # fmt: skip
    assert again.margin_kind == FRICTION and again.revision == 1


def test_told_beside_the_hulls_margin_and_not_in_its_place() -> None:
    """`plan --json` keeps `planned_margin_min` and adds that of the kind."""
    plan = level_walk(FEASIBLE)
    settings = replace(SHORT, margin=FEASIBLE)
    footing = footing_of(paper_robot(), flat_course(), settings)
    told = describe_plan(
        paper_robot(), join_plans([plan], 0.0), massless_legs=False, footing=footing
    )
    assert told["margin_kind"] == FEASIBLE
    assert told["planned_margin_feasible_min"] == pytest.approx(plan.margin, abs=1e-9)
    by_segment = [s["margin_feasible_min"] for s in told["segments"]]
    assert min(by_segment) == told["planned_margin_feasible_min"]
    bare = describe_plan(paper_robot(), join_plans([walk_plan(flat_course(), goal=2.25)], 0.0),
                         massless_legs=False)  # fmt: skip
    assert bare["margin_kind"] == HULL and "planned_margin_hull_min" not in bare


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("gait: {margin: torque}", "gait.margin"),
        ("gait: {margin: friction}\nbody: {balance: dynamic}", "gait.margin"),
    ],
)
def test_margins_that_cannot_be_are_refused(text: str, field: str) -> None:
    """An unknown word, and a static margin of a gait that has none."""
    document = "course: [{kind: floor, length: 4.0}]\n" + text
    with pytest.raises(InputError) as caught:
        parse_scenario(document, source="test")
    assert caught.value.field == field


def test_stricter_of_two_kinds_is_the_one_further_on() -> None:
    """Whatever the order in which they are given."""
    for i, one in enumerate(KINDS):
        for j, other in enumerate(KINDS):
            assert stricter(one, other) == KINDS[max(i, j)]


@FEW
@given(SEEDS)
def test_many_stances_are_told_hulls_as_one_is(seed: int) -> None:
    """`are_hulls` is `is_hull`, stance by stance."""
    rng = np.random.default_rng(seed)
    places = rng.uniform([-0.5, -0.3, -0.4], [0.5, 0.3, 0.4], (8, 4, 3))
    normals = np.tile([0.0, 0.0, 1.0], (8, 4, 1))
    tilted = rng.random((8, 4)) < 0.1
    normals[tilted] = [0.6, 0.0, 0.8]
    standing = rng.random((8, 4)) < 0.8
    friction = float(rng.uniform(0.2, 3.0))
    expected = [
        is_hull(make_contacts(p[who], n[who], friction))
        for p, n, who in zip(places, normals, standing, strict=True)
    ]
    np.testing.assert_array_equal(are_hulls(places, normals, standing, friction), expected)


def test_limits_of_many_poses_are_those_of_each() -> None:
    """`leg_limits` is `joint_limits`, pose by pose."""
    plan, robot = level_walk(HULL), paper_robot()
    times = np.linspace(0.0, plan.duration, 9)
    feet, standing = plan.contacts.feet_at(times)
    body = plan.body.samples(times)[:, 0]
    q, _, _ = pose_robot(robot, body, feet)
    many = leg_limits(robot, rotations(body), q)
    for k, who in enumerate(standing):
        one = joint_limits(robot, rotations(body)[k], q[k], who)
        np.testing.assert_allclose(many.rows[k, who], one.rows, atol=1e-12)
        np.testing.assert_allclose(many.upper[k, who], one.upper, atol=1e-12)
