"""The whole-body controller's program and tick over a recorded climb.

    python -m benchmarks.whole_body_qp

The case study runs until the robot is up the stairs. In the loop, between the plant's steps, every
tick's program is timed as the controller solves it, and in a run of its own every tick of the
controller, dynamics and all. Asked: of the program median and 99th percentile at most 0.15 and
0.5 ms, of the tick a median of at most 0.5 ms.

Then the very same programs, one after the other, through DAQP and other solvers. There the rows
that may give way may not: DAQP alone knows of such. Programs whose solution needs them to are left
out, and counted. Each solver starts anew with every program, as the controller's does.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any
from unittest.mock import patch

import numpy as np
import piqp

from benchmarks.common import Stopwatch, markdown_table, provenance, stopwatch
from benchmarks.stair_climbs import make_whole
from drake_quad.common import FloatArray
from drake_quad.control.whole_body_qp import Program, solve
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.systems import tracking_controller
from drake_quad.systems.tracking_controller import TrackingController

ASKED = {"program": (0.15e-3, 0.5e-3), "tick": (0.5e-3, None)}  # [s] median, 99th percentile
COMMON = ("controller.kind=whole_body", "controller.period=0.002")
CLIMB = (28.0, 50.0)  # [s] of the case study: from before the first step until after the last
AGREE = 1e-2  # [N] within which forces are the same
NONE = 1e20  # a bound beyond it is none

Solver = Callable[[Program], FloatArray | None]


def run(
    scenario: str, overrides: Sequence[str], *, begin: float, end: float, programs: list[Program]
) -> tuple[Stopwatch, Stopwatch]:
    """Simulates to `end` [s]; from `begin` on keeps the programs, and times what it can.

    Returns:
        Times of the programs, and of the ticks in a run of its own: stopwatches take time too.
    """
    prepared = prepare(load_scenario(scenario, (*COMMON, *overrides)))
    watches = []
    for owner, name in (
        (tracking_controller, "solve"),
        (TrackingController, "_update"),
    ):
        with stopwatch(owner, name) as watch:  # before the diagram keeps the bound methods
            _, simulator = make_whole(prepared)
            simulator.Initialize()
            simulator.AdvanceTo(begin)
            watch.seconds.clear()
            simulator.AdvanceTo(end)
        watches.append(watch)
    with patch.object(tracking_controller, "solve", _keeping(programs)):
        _, simulator = make_whole(prepared)
        simulator.AdvanceTo(begin)
        programs.clear()
        simulator.AdvanceTo(end)
    return watches[0], watches[1]


def _keeping(programs: list[Program]) -> Solver:
    def keep(program: Program) -> FloatArray | None:
        programs.append(program)
        return solve(program)

    return keep


def hardened(program: Program) -> Program:
    """The same without rows that may give way."""
    return program._replace(sense=np.zeros_like(program.sense))


def with_piqp(program: Program) -> FloatArray | None:
    """The solution by PIQP, None if it finds none."""
    n = len(program.g)
    lower = np.where(program.lower < -NONE, -np.inf, program.lower)
    upper = np.where(program.upper > NONE, np.inf, program.upper)
    solver = piqp.DenseSolver()
    solver.setup(program.H, program.g, None, None, program.A, lower[n:], upper[n:], lower[:n],
                 upper[:n])  # fmt: skip
    status = solver.solve()
    return np.array(solver.result.x) if status == piqp.PIQP_SOLVED else None


def with_proxsuite(program: Program) -> FloatArray | None:
    """The solution by ProxQP, None if it finds none."""
    from proxsuite import proxqp  # not everybody has it

    n, m = len(program.g), len(program.A)
    lower = np.clip(program.lower, -NONE, NONE)
    upper = np.clip(program.upper, -NONE, NONE)
    solver = proxqp.dense.QP(n, 0, m, True)
    solver.settings.eps_abs = 1e-6
    solver.init(program.H, program.g, None, None, program.A, lower[n:], upper[n:], lower[:n],
                upper[:n])  # fmt: skip
    solver.solve()
    solved = solver.results.info.status == proxqp.QPSolverOutput.PROXQP_SOLVED
    return np.array(solver.results.x) if solved else None


def solvers() -> dict[str, Solver]:
    """By name, DAQP first; those that are there."""
    found: dict[str, Solver] = {"daqp": solve, "piqp": with_piqp}
    if find_spec("proxsuite") is not None:
        found["proxsuite"] = with_proxsuite
    return found


def compare(programs: Sequence[Program]) -> dict[str, Any]:
    """Each solver's times on the same programs [s], how many it solves, and how far off it is [N].

    Returns:
        By solver; and how many programs were left out.
    """
    kept = []
    for program in programs:
        soft, hard = solve(program), solve(hardened(program))
        if soft is not None and hard is not None and np.max(np.abs(soft - hard)) < AGREE:
            kept.append((hardened(program), hard))
    result: dict[str, Any] = {"left_out": len(programs) - len(kept), "solvers": {}}
    for name, solver in solvers().items():
        seconds, far, solved = [], 0.0, 0
        for program, expected in kept:
            begun = time.perf_counter()
            found = solver(program)
            seconds.append(time.perf_counter() - begun)
            if found is not None:
                solved += 1
                far = max(far, float(np.max(np.abs(found - expected))))
        result["solvers"][name] = {
            "programs": len(kept),
            "solved": solved,
            "difference": far,
            **quantiles(seconds),
        }
    return result


def quantiles(seconds: Sequence[float]) -> dict[str, float]:
    """Median and 99th percentile [s]."""
    if not len(seconds):
        return {"median": float("nan"), "p99": float("nan")}
    return {"median": float(np.median(seconds)), "p99": float(np.percentile(seconds, 99.0))}


def measure(
    scenario: str, overrides: Sequence[str] = (), *, begin: float, end: float, most: int
) -> dict[str, Any]:
    """All figures.

    Args:
        scenario: Its name.
        overrides: Overrides as on the command line.
        begin: Time from which it is timed [s].
        end: Time until which it is timed [s].
        most: Largest number of programs that all solvers solve, evenly chosen.
    """
    programs: list[Program] = []
    program_watch, tick_watch = run(scenario, overrides, begin=begin, end=end, programs=programs)
    every = max(1, -(-len(programs) // most))
    return {
        "scenario": scenario,
        "ticks": len(tick_watch.seconds),
        "program": quantiles(program_watch.seconds),
        "tick": quantiles(tick_watch.seconds),
        "feet": {n: sum(len(p.g) == 3 * n for p in programs) for n in range(5)},
        **compare(programs[::every]),
        "asked": ASKED,
    }


def show(result: dict[str, Any]) -> str:
    """The figures as Markdown."""

    def micro(seconds: float | None) -> str:
        return "-" if seconds is None else f"{1e6 * seconds:.0f} µs"

    names = {"program": "the program, as solved", "tick": "the controller's whole tick"}
    loop = [
        [names[key], *(micro(result[key][q]) for q in ("median", "p99")), *map(micro, ASKED[key])]
        for key in names
    ]
    rows = [
        [
            name,
            f"{s['solved']} of {s['programs']}",
            micro(s["median"]),
            micro(s["p99"]),
            f"{s['difference']:.1e} N",
        ]
        for name, s in result["solvers"].items()
    ]
    return "\n".join(
        [
            f"### `{result['scenario']}`, {result['ticks']} ticks",
            "",
            markdown_table(("in the loop", "median", "99 %", "median asked", "99 % asked"), loop),
            "",
            markdown_table(("one after the other", "solved", "median", "99 %", "off"), rows),
            "",
            f"{result['left_out']} programs are left out, in which soft rows give way.",
            "",
        ]
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenario", default="case_study")
    parser.add_argument("--begin", type=float, default=CLIMB[0], help="[s]")
    parser.add_argument("--end", type=float, default=CLIMB[1], help="[s]")
    parser.add_argument("--most", type=int, default=4000, help="programs through all solvers")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    result = measure(
        options.scenario, options.set, begin=options.begin, end=options.end, most=options.most
    )
    peers = ("daqp", *(("proxsuite",) if "proxsuite" in result["solvers"] else ()))
    print(json.dumps(result) if options.json else f"{show(result)}\n{provenance(*peers)}")


if __name__ == "__main__":
    main()
