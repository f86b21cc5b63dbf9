"""The search's distances are true: of legs from stairs, and of shanks from one another."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from design_rig import shape, unswayed
from hypothesis import assume, given, settings, strategies as st
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.gait_design.candidates import (
    CandidateBatch,
    Staircase,
    candidate_bounds,
    make_candidates,
    make_cycle,
    make_foothold_patterns,
)
from drake_quad.gait_design.clearance_kernels import (
    SHANK,
    THIGH,
    clearance_between_legs,
    clearance_under_line,
    pose_leg_clearance,
    pose_trunk_clearance,
)
from drake_quad.gait_design.objective import NAMES
from drake_quad.math.ground_distance import (
    FAR,
    from_nosing,
    line_over_nosings,
    line_to_stairs,
    point_to_stairs,
)
from drake_quad.math.rotations import rotations
from drake_quad.planning.clearance import (
    from_ground,
    from_nosings,
    knee_axes,
    shank_clearance,
    shank_middles,
)
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.model import SHANK_POINTS
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario

coordinates = st.floats(-2.0, 2.0)


@given(coordinates, coordinates, st.floats(-0.3, 0.3), st.floats(0.1, 0.6))
def test_distance_from_stairs_is_that_of_the_nearest_point(
    s: float, z: float, rise: float, run: float
) -> None:
    """Against a dense sampling of the profile; inside it is negative."""
    assume(abs(s / run - np.floor(s / run) - 0.5) > 1e-3)  # on a riser either tread is right
    stairs = Staircase(rise, run)
    assume(abs(z - float(stairs.line(np.array(s)))) < run)  # it looks two treads to either side
    found = point_to_stairs(s, z, rise, run)
    i = np.arange(-40, 41)[:, None]
    along = np.linspace(0.0, 1.0, 201)
    tops = np.stack(np.broadcast_arrays((i - 0.5 + along) * run, i * rise), axis=-1).reshape(-1, 2)
    heights = (i + along - (1.0 if rise > 0.0 else 0.0)) * rise
    edges = (i - 0.5) if rise > 0.0 else (i + 0.5)
    heights = heights if rise > 0.0 else (i + along) * rise
    risers = np.stack(np.broadcast_arrays(edges * run, heights), axis=-1).reshape(-1, 2)
    nearest = np.min(np.linalg.norm(np.concatenate([tops, risers]) - [s, z], axis=1))
    ground = rise * np.round(s / run)
    if z > ground + 1e-9:
        assert found == pytest.approx(nearest, abs=0.01)
    elif z < ground - 1e-9:
        assert found <= 0.0


@settings(max_examples=300)
@given(
    st.tuples(coordinates, coordinates), st.floats(-3.1, 3.1), st.floats(0.02, 0.2),
    st.floats(-0.3, 0.3), st.floats(0.1, 0.6),
)  # fmt: skip
def test_a_nosing_between_two_points_is_seen(
    begin: tuple[float, float], way: float, length: float, rise: float, run: float
) -> None:
    """Points and the line between them are as near to the stairs as the line's nearest point.

    Where the line goes through what is below a nosing the distance is negative.
    """
    stairs, (s, z) = Staircase(rise, run), begin
    assume(abs(z - float(stairs.line(np.array(s)))) < 0.5 * run and length < run)
    p = np.array([s, 0.0, z])
    q = p + length * np.array([np.cos(way), 0.0, np.sin(way)])
    ends = [point_to_stairs(x[0], x[2], rise, run) for x in (p, q)]
    told = min(*ends, line_to_stairs(p, q, rise, run))
    between = p + np.linspace(0.0, 1.0, 401)[:, None] * (q - p)
    nearest = min(point_to_stairs(x[0], x[2], rise, run) for x in between)
    if nearest > 1e-3:
        assert told == pytest.approx(nearest, abs=1e-3)
    if nearest < -1e-3:
        assert told < 0.0


@given(coordinates, st.floats(0.0, 2.0), st.floats(-0.3, 0.3), st.floats(0.1, 0.6))
def test_what_is_above_the_nosings_is_as_far_from_the_stairs(
    s: float, above: float, rise: float, run: float
) -> None:
    """The plane through the nosings is no farther off than the stairs; below it nothing is told."""
    z = float(Staircase(rise, run).line(np.array(s))) + above
    assert line_over_nosings(s, z, rise, run) <= point_to_stairs(s, z, rise, run) + 1e-9
    k = np.floor(s / run)
    nosing = (k + 0.5) * run, max(k, k + 1.0) * rise if rise > 0.0 else k * rise
    assert line_over_nosings(nosing[0], nosing[1] + 1e-9, rise, run) == pytest.approx(0.0, abs=1e-8)
    assert line_over_nosings(nosing[0], nosing[1] - 1e-6, rise, run) == -np.inf


@settings(max_examples=300)
@given(st.integers(0, 2**32 - 1), st.floats(-0.3, 0.5), st.floats(-0.3, 0.3), st.floats(0.1, 0.6))
def test_what_is_passed_over_would_have_changed_nothing(
    seed: int, least: float, rise: float, run: float
) -> None:
    """Room is the less of what there was and of what is found if there was none."""
    rng = np.random.default_rng(seed)
    middle = np.array([0.0, 0.0, rng.uniform(-0.3, 0.6)])
    front, rear = (
        middle + np.cumsum(rng.uniform(-0.12, 0.12, (SHANK + THIGH, 3)), axis=0) for _ in range(2)
    )
    front += [rng.uniform(0.0, 0.8), 0.0, 0.0]
    radii = rng.uniform(0.0, 0.05, (2, SHANK))
    box = np.array([[-0.2, -0.1, -0.1], [0.2, 0.1, 0.1]])
    parts = np.array([box + front[k] for k in rng.integers(0, SHANK, 2)])
    parts += rng.uniform(-0.4, 0.4, (2, 1, 3)) * rng.integers(0, 2)  # often a shank is in one
    trunk = np.stack([[parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)], *parts])
    line = middle + np.linspace(-0.4, 0.4, 7)[:, None] * [1.0, 0.0, rng.uniform(-0.5, 0.5)]
    rooms: tuple[Callable[[float], float], ...] = (
        lambda least: pose_leg_clearance(front, radii[0], rise, run, least),
        lambda least: pose_trunk_clearance(front[:SHANK], radii[0], trunk, least),
        lambda least: clearance_between_legs(front, rear, radii[0], radii[1], least),
        lambda least: clearance_under_line(line, rise, run, least),
    )
    for room in rooms:
        assert room(least) == pytest.approx(min(least, room(np.inf)), abs=1e-12)
    alone = [pose_trunk_clearance(front[:SHANK], radii[0], np.stack([p, p]), np.inf) for p in parts]
    assert pose_trunk_clearance(front[:SHANK], radii[0], trunk, np.inf) == pytest.approx(min(alone))


@pytest.mark.parametrize(("point", "worth"), [(-1, 3.0), (3, 1.0)])
def test_a_distance_counts_three_times_at_a_shanks_end_alone(point: int, worth: float) -> None:
    """Where one place of shanks is nearest, a centimetre more of it takes that much room."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.5)
    pattern = make_foothold_patterns(robot, [stairs.run])[0]
    grid = make_candidates(robot, pattern, candidate_bounds(pattern)[2][None])
    room = []
    for radius in (0.2, 0.21):
        radii = np.full((4, len(SHANK_POINTS)), -1.0)  # as thin as to be never in the way
        radii[:, point] = radius
        outline = replace(shape(), shank_radii=radii)
        room.append(unswayed(grid, stairs, outline)[NAMES.index("legs")])
    assert room[0] - room[1] == pytest.approx(worth * 0.01, abs=1e-9)


def test_a_leaning_shanks_end_is_looked_at() -> None:
    """Over a nosing just behind a thin foot it is what touches first, and where a third will do.

    Four steps of 0.25 m by 0.3 m were called feasible with a shank that came down on the last
    nosing before its foot did, and the robot fell.
    """
    robot, rise, run = replace(paper_robot(), foot_radius=0.008), 0.25, 0.3
    assert robot.shank_radii[0, -1] == pytest.approx(0.018)
    lane = course_of(
        parse_scenario(
            f"course: [{{kind: floor, length: 3}}, {{kind: stairs, going: up, rise: {rise}, "
            f"run: {run}, count: 1}}, {{kind: floor, length: 3}}]",
            source="test",
        )
    ).lanes[0]
    foot = np.array([3.04, 0.3, rise + robot.foot_radius])  # 40 mm ahead of the nosing
    for lean, inside in ((0.2, False), (1.2, True)):
        hip = foot + 0.9 * np.array([-np.sin(lean), 0.0, np.cos(lean)])
        body = np.array([hip[0] - robot.geometry.p_BH[0, 0], 0.0, hip[2], 0.0, 0.0])
        feet = np.tile(foot, (4, 1))
        q, excess, _ = pose_robot(robot, body[None], feet[None])
        assert excess[0, 0] == 0.0
        room = shank_clearance(robot, lane, body[None], feet[None], q)[0, 0]
        knee = body[:3] + calc_knees(robot.geometry, q)[0, 0]
        end = knee + SHANK_POINTS[-1] * (foot - knee)
        told = room[len(SHANK_POINTS) - 1]
        assert told == pytest.approx(from_ground(lane, end[None])[0] - 0.018, abs=1e-9)
        assert (told < 0.0) == inside


@pytest.mark.parametrize("rise", [0.2, -0.2])
def test_the_search_sees_nosings_between_a_shanks_points(rise: float) -> None:
    """Of two points of shanks and the line between them, the nearest place is what is told."""
    robot, stairs, thick, unseen = paper_robot(), Staircase(rise, 0.4), 0.02, 0.0
    pattern = make_foothold_patterns(robot, [stairs.run])[0]
    lower, upper, _ = candidate_bounds(pattern)
    rng = np.random.default_rng(0)
    for i in rng.integers(1, len(SHANK_POINTS) - 1, 120):  # none that counts more than it is
        radii = np.full((4, len(SHANK_POINTS)), -1.0)  # as thin as to be never in the way
        radii[:, i - 1 : i + 1] = thick
        grid = make_candidates(robot, pattern, rng.uniform(lower, upper)[None])
        body, feet, q = posed(grid, stairs)
        R = rotations(body)
        knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
        across = np.einsum("nij,nlj->nli", R, knee_axes(q))
        ends = shank_middles(robot.shank_offsets, knees, feet, across)[:, :, i - 1 : i + 1]
        way = np.linspace(0.0, 1.0, 41)[:, None]
        places = ends[:, :, :1] + way * (ends[:, :, 1:] - ends[:, :, :1])
        away = [point_to_stairs(p[0], p[2], rise, 0.4) - thick for p in places.reshape(-1, 3)]
        by_place = np.reshape(away, (-1, len(way)))
        told = unswayed(grid, stairs, replace(shape(), shank_radii=radii))[NAMES.index("legs")]
        if 0.0 < by_place.min() < 0.05:  # farther off it may be less exact
            assert told == pytest.approx(by_place.min(), abs=2e-3)
            unseen = max(unseen, by_place[:, [0, -1]].min() - by_place.min())
    assert unseen > 0.003  # what points alone would not have told


def posed(grid: CandidateBatch, stairs: Staircase) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bodies (N, 5), feet that rolled (N, 4, 3) and angles of a grid of one, not swaying."""
    robot = paper_robot()
    cycle = make_cycle(grid, stairs, foot_radius=robot.foot_radius, clearance=0.02)
    body, feet = cycle.body[0], np.array(cycle.feet[0])
    q, _, _ = pose_robot(robot, body, feet)
    tilt = body[:, 3, None] + q[..., 1] + q[..., 2]
    roll = robot.foot_radius * (tilt - np.take_along_axis(tilt, cycle.landed, axis=0))
    feet[..., 0] += np.where(cycle.standing, roll, 0.0)
    return body, feet, pose_robot(robot, body, feet)[0]


def test_the_room_of_shanks_is_of_the_lines_between_their_points_too() -> None:
    """Of each to the nosing next to it, less the thinner of its ends."""
    robot = paper_robot()
    course = course_of(
        parse_scenario(
            "course: [{kind: floor, length: 3}, {kind: stairs, going: up, rise: 0.25, run: 0.3, "
            "count: 3}, {kind: floor, length: 3}]",
            source="test",
        )
    )
    lane, radii = course.lanes[0], robot.shank_radii
    rng = np.random.default_rng(0)
    body = rng.uniform([3.0, -0.1, 1.0, -0.3, 0.0], [3.8, 0.1, 1.3, 0.3, 0.0], (40, 5))
    feet = body[:, None, :3] + robot.geometry.p_BH - [0.0, 0.0, 0.9]
    q, _, _ = pose_robot(robot, body, feet)
    R = rotations(body)
    knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
    across = np.einsum("nij,nlj->nli", R, knee_axes(q))
    lines = from_nosings(lane, shank_middles(robot.shank_offsets, knees, feet, across))
    told = shank_clearance(robot, lane, body, feet, q)[..., len(SHANK_POINTS) :]
    np.testing.assert_allclose(told, lines - np.minimum(radii[:, :-1], radii[:, 1:]), atol=1e-12)
    assert told.min() < 0.0 < told.max()


def test_nosings_that_are_passed_over_are_not_the_nearest() -> None:
    """Lines near, over and below a flight's nosings: as by looking at every nosing, to the bit."""
    text = (
        "course: [{kind: floor, length: 2.0, width: 2.0}, "
        "{kind: stairs, going: up, rise: 0.2, run: 0.3, count: 8, width: 2.0}, "
        "{kind: floor, length: 2.0, width: 2.0}]"
    )
    (lane,) = course_of(parse_scenario(text, source="t")).lanes
    points = np.random.default_rng(1).uniform([0.0, -0.1, -0.3], [6.0, 0.1, 2.0], (500, 4, 3))
    told = from_nosings(lane, points)
    for row, line in zip(told, points, strict=True):
        for i in range(3):
            p, q = ((float(v[0]), float(v[2])) for v in (line[i], line[i + 1]))
            every = [
                from_nosing(p, q, float(at), float(max(low, high)), FAR) if low != high else FAR
                for at, low, high in zip(
                    lane.breaks[1:-1], lane.heights, lane.heights[1:], strict=False
                )
            ]
            assert row[i] == min(every)
    assert np.any(told < -0.1) and np.any(told == FAR)
