"""Room for an uncertain map: the ground that a swing is planned over covers what may really be."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from rig import paper_robot, stairs_course, stance_at

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.swing import plan_swing
from drake_quad.gait.swing_clearance import KEEN, inflate_profile
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.robot.legs import Leg

RADIUS = 0.02
CLEARANCE = 0.05
Profile = tuple[FloatArray, FloatArray]

ERRORS = st.tuples(st.floats(0.0, 0.04), st.floats(0.0, 0.03))


def profile_of(runs: list[float], rises: list[float]) -> Profile:
    """Treads of these lengths, with these risers between them."""
    edges = np.concatenate([[0.0], np.cumsum(runs)])
    heights = np.concatenate([[0.0], np.cumsum(rises)])
    return np.repeat(edges, 2)[1:-1], np.repeat(heights, 2)


PROFILES = st.integers(2, 4).flatmap(
    lambda n: st.builds(
        profile_of,
        st.lists(st.floats(0.2, 0.5), min_size=n, max_size=n),
        st.lists(
            st.floats(-0.16, 0.16).filter(lambda r: abs(r) > 0.04), min_size=n - 1, max_size=n - 1
        ),
    )
)


def top(profile: Profile, d: FloatArray) -> FloatArray:
    """Height at `d`; at a riser the higher of its ends."""
    below, above = (np.interp(d + e, *profile) for e in (-1e-9, 1e-9))
    return np.maximum(below, above)


@given(PROFILES)
def test_without_an_error_the_ground_is_the_maps_to_the_bit(profile: Profile) -> None:
    """The very arrays, so that plans for an exact map are what they were."""
    d, z = inflate_profile(*profile, place=0.0, height=0.0)
    assert d is profile[0] and z is profile[1]


@given(PROFILES, ERRORS)
def test_ground_is_raised_and_never_lowered_but_known_at_both_feet(
    profile: Profile, errors: tuple[float, float]
) -> None:
    """At least as high everywhere, by the height's error at most where no riser moved."""
    place, height = errors
    d, z = inflate_profile(*profile, place=place, height=height)
    assert np.all(np.diff(d) >= 0.0)
    assert (d[0], d[-1]) == (profile[0][0], profile[0][-1])
    np.testing.assert_allclose([z[0], z[-1]], [profile[1][0], profile[1][-1]], atol=1e-12)
    at = np.linspace(0.0, d[-1], 400)
    assert np.all(top((d, z), at) >= np.interp(at, *profile) - 1e-9)
    near = np.max([top(profile, np.clip(at + k, 0.0, d[-1]))
                   for k in np.linspace(-place - 1e-6, place + 1e-6, 41)], axis=0)  # fmt: skip
    assert np.all(np.interp(at, d, z) <= near + height + 2 * KEEN)


@given(PROFILES, ERRORS, ERRORS)
def test_more_error_is_never_less_room(
    profile: Profile, a: tuple[float, float], b: tuple[float, float]
) -> None:
    """The ground rises with either error."""
    more = [max(x, y) for x, y in zip(a, b, strict=True)]
    at = np.linspace(0.0, profile[0][-1], 400)
    less = inflate_profile(*profile, place=a[0], height=a[1])
    high = inflate_profile(*profile, place=more[0], height=more[1])
    assert np.all(top(high, at) >= np.interp(at, *less) - 2 * KEEN)


@given(PROFILES, ERRORS)
def test_the_way_back_has_the_same_ground(profile: Profile, errors: tuple[float, float]) -> None:
    """Walked the other way, the profile is the same backwards."""
    place, height = errors
    length = profile[0][-1]
    d, z = inflate_profile(*profile, place=place, height=height)
    back_d, back_z = inflate_profile(length - profile[0][::-1], profile[1][::-1],
                                     place=place, height=height)  # fmt: skip
    at = np.linspace(0.0, length, 203)
    np.testing.assert_allclose(top((d, z), at), top((back_d, back_z), length - at), atol=1e-7)


@pytest.mark.parametrize("rise", [0.13, -0.13])
@pytest.mark.parametrize("near", [0.01, 0.03, 0.05])
def test_a_riser_comes_half_the_way_to_a_foothold_at_most(near: float, rise: float) -> None:
    """However close it is already: the foothold is not the swing's to move."""
    for runs in ([near, 0.4], [0.4, near]):
        length = sum(runs)
        d, z = inflate_profile(*profile_of(runs, [rise]), place=0.06, height=0.0)
        moved = d[:-1][np.abs(np.diff(z)) > 0.1]
        riser = runs[0] + (-0.06 if rise > 0 else 0.06)
        expected = np.clip(riser, 0.5 * runs[0], length - 0.5 * runs[1])
        np.testing.assert_allclose(moved, expected, atol=1e-9)


@settings(max_examples=150)
@given(PROFILES, ERRORS, st.randoms(use_true_random=False))
def test_a_swing_over_the_inflated_ground_clears_every_ground_within_the_error(
    profile: Profile, errors: tuple[float, float], random: object
) -> None:
    """Risers anywhere within their error, treads as high as theirs: all are cleared."""
    place, height = errors
    d, z = profile
    length = float(d[-1])
    try:
        swing = plan_swing(
            [0.0, 0.0, z[0] + RADIUS], [length, 0.0, z[-1] + RADIUS], duration=1.0,
            profile=inflate_profile(d, z, place=place, height=height),
            clearance=CLEARANCE, foot_radius=RADIUS,
        )  # fmt: skip
    except PlanningError:
        assume(False)
    p = swing.positions(np.linspace(0.0, 1.0, 2001))
    risers = d[1:-1:2]
    first, last = risers[0], length - risers[-1]
    for k, riser in enumerate(risers):
        moved = riser + random.uniform(-place, place)  # type: ignore[attr-defined]
        moved = float(np.clip(moved, 0.5 * first, length - 0.5 * last))
        upper = max(z[2 * k + 1], z[2 * k + 2])
        inner = 0 < (k + 1 if z[2 * k + 2] > z[2 * k + 1] else k) < len(risers)
        nosing = upper + (random.uniform(0.0, height) if inner else 0.0)  # type: ignore[attr-defined]
        near = np.hypot(p[:, 0] - moved, p[:, 2] - nosing).min()
        beside = min(moved, length - moved)
        assert near >= min(CLEARANCE, 0.5 * (beside + RADIUS)) - 2e-4
        assert np.interp(moved, p[:, 0], p[:, 2]) > nosing


@pytest.mark.parametrize("going", ["up", "down"])
def test_builder_leaves_the_room_and_by_default_none(going: str) -> None:
    """With an error the foot peaks higher by it; without one nothing changes."""
    course, robot = stairs_course(going), paper_robot()
    feet = stance_at(course, PlanSettings(), start=2.4).feet
    swings = []
    for place, height in ((None, None), (0.0, 0.0), (0.0, 0.02), (0.02, 0.02)):
        errors = {} if place is None else {"map_error_place": place, "map_error_height": height}
        builder = StepBuilder(course.lanes[0], feet, foot_radius=robot.foot_radius,
                              clearance=0.03, **errors)  # type: ignore[arg-type]  # fmt: skip
        builder.step(Leg(1), np.array([3.75, 0.2]), 1.2, lift_off=0.0)
        swings.append(builder.steps[0].swing)
    exact, default, high, both = swings
    assert (exact.apex_z, exact.apex_time) == (default.apex_z, default.apex_time)
    assert high.apex_z >= default.apex_z + 0.015
    assert both.apex_z >= high.apex_z - 5e-3
    assert np.array_equal(both.p_end, exact.p_end)


def test_a_leg_that_swings_sideways_keeps_the_room_along_the_lane() -> None:
    """The error of place is the riser's, across it: a slanting swing meets it stretched."""
    d, z = profile_of([0.3, 0.3], [0.13])
    moved, _ = inflate_profile(d, z, place=0.03, height=0.0)
    stretched, _ = inflate_profile(2 * d, z, place=0.06, height=0.0)
    np.testing.assert_allclose(stretched, 2 * moved, atol=1e-9)
