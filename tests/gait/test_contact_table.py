"""Laws of the gaits' contact tables."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.gait.schedule import GaitSchedule, spin_schedule, wave_schedule
from drake_quad.robot.legs import LEGS, Leg

betas = st.floats(0.75, 0.98)
cycle_times = st.floats(0.5, 20.0)
signs = st.sampled_from([1, -1])


def make(kind: str, beta: float, cycle_time: float, sign: int) -> GaitSchedule:
    if kind == "wave":
        return wave_schedule(duty_factor=beta, cycle_time=cycle_time, heading=sign)
    return spin_schedule(duty_factor=beta, cycle_time=cycle_time, sense=sign)


tables = st.builds(make, st.sampled_from(["wave", "spin"]), betas, cycle_times, signs)


@given(tables)
def test_never_more_than_one_leg_in_the_air(table: GaitSchedule) -> None:
    """Swings follow one another within the cycle, without overlapping."""
    end = 0.0
    for _, lift, touchdown in table.swing_intervals():
        assert end <= lift < touchdown
        end = touchdown
    assert end <= table.cycle_time
    assert [leg for leg, *_ in table.swing_intervals()] == list(table.order)


@given(tables)
def test_each_leg_stands_for_beta_of_the_cycle(table: GaitSchedule) -> None:
    """Each of the four legs swings once, for (1 - beta) T."""
    intervals = table.swing_intervals()
    assert sorted(leg for leg, *_ in intervals) == list(LEGS)
    for leg, lift, touchdown in intervals:
        assert touchdown - lift == pytest.approx((1 - table.duty_factor) * table.cycle_time)
        assert lift == pytest.approx(table.lift_off[leg.row] * table.cycle_time)


@given(tables, st.floats(-3.0, 3.0))
def test_answers_agree_at_any_time_of_any_cycle(table: GaitSchedule, cycles: float) -> None:
    """Swing leg, swing phase and standing legs describe one and the same state."""
    t = cycles * table.cycle_time
    leg, phase, standing = table.swing_leg(t), table.swing_phase(t), table.standing(t)
    if leg is None:
        assert phase is None and standing.all()
    else:
        assert phase is not None and 0.0 <= phase < 1.0
        assert np.flatnonzero(~standing).tolist() == [leg.row]
    assert (table.standings([t])[0] == standing).all()


@given(tables)
def test_intervals_are_half_open(table: GaitSchedule) -> None:
    """A leg is in the air at its lift-off, at phase 0, and not any more at its touchdown."""
    for leg, lift, touchdown in table.swing_intervals():
        assert table.swing_leg(lift) is leg
        assert table.swing_phase(lift) == 0.0
        assert table.swing_leg(np.nextafter(touchdown, 0.0)) is leg
        assert table.swing_leg(touchdown) is not leg


@given(betas, cycle_times, signs)
def test_wave_is_equally_spaced_and_its_two_halves_are_mirror_images(
    beta: float, cycle_time: float, heading: int
) -> None:
    """The wave lifts a leg every quarter cycle, and half a cycle later the one mirrored."""
    table = make("wave", beta, cycle_time, heading)
    for leg in LEGS:
        shift = (table.lift_off[leg.mirrored.row] - table.lift_off[leg.row]) % 1.0
        assert shift == 0.5
    assert sorted(table.lift_off) == [0.0, 0.25, 0.5, 0.75]


@given(betas)
def test_walking_backward_exchanges_front_and_rear(beta: float) -> None:
    """Seen from a robot that walks backward, the wave is the one that walks forward."""
    forward, backward = make("wave", beta, 8.0, 1), make("wave", beta, 8.0, -1)
    assert backward.order == tuple(leg.reversed for leg in forward.order)
    for leg in LEGS:
        assert backward.lift_off[leg.reversed.row] == forward.lift_off[leg.row]


@given(betas)
def test_spins_lift_at_the_papers_times(beta: float) -> None:
    """Legs 1, 3, 4, 2 lift at t0, t2, t3, t5, with two equal intervals on four feet."""
    table = make("spin", beta, 1.0, 1)
    assert table.order == (Leg(1), Leg(3), Leg(4), Leg(2))
    (_, _, t1), (_, t2, t3a), (_, t3, t4), (_, t5, _) = table.swing_intervals()
    assert t2 - t1 == pytest.approx(2 * beta - 1.5, abs=1e-12)
    assert t5 - t4 == pytest.approx(2 * beta - 1.5, abs=1e-12)
    assert t3a == pytest.approx(t3, abs=1e-12)
    clockwise = make("spin", beta, 1.0, -1)
    assert clockwise.order == (Leg(1), Leg(2), Leg(4), Leg(3))
    assert sorted(clockwise.lift_off) == sorted(table.lift_off)


def test_a_tiny_negative_time_is_the_cycles_start() -> None:
    """Rounding of the modulo does not fall off the end of the table."""
    table = make("wave", 0.75, 8.0, 1)
    assert table.swing_leg(-1e-300) is Leg.FRONT_LEFT
    assert table.swing_leg(-1e-6) is Leg.REAR_LEFT


@pytest.mark.parametrize("beta", [0.74, 1.0, float("nan")])
def test_duty_factors_that_need_two_legs_in_the_air_are_refused(beta: float) -> None:
    """Only duty factors in [3/4, 1) are accepted."""
    for kind in ("wave", "spin"):
        with pytest.raises(ValueError, match="duty_factor"):
            make(kind, beta, 8.0, 1)


def test_other_bad_tables_are_refused() -> None:
    """A cycle needs a length, a heading a sign, and swings room between each other."""
    with pytest.raises(ValueError, match="cycle_time"):
        make("wave", 0.8, 0.0, 1)
    with pytest.raises(ValueError, match="heading"):
        make("wave", 0.8, 8.0, 0)
    with pytest.raises(ValueError, match="sense"):
        make("spin", 0.8, 8.0, 2)
    with pytest.raises(ValueError, match="swing"):
        GaitSchedule(8.0, 0.75, np.array([0.0, 0.1, 0.5, 0.75]), (Leg(1), Leg(2), Leg(3), Leg(4)))
    with pytest.raises(ValueError, match="swing"):
        GaitSchedule(8.0, 0.75, np.array([0.0, 0.25, 0.5, 0.75]), (Leg(1), Leg(4), Leg(2), Leg(3)))
