"""Statically stable stair climbing for quadrupeds: planned, proven, simulated in Drake, measured.

    import drake_quad as dq

    robot = dq.load_robot("go1")
    answer = dq.check_stairs(robot, dq.Stairs(rise=0.10, run=0.30, count=6))
    prepared = dq.plan(dq.load_scenario("case_study"))
    result = dq.simulate(prepared)

What is listed in `__all__` is the public API, on which the command line is built; everything else
may change. Names are imported when they are first used, so that `import drake_quad` is quick.
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drake_quad.api.runs import (
        certify as certify,
        load_study as load_study,
        make_viewers as make_viewers,
        plan as plan,
        replay as replay,
        report_plan as report_plan,
        run_study as run_study,
    )
    from drake_quad.api.stairs import (
        chart_stairs as chart_stairs,
        check_course as check_course,
        check_stairs as check_stairs,
        make_passport as make_passport,
        try_passport as try_passport,
    )
    from drake_quad.certificate.certify import Certificate as Certificate
    from drake_quad.errors import (
        DrakeQuadError as DrakeQuadError,
        InputError as InputError,
        MachineError as MachineError,
        PlanningError as PlanningError,
    )
    from drake_quad.feasibility.changes import Change as Change
    from drake_quad.feasibility.chart import (
        Span as Span,
        StairChart as StairChart,
    )
    from drake_quad.feasibility.chart_picture import save_chart as save_chart
    from drake_quad.feasibility.check_request import (
        CheckRequest as CheckRequest,
        run_check as run_check,
    )
    from drake_quad.feasibility.check_words import (
        near_words as near_words,
        treads_in_words as treads_in_words,
    )
    from drake_quad.feasibility.inspect_robot import (
        describe_robot as describe_robot,
        print_robot as print_robot,
    )
    from drake_quad.feasibility.passport import Passport as Passport
    from drake_quad.feasibility.passport_page import (
        passport_cells as passport_cells,
        passport_columns as passport_columns,
    )
    from drake_quad.feasibility.result import Feasibility as Feasibility
    from drake_quad.feasibility.robot_picture import (
        check_picture_path as check_picture_path,
        draw_robot as draw_robot,
        save_picture as save_picture,
    )
    from drake_quad.perception.see import (
        SeenStairs as SeenStairs,
        describe_seen as describe_seen,
        parse_intrinsics as parse_intrinsics,
        read_depth_image as read_depth_image,
        see_stairs as see_stairs,
    )
    from drake_quad.perception.see_picture import draw_seen as draw_seen
    from drake_quad.planning.mission import MissionPlan as MissionPlan
    from drake_quad.planning.motion_plan import MotionPlan as MotionPlan
    from drake_quad.report.bus_page import write_bus_page as write_bus_page
    from drake_quad.report.joint_table import write_joint_table as write_joint_table
    from drake_quad.report.lcm_replay import write_scene_log as write_scene_log
    from drake_quad.report.mcap_export import write_mcap as write_mcap
    from drake_quad.report.page import write_report as write_report
    from drake_quad.report.ros2_bag import write_ros2_bag as write_ros2_bag
    from drake_quad.robot.loader import load_robot as load_robot
    from drake_quad.robot.model import RobotModel as RobotModel
    from drake_quad.runs.read_summary import read_summary as read_summary
    from drake_quad.runs.reader import RecordedRun as RecordedRun, load_run as load_run
    from drake_quad.runs.result import RunResult as RunResult
    from drake_quad.runs.summary_lines import (
        safety_line as safety_line,
        summary_lines as summary_lines,
    )
    from drake_quad.scenario.config import Scenario as Scenario
    from drake_quad.scenario.load import (
        load_scenario as load_scenario,
        save_scenario as save_scenario,
        shipped_scenarios as shipped_scenarios,
    )
    from drake_quad.simulation.diagram import MakeStairClimb as MakeStairClimb
    from drake_quad.simulation.prepared import PreparedScenario as PreparedScenario
    from drake_quad.simulation.run import simulate as simulate
    from drake_quad.sweep.compare import (
        Comparison as Comparison,
        compare_sweeps as compare_sweeps,
        print_comparison as print_comparison,
    )
    from drake_quad.sweep.passport_trials import check_trials as check_trials
    from drake_quad.sweep.rebuild_report import rebuild_report as rebuild_report
    from drake_quad.sweep.statistics import (
        caveats_of as caveats_of,
        gate_words as gate_words,
        grade as grade,
    )
    from drake_quad.sweep.study import Study as Study
    from drake_quad.sweep.trials import repeat_into as repeat_into
    from drake_quad.systems.controller import MakeController as MakeController
    from drake_quad.terrain.course import Course as Course, build_course as build_course
    from drake_quad.terrain.elements import Element as Element, Stairs as Stairs

try:
    __version__ = version("drake_quad")  # pyproject.toml says it, and nobody else
except PackageNotFoundError:  # a checkout on the path that was never installed
    __version__ = "0+unknown"

# The public names by the modules that define them; a test compares them with the imports above.
_PUBLIC = {
    "api.runs": "certify load_study make_viewers plan replay report_plan run_study",
    "api.stairs": "chart_stairs check_course check_stairs make_passport try_passport",
    "certificate.certify": "Certificate",
    "errors": "DrakeQuadError InputError MachineError PlanningError",
    "feasibility.chart": "Span StairChart",
    "feasibility.chart_picture": "save_chart",
    "feasibility.result": "Feasibility",
    "feasibility.changes": "Change",
    "feasibility.check_words": "near_words treads_in_words",
    "feasibility.check_request": "CheckRequest run_check",
    "feasibility.inspect_robot": "describe_robot print_robot",
    "feasibility.passport": "Passport",
    "feasibility.passport_page": "passport_cells passport_columns",
    "feasibility.robot_picture": "check_picture_path draw_robot save_picture",
    "perception.see": "SeenStairs describe_seen parse_intrinsics read_depth_image see_stairs",
    "perception.see_picture": "draw_seen",
    "planning.mission": "MissionPlan",
    "planning.motion_plan": "MotionPlan",
    "report.bus_page": "write_bus_page",
    "report.joint_table": "write_joint_table",
    "report.lcm_replay": "write_scene_log",
    "report.mcap_export": "write_mcap",
    "report.ros2_bag": "write_ros2_bag",
    "report.page": "write_report",
    "robot.loader": "load_robot",
    "robot.model": "RobotModel",
    "runs.read_summary": "read_summary",
    "runs.reader": "RecordedRun load_run",
    "runs.result": "RunResult",
    "runs.summary_lines": "safety_line summary_lines",
    "scenario.config": "Scenario",
    "scenario.load": "load_scenario save_scenario shipped_scenarios",
    "simulation.diagram": "MakeStairClimb",
    "simulation.prepared": "PreparedScenario",
    "simulation.run": "simulate",
    "sweep.compare": "Comparison compare_sweeps print_comparison",
    "sweep.passport_trials": "check_trials",
    "sweep.rebuild_report": "rebuild_report",
    "sweep.statistics": "caveats_of gate_words grade",
    "sweep.study": "Study",
    "sweep.trials": "repeat_into",
    "systems.controller": "MakeController",
    "terrain.course": "Course build_course",
    "terrain.elements": "Element Stairs",
}
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
__all__ = ["__version__", *sorted(_HOMES)]


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
