"""Laws of the abduction-hip-knee leg: inverse against forward, Jacobian, mirrors, continuity.

Each example is one random robot, in hundreds of random poses at once.
"""

import numpy as np
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.robot.kinematics import calc_feet, calc_jacobians, solve_legs
from drake_quad.robot.legs import SIGNS
from drake_quad.robot.model import LegGeometry

POSES = 400
seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=20)


def random_legs(rng: np.random.Generator) -> LegGeometry:
    """Four legs of lengths of their own, each offset outward, with knees either way."""
    hips = np.column_stack(
        [
            SIGNS[:, 0] * rng.uniform(0.1, 0.6, 4),
            SIGNS[:, 1] * rng.uniform(0.05, 0.3, 4),
            rng.uniform(-0.1, 0.1, 4),
        ]
    )
    return LegGeometry(
        p_BH=hips,
        offset=SIGNS[:, 1] * rng.uniform(0.0, 0.15, 4) * rng.integers(0, 2),
        thigh=rng.uniform(0.2, 0.7, 4),
        shank=rng.uniform(0.2, 0.7, 4),
        knee_sign=rng.choice([-1.0, 1.0], 4),
        raised=rng.uniform(-0.1, 0.1, 4) * rng.integers(0, 2),
    )


def random_poses(rng: np.random.Generator, legs: LegGeometry) -> FloatArray:
    """Angles (POSES, 4, 3) with each knee on its own side and each foot well below its hip."""
    shape = (POSES, 4)
    abduction = rng.uniform(-1.2, 1.2, shape)
    hip = rng.uniform(-1.3, 1.3, shape)
    knee = legs.knee_sign * rng.uniform(0.2, 2.6, shape)
    below = legs.thigh * np.cos(hip) + legs.shank * np.cos(hip + knee) > 0.05 + legs.raised
    # A leg stretched towards the ground stands in for those whose foot is above the hip.
    hip, knee = (
        np.where(below, hip, -0.1 * legs.knee_sign),
        np.where(below, knee, 0.2 * legs.knee_sign),
    )
    return np.stack([abduction, hip, knee], axis=-1)


def stumps(legs: LegGeometry) -> LegGeometry:
    """The same legs cut off at their hip pitch axes."""
    nothing = np.zeros(4)
    return LegGeometry(legs.p_BH, legs.offset, nothing, nothing, legs.knee_sign, legs.raised)


def mirrored(legs: LegGeometry, rows: list[int], flip: tuple[float, float]) -> LegGeometry:
    """The same robot seen in a mirror that exchanges `rows` and flips x and y by `flip`."""
    return LegGeometry(
        legs.p_BH[rows] * [*flip, 1.0],
        flip[1] * legs.offset[rows],
        legs.thigh[rows],
        legs.shank[rows],
        flip[0] * legs.knee_sign[rows],
        legs.raised[rows],
    )


@examples
@given(seeds)
def test_inverse_of_forward_is_the_identity(seed: int) -> None:
    """The angles that put the feet somewhere come back from where the feet are."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    q = random_poses(rng, legs)
    back, excess = solve_legs(legs, calc_feet(legs, q))
    np.testing.assert_allclose(back, q, atol=1e-7)
    assert np.all(excess == 0.0)


@examples
@given(seeds)
def test_forward_of_inverse_is_the_identity_or_misses_by_the_excess(seed: int) -> None:
    """A foot is put where it was asked for; out of reach, it is `excess` away, no more."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    p_HF = rng.uniform(-1.5, 1.5, (POSES, 4, 3))
    # Nearer to the abduction axis than the leg's plane no foot of this kind can be.
    near = np.hypot(p_HF[..., 1], p_HF[..., 2]) < np.abs(legs.offset) + 0.01
    p_HF[near] = [0.1, 0.0, -0.6]
    q, excess = solve_legs(legs, legs.p_BH + p_HF)
    miss = np.linalg.norm(calc_feet(legs, q) - legs.p_BH - p_HF, axis=-1)
    np.testing.assert_allclose(miss, excess, atol=5e-6)
    assert np.any(excess > 0.1) and np.any(excess == 0.0)


@examples
@given(seeds)
def test_out_of_reach_the_leg_stretches_towards_the_foot(seed: int) -> None:
    """Beyond a stretched leg the excess is the distance, and the direction is kept."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    straight = random_poses(rng, legs) * [1.0, 1.0, 0.0]
    feet = calc_feet(legs, straight)
    leg = feet - calc_feet(stumps(legs), straight)
    beyond = rng.uniform(0.01, 0.5, (POSES, 4))
    target = feet + beyond[..., None] * leg / np.linalg.norm(leg, axis=-1, keepdims=True)
    q, excess = solve_legs(legs, target)
    np.testing.assert_allclose(excess, beyond, atol=5e-6)
    np.testing.assert_allclose(calc_feet(legs, q), feet, atol=5e-6)


@examples
@given(seeds, st.floats(1e-9, 1e-2))
def test_inverse_is_continuous_also_across_the_limit_of_reach(seed: int, step: float) -> None:
    """A small move of the foot turns no joint far: by its square root at most, stretched."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    # Around the limit of reach, well below the hip and outside of the fold of the knee.
    towards = rng.normal(size=(POSES, 4, 3)) * [1.0, 0.5, 0.0] - [0.0, 0.0, 1.0]
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    p_HF = legs.reach[:, None] * rng.uniform(0.9, 1.2, (POSES, 4, 1)) * towards
    p_HF[..., 1] += legs.offset
    direction = rng.normal(size=(POSES, 4, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    a, inside = solve_legs(legs, legs.p_BH + p_HF)
    b, _ = solve_legs(legs, legs.p_BH + p_HF + step * direction)
    assert np.any(inside > 0.0) and np.any(inside == 0.0)
    assert np.abs(b - a).max() <= 10.0 * np.sqrt(step)


@examples
@given(seeds)
def test_jacobian_is_the_derivative_of_the_feet(seed: int) -> None:
    """Each column equals the central difference of the feet over that joint."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    q = random_poses(rng, legs)
    J, h = calc_jacobians(legs, q), 1e-6
    for column in range(3):
        step = h * np.eye(3)[column]
        difference = (calc_feet(legs, q + step) - calc_feet(legs, q - step)) / (2 * h)
        np.testing.assert_allclose(J[..., column], difference, atol=1e-8)


@examples
@given(seeds)
def test_left_and_right_are_mirror_images(seed: int) -> None:
    """The mirrored robot puts mirrored feet at the same angles, abductions turned round."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    q = random_poses(rng, legs)
    rows = [1, 0, 3, 2]
    other, q_other = mirrored(legs, rows, (1.0, -1.0)), q[:, rows] * [-1.0, 1.0, 1.0]
    feet = calc_feet(legs, q)[:, rows] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(calc_feet(other, q_other), feet, atol=1e-12)
    np.testing.assert_allclose(solve_legs(other, feet)[0], q_other, atol=1e-7)


@examples
@given(seeds)
def test_front_and_rear_are_mirror_images(seed: int) -> None:
    """The robot that faces backward has hip pitch and knee of the other sign."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    q = random_poses(rng, legs)
    rows = [2, 3, 0, 1]
    other, q_other = mirrored(legs, rows, (-1.0, 1.0)), q[:, rows] * [1.0, -1.0, -1.0]
    feet = calc_feet(legs, q)[:, rows] * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(calc_feet(other, q_other), feet, atol=1e-12)
    np.testing.assert_allclose(solve_legs(other, feet)[0], q_other, atol=1e-7)


@examples
@given(seeds)
def test_many_poses_at_once_are_each_alone(seed: int) -> None:
    """Leading axes are batches of any shape: nothing of one pose gets into another."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    q = random_poses(rng, legs)[:6].reshape(2, 3, 4, 3)
    feet, J = calc_feet(legs, q), calc_jacobians(legs, q)
    back, excess = solve_legs(legs, feet)
    assert feet.shape == (2, 3, 4, 3) and J.shape == (2, 3, 4, 3, 3) and excess.shape == (2, 3, 4)
    for i, j in np.ndindex(2, 3):
        np.testing.assert_array_equal(feet[i, j], calc_feet(legs, q[i, j]))
        np.testing.assert_array_equal(J[i, j], calc_jacobians(legs, q[i, j]))
        np.testing.assert_array_equal(back[i, j], solve_legs(legs, feet[i, j])[0])


@examples
@given(seeds)
def test_reach_is_the_length_of_the_stretched_leg(seed: int) -> None:
    """A straight leg is `reach` long from its hip pitch axis, a bent one shorter."""
    rng = np.random.default_rng(seed)
    legs = random_legs(rng)
    for bend, longest in ((0.0, True), (1.0, False)):
        q = random_poses(rng, legs) * [1.0, 1.0, bend]
        length = np.linalg.norm(calc_feet(legs, q) - calc_feet(stumps(legs), q), axis=-1)
        reached = np.isclose(length, legs.reach, rtol=0.0, atol=1e-9)
        assert np.all(reached == longest) and np.all(length <= legs.reach + 1e-9)
