"""How far legs let the robot be thrown, and what that leaves of the push budget."""

import numpy as np
from hypothesis import given, settings, strategies as st
from rig import paper_robot, rotations, stand_plan

from drake_quad.common import BoolArray, FloatArray
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_com, calc_feet, solve_legs
from drake_quad.stability.capture_point import (
    SWING_BACK,
    Pendulum,
    directions,
    find_pressure_area,
    held_back,
    pressure_reach,
    push_budget,
    way_out,
)
from drake_quad.stability.equilibrium_region import find_region, make_contacts
from drake_quad.stability.leg_stroke import HALVINGS, STEPS, leg_stroke_left

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20, deadline=None)
WAYS = directions(16)
MOST = np.full(len(WAYS), 0.8)


def random_pose(seed: int) -> tuple[FloatArray, FloatArray]:
    """A body pose (5,) and feet (4, 3) near to the stance in which runs begin."""
    rng = np.random.default_rng(seed)
    stance = stand_plan().end
    body = stance.body + rng.uniform([-0.1, -0.06, -0.05, -0.1, -3.0], [0.1, 0.06, 0.0, 0.1, 3.0])
    feet = np.array(stance.feet)
    c, s = np.cos(body[4]), np.sin(body[4])
    turned = (feet[:, :2] - stance.body[:2]) @ np.array([[c, s], [-s, c]]) + stance.body[:2]
    feet[:, :2] = turned + rng.uniform(-0.08, 0.08, (4, 2))
    return body, feet


def all_fit(bodies: FloatArray, feet: FloatArray, standing: BoolArray) -> BoolArray:
    """Of each pose (N, 5), with feet (N, 4, 3), whether the standing legs are within limits."""
    robot = paper_robot()
    q, excess, _ = pose_robot(robot, bodies, feet)
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    good = np.all((q >= lower - 1e-9) & (q <= upper + 1e-9), axis=-1) & (excess <= 0.0)
    return np.asarray(np.all(good | ~standing, axis=-1))


def fits(body: FloatArray, feet: FloatArray, standing: BoolArray) -> bool:
    """The same of one pose (5,)."""
    return bool(all_fit(body[None], feet[None], standing)[0])


@FEW
@given(SEEDS)
def test_legs_reach_so_far_and_no_farther(seed: int) -> None:
    """The centre of mass is where it is said to be; a little farther on a leg is at its limit."""
    robot, (body, feet) = paper_robot(), random_pose(seed)
    standing = np.random.default_rng(seed).random(4) < 0.8
    if not fits(body, feet, np.ones(4, dtype=bool)) or not np.any(standing):
        return
    q, _, com = (part[0] for part in pose_robot(robot, body[None], feet[None]))
    found = leg_stroke_left(robot, rotations(body), q, standing, WAYS, MOST)
    step = MOST[0] / STEPS / 2**HALVINGS
    for way, far in zip(WAYS, found, strict=True):
        # The body goes a little farther than the centre of mass, whose feet stay behind.
        moved = np.linspace(0.0, MOST[0], 400)
        bodies = np.tile(body, (400, 1))
        bodies[:, :2] += moved[:, None] * way
        whole = all_fit(bodies, np.tile(feet, (400, 1, 1)), standing)
        first = 400 if whole.all() else int(np.argmin(whole))
        _, _, coms = pose_robot(robot, bodies, np.tile(feet, (400, 1, 1)))
        along = (coms[:, :2] - com[:2]) @ way
        if standing.all():  # else the other legs stay as they are, and carry less of it back
            assert along[max(first - 1, 0)] + 3.0 * step + 2e-3 > far
            assert far > along[max(first - 1, 0)] - 3.0 * step - 2e-3


def stroke_of_arrays(
    body: FloatArray, feet: FloatArray, q: FloatArray, standing: BoolArray, way: FloatArray
) -> float:
    """`leg_stroke_left` along one way (2,), by the array kinematics and without a kernel."""
    robot, R = paper_robot(), rotations(body)
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)

    def posed(distance: float) -> tuple[FloatArray, bool]:
        moved = feet - body[:3] - distance * np.append(way, 0.0)
        found, excess = solve_legs(robot.geometry, moved @ R)
        good = (excess <= 0.0) & np.all((found >= lower) & (found <= upper), axis=-1)
        return np.where(standing[:, None], found, q), bool(np.all(good | ~standing))

    steps = np.linspace(0.0, MOST[0], STEPS + 1)[1:]
    whole = next((k for k, far in enumerate(steps) if not posed(far)[1]), STEPS)
    low, high = whole / STEPS * MOST[0], min(whole + 1, STEPS) / STEPS * MOST[0]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if posed(middle)[1] else (low, middle)
    left_behind = R @ (calc_com(robot, posed(low)[0]) - calc_com(robot, q))
    return max(low + float(left_behind[:2] @ way), 0.0)


@FEW
@given(SEEDS)
def test_the_kernel_is_the_array_kinematics_whoever_stands(seed: int) -> None:
    """With any feet standing, the stroke is what the kinematics on arrays give step by step."""
    robot, (body, feet) = paper_robot(), random_pose(seed)
    standing = np.random.default_rng(seed).random(4) < 0.7
    q = pose_robot(robot, body[None], feet[None])[0][0]
    found = leg_stroke_left(robot, rotations(body), q, standing, WAYS, MOST)
    # The feet from the angles: a leg out of reach ends short of them.
    feet = body[:3] + calc_feet(robot.geometry, q) @ rotations(body).T
    expected = [stroke_of_arrays(body, feet, q, standing, way) for way in WAYS]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@given(st.floats(0.05, 0.8), st.floats(0.05, 0.8), st.floats(5.0, 15.0))
def test_a_pendulum_so_thrown_turns_back_where_the_legs_end(
    pressure: float, legs: float, height: float
) -> None:
    """With the pressure at P and the speed that `held_back` allows, c turns at R, or comes to P."""
    rate = np.sqrt(9.81 / (0.1 * height))
    thrown = float(held_back(np.array([pressure]), np.array([legs]))[0])
    assert thrown <= pressure + 1e-12
    # c(t) = P - P cosh(ωt) + ξ sinh(ωt), from rest of the pressure at P and c' = ω ξ
    t = np.linspace(0.0, 12.0, 4001) / rate
    c = pressure - pressure * np.cosh(rate * t) + thrown * np.sinh(rate * t)
    expected = legs if legs < pressure else pressure
    assert c.max() <= expected + 1e-6
    if legs < 0.98 * pressure:
        assert c.max() >= expected - 1e-4


@FEW
@given(SEEDS)
def test_legs_only_take_away_from_the_budget(seed: int) -> None:
    """And nothing where they reach farther than the pressure does."""
    rng = np.random.default_rng(seed)
    feet = stand_plan().end.feet + rng.uniform(-0.1, 0.1, (4, 3)) * [1.0, 1.0, 0.0]
    contacts = make_contacts(feet, friction=0.8)
    (x, y), (vx, vy) = feet[:, :2].mean(axis=0), rng.uniform(-0.1, 0.1, 2)
    body = Pendulum(x, y, 0.85, vx, vy)
    region, area = find_region(contacts), find_pressure_area(contacts, body)
    reach = pressure_reach(region, area, body, WAYS)
    free = push_budget(region, reach, body, WAYS)
    legs = rng.uniform(0.05, 1.0, len(WAYS))
    held = push_budget(region, reach, body, WAYS, legs)
    assert np.all(held <= free + 1e-12)
    far = push_budget(region, reach, body, WAYS, np.full(len(WAYS), 10.0))
    np.testing.assert_allclose(far, free, rtol=1e-12, atol=1e-12)


@FEW
@given(SEEDS, st.floats(0.05, 1.0))
def test_room_around_caps_the_throw(seed: int, share: float) -> None:
    """No throw of the budget is more than the static margin over the share that it may miss by."""
    rng = np.random.default_rng(seed)
    feet = stand_plan().end.feet + rng.uniform(-0.1, 0.1, (4, 3)) * [1.0, 1.0, 0.0]
    contacts = make_contacts(feet, friction=0.8)
    x, y = feet[:, :2].mean(axis=0) + rng.uniform(-0.2, 0.2, 2)
    body = Pendulum(x, y, 0.85)
    region, area = find_region(contacts), find_pressure_area(contacts, body)
    around = max(region.margin(body.x, body.y), 0.0)
    assert np.all(around <= way_out(region, body.x, body.y, WAYS) + 1e-9)
    reach = pressure_reach(region, area, body, WAYS)
    budget = push_budget(region, reach, body, WAYS, swing_back=share)
    free = push_budget(region, reach, body, WAYS)
    np.testing.assert_allclose(budget, np.minimum(free, body.rate * around / share), atol=1e-9)
    assert 0.0 < SWING_BACK < 1.0
