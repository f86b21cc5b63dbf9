"""How long `drake-quad check` takes for one staircase, warm, and `drake-quad chart` for many.

    python -m benchmarks.check
    python -m benchmarks.check --chart
    python -m benchmarks.check --robots

Asked: a check at most 1 s, and 100 cells of a chart at most 60 s on two cores. `--robots` measures
the command itself, in a process of its own, for robots by name: a yes on the steepest flight that
the documents say one climbs, of ten steps, and a no.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.common import markdown_table, provenance
from drake_quad.errors import InputError
from drake_quad.feasibility.chart import Span, chart_grid
from drake_quad.feasibility.check import check_flight
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import leg_length
from drake_quad.terrain.elements import Stairs

ROBOT = "package://drake_quad_models/paper_quadruped.urdf"
STAIRS = (Stairs(0.178, 0.28), Stairs(0.15, 0.35), Stairs(0.2, 0.3, 4), Stairs(0.1, 0.45, 4))
RISES, RUNS = Span(0.025, 0.25, 0.025), Span(0.25, 0.52, 0.03)  # 10 by 10

TEN = 10  # steps
# Rise and run [m] of each robot's steepest flight: of `studies/ten_steps.yaml`, and of the table of
# docs/robots.md for robots that are not in that study.
STEEPEST = {
    "paper_quadruped": (0.178, 0.28),
    "anymal_b": (0.12, 0.30),
    "anymal_c": (0.178, 0.28),
    "spot": (0.178, 0.28),
    "b1": (0.178, 0.28),
    "b2": (0.178, 0.28),
    "a2": (0.178, 0.28),
    "go1": (0.15, 0.30),
    "go2": (0.12, 0.30),
    "a1": (0.12, 0.30),
    "aliengo": (0.178, 0.28),
    "laikago": (0.178, 0.28),
    "solo12": (0.10, 0.28),
    "mini_cheetah": (0.12, 0.30),
    "hyqreal1": (0.12, 0.30),
    "hyq": (0.178, 0.28),
}
TOO_HIGH = 0.7  # of a leg: a rise that no robot here climbs
# Asked of a fresh process: at most, and in the median of all robots; a no; a check when warm [s].
MOST, MEDIAN, NO, WARM_MEDIAN = 5.0, 2.0, 3.0, 1.0


def measure_checks(model: str, stairs: Sequence[Stairs], *, repeats: int) -> list[dict[str, Any]]:
    """One row a staircase: medians of wall and processor time [s], after one that warms up."""
    rows = []
    check_flight(model, replace(stairs[0], count=1))
    for flight in stairs:
        wall, processor = [], []
        for _ in range(repeats):
            begun, used = time.perf_counter(), time.process_time()
            check = check_flight(model, flight, preference=GaitPreference.asked())
            wall.append(time.perf_counter() - begun)
            processor.append(time.process_time() - used)
        rows.append(
            {
                **flight.fields(),
                "feasible": check.feasible,
                "wall": float(np.median(wall)),
                "processor": float(np.median(processor)),
            }
        )
    return rows


def measure_fresh(model: str, stairs: Stairs) -> dict[str, Any]:
    """Answer, wall and processor time [s] of `drake-quad check` in a process of its own."""
    flight = [f"--{name}={value}" for name, value in stairs.fields().items()]
    command = [sys.executable, "-m", "drake_quad", "check", model, *flight, "--no-nearest"]
    begun, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = subprocess.run(command, check=False, capture_output=True, text=True)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if answer.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(command)}: {answer.stderr}")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"feasible": answer.returncode == 0, "wall": wall, "processor": used}


def measure_robot(name: str) -> dict[str, Any] | None:
    """A robot's figures on its flight of STEEPEST and on a rise that is too high; None without it.

    The check in this process comes first: it leaves robot and kernels on disk for the others.
    """
    try:
        robot = load_robot(name)
    except InputError:  # its package is not installed
        return None
    rise, run = STEEPEST[name]
    flight, high = Stairs(rise, run, TEN), Stairs(round(TOO_HIGH * leg_length(robot), 2), run, TEN)
    (warm,) = measure_checks(name, [flight], repeats=1)
    yes, no = measure_fresh(name, flight), measure_fresh(name, high)
    row = {"robot": name, **flight.fields(), "too_high": high.rise}
    return {**row, "warm": warm, "yes": yes, "no": no}


def robots_table(rows: Sequence[dict[str, Any]]) -> str:
    """A Markdown table of rows of `measure_robot`, with their medians and what is asked."""
    header = ("robot", "rise × run", "answer", "fresh", "processor time", "warm", "a no", "rise")
    kinds = ("yes", "no", "warm")
    lines = [
        [
            row["robot"],
            f"{row['rise']:g} × {row['run']:g} m",
            "yes" if row["yes"]["feasible"] else "no",
            f"{row['yes']['wall']:.1f} s",
            f"{row['yes']['processor']:.1f} s",
            f"{row['warm']['wall']:.1f} s",
            ("not a no: " if row["no"]["feasible"] else "") + f"{row['no']['wall']:.1f} s",
            f"{row['too_high']:g} m",
        ]
        for row in rows
    ]
    walls = {kind: [row[kind]["wall"] for row in rows] for kind in kinds}
    for name, figure in (("median", np.median), ("most", np.max)):
        yes, no, again = (f"{figure(walls[k]):.1f} s" if rows else "-" for k in kinds)
        lines.append([name, "", "", yes, "", again, no, ""])
    asked = f"median {MEDIAN:g} s, most {MOST:g} s"
    lines.append(["asked", "", "yes", asked, "", f"median {WARM_MEDIAN:g} s", f"most {NO:g} s", ""])
    return markdown_table(header, lines)


def measure_chart(model: str, rises: Span, runs: Span, *, workers: int) -> dict[str, Any]:
    """Wall time [s] of a chart, its processes' start included."""
    begun = time.perf_counter()
    cells = chart_grid(model, rises, runs, count=4, workers=workers).cells
    wall = time.perf_counter() - begun
    works = sum(cell.margin is not None for cell in cells)
    return {"cells": len(cells), "feasible": works, "workers": workers, "wall": wall}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--robot", default=ROBOT)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--chart", action="store_true", help="time a chart of 100 cells too")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--robots", nargs="*", metavar="NAME", choices=list(STEEPEST),
        help="time fresh processes for these robots, or all that are installed, instead",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    if options.robots is not None:
        measured = [measure_robot(name) for name in options.robots or STEEPEST]
        robots = [row for row in measured if row is not None]
        print(json.dumps({"robots": robots}) if options.json else robots_table(robots))
        if not options.json:
            print(f"\n{provenance()}")
        return
    checks = measure_checks(options.robot, STAIRS, repeats=options.repeats)
    chart = None
    if options.chart:
        chart = measure_chart(options.robot, RISES, RUNS, workers=options.workers)
    if options.json:
        print(json.dumps({"checks": checks, "chart": chart}))
        return
    header = ("rise × run", "steps", "answer", "time", "processor time")
    rows = [
        [
            f"{row['rise']:g} × {row['run']:g} m",
            str(row["count"]),
            "yes" if row["feasible"] else "no",
            f"{row['wall']:.2f} s",
            f"{row['processor']:.2f} s",
        ]
        for row in checks
    ]
    print(markdown_table(header, rows))
    if chart is not None:
        print(
            f"\nchart: {chart['cells']} cells in {chart['wall']:.0f} s on {chart['workers']} "
            f"processes, {chart['feasible']} of them feasible"
        )
    print(f"\n{provenance()}")


if __name__ == "__main__":
    main()
