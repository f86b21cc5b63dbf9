"""The controller over a bus with the robot's side in MuJoCo, in lock step.

    python -m benchmarks.bus_mujoco --walk 2.0 --seeds 3

All that passes between the two are the messages of `drake_quad.bus`, through their bytes, of LCM or
of Unitree's; the robot begins on folded legs, damped; the sensors' noise is real sensors', by the
seed. A tick of one side follows a tick of the other, so that nothing depends on the machine.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.mujoco_model import STEP
from benchmarks.mujoco_robot import MujocoRobot
from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.joint_map import joint_map
from drake_quad.bus.messages import DRIVES_DAMP, DRIVES_FOLLOW, CommandMessage, StateMessage
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.processes import FIELDS
from drake_quad.bus.real_time import NS, ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import DriveGuard
from drake_quad.bus.unitree_messages import decode_low_state, encode_low_state
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.scenario.build import sensor_errors
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare

COURSES = {
    "level": "  - {{kind: floor, length: {length}, width: 2.0}}\n",
    "stairs": "  - {{kind: floor, length: 2.5, width: 2.0}}\n"
    "  - {{kind: stairs, going: up, rise: 0.10, run: 0.50, count: 4, width: 2.0}}\n"
    "  - {{kind: landing, length: 2.5}}\n",
}


class MujocoSide:
    """MuJoCo's robot as far as its drives and its sensors, real sensors' noise on them."""

    def __init__(self, prepared: PreparedScenario) -> None:
        self._control = prepared.scenario.controller
        model = MakeModelPlant(prepared.robot.url)
        self.robot = MujocoRobot(
            prepared.robot, model, prepared.course, self._control,
            lowest_stance(prepared.robot, prepared.stance),
        )  # fmt: skip
        errors = sensor_errors(prepared.scenario)
        assert errors is not None
        self._rng = errors.imu_generator
        self._imu, self._joints = errors.imu, errors.joints
        self._bias = 1e-3 * self._rng.normal(size=3), 0.02 * self._rng.normal(size=3)

    def advance(self, drives: int, command: CommandMessage | None) -> None:
        """Goes on by a period; the drives' law is τ + k (q_d - q) + d (v_d - v)."""
        c, robot = self._control, self.robot
        for _ in range(round(c.period / STEP)):
            now = robot.joint_state_measured()
            q, v = now[:12], now[12:]
            if drives == DRIVES_DAMP or command is None:
                ctrl = q + STEP * v  # MuJoCo's own drives damp by kd
            else:
                told = command.velocity if drives == DRIVES_FOLLOW else np.zeros(12)
                k, d = command.stiffness / c.kp, command.damping / c.kd
                ctrl = q + k * (command.position - q)
                ctrl += (command.effort + c.kd * (d * told + (1.0 - d) * v)) / c.kp
            robot.data.ctrl[:] = ctrl
            robot.step()

    def sense(self, sequence: int, drives: int) -> StateMessage:
        """What it senses now: MuJoCo's values, with white noise and biases."""
        robot, rng = self.robot, self._rng
        imu = robot.imu_measured()
        joints = robot.joint_state_measured()
        return StateMessage(
            1, sequence, round(robot.time * NS), drives,
            joints[:12] + 1e-4 * rng.normal(size=12), joints[12:] + 5e-3 * rng.normal(size=12),
            np.array(robot.data.actuator_force),
            imu[:3] + self._bias[0] + 2e-3 * rng.normal(size=3),
            imu[3:] + self._bias[1] + 2e-2 * rng.normal(size=3), robot.contacts.force,
        )  # fmt: skip


def through_unitree(state: StateMessage, prepared: PreparedScenario) -> StateMessage:
    """The state as it comes out of a LowState, numbered as on our own bus."""
    joints = joint_map(prepared.robot)
    come = decode_low_state(encode_low_state(state, joints), 0, joints)
    assert come.message is not None and not come.fault
    return come.message


def run(text: str, seed: int, contacts: str, *, unitree: bool, limit: float) -> dict[str, Any]:
    """One run, from damped to damped."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.yaml"
        path.write_text(text)
        fields = [*FIELDS, f"simulation.seed={seed}", f"sensors.contacts={contacts}"]
        prepared = prepare(load_scenario(str(path), fields))
    clock = ManualClock()
    bus = LoopbackBus(clock.now_ns)
    side, guard = MujocoSide(prepared), DriveGuard()
    loop = ControlLoop(prepared, bus, clock)
    period_ns, sequence = round(loop.period * NS), 0
    places: list[list[float]] = []
    while not loop.outcome and loop.time < limit:
        drives = guard.judge(bus, clock.now_ns())
        side.advance(drives, guard.command)
        sequence += 1
        state = side.sense(sequence, drives)
        bus.publish_state(through_unitree(state, prepared) if unitree else state)
        loop.tick()
        if len(loop.events) > len(places):
            places.append(np.array(side.robot.data.qpos[:3]).round(3).tolist())
        clock.sleep_until(clock.now_ns() + period_ns)
    return {
        "seed": seed,
        "contacts": contacts,
        "messages": "unitree" if unitree else "lcm",
        "outcome": loop.outcome or f"not at the goal after {limit:g} s",
        "trunk": places,
        "seconds": round(loop.time, 1),
        "largest_step": round(loop.largest_step, 4),
        "events": [f"{e.time:.1f} {e.mode} {e.reason}".strip() for e in loop.events],
    }


def main() -> None:
    """Prints a line of JSON a run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--walk", type=float, default=2.0)
    parser.add_argument("--course", choices=sorted(COURSES), default="level")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--contacts", choices=("feet", "joints"), default="joints")
    parser.add_argument("--unitree", action="store_true")
    parser.add_argument("--limit", type=float, default=240.0)
    given = parser.parse_args()
    text = (
        "description: A walk over a bus\ncourse:\n"
        + COURSES[given.course].format(length=given.walk + 2.5)
        + "start: {distance: 1.0}\nmission:\n  - {kind: stand, duration: 0.5}\n"
        + f"  - {{kind: walk, distance: {given.walk}}}\n"
    )
    for seed in range(given.first, given.first + given.seeds):
        found = run(text, seed, given.contacts, unitree=given.unitree, limit=given.limit)
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
