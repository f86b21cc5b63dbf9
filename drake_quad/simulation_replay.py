"""Kinematic replay: a plan as if it were a run. No physics; what touches is asked of geometry."""

import time

from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.plan_torques import SHARES
from drake_quad.preparation import Preparation
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_state import make_layout
from drake_quad.run_files import RunResult
from drake_quad.run_log import kinematic_logs, make_table, state_names
from drake_quad.simulation_contacts import find_touches
from drake_quad.simulation_end import result_of

LISTED = 10  # overlaps that a summary holds


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
    touches = find_touches(p.robot, p.course, times, logs["state"])
    logs["nonfoot"][:, 0], logs["nonfoot_depth"] = touches.count, touches.depth[:, None]
    logs["foot_depth"] = touches.foot_depth
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
    result = result_of(p, "goal_reached", reason, table, simulated=float(times[-1]), wall=wall)
    result.summary["overlaps"] = list(touches.deepest[:LISTED])
    return result
