"""How fast a plan is on the flights, and what binds it, are the plan's own."""

from dataclasses import replace

import numpy as np
import pytest
from design_rig import COUNT, RUN, found
from rig import URL, paper_robot

from drake_quad.cli.check_answer import pace_lines
from drake_quad.feasibility.check_report import feasibility_report
from drake_quad.gait_design.pace import JOINTS, SPEED_SPARE, joint_speeds, nearest_limit
from drake_quad.planning.mission import CHECK_PERIOD
from drake_quad.planning.motion_plan import evaluate


def test_speed_on_the_flights_is_length_over_time_and_the_gaits() -> None:
    """Up and down are told, all treads long; the speed is the gait's, but for the ends' sway."""
    pace, gait = found().pace, found().scenario.gait
    assert pace is not None and [f.going for f in pace.flights] == ["up", "down"]
    by_gait = gait.treads * RUN / (gait.cycle_time + 2.0 * gait.switch_wait)
    for flight in pace.flights:
        assert flight.length == pytest.approx(COUNT * RUN)
        assert flight.speed * flight.time == pytest.approx(flight.length)
        assert flight.speed == pytest.approx(by_gait, rel=0.1)
    assert found().speed == min(f.speed for f in pace.flights)


def test_no_sample_of_the_plan_turns_a_joint_faster_than_the_peak() -> None:
    """Nowhere is a joint quicker than told, and there the joint is as quick as told."""
    designed, pace, robot = found().designed, found().pace, paper_robot()
    assert designed is not None and pace is not None and pace.peak is not None
    for plan in designed.plan.plans:
        count = int(np.ceil(plan.duration / CHECK_PERIOD)) + 1
        s = evaluate(robot, plan, np.linspace(0.0, plan.duration, count))
        q = s.q.reshape(-1, 12)
        speed = np.abs(np.diff(q, axis=0)) / np.diff(s.times)[:, None]
        assert np.max(speed / robot.speed) <= pace.peak.share * 1.001
    j = robot.joint_names.index(pace.peak.joint)
    walk = next(
        p
        for p in designed.plan.plans
        if p.duration > pace.peak.time + 1e-3
        and joint_speeds(robot, p, np.array([pace.peak.time]))[0][0, j]
        == pytest.approx(pace.peak.speed)
    )
    assert walk.contacts.steps and JOINTS[j % 3] == pace.peak.kind


def test_the_limit_that_binds_is_the_one_of_which_least_is_left() -> None:
    """Whichever limit is used up is the one that is named, the joint with its leg."""
    pace = found().pace
    assert pace is not None and pace.peak is not None
    wanted = {"margin": 0.06, "torque": 0.15, "legs": 0.02}
    good = {"margin": 0.06, "torque": 0.15, "room": 0.02}

    def bound(share: float = 1.0 - SPEED_SPARE, zmp: float = 0.06, **less: float) -> str:
        assert pace is not None and pace.peak is not None
        peak = replace(pace.peak, speed=share * pace.peak.limit)
        quick = replace(pace, peak=peak, zmp_margin=zmp)
        return nearest_limit(quick, part="the trunk", wanted=wanted, **(good | less)).words

    assert bound(share=0.99) == pace.peak.words and pace.peak.leg in pace.peak.words
    assert bound(zmp=0.01) == "margin of the zero-moment point"
    assert bound(margin=0.01) == "static margin"
    assert bound(torque=0.01) == "torque of a joint at rest"
    assert bound(room=0.001) == "clearance of the trunk"


def test_check_says_speed_time_and_what_binds_in_words() -> None:
    """The line has each flight's time and speed, and the limit; a no has none of it."""
    asked = {"rise": 0.12, "run": RUN, "count": COUNT}
    told = feasibility_report(found(), paper_robot(), source=URL, asked=asked)
    (line,) = pace_lines(told)
    assert f"up {told['pace']['flights'][0]['time']:.0f} s" in line
    assert f"({told['pace']['speed']:.3f} m/s)" in line
    assert told["pace"]["bound"]["words"] in line
    without = replace(found(), designed=None)
    assert without.pace is None and without.speed is None and without.bound is None
