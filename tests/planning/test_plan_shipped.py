"""Plans of shipped scenarios that are held to a figure: Table I in physics, and 1 m in 2 s."""

from contextlib import suppress
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from rig import GRAVITY, paper_robot

from drake_quad.errors import PlanningError
from drake_quad.gait.workspace import PAPER_WORKSPACE
from drake_quad.planning.mission import MissionPlan, check_mission, initial_stance, plan_mission
from drake_quad.planning.motion_plan import MotionPlan, Segment, evaluate
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.zmp import sample_zmp
from drake_quad.scenario.build import course_of, mission_of, plan_settings
from drake_quad.scenario.load import load_scenario
from drake_quad.stability.support_polygon import stability_margin

PERIOD = 0.004  # [s]


@cache
def planned(name: str) -> tuple[PlanSettings, MissionPlan]:
    """A shipped scenario's settings and plan, checked."""
    scenario = load_scenario(name)
    course, settings = course_of(scenario), plan_settings(scenario)
    stance = initial_stance(paper_robot(), course, settings, start=scenario.start.distance)
    mission = plan_mission(paper_robot(), course, settings, mission_of(scenario, course), stance)
    check_mission(paper_robot(), mission)
    return settings, mission


def walks(mission: MissionPlan) -> list[tuple[MotionPlan, Segment]]:
    """The plans that walk, with their wave."""
    found = [(plan, s) for plan in mission.plans for s in plan.segments if s.kind == "wave"]
    assert len(found) == 2  # up and down
    return found


def test_paper_physics_has_every_number_of_table_i() -> None:
    """Gait, boxes and clearance are the paper's; the waits are the one thing added."""
    settings, _ = planned("paper_physics")
    assert settings.workspace == PAPER_WORKSPACE
    assert (settings.duty_factor, settings.cycle_time) == (0.75, 8.0)
    assert (settings.spin_duty_factor, settings.spin_cycle_time) == (0.75, 8.0)
    assert settings.swing_clearance == 0.02
    assert settings.stance_stagger == 0.0 and not settings.on_centre
    assert settings.switch_wait > 0.0 and not settings.dynamic


def test_paper_physics_keeps_seven_centimetres_of_static_margin() -> None:
    """Of the whole robot, legs and all, at any instant."""
    _, mission = planned("paper_physics")
    for plan in mission.plans:
        count = int(np.ceil(plan.duration / 0.02)) + 1
        samples = evaluate(paper_robot(), plan, np.linspace(0.0, plan.duration, count))
        assert samples.margin.min() > 0.07


def test_paper_physics_puts_no_foot_onto_another() -> None:
    """Without a stagger the feet of a side land 5 cm apart: more than both feet are wide."""
    _, mission = planned("paper_physics")
    nearest = np.inf
    for plan in mission.plans:
        times = np.linspace(0.0, plan.duration, int(plan.duration / 0.02))
        feet, _ = plan.contacts.feet_at(times)
        for a, b in combinations(range(4), 2):
            nearest = min(nearest, np.linalg.norm(feet[:, a] - feet[:, b], axis=1).min())
    assert nearest == pytest.approx(0.05, abs=5e-3)
    assert nearest > 2.4 * paper_robot().foot_radius


def test_fast_walks_a_metre_in_two_seconds() -> None:
    """By the plan's own time, waits at switches and all, on level ground and stairs."""
    _, mission = planned("fast")
    for _, wave in walks(mission):
        assert wave.details["stride"] / wave.details["cycle_lasts"] >= 0.5


def test_fast_keeps_its_zero_moment_point_inside_by_five_centimetres() -> None:
    """Of the whole robot with its links moving, at any instant."""
    _, mission = planned("fast")
    for plan in mission.plans:
        zmp = sample_zmp(paper_robot(), plan.contacts, plan.body, PERIOD)
        assert zmp.margin.min() > 0.05


def test_fast_asks_no_joint_for_more_speed_than_it_has() -> None:
    """Nor for a foot out of reach: sampled through every swing."""
    robot, (_, mission) = paper_robot(), planned("fast")
    for plan, _ in walks(mission):
        times = np.arange(0.0, plan.duration, PERIOD)
        samples = evaluate(robot, plan, times)
        speed = np.abs(np.diff(samples.q.reshape(-1, 12), axis=0)) / PERIOD
        assert np.max(speed / robot.speed) < 0.97
        assert samples.reach_excess.max() == 0.0


def test_fast_can_be_told_when_to_lift_by_what_a_controller_knows() -> None:
    """At each lift-off the centre of mass less h/g of the planned acceleration has 5 cm of margin.

    The centre of mass alone has less than none: a clock that waited for it would wait for ever.
    """
    _, mission = planned("fast")
    leaning, still = [], []
    for plan in mission.plans:
        zmp = sample_zmp(paper_robot(), plan.contacts, plan.body, PERIOD)
        for step in plan.contacts.steps:
            k = int(np.searchsorted(zmp.times, step.lift_off))
            others = np.arange(4) != step.leg.row
            feet = plan.contacts.phase(step.lift_off).feet[others, :2]
            lean = 0.75 / GRAVITY * zmp.body[k, 2, :2]
            leaning.append(stability_margin(zmp.com[k] - lean, feet))
            still.append(stability_margin(zmp.com[k], feet))
    assert min(leaning) > 0.05
    assert min(still) < 0.0


@pytest.mark.parametrize("mode", ["still", "shift"])
def test_a_transition_without_a_shift_is_no_error_of_the_program(mode: str) -> None:
    """0 m is a figure that a scenario may have: there is a plan, or a reason why there is none."""
    sets = ["transition.max_shift=0", f"transition.mode={mode}"]
    scenario, robot = load_scenario("flat_walk", sets), paper_robot()
    course, settings = course_of(scenario), plan_settings(scenario)
    stance = initial_stance(robot, course, settings, start=scenario.start.distance)
    with suppress(PlanningError):
        plan_mission(robot, course, settings, mission_of(scenario, course), stance)
