"""Laws of the body's spline: smooth to the acceleration, local, and within its control points."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from drake_quad.math.curves import (
    BodySpline,
    greville,
    join_weights,
    knot_count,
    knot_spacing,
    weights,
)

seeds = st.integers(0, 2**32 - 1)
knots = st.floats(0.05, 1.0)
examples = settings(max_examples=30)


def random_spline(seed: int, knot: float) -> tuple[BodySpline, float]:
    """A spline over a random duration, and the duration [s]."""
    rng = np.random.default_rng(seed)
    duration = knot * rng.uniform(1.0, 12.0)
    return BodySpline(knot, rng.normal(size=(knot_count(duration, knot), 5))), duration


@examples
@given(st.floats(0.0, 1.0), knots)
def test_weights_of_values_sum_to_one_and_of_rates_to_none(u: float, knot: float) -> None:
    """Moving all control points moves the path as much, and changes no velocity."""
    w = weights(np.array([u]), knot)[0]
    assert w.sum(axis=1) * [1.0, knot, knot**2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert np.all(w[0] >= -1e-15)


@examples
@given(seeds, knots)
def test_path_is_continuous_to_the_acceleration(seed: int, knot: float) -> None:
    """At every knot value, velocity and acceleration from both sides agree."""
    spline, _ = random_spline(seed, knot)
    for k in range(1, len(spline.control) - 3):
        t = k * knot
        before, after = spline.sample(t - 1e-9 * knot), spline.sample(t + 1e-9 * knot)
        scale = np.array([[1.0], [knot], [knot**2]])
        np.testing.assert_allclose(before * scale, after * scale, atol=1e-6)


@examples
@given(seeds, knots)
def test_velocity_and_acceleration_are_the_derivatives(seed: int, knot: float) -> None:
    """They equal central differences of value and velocity."""
    spline, duration = random_spline(seed, knot)
    h = 1e-5 * knot
    times = np.linspace(0.01, 0.99, 40) * duration
    clear = np.abs(times / knot - np.round(times / knot)) > 1e-3  # of knots, where jerk jumps
    for t in times[clear]:
        difference = (spline.sample(t + h) - spline.sample(t - h)) / (2 * h)
        np.testing.assert_allclose(difference[:2] * knot, spline.sample(t)[1:] * knot, rtol=1e-4,
                                   atol=1e-4 / knot)  # fmt: skip


@examples
@given(seeds, knots)
def test_many_times_at_once_are_each_alone(seed: int, knot: float) -> None:
    """`samples` is `sample` at each time, also at knots, ends and beyond the end."""
    spline, duration = random_spline(seed, knot)
    times = np.concatenate([np.linspace(0.0, 1.1 * duration, 50), knot * np.arange(4)])
    each = np.stack([spline.sample(float(t)) for t in times])
    np.testing.assert_allclose(spline.samples(times), each, atol=1e-9 / knot**2)


@examples
@given(seeds, knots)
def test_path_stays_within_its_control_points(seed: int, knot: float) -> None:
    """Nowhere is it beyond the four control points that weigh there."""
    spline, duration = random_spline(seed, knot)
    values = spline.samples(np.linspace(0.0, duration, 100))[:, 0]
    assert np.all(values <= spline.control.max(axis=0) + 1e-12)
    assert np.all(values >= spline.control.min(axis=0) - 1e-12)


@examples
@given(seeds, knots)
def test_three_equal_control_points_at_an_end_are_rest_there(seed: int, knot: float) -> None:
    """With them the path starts and ends where they are, without velocity or acceleration."""
    spline, _ = random_spline(seed, knot)
    control = np.array(spline.control)
    control[:3], control[-3:] = control[0], control[-1]
    if len(control) < 6:
        return
    still = BodySpline(knot, control)
    end = (len(control) - 3) * knot
    for t, place in (
        (0.0, control[0]),
        (end, control[-1]),
        (-1.0, control[0]),
        (end + 1, control[-1]),
    ):
        sample = still.sample(t)
        np.testing.assert_allclose(sample[0], place, atol=1e-12)
        np.testing.assert_allclose(sample[1:] * [[knot], [knot**2]], 0.0, atol=1e-9)


@examples
@given(st.floats(0.1, 20.0), knots, st.floats(-1.0, 1.0))
def test_control_points_on_a_line_in_time_are_that_line(
    duration: float, knot: float, speed: float
) -> None:
    """Away from the ends a spline through `greville` times runs at constant speed."""
    times = greville(duration, knot)
    assert len(times) == knot_count(duration, knot)
    assert times[0] == 0.0 and times[-1] == pytest.approx(duration)
    control = np.outer(speed * times, np.ones(5))
    spline = BodySpline(knot, control)
    for t in np.linspace(2 * knot, duration - 2 * knot, 9) if duration > 4 * knot else []:
        sample = spline.sample(t)
        np.testing.assert_allclose(sample[0], speed * t, atol=1e-9)
        np.testing.assert_allclose(sample[1], speed, atol=1e-9)


@examples
@given(st.floats(0.01, 50.0), knots)
def test_knots_reach_the_end_and_no_further_than_one(duration: float, knot: float) -> None:
    """There are just enough spans for the duration."""
    spans = knot_count(duration, knot) - 3
    assert spans * knot >= duration * (1 - 1e-6) and (spans - 1) * knot < duration


def test_a_path_cannot_be_changed() -> None:
    """The control points are a read-only copy."""
    control = np.zeros((6, 5))
    spline = BodySpline(0.2, control)
    control[:] = 1.0
    assert np.all(spline.control == 0.0)
    with pytest.raises(ValueError, match="read-only"):
        spline.control[0] = 1.0


@examples
@given(st.floats(0.3, 50.0), knots)
def test_a_path_whose_last_control_points_are_one_ends_at_rest_however_long_it_takes(
    duration: float, most: float
) -> None:
    """With knots spaced for its duration, but no farther apart than asked for."""
    knot = knot_spacing(duration, most)
    assert knot <= max(most, duration) and knot > 0.4 * min(most, duration)
    control = np.random.default_rng(1).normal(size=(knot_count(duration, knot), 5))
    control[-3:] = control[-1]
    scale = np.array([[1.0], [knot], [knot**2]])
    left = (BodySpline(knot, control).sample(duration) - [control[-1], *np.zeros((2, 5))]) * scale
    np.testing.assert_allclose(left, 0.0, atol=1e-8)


@pytest.mark.parametrize("knot", [0.2, 0.02])
def test_a_whole_number_of_knots_stays_as_it_is(knot: float) -> None:
    """To the bit, although their sum rounds."""
    for count in (1, 3, 383, 3850):
        assert knot_spacing(sum([knot] * count), knot) == knot


@examples
@given(st.floats(3.0, 50.0), st.floats(0.05, 0.3), st.floats(0.1, 1.0))
def test_what_a_path_begins_with_goes_smoothly_and_is_gone_when_joined(
    duration: float, most: float, share: float
) -> None:
    """All of it at rest at first, none from then on, and never more than at first."""
    knot = knot_spacing(duration, most)
    joined = max(share * duration, 5.0 * knot)
    left = join_weights(duration, knot, joined)
    assert np.all(left[:3] == 1.0) and np.all(np.diff(left) <= 1e-12) and np.all(left[-3:] == 0.0)
    spline = BodySpline(knot, np.repeat(left[:, None], 5, axis=1))
    after = spline.samples(np.linspace(min(joined, duration), duration, 20))
    np.testing.assert_allclose(after[:, 0], 0.0, atol=1e-12)
