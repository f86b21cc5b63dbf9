"""Kills the controller's process at random moments, and measures when the robot's drives damp.

    python -m benchmarks.bus_kills --count 20

A simulated robot and a controller on LCM's loopback, by the wall clock, anew each time; the
controller is killed by SIGKILL at a moment drawn between arming and some seconds of walking. Asked:
the drives damp within 100 ms of their last command, each time.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SCENARIO = """
description: A short level walk, to be killed in
course:
  - {kind: floor, length: 8.0, width: 2.0}
start: {distance: 1.0}
mission:
  - {kind: stand, duration: 0.2}
  - {kind: walk, distance: 5.0}
"""
LATEST = 9.0  # [s] after arming: standing up takes 3.5 s, standing 1 s


def _wait(path: Path, text: str, seconds: float) -> None:
    until = time.monotonic() + seconds
    while text not in path.read_text():
        if time.monotonic() > until:
            raise SystemExit(f"no {text!r} in {seconds} s:\n{path.read_text()}")
        time.sleep(0.005)


def measure(count: int, seed: int, domain: int) -> dict[str, object]:
    """The delays from SIGKILL to damping, and the modes that were killed in."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        scenario = place / "walk.yaml"
        scenario.write_text(SCENARIO)
        common = [str(scenario), "--domain", str(domain), "--out", folder]
        command = [sys.executable, "-m", "drake_quad"]
        delays, modes = [], []
        for k in range(count):
            robot_says, says = place / f"robot{k}.txt", place / f"control{k}.txt"
            with robot_says.open("w") as out, says.open("w") as words:
                robot = subprocess.Popen(
                    [*command, "simulate", *common], stdout=subprocess.DEVNULL, stderr=out
                )
                controller = subprocess.Popen(
                    [*command, "control", *common], stdout=subprocess.DEVNULL, stderr=words
                )
                _wait(says, "standing up", 120.0)
                time.sleep(float(rng.uniform(0.0, LATEST)))
                controller.send_signal(signal.SIGKILL)
                killed = time.monotonic_ns()
                controller.wait()
                time.sleep(1.0)
                robot.send_signal(signal.SIGINT)
                robot.wait(60)
            changes = json.loads((place / "robot.json").read_text())["drives"]
            last = changes[-1]
            delays.append(round((last["wall_ns"] - killed) * 1e-6, 1))
            modes.append(last["mode"] if last["drives"] == "damping" else "not damped")
    return {"kills": count, "delay_ms": delays, "modes": modes}


def main() -> None:
    """Prints the figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--domain", type=int, default=61)
    given = parser.parse_args()
    print(json.dumps(measure(given.count, given.seed, given.domain)))


if __name__ == "__main__":
    main()
