"""The room that a robot takes to turn: its trunk and its feet, before a gait is known and after."""

from dataclasses import replace

import numpy as np
import pytest
from rig import flat_course, paper_robot, rotations, spin_plan

from drake_quad.errors import PlanningError
from drake_quad.planning.turning_room import (
    check_turning_width,
    half_width_taken,
    least_turning_space,
)
from drake_quad.terrain.course import build_course
from drake_quad.terrain.elements import Element

HALF_TURN = spin_plan(np.pi)
LANE = flat_course().lanes[0]


def with_trunk(low: list[float], high: list[float]) -> float:
    robot = replace(paper_robot(), trunk_boxes=np.array([[low, high]]))
    return least_turning_space(robot)


def test_the_least_room_holds_the_head_or_the_feet_whichever_reaches_farther() -> None:
    """A head 0.61 m ahead and 0.18 m wide takes 1.24 m; without it feet under their hips decide."""
    assert least_turning_space(paper_robot()) == 1.24
    legs = paper_robot().geometry
    hips = np.abs(legs.p_BH[:, :2] + np.column_stack([np.zeros(4), legs.offset]))
    feet = 2.0 * (np.hypot(*hips.T).max() + paper_robot().foot_radius)
    small = with_trunk([-0.2, -0.1, -0.1], [0.2, 0.1, 0.1])
    assert feet <= small < feet + 0.01
    assert with_trunk([-0.9, -0.1, -0.1], [0.2, 0.1, 0.1]) == pytest.approx(1.812, abs=0.01)


def test_a_half_turn_takes_what_trunk_and_feet_sweep() -> None:
    """Each corner of the trunk, and each foot, lies within the half width at every moment.

    And one of them reaches it. What is compared is laid out here pose by pose.
    """
    robot, taken = paper_robot(), half_width_taken(paper_robot(), HALF_TURN, LANE)
    farthest = 0.0
    for t in np.linspace(0.0, HALF_TURN.duration, 1000):
        body = HALF_TURN.body.samples(np.array([t]))[0, 0]
        for low, high in robot.trunk_boxes:
            for x in (low[0], high[0]):
                for y in (low[1], high[1]):
                    for z in (low[2], high[2]):
                        p_W = body[:3] + rotations(body) @ [x, y, z]
                        farthest = max(farthest, abs(float(p_W[1])))
        feet, _ = HALF_TURN.contacts.feet_at(np.array([t]))
        farthest = max(farthest, float(np.abs(feet[0, :, 1]).max()) + robot.foot_radius)
    assert taken == pytest.approx(farthest, abs=0.005)
    assert 2.0 * taken >= least_turning_space(robot) - 0.01  # half a turn swings the head across


def test_a_turn_that_leaves_the_ground_is_refused_with_both_widths() -> None:
    """One line that says what the turn takes and what there is; with that much it is taken."""
    robot, taken = paper_robot(), half_width_taken(paper_robot(), HALF_TURN, LANE)
    for width, fits in ((2.0 * taken + 0.02, True), (2.0 * taken - 0.02, False)):
        lane = build_course([Element("floor", length=6.0, width=width)]).lanes[0]
        if fits:
            check_turning_width(robot, HALF_TURN, lane)
            continue
        with pytest.raises(PlanningError) as refused:
            check_turning_width(robot, HALF_TURN, lane)
        assert f"{width:.2f} m of ground are known" in refused.value.reason
        assert refused.value.data["taken"] == pytest.approx(2.0 * taken)
