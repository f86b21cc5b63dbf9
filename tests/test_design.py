"""Gait design: what is judged on endless stairs holds on a course, and what fails is told."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rig import paper_robot

from drake_quad.check_stairs import check_stairs
from drake_quad.design import choose, kernel
from drake_quad.design.candidate import (
    EDGE,
    LOWER,
    UPPER,
    Grid,
    bounds,
    make_grid,
    make_patterns,
)
from drake_quad.design.choose import ENOUGH, choose_gaits, highest_rise
from drake_quad.design.course import flights_of
from drake_quad.design.cycle import PHASES, make_cycle
from drake_quad.design.evaluate import NAMES, evaluate, lacking_room, wanted_room
from drake_quad.design.fields import control_fields
from drake_quad.design.kernel_distance import SHANK, THIGH, from_stairs, line_from_stairs
from drake_quad.design.search import HOPELESS, SURELY, Search
from drake_quad.design.shape import SHANK_POINTS, Shape, read_shape
from drake_quad.design.staircase import Staircase
from drake_quad.design.words import describe_gait
from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.planning.pattern import Pattern
from drake_quad.planning.shank_room import (
    distance,
    from_nosings,
    knee_axes,
    shank_middles,
    shank_room,
)
from drake_quad.robot.leg_kinematics import calc_jacobians, calc_knees
from drake_quad.scenario import parse_scenario
from drake_quad.scenario_build import control_settings, course_of
from drake_quad.scenario_config_control import ControllerConfig

MODEL = "package://drake_quad_models/paper_quadruped.urdf"
coordinates = st.floats(-2.0, 2.0)


@cache
def shape() -> Shape:
    return read_shape(paper_robot())


@given(coordinates, coordinates, st.floats(-0.3, 0.3), st.floats(0.1, 0.6))
def test_distance_from_stairs_is_that_of_the_nearest_point(
    s: float, z: float, rise: float, run: float
) -> None:
    """Against a dense sampling of the profile; inside it is negative."""
    assume(abs(s / run - np.floor(s / run) - 0.5) > 1e-3)  # on a riser either tread is right
    stairs = Staircase(rise, run)
    assume(abs(z - float(stairs.line(np.array(s)))) < run)  # it looks two treads to either side
    found = from_stairs(s, z, rise, run)
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
    ends = [from_stairs(x[0], x[2], rise, run) for x in (p, q)]
    told = min(*ends, line_from_stairs(p, q, rise, run))
    between = p + np.linspace(0.0, 1.0, 401)[:, None] * (q - p)
    nearest = min(from_stairs(x[0], x[2], rise, run) for x in between)
    if nearest > 1e-3:
        assert told == pytest.approx(nearest, abs=1e-3)
    if nearest < -1e-3:
        assert told < 0.0


def test_a_shank_over_a_nosing_between_its_points_is_seen_on_a_course() -> None:
    """Go1's rear shanks touched the nosings that they leaned over as it came down."""
    lane = course_of(
        parse_scenario(
            "course: [{kind: floor, length: 3}, {kind: stairs, going: up, rise: 0.2, run: 0.3, "
            "count: 1}, {kind: floor, length: 3}]",
            source="test",
        )
    ).lanes[0]
    line = np.array([[2.9, 0.0, 0.11], [3.1, 0.0, 0.3]])  # 3.5 mm over it, its ends far away
    assert distance(lane, line).min() > 0.05
    assert from_nosings(lane, line)[0] == pytest.approx(0.005 / np.sqrt(2.0), abs=3e-4)
    assert from_nosings(lane, line - [0.0, 0.0, 0.01])[0] < 0.0


@given(st.integers(0, 2**32 - 1))
def test_kernel_has_the_robots_own_kinematics(seed: int) -> None:
    """Angles, centre of mass, torques and points are those of the robot floor."""
    rng, robot = np.random.default_rng(seed), paper_robot()
    g = robot.geometry
    legs = np.column_stack([g.p_BH, g.offset, g.thigh, g.shank, g.knee_sign])
    masses = np.concatenate([[robot.trunk_mass], robot.link_mass.ravel()])
    coms = np.concatenate([robot.trunk_com[None], robot.link_com.reshape(12, 3)])
    body = np.array([*rng.uniform(-0.1, 0.1, 2), 0.8, rng.uniform(-0.5, 0.5), 0.0])
    feet = g.p_BH - np.array([0.0, 0.0, 0.8]) + rng.uniform(-0.15, 0.15, (4, 3)) + body[:3]
    q, excess, com = pose_robot(robot, body[None], feet[None])
    cp, sp = np.cos(body[3]), np.sin(body[3])
    found, points = np.empty((4, 3)), np.empty((4, SHANK + THIGH, 3))
    offsets = rng.uniform(-0.1, 0.1, (4, SHANK))
    R = rotations(body)
    J = calc_jacobians(g, q[0])
    for k in range(4):
        room = kernel._angles(legs[k], body, feet[k], 0.0, cp, sp, found[k])
        assert (room < 0.0) == (excess[0, k] > 0.0) or abs(room) < 1e-5
        force = rng.uniform(0.0, 300.0)
        torque = J[k].T @ (R.T @ [0.0, 0.0, -force])
        used = kernel._torques(legs[k], found[k], force, cp, sp, robot.effort[3 * k : 3 * k + 3])
        assert used == pytest.approx(np.max(np.abs(torque) / robot.effort[3 * k : 3 * k + 3]))
        kernel._points(legs[k], found[k], body, 0.0, cp, sp, feet[k], offsets[k], points[k])
    np.testing.assert_allclose(found, q[0], atol=1e-9)
    knees = body[:3] + calc_knees(g, q[0]) @ R.T
    middles = shank_middles(offsets, knees, feet, knee_axes(q[0]) @ R.T)
    np.testing.assert_allclose(points[:, :SHANK], middles, atol=1e-9)
    lines = knees[:, None] + SHANK_POINTS[:, None] * (feet - knees)[:, None]
    np.testing.assert_allclose(np.linalg.norm(middles - lines, axis=2), np.abs(offsets), atol=1e-9)
    centre = np.empty(3)
    kernel._centre(body, found, legs, masses, coms, cp, sp, centre)
    np.testing.assert_allclose(centre, com[0], atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_kernel_has_the_gait_floors_margin_and_fair_shares(seed: int, air: int) -> None:
    """Sway only where it helps; three feet carry the weight without a moment."""
    rng = np.random.default_rng(seed)
    corners = [[0.4, 0.3, 0.0], [0.4, -0.3, 0.0], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]]
    feet = np.array(corners) + rng.uniform(-0.1, 0.1, (4, 3))
    com = np.array([*rng.uniform(-0.15, 0.15, 2), 0.6])
    standing = np.arange(4) != air
    still = stability_margins(com[None, :2], feet[None, :, :2], standing[None])[0]
    assert kernel._margin(com[0], com[1], feet, air) == pytest.approx(still, abs=1e-9)
    sway, margin = kernel._sway(com, feet, air, 0.2, 0.05)
    moved = np.array([[com[0], com[1] + sway]])
    assert margin == pytest.approx(
        stability_margins(moved, feet[None, :, :2], standing[None])[0], abs=1e-9
    )
    assert margin >= min(still, 0.05) - 1e-3
    forces = np.zeros(4)
    kernel._share(com[0], com[1], feet, air, 100.0, forces)
    assert forces[air] == 0.0 and forces.sum() == pytest.approx(100.0)
    np.testing.assert_allclose(forces @ feet[:, :2] / 100.0, com[:2], atol=1e-9)


def some_gaits(pattern: Pattern, count: int = 12) -> Grid:
    """Candidates all over what is free."""
    parameters = np.random.default_rng(0).uniform(LOWER, UPPER, (count, len(LOWER)))
    return make_grid(paper_robot(), pattern, parameters)


@pytest.mark.parametrize("rise", [0.15, -0.15])
def test_feet_of_a_cycle_stand_whole_on_treads(rise: float) -> None:
    """Every standing foot is on a tread, at its height, no nearer to an end than it is wide."""
    stairs, radius = Staircase(rise, 0.3), 0.03
    for pattern in make_patterns(paper_robot(), [stairs.run]):
        cycle = make_cycle(some_gaits(pattern), stairs, foot_radius=radius, clearance=0.02)
        place = np.round(cycle.feet[..., 0] / stairs.run)
        stands = np.broadcast_to(cycle.standing, place.shape)
        off = np.abs(cycle.feet[..., 0] - place * stairs.run)
        assert np.all(off[stands] <= 0.5 * stairs.run - radius - EDGE + 1e-9)
        height = cycle.feet[..., 2] - radius - stairs.rise * place
        np.testing.assert_allclose(height[stands], 0.0, atol=1e-9)


@settings(max_examples=15)
@given(st.floats(0.02, 0.2), st.floats(0.25, 0.6))
def test_a_weaker_robot_has_no_more_room(rise: float, run: float) -> None:
    """Half the torque leaves less of it, and nothing else changes."""
    robot, stairs = paper_robot(), Staircase(rise, run)
    grid = some_gaits(Pattern(1, 2))
    weak = replace(robot, effort=0.5 * robot.effort)
    full = evaluate(robot, shape(), grid, stairs, clearance=0.02)
    half = evaluate(weak, shape(), grid, stairs, clearance=0.02)
    k = NAMES.index("torque")
    assert np.all(half[:, k] <= full[:, k] + 1e-12)
    np.testing.assert_array_equal(np.delete(half, k, axis=1), np.delete(full, k, axis=1))


@given(st.integers(0, 2**32 - 1), st.floats(-1.0, 5.0))
def test_only_the_hopeless_are_not_looked_at_to_the_end(seed: int, enough: float) -> None:
    """Those that lack no more than enough are judged in full, the others lack more than that."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.4)
    parameters = np.random.default_rng(seed).uniform(LOWER, UPPER, (8, len(LOWER)))
    grid, limits = make_grid(robot, Pattern(), parameters), np.full(8, enough)
    full = evaluate(robot, shape(), grid, stairs, clearance=0.02)
    quick = evaluate(robot, shape(), grid, stairs, clearance=0.02, enough=limits)
    wanted = wanted_room(robot)
    good = lacking_room(full, wanted) <= enough
    np.testing.assert_array_equal(quick[good], full[good])
    assert np.all(lacking_room(quick[~good], wanted) > enough)
    for name in ("height", "shift_down"):
        np.testing.assert_array_equal(getattr(grid.take(good), name), getattr(grid, name)[good])


def test_one_candidate_alone_is_judged_as_among_others() -> None:
    """A grid of one gives the same row."""
    robot, stairs = paper_robot(), Staircase(-0.13, 0.4)
    parameters = np.random.default_rng(1).uniform(LOWER, UPPER, (8, len(LOWER)))
    many = evaluate(robot, shape(), make_grid(robot, Pattern(), parameters), stairs, clearance=0.02)
    for k in (0, 3, 7):
        grid = make_grid(robot, Pattern(), parameters[k])
        one = evaluate(robot, shape(), grid, stairs, clearance=0.02)
        np.testing.assert_allclose(one[0], many[k], atol=1e-12)


def test_higher_steps_are_never_easier() -> None:
    """The best score falls, if anything, as rises grow; the highest rise that works works."""
    robot = paper_robot()
    scores = []
    for rise in (0.05, 0.15, 0.3, 0.6):
        flights = [Staircase(rise, 0.35), Staircase(-rise, 0.35)]
        scores.append(max(d.score for d in choose_gaits(robot, shape(), flights)))
    assert scores[0] > 0.5 > 0.0 > scores[-1]
    highest = highest_rise(robot, shape(), 0.35, below=0.6)
    assert highest is not None and 0.1 < highest < 0.6
    assert any(d.feasible for d in choose_gaits(robot, shape(), [Staircase(highest, 0.35)]))


def test_a_good_gait_comes_before_other_patterns_are_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On easy stairs one search answers; who asks for more gets each other pattern once."""
    searched = []
    least = Search.least

    def counted(search: Search, first: FloatArray, seed: int, **ends: float) -> FloatArray:
        searched.append(search)
        return least(search, first, seed, **ends)

    monkeypatch.setattr(Search, "least", counted)
    flights = [Staircase(0.1, 0.4), Staircase(-0.1, 0.4)]
    gaits = choose_gaits(paper_robot(), shape(), flights)
    first = next(gaits)
    assert first.score >= ENOUGH and len(searched) == 1
    others = list(gaits)
    assert len(searched) == 1 + len(others) > 1
    assert len({d.gait.pattern for d in (first, *others)}) == 1 + len(others)


@pytest.mark.parametrize("nearly", [-np.inf, choose.NEARLY])
def test_before_a_no_it_is_searched_from_elsewhere_too(
    monkeypatch: pytest.MonkeyPatch, nearly: float
) -> None:
    """Where nearly a gait was found; these stairs are far beyond all, for nothing is infinite."""
    seeds = []

    def hopeless(search: Search, first: FloatArray, seed: int, **ends: float) -> FloatArray:
        seeds.append(seed)
        return first[0]

    monkeypatch.setattr(Search, "least", hopeless)
    monkeypatch.setattr(choose, "NEARLY", nearly)
    flights = [Staircase(0.9, 0.3), Staircase(-0.9, 0.3)]
    gaits = list(choose_gaits(paper_robot(), shape(), flights))
    assert not any(d.feasible for d in gaits)
    assert seeds == sorted(seeds) and seeds.count(1) > 0
    assert seeds.count(2) == (seeds.count(1) if nearly == -np.inf else 0)


def test_a_search_ends_with_enough_or_as_hopeless() -> None:
    """With no less room than was asked for; and where much too much is lacking, early."""
    robot, (lower, upper, _) = paper_robot(), bounds(Pattern(1, 2))
    first = lower + np.random.default_rng(0).random((40, len(lower))) * (upper - lower)

    def lacking(rise: float, **ends: float) -> tuple[float, int]:
        flights = [Staircase(rise, 0.4), Staircase(-rise, 0.4)]
        search, asked = Search(robot, shape(), Pattern(1, 2), flights), []
        search_call = type(search).__call__

        class Counted(Search):
            def __call__(self, x: FloatArray) -> FloatArray:
                asked.append(x.shape[1])
                return search_call(self, x)

        search.__class__ = Counted
        x = search.least(first, 1, **ends)
        search.rivals = None
        return float(search(x[:, None])[0]), len(asked)

    best, whole = lacking(0.1)
    found, until = lacking(0.1, enough=SURELY)
    assert best <= found <= SURELY and until < 0.5 * whole
    _, whole = lacking(0.9)
    _, until = lacking(0.9, hopeless=HOPELESS)
    assert until < 0.6 * whole


@given(st.floats(0.2, 1.2), st.floats(0.005, 0.05))
def test_the_thicker_the_foot_the_sooner_it_is_followed(size: float, radius: float) -> None:
    """Past the shipped robot's thickness, scaled, a foot rolls as far as any before it is seen."""

    def follow(foot_radius: float) -> float:
        return float(control_fields(1.0, size, foot_radius)["foothold_time"])

    shipped = 0.008 * size  # the paper robot's foot, for legs of this size
    thick = max(radius, shipped)
    assert follow(thick) * thick == pytest.approx(follow(shipped) * shipped, rel=1e-3)
    assert follow(0.5 * shipped) == follow(shipped)  # thin feet: no slower than that
    assert follow(shipped) == pytest.approx(ControllerConfig().foothold_time * size**0.5, rel=1e-3)


def test_design_and_plan_agree_on_the_room() -> None:
    """A gait that is chosen for building-code stairs has a plan on them, and its room is real."""
    check = check_stairs(MODEL, rise=0.17, run=0.29, count=3)
    assert check.designed is not None
    designed = check.designed
    assert designed.margin > 0.02 and designed.room.distance > 0.005
    assert designed.scenario.design == "given" and set(designed.design.slacks) == set(NAMES)
    assert designed.margin >= designed.design.slacks["margin"] - 0.03


def test_stairs_out_of_reach_are_told_with_what_would_work() -> None:
    """The limit, by how much, the gait that came nearest, and a rise that works."""
    check = check_stairs(MODEL, rise=0.8, run=0.25, count=3)
    assert not check.feasible
    for words in ("rise 0.8 m on a run of 0.25 m", "a cycle", "could work"):
        assert words in check.reason
    nearest = check.data["nearest_rise"]
    assert check_stairs(MODEL, rise=0.5 * nearest, run=0.25, count=3).feasible


def test_runs_that_no_stance_fits_are_told() -> None:
    """Treads of two metres: front and rear feet would be on the same one, or 2 m apart."""
    check = check_stairs(MODEL, rise=0.1, run=2.0, count=2)
    assert not check.feasible and "fits between its hips" in check.reason


def test_kinds_of_steps_are_found_once() -> None:
    """Alike steps of a course count once, up and down apart."""
    scenario = parse_scenario(
        """
        course:
          - {kind: floor, length: 3}
          - {kind: stairs, going: up, rises: [0.1, 0.1, 0.12], run: 0.4}
          - {kind: landing, length: 3, turn_deg: 90}
          - {kind: stairs, going: down, rise: 0.1, run: 0.4, count: 3}
          - {kind: floor, length: 3}
        """,
        source="test",
    )
    found = {(round(s.rise, 6), round(s.run, 6)) for s in flights_of(course_of(scenario))}
    assert found == {(0.1, 0.4), (0.12, 0.4), (-0.1, 0.4)}


@given(st.integers(0, 2**32 - 1))
def test_room_on_a_course_is_that_on_endless_stairs(seed: int) -> None:
    """In the middle of a long flight the course's distance is the staircase's."""
    scenario = parse_scenario(
        "course: [{kind: floor, length: 3}, {kind: stairs, going: up, rise: 0.15, run: 0.3, "
        "count: 20}, {kind: floor, length: 3}]",
        source="test",
    )
    lane = course_of(scenario).lanes[0]
    rng = np.random.default_rng(seed)
    p = rng.uniform([4.5, -0.5, 0.5], [6.5, 0.5, 2.0], (20, 3))
    # Tread 0 of the endless staircase is the flight's fifth: its middle, at its height.
    s, z = p[:, 0] - (3.0 + 4.5 * 0.3), p[:, 2] - 5 * 0.15
    expected = [from_stairs(a, b, 0.15, 0.3) for a, b in zip(s, z, strict=True)]
    np.testing.assert_allclose(distance(lane, p), expected, atol=1e-9)


def test_feedback_of_the_papers_robot_is_what_it_was_found_to_be() -> None:
    """Scaling by one changes nothing; a scenario's defaults are the same numbers."""
    fields = control_fields(1.0, 1.0, paper_robot().foot_radius)
    default = ControllerConfig()
    for name, value in fields.items():
        if name not in ("kind", "period"):
            assert value == pytest.approx(getattr(default, name)), name


def test_robot_and_course_are_enough_of_a_scenario() -> None:
    """A file that names a robot and no gait asks for a design; any gait of its own does not."""
    course = "course: [{kind: floor, length: 8}]\n"
    robot = f"robot: {{model: '{MODEL}'}}\n"
    assert parse_scenario(robot + course, source="a").design == "auto"
    assert parse_scenario(course, source="a").design == "given"
    assert parse_scenario(robot + course + "gait: {stride: 0.5}", source="a").design == "given"
    assert parse_scenario(course + "design: auto", source="a").design == "auto"
    assert control_settings(parse_scenario(course, source="a")).kind == "ik"


@pytest.mark.parametrize("rise", [0.15, -0.15])
def test_feet_of_a_cycle_were_set_down_where_they_stand(rise: float) -> None:
    """At the moment that `landed` names, or a whole round of cycles before."""
    stairs = Staircase(rise, 0.3)
    patterns = make_patterns(paper_robot(), [stairs.run])
    patterns += make_patterns(paper_robot(), [stairs.run], per_tread=2)
    for pattern in patterns:
        parameters = np.stack([bounds(pattern)[2]] * 2)
        grid = make_grid(paper_robot(), pattern, parameters)
        cycle = make_cycle(grid, stairs, foot_radius=0.01, clearance=0.02)
        x, n = cycle.feet[0, :, :, 0], len(cycle.swing)
        rounds = n // (4 * len(PHASES))
        way = rounds * pattern.treads * stairs.run / pattern.per_tread
        ahead = x - np.take_along_axis(x, cycle.landed, axis=0)
        at = np.arange(n)[:, None]
        expected = np.where(cycle.landed > at, -way, 0.0)  # in the round before
        np.testing.assert_allclose(ahead[cycle.standing], expected[cycle.standing], atol=1e-9)


def test_the_search_knows_that_feet_roll() -> None:
    """The margin of a candidate that does not sway is that of feet rolled since they landed."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.5)
    pattern = make_patterns(robot, [stairs.run])[0]
    grid = make_grid(robot, pattern, bounds(pattern)[2][None])
    cycle = make_cycle(grid, stairs, foot_radius=robot.foot_radius, clearance=0.02)
    body, feet = cycle.body[0], cycle.feet[0]
    q, _, com = pose_robot(robot, body, feet)
    tilt = body[:, 3, None] + q[..., 1] + q[..., 2]
    roll = robot.foot_radius * (tilt - np.take_along_axis(tilt, cycle.landed, axis=0))
    rolled = feet.copy()
    rolled[..., 0] += roll

    def least(places: FloatArray) -> float:
        return min(
            kernel._margin(*com[n, :2], places[n], int(cycle.swing[n])) for n in range(len(com))
        )

    assert abs(least(rolled) - least(feet)) > 1e-4
    found = unswayed(grid, stairs, shape())
    assert found[NAMES.index("margin")] == pytest.approx(least(rolled), abs=1e-9)


def unswayed(grid: Grid, stairs: Staircase, outline: Shape) -> FloatArray:
    """The room (7,) by NAMES of a grid of one on stairs, if its body does not sway."""
    robot, g = paper_robot(), paper_robot().geometry
    cycle = make_cycle(grid, stairs, foot_radius=robot.foot_radius, clearance=0.02)
    found = np.full((1, len(NAMES)), np.inf)
    kernel.slacks(
        cycle.body, cycle.feet, cycle.swing, cycle.landed, stairs.rise, stairs.run,
        robot.foot_radius,
        np.column_stack([g.p_BH, g.offset, g.thigh, g.shank, g.knee_sign]),
        np.stack([robot.q_lower, robot.q_upper, robot.effort]),
        np.concatenate([[robot.trunk_mass], robot.link_mass.ravel()]),
        np.concatenate([robot.trunk_com[None], robot.link_com.reshape(12, 3)]),
        np.stack([outline.trunk_lower, outline.trunk_upper]),
        np.stack([outline.shank_offsets, outline.shank_radii]),
        0.0, wanted_room(robot), found, np.full(1, np.inf),
    )  # fmt: skip
    return found[0]


@pytest.mark.parametrize(("point", "worth"), [(-1, 3.0), (3, 1.0)])
def test_a_distance_counts_three_times_at_a_shanks_end_alone(point: int, worth: float) -> None:
    """Where one place of shanks is nearest, a centimetre more of it takes that much room."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.5)
    pattern = make_patterns(robot, [stairs.run])[0]
    grid = make_grid(robot, pattern, bounds(pattern)[2][None])
    room = []
    for radius in (0.2, 0.21):
        radii = np.full((4, len(SHANK_POINTS)), -1.0)  # as thin as to be never in the way
        radii[:, point] = radius
        outline = replace(shape(), shank_radii=radii)
        room.append(unswayed(grid, stairs, outline)[NAMES.index("legs")])
    assert room[0] - room[1] == pytest.approx(worth * 0.01, abs=1e-9)


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        (Pattern(1, 2), "1 tread a cycle, rear"),
        (Pattern(2, 3), "2 treads a cycle, rear"),
        (Pattern(1, 3, 2), "1 place a cycle, 2 to a tread, rear"),
        (Pattern(2, 4, 2), "2 places a cycle, 2 to a tread, rear"),
    ],
)
def test_a_gait_is_told_in_words(pattern: Pattern, words: str) -> None:
    """How far a cycle goes, and how treads are shared."""
    first = next(choose_gaits(paper_robot(), shape(), [Staircase(0.1, 0.4)]))
    _, _, usual = bounds(pattern)
    told = describe_gait(replace(first, gait=make_grid(paper_robot(), pattern, usual)))
    assert told.startswith(f"({words} feet {pattern.lag} behind, body ")


def test_a_leaning_shanks_end_is_looked_at() -> None:
    """Over a nosing just behind a thin foot it is what touches first, and where a third will do.

    Four steps of 0.25 m by 0.3 m were called feasible with a shank that came down on the last
    nosing before its foot did, and the robot fell.
    """
    robot, rise, run = paper_robot(), 0.25, 0.3
    assert robot.shank_radii[0, -1] == pytest.approx(0.018) and robot.foot_radius < 0.01
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
        room = shank_room(robot, lane, body[None], feet[None], q)[0, 0]
        knee = body[:3] + calc_knees(robot.geometry, q)[0, 0]
        end = knee + SHANK_POINTS[-1] * (foot - knee)
        told = room[len(SHANK_POINTS) - 1]
        assert told == pytest.approx(distance(lane, end[None])[0] - 0.018, abs=1e-9)
        assert (told < 0.0) == inside
