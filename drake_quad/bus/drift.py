"""A designed gait made fit for a robot that is not quite where it believes to be.

A design counts on stairs and a state that are known exactly. On a bus the robot is put down by
hand, its estimate drifts, its trunk sags and its feet sink in.
"""

import copy
from collections.abc import Iterable
from math import sqrt

from drake_quad.common import GRAVITY
from drake_quad.errors import InputError, PlanningError
from drake_quad.gait_design.quicken import design_preferred
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import leg_length
from drake_quad.scenario.config import Scenario
from drake_quad.simulation.prepare import judge_plan, prepare
from drake_quad.terrain.element_checks import LEVEL

# [m] by which stairs may be elsewhere than where a robot believes them: it is put down by hand, and
# its estimate drifts. Half as much in place had a foot meet a riser on its way to the next tread.
PLACE_ERROR, HEIGHT_ERROR = 0.03, 0.01
# Heights by which swing feet clear the ground [m], tried in turn: a trunk that sags, feet that sink
# in and an estimate that sinks took 9 mm of the 8 that a Go2's gait is designed with, its feet
# scraped along the floor and came down up to 135 mm short.
CLEARANCES = (0.03, 0.02)
# Speed of swing feet, over the root of gravity times a leg's length: 0.6 m/s of a Go2's. Its joints
# felt a touchdown in the air where a foot came down a riser at 1.2 m/s.
SWING_SPEED = 0.3
# Shares of how far from treads' middles feet are set down, tried in turn.
CENTRED = (0.0, 0.25, 0.5)
MARGIN_KEPT = 0.9  # of the plan's margin, that either of these changes has to leave


def allow_for_drift(scenario: Scenario, fields: list[str], *, source: str) -> Scenario:
    """A scenario to be designed, designed, its swings allowing for drift and for what gives.

    Its swing feet are raised and calmed, see `raise_swings`. On stairs swings allow for a map that
    is wrong, and feet are set down nearer to the treads' middles, see `centre_footholds`. Else the
    gait is the one for stairs that are known exactly: one that keeps shanks so much farther off is
    not found for every robot, or not soon.

    Args:
        scenario: Scenario as `load_for_bus` returns it.
        fields: What a person sets of it: what that says of swings and the map's errors stays.
        source: What an error names.

    Returns:
        The scenario, or the given one if it has a gait already.

    Raises:
        InputError: If robot or course cannot be used.
        PlanningError: If no gait climbs it.
    """
    if scenario.design != "auto":
        return scenario
    told = [one.strip() for one in fields]
    errors = scenario.gait.map_error_place, scenario.gait.map_error_height
    filled = design_preferred(scenario, source=source).scenario
    level = all(element.kind in LEVEL for element in scenario.course)
    exact = any(one.startswith("gait.map_error") for one in told) or errors != (0.0, 0.0)
    if not (level or exact):
        filled.gait.map_error_place, filled.gait.map_error_height = PLACE_ERROR, HEIGHT_ERROR
    if not any(one.startswith("gait.swing_") for one in told):
        filled = raise_swings(filled, source=source)
    return filled if level or exact else centre_footholds(filled, source=source)


def raise_swings(scenario: Scenario, *, source: str) -> Scenario:
    """The scenario with higher and calmer swings, if its plan allows for them.

    Args:
        scenario: Scenario with a gait.
        source: What an error names.

    Returns:
        The scenario with the first of CLEARANCES, and with SWING_SPEED, that leaves MARGIN_KEPT of
        the plan's margin; the given one if none does, or it has no plan.
    """
    speed = round(SWING_SPEED * sqrt(GRAVITY * leg_length(load_robot(scenario.robot.model))), 3)

    def higher(clearance: float) -> Scenario:
        found = copy.deepcopy(scenario)
        found.gait.swing_clearance = max(found.gait.swing_clearance, clearance)
        found.gait.swing_speed = found.gait.swing_speed or speed
        return found

    return _first_that_keeps_margin(scenario, map(higher, CLEARANCES), source)


def centre_footholds(scenario: Scenario, *, source: str) -> Scenario:
    """The scenario with its footholds nearer to the treads' middles, if its plan allows for it.

    A designed gait sets feet down where its margin is largest, which may be near a nosing: a Go2's
    stood 33 mm from the edges going down, and slid off where its estimate was as far ahead.

    Args:
        scenario: Scenario with a gait.
        source: What an error names.

    Returns:
        The scenario with the least of CENTRED's shares of its phases that leaves MARGIN_KEPT of
        the plan's margin; the given one if none does, or it has no plan.
    """

    def nearer(share: float) -> Scenario:
        found = copy.deepcopy(scenario)
        found.gait.tread_phase_up *= share
        found.gait.tread_phase_down *= share
        return found

    return _first_that_keeps_margin(scenario, map(nearer, CENTRED), source)


def _first_that_keeps_margin(
    scenario: Scenario, others: Iterable[Scenario], source: str
) -> Scenario:
    """The first of others whose plan has MARGIN_KEPT of a scenario's margin, or else that one."""
    least = _planned_margin(scenario, source)
    if least is None:
        return scenario
    kept = (o for o in others if (_planned_margin(o, source) or 0.0) >= MARGIN_KEPT * least)
    return next(kept, scenario)


def _planned_margin(scenario: Scenario, source: str) -> float | None:
    """The least margin of a scenario's plan [m]; None without steps, or if it cannot be done."""
    try:
        prepared = prepare(scenario, source=source)
        judge_plan(prepared)
    except (InputError, PlanningError):  # out of a leg's reach is the former
        return None
    return min((p.margin for p in prepared.plan.plans if p.contacts.steps), default=None)
