"""A controller and a simulated robot as two processes on a bus, by the wall clock: stairs.

    python -m benchmarks.bus_pair go2.xml --mjcf go2.xml --bus unitree --seeds 10
    python -m benchmarks.bus_pair go2 --bus lcm --seeds 10

The robot stands up, walks 2.5 m, climbs the flight, walks over the landing, comes down and sits
down. Its side is MuJoCo with the file of `--mjcf`, or else Drake. The state is estimated, and the
feet are felt by the joints. Nothing else should run on the machine, which has a share in how well
time is kept: the first lines have it for a loop that does nothing, and for one that only spins.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.bus_mjcf import add_course_options, course_text
from drake_quad.bus.drift import allow_for_drift
from drake_quad.bus.processes import each_period, load_for_bus
from drake_quad.bus.real_time import NS, LoopTimes, WallClock, real_time
from drake_quad.scenario.load import save_scenario

LIMIT = 900.0  # [s] of the wall clock, after which a run is given up
LEAVE = 60.0  # [s] that the robot's process has for its end
PERIOD, BARE = 0.002, 20.0  # [s] of the loop that does nothing, and how long it is measured
SPINS = (0.0, 0.5, 0.9)  # of its period, for which it is busy all the same
COMMAND = (sys.executable, "-m", "drake_quad")


def designed(given: argparse.Namespace, place: Path) -> Path:
    """The scenario with its gait, as `control` would design it, so that it is done once."""
    path, filled = place / "asked.yaml", place / "walk.yaml"
    path.write_text(course_text(given))
    scenario = load_for_bus(str(path), given.set)
    save_scenario(allow_for_drift(scenario, given.set, source=str(path)), filled)
    return filled


def run(scenario: Path, seed: int, given: argparse.Namespace) -> dict[str, Any]:
    """One run, from damped to damped."""
    place = scenario.parent / str(seed)
    place.mkdir(exist_ok=True)
    # A domain of its own: what a killed process may have left cannot be heard.
    fields = [f"simulation.seed={seed}", *given.set]
    common = [str(scenario), "--bus", given.bus, "--domain", str(given.domain + seed), "--out",
              str(place), *(f"--set={field}" for field in fields)]  # fmt: skip
    side = ["--mjcf", str(given.mjcf.resolve())] if given.mjcf else []
    faults = ["--loss", str(given.loss), "--delay", str(given.delay), "--jitter",
              str(given.jitter), "--fault-seed", str(seed)]  # fmt: skip
    with (place / "robot.txt").open("w") as says, (place / "control.txt").open("w") as words:
        robot = subprocess.Popen(
            [*COMMAND, "simulate", *common, *side, *faults, "--fifo"],
            stdout=subprocess.DEVNULL,
            stderr=says,
        )
        try:
            kept = ["--record", str(place / "bus.mcap")] if given.keep else []
            busy = ["--busy-wait"] if given.busy_wait else []
            controller = subprocess.run(
                [*COMMAND, "control", *common, "--contacts", given.contacts, *kept, *busy],
                stdout=subprocess.DEVNULL, stderr=words, timeout=LIMIT, check=False,
            )  # fmt: skip
            failed = "" if controller.returncode in (0, 1) else f"exit {controller.returncode}"
        except subprocess.TimeoutExpired:
            failed = f"not at the goal after {LIMIT:g} s"
        robot.send_signal(signal.SIGINT)
        robot.wait(LEAVE)
    if failed:
        return {"seed": seed, "outcome": failed, "said": (place / "control.txt").read_text()[-400:]}
    control = json.loads((place / "control.json").read_text())
    other = json.loads((place / "robot.json").read_text())
    kept, paced = control["real_time"], other["real_time"]
    return {
        "seed": seed,
        "outcome": control["outcome"],
        "seconds": round(control["events"][-1]["time"], 1),
        "real_time_factor": round(other["real_time_factor"], 4),
        "end": [round(x, 3) for x in other["end"]],
        "overrun_share": kept["overrun_share"],
        "jitter_ms": kept["jitter_ms"],
        "state_age_ms": kept["state_age_ms"],
        "longest_ticks": kept["longest_ticks"],
        "work_ms": kept["work_ms"],
        "robot_overrun_share": paced["overrun_share"],
        "robot_work_ms": paced["work_ms"],
        "robot_longest_ticks": paced["longest_ticks"],
        "time_stolen": kept["time_stolen"],
        "time_given_up": [kept["time_given_up"], paced["time_given_up"]],
        "states_lost": control["states_lost"],
        "ticks_held": control["ticks_held"],
        "largest_step": round(control["largest_step"], 4),
    }


def bare_loop(period: float, seconds: float, spin: float) -> dict[str, Any]:
    """How late ticks of a loop are that does nothing, with the same clock and priority.

    Args:
        period: Of the loop [s].
        seconds: How long it goes on.
        spin: Share of the period for which a tick reads the clock again and again.
    """
    clock, times, left = WallClock(), LoopTimes(period), round(seconds / period)
    busy_ns = round(spin * period * NS)

    def tick() -> bool:
        nonlocal left
        now = begun = clock.now_ns()
        while now < begun + busy_ns:
            now = clock.now_ns()
        times.note(begun, now, -1)
        left -= 1
        return left > 0

    with real_time() as given:
        each_period(clock, period, tick)
    figures = times.figures()
    names = ("overrun_share", "time_stolen", "jitter_ms", "longest_ticks")
    return {**given, "spin": spin, **{name: figures[name] for name in names}}


def main() -> None:
    """Prints a line of JSON for the machine's own loop, and one a run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("robot", help="the controller's robot: a name, or a file")
    parser.add_argument("--mjcf", type=Path, help="the robot's side is MuJoCo with this file")
    parser.add_argument("--bus", choices=("unitree", "lcm"), default="unitree")
    parser.add_argument("--domain", type=int, default=70, help="of seed 0")
    add_course_options(parser)
    parser.add_argument("--busy-wait", action="store_true", help="as of `control`")
    parser.add_argument(
        "--keep",
        type=Path,
        help="folder for files and messages of the runs",
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = given.keep or Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        scenario = designed(given, place)
        for spin in SPINS:
            print(json.dumps({"bare_loop": bare_loop(PERIOD, BARE, spin)}), flush=True)
        for seed in range(given.first, given.first + given.seeds):
            print(json.dumps(run(scenario, seed, given)), flush=True)


if __name__ == "__main__":
    main()
