"""Touchdowns felt by the joints' torques, beside those that were, on logged runs.

    python -m benchmarks.joint_contacts runs/case_study

The runs' logs are read (log them at 2 ms: `--set simulation.log_period=0.002`), their torques and
states given to the momentum observer of `drake_quad.estimation.contact_from_torques`, and the
touchdowns that it feels compared with those of the contact results (1 % of the weight on a foot).
`--noise` adds white noise to the torques, in shares of each joint's limit. Asked:
missed at most 0.1 %, false at most 0.5 %, median delay at most 20 ms.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.estimation.contact_from_torques import (
    DriveGains,
    TouchMemory,
    TouchSettings,
    compare_touchdowns,
    observe,
)
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.systems.joint_contact_estimator import TorqueDynamics


def measure(
    run: RecordedRun, settings: TouchSettings, *, noise: float, seed: int
) -> dict[str, Any]:
    """The figures of one run.

    Args:
        run: With its torques and its bearing feet.
        settings: The observer's.
        noise: Deviation of the torques' noise, in shares of each joint's limit.
        seed: Seed of that noise.
    """
    robot, layout, log = run.robot, run.layout, run.log
    model = MakeModelPlant(robot.url)
    # The log's torques are those after a command, at the beginning of a tooth: no mean is sought.
    gains = DriveGains(kp=0.0, kd=0.0, period=0.002)
    scratch = model.CreateDefaultContext()
    dynamics = TorqueDynamics(robot, layout, model, gains=gains)
    states = np.hstack([run.positions, run.velocities])
    torque = log.numbers([f"tau_{name}" for name in robot.joint_names])
    torque = torque + noise * robot.effort * np.random.default_rng(seed).normal(size=torque.shape)
    real = log.numbers([f"{leg}_bearing" for leg in ("FL", "FR", "RL", "RR")]) > 0.5
    period = float(np.median(np.diff(log.t)))
    memory, before = np.zeros(TouchMemory.SIZE), np.zeros(dynamics.memory_shape)
    felt = np.zeros_like(real)
    for k in range(len(log.t)):
        now, before = dynamics.calc(scratch, before, states[k], torque[k], period)
        observe(memory, now, robot.mass, period, settings)
        felt[k] = memory[TouchMemory.BEARING] > 0.5
    found = compare_touchdowns(log.t, real, felt)
    delays = 1e3 * np.array(found.delays or (np.nan,))
    return {
        "run": run.name,
        "robot": robot.name,
        "log_period_ms": round(1e3 * period, 3),
        "torque_noise": noise,
        "touchdowns": found.touchdowns,
        "missed": found.missed,
        "false": found.false,
        "delay_median_ms": round(float(np.median(delays)), 2),
        "delay_p95_ms": round(float(np.percentile(delays, 95)), 2),
        "agrees": round(float(np.mean(real == felt)), 5),
    }


def main() -> None:
    """Prints a line of JSON for each run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    for directory in given.runs:
        print(json.dumps(measure(load_run(directory), TouchSettings(), noise=given.noise,
                                 seed=given.seed)))  # fmt: skip


if __name__ == "__main__":
    main()
