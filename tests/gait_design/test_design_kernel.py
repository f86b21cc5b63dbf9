"""The search's arithmetic, pose by pose: own kinematics, the gait floor's margin, fair shares."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from design_rig import shape, unswayed
from hypothesis import given, strategies as st
from rig import paper_robot, with_raised
from scipy.stats import qmc

from drake_quad.common import FloatArray
from drake_quad.gait_design import objective as objective_module
from drake_quad.gait_design.candidates import (
    LOWER,
    UPPER,
    Staircase,
    candidate_bounds,
    make_candidates,
    make_cycle,
    make_foothold_patterns,
)
from drake_quad.gait_design.clearance_kernels import SHANK, THIGH, place_points
from drake_quad.gait_design.kernels import slacks
from drake_quad.gait_design.objective import (
    NAMES,
    evaluate_candidates,
    objective,
    robot_tables,
    wanted_with_tolerance,
)
from drake_quad.gait_design.pose_kernels import (
    best_sway,
    centre_of_mass,
    joint_angles,
    pose_of,
    static_foot_loads,
    torque_used,
)
from drake_quad.gait_design.search import latin_hypercube
from drake_quad.math.rotations import rotations
from drake_quad.planning.clearance import knee_axes, shank_middles
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_jacobians, calc_knees, leg_array, leg_row
from drake_quad.robot.model import SHANK_POINTS
from drake_quad.stability.support_polygon import stability_margins


@given(st.integers(0, 2**32 - 1))
def test_kernel_has_the_robots_own_kinematics(seed: int) -> None:
    """Angles, centre of mass, torques and points are those of the robot floor."""
    rng = np.random.default_rng(seed)
    robot = with_raised(paper_robot(), rng.uniform(-0.1, 0.1, 4) * rng.integers(0, 2))
    g = robot.geometry
    legs = leg_array(g)
    tables = robot_tables(robot, shape())
    body = np.array([*rng.uniform(-0.1, 0.1, 2), 0.8, rng.uniform(-0.5, 0.5), 0.0])
    feet = g.p_BH - np.array([0.0, 0.0, 0.8]) + rng.uniform(-0.15, 0.15, (4, 3)) + body[:3]
    q, excess, com = pose_robot(robot, body[None], feet[None])
    pose = pose_of(body, 0.0)
    found, points = np.empty((4, 3)), np.empty((4, SHANK + THIGH, 3))
    offsets = rng.uniform(-0.1, 0.1, (4, SHANK))
    R = rotations(body)
    J = calc_jacobians(g, q[0])
    for k in range(4):
        leg = leg_row(legs, k)
        room = joint_angles(leg, pose, feet[k], found[k])
        assert (room < 0.0) == (excess[0, k] > 0.0) or abs(room) < 1e-5
        force = rng.uniform(0.0, 300.0)
        torque = J[k].T @ (R.T @ [0.0, 0.0, -force])
        used = torque_used(leg, found[k], force, pose, robot.effort[3 * k : 3 * k + 3])
        assert used == pytest.approx(np.max(np.abs(torque) / robot.effort[3 * k : 3 * k + 3]))
        place_points(leg, found[k], pose, feet[k], offsets[k], points[k])
    np.testing.assert_allclose(found, q[0], atol=1e-9)
    knees = body[:3] + calc_knees(g, q[0]) @ R.T
    middles = shank_middles(offsets, knees, feet, knee_axes(q[0]) @ R.T)
    np.testing.assert_allclose(points[:, :SHANK], middles, atol=1e-9)
    lines = knees[:, None] + SHANK_POINTS[:, None] * (feet - knees)[:, None]
    np.testing.assert_allclose(np.linalg.norm(middles - lines, axis=2), np.abs(offsets), atol=1e-9)
    at = np.empty(3)
    centre_of_mass(pose, found, tables, at)
    np.testing.assert_allclose(at, com[0], atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_kernel_has_the_gait_floors_margin_and_fair_shares(seed: int, air: int) -> None:
    """Sway only where it helps; three feet carry the weight without a moment."""
    rng = np.random.default_rng(seed)
    corners = [[0.4, 0.3, 0.0], [0.4, -0.3, 0.0], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]]
    feet = np.array(corners) + rng.uniform(-0.1, 0.1, (4, 3))
    com = np.array([*rng.uniform(-0.15, 0.15, 2), 0.6])
    standing = np.arange(4) != air
    still = stability_margins(com[None, :2], feet[None, :, :2], standing[None])[0]
    _, unmoved = best_sway(com, feet, air, 0.0, 0.05)
    assert unmoved == pytest.approx(still, abs=1e-9)
    sway, margin = best_sway(com, feet, air, 0.2, 0.05)
    moved = np.array([[com[0], com[1] + sway]])
    assert margin == pytest.approx(
        stability_margins(moved, feet[None, :, :2], standing[None])[0], abs=1e-9
    )
    assert margin >= min(still, 0.05) - 1e-3
    forces = np.zeros(4)
    static_foot_loads(com[0], com[1], feet, air, 100.0, forces)
    assert forces[air] == 0.0 and forces.sum() == pytest.approx(100.0)
    np.testing.assert_allclose(forces @ feet[:, :2] / 100.0, com[:2], atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(-1.0, 5.0))
def test_only_the_hopeless_are_not_looked_at_to_the_end(seed: int, enough: float) -> None:
    """Those that lack no more than enough are judged in full, the others lack more than that."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.4)
    parameters = np.random.default_rng(seed).uniform(LOWER, UPPER, (8, len(LOWER)))
    grid, limits = make_candidates(robot, FootholdPattern(), parameters), np.full(8, enough)
    full = evaluate_candidates(robot, shape(), grid, stairs, clearance=0.02)
    quick = evaluate_candidates(robot, shape(), grid, stairs, clearance=0.02, enough=limits)
    wanted = wanted_with_tolerance(robot)
    good = objective(full, wanted) <= enough
    np.testing.assert_array_equal(quick[good], full[good])
    assert np.all(objective(quick[~good], wanted) > enough)
    for name in ("height", "shift_down"):
        np.testing.assert_array_equal(getattr(grid.take(good), name), getattr(grid, name)[good])


def test_one_candidate_alone_is_judged_as_among_others() -> None:
    """A grid of one gives the same row."""
    robot, stairs = paper_robot(), Staircase(-0.13, 0.4)
    parameters = np.random.default_rng(1).uniform(LOWER, UPPER, (8, len(LOWER)))
    many = evaluate_candidates(
        robot,
        shape(),
        make_candidates(robot, FootholdPattern(), parameters),
        stairs,
        clearance=0.02,
    )
    for k in (0, 3, 7):
        grid = make_candidates(robot, FootholdPattern(), parameters[k])
        one = evaluate_candidates(robot, shape(), grid, stairs, clearance=0.02)
        np.testing.assert_allclose(one[0], many[k], atol=1e-12)


def test_two_threads_find_what_one_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each evaluates half of the candidates; on one core all are evaluated here: the same bits."""
    pattern, stairs = FootholdPattern(2, 1), Staircase(0.15, 0.3)
    lower, upper, _ = candidate_bounds(pattern)
    x = lower + np.random.default_rng(4).random((21, len(lower))) * (upper - lower)
    grid = make_candidates(paper_robot(), pattern, x)
    found, threads = [], []
    for cores in (2, 1):
        monkeypatch.setattr(objective_module, "CORES", cores)
        calls: set[int] = set()

        def noted(*given: Any, calls: set[int] = calls) -> None:
            calls.add(threading.get_ident())
            slacks(*given)

        monkeypatch.setattr(objective_module, "slacks", noted)
        found.append(evaluate_candidates(paper_robot(), shape(), grid, stairs, clearance=0.02))
        threads.append(len(calls))
    assert np.array_equal(found[0], found[1]) and np.isfinite(found[0]).all()
    assert threads == [2, 1]


@given(st.integers(1, 30), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_a_first_population_has_one_member_in_each_slice(n: int, axes: int, seed: int) -> None:
    """Along every axis; and its numbers are those of scipy, which takes half a second to import."""
    points = latin_hypercube(n, axes, np.random.default_rng(seed))
    assert np.array_equal(
        np.sort(np.ceil(points * n), axis=0), np.tile(np.arange(1, n + 1)[:, None], axes)
    )
    known = qmc.LatinHypercube(axes, rng=np.random.default_rng(seed)).random(n)
    assert np.array_equal(latin_hypercube(n, axes, np.random.default_rng(seed).spawn(1)[0]), known)


def test_the_search_knows_that_feet_roll() -> None:
    """The margin of a candidate that does not sway is that of feet rolled since they landed."""
    robot, stairs = paper_robot(), Staircase(0.13, 0.5)
    pattern = make_foothold_patterns(robot, [stairs.run])[0]
    grid = make_candidates(robot, pattern, candidate_bounds(pattern)[2][None])
    cycle = make_cycle(grid, stairs, foot_radius=robot.foot_radius, clearance=0.02)
    body, feet = cycle.body[0], cycle.feet[0]
    q, _, com = pose_robot(robot, body, feet)
    tilt = body[:, 3, None] + q[..., 1] + q[..., 2]
    roll = robot.foot_radius * (tilt - np.take_along_axis(tilt, cycle.landed, axis=0))
    rolled = feet.copy()
    rolled[..., 0] += roll

    def least(places: FloatArray) -> float:
        standing = np.arange(4) != cycle.swing[:, None]
        return float(stability_margins(com[:, :2], places[..., :2], standing).min())

    assert abs(least(rolled) - least(feet)) > 1e-4
    found = unswayed(grid, stairs, shape())
    assert found[NAMES.index("margin")] == pytest.approx(least(rolled), abs=1e-9)


def test_the_search_keeps_shanks_off_the_trunks_parts_alone() -> None:
    """Not off one box about them; a part where shanks go takes room away."""
    grid, stairs = (
        make_candidates(
            paper_robot(), FootholdPattern(), candidate_bounds(FootholdPattern())[2][None]
        ),
        Staircase(0.13, 0.4),
    )
    outline, apart = shape(), NAMES.index("apart")
    box = np.array([outline.trunk_lower, outline.trunk_upper])
    long = np.array([box[0] - [0.3, 0.2, 0.4], box[1] + [0.3, 0.2, 0.0]])
    whole = replace(outline, trunk_lower=long[0], trunk_upper=long[1])
    alone, filled = (
        evaluate_candidates(
            paper_robot(), replace(whole, trunk_parts=part[None]), grid, stairs, clearance=0.02
        )[0]
        for part in (box, long)
    )
    assert filled[apart] < 0.0 < alone[apart]
