"""Where the feet are to be: held, swung, searched down, caught."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rig import flat_walk

from drake_quad.common import FloatArray
from drake_quad.control.foot_targets import (
    DEEPEST,
    MOST_MORE,
    REGAIN_TIME,
    TOUCHDOWN,
    URGENT_SEARCH,
    FootInputs,
    compute_foot_targets,
)
from drake_quad.control.kernel_state import (
    DEPTH,
    HEIGHT,
    HOLD,
    LANDED,
    LIFTED,
    REGAINED,
    Pace,
    new_memory,
)
from drake_quad.planning.phase_table import PlannedFeet

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=40)
PACE = Pace(
    period=0.005,
    foothold_time=0.3,
    touchdown_press=0.003,
    landing_speed=0.15,
    search_speed=0.05,
    height_time=0.5,
)
FEET = flat_walk().contacts.feet
NOBODY = np.zeros(7)


class Result(NamedTuple):
    """What `compute_foot_targets` returns."""

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    memory: FloatArray


class Walk:
    """Calls of `compute_foot_targets` one after another; each keeps what it is not given."""

    def __init__(self, *, swing: int | None = None) -> None:
        """A robot on its plan's first feet, one of which may be in the air."""
        self.planned = FEET.copy()
        self.velocity, self.acceleration = np.zeros((4, 3)), np.zeros((4, 3))
        self.standing = np.arange(4) != (-1 if swing is None else swing)
        self.s = float("nan") if swing is None else 0.5
        self.rate, self.phase_rate = 1.0, 2.0
        self.feet = FEET.copy()
        self.bearing = self.standing.astype(float)
        self.catch, self.urgent = NOBODY.copy(), False
        self.unloaded = np.zeros(4, dtype=bool)
        self.memory = new_memory(FEET)

    def tick(self, count: int = 1) -> Result:
        """What the last of so many ticks returns."""
        planned = PlannedFeet(
            self.planned, self.velocity, self.acceleration, self.standing, self.s, self.phase_rate
        )
        for _ in range(count):
            now = FootInputs(
                planned, self.rate, self.feet, self.bearing, self.catch, self.urgent, self.unloaded
            )
            target, self.memory = compute_foot_targets(now, self.memory, PACE)
        return Result(*target, self.memory)


@examples
@given(seeds, st.integers(1, 300))
def test_standing_foot_is_held_where_it_really_stands(seed: int, count: int) -> None:
    """Its target comes to the measured place by a constant share a tick, and does not move else."""
    rng, walk = np.random.default_rng(seed), Walk()
    walk.feet = FEET + rng.uniform(-0.03, 0.03, (4, 3))
    result = walk.tick(count)
    left = (1.0 - PACE.period / PACE.foothold_time) ** count
    np.testing.assert_allclose(result.place, walk.feet + left * (FEET - walk.feet), atol=1e-12)
    assert np.all(result.velocity == 0.0) and np.all(result.acceleration == 0.0)


@examples
@given(seeds, st.floats(0.0, 1.0), st.integers(0, 3), st.sampled_from([0.0, 1.0, 0.5]))
def test_swing_foot_follows_the_plan_at_the_clocks_rate(
    seed: int, s: float, row: int, rate: float
) -> None:
    """Velocity by the rate, acceleration by its square; the place is the plan's until it lands."""
    rng, walk = np.random.default_rng(seed), Walk(swing=row)
    walk.planned[row] += rng.uniform(-0.2, 0.2, 3)
    walk.velocity[row], walk.acceleration[row] = rng.normal(size=3), rng.normal(size=3)
    walk.s, walk.rate = s, rate
    result = walk.tick()
    below = walk.planned[row] - result.place[row]
    np.testing.assert_allclose(below[:2], 0.0, atol=1e-12)
    search = PACE.landing_speed if rate == 0.0 and s > TOUCHDOWN else 0.0
    assert -1e-12 <= below[2] <= PACE.touchdown_press + search * PACE.period + 1e-12
    assert s > 0.95 or below[2] == pytest.approx(search * PACE.period, abs=1e-12)
    expected = rate * walk.velocity[row] - [0.0, 0.0, search]
    np.testing.assert_allclose(result.velocity[row], expected)
    np.testing.assert_allclose(result.acceleration[row], rate**2 * walk.acceleration[row])


@pytest.mark.parametrize(("s", "pressed"), [(0.5, 0.0), (0.949, 0.0), (0.975, 0.5), (1.0, 1.0)])
def test_a_swing_foot_is_pressed_down_at_the_end_of_its_swing(s: float, pressed: float) -> None:
    """Earlier it would meet the ground while it still comes down quickly."""
    walk = Walk(swing=0)
    walk.s = s
    below = walk.planned[0, 2] - walk.tick().place[0, 2]
    assert below == pytest.approx(pressed * PACE.touchdown_press, abs=1e-9)


@examples
@given(st.integers(0, 3), st.integers(1, 100))
def test_swing_starts_on_the_ground_of_a_foot_that_gave_its_load_away(row: int, count: int) -> None:
    """Without load it is not sensed to bear: it is not searched for below ground that is there."""
    walk = Walk()
    walk.bearing[row], walk.unloaded[row] = 0.0, True
    walk.tick(count)
    walk.standing[row], walk.unloaded[row], walk.s = False, False, 0.0
    np.testing.assert_allclose(walk.tick().place[row], FEET[row], atol=1e-12)


@examples
@given(seeds, st.integers(0, 3))
def test_swing_starts_where_the_foot_stood_and_forgets_it(seed: int, row: int) -> None:
    """The difference at lift-off is gone after a third of the swing, and never grows.

    The planned way clears nosings that it then comes to, and a foot that has rolled ahead does not.
    """
    rng, walk = np.random.default_rng(seed), Walk()
    off = np.array([*rng.uniform(-0.03, 0.03, 2), 0.0])
    walk.feet[row] += off
    walk.tick(2000)
    walk.standing[row], walk.bearing[row] = False, 0.0
    parts = []
    for s in (0.0, 0.1, 0.2, 0.3, 1.0 / 3.0, 0.6):
        walk.s = s
        parts.append(walk.tick().place[row] - walk.planned[row])
    np.testing.assert_allclose(parts[0], off, atol=1e-6)
    np.testing.assert_allclose(parts[-2:], 0.0, atol=1e-9)
    sizes = np.linalg.norm(parts, axis=1)
    assert np.all(np.diff(sizes) <= 1e-12)


@examples
@given(seeds, st.integers(0, 3), st.floats(0.02, 0.75), st.floats(0.2, 1.0))
def test_a_swing_foots_velocity_and_acceleration_are_those_of_its_place(
    seed: int, row: int, s: float, rate: float
) -> None:
    """Also of its way back from where it really stood, and up to ground that is higher than mapped.

    Without that, the drives' damping held the foot back, and it was up to 16 mm off its way.
    """
    rng, walk = np.random.default_rng(seed), Walk()
    walk.feet += [0.0, 0.0, 0.01]
    walk.feet[row] += rng.uniform(-0.03, 0.03, 3)
    walk.tick(2000)
    walk.standing[row], walk.bearing[row], walk.rate = False, 0.0, rate
    results, h = [], 1e-4
    for n in (-1, 0, 1):
        memory = walk.memory.copy()
        walk.s = s + n * h * rate * walk.phase_rate
        results.append(walk.tick())
        walk.memory = memory  # the height of the ground is felt on, meanwhile
    before, now, after = results
    speed = (after.place[row] - before.place[row]) / (2 * h)
    change = (after.velocity[row] - before.velocity[row]) / (2 * h)
    np.testing.assert_allclose(now.velocity[row], speed, atol=1e-4)
    np.testing.assert_allclose(now.acceleration[row], change, atol=5e-3)


@pytest.mark.parametrize("row", range(4))
def test_early_ground_is_kept_and_pressed_on(row: int) -> None:
    """A foot that bears in the second half of its swing stays there, whatever the plan has next."""
    walk = Walk(swing=row)
    walk.planned[row, 2] += 0.05
    walk.velocity[row] = [0.5, 0.0, -0.2]
    walk.feet[row] = walk.planned[row] + [0.004, -0.002, 0.001]
    found = walk.feet[row].copy()
    walk.s, walk.bearing[row] = 0.6, 1.0
    for s in (0.6, 0.8, 1.0):
        walk.s = s
        walk.planned[row] += [0.03, 0.0, -0.02]
        result = walk.tick()
        expected = found - [0.0, 0.0, PACE.touchdown_press]
        np.testing.assert_allclose(result.place[row], expected, atol=1e-12)
        assert np.all(result.velocity[row] == 0.0) and np.all(result.acceleration[row] == 0.0)
    # The plan's own touchdown: it is held there, still pressed on, and lets go of that in time.
    walk.standing[row] = True
    held = walk.tick().place[row]
    follow = PACE.period / PACE.foothold_time
    np.testing.assert_allclose(held, expected + follow * (found - expected), atol=1e-12)
    assert walk.memory[LANDED + row] == 0.0


@examples
@given(st.floats(-0.1, 0.1), st.integers(0, 3))
def test_swing_ends_as_much_higher_than_planned_as_the_others_stand(z: float, row: int) -> None:
    """Where the whole ground is higher or lower than mapped, so is the next foothold."""
    walk = Walk()
    walk.feet[:, 2] += z
    walk.tick(5000)
    walk.standing[row], walk.bearing[row] = False, 0.0
    for s in (0.0, 0.67):
        walk.s = s
        above = walk.tick().place[row] - walk.planned[row]
        np.testing.assert_allclose(above, [0.0, 0.0, z], atol=1e-6)


def test_contact_in_the_first_half_is_that_of_the_lift_off() -> None:
    """A foot that still touches as it leaves goes on."""
    walk = Walk(swing=1)
    walk.s, walk.bearing[1] = 0.4, 1.0
    walk.planned[1, 2] += 0.05
    result = walk.tick()
    np.testing.assert_allclose(result.place[1], walk.planned[1])
    assert result.memory[LANDED + 1] == 0.0


def test_early_ground_that_gives_way_is_followed_down() -> None:
    """It was no ground: the foot goes on down at the search speed, and stops where it bears."""
    walk = Walk(swing=2)
    walk.s, walk.bearing[2] = 0.7, 1.0
    first = walk.tick().place[2].copy()
    walk.bearing[2] = 0.0
    after = walk.tick(20).place[2]
    np.testing.assert_allclose(
        first - after, [0.0, 0.0, 20 * PACE.period * PACE.search_speed], atol=1e-12
    )
    walk.bearing[2] = 1.0
    np.testing.assert_array_equal(walk.tick(5).place[2], after)


def test_no_ground_where_it_should_be_is_searched_for_downwards() -> None:
    """While the clock waits it goes on down at the speed set; while the clock runs it does not."""
    walk = Walk(swing=0)
    walk.s = 1.0
    assert walk.tick(10).memory[DEPTH] == 0.0
    start = walk.tick().place[0, 2]
    walk.rate = 0.0
    depths = [start - walk.tick(20).place[0, 2] for _ in range(4)]
    expected = 20 * PACE.period * PACE.landing_speed * np.arange(1, 5)
    np.testing.assert_allclose(depths, expected, atol=1e-12)
    walk.bearing[0] = 1.0
    walk.feet[0, 2] -= depths[-1]
    np.testing.assert_allclose(
        walk.tick(50).place[0, 2], walk.feet[0, 2] - PACE.touchdown_press, atol=1e-12
    )


def catching(walk: Walk, row: int, to: FloatArray, elapsed: float) -> None:
    walk.catch = np.array([row + 1.0, *to, 0.2, elapsed, 0.04])
    walk.standing, walk.urgent = np.arange(4) != row, True


@examples
@given(seeds, st.integers(0, 3))
def test_catching_foot_goes_from_where_it_is_to_where_it_is_told(seed: int, row: int) -> None:
    """From its place as measured to the catch's, lifted on the way; pressing as it arrives."""
    rng, walk = np.random.default_rng(seed), Walk()
    walk.feet = FEET + rng.uniform(-0.02, 0.02, (4, 3))
    to = walk.feet[row] + rng.uniform(-0.2, 0.2, 3) * [1.0, 1.0, 0.2]
    catching(walk, row, to, PACE.period)
    begin = walk.feet[row].copy()
    first = walk.tick().place[row]
    assert np.linalg.norm(first - begin) < 0.002
    walk.feet[row] += 0.01  # where it set out from is remembered
    catching(walk, row, to, 0.1)
    half = walk.tick().place[row]
    np.testing.assert_allclose(half, 0.5 * (begin + to) + [0.0, 0.0, 0.04], atol=1e-9)
    catching(walk, row, to, 0.2)
    last = walk.tick()
    np.testing.assert_allclose(last.place[row], to - [0.0, 0.0, PACE.touchdown_press], atol=1e-9)
    np.testing.assert_allclose(last.velocity[row], 0.0, atol=1e-9)
    catching(walk, row, to, 0.25)
    assert walk.tick().place[row, 2] < last.place[row, 2]  # there is no ground yet


@examples
@given(seeds, st.floats(0.1, 0.75))
def test_catching_foots_velocity_is_the_derivative_of_its_place(seed: int, share: float) -> None:
    """Lift and all; up to where it begins to press."""
    rng, walk = np.random.default_rng(seed), Walk()
    to = FEET[0] + rng.uniform(-0.2, 0.2, 3)
    catching(walk, 0, to, PACE.period)
    walk.tick()
    h, t = 1e-6, 0.2 * share
    places = []
    for elapsed in (t - h, t + h):
        catching(walk, 0, to, elapsed)
        places.append(walk.tick().place[0])
    catching(walk, 0, to, t)
    np.testing.assert_allclose(
        walk.tick().velocity[0], (places[1] - places[0]) / (2 * h), atol=1e-6
    )


def test_while_one_foot_catches_the_others_are_held() -> None:
    """Feet that bear stay; the one that the plan has in the air goes straight down, to help."""
    walk = Walk(swing=1)
    walk.planned[1, 2] += 0.1
    walk.feet[1, 2] += 0.06
    walk.memory[HOLD + 5] += 0.06
    catching(walk, 2, FEET[2] + [0.1, 0.0, 0.0], 0.1)
    result = walk.tick()
    for row in (0, 3):
        np.testing.assert_allclose(result.place[row], FEET[row], atol=1e-12)
    np.testing.assert_allclose(result.place[1, :2], FEET[1, :2], atol=1e-12)
    assert FEET[1, 2] < result.place[1, 2] < walk.feet[1, 2]


def test_feet_that_a_stopped_plan_has_in_the_air_say_nothing_of_the_ground() -> None:
    """While a push is caught a foot stands where the plan has it half a step above the ground.

    It had drawn the body down by a quarter of that.
    """
    walk = Walk(swing=1)
    walk.planned[1, 2] += 0.1
    walk.urgent, walk.s = True, float("nan")
    walk.standing, walk.bearing = np.ones(4, dtype=bool), np.ones(4)
    walk.memory[HEIGHT] = 0.004  # as the ground was found before
    assert walk.tick(400).memory[HEIGHT] == 0.004
    walk.urgent = False
    walk.planned[1, 2] -= 0.1
    assert abs(walk.tick(2000).memory[HEIGHT]) < 1e-4


@pytest.mark.parametrize(("urgent", "speed"), [(False, PACE.search_speed), (True, URGENT_SEARCH)])
def test_standing_foot_that_loses_the_ground_goes_straight_down_after_it(
    urgent: bool, speed: float
) -> None:
    """At the search speed, in haste if a push is being caught, and never far below where it is."""
    walk = Walk()
    walk.urgent, walk.bearing[1] = urgent, 0.0
    result = walk.tick()
    step = speed * PACE.period
    np.testing.assert_allclose(FEET[1] - result.place[1], [0.0, 0.0, step], atol=1e-12)
    np.testing.assert_allclose(result.place[[0, 2, 3]], FEET[[0, 2, 3]], atol=1e-12)
    deep = walk.tick(1000).place[1]
    np.testing.assert_allclose(deep[:2], FEET[1, :2], atol=1e-12)
    assert DEEPEST - 1e-12 <= FEET[1, 2] - deep[2] <= DEEPEST + step
    walk.bearing[1] = 1.0
    np.testing.assert_allclose(walk.tick(2000).place[1], FEET[1], atol=1e-9)


def test_foot_that_finds_the_ground_again_stands_there_and_takes_its_load_up_slowly() -> None:
    """It does not press on to where it was aimed, and has all its load again after REGAIN_TIME."""
    walk = Walk()
    walk.tick()  # it had borne
    walk.bearing[1] = 0.0
    assert walk.tick(100).place[1, 2] < FEET[1, 2] - 0.5 * DEEPEST
    walk.bearing[1] = 1.0
    np.testing.assert_allclose(walk.tick().place[1], FEET[1], atol=1e-12)
    ticks = round(REGAIN_TIME / PACE.period)
    regained = [walk.memory[REGAINED + 1]] + [
        float(walk.tick().memory[REGAINED + 1]) for _ in range(ticks)
    ]
    np.testing.assert_allclose(np.diff(regained)[:-1], PACE.period / REGAIN_TIME, atol=1e-12)
    assert regained[0] < 0.1 and regained[-1] == 1.0


def test_feet_that_have_not_borne_yet_have_lost_nothing() -> None:
    """As a run begins contacts are not known: then all loads are whole at once."""
    walk = Walk()
    walk.bearing[:] = 0.0
    walk.tick(3)
    walk.bearing[:] = 1.0
    np.testing.assert_array_equal(walk.tick().memory[REGAINED : REGAINED + 4], 1.0)


@pytest.mark.parametrize("height", [0.03, -0.02])
def test_body_follows_the_ground_as_found(height: float) -> None:
    """Feet that all stand higher than planned raise the body by as much, within a few seconds."""
    walk = Walk()
    walk.feet[:, 2] += height
    found = [float(walk.tick(100).memory[HEIGHT]) / height for _ in range(8)]
    assert 0.2 < found[0] < 0.8 and found[-1] == pytest.approx(1.0, abs=1e-2)
    assert np.all(np.diff(found) > 0.0) and max(found) <= 1.0


@examples
@given(seeds, st.integers(0, 3), st.floats(0.67, 0.79))
def test_swing_ends_on_ground_as_high_as_its_neighbour_found_it(
    seed: int, row: int, s: float
) -> None:
    """As far off the map as the other foot of its pair, whatever the other pair does."""
    rng, walk = np.random.default_rng(seed), Walk(swing=row)
    off = rng.uniform(-0.03, 0.03, 4)
    walk.feet[:, 2] += off
    walk.s = s
    result = walk.tick(2000)
    beside = row ^ 1
    assert result.place[row, 2] - walk.planned[row, 2] == pytest.approx(off[beside], abs=1e-6)


@pytest.mark.parametrize("rise", [0.178, -0.178])
def test_a_neighbour_on_another_tread_leads_no_foot_there(rise: float) -> None:
    """One that missed its tread says little of where the next is: only so much more counts."""
    walk = Walk(swing=0)
    walk.feet[1, 2] += rise
    walk.s = 0.7
    higher = walk.tick(3000).place[0, 2] - walk.planned[0, 2]
    assert higher == pytest.approx(rise / 3 + np.copysign(MOST_MORE, rise), abs=1e-4)


def test_swing_goes_by_all_feet_where_its_neighbour_does_not_stand() -> None:
    """Two feet in the air: the mean of those that stand."""
    walk = Walk(swing=0)
    walk.standing[1], walk.bearing[1] = False, 0.0
    walk.feet[2:, 2] += np.array([0.01, 0.03])
    walk.s = 0.7
    assert walk.tick(3000).place[0, 2] - walk.planned[0, 2] == pytest.approx(0.02, abs=1e-4)


def test_one_high_foot_counts_as_a_quarter() -> None:
    """It is the standing feet's mean; a foot in the air has no say."""
    walk = Walk()
    walk.feet[3, 2] += 0.04
    assert walk.tick(2000).memory[HEIGHT] == pytest.approx(0.01, abs=1e-5)
    walk.standing[3], walk.bearing[3], walk.s = False, 0.0, 0.3
    assert walk.tick(2000).memory[HEIGHT] == pytest.approx(0.0, abs=1e-5)
    walk.feet[:3, 2] += 0.01
    assert walk.tick(3000).memory[HEIGHT] == pytest.approx(0.01, abs=1e-5)


@examples
@given(seeds)
def test_memory_given_is_not_changed(seed: int) -> None:
    """A tick returns a new memory: a Context's own state must not change under it."""
    rng, walk = np.random.default_rng(seed), Walk(swing=int(seed % 4))
    walk.feet = FEET + rng.uniform(-0.02, 0.02, (4, 3))
    walk.s, walk.bearing[:] = 0.8, 1.0
    before, memory = walk.memory.copy(), walk.memory
    walk.tick()
    np.testing.assert_array_equal(memory, before)
    assert not np.array_equal(walk.memory, before)
    assert np.all(np.abs(walk.memory[LIFTED : LIFTED + 12]) < 0.1)
