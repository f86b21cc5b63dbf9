"""Laws of how the standing feet share a wrench."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy.optimize import linprog

from drake_quad.common import FloatArray, Vector
from drake_quad.planning.wrench_distribution import UPRIGHT, distribute_wrench
from drake_quad.robot.legs import SIGNS
from drake_quad.stability.support_polygon import stability_margin

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=200)
WEIGHT = 590.0  # [N]
PLENTY = 1e6  # of friction


def vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def random_arms(rng: np.random.Generator) -> FloatArray:
    """Four feet about a centre of mass that is over them, (4, 3) [m]."""
    feet = np.column_stack([SIGNS * [0.45, 0.33], np.full(4, -0.8)])
    return np.asarray(feet + rng.uniform(-0.25, 0.25, (4, 3)))


def random_wrench(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """The weight, and a little of every other force and moment."""
    force = np.array([0.0, 0.0, WEIGHT]) + rng.uniform(-30.0, 30.0, 3)
    return force, rng.uniform(-20.0, 20.0, 3)


def share(
    force: FloatArray,
    moment: FloatArray,
    arms: FloatArray,
    load: FloatArray,
    *,
    least: float = 0.0,
    friction: float = PLENTY,
) -> FloatArray:
    """`distribute_wrench` on arrays, (4, 3) [N]."""
    found = distribute_wrench(
        vector(force),
        vector(moment),
        [vector(p) for p in arms],
        load.tolist(),
        least=least,
        friction=friction,
    )
    return np.array(found)


def wrench_of(forces: FloatArray, arms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force and moment about the centre of mass that forces at the feet make."""
    return forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)


def most_of_the_least(
    force: FloatArray, moment: FloatArray, arms: FloatArray, forces: FloatArray
) -> float:
    """The greatest smallest normal force that four feet can push with, by linear programming.

    The horizontal forces are those of `forces`; the normal ones make up the rest of the wrench.
    """
    x, y, z = arms.T
    rows = np.array([np.ones(4), y, -x])
    right = [
        force[2],
        moment[0] + float(z @ forces[:, 1]),
        moment[1] - float(z @ forces[:, 0]),
    ]
    result = linprog(
        [0, 0, 0, 0, -1],
        A_ub=np.column_stack([-np.eye(4), np.ones(4)]),
        b_ub=np.zeros(4),
        A_eq=np.column_stack([rows, np.zeros(3)]),
        b_eq=right,
        bounds=[(None, None)] * 5,
    )
    assert result.success
    return float(result.x[4])


@examples
@given(seeds)
def test_wrench_is_reproduced_where_pushing_feet_can_make_it(seed: int) -> None:
    """Whenever some forces without pull make up the wrench, the ones found do."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    # A foot that pushes with nothing has no friction either: each is to push with a newton.
    forces = share(force, moment, arms, rng.uniform(0.1, 1.0, 4), least=1.0)
    assume(most_of_the_least(force, moment, arms, forces) > 1.0)
    made_force, made_moment = wrench_of(forces, arms)
    np.testing.assert_allclose(made_force, force, atol=1e-6)
    np.testing.assert_allclose(made_moment, moment, atol=1e-6)


@examples
@given(seeds, st.integers(-1, 3))
def test_feet_never_pull_nor_slide(seed: int, lifted: int) -> None:
    """Whatever is asked, normal forces are not negative and all are in their friction cones."""
    rng = np.random.default_rng(seed)
    arms = random_arms(rng)
    load = np.where(np.arange(4) == lifted, 0.0, rng.uniform(0.1, 1.0, 4))
    force, moment = rng.uniform(-800.0, 800.0, 3), rng.uniform(-400.0, 400.0, 3)
    forces = share(force, moment, arms, load, least=20.0, friction=0.5)
    assert np.all(forces[:, 2] >= 0.0)
    assert np.all(np.hypot(forces[:, 0], forces[:, 1]) <= 0.5 * forces[:, 2] + 1e-9)


@examples
@given(seeds, st.integers(0, 3))
def test_three_feet_get_the_only_solution_there_is(seed: int, lifted: int) -> None:
    """With one foot in the air the normal forces are those of the three balance equations."""
    rng = np.random.default_rng(seed)
    arms = random_arms(rng)
    standing = [k for k in range(4) if k != lifted]
    assume(stability_margin((0.0, 0.0), arms[standing, :2]) > 0.02)
    load = np.where(np.arange(4) == lifted, 0.0, rng.uniform(0.1, 1.0, 4))
    weight = np.array([0.0, 0.0, WEIGHT])
    forces = share(weight, np.zeros(3), arms, load)
    x, y, _ = arms[standing].T
    expected = np.linalg.solve(np.array([np.ones(3), y, -x]), weight[[2, 0, 0]])
    np.testing.assert_allclose(forces[standing, 2], expected, rtol=1e-6)
    np.testing.assert_allclose(forces[lifted], 0.0, atol=1e-9)
    np.testing.assert_allclose(forces[:, :2], 0.0, atol=1e-6)


@examples
@given(seeds)
def test_normal_forces_are_the_least_squares_by_load(seed: int) -> None:
    """Where no foot needs holding down, Σ f²/load is the smallest of all that balance."""
    rng = np.random.default_rng(seed)
    arms, load = random_arms(rng), rng.uniform(0.1, 1.0, 4)
    weight = np.array([0.0, 0.0, WEIGHT])
    forces = share(weight, np.zeros(3), arms, load)
    assume(np.all(forces[:, 2] > 1.0))
    x, y, _ = arms.T
    A = np.array([np.ones(4), y, -x])
    kkt = np.block([[np.diag(1.0 / load), A.T], [A, np.zeros((3, 3))]])
    expected = np.linalg.solve(kkt, [0.0, 0.0, 0.0, 0.0, WEIGHT, 0.0, 0.0])[:4]
    np.testing.assert_allclose(forces[:, 2], expected, rtol=1e-6)


@examples
@given(seeds)
def test_every_full_foot_pushes_with_the_least_force_where_that_can_be(seed: int) -> None:
    """If any forces that balance keep all four feet at `least`, the ones found do."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    least = 40.0
    forces = share(force, moment, arms, np.ones(4), least=least)
    possible = most_of_the_least(force, moment, arms, forces)
    assume(abs(possible - least) > 1e-3)
    if possible > least:
        assert forces[:, 2].min() >= least - 1e-6
        made_force, made_moment = wrench_of(forces, arms)
        np.testing.assert_allclose(made_force, force, atol=1e-6)
        np.testing.assert_allclose(made_moment, moment, atol=1e-6)


@examples
@given(seeds)
def test_order_of_the_feet_does_not_matter(seed: int) -> None:
    """Feet given in another order get the same forces, in that order."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    load = rng.uniform(0.1, 1.0, 4)
    forces = share(force, moment, arms, load, least=30.0, friction=0.5)
    for order in list(permutations(range(4)))[1::5]:
        rows = list(order)
        other = share(force, moment, arms[rows], load[rows], least=30.0, friction=0.5)
        np.testing.assert_allclose(other, forces[rows], atol=1e-6)


@examples
@given(seeds)
def test_mirrored_wrench_on_mirrored_feet_gets_mirrored_forces(seed: int) -> None:
    """Left and right are alike: nothing prefers a side."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    load = rng.uniform(0.1, 1.0, 4)
    flip, turn = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    forces = share(force, moment, arms, load, least=30.0, friction=0.5)
    other = share(force * flip, moment * turn, arms * flip, load, least=30.0, friction=0.5)
    np.testing.assert_allclose(other, forces * flip, atol=1e-6)


@examples
@given(seeds, st.floats(-3.2, 3.2))
def test_turned_wrench_on_turned_feet_gets_turned_forces(seed: int, angle: float) -> None:
    """No direction of the ground is special."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    load = rng.uniform(0.1, 1.0, 4)
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    forces = share(force, moment, arms, load, least=30.0, friction=0.5)
    other = share(R @ force, R @ moment, arms @ R.T, load, least=30.0, friction=0.5)
    np.testing.assert_allclose(other, forces @ R.T, atol=1e-5)


def test_a_foot_that_is_about_to_lift_off_bears_next_to_nothing() -> None:
    """As a foot's load goes to 0 the forces go to those of the other three, without a jump."""
    rng = np.random.default_rng(1)
    arms = random_arms(rng) + np.array([0.06, 0.04, 0.0])
    weight = np.array([0.0, 0.0, WEIGHT])
    three = share(weight, np.zeros(3), arms, np.array([0.0, 1.0, 1.0, 1.0]), least=20.0)
    assert three[:, 2].sum() == pytest.approx(WEIGHT)
    gaps = []
    for load in (0.1, 0.01, 1e-4):
        four = share(weight, np.zeros(3), arms, np.array([load, 1.0, 1.0, 1.0]), least=20.0)
        gaps.append(float(np.abs(four - three).max()))
    assert gaps[0] > gaps[1] > gaps[2] and gaps[2] < 0.2


def test_what_three_feet_cannot_give_is_left_out() -> None:
    """With the centre of mass outside, no foot pulls and the vertical force is there at least."""
    arms = np.column_stack([SIGNS * [0.4, 0.3], np.full(4, -0.8)]) - [0.3, 0.2, 0.0]
    load = np.array([0.0, 1.0, 1.0, 1.0])  # the foot it leans towards is in the air
    weight = np.array([0.0, 0.0, WEIGHT])
    forces = share(weight, np.zeros(3), -arms, load)
    assert np.all(forces[:, 2] >= 0.0) and forces[0, 2] == 0.0
    assert forces[:, 2].sum() >= WEIGHT - 1e-6


@given(seeds)
def test_on_slopes_no_force_leaves_its_cone(seed: int) -> None:
    """The cones stand about the ground's normals; upright ones change nothing, to the bit."""
    rng = np.random.default_rng(seed)
    arms, (force, moment) = random_arms(rng), random_wrench(rng)
    given = (vector(force), vector(moment), [vector(arm) for arm in arms], [1.0] * 4)
    gradient = rng.uniform(-0.5, 0.5, (4, 2))
    normals = np.column_stack([-gradient, np.ones(4)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found = np.array(distribute_wrench(*given, normals=[vector(n) for n in normals]))
    push = np.sum(found * normals, axis=1)
    along = np.linalg.norm(found - push[:, None] * normals, axis=1)
    assert np.all(push >= -1e-9) and np.all(along <= 0.5 * push + 1e-6)
    assert distribute_wrench(*given, normals=UPRIGHT) == distribute_wrench(*given)
