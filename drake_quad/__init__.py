"""Statically stable stair climbing for quadrupeds: planned, proven, simulated in Drake, measured.

    import drake_quad as dq

    robot = dq.load_robot("go1")
    answer = dq.check_stairs(robot, dq.Stairs(rise=0.10, run=0.30, count=6))
    prepared = dq.plan(dq.load_scenario("case_study"))
    result = dq.simulate(prepared)

What is listed in `__all__` is the public API; everything else may change. Names are imported when
they are first used, so that `import drake_quad` is quick.
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drake_quad.api import (
        certify,
        chart_stairs,
        check_course,
        check_stairs,
        load_study,
        plan,
        replay,
        run_study,
    )
    from drake_quad.certificate.certify import Certificate
    from drake_quad.errors import DrakeQuadError, InputError, MachineError, PlanningError
    from drake_quad.feasibility.chart import Span
    from drake_quad.feasibility.check import Feasibility
    from drake_quad.planning.mission import MissionPlan
    from drake_quad.planning.motion_plan import MotionPlan
    from drake_quad.report.page import write_report
    from drake_quad.robot.loader import load_robot
    from drake_quad.robot.model import RobotModel
    from drake_quad.runs.reader import RecordedRun, load_run
    from drake_quad.runs.result import RunResult
    from drake_quad.scenario.config import Scenario
    from drake_quad.scenario.load import load_scenario, save_scenario, shipped_scenarios
    from drake_quad.simulation.diagram import MakeStairClimb
    from drake_quad.simulation.prepare import PreparedScenario
    from drake_quad.simulation.run import simulate
    from drake_quad.sweep.compare import compare_sweeps
    from drake_quad.sweep.study import Study
    from drake_quad.systems.controller import MakeController
    from drake_quad.terrain.course import Course, build_course
    from drake_quad.terrain.elements import Element, Stairs

try:
    __version__ = version("drake_quad")  # pyproject.toml says it, and nobody else
except PackageNotFoundError:  # a checkout on the path that was never installed
    __version__ = "0+unknown"

# Where each public name is defined.
_HOMES = {
    "Certificate": "certificate.certify",
    "Course": "terrain.course",
    "DrakeQuadError": "errors",
    "Element": "terrain.elements",
    "Feasibility": "feasibility.check",
    "InputError": "errors",
    "MachineError": "errors",
    "MakeController": "systems.controller",
    "MakeStairClimb": "simulation.diagram",
    "MissionPlan": "planning.mission",
    "MotionPlan": "planning.motion_plan",
    "PlanningError": "errors",
    "PreparedScenario": "simulation.prepare",
    "RecordedRun": "runs.reader",
    "RobotModel": "robot.model",
    "RunResult": "runs.result",
    "Scenario": "scenario.config",
    "Span": "feasibility.chart",
    "Stairs": "terrain.elements",
    "Study": "sweep.study",
    "build_course": "terrain.course",
    "certify": "api",
    "chart_stairs": "api",
    "check_course": "api",
    "check_stairs": "api",
    "compare_sweeps": "sweep.compare",
    "load_robot": "robot.loader",
    "load_run": "runs.reader",
    "load_scenario": "scenario.load",
    "load_study": "api",
    "plan": "api",
    "replay": "api",
    "run_study": "api",
    "save_scenario": "scenario.load",
    "shipped_scenarios": "scenario.load",
    "simulate": "simulation.run",
    "write_report": "report.page",
}

__all__ = [
    "Certificate",
    "Course",
    "DrakeQuadError",
    "Element",
    "Feasibility",
    "InputError",
    "MachineError",
    "MakeController",
    "MakeStairClimb",
    "MissionPlan",
    "MotionPlan",
    "PlanningError",
    "PreparedScenario",
    "RecordedRun",
    "RobotModel",
    "RunResult",
    "Scenario",
    "Span",
    "Stairs",
    "Study",
    "__version__",
    "build_course",
    "certify",
    "chart_stairs",
    "check_course",
    "check_stairs",
    "compare_sweeps",
    "load_robot",
    "load_run",
    "load_scenario",
    "load_study",
    "plan",
    "replay",
    "run_study",
    "save_scenario",
    "shipped_scenarios",
    "simulate",
    "write_report",
]


def __getattr__(name: str) -> Any:
    """Imports a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'drake_quad' has no attribute '{name}'")
    value = getattr(import_module(f"drake_quad.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, so that completion finds them."""
    return sorted(__all__)
