"""Kinematic replay: a plan as if it were a run. No physics, and nothing is measured."""

import time

from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.plan_torques import SHARES
from drake_quad.preparation import Preparation
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_state import make_layout
from drake_quad.run_files import RunResult
from drake_quad.run_log import kinematic_logs, make_table, state_names
from drake_quad.simulation_end import result_of


def replay_plan(p: Preparation) -> RunResult:
    """The plan of what was prepared, sampled as a run is logged."""
    begun = time.perf_counter()
    plant = MakeModelPlant(p.robot.url)
    layout = make_layout(plant, p.robot)
    plans: tuple[MotionPlan, ...] = p.plan.plans
    times, logs = kinematic_logs(
        p.robot,
        layout,
        plans,
        p.scenario.simulation.log_period,
        massless_legs=p.settings.uniform_body,
    )
    table = make_table(
        p.robot,
        layout,
        times=times,
        logs=logs,
        plans=plans,
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
        massless_legs=p.settings.uniform_body,
        share=SHARES[p.scenario.controller.kind],
    )
    wall = time.perf_counter() - begun
    reason = "kinematic replay of the plan: no physics, nothing measured"
    return result_of(p, "goal_reached", reason, table, simulated=float(times[-1]), wall=wall)
