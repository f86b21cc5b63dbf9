"""What becomes of a robot that is damped in its walk: how far it tilts, and how fast it sinks.

    python -m benchmarks.bus_damping --moments 8
    python -m benchmarks.bus_damping --moments 8 --sit

The controller and Drake's robot in lock step, over a bus in one process: nothing depends on the
machine. The shipped robot walks on level ground. At moments spread over the walk a person presses
Ctrl-C: the drives damp, without stiffness, whatever foot is in the air. With `--sit` the robot sits
down first.
"""

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.processes import FIELDS
from drake_quad.bus.real_time import NS, ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import RobotLoop, SimulatedRobot
from drake_quad.bus.safety import SafetyMode
from drake_quad.math.rotations import quaternion_matrix
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare

WALK = """
description: A level walk
course:
  - {kind: floor, length: 10.0, width: 10.0}
start: {distance: 4.0}
mission:
  - {kind: walk, distance: 0.8}
"""
AFTER = 5.0  # [s] for which it is looked at
PERIOD_NS = NS // 500


def damp(prepared: PreparedScenario, moment: float, *, sit: bool) -> dict[str, float | str]:
    """One walk that is stopped so many seconds after its begin: damped, or made to sit down."""
    clock = ManualClock()
    bus = LoopbackBus(clock.now_ns)
    side = SimulatedRobot(prepared)
    robot, loop = RobotLoop(side, bus, clock), ControlLoop(prepared, bus, clock)
    loop.limits = replace(loop.limits, fold_time=0.6, rise_time=1.0)
    walked, heights, tilts, steps = 0, list[float](), list[float](), list[float]()
    before = None
    while len(heights) < AFTER * 500:
        robot.tick()
        loop.tick()
        clock.sleep_until(clock.now_ns() + PERIOD_NS)
        walked += loop.mode == SafetyMode.WALKING
        if walked < moment * 500 or loop.newest is None:
            assert not loop.outcome, loop.outcome
            continue
        loop.stop("interrupted", sit=sit)
        R_WB = quaternion_matrix(np.asarray(side.truth()["pose"])[3:])
        heights.append(float(side.base[2]))
        tilts.append(float(np.degrees(np.arccos(np.clip(R_WB[2, 2], -1.0, 1.0)))))
        joints = loop.newest.position
        steps.append(0.0 if before is None else float(np.abs(joints - before).max()))
        before = joints
    return {
        "moment": moment,
        "greatest_tilt_deg": round(max(tilts), 1),
        "tilt_at_the_end_deg": round(tilts[-1], 1),
        "sinks_at_most": round(-float(np.diff(heights).min()) * 500, 2),
        "largest_joint_step": round(max(steps), 4),
    }


def main() -> None:
    """Prints a line for each moment."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--moments", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=10.0, help="of the walk, over which")
    parser.add_argument("--sit", action="store_true", help="as with `control --soft-stop`")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.yaml"
        path.write_text(WALK)
        prepared = prepare(load_scenario(str(path), [*FIELDS, "sensors.contacts=feet"]))
    for moment in np.linspace(0.5, given.seconds, given.moments):
        print(json.dumps(damp(prepared, round(float(moment), 2), sit=given.sit)), flush=True)


if __name__ == "__main__":
    main()
