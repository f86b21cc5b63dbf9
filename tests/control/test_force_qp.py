"""The whole-body program: a second solver agrees, limits hold, no answer where there is none."""

from typing import NamedTuple

import numpy as np
import piqp
import pytest
from hypothesis import example, given, settings, strategies as st
from rig import GRAVITY, flat_walk, model_layout, model_plant, paper_robot, state_of

from drake_quad.common import FloatArray
from drake_quad.control.inverse_dynamics import Dynamics, contact_axes, reduce_dynamics, turn_forces
from drake_quad.control.kernel_state import Weights
from drake_quad.control.measurement import measure
from drake_quad.control.whole_body_qp import (
    SOFT,
    FootBounds,
    JointBounds,
    Program,
    _support_sides,
    has_numbers,
    make_program,
    solve,
    spread_variables,
)
from drake_quad.robot.kinematics import leg_array
from drake_quad.stability.support_polygon import stability_margin

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=60)
WEIGHT = paper_robot().mass * GRAVITY
WEIGHTS = Weights(
    angular=1.0,
    linear=1.0,
    force=1e-6,
    along=1e-5,
    greatest_force=1.5 * WEIGHT,
    pressure_margin=0.01,
)
FRICTION = 0.5
LEAST = 20.0  # [N]
MU = np.full(4, FRICTION)
LEVEL = np.tile(np.eye(3), (4, 1, 1))  # axes of forces on level ground
EVEN = np.ones(4)  # forces along the ground cost the same at all feet
RHO = 1e-6  # DAQP's price of soft constraints


class Case(NamedTuple):
    """A program and what it was made of."""

    program: Program
    dynamics: Dynamics
    feet: FootBounds
    wanted: FloatArray
    effort: FloatArray

    @property
    def load(self) -> FloatArray:
        """How much each foot may carry (4,)."""
        return self.feet.load

    @property
    def places(self) -> FloatArray:
        """The feet's centres (4, 3) [m]."""
        return self.feet.place

    @property
    def forces(self) -> FloatArray:
        """Its solution, (4, 3) [N]."""
        x = solve(self.program)
        assert x is not None
        return spread_variables(x, self.load).reshape(4, 3)

    @property
    def torque(self) -> FloatArray:
        """The joints' torques of its solution (12,) [Nm]."""
        return self.dynamics.torque @ self.forces.ravel() + self.dynamics.torque_offset


def feet_of(load: FloatArray, place: FloatArray) -> FootBounds:
    """The bounds of feet on level ground."""
    return FootBounds(load, place, MU, LEAST * load, LEVEL, EVEN)


def random_load(rng: np.random.Generator) -> FloatArray:
    """Four feet, three, or four of which one is about to lift off."""
    load = np.ones(4)
    kind = rng.integers(3)
    if kind:
        load[rng.integers(4)] = 0.0 if kind == 1 else rng.uniform(0.01, 1.0)
    return load


def case_of(seed: int, *, effort: float = 1.0, calm: bool = False, urge: float = 1.0) -> Case:
    """A robot off its stance and in motion, that wants some acceleration.

    Args:
        seed: Of everything random in it.
        effort: The robot's torque limits are multiplied by it.
        calm: At rest, on four feet.
        urge: What it wants is multiplied by it.
    """
    rng = np.random.default_rng(seed)
    robot, plant, layout = paper_robot(), model_plant(), model_layout()
    sample = flat_walk().sample(0.0)
    places = sample.feet + rng.uniform(-0.08, 0.08, (4, 3))
    body = sample.body[0] + rng.uniform(-0.05, 0.05, 5)
    speeds = np.concatenate([rng.uniform(-0.3, 0.3, 6), rng.uniform(-1.0, 1.0, 12)])
    state = state_of(body, places, velocity=speeds * (0.0 if calm else 1.0))
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    measured = measure(layout, leg_array(robot.geometry), robot.foot_radius, state, state)
    load = np.ones(4) if calm else random_load(rng)
    swing = np.where(load == 0.0, 1.0, 0.0)[:, None] * rng.uniform(-3.0, 3.0, 3)
    dynamics = reduce_dynamics(
        plant.CalcMassMatrix(context),
        plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context),
        (layout.v_joints - layout.num_positions).astype(np.int64),
        measured.feet,
        swing,
        measured.p,
        robot.foot_radius,
    )
    wanted = rng.uniform(-1.0, 1.0, 6) * [2.0, 2.0, 2.0, 1.5, 1.5, 1.5]
    wanted *= urge
    lower = 800.0 * (robot.q_lower - measured.q - 0.05 * measured.qd)
    upper = 800.0 * (robot.q_upper - measured.q - 0.05 * measured.qd)
    limit = effort * robot.effort
    feet = feet_of(load, np.array(measured.feet.place))
    program = make_program(dynamics, wanted, feet, JointBounds(limit, lower, upper), WEIGHTS)
    return Case(program, dynamics, feet, wanted, limit)


def on_slopes(seed: int, *, steepest: float = 0.5) -> tuple[Case, FloatArray]:
    """The same as `case_of`, each foot on a slope of its own; and the forces' axes (4, 3, 3)."""
    rng, case = np.random.default_rng(seed), case_of(seed)
    gradient = rng.uniform(-steepest, steepest, (4, 2)) / np.sqrt(2.0)
    normals = np.column_stack([-gradient, np.ones(4)])
    axes = contact_axes(normals / np.linalg.norm(normals, axis=1)[:, None])
    maps = Dynamics(*(np.array(part) for part in case.dynamics))
    turn_forces(maps, axes)
    bound = np.full(12, 1e4)
    feet, joints = case.feet._replace(axes=axes), JointBounds(case.effort, -bound, bound)
    program = make_program(maps, case.wanted, feet, joints, WEIGHTS)
    return case._replace(program=program, dynamics=maps), axes


def second_opinion(p: Program) -> FloatArray:
    """The solution by PIQP's interior point, of the same program written out with slacks.

    DAQP lets a soft row give way by e at the price e^2 / (2 RHO), where the row is as long as one
    in the metric of the program's Hessian (Arnström, Bemporad, Axehill: "A dual active-set solver
    for embedded quadratic programming", IEEE TAC 2022).
    """
    n, m = len(p.g), len(p.A)
    size = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(p.H), p.A.T), axis=0)
    soft = np.flatnonzero(p.sense[n:] == SOFT)
    k, scale = len(soft), 1e4  # of the cost: forces are large and their price small
    H = np.zeros((n + k, n + k))
    H[:n, :n], H[n:, n:] = scale * p.H, scale * np.eye(k)
    slack = np.zeros((m, k))
    slack[soft, np.arange(k)] = np.sqrt(RHO) * size[soft]
    norm = np.linalg.norm(p.A, axis=1)
    free = np.full(k, np.inf)
    lower = np.where(p.lower <= -1e29, -np.inf, p.lower)
    upper = np.where(p.upper >= 1e29, np.inf, p.upper)
    solver = piqp.DenseSolver()
    # Tighter than it can be: it goes on until it gets no further.
    solver.settings.eps_abs = solver.settings.eps_duality_gap_abs = 1e-10
    solver.settings.eps_rel = solver.settings.eps_duality_gap_rel = 0.0
    solver.settings.max_iter = 300
    solver.setup(
        H,
        np.concatenate([scale * p.g, np.zeros(k)]),
        None,
        None,
        np.hstack([p.A, slack]) / norm[:, None],
        lower[n:] / norm,
        upper[n:] / norm,
        np.concatenate([lower[:n], -free]),
        np.concatenate([upper[:n], free]),
    )
    solver.solve()
    return np.array(solver.result.x)[:n]


@pytest.mark.parametrize("effort", [1.0, 0.25, 0.1])
def test_second_solver_finds_the_same_forces(effort: float) -> None:
    """On 200 random states an interior point agrees with the active set, to 1e-4 N.

    With a quarter and a tenth of the torques, soft rows are at their limits in most of them.
    """
    worst = 0.0
    for seed in range(200):
        program = case_of(seed, effort=effort).program
        x = solve(program)
        assert x is not None
        worst = max(worst, float(np.abs(x - second_opinion(program)).max()))
    assert worst < 1e-4


@pytest.mark.parametrize("effort", [1.0, 0.25, 0.1])
def test_forces_stay_within_friction_and_only_push(effort: float) -> None:
    """Cones, least and greatest normal forces: hard, however little torque there is."""
    for seed in range(100):
        case = case_of(seed, effort=effort)
        f = case.forces
        assert np.all(np.hypot(f[:, 0], f[:, 1]) <= FRICTION * f[:, 2] + 1e-3)
        assert np.all(f[:, 2] >= LEAST * case.load - 1e-3)
        assert np.all(f[:, 2] <= WEIGHTS.greatest_force * case.load + 1e-3)
        np.testing.assert_array_equal(f[case.load == 0.0], 0.0)


def test_cones_stand_on_the_ground_as_it_is() -> None:
    """On slopes: within the cone about the normal, pushing as much as asked, pressure inside."""
    most = 0.0
    for seed in range(100):
        case, axes = on_slopes(seed)
        push = case.forces[:, 2]  # along the normal
        along = np.linalg.norm(case.forces[:, :2], axis=1)
        f = np.einsum("kij,kj->ki", axes, case.forces)
        normals = axes[:, :, 2]
        np.testing.assert_allclose(np.sum(f * normals, axis=1), push, atol=1e-9)
        assert np.all(along <= FRICTION * push + 1e-3)
        assert np.all(push >= LEAST * case.load - 1e-3)
        assert np.all(push <= WEIGHTS.greatest_force * case.load + 1e-3)
        most = max(most, float(np.max(along / np.maximum(push, 1e-9))))
        pressure = f[:, 2] @ case.places[:, :2] / f[:, 2].sum()
        inside = stability_margin(pressure, case.places[case.load > 0.0, :2])
        assert inside > WEIGHTS.pressure_margin - 1e-5
    assert most > 0.96 * FRICTION  # the cone is used


@examples
@given(seeds, st.floats(0.0, 2.0 * np.pi))
def test_pyramid_on_a_slope_leaves_little_of_the_cone_out(seed: int, angle: float) -> None:
    """Eight sides within the cone: 92 % of its friction every way, all of it down the slope."""
    case, _ = on_slopes(seed)
    n, foot = len(case.program.g), int(np.flatnonzero(case.load > 0.0)[0])
    rows = case.program.A[:8, :3]
    assert case.load[foot] > 0.0 and n >= 9
    steepest = [np.max(rows @ [m * np.cos(angle), m * np.sin(angle), 1.0]) for m in (0.0, 1.0)]
    most = -steepest[0] / (steepest[1] - steepest[0]) if steepest[1] > steepest[0] else np.inf
    assert np.cos(np.pi / 8.0) * FRICTION - 1e-9 <= most <= FRICTION + 1e-9
    assert abs(np.max(rows @ [FRICTION, 0.0, 1.0])) < 1e-9


def test_turned_maps_are_those_of_forces_in_their_axes() -> None:
    """Base, joints and torques move alike, told in W or in the ground's axes."""
    for seed in range(20):
        case, axes = on_slopes(seed)
        local = np.random.default_rng(seed).normal(size=(4, 3))
        world = np.einsum("kij,kj->ki", axes, local).ravel()
        plain = case_of(seed).dynamics
        for turned, own in zip(case.dynamics[::2], plain[::2], strict=True):
            np.testing.assert_allclose(turned @ local.ravel(), own @ world, atol=1e-9)


@pytest.mark.parametrize("effort", [1.0, 0.25, 0.1])
def test_torques_stay_within_their_limits(effort: float) -> None:
    """Soft as they are, they give way by no more than 0.1 Nm where they can be kept at all."""
    reached = 0
    for seed in range(100):
        case = case_of(seed, effort=effort)
        over = np.abs(case.torque) - case.effort
        assert over.max() < 0.1
        reached += bool(over.max() > -1e-3)
    assert reached > 50 or effort == 1.0  # the limits do decide


def test_centre_of_pressure_stays_inside_the_support() -> None:
    """By the margin set, over three feet and over four; some programs would rather go further."""
    at_the_edge = 0
    for seed in range(100):
        case = case_of(seed, urge=6.0)
        push = case.forces[:, 2]
        pressure = push @ case.places[:, :2] / push.sum()
        margin = stability_margin(pressure, case.places[case.load > 0.0, :2])
        assert margin > WEIGHTS.pressure_margin - 1e-5
        at_the_edge += margin < WEIGHTS.pressure_margin + 1e-5
    assert at_the_edge > 5


@examples
@given(seeds)
def test_base_accelerates_as_wanted_where_it_can(seed: int) -> None:
    """On four feet, at rest and wanting little, it gets that, but for the price of forces."""
    case = case_of(seed, calm=True, urge=0.1)
    found = case.dynamics.base @ case.forces.ravel() + case.dynamics.base_offset
    np.testing.assert_allclose(found, case.wanted, atol=0.02)


@examples
@given(seeds, st.integers(0, 3))
def test_foot_that_may_carry_less_carries_less(seed: int, row: int) -> None:
    """A foot that gives its load away ends with none: its greatest force goes with its load."""
    rng = np.random.default_rng(seed)
    case = case_of(seed, calm=True, urge=0.1)
    bounds = np.full(12, 1e4)
    pushes = []
    for share in sorted(rng.uniform(0.0, 0.2, 3)):
        load = np.ones(4)
        load[row] = share + 1e-6
        feet, joints = feet_of(load, case.feet.place), JointBounds(case.effort, -bounds, bounds)
        program = make_program(case.dynamics, case.wanted, feet, joints, WEIGHTS)
        x = solve(program)
        assert x is not None
        pushes.append(float(spread_variables(x, load)[3 * row + 2]))
        assert pushes[-1] <= WEIGHTS.greatest_force * load[row] + 1e-3
    assert pushes[0] <= pushes[1] + 1e-3 and pushes[1] <= pushes[2] + 1e-3


def test_limits_that_are_none_are_no_obstacle() -> None:
    """Infinite torques and accelerations count as no limits, and give the same as great ones."""
    case = case_of(3)
    found = []
    for limit in (np.full(12, np.inf), np.full(12, 1e6)):
        joints = JointBounds(limit, -limit, limit)
        program = make_program(case.dynamics, case.wanted, case.feet, joints, WEIGHTS)
        x = solve(program)
        assert x is not None
        found.append(x)
    np.testing.assert_allclose(found[0], found[1], atol=1e-6)


@pytest.mark.parametrize("part", ["H", "g", "A", "lower", "upper"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_program_without_numbers_has_no_solution(part: str, seed: int) -> None:
    """A single nan, anywhere in it."""
    program = case_of(seed).program
    broken = np.array(getattr(program, part))
    broken.flat[seed * 7 % broken.size] = np.nan
    assert has_numbers(program) and solve(program) is not None
    assert not has_numbers(program._replace(**{part: broken}))


def test_program_that_contradicts_itself_has_no_solution() -> None:
    """Hard rows that exclude each other: None, and no exception."""
    program = case_of(0).program
    lower, n = program.lower.copy(), len(program.g)
    lower[n : n + 4] = 1.0  # a force outside each side of its pyramid
    assert solve(program._replace(lower=lower)) is None


@examples
@example(1185540)  # where DAQP cycles
@given(seeds)
def test_soft_rows_give_way_when_there_is_no_other_way(seed: int) -> None:
    """Joints past their limits, which no force brings back in time, still leave a solution."""
    case, rng = case_of(seed), np.random.default_rng(seed)
    lower = rng.uniform(100.0, 1000.0, 12) * rng.choice([-1.0, 1.0], 12)
    upper = lower + rng.uniform(0.0, 1000.0, 12)
    joints = JointBounds(case.effort, lower, upper)
    program = make_program(case.dynamics, case.wanted, case.feet, joints, WEIGHTS)
    x = solve(program)
    assert x is not None
    f = spread_variables(x, case.load).reshape(4, 3)
    # To the solver's own tolerance, which the soft rows' price makes one of the force.
    room = FRICTION * f[:, 2] + 2e-2 + 1e-4 * f[:, 2]
    assert np.all(np.hypot(f[:, 0], f[:, 1]) <= room)


@given(seeds, st.lists(st.booleans(), min_size=4, max_size=4))
def test_spread_puts_forces_under_the_loaded_feet(seed: int, stands: list[bool]) -> None:
    """In their order, with nothing under the others."""
    load = np.array(stands, dtype=float)
    x = np.random.default_rng(seed).normal(size=3 * sum(stands))
    forces = spread_variables(x, load).reshape(4, 3)
    np.testing.assert_array_equal(forces[load > 0.0].ravel(), x)
    np.testing.assert_array_equal(forces[load == 0.0], 0.0)


@examples
@given(seeds, st.sampled_from([3, 4]))
def test_support_sides_are_those_of_the_polygon(seed: int, count: int) -> None:
    """From a point inside, the nearest side is as far as the static margin says.

    Also where one of four feet stands within the triangle of the others.
    """
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 0.5, (4, 3))
    standing = np.sort(rng.permutation(4)[:count])
    sides = _support_sides(places, standing)
    weights = rng.dirichlet(np.ones(count))
    point = weights @ places[standing, :2]
    margin = stability_margin(point, places[standing, :2])
    assert len(sides) >= 3
    np.testing.assert_allclose(np.linalg.norm(sides[:, :2], axis=1), 1.0)
    assert (sides[:, :2] @ point - sides[:, 2]).min() == pytest.approx(margin, abs=1e-9)
