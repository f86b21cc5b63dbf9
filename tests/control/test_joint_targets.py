"""The joints that put the feet where they are to be, in the body as desired or as measured."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from hypothesis import given, settings, strategies as st
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RollPitchYaw
from rig import flat_walk, model_layout, paper_robot

from drake_quad.common import FloatArray
from drake_quad.control.kernel_state import LOOK_AHEAD, make_constants
from drake_quad.control.settings import ControlSettings
from drake_quad.control.tracking import joint_targets
from drake_quad.robot.kinematics import calc_feet, calc_jacobians, leg_array

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=40)
FEET = np.array(flat_walk().contacts.feet)
LIMITS = (paper_robot().q_lower, paper_robot().q_upper)
LOAD, NONE = np.ones(4), np.zeros(3)


class Robot(NamedTuple):
    """The part of CONSTANTS that the joints' targets need."""

    legs: FloatArray = leg_array(paper_robot().geometry)
    q_lower: FloatArray = paper_robot().q_lower
    q_upper: FloatArray = paper_robot().q_upper
    look_ahead: FloatArray = np.full(4, LOOK_AHEAD)


class Base(NamedTuple):
    """The base as measured."""

    p: FloatArray
    R: FloatArray


class Target(NamedTuple):
    """The base as desired, and the feet's loads."""

    body: FloatArray
    R: FloatArray
    v: FloatArray = NONE
    w: FloatArray = NONE
    load: FloatArray = LOAD


ROBOT = Robot()


def turned(seed: int) -> tuple[FloatArray, FloatArray]:
    """A base's place and rotation, a little off the plan's first."""
    rng = np.random.default_rng(seed)
    p = flat_walk().sample(0.0).body[0, :3] + rng.uniform(-0.03, 0.03, 3)
    R = RollPitchYaw(rng.uniform(-0.05, 0.05, 3)).ToRotationMatrix().matrix()
    return p, np.ascontiguousarray(R)  # as the systems give it: another layout compiles anew


def feet_in_world(q: FloatArray, p: FloatArray, R: FloatArray) -> FloatArray:
    return np.asarray(p + calc_feet(paper_robot().geometry, q.reshape(4, 3)) @ R.T)


@examples
@given(seeds)
def test_targets_put_loaded_feet_in_the_desired_body_and_others_in_the_measured(seed: int) -> None:
    """By forward kinematics; half the load, half way between."""
    (p, R), (p_d, R_d) = turned(seed), turned(seed + 1)
    target = Target(p_d, R_d, load=np.array([1.0, 0.0, 1.0, 0.5]))
    q, qd = joint_targets(ROBOT, FEET, np.zeros((4, 3)), Base(p, R), target)
    desired, measured = feet_in_world(q, p_d, R_d), feet_in_world(q, p, R)
    np.testing.assert_allclose(desired[[0, 2]], FEET[[0, 2]], atol=1e-9)
    np.testing.assert_allclose(measured[1], FEET[1], atol=1e-9)
    half = 0.5 * (R.T @ (FEET[3] - p) + R_d.T @ (FEET[3] - p_d))
    np.testing.assert_allclose((measured[3] - p) @ R, half, atol=1e-9)
    np.testing.assert_array_equal(qd, 0.0)


@examples
@given(seeds)
def test_target_speeds_move_feet_and_body_as_desired(seed: int) -> None:
    """The speeds are the derivative of the angles as body and feet move on."""
    rng, (p, R) = np.random.default_rng(seed), turned(seed)
    v, w = rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.2, 0.2, 3)
    feet_v = rng.uniform(-0.3, 0.3, (4, 3))
    h = 1e-5
    _, qd = joint_targets(ROBOT, FEET, feet_v, Base(p, R), Target(p, R, v, w))
    angles = []
    for t in (-h, h):
        size = float(np.linalg.norm(w))
        turn = np.asarray(AngleAxis(t * size, w / size).rotation())
        at = (p + t * v, turn @ R)
        target = Target(*at, v, w)
        angles.append(joint_targets(ROBOT, FEET + t * feet_v, feet_v, Base(*at), target)[0])
    np.testing.assert_allclose(qd, (angles[1] - angles[0]) / (2 * h), atol=1e-5)


def at_legs_ends(seed: int, further: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A base, its R_WB, and feet so much farther out [m] than straight knees have them."""
    rng, robot = np.random.default_rng(seed), paper_robot()
    p, R = turned(seed)
    q = np.column_stack([rng.uniform(-0.2, 0.2, 4), rng.uniform(-0.3, 0.9, 4), LIMITS[1][2::3]])
    feet = calc_feet(robot.geometry, q)
    # A folded leg has its foot by its hip.
    along = feet - calc_feet(robot.geometry, q * [1.0, 0.0, 0.0] + [0.0, 0.0, LIMITS[0][2]])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return p, R, p + (feet + further * along) @ R.T


@examples
@given(seeds, st.floats(0.0, 0.05))
def test_a_leg_that_is_too_short_goes_as_far_as_its_knee_lets_it(seed: int, out: float) -> None:
    """No hip pitch would bring the foot nearer by more than what is of second order."""
    p, R, feet = at_legs_ends(seed, out)
    q, _ = joint_targets(ROBOT, feet, np.zeros((4, 3)), Base(p, R), Target(p, R))
    assert np.all(q[2::3] <= LIMITS[1][2::3])
    away = np.linalg.norm(feet_in_world(q, p, R) - feet, axis=1)
    for turn in np.linspace(-0.1, 0.1, 201):
        other = q + np.tile([0.0, turn, 0.0], 4)
        assert np.all(away <= np.linalg.norm(feet_in_world(other, p, R) - feet, axis=1) + 1e-3)


@examples
@given(seeds, st.floats(-0.03, 0.05))
def test_no_knee_is_sent_past_its_limit_and_no_hip_after_it(seed: int, out: float) -> None:
    """Across the leg feet keep their speed; along it they lose what would need a longer leg."""
    rng, robot = np.random.default_rng(seed), paper_robot()
    p, R, feet = at_legs_ends(seed, out)
    v, w = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.2, 0.2, 3)
    feet_v = rng.uniform(-0.5, 0.5, (4, 3))
    q, qd = joint_targets(ROBOT, feet, feet_v, Base(p, R), Target(p, R, v, w))
    later = (q + LOOK_AHEAD * qd)[2::3]
    assert np.all(later <= LIMITS[1][2::3] + 1e-9) and np.all(later >= LIMITS[0][2::3] - 1e-9)
    jacobians = calc_jacobians(robot.geometry, q.reshape(4, 3))
    wanted = (feet_v - v - np.cross(w, feet - p)) @ R
    for k in range(4):
        hip = jacobians[k, :, 1]
        missed = jacobians[k] @ qd[3 * k : 3 * k + 3] - wanted[k]
        assert abs(missed @ hip) / np.linalg.norm(hip) < 1e-6
        assert abs(qd[3 * k + 1]) < 15.0  # [rad/s]; a straight leg's would have no bound


def test_small_robots_look_ahead_for_less_time() -> None:
    """As times go with the root of the leg: a quarter of the length, half of the time."""
    robot = paper_robot()
    small = replace(
        robot,
        geometry=replace(
            robot.geometry,
            thigh=0.25 * robot.geometry.thigh,
            shank=0.25 * robot.geometry.shank,
        ),
    )
    times = [
        make_constants(
            r, model_layout(), ControlSettings(), stiffness=1.0, inertia=1.0, damping=np.zeros(12)
        )[0]["look_ahead"]
        for r in (robot, small)
    ]
    np.testing.assert_allclose(times[0], LOOK_AHEAD)
    np.testing.assert_allclose(times[1], 0.5 * LOOK_AHEAD)
