"""Legs' limits along a body path: where they are, and that a path is bent until legs keep them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import paper_robot, stairs_course, stance_at

from drake_quad.common import FloatArray
from drake_quad.math.curves import BodySpline
from drake_quad.math.distance import points_to_boxes
from drake_quad.planning import body_path as body_search, leg_limits
from drake_quad.planning.body_path import (
    LEAST_TILT,
    MOST_TILT,
    PER_SWING,
    STEEPEST,
    TILT_BESIDE,
    BodyPathOptimizer,
)
from drake_quad.planning.body_problem import FIRST_PHASE, SHANKS, make_basis
from drake_quad.planning.body_reference import body_pitch
from drake_quad.planning.clearance import trunk_clearance
from drake_quad.planning.contact_plan import sample_times, swing_times
from drake_quad.planning.leg_limits import (
    SAFE,
    TRUNK_SHARE,
    LegLimits,
    Shanks,
    find_limits,
    limit_distances,
    reach_left,
    tilt_arm,
)
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.robot.kinematics import calc_feet, calc_knees
from drake_quad.robot.model import PATH, RobotModel, ThighStops


def limited() -> RobotModel:
    """The paper's robot with narrow joints, so that every limit is near."""
    robot = paper_robot()
    lower = np.array(robot.q_lower).reshape(4, 3)
    upper = np.array(robot.q_upper).reshape(4, 3)
    lower[:, :2], upper[:, :2] = [-0.4, 0.2], [0.4, 1.3]
    bent = np.sort(robot.geometry.knee_sign[:, None] * np.array([0.8, 2.0]), axis=1)
    lower[:, 2], upper[:, 2] = bent[:, 0], bent[:, 1]
    return replace(robot, q_lower=lower.ravel(), q_upper=upper.ravel())


def poses(seed: int, count: int = 20, shift: float = 0.3) -> tuple[FloatArray, FloatArray]:
    """Poses about one with the feet under the hips: bodies (N, 5), feet (N, 4, 3)."""
    rng, g = np.random.default_rng(seed), paper_robot().geometry
    stand = g.p_BH + np.stack([0.0 * g.offset, g.offset, 0.0 * g.offset], axis=-1)
    body = np.zeros((count, 5))
    body[:, :2] = rng.uniform(-shift, shift, (count, 2))
    body[:, 2] = 0.85 + rng.uniform(-shift, 0.5 * shift, count)
    body[:, 3] = rng.uniform(-shift, shift, count)
    feet = np.tile(stand, (count, 1, 1))
    feet[..., 2] = 0.0
    return body, feet


@given(st.integers(0, 2**32 - 1))
def test_room_is_negative_just_where_joints_pass_their_limits(seed: int) -> None:
    """Against the joint angles, all limits but the knee's side; reach is the knee's straightest."""
    robot = limited()
    body, feet = poses(seed)
    q, _, _ = pose_robot(robot, body, feet)
    q = q.reshape(-1, 12)
    inside = np.minimum(q - robot.q_lower, robot.q_upper - q).reshape(-1, 4, 3).min(axis=2)
    room = reach_left(robot, body, feet).min(axis=2)
    clear = np.abs(inside) > 1e-6
    np.testing.assert_array_equal((room > 0.0)[clear], (inside > 0.0)[clear])


@given(st.integers(0, 2**32 - 1), st.floats(-0.6, 0.6))
def test_sides_are_the_first_order_of_the_room(seed: int, slope: float) -> None:
    """A small shift, rising with the slope, with a lift and a tilt changes the room as it says."""
    robot = limited()
    body, feet = poses(seed)
    rise, bend = np.tile([slope, 0.0], (len(body), 1)), 0.5 * slope
    extra = np.random.default_rng(seed).uniform(-0.1, 0.1, (len(body), 2))  # these poses have it
    path = np.column_stack([body[:, :2], extra])
    limits = find_limits(robot, body, feet, rise, path, pitch=rise * 0.5)
    room = reach_left(robot, body, feet)
    if limits is None:
        assert room.min() >= 0.0
        return
    assert room.min() < 0.0
    shift = 1e-4 * np.random.default_rng(seed).uniform(-1.0, 1.0, 4)
    moved = np.array(body)
    moved[:, :2] += shift[:2]
    moved[:, 2] += slope * shift[0] + shift[2]
    moved[:, 3] += bend * shift[0] + shift[3] / tilt_arm(robot)
    path = np.column_stack([moved[:, :2], extra + shift[2:]])
    after = reach_left(robot, moved, feet)
    reach = robot.geometry.reach
    kept = np.einsum("ij,ij->i", limits.normal, path[limits.sample]) - limits.offset
    least = np.full(room.shape[0], np.inf)
    np.minimum.at(least, limits.sample, kept)
    for k in np.unique(limits.sample):
        here = (after[k] - SAFE * reach[:, None]).min()
        assert least[k] == pytest.approx(here, abs=2e-6)


def test_a_path_within_the_limits_has_no_sides() -> None:
    """So that plans that were possible are as they were."""
    body, feet = poses(0, shift=0.0)
    none = np.zeros((len(body), 4))
    assert find_limits(paper_robot(), body, feet, none[:, :2], none) is None


def test_one_leg_alone_may_be_at_its_limits() -> None:
    """The others have no sides; with shanks looked after, and far from all, it has the same."""
    robot, lane = paper_robot(), stairs_course().lanes[0]
    (body, feet), path = poses(0, count=3, shift=0.0), np.zeros((3, 4))
    body[:, 2] += 100.0  # far above any stairs
    feet[..., 2] += 100.0
    none = np.zeros((3, 2))
    q, _, _ = pose_robot(robot, body, feet)
    lower, upper = np.full((4, 3), -3.1), np.full((4, 3), 3.1)
    lower[2, 0] = q[0, 2, 0] + 0.1
    knees = np.sort(robot.geometry.knee_sign[:, None] * np.array([0.0, 3.1]), axis=1)
    lower[:, 2], upper[:, 2] = knees[:, 0], knees[:, 1]
    stiff = replace(robot, q_lower=lower.ravel(), q_upper=upper.ravel())
    alone = find_limits(stiff, body, feet, none, path)
    both = find_limits(stiff, body, feet, none, path, Shanks(lane, 0.001))
    assert alone is not None and both is not None
    np.testing.assert_array_equal(alone.sample, [0, 1, 2])
    np.testing.assert_array_equal(both.normal[~both.shank], alone.normal)


def test_a_path_is_bent_until_legs_keep_their_limits() -> None:
    """Abduction narrower than the usual path's sway: the new one keeps it, and its balance."""
    robot, settings = paper_robot(), PlanSettings()
    course = stairs_course()
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        robot, course, settings, task, stance_at(course, settings)
    )
    times = sample_times(contacts)
    feet, _ = contacts.feet_at(times)

    def most_abducted(spline: BodySpline) -> float:
        q, _, _ = pose_robot(robot, spline.samples(times)[:, 0], feet)
        return float(np.abs(q[..., 0]).max())

    usual, _, _ = plan_body(robot, contacts, route, settings)
    most = most_abducted(usual) - 0.03
    lower, upper = np.array(robot.q_lower), np.array(robot.q_upper)
    lower[0::3], upper[0::3] = -most, most
    narrow = replace(robot, q_lower=lower, q_upper=upper)
    bent, _, margin = plan_body(narrow, contacts, route, settings)
    assert most_abducted(bent) <= most
    assert margin > 0.03


def test_a_body_rises_where_its_legs_are_folded_too_far() -> None:
    """Knees that may not bend as far as the usual path has them: it lifts, and keeps its way."""
    robot, settings = paper_robot(), PlanSettings(body_height=0.70)
    course = stairs_course()
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        robot, course, settings, task, stance_at(course, settings)
    )
    usual, _, _ = plan_body(robot, contacts, route, settings)
    times = sample_times(contacts)
    feet, _ = contacts.feet_at(times)
    body = usual.samples(times)[:, 0]
    q, _, _ = pose_robot(robot, body, feet)
    most = float(np.abs(q[..., 2]).max()) - 0.05
    bent = np.sort(robot.geometry.knee_sign[:, None] * np.array([0.0, most]), axis=1)
    lower, upper = np.array(robot.q_lower), np.array(robot.q_upper)
    lower[2::3], upper[2::3] = bent[:, 0], bent[:, 1]
    stiff = replace(robot, q_lower=lower, q_upper=upper)
    path, _, margin = plan_body(stiff, contacts, route, settings)
    raised = path.samples(times)[:, 0]
    assert reach_left(stiff, body, feet).min() < 0.0 <= reach_left(stiff, raised, feet).min()
    assert np.max(raised[:, 2] - body[:, 2]) > 0.01
    np.testing.assert_allclose(raised[[0, -1]], body[[0, -1]], atol=2e-3)
    assert margin > 0.03


def test_trunk_room_is_the_distance_from_a_box() -> None:
    """Outside of it from its surface, inside negative; less the shank's radius."""
    robot = paper_robot()
    far = replace(robot, trunk_boxes=np.array([[[-0.1, -0.02, 0.2], [0.1, 0.02, 0.3]]]))
    q = np.zeros((1, 4, 3))
    p_BF = calc_feet(robot.geometry, q)
    room = trunk_clearance(far, p_BF, q)
    knee = calc_knees(robot.geometry, q)[0]
    for leg in range(4):
        low, high = far.trunk_boxes[0]
        beyond = np.maximum(np.maximum(low - knee[leg], knee[leg] - high), 0.0)
        near = room[0, leg, 0] + robot.shank_radii[leg, 0]
        assert near == pytest.approx(
            np.linalg.norm(beyond), abs=0.05
        )  # the outline is not the line
    around = replace(robot, trunk_boxes=np.array([[[-5.0, -5.0, -5.0], [5.0, 5.0, 5.0]]]))
    assert trunk_clearance(around, p_BF, q).max() < -3.0


@given(st.integers(0, 2**32 - 1))
def test_a_line_is_as_far_from_a_box_as_its_nearest_point(seed: int) -> None:
    """Also where an edge of the box is between its ends; inside it is negative."""
    rng = np.random.default_rng(seed)
    low, high = -rng.uniform(0.02, 0.3, 3), rng.uniform(0.02, 0.3, 3)
    points = rng.uniform(-0.5, 0.5, (1, 2, 3))
    box = np.stack([low, high])[None]
    told = points_to_boxes(points, box, 0.1)[0]
    between = points[0, 0] + np.linspace(0.0, 1.0, 2001)[:, None] * (points[0, 1] - points[0, 0])
    all_points = points_to_boxes(between[None], box, 0.1)[0, : len(between)]
    np.testing.assert_allclose(told[:2], all_points[[0, -1]], atol=1e-12)
    if all_points.min() < 0.1:  # of what is farther off the ends are told
        assert told[2] == pytest.approx(all_points.min(), abs=5e-3)
    assert told[2] >= all_points.min() - 1e-3


@given(st.integers(0, 2**32 - 1))
def test_of_several_boxes_the_nearest_counts_and_none_that_is_near_is_left_out(seed: int) -> None:
    """What is farther off than is asked for is told to be at least that; all else is exact."""
    rng = np.random.default_rng(seed)
    middles, sizes = rng.uniform(-0.6, 0.6, (3, 3)), rng.uniform(0.02, 0.2, (3, 3))
    boxes = np.stack([middles - sizes, middles + sizes], axis=1)
    points, enough = rng.uniform(-0.5, 0.5, (4, 3, 3)), rng.uniform(0.0, 0.5)
    alone = np.min([points_to_boxes(points, box[None], np.inf) for box in boxes], axis=0)
    told = points_to_boxes(points, boxes, enough)
    near = alone < enough - 1e-3
    np.testing.assert_allclose(told[near], alone[near], atol=1e-3)
    assert np.all(told[~near] >= enough - 2e-3)


def test_a_trunk_of_several_parts_is_no_larger_than_these() -> None:
    """Between two boxes there is room, though a box about both has none."""
    robot, q = paper_robot(), np.zeros((1, 4, 3))
    p_BF = calc_feet(robot.geometry, q)
    knee = calc_knees(robot.geometry, q)[0, 0]
    up = np.array([0.0, 0.0, 2.0])
    above, below = knee + up, knee - up
    box = np.array([[-0.1] * 3, [0.1] * 3])
    two = replace(robot, trunk_boxes=np.stack([above + box, below + box]))
    one = replace(robot, trunk_boxes=np.stack([below - 0.1, above + 0.1])[None])
    assert (
        trunk_clearance(two, p_BF, q)[0, 0].min()
        > 0.5
        > 0.0
        > trunk_clearance(one, p_BF, q)[0, 0].min()
    )


def test_a_leg_folded_onto_the_trunk_is_beyond_its_limits() -> None:
    """Where shanks are looked after, the trunk's box counts; where they are not, it does not."""
    (body, feet), none, path = poses(0, count=3, shift=0.0), np.zeros((3, 2)), np.zeros((3, 4))
    lane = stairs_course().lanes[0]
    body[:, 2] += 100.0  # far above any stairs
    feet[..., 2] += 100.0
    shanks, size = Shanks(lane, 0.02), np.array([[-1.0], [1.0]])
    small = replace(paper_robot(), trunk_boxes=0.01 * size[None] * np.ones(3))
    large = replace(paper_robot(), trunk_boxes=1.0 * size[None] * np.ones(3))
    assert find_limits(small, body, feet, none, path, shanks) is None
    assert find_limits(large, body, feet, none, path) is None
    found = find_limits(large, body, feet, none, path, shanks)
    assert found is not None and found.short > 0.5 and np.all(found.shank)


def optimizer(settings: PlanSettings) -> BodyPathOptimizer:
    """The search for the body's path of a walk over the usual stairs, as it begins."""
    robot, course = paper_robot(), stairs_course()
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        robot, course, settings, task, stance_at(course, settings)
    )
    return BodyPathOptimizer(robot, contacts, route, settings, None, np.zeros((4, 2)))


@pytest.mark.parametrize("share", [0.0, 1.0, 2.5])
def test_a_steep_body_is_free_to_tilt_back_but_hardly_further(share: float) -> None:
    """It may reach STEEPEST and no more; of one that is steeper already a little is left."""
    settings = PlanSettings(pitch_along_slope=share)
    robot, search = paper_robot(), optimizer(settings)
    times = sample_times(search.contacts)
    _, (back, ahead) = search._lift_range(times)
    steepest = search.spline.samples(times)[:, 0, 3].min()
    room = STEEPEST + float(steepest)
    expected = min(MOST_TILT, max(room, LEAST_TILT))
    np.testing.assert_allclose(-back / tilt_arm(robot), expected, atol=0.03)
    np.testing.assert_allclose(ahead / tilt_arm(robot), MOST_TILT)


@given(at=st.floats(0.05, 0.95), turn=st.floats(0.0, 2.0 * np.pi))
def test_a_body_rises_and_pitches_by_a_shift_as_the_ground_does(at: float, turn: float) -> None:
    """To first order, also where a flight begins: there its pitch changes along the way."""
    search = optimizer(PlanSettings(pitch_along_slope=1.2))
    body = search.spline.samples(np.array([at * search.contacts.duration]))[:, 0]
    rise, pitch = search._follows(body)
    way = 0.01 * np.array([[np.cos(turn), np.sin(turn)]])
    along = float(way[0] @ [np.cos(body[0, 4]), np.sin(body[0, 4])])
    ends = [search._route.ground(body[:, :2] + s * way)[1] for s in (-1.0, 1.0)]
    before, after = (body_pitch(1.2, end)[0] for end in ends)
    if abs(along) == pytest.approx(0.01, rel=1e-3):  # straight along the lane
        assert 2.0 * float(way[0] @ pitch[0]) == pytest.approx(after - before, abs=1e-6)
    slope = search._route.ground(body[:, :2])[1][0]
    np.testing.assert_allclose(way @ rise[0], slope * along, atol=1e-12)


def test_limits_of_a_path_know_that_bodies_pitch(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a search asks for its limits has the pitch of bodies that come onto a flight."""
    search, asked = optimizer(PlanSettings(pitch_along_slope=1.2)), []
    monkeypatch.setattr(body_search, "find_limits", lambda *_, **more: asked.append(more["pitch"]))
    search.find_limits()
    assert np.abs(asked[0]).max() > 0.2  # [rad/m]


def test_distances_that_jump_have_no_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where two shapes take turns the difference says nothing of the way out."""
    body, feet = poses(0, count=3, shift=0.0)
    plain = np.full((3, 4, 6), 0.5)
    plain[:, 0, 0] = -0.01

    def jumps(robot: RobotModel, at: FloatArray, feet: FloatArray, *_: object) -> FloatArray:
        moved = np.abs(at[:, 0] - body[: len(at), 0]).max() > 0.0
        return (plain if feet.shape[1] == 4 else plain[:, :1]) + (1.0 if moved else 0.0)

    monkeypatch.setattr(leg_limits, "limit_distances", jumps)
    found = find_limits(paper_robot(), body, feet, np.zeros((3, 2)), np.zeros((3, 4)))
    assert found is not None and found.short == pytest.approx(0.1) and len(found.sample) == 0


def test_beside_a_steep_flight_a_body_may_tilt() -> None:
    """Where a flight ends one foot still stands next to it: not so where the body is steep."""
    settings = PlanSettings(pitch_along_slope=2.5, max_ahead=0.05, max_shift=0.05)
    robot, search = paper_robot(), optimizer(settings)
    times = sample_times(search.contacts)
    _, (back, _) = search._lift_range(times) / tilt_arm(robot)
    pitch = search.spline.samples(times)[:, 0, 3]
    steep, level = pitch < 0.9 * pitch.min(), pitch > -0.01
    assert steep.any() and level.any() and STEEPEST + pitch.min() < LEAST_TILT
    np.testing.assert_allclose(-back[steep], LEAST_TILT)
    assert np.all(-back <= TILT_BESIDE + 1e-12) and (-back[level]).max() == pytest.approx(
        TILT_BESIDE
    )
    # Wherever a body may be just then, it does not become steeper than STEEPEST, but for a little.
    assert np.all(-back <= np.maximum(STEEPEST + pitch, LEAST_TILT) + 1e-9)
    wide = search._lift_range(times, beside=20)[1, 0] / tilt_arm(robot)
    assert np.all(wide >= back - 1e-12) and (wide > back + 1e-3).any()


def test_shanks_short_at_one_time_are_kept_away_at_others() -> None:
    """Each phase of the contacts has its own slack: one that has to be used is not all phases'."""
    search = optimizer(PlanSettings())
    path = search.solve(broken=1e-6)
    times = search._times
    count = len(times)
    early, late = count // 4, 3 * count // 4
    x = make_basis(times, search._knot, len(path)).at(path)[:, 0, 0]
    normal = np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    # Early no path can be both ahead of and behind a place; late a little ahead of it is easy.
    limits = LegLimits(
        np.array([early, early, late]), normal,
        np.array([x[early] + 0.05, -x[early] + 0.05, x[late] + 0.02]), np.ones(3, dtype=bool), 1.0,
        np.zeros(count),
    )  # fmt: skip
    search._limits = limits
    found = search.solve(broken=1e-6)
    there = make_basis(times, search._knot, len(found)).at(found)[:, 0, 0]
    assert there[late] >= x[late] + 0.02 - 1e-5
    assert abs(there[early] - x[early]) < 0.05  # neither of the two is kept
    slack = search._solution.scalars if search._solution is not None else np.zeros(6)
    assert slack[SHANKS] == pytest.approx(slack[FIRST_PHASE:].max(), abs=1e-5) and slack[SHANKS] > 0
    assert np.sum(slack[FIRST_PHASE:] > 1e-4) == 1 and not search.keeps_limits


def test_shanks_are_looked_at_between_a_paths_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """At moments of every swing, of which the nearest sample is asked what they are short of."""
    course, settings = stairs_course(), PlanSettings(shank_room=0.05)
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        paper_robot(), course, settings, task, stance_at(course, settings)
    )
    search = BodyPathOptimizer(paper_robot(), contacts, route, settings, None, np.zeros((4, 2)))
    looked_at = []

    def all_short(_: object, body: FloatArray, *others: object, **more: object) -> LegLimits:
        looked_at.append(body)
        count = len(body)
        every, none = np.arange(count), np.zeros(count)
        beyond = np.full(count, 0.5)
        return LegLimits(every, np.zeros((count, 4)), none, np.ones(count, dtype=bool), 0.5, beyond)

    monkeypatch.setattr(body_search, "find_limits", all_short)
    assert search.find_limits() == 0.5
    times = sample_times(contacts)
    every = np.union1d(times, swing_times(contacts, PER_SWING))
    assert len(every) > 1.3 * len(times)
    np.testing.assert_allclose(looked_at[0], search.spline.samples(every)[:, 0])
    found = search._limits
    assert found is not None
    asked = np.abs(times[found.sample] - every)
    np.testing.assert_allclose(asked, np.abs(times[:, None] - every).min(axis=0), atol=1e-9)


def test_the_limits_know_thighs_that_come_into_the_trunk() -> None:
    """Where a trunk is wide they say so, and the way out; far from it they do not."""
    robot = paper_robot()
    shanks = Shanks(None, 0.01)
    body = np.array([[0.0, 0.0, 1.0, 0.0, 0.0]])
    feet = calc_feet(robot.geometry, np.array([[0.0, 0.5, -1.0]] * 4)) + body[0, :3]
    plain = limit_distances(robot, body, feet[None], shanks, 0.1)
    middle = robot.geometry.p_BH.mean(axis=0)
    path = np.zeros((4, 1, PATH, 3))
    path[..., 2] = -robot.geometry.thigh[:, None, None] * np.linspace(0.0, 1.0, PATH)
    hip = float(np.abs(robot.geometry.p_BH[:, 1] + robot.geometry.offset).min())
    for gap, counts in ((-0.01, True), (0.1, False)):
        wide = hip - 0.05 - gap
        half = np.array([2.0, wide, 0.3])
        box = np.stack([middle - half, middle + half])[None]
        stops = ThighStops(boxes=box, paths=path, radii=np.full((4, 1), 0.05))
        found = limit_distances(replace(robot, thigh_stops=stops), body, feet[None], shanks, 0.1)
        np.testing.assert_array_equal(found[..., :-1], plain[..., :-1])
        if counts:
            np.testing.assert_allclose(found[..., -1], gap - TRUNK_SHARE * 0.01, atol=1e-9)
            wider = replace(robot, thigh_stops=stops)
            sides = find_limits(wider, body, feet[None], np.zeros((1, 2)), np.zeros((1, 4)), shanks)
            assert sides is not None and np.sum(sides.shank) == 4  # one for each thigh
            # Left thighs lean inwards as the body goes to the left, right ones outwards.
            lateral = sides.normal[sides.shank, 1]
            assert np.all(lateral[[0, 2]] < -0.1) and np.all(np.abs(lateral[[1, 3]]) < 0.02)
        else:
            assert np.all(found[..., -1] >= 0.1)
