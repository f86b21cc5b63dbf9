"""Chooses among gaits, each with its best times, for speed: the quickest that keeps enough margin.

Gaits that go farther in a cycle are tried first, and a gait that could not be quicker than what was
found is not tried.
"""

from collections.abc import Iterable
from itertools import chain

from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.pace import measure_pace
from drake_quad.gait_design.plan_candidates import Designed
from drake_quad.gait_design.preference import (
    GaitPreference,
    required_margins,
)
from drake_quad.gait_design.tempo import (
    balanced_by_motion,
    tread_way,
    usual_tempo,
)
from drake_quad.gait_design.tempo_search import ENOUGH, WORTH, GaitChoice, TempoSearch
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.course import Course


def quicken(
    designed: Designed,
    robot: RobotModel,
    preference: GaitPreference,
    *,
    others: Iterable[GaitChoice] = (),
    source: str = "scenario",
) -> Designed:
    """The designed gait, or another, with times as is preferred; the same if none are better.

    Args:
        designed: A gait that was found for margin, with its plan.
        robot: The scenario's.
        preference: What it is to be good at.
        others: Gaits for the same course that go farther in a cycle, or as far; none is drawn that
            is not needed.
        source: What an error names.
    """
    course = course_of(designed.scenario, source=source, foot_radius=robot.foot_radius)
    if not preference.quick or not flights_of(course, designed.scenario.gait.deep_tread):
        return designed
    tasks = mission_of(designed.scenario, course, source=source)
    before = measure_pace(robot, course, tasks, designed.plan)
    if before.slowest is None:
        return designed
    enough = preference.speed is not None and before.slowest.speed >= ENOUGH * preference.speed
    if enough and not preference.dynamic:
        return designed
    own = required_margins(preference, robot, designed.margin, before.zmp_margin)
    kept = [
        required_margins(w, robot, designed.margin, before.zmp_margin) for w in preference.steps()
    ]
    kept = [k for k in kept if own.spare(k.margin, k.zmp_margin) >= 0.0]
    slow = GaitChoice(designed.scenario, designed.design, planned=True)
    best, speed = designed, before.slowest.speed
    # For a speed that is enough, the gait that was found for margin may do. Else a gait that goes
    # farther in a cycle is mostly the quicker one, and the other need not be tried then.
    for gait in chain([slow], others) if preference.speed is not None else chain(others, [slow]):
        if fastest(gait.scenario, robot, course) <= WORTH * speed:
            continue
        if preference.dynamic:
            moving = balanced_by_motion(gait.scenario)
            gait = GaitChoice(moving, gait.design, planned=gait.planned)
        search = TempoSearch(gait, designed, robot, own, source)
        for margins in kept:
            found = search.quickest(preference.speed, speed, margins)
            if found is not None:
                best, speed = found.designed, found.speed
        if preference.speed is not None and speed >= ENOUGH * preference.speed:
            break
    return best


def fastest(scenario: Scenario, robot: RobotModel, course: Course) -> float:
    """A speed that no times of a scenario's gait exceed on the shallowest treads [m/s]."""
    flights = flights_of(course, scenario.gait.deep_tread)
    tempo = usual_tempo(scenario.gait, robot)
    way = tread_way(scenario.gait, min(s.run for s in flights))
    return way / (4.0 * (tempo.swing + tempo.gap))
