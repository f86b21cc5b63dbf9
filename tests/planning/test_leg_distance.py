"""Room between legs: the distance of lines, and of legs as shanks and thighs make them up."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from rig import paper_robot

from drake_quad.errors import PlanningError
from drake_quad.math.distance import PAIRS, line_to_line
from drake_quad.planning.clearance import check_self_collision, leg_clearance
from drake_quad.planning.motion_plan import PlanSamples, pose_robot
from drake_quad.planning.problem import Task
from drake_quad.planning.thigh_trunk import CUTOFF
from drake_quad.robot.kinematics import calc_feet

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.sampled_from([1.0, 1e-3, 0.0]))
def test_the_distance_of_two_lines_is_that_of_their_nearest_places(seed: int, bend: float) -> None:
    """Against a dense sampling of both; also where they are parallel, or nearly."""
    p, q, r, s = np.random.default_rng(seed).uniform(-1.0, 1.0, (4, 3))
    s = bend * s + (1.0 - bend) * (r + 0.7 * (q - p))
    way = np.linspace(0.0, 1.0, 301)[:, None]
    one, two = p + way * (q - p), r + way * (s - r)
    dense = np.linalg.norm(one[:, None] - two[None], axis=-1).min()
    told = line_to_line(p, q, r, s)
    assert told <= dense + 1e-9
    assert told == pytest.approx(dense, abs=2e-2)
    assert told == pytest.approx(line_to_line(s, r, q, p), abs=1e-9)
    assert line_to_line(p, p, r, r) == pytest.approx(np.linalg.norm(p - r))
    assert line_to_line(p, p, r, s) == pytest.approx(
        np.linalg.norm(p - two, axis=1).min(), abs=2e-2
    )


@given(seeds)
def test_room_between_legs_is_mirrored_with_them(seed: int) -> None:
    """What is on the left is as near to each other as it would be on the right."""
    robot, rng = paper_robot(), np.random.default_rng(seed)
    q = rng.uniform([-0.6, -1.2, -2.0], [0.6, 1.2, -0.3], (1, 4, 3))
    other = q[:, [1, 0, 3, 2]] * [-1.0, 1.0, 1.0]
    room = leg_clearance(robot, calc_feet(robot.geometry, q), q)[0]
    mirrored = leg_clearance(robot, calc_feet(robot.geometry, other), other)[0]
    pairs = {frozenset(pair): k for k, pair in enumerate(PAIRS.tolist())}
    swap = {0: 1, 1: 0, 2: 3, 3: 2}
    for (one, two), value in zip(PAIRS.tolist(), room, strict=True):
        assert mirrored[pairs[frozenset((swap[one], swap[two]))]] == pytest.approx(value, abs=1e-9)


def crossing() -> tuple[PlanSamples, str]:
    """A stance in which the front feet stand, one where the other should, and their pair."""
    robot = paper_robot()
    feet = robot.geometry.p_BH + np.array([0.0, 0.0, -0.9])
    feet[[0, 1], 1] = feet[[1, 0], 1]
    body = np.zeros((2, 3, 5))
    still = np.broadcast_to(feet, (2, 4, 3))
    q, excess, com = pose_robot(robot, body[:, 0], np.ascontiguousarray(still))
    standing, times = np.ones((2, 4), dtype=bool), np.array([0.0, 1.0])
    return PlanSamples(times, body, still, standing, q, excess, com, np.zeros(2)), "FL and FR"


def test_a_plan_that_crosses_two_legs_is_refused() -> None:
    """With which, where and how far; shanks that only hang beside each other are not."""
    samples, who = crossing()
    task = Task(kind="spin", name="spin 1", lane=0)
    robot = replace(paper_robot(), trunk_boxes=np.array([[[-0.01] * 3, [0.01] * 3]]))
    with pytest.raises(PlanningError, match=f"the legs {who} would be .* inside each other at 0.0"):
        check_self_collision(robot, task, samples)
    q = np.zeros((1, 4, 3))
    assert leg_clearance(robot, calc_feet(robot.geometry, q), q).min() == CUTOFF
