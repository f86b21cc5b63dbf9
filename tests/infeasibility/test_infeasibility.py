"""Proofs of infeasibility are sound: their bounds hold, and nothing that has a plan is refuted."""

from dataclasses import replace

import numpy as np
import pytest
from design_rig import asked
from hypothesis import given, settings, strategies as st
from infeasibility_rig import COUNT, HIGH, RUN, proof
from rig import URL, paper_robot, with_raised

from benchmarks.check import STEEPEST
from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.feasibility.flight import Around
from drake_quad.feasibility.result import Feasibility
from drake_quad.infeasibility.boxes import (
    OPEN,
    ClimbClass,
    TurnedBoxes,
    close_boxes,
    places_on,
    reachable_places,
    trunk_inside,
)
from drake_quad.infeasibility.climb import ABOVE, BELOW, FEET, Moment, edges, find_way
from drake_quad.infeasibility.proof import AXES, prove_infeasible
from drake_quad.infeasibility.robot_bounds import bounds_of
from drake_quad.robot.kinematics import calc_com, calc_feet
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.scenario.config import Scenario
from drake_quad.stability.margin_kinds import FRICTION
from drake_quad.terrain.elements import Stairs

SHARES = st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12)
ANGLES = st.tuples(st.floats(-0.7, 0.7), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))


def joints(robot: RobotModel, shares: list[float]) -> FloatArray:
    """Joint angles (4, 3) at shares of the way from the lower to the upper limits."""
    q = robot.q_lower + np.array(shares) * (robot.q_upper - robot.q_lower)
    return q.reshape(4, 3)


def rotation(pitch: float, roll: float, yaw: float) -> FloatArray:
    """R_WB as the product of its three turns."""
    cp, sp, cr, sr, cy, sy = (f(a) for a in (pitch, roll, yaw) for f in (np.cos, np.sin))
    about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    return np.array(about_z @ about_y @ about_x)


def robot_of(raised: float, longer: float) -> RobotModel:
    """The paper's robot with other legs."""
    robot = with_raised(paper_robot(), np.full(4, raised))
    return replace(robot, geometry=replace(robot.geometry, thigh=longer * robot.geometry.thigh))


@pytest.mark.parametrize("turns", [-1, 1, 2])
def test_a_whole_turn_of_the_knees_limits_changes_no_bound(turns: int) -> None:
    """A knee that may go from 3.5 to 6.1 rad is as straight at its end as one from -2.8 to -0.2."""
    robot = paper_robot()
    lower, upper = np.array(robot.q_lower), np.array(robot.q_upper)
    lower[2::3] += turns * 2.0 * np.pi
    upper[2::3] += turns * 2.0 * np.pi
    wound = replace(robot, q_lower=lower, q_upper=upper)
    np.testing.assert_allclose(bounds_of(wound).reach, bounds_of(robot).reach, rtol=1e-12)
    assert leg_length(wound) == pytest.approx(leg_length(robot), rel=1e-12)
    assert prove_infeasible(wound, ClimbClass(0.4, RUN, COUNT)) is None


def test_what_a_proof_is_not_about_has_none() -> None:
    """Margins that count on friction, and landings on which not all feet need to be at once."""
    no = Feasibility(Scenario(), None, "", {}, paper_robot(), Stairs(HIGH, RUN, COUNT))
    assert no.proof is not None
    assert replace(no, around=Around(landing=1.0)).proof is None
    assert replace(no, around=Around(landing=5.0)).proof is not None
    scenario = Scenario()
    scenario.gait.margin = FRICTION
    assert replace(no, scenario=scenario).proof is None


@given(shares=SHARES, raised=st.floats(-0.1, 0.1), longer=st.floats(0.5, 1.5))
@settings(max_examples=60, deadline=None)
def test_bounds_of_a_robot_hold_at_all_joint_positions(
    shares: list[float], raised: float, longer: float
) -> None:
    """Reach, height of hanging feet, and centre of mass, for any legs."""
    robot = robot_of(raised, longer)
    bounds, q = bounds_of(robot), joints(robot, shares)
    from_hip = calc_feet(robot.geometry, q) - robot.geometry.p_BH
    assert np.all(np.linalg.norm(from_hip, axis=-1) <= bounds.reach + 1e-9)
    both = q[:, 1] + q[:, 2]
    down = robot.geometry.thigh * np.cos(q[:, 1]) + robot.geometry.shank * np.cos(both)
    hangs = raised - down <= 0.0
    assert np.all(from_hip[hangs, 2] <= bounds.rise[hangs] + 1e-9)
    com = calc_com(robot, q)
    assert np.all(bounds.com_lower - 1e-9 <= com) and np.all(com <= bounds.com_upper + 1e-9)


@given(
    shares=SHARES,
    angles=ANGLES,
    leg=st.integers(0, 3),
    level=st.integers(0, 3),
    place=st.floats(0.0, 1.0),
    rise=st.floats(0.05, 0.5),
    size=st.floats(0.0, 0.3),
)
@settings(max_examples=150, deadline=None)
def test_a_place_that_a_foot_reaches_is_within_its_bounds(
    shares: list[float],
    angles: tuple[float, float, float],
    leg: int,
    level: int,
    place: float,
    rise: float,
    size: float,
) -> None:
    """Any pose that puts a hanging leg's foot on a level, in a box of any size about the pose."""
    robot, climb = paper_robot(), ClimbClass(rise, 0.3, 3)
    bounds, q = bounds_of(robot), joints(robot, shares)
    g = robot.geometry
    down = g.thigh * np.cos(q[:, 1]) + g.shank * np.cos(q[:, 1] + q[:, 2])
    if down[leg] < 0.0:
        return
    low, high = places_on(climb, bounds.foot_radius, level)
    x = np.clip(low, -1.0, None) + place * (np.clip(high, None, 2.0) - np.clip(low, -1.0, None))
    foot = rotation(*angles) @ calc_feet(g, q)[leg]
    pose = np.array([x - foot[0], level * rise + bounds.foot_radius - foot[2], angles[0]])
    box = np.stack([pose - size * np.array(shares[:3]), pose + size * np.array(shares[3:6])])
    box[:, 2] = np.clip(box[:, 2], -climb.pitch, climb.pitch)
    turn = TurnedBoxes(climb, box[None])
    for above, boundary in ((False, level), (True, level - 1)):
        if boundary >= 0:
            first, last = reachable_places(bounds, climb, boundary, leg, above=above, turn=turn)
            assert first[0] <= x + 1e-9 and x - 1e-9 <= last[0]
    com = rotation(*angles) @ calc_com(robot, q) + [pose[0], 0.0, pose[1]]
    least, most = turn.x_of((bounds.com_lower, bounds.com_upper))
    assert least[0] <= com[0] + 1e-9 and com[0] - 1e-9 <= most[0]


@given(x=st.floats(-1.0, 2.0), z=st.floats(-0.5, 2.0), angles=ANGLES, size=st.floats(0.0, 0.2))
@settings(max_examples=100, deadline=None)
def test_a_trunk_that_is_clear_somewhere_in_a_box_does_not_close_it(
    x: float, z: float, angles: tuple[float, float, float], size: float
) -> None:
    """A box is closed only if the line under the trunk is inside at each of its poses."""
    bounds, climb = bounds_of(paper_robot()), ClimbClass(0.2, 0.3, 4)
    under = bounds.trunk @ rotation(*angles).T + [x, 0.0, z]
    level = np.clip(np.floor(under[:, 0] / climb.run) + 1.0, 0.0, climb.count)
    pose = np.array([x, z, angles[0]])
    box = np.stack([pose - size, pose + size])
    box[:, 2] = np.clip(box[:, 2], -climb.pitch, climb.pitch)
    if np.all(under[:, 2] > level * climb.rise):
        assert not trunk_inside(bounds, climb, TurnedBoxes(climb, box[None]))[0]


def refuted_poses(robot: RobotModel, check: Feasibility) -> tuple[int, int]:
    """Poses of a plan at lift-offs and touchdowns on its way up: all, and those that are refuted.

    Each counts once for every boundary of the flight that its feet are on both sides of.
    """
    stairs, plan = check.stairs, check.plan
    assert plan is not None and stairs is not None
    start = float(check.scenario.course[0].length or 0.0)
    bounds, climb = bounds_of(robot), ClimbClass(stairs.rise, stairs.run, stairs.count)
    seen, refuted, up = 0, 0, False
    for task, phase in [(part, p) for part in plan.plans for p in part.contacts.phases]:
        if phase.step is None or up:
            continue
        mover = int(np.flatnonzero(~phase.standing)[0])
        for t in (phase.start, phase.end):
            body = task.body.samples(np.array([t]))[0, 0]
            feet = task.contacts.feet_at(np.array([t]))[0][0]
            levels = np.round((feet[:, 2] - robot.foot_radius) / stairs.rise)
            pose = np.array([body[0] - start, body[2], body[3]])
            for boundary in range(stairs.count):
                above = sum(1 << leg for leg in range(FEET) if levels[leg] > boundary)
                if Moment(above, mover).mixed:
                    box, moment = np.stack([pose, pose])[None], Moment(above, mover)
                    seen += 1
                    refuted += close_boxes(bounds, climb, boundary, moment, box)[0] != OPEN
            up = bool(np.all(levels == stairs.count))
    assert up  # the whole flight was looked at
    return seen, refuted


@pytest.mark.parametrize("stairs", [Stairs(0.12, 0.32, 2), Stairs(0.2, 0.3, 4)])
def test_nothing_of_a_plan_is_refuted(stairs: Stairs) -> None:
    """At every lift-off and touchdown of a plan its own pose is left open, at every boundary."""
    climb = ClimbClass(stairs.rise, stairs.run, stairs.count)
    assert prove_infeasible(paper_robot(), climb) is None
    seen, refuted = refuted_poses(paper_robot(), asked(URL, stairs))
    assert seen > 10 and refuted == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(STEEPEST))
def test_nothing_of_the_steepest_plans_is_refuted(name: str) -> None:
    """Of each robot that is installed, on its steepest flight that the documents tell of."""
    try:
        robot = load_robot(name)
    except InputError:
        pytest.skip(f"{name} is not installed")
    stairs = Stairs(*STEEPEST[name], 4)
    assert prove_infeasible(robot, ClimbClass(stairs.rise, stairs.run, 4)) is None
    seen, refuted = refuted_poses(robot, asked(name, stairs, thorough=False))
    assert seen > 10 and refuted == 0


def test_a_climb_passes_all_of_its_moments() -> None:
    """Without any of the first foot's moments, or of the last foot's, no way is left; else some."""
    last = {Moment(ABOVE & ~(1 << i), i) for i in range(FEET)}
    first = {Moment(1 << i, i) for i in range(FEET)}
    assert len(list(edges())) == 32 and len(find_way(set()) or []) == 6
    for cut in (last, first):
        assert find_way(cut) is None
        assert all(find_way(cut - {one}) is not None for one in cut)
    assert not any(m.mixed for m in (Moment(BELOW, 0), Moment(ABOVE, 3)))


def test_a_proof_has_a_tree_for_each_moment_that_it_needs() -> None:
    """None is spare; a tree has two boxes for each that is halved, and all boxes are closed."""
    found = proof()
    refuted = {one.moment for one in found.refutations}
    assert find_way(refuted) is None and found.boxes > 0
    assert all(find_way(refuted - {one}) is not None for one in refuted)
    for one in found.refutations:
        halved = [sum(letter in AXES for letter in level) for level in one.tree]
        assert [len(level) for level in one.tree] == [1, *(2 * n for n in halved[:-1])]
        assert halved[-1] == 0


def test_a_proof_is_one_of_narrower_classes_too() -> None:
    """What no pose does, none of fewer poses does; and the same question has the same answer."""
    for pitch, roll in ((0.7, 0.2), (0.5, 0.2), (0.5, 0.0), (0.0, 0.0)):
        climb = ClimbClass(HIGH, RUN, COUNT, pitch=pitch, roll=roll, yaw=roll)
        found = prove_infeasible(paper_robot(), climb)
        assert found is not None
        assert found == prove_infeasible(paper_robot(), climb)


@given(longer=st.floats(0.7, 1.3), rise=st.floats(0.05, 0.5))
@settings(max_examples=8, deadline=None)
def test_a_rise_of_a_fraction_of_the_legs_is_never_refuted(longer: float, rise: float) -> None:
    """Robots with legs like the paper's, whose trunk is as high as it likes, climb half a leg."""
    assert prove_infeasible(robot_of(0.0, longer), ClimbClass(rise, 0.5, 2)) is None
