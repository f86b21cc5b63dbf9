"""The push budget against pushes in the simulation: how much of what it says do stances take?

    python -m benchmarks.push_budget --trials 200

Each trial stands the robot on four feet, its feet and its body somewhere, on level ground or on
stairs, and pushes it through its centre of mass, somewhere to. Catching steps are switched off.
The push that topples it is sought by halving. `ratio` is predicted over actual: 1 is exact, less is
on the safe side. A push is survived if at the end the robot stands on three feet at least, within
0.15 m of its place and 10° of upright. How far a foot slid or hopped at 90 % of the budget is told
beside it.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus

from benchmarks.common import markdown_table, provenance
from drake_quad.diagram import MakeStairClimb
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import Stance, pose_robot, rotations
from drake_quad.robot.load_robot import load_robot
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario import Scenario, control_settings, course_of, parse_scenario, plan_settings
from drake_quad.stability.contacts import make_contacts
from drake_quad.stability.pendulum import Pendulum, find_pressure_area
from drake_quad.stability.push_budget import push_budget
from drake_quad.stability.region import find_region
from drake_quad.stability.torque import joint_limits
from drake_quad.systems.disturbances import Disturbances, Push
from drake_quad.terrain import Course

SCENARIO = """
course:
  - {kind: floor, length: 4.0}
  - {kind: stairs, going: up, rise: 0.13, run: 0.50, count: 6}
  - {kind: floor, length: 4.0}
controller: {catch_pushes: false}
monitor: {margins: hull}
"""
STAIRS = 5.5  # [m] where the body is among the stairs
PUSHED_AT, PUSH, LASTS = 0.4, 0.05, 3.0  # [s] when, how long, and when it is over
FARTHEST, UPRIGHT = 0.15, 0.985  # [m] of the base, and its z axis's z, of a push survived
LEAST = 0.05  # [m/s] a budget too small to ask about
SHARE = 0.9  # of the budget that no push may topple by
HALVINGS = 5


@dataclass(frozen=True)
class Trial:
    """A stance and the way in which it is pushed.

    Attributes:
        stance: In which it stands.
        way: (2,) unit vector in W.
        p_BScm: Its centre of mass in B [m].
        budget: What the law says [m/s].
        on_stairs: Where.
    """

    stance: Stance
    way: FloatArray
    p_BScm: FloatArray
    budget: float
    on_stairs: bool


def draw(random: np.random.Generator, robot: RobotModel, course: Course, mu: float) -> Trial:
    """A random stance that the legs can take, and its budget."""
    while True:
        on_stairs = bool(random.random() < 0.5)
        x = STAIRS if on_stairs else 2.0
        feet = np.empty((4, 3))
        feet[:, 0] = x + 0.375 * np.array([1, 1, -1, -1]) + random.uniform(-0.15, 0.15, 4)
        feet[:, 1] = 0.3 * np.array([1, -1, 1, -1]) + random.uniform(-0.08, 0.08, 4)
        if on_stairs:  # on a tread's middle, whole
            feet[:, 0] = 4.0 + 0.5 * (np.floor((feet[:, 0] - 4.0) / 0.5) + 0.5)
        ground = course.height(feet[:, 0], feet[:, 1])
        feet[:, 2] = ground + robot.foot_radius
        shift = random.uniform([-0.2, -0.12], [0.2, 0.12])
        body = np.array([x + shift[0], shift[1], ground.mean() + random.uniform(0.75, 0.88), 0, 0])
        q, excess, com = (part[0] for part in pose_robot(robot, body[None], feet[None]))
        inside = np.all((q.ravel() > robot.q_lower) & (q.ravel() < robot.q_upper))
        if excess.max() > 0.0 or not inside:
            continue
        turn = random.uniform(0.0, 2.0 * np.pi)
        way = np.array([np.cos(turn), np.sin(turn)])
        R = rotations(body)
        places = feet - [0.0, 0.0, robot.foot_radius]
        contacts = make_contacts(places, friction=mu)
        limits = joint_limits(robot, R, q, np.ones(4, dtype=bool))
        pendulum = Pendulum(*com.tolist(), ground=float(places[:, 2].mean()))
        budget = push_budget(
            find_region(contacts, limits=limits),
            find_pressure_area(contacts, pendulum, limits=limits),
            pendulum,
            way[None],
        )[0]
        if budget > LEAST:
            p_BScm = R.T @ (com - body[:3])
            return Trial(Stance(body, feet), way, p_BScm, float(budget), on_stairs)


def survives(
    scenario: Scenario, robot: RobotModel, course: Course, trial: Trial, v: float
) -> tuple[bool, float]:
    """Whether the robot stands after a push worth `v` [m/s], and how far a foot slid [m]."""
    force = robot.mass * v / PUSH * trial.way
    push = Push(
        time=PUSHED_AT,
        duration=PUSH,
        force_H=(float(force[0]), float(force[1]), 0.0),
        body=robot.trunk,
        p_BP=tuple(trial.p_BScm.tolist()),
        speed=v,
    )
    climb = MakeStairClimb(
        robot=robot,
        course=course,
        settings=plan_settings(scenario),
        mission=(Task(kind="stand", name="stand", lane=0, duration=2.0 * LASTS),),
        control=control_settings(scenario),
        stance=trial.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=0.02,
        disturbances=Disturbances(pushes=(push,)),
    )
    simulator = Simulator(climb.diagram)
    status = simulator.AdvanceTo(LASTS)
    if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
        return False, float("nan")
    context = simulator.get_context()
    monitor = climb.diagram.GetSubsystemByName("contact_monitor")
    own = monitor.GetMyContextFromRoot(context)
    bearing = monitor.GetOutputPort("contact_state_measured").Eval(own)
    places = monitor.GetOutputPort("foot_contact_position").Eval(own).reshape(4, 3)
    state = climb.plant.get_state_output_port().Eval(climb.plant.GetMyContextFromRoot(context))
    base = climb.layout.read(state)
    slid = np.linalg.norm((places - trial.stance.feet)[:, :2], axis=1).max()
    off = np.linalg.norm(base.p_WB - trial.stance.body[:3])
    stands = np.sum(bearing > 0.5) >= 3 and off < FARTHEST and base.R_WB[2, 2] > UPRIGHT
    return bool(stands), float(slid)


def measure(trials: int, *, kind: str, seed: int = 0) -> list[dict[str, Any]]:
    """Of each trial the budget, the greatest push survived, and whether 90 % of the budget was."""
    scenario = parse_scenario(SCENARIO, source="push_budget", overrides=[f"controller.kind={kind}"])
    robot = load_robot(scenario.robot.model)
    course = course_of(scenario, foot_radius=robot.foot_radius)
    random, rows = np.random.default_rng(seed), []
    for _ in range(trials):
        trial = draw(random, robot, course, scenario.simulation.friction)

        def holds(share: float, trial: Trial = trial) -> bool:
            return survives(scenario, robot, course, trial, share * trial.budget)[0]

        safe, slid = survives(scenario, robot, course, trial, SHARE * trial.budget)
        low, high = (SHARE, 2.0) if safe else (0.0, SHARE)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(middle) else (low, middle)
        actual = 0.5 * (low + high) * trial.budget
        row = {
            "on_stairs": trial.on_stairs,
            "direction": float(np.degrees(np.arctan2(trial.way[1], trial.way[0]))),
            "budget": trial.budget,
            "actual": actual,
            "ratio": trial.budget / actual,
            "safe": safe,
            "slid": slid,
        }
        rows.append(row)
        print(json.dumps(row), flush=True)
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--kind", default="ik", choices=("ik", "whole_body"), help="of controller")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    rows = measure(options.trials, kind=options.kind, seed=options.seed)
    table = []
    for name, mine in (
        ("level", [r for r in rows if not r["on_stairs"]]),
        ("stairs", [r for r in rows if r["on_stairs"]]),
        ("all", rows),
    ):
        if mine:
            ratios = [r["ratio"] for r in mine]
            table.append(
                [
                    name,
                    str(len(mine)),
                    str(sum(not r["safe"] for r in mine)),
                    f"{np.median(ratios):.2f}",
                    f"{min(ratios):.2f} to {max(ratios):.2f}",
                ]
            )
    header = ("ground", "trials", "toppled under 90 %", "median predicted / actual", "range")
    print(markdown_table(header, table))
    print(f"\ncontroller {options.kind}; {provenance()}")


if __name__ == "__main__":
    main()
