"""The zero-moment point of a plan: against Drake's momentum, at rest, and under rigid motion."""

from functools import cache

import numpy as np
import pytest
from rig import (
    GRAVITY,
    flat_course,
    model_layout,
    model_plant,
    paper_robot,
    rotations,
    stairs_course,
    state_from_joints,
    walk_plan,
)

from drake_quad.common import FloatArray
from drake_quad.math.curves import BodySpline, knot_count
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.zmp import calc_zmp, link_places, sample_zmp, shift_response

QUICK = PlanSettings(
    dynamic=True, duty_factor=0.76, cycle_time=1.88, switch_wait=0.06, body_height=0.88
)
RODS = 2e-3  # [m] of what a uniform rod for a limb leaves, and the mean ground's jump at a switch
STEP = 0.005  # [s]


@cache
def quick_walk() -> MotionPlan:
    """Up three stairs, 1 m in 2 s."""
    return walk_plan(stairs_course(), goal=6.25, settings=QUICK)


def wave_window(plan: MotionPlan, duration: float) -> FloatArray:
    """Even times in the middle of the wave."""
    wave = next(s for s in plan.segments if s.kind == "wave")
    begin = 0.5 * (wave.start + wave.end - duration)
    return np.asarray(begin + STEP * np.arange(int(duration / STEP)), dtype=np.float64)


def zmp_by_drake(plan: MotionPlan, times: FloatArray) -> FloatArray:
    """From the rates of the whole robot's momentum, links' rotation and all, (N, 2) [m]."""
    plant, layout, robot = model_plant(), model_layout(), paper_robot()
    context = plant.CreateDefaultContext()
    body = plan.body.samples(times)[:, 0]
    feet, standing = plan.contacts.feet_at(times)
    q, _, _ = pose_robot(robot, body, feet)
    states = [state_from_joints(b, a)[: layout.num_positions] for b, a in zip(body, q, strict=True)]
    momenta, coms = [], []
    for k in range(1, len(times) - 1):
        plant.SetPositions(context, states[k])
        rate = (states[k + 1] - states[k - 1]) / (2.0 * STEP)
        plant.SetVelocities(context, plant.MapQDotToVelocity(context, rate))
        about_origin = plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3))
        momenta.append(about_origin.get_coeffs())
        coms.append(plant.CalcCenterOfMassPositionInWorld(context))
    rates = (np.array(momenta)[2:] - np.array(momenta)[:-2]) / (2.0 * STEP)
    weight = np.array([0.0, 0.0, -robot.mass * GRAVITY])
    moment = rates[:, :3] - np.cross(np.array(coms)[1:-1], weight)
    force = rates[:, 3:] - weight
    z = np.sum(feet[..., 2] * standing, axis=1) / standing.sum(axis=1) - robot.foot_radius
    z = z[2:-2]
    x = (z * force[:, 0] - moment[:, 1]) / force[:, 2]
    y = (moment[:, 0] + z * force[:, 1]) / force[:, 2]
    return np.stack([x, y], axis=-1)


def test_masses_tell_what_the_whole_robots_momentum_does() -> None:
    """On stairs at 0.5 m/s the point is Drake's, by the whole robot's momentum."""
    plan = quick_walk()
    times = wave_window(plan, 2.0)
    ours = sample_zmp(paper_robot(), plan.contacts, plan.body, STEP)
    found = [np.interp(times[2:-2], ours.times, ours.zmp[:, k]) for k in range(2)]
    off = np.linalg.norm(np.stack(found, axis=-1) - zmp_by_drake(plan, times), axis=1)
    assert np.percentile(off, 95) < RODS
    assert np.median(off) < 0.25 * RODS


def test_quick_legs_move_the_point_by_more_than_the_margin() -> None:
    """Planned with the body alone it would be wrong: why the links are in it."""
    plan = quick_walk()
    z = sample_zmp(paper_robot(), plan.contacts, plan.body, STEP)
    of_body = z.com - (0.8 / GRAVITY) * z.body[:, 2, :2]
    assert np.linalg.norm(z.zmp - of_body, axis=1).max() > z.margin.min() > 0.05


def test_links_have_the_whole_robots_mass_and_centre() -> None:
    """Their mean, weighed, is `calc_com`'s, over all poses of a walk."""
    plan, robot = quick_walk(), paper_robot()
    times = np.linspace(0.0, plan.duration, 200)
    body = plan.body.samples(times)[:, 0]
    feet, _ = plan.contacts.feet_at(times)
    p_WL, mass = link_places(robot, body, feet)
    assert mass.sum() == pytest.approx(robot.mass)
    com = pose_robot(robot, body, feet)[2]
    np.testing.assert_allclose(mass @ p_WL / robot.mass, com, atol=1e-9)


def test_at_rest_the_point_is_under_the_centre_of_mass() -> None:
    """Nothing moves, nothing is accelerated."""
    stance = quick_walk().end
    contacts = ContactPlan(stance.feet, (), 2.0)
    spline = BodySpline(0.2, np.tile(stance.body, (knot_count(2.0, 0.2), 1)))
    z = sample_zmp(paper_robot(), contacts, spline, 0.05)
    np.testing.assert_allclose(z.zmp, z.com, atol=1e-9)


@pytest.mark.parametrize("angle", [0.4, -2.0])
def test_point_turns_and_moves_with_the_robot(angle: float) -> None:
    """A rigid motion of all masses in the plane is one of the point."""
    rng = np.random.default_rng(3)
    p = np.cumsum(1e-3 * rng.standard_normal((40, 6, 3)), axis=0) + rng.uniform(0, 1, (6, 3))
    mass, ground = rng.uniform(1.0, 5.0, 6), np.full(40, -0.2)
    R = rotations(np.array([0.0, 0.0, 0.0, 0.0, angle]))
    shift = np.array([3.0, -1.0, 0.0])
    here = calc_zmp(p, mass, ground, step=0.01)
    there = calc_zmp(p @ R.T + shift, mass, ground, step=0.01)
    np.testing.assert_allclose(there, here @ R[:2, :2].T + shift[:2], atol=1e-9)


def test_a_point_mass_has_the_pendulums_point() -> None:
    """Which is c - h/g c̈, for a mass on a parabola at constant height."""
    t = 0.01 * np.arange(50)
    p = np.stack([0.7 * t**2, -0.2 * t**2, np.full(50, 0.9)], axis=-1)[:, None]
    zmp = calc_zmp(p, np.array([12.0]), np.full(50, 0.1), step=0.01)
    expected = p[:, 0, :2] - 0.8 / GRAVITY * np.array([1.4, -0.4])
    np.testing.assert_allclose(zmp[1:-1], expected[1:-1], atol=1e-9)


def test_shift_response_foretells_what_a_sway_of_the_body_does() -> None:
    """Gain and height give the point of a small sway about a stance, feet standing."""
    robot, plan = paper_robot(), walk_plan(flat_course(), goal=3.25)
    stance = plan.end
    gain, heights = shift_response(robot, stance.body, stance.feet)
    t = 0.01 * np.arange(200)
    sway = 0.01 * np.sin(3.0 * t)
    body = np.tile(stance.body, (200, 1))
    body[:, :2] += sway[:, None]
    p_WL, mass = link_places(robot, body, np.tile(stance.feet, (200, 1, 1)))
    ground = np.full(200, stance.feet[:, 2].mean() - robot.foot_radius)
    zmp = calc_zmp(p_WL, mass, ground, step=0.01)
    rest = mass @ link_places(robot, stance.body[None], stance.feet[None])[0][0, :, :2] / mass.sum()
    expected = rest + sway[:, None] * gain * (1.0 + heights / GRAVITY * 9.0)
    np.testing.assert_allclose(zmp[1:-1], expected[1:-1], atol=2e-4)
    assert np.all((gain > 0.6) & (gain < 1.0))
