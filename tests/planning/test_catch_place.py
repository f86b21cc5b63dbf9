"""Ground for a step that catches a fall: its height, whole under a foot, free on the way."""

import numpy as np
from hypothesis import given, strategies as st
from rig import course_of, flat_course, paper_robot, stairs_course

from drake_quad.planning.recovery_step import CLEARANCE, FOOTING, StepTargetMap
from drake_quad.terrain.elements import Element

ROBOT = paper_robot()
WIDE = course_of(Element("floor", length=8.0, width=8.0))


GROUNDS = {
    "up": StepTargetMap(stairs_course("up"), ROBOT.foot_radius),
    "down": StepTargetMap(stairs_course("down"), ROBOT.foot_radius),
    "level": StepTargetMap(flat_course(), ROBOT.foot_radius),
    "wide": StepTargetMap(WIDE, ROBOT.foot_radius),
}


@given(st.sampled_from(["up", "down"]), st.floats(-0.5, 8.0), st.floats(-1.5, 1.5))
def test_ground_is_the_courses(going: str, x: float, y: float) -> None:
    """The compiled height is the course's own, off it too."""
    found = GROUNDS[going].height(np.array([[x, y]]))[0]
    np.testing.assert_equal(found, float(stairs_course(going).height(x, y)))


def test_a_foot_is_whole_only_well_away_from_risers_and_from_the_courses_sides() -> None:
    """Whichever way the lane heads; `room` is what the foot's sphere and its footing need."""
    room = ROBOT.foot_radius + FOOTING
    turned = course_of(
        Element("floor", length=3.0),
        Element("landing", length=3.0, turn_deg=22.5),
        Element("stairs", going="up", rise=0.13, run=0.5, count=3),
        Element("floor", length=3.0),
    )
    for course, lane in ((stairs_course("up"), 0), (turned, 1)):
        lay = course.lanes[lane]
        ground = StepTargetMap(course, ROBOT.foot_radius)
        for s, _ in lay.nosings():
            for side in (-1.0, 1.0):
                near, far = (lay.point(s + side * f * room, 0.1) for f in (0.97, 1.05))
                assert ground.whole(np.array([near, far])).tolist() == [False, True]
        half = lay.half_width
        beside = lay.point(float(lay.breaks[-1]) - 1.0, [half - 0.5 * room, half - 1.2 * room])
        assert ground.whole(beside).tolist() == [False, True]


def test_the_way_is_open_under_a_foot_that_is_high_enough() -> None:
    """Up a riser only from above it, down and along it always; other feet are gone around."""
    ground, riser = GROUNDS["up"], 3.0
    level, upper = np.array([[2.8, 0.2]]), np.array([[3.2, 0.2]])
    stands = np.array([2.9, 0.2, ROBOT.foot_radius])
    assert ground.open_way(stands, level).all()
    assert not ground.open_way(stands, upper).any()
    assert not ground.open_way(np.add(stands, [0.0, 0.0, 0.13]), upper).any()
    assert ground.open_way(np.add(stands, [0.0, 0.0, 0.13 + CLEARANCE]), upper).all()
    on_top = np.array([riser + 0.1, 0.2, 0.13 + ROBOT.foot_radius])
    assert ground.open_way(on_top, level).all()
    other = np.array([[2.8, 0.05, 0.0]])
    around = ground.free_of(np.array([[2.7, 0.05], [2.9, 0.15], [2.8, 0.1]]),
                            np.array([2.9, 0.05, 0.0]), other)  # fmt: skip
    assert around.tolist() == [False, True, False]
