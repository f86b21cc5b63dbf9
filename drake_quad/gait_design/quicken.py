"""Chooses among gaits, each with its best times, for speed: the quickest that keeps enough margin.

Gaits that go farther in a cycle are tried first, and a gait that could not be quicker than what was
found is not tried. A gait that is not proven for every time is not taken in place of one that is.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cached_property
from itertools import chain

from drake_quad.certificate.certify import Certificate, certify_plans
from drake_quad.certificate.kinematics import shank_of
from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.designer import design_longer, design_scenario
from drake_quad.gait_design.pace import measure_pace
from drake_quad.gait_design.preference import (
    GaitPreference,
    required_margins,
)
from drake_quad.gait_design.tempo import (
    balanced_by_motion,
    tread_way,
    usual_tempo,
)
from drake_quad.gait_design.tempo_planner import GaitChoice
from drake_quad.gait_design.tempo_search import ENOUGH, WORTH, SearchStoppedError, TempoSearch
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.motion_config import OF_LEG
from drake_quad.terrain.course import Course

CLEARANCES = ("foot_clearance", "shank_clearance")  # of a certificate


def design_preferred(
    scenario: Scenario, *, source: str = "scenario", robot: RobotModel | None = None
) -> Designed:
    """Designs the gait of a scenario with `design: auto`, with times as its `prefer` says.

    Args:
        scenario: Robot and course.
        source: What an error names.
        robot: The scenario's, if it is at hand: to read it takes a while.

    Raises:
        InputError: If robot or course cannot be used.
        PlanningError: If no gait climbs it.
    """
    preference = GaitPreference(scenario.prefer)
    robot = robot or load_robot(scenario.robot.model)
    slow = design_scenario(scenario, source=source, robot=robot)
    return find_quicker(slow, robot, preference, source=source)


def find_quicker(
    designed: Designed,
    robot: RobotModel,
    preference: GaitPreference,
    *,
    source: str = "scenario",
    note: Callable[[str], object] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> Designed:
    """`quicken` of a gait, with all others for its course that go farther in a cycle, or as far.

    Args:
        designed: A gait that was found for margin, with its plan.
        robot: The scenario's.
        preference: What it is to be good at.
        source: What an error names.
        note: Receives a line after each trial of a gait's times.
        stop: Whether the best so far is to be the answer, asked before each trial.
    """
    return quicken(
        designed, robot, preference, source=source, note=note, stop=stop,
        others=lambda worth: design_longer(
            designed, robot, as_long=preference.less_margin, worth=worth, source=source
        ),
    )  # fmt: skip


def quicken(
    designed: Designed,
    robot: RobotModel,
    preference: GaitPreference,
    *,
    others: Callable[[Callable[[float], bool]], Iterable[GaitChoice]] = lambda _: (),
    source: str = "scenario",
    note: Callable[[str], object] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> Designed:
    """The designed gait, or another, with times as is preferred; the same if none are better.

    Args:
        designed: A gait that was found for margin, with its plan.
        robot: The scenario's.
        preference: What it is to be good at.
        others: Makes gaits for the same course that go farther in a cycle, or as far; none is
            drawn that is not needed. It is told which are of interest that go so many times as far.
        source: What an error names.
        note: Receives a line after each trial of a gait's times.
        stop: Whether the best so far is to be the answer, asked before each trial.
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
    proven, usual = Proven(designed, robot, course), fastest(designed.scenario, robot, course)
    longer = others(lambda times: times * usual > WORTH * speed)
    # For a speed that is enough, the gait that was found for margin may do. Else a gait that goes
    # farther in a cycle is mostly the quicker one, and the other need not be tried then.
    for gait in chain([slow], longer) if preference.speed is not None else chain(longer, [slow]):
        if fastest(gait.scenario, robot, course) <= WORTH * speed:
            continue
        if preference.dynamic:
            moving = balanced_by_motion(gait.scenario)
            gait = GaitChoice(moving, gait.design, planned=gait.planned)
        search = TempoSearch(gait, designed, robot, own, source, note, stop)
        for margins in kept:
            try:
                found = search.quickest(preference.speed, speed, margins)
            except SearchStoppedError:
                found = search.verified_best(speed)
            if found is None:
                continue
            if preference.dynamic:
                best, speed = found.designed, found.speed
            elif proven.as_good(found.designed):
                certificate = proven.certificate(found.designed)
                best, speed = replace(found.designed, certificate=certificate), found.speed
        if stop() or (preference.speed is not None and speed >= ENOUGH * preference.speed):
            break
    return best


def run_error(robot: RobotModel) -> float:
    """How far feet and shanks of a run may be off its plan [m]."""
    return max(OF_LEG["body"], OF_LEG["swing"]) * leg_length(robot)


class Proven:
    """What is proven of the gait that was found for margin, and whether others keep as much.

    Plans keep what they ask for at sampled times, and of what they look at. A quicker gait is worth
    neither a proof, nor stairs that a run may touch.
    """

    def __init__(self, slow: Designed, robot: RobotModel, course: Course) -> None:
        """Takes that gait, its robot and its course."""
        self._slow, self._robot, self._course = slow, robot, course
        self._proofs: dict[Designed, Certificate] = {}

    def as_good(self, found: Designed) -> bool:
        """Whether margin, limits and clearances of a plan are proven, where the slow one's are.

        Feet and shanks keep `run_error` from the stairs, or as much as in the slow plan.
        """
        proof, error = self.certificate(found), run_error(self._robot)
        if proof.failure is not None:
            return self._slow_proof.failure is not None
        quick = {name: proof.least[name] for name in CLEARANCES}
        clear = all(have is None or have >= error for have in quick.values())
        # The slow one is not asked where it need not be: to prove it takes a second.
        if clear or self._slow_proof.failure is not None:
            return True
        pairs = ((quick[name], self._slow_proof.least[name]) for name in CLEARANCES)
        return all(
            have is None or before is None or have >= min(before, error) for have, before in pairs
        )

    def certificate(self, designed: Designed) -> Certificate:
        """What is proven of a gait's plan, kept with it."""
        if designed not in self._proofs:
            robot, plans = self._robot, designed.plan.plans
            proof = certify_plans(robot, shank_of(robot), plans, self._course.boxes)
            self._proofs[designed] = proof
        return self._proofs[designed]

    @cached_property
    def _slow_proof(self) -> Certificate:
        return self.certificate(self._slow)


def fastest(scenario: Scenario, robot: RobotModel, course: Course) -> float:
    """A speed that no times of a scenario's gait exceed on the shallowest treads [m/s]."""
    flights = flights_of(course, scenario.gait.deep_tread)
    tempo = usual_tempo(scenario.gait, robot)
    way = tread_way(scenario.gait, min(s.run for s in flights))
    return way / (4.0 * (tempo.swing + tempo.gap))
