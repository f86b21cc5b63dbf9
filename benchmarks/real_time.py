"""The whole simulation against the bare plant on the same trajectory, side by side.

    python -m benchmarks.real_time

The whole is what `drake-quad run` simulates: plant, controller, planner, monitors and logs, without
a viewer; `:everything` after a scenario's name adds the whole-body controller at 500 Hz and the
sensors and filter that it estimates its state with, whatever the scenario has. The bare plant is
the same robot on the same course with the same joint gains, driven by the commands that the
controller gave in a run recorded before, out of a trajectory source and a zero-order hold; no
Python, no log. Both step to the bit the same states, which is checked.

The two take turns, a second of simulated time each, and what counts is the median over all turns
of the ratio of their times: a busy machine slows both. Asked: ratio at most 2, and the whole at
least 3 times real time (where the bare plant leaves room for that: see its own factor).
"""

import argparse
import json
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.common import Stopwatch, markdown_table, provenance, stopwatch
from benchmarks.stair_climbs import Pair, make_pair, record
from drake_quad.common import FloatArray
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.systems.contact_monitor import ContactMonitor
from drake_quad.systems.gait_scheduler import GaitScheduler
from drake_quad.systems.sensors import Imu, JointSensor
from drake_quad.systems.stability_monitor import StabilityMonitor
from drake_quad.systems.state_estimator import StateEstimator
from drake_quad.systems.tracking_controller import TrackingController
from drake_quad.systems.transition_planner import TransitionPlanner
from drake_quad.util.collector import frozen_objects

ASKED_RATIO, ASKED_FACTOR = 2.0, 3.0
TURN = 1.0  # [s] simulated in a turn
DEFAULTS = ["flat_walk", "case_study", "case_study:everything"]
LABELS = {
    "wall": "wall time, median turn",
    "cpu": "processor time, median turn",
    "total": "wall time of all turns, planning included",
}
EVERYTHING = ("controller.kind=whole_body", "controller.period=0.002", "estimator.kind=ekf")
SYSTEMS = (
    TrackingController,  # of either kind
    GaitScheduler,
    TransitionPlanner,
    StateEstimator,
    Imu,
    JointSensor,
    ContactMonitor,
    StabilityMonitor,
)


@dataclass(frozen=True, eq=False)
class Turns:
    """What the turns took.

    Attributes:
        wall: (n, 2) wall time of the whole and of the bare plant in each turn [s].
        cpu: (n, 2) processor time of the same [s], which waiting for a busy machine leaves out.
        difference: The largest difference of their states at the ends of turns.
        turn: Simulated in each turn [s].
    """

    wall: FloatArray
    cpu: FloatArray
    difference: float
    turn: float

    def figures(self) -> dict[str, dict[str, float]]:
        """Real-time factors of both, and the ratio of their times.

        `wall` and `cpu` are medians over the turns; `total` is of all wall time together, and so
        with the planning at each task's beginning, which most turns have none of.
        """
        total = self.wall.sum(axis=0, keepdims=True)
        whole_turns = {
            "wall": (self.wall, self.turn),
            "cpu": (self.cpu, self.turn),
            "total": (total, self.turn * len(self.wall)),
        }
        return {
            name: {
                "whole": float(simulated / np.median(seconds[:, 0])),
                "bare": float(simulated / np.median(seconds[:, 1])),
                "ratio": float(np.median(seconds[:, 0] / seconds[:, 1])),
            }
            for name, (seconds, simulated) in whole_turns.items()
        }


def take_turns(pair: Pair, *, duration: float, turn: float = TURN) -> Turns:
    """Advances both to `duration` [s], a turn each; who goes first alternates.

    Starting up (the planning of the first task included) is not in the turns' times.
    """
    simulators = (pair.whole, pair.bare)
    for simulator in simulators:
        simulator.Initialize()
    count = round(duration / turn)
    wall, cpu = np.zeros((count, 2)), np.zeros((count, 2))
    difference = 0.0
    with frozen_objects():  # as in `drake-quad run`
        for k in range(count):
            for which in (0, 1) if k % 2 == 0 else (1, 0):
                begun = time.perf_counter(), time.process_time()
                simulators[which].AdvanceTo((k + 1) * turn)
                wall[k, which] = time.perf_counter() - begun[0]
                cpu[k, which] = time.process_time() - begun[1]
            difference = max(difference, pair.state_difference())
    return Turns(wall, cpu, difference, turn)


def time_ticks(scenario: str, overrides: Sequence[str], *, duration: float) -> dict[str, Any]:
    """What a tick of every Python system takes, in a run of its own: stopwatches take time too.

    A tick is the system's update with all that it evaluates on its inputs, without Drake's call
    into Python.
    """
    prepared = prepare(load_scenario(scenario, overrides))
    watches: dict[str, Stopwatch] = {}
    with ExitStack() as stack:
        for system in SYSTEMS:  # before the diagram is built, which keeps the bound methods
            watches[system.__name__] = stack.enter_context(stopwatch(system, "_update"))
        _, wall = record(prepared, duration=duration)
    return {
        "wall": wall,
        "systems": {
            name: {"ticks": len(w.seconds), "median": w.median, "total": w.total}
            for name, w in watches.items()
            if w.seconds  # the others are not in this diagram
        },
    }


def measure(
    name: str, overrides: Sequence[str] = (), *, duration: float, repeats: int
) -> dict[str, Any]:
    """All figures of one scenario, which `:everything` may follow."""
    scenario, _, more = name.partition(":")
    overrides = (*(EVERYTHING if more else ()), *overrides)
    prepared = prepare(load_scenario(scenario, overrides))
    commands, _ = record(prepared, duration=duration)
    duration = min(duration, commands.duration)
    turn = min(TURN, duration)
    rounds = [
        take_turns(make_pair(prepared, commands), duration=duration, turn=turn)
        for _ in range(repeats)
    ]
    together = Turns(
        np.concatenate([r.wall for r in rounds]),
        np.concatenate([r.cpu for r in rounds]),
        max(r.difference for r in rounds),
        turn,
    )
    return {
        "scenario": name,
        "duration": duration,
        "repeats": repeats,
        "state_difference": together.difference,
        **together.figures(),
        "ratio_of_each_repeat": [r.figures()["wall"]["ratio"] for r in rounds],
        "ticks": time_ticks(scenario, overrides, duration=duration),
        "asked": {"ratio": ASKED_RATIO, "whole_factor": ASKED_FACTOR},
    }


def show(result: dict[str, Any]) -> str:
    """The figures as Markdown."""
    ratios = ", ".join(f"{r:.2f}" for r in result["ratio_of_each_repeat"])
    lines = [
        f"### `{result['scenario']}`, {result['duration']:.0f} s, {result['repeats']} repeats",
        "",
        markdown_table(
            ("real-time factor", "whole", "bare plant", "ratio of times"),
            [
                [label, *(f"{result[key][column]:.2f}" for column in ("whole", "bare", "ratio"))]
                for key, label in LABELS.items()
            ],
        ),
        "",
        f"Asked: whole ≥ {ASKED_FACTOR:g}, ratio ≤ {ASKED_RATIO:g}. Each repeat: {ratios}. "
        f"Largest difference between the two states: {result['state_difference']:.1e}.",
        "",
        markdown_table(
            ("system", "ticks", "median tick", "of the whole's wall time"),
            [
                [
                    name,
                    str(w["ticks"]),
                    f"{1e6 * w['median']:.0f} µs",
                    f"{100 * w['total'] / result['ticks']['wall']:.1f} %",
                ]
                for name, w in result["ticks"]["systems"].items()
            ],
        ),
        "",
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenarios", nargs="+", default=DEFAULTS)
    parser.add_argument("--durations", nargs="+", type=float, default=[24.0, 60.0, 60.0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    if len(options.durations) != len(options.scenarios):
        parser.error("--durations needs one number a scenario")
    for name in options.scenarios:
        if name.partition(":")[2] not in ("", "everything"):
            parser.error(f"{name}: nothing but `:everything` may follow a scenario's name")
    results = []
    for name, duration in zip(options.scenarios, options.durations, strict=True):
        results.append(measure(name, options.set, duration=duration, repeats=options.repeats))
        if not options.json:
            print(show(results[-1]), flush=True)
    print(json.dumps({"scenarios": results}) if options.json else provenance())


if __name__ == "__main__":
    main()
