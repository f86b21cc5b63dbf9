"""The legs' share in the balance is what the program lacks: with it, its points are the robot's."""

from functools import cache

import numpy as np
import pytest
from rig import flat_course, paper_robot, walk_plan

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.zmp import (
    Share,
    ZmpSamples,
    com_gain,
    com_share,
    sample_zmp,
    shift_response,
    zmp_share,
)

QUICK = PlanSettings(dynamic=True, duty_factor=0.76, cycle_time=1.88, switch_wait=0.06)


@cache
def walk() -> MotionPlan:
    """Two metres of level ground, 1 m in 2 s."""
    return walk_plan(flat_course(), goal=3.25, settings=QUICK)


@cache
def found() -> ZmpSamples:
    plan = walk()
    return sample_zmp(paper_robot(), plan.contacts, plan.body, 0.01)


def program_zmp(share: Share, gain: FloatArray, times: FloatArray) -> FloatArray:
    """The point as the program has it, (N, 2) [m]."""
    body = walk().body.samples(times)
    lean = (share.height / GRAVITY)[:, None]
    p = gain * (body[:, 0, :2] - lean * body[:, 2, :2])
    return np.asarray(p + share.offset - lean * share.acceleration)


def test_zmp_share_makes_the_programs_point_the_one_found() -> None:
    """At the very path that it was found along, whatever gain and height are."""
    z = found()
    for response in (
        shift_response(paper_robot(), z.body[0, 0], walk().contacts.feet),
        (np.array([0.5, 1.2]), np.array([0.4, 0.9])),
    ):
        share = zmp_share(z, z.times, response)
        point = program_zmp(share, response[0], z.times)
        np.testing.assert_allclose(point, z.zmp, atol=1e-9)


def test_zmp_share_makes_the_programs_centre_of_mass_the_one_found() -> None:
    """Gain times body, and the offset."""
    z = found()
    response = shift_response(paper_robot(), z.body[0, 0], walk().contacts.feet)
    share = zmp_share(z, z.times, response)
    np.testing.assert_allclose(response[0] * z.body[:, 0, :2] + share.offset, z.com, atol=1e-12)


def test_com_share_makes_the_programs_centre_of_mass_the_robots() -> None:
    """To what samples 0.05 s apart tell of quick legs."""
    robot, plan = paper_robot(), walk()
    times = np.linspace(0.0, plan.duration, 300)
    gain = com_gain(robot, plan.body, plan.contacts)
    share = com_share(robot, plan.contacts, plan.body, times, gain)
    body = plan.body.samples(times)[:, 0]
    _, _, com = pose_robot(robot, body, plan.contacts.feet_at(times)[0])
    np.testing.assert_allclose(gain * body[:, :2] + share.offset, com[:, :2], atol=4e-3)


def test_gain_is_what_both_ways_of_asking_find() -> None:
    """How much of a shift of the body the centre of mass makes: more than the trunk alone."""
    robot, plan = paper_robot(), walk()
    gain = com_gain(robot, plan.body, plan.contacts)
    response, heights = shift_response(robot, plan.body.sample(0.0)[0], plan.contacts.feet)
    np.testing.assert_allclose(gain, response, atol=5e-3)
    assert np.all(gain > robot.trunk_mass / robot.mass) and np.all(gain < 1.0)
    # What moves with the body is higher than the centre of mass.
    _, _, com = pose_robot(robot, plan.body.sample(0.0)[:1], plan.contacts.feet[None])
    assert np.all(heights > com[0, 2]) and heights == pytest.approx(heights[0], abs=0.05)
