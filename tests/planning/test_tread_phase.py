"""Where on treads feet stand and how the body leads: nothing on level ground, all on a flight."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.planning.body_reference import (
    half_window,
    sideways_shift,
    steepness,
    tilting_ground,
    tread_offset,
)
from drake_quad.planning.foothold_grid import FootholdGrid, make_foothold_grid
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.problem import PlanSettings
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario

RISE, RUN = 0.15, 0.3
SETTINGS = PlanSettings(
    pattern=FootholdPattern(1, 2),
    tread_phase_up=-0.2,
    tread_phase_down=0.3,
    body_shift_up=-0.1,
    body_shift_down=0.12,
    pitch_along_slope=1.0,
)


def lattice(going: str = "up", count: int = 12) -> FootholdGrid:
    text = f"""
    course:
      - {{kind: floor, length: 4}}
      - {{kind: stairs, going: {going}, rise: {RISE}, run: {RUN}, count: {count}}}
      - {{kind: floor, length: 4}}
    """
    lane = course_of(parse_scenario(text, source="test")).lanes[0]
    return make_foothold_grid(
        lane, start=1.5, goal=lane.length - 1.5, spacing=RUN, behind=2, per_cycle=1
    )


@pytest.mark.parametrize(("going", "sign"), [("up", 1.0), ("down", -1.0)])
def test_steepness_is_one_on_a_flight_and_nothing_far_from_it(going: str, sign: float) -> None:
    """With the sign of the way it leads; never beyond one."""
    places = lattice(going)
    s = np.linspace(places.s[0], places.s[-1], 400)
    share = steepness(places, s, 0.4)
    assert np.all(np.abs(share) <= 1.0) and np.all(sign * share >= 0.0)
    middle, ends = 4.0 + 6 * RUN, [1.5, places.s[-1] - 0.5]
    assert steepness(places, np.array([middle]), 0.4)[0] == pytest.approx(sign)
    np.testing.assert_allclose(steepness(places, np.array(ends), 0.4), 0.0, atol=1e-9)


@pytest.mark.parametrize(("going", "phase"), [("up", -0.2), ("down", 0.3)])
def test_feet_and_body_are_shifted_on_the_flight_alone(going: str, phase: float) -> None:
    """By the share of a tread and the length asked for that way; not at all on level ground."""
    places = lattice(going)
    on = int(np.argmin(np.abs(places.s - (4.0 + 6.5 * RUN))))
    assert tread_offset(places, on, RUN, SETTINGS) == pytest.approx(phase * RUN)
    assert tread_offset(places, 2, RUN, SETTINGS) == 0.0
    shift = sideways_shift(places, np.array([places.s[on], 1.5]), SETTINGS)
    wanted = SETTINGS.body_shift_up if going == "up" else SETTINGS.body_shift_down
    np.testing.assert_allclose(shift, [wanted, 0.0], atol=1e-9)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_level_ground_shifts_nothing(up: float, down: float) -> None:
    """Whatever is asked for on stairs."""
    text = "course: [{kind: floor, length: 9}]"
    lane = course_of(parse_scenario(text, source="test")).lanes[0]
    flat = make_foothold_grid(lane, start=2.0, goal=6.0, spacing=0.4, behind=2)
    settings = PlanSettings(body_shift_up=up, body_shift_down=down, tread_phase_up=up)
    np.testing.assert_array_equal(sideways_shift(flat, flat.s, settings), 0.0)
    assert tread_offset(flat, 3, 0.4, settings) == 0.0
    assert half_window(flat, settings) == pytest.approx(0.5 * settings.workspace.P_x)


@pytest.mark.parametrize("going", ["up", "down"])
def test_ground_of_a_tilting_body_is_the_slope_and_has_no_steps(going: str) -> None:
    """On the flight the line through the treads; on its way there it moves without a jump."""
    places = lattice(going)
    s = np.linspace(places.s[2], places.s[-2], 4000)
    height, slope = tilting_ground(places, s, SETTINGS)
    assert np.max(np.abs(np.diff(height))) < 2.0 * RISE / RUN * (s[1] - s[0])
    assert np.max(np.abs(np.diff(slope))) < 0.02
    middle = int(np.argmin(np.abs(s - (4.0 + 6.0 * RUN))))
    sign = 1.0 if going == "up" else -1.0
    assert slope[middle] == pytest.approx(sign * RISE / RUN)
    assert height[middle] == pytest.approx(float(places.height(s[middle : middle + 1])[0]))
