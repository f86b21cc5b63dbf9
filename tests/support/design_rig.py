"""What tests of the design share: the paper's robot as the search sees it, a design, answers."""

from functools import cache
from typing import Any

import numpy as np
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.flight import AS_USUAL, make_stairs_scenario
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.candidates import CandidateBatch, Staircase, make_cycle
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.designer import design_scenario
from drake_quad.gait_design.kernels import slacks
from drake_quad.gait_design.objective import NAMES, robot_tables, wanted_with_tolerance
from drake_quad.robot.model import LinkOutline, link_outline_of
from drake_quad.scenario.config import Scenario
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs

MODEL = "package://drake_quad_models/paper_quadruped.urdf"
RISE, RUN, COUNT = 0.12, 0.32, 2  # of stairs that the paper's robot climbs


@cache
def shape() -> LinkOutline:
    """The outline of the paper's robot."""
    return link_outline_of(paper_robot())


@cache
def designed() -> Designed:
    """The paper's robot on two low steps."""
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.1, 0.3, 2), model=MODEL)
    return design_scenario(scenario, robot=paper_robot())


def unswayed(grid: CandidateBatch, stairs: Staircase, outline: LinkOutline) -> FloatArray:
    """The room (7,) by NAMES of a grid of one on stairs, if its body does not sway."""
    robot = paper_robot()
    cycle = make_cycle(grid, stairs, foot_radius=robot.foot_radius, clearance=0.02)
    found = np.full((1, len(NAMES)), np.inf)
    tables = robot_tables(robot, outline)._replace(widest=0.0)
    slacks(cycle, stairs, tables, wanted_with_tolerance(robot), found, np.full(1, np.inf))
    return found[0]


def asked(model: str, stairs: Stairs, **question: Any) -> Feasibility:
    """`check_flight`, which designs a gait, without what is near; the same is asked once."""
    question.pop("robot", None)  # of that name
    return _asked(
        model, stairs, **{"nearest": False, "margin": HULL, "around": AS_USUAL, **question}
    )


_asked = cache(check_flight)


def found() -> Feasibility:
    """The answer about those stairs."""
    return asked(MODEL, Stairs(RISE, RUN, COUNT))


def made_up(*, feasible: bool) -> Feasibility:
    """An answer as a test wants it, without a search."""
    check = found() if feasible else Feasibility(Scenario(), None, "", {})
    assert check.feasible is feasible
    return check
