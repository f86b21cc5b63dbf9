"""Controller and simulated robot over a bus: in lock step, and in two processes."""

import json
import os
import signal
import subprocess
import sys
import time
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from bus_rig import PERIOD_NS, QUICK, SHORT_WALK, Puppet, short_walk
from rig import state_of

from drake_quad.bus.bus_controller import BusController, TouchByTorque
from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.messages import DRIVES_FOLLOW, StateMessage
from drake_quad.bus.postures import sit_to_stand
from drake_quad.bus.real_time import ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import RobotLoop, SimulatedRobot
from drake_quad.bus.safety import SafetyMode
from drake_quad.common import FloatArray
from drake_quad.estimation.contact_from_torques import TouchSettings
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.joint_contact_estimator import standing_torque

COMMAND = [sys.executable, "-m", "drake_quad"]


@pytest.mark.parametrize("contacts", [pytest.param("feet", marks=pytest.mark.long), "joints"])
def test_the_simulated_robot_stands_up_and_walks(contacts: str) -> None:
    """In lock step, on its own sensors alone, the shipped robot rises and shifts its weight.

    A tick of each side after the other, by a clock of the test's: the same whatever else the
    machine does. Standing up is quicker here than a robot's.
    """
    prepared, clock = short_walk(contacts, QUICK), ManualClock()
    bus = LoopbackBus(clock.now_ns)
    simulated = SimulatedRobot(prepared)
    robot = RobotLoop(simulated, bus, clock)
    loop = ControlLoop(prepared, bus, clock)
    loop.limits = replace(loop.limits, fold_time=0.6, rise_time=1.0)
    low, walked = robot.robot.base[2], 0
    legs_lifted = 0.0
    while walked < 800:
        robot.tick()
        loop.tick()
        clock.sleep_until(clock.now_ns() + PERIOD_NS)
        walked += loop.mode == SafetyMode.WALKING
        if loop.mode == SafetyMode.WALKING:
            legs_lifted = max(legs_lifted, float(np.ptp(simulated.feet[:, 2])))
        assert not loop.outcome, loop.outcome
    assert robot.robot.base[2] > low + 0.4
    body = prepared.plan.plans[1].sample(0.9).body[0]
    start = prepared.stance.body
    moved = float(np.hypot(*(body[:2] - start[:2])))
    assert moved > 0.1  # the plan shifts the body before the first step
    assert legs_lifted > 0.015  # and that step was made
    assert loop.largest_step <= 0.05 and loop.holds == 0
    assert robot.guard.reason == ""


def felt_under(robot: RobotModel, prepared: PreparedScenario, share: float) -> FloatArray:
    """Feet felt to bear (4,) after the robot has hung for a while, then pressed on each foot."""
    model = MakeModelPlant(robot.url)
    layout = make_layout(model, robot)
    touch = TouchByTorque(robot, layout, model, prepared.scenario.controller, TouchSettings())
    stance = prepared.stance
    state = state_of(stance.body, stance.feet, layout=layout)
    hanging = standing_torque(replace(robot, mass=0.0), layout, model, state)  # no feet's part
    pressed = standing_torque(robot, layout, model, state) - hanging  # of a quarter on each foot
    felt = np.ones(4)
    for torque in (hanging, hanging + 4.0 * share * pressed):
        for tick in range(100):
            message = StateMessage(
                1, tick, tick * PERIOD_NS, DRIVES_FOLLOW, state[layout.q_joints], np.zeros(12),
                torque, np.zeros(3), np.zeros(3), np.zeros(4),
            )  # fmt: skip
            felt = touch.feel(state, message, 1)
    return felt


def test_a_bus_allows_for_the_friction_that_a_robots_file_states() -> None:
    """Pressed with 5 % of the weight a foot has landed; not if its joints' friction may be that."""
    prepared = short_walk("joints")
    robot = prepared.robot
    assert np.array_equal(felt_under(robot, prepared, 0.05), np.ones(4))
    rough = replace(robot, joint_friction=np.full(12, 10.0))
    assert np.array_equal(felt_under(rough, prepared, 0.05), np.zeros(4))
    assert np.array_equal(felt_under(rough, prepared, 0.5), np.ones(4))


def test_a_controller_on_a_bus_knows_how_much_its_feet_give() -> None:
    """`estimator.foot_give` reaches the estimator: the same messages are answered otherwise."""
    prepared = short_walk()
    soft = replace(prepared, scenario=deepcopy(prepared.scenario))
    soft.scenario.estimator.foot_give = 0.015
    stance = sit_to_stand(prepared.robot, prepared.stance)[-1]
    answers = []
    for one in (prepared, prepared, soft):
        clock = ManualClock()
        puppet = Puppet(stance, LoopbackBus(clock.now_ns), clock)
        controller = BusController(one, one.scenario.controller)
        for _ in range(100):
            clock.sleep_until(clock.now_ns() + PERIOD_NS)
            controller.take(puppet.state())
        answers.append(controller.wanted().torque)
    assert np.array_equal(answers[0], answers[1])
    assert not np.array_equal(answers[0], answers[2])


def test_the_controllers_time_is_the_robots() -> None:
    """Of states that are no whole number of its periods apart, no time is lost or gained."""
    prepared = short_walk()
    clock = ManualClock()
    puppet = Puppet(sit_to_stand(prepared.robot, prepared.stance)[-1], LoopbackBus(clock.now_ns),
                    clock)  # fmt: skip
    controller = BusController(prepared, prepared.scenario.controller)
    for gap_ms in (5, 5, 5, 3, 7, 1, 1, 1, 2, 5) * 4:
        clock.sleep_until(clock.now_ns() + gap_ms * 1_000_000)
        controller.take(puppet.state())
    passed = 1e-9 * (clock.now_ns() - 1_000_000_000) - 0.005  # since the first state
    assert abs(controller.ticks * 0.002 - 0.002 - passed) <= 0.001 + 1e-9


def wait_for(path: Path, text: str, seconds: float) -> None:
    until = time.monotonic() + seconds
    while text not in path.read_text():
        assert time.monotonic() < until, f"no {text!r} in:\n{path.read_text()}"
        time.sleep(0.01)


@pytest.mark.parametrize(
    "end",
    [
        pytest.param("goal", marks=pytest.mark.long),  # in slow motion, for a machine that is busy
        pytest.param("kill", marks=pytest.mark.slow),  # by the wall clock, which it may not keep
    ],
)
def test_two_processes_over_lcm(tmp_path: Path, end: str) -> None:
    """Over LCM on loopback: it walks to its goal; killed, the robot is damped within 0.1 s."""
    scenario = tmp_path / "walk.yaml"
    scenario.write_text(SHORT_WALK)
    domain = str(100 + os.getpid() % 100)
    places = {name: tmp_path / f"{name}.txt" for name in ("simulate", "control")}
    with places["simulate"].open("w") as sim_out, places["control"].open("w") as control_out:
        rate = "0.25" if end == "goal" else "1.0"
        common = [str(scenario), "--domain", domain, "--out", str(tmp_path), "--rate", rate]
        sim = subprocess.Popen([*COMMAND, "simulate", *common], stderr=sim_out)
        control = subprocess.Popen([*COMMAND, "control", *common], stderr=control_out)
        try:
            if end == "goal":
                assert control.wait(400) == 0, places["control"].read_text()
            else:
                wait_for(places["control"], "walking", 120)
                time.sleep(1.0)
                control.send_signal(signal.SIGKILL)
                killed = time.monotonic_ns()
                wait_for(places["simulate"], "the commander is silent", 10)
        finally:
            control.kill()
            sim.send_signal(signal.SIGINT)
            sim.wait(60)
    told = json.loads((tmp_path / "robot.json").read_text())
    if end == "kill":
        last = told["drives"][-1]
        assert last["drives"] == "damping"
        assert (last["wall_ns"] - killed) * 1e-9 < 0.1
    else:
        ended = json.loads((tmp_path / "control.json").read_text())
        assert ended["outcome"] == "goal_reached" and ended["largest_step"] <= 0.05
        assert "Reached the goal" in (tmp_path / "control.html").read_text()
        walked = [c["base"] for c in told["drives"] if c["mode"] in ("walking", "standing")]
        assert 0.2 < walked[-1][0] - walked[0][0] < 0.4
        went = pq.read_table(tmp_path / "robot.parquet")
        assert went["base_x"][-1].as_py() == pytest.approx(told["end"][0], abs=1e-3)
