"""Gait design: what is judged on endless stairs holds on a course, and what fails is told."""

from dataclasses import replace

import numpy as np
import pytest
from design_rig import MODEL, shape
from hypothesis import given, settings, strategies as st
from rig import paper_robot

from drake_quad.control.settings import ControlSettings
from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight
from drake_quad.gait_design.candidates import (
    EDGE,
    LOWER,
    PHASES,
    UPPER,
    CandidateBatch,
    Staircase,
    candidate_bounds,
    flights_of,
    make_candidates,
    make_cycle,
    make_foothold_patterns,
)
from drake_quad.gait_design.choose_gait import choose_gaits
from drake_quad.gait_design.designer import FOUND_RADIUS, control_fields, scenario_fields
from drake_quad.gait_design.objective import NAMES, evaluate_candidates
from drake_quad.math.ground_distance import point_to_stairs
from drake_quad.planning.clearance import from_ground, from_nosings
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import DESIGNED, parse_scenario
from drake_quad.terrain.elements import Stairs


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
    assert from_ground(lane, line).min() > 0.05
    assert from_nosings(lane, line)[0] == pytest.approx(0.005 / np.sqrt(2.0), abs=3e-4)
    assert from_nosings(lane, line - [0.0, 0.0, 0.01])[0] < 0.0


def some_gaits(pattern: FootholdPattern, count: int = 12) -> CandidateBatch:
    """Candidates all over what is free."""
    parameters = np.random.default_rng(0).uniform(LOWER, UPPER, (count, len(LOWER)))
    return make_candidates(paper_robot(), pattern, parameters)


@pytest.mark.parametrize("rise", [0.15, -0.15])
def test_feet_of_a_cycle_stand_whole_on_treads(rise: float) -> None:
    """Every standing foot is on a tread, at its height, no nearer to an end than it is wide."""
    stairs, radius = Staircase(rise, 0.3), 0.03
    for pattern in make_foothold_patterns(paper_robot(), [stairs.run]):
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
    """With half the torque twice as much of it is used, and nothing else changes.

    Of one leg alone, it may be that one or another that lacks room.
    """
    robot, stairs = paper_robot(), Staircase(rise, run)
    grid = some_gaits(FootholdPattern(1, 2))
    weak = replace(robot, effort=0.5 * robot.effort)
    full = evaluate_candidates(robot, shape(), grid, stairs, clearance=0.02)
    half = evaluate_candidates(weak, shape(), grid, stairs, clearance=0.02)
    k = NAMES.index("torque")
    np.testing.assert_allclose(1.0 - half[:, k], 2.0 * (1.0 - full[:, k]), rtol=1e-9)
    lame = [
        evaluate_candidates(
            replace(robot, effort=robot.effort * np.where(np.arange(12) // 3 == leg, 0.5, 1.0)),
            shape(), grid, stairs, clearance=0.02,
        )[:, k]
        for leg in range(4)
    ]  # fmt: skip
    np.testing.assert_allclose(np.min(lame, axis=0), half[:, k], rtol=1e-9)
    assert all(np.all(one >= half[:, k] - 1e-12) for one in lame)
    np.testing.assert_array_equal(np.delete(half, k, axis=1), np.delete(full, k, axis=1))


@given(st.floats(0.2, 1.2), st.floats(0.005, 0.05))
def test_the_thicker_the_foot_the_sooner_it_is_followed(size: float, radius: float) -> None:
    """Past the thickness it was found with, scaled, feet roll as far as any before it is seen."""

    def follow(foot_radius: float) -> float:
        return float(control_fields(1.0, size, foot_radius)["foothold_time"])

    shipped = FOUND_RADIUS * size  # of the feet that it was found with
    thick = max(radius, shipped)
    assert follow(thick) * thick == pytest.approx(follow(shipped) * shipped, rel=1e-3)
    assert follow(0.5 * shipped) == follow(shipped)  # thin feet: no slower than that
    own = paper_robot().foot_radius * size  # the defaults are for the shipped robot
    assert follow(own) == pytest.approx(ControlSettings().foothold_time * size**0.5, rel=1e-3)


def test_design_and_plan_agree_on_the_room() -> None:
    """A gait that is chosen for building-code stairs has a plan on them, and its room is real."""
    check = check_flight(MODEL, Stairs(0.17, 0.29, 3))
    assert check.designed is not None
    designed = check.designed
    assert designed.margin > 0.02 and designed.clearance.distance > 0.005
    assert designed.scenario.design == "given" and set(designed.design.slacks) == set(NAMES)
    assert designed.margin >= designed.design.slacks["margin"] - 0.03


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
    expected = [point_to_stairs(a, b, 0.15, 0.3) for a, b in zip(s, z, strict=True)]
    np.testing.assert_allclose(from_ground(lane, p), expected, atol=1e-9)


def test_feedback_of_the_papers_robot_is_what_it_was_found_to_be() -> None:
    """Scaling by one changes nothing; a scenario's defaults are the same numbers."""
    fields = control_fields(1.0, 1.0, paper_robot().foot_radius)
    default = ControlSettings()
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
    assert parse_scenario(course, source="a").controller.kind == "ik"


def test_to_set_a_field_does_not_make_a_gait_ones_own() -> None:
    """What a design leaves alone may be set; what it fills in would be lost, and is refused."""
    text = f"robot: {{model: '{MODEL}'}}\ncourse: [{{kind: floor, length: 8}}]\n"
    for override in ("controller.friction=0.6", "gait.margin=friction", "gait={}"):
        assert parse_scenario(text, source="a", overrides=[override]).design == "auto"
    for override in ("gait.cycle_time=6", "gait={cycle_time: 6}", "body.margin_desired=0.05"):
        with pytest.raises(InputError, match="the design fills that in"):
            parse_scenario(text, source="a", overrides=[override])
        given = parse_scenario(text, source="a", overrides=[override, "design=given"])
        assert given.design == "given"


def test_what_a_design_fills_in_is_what_may_not_be_set() -> None:
    """The names that the scenario knows of are those of the design, no more and no fewer."""
    design = next(choose_gaits(paper_robot(), shape(), [Staircase(0.0, 0.5)]))
    fields = scenario_fields(paper_robot(), design, [])
    assert {section: frozenset(own) for section, own in fields.items()} == DESIGNED


@pytest.mark.parametrize("rise", [0.15, -0.15])
def test_feet_of_a_cycle_were_set_down_where_they_stand(rise: float) -> None:
    """At the moment that `landed` names, or a whole round of cycles before."""
    stairs = Staircase(rise, 0.3)
    patterns = make_foothold_patterns(paper_robot(), [stairs.run])
    patterns += make_foothold_patterns(paper_robot(), [stairs.run], per_tread=2)
    for pattern in patterns:
        parameters = np.stack([candidate_bounds(pattern)[2]] * 2)
        grid = make_candidates(paper_robot(), pattern, parameters)
        cycle = make_cycle(grid, stairs, foot_radius=0.01, clearance=0.02)
        x, n = cycle.feet[0, :, :, 0], len(cycle.swing)
        rounds = n // (4 * len(PHASES))
        way = rounds * pattern.treads * stairs.run / pattern.per_tread
        ahead = x - np.take_along_axis(x, cycle.landed, axis=0)
        at = np.arange(n)[:, None]
        expected = np.where(cycle.landed > at, -way, 0.0)  # in the round before
        np.testing.assert_allclose(ahead[cycle.standing], expected[cycle.standing], atol=1e-9)
