"""How long `drake-quad check` takes for one staircase, warm, and `drake-quad chart` for many.

    python -m benchmarks.check
    python -m benchmarks.check --chart

Asked: a check at most 1 s, and 100 cells of a chart at most 60 s on two cores.
"""

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from benchmarks.common import markdown_table, provenance
from drake_quad.feasibility.chart import Span, chart_grid
from drake_quad.feasibility.check import check_flight
from drake_quad.terrain.elements import Stairs

ROBOT = "package://drake_quad_models/paper_quadruped.urdf"
STAIRS = (Stairs(0.178, 0.28), Stairs(0.15, 0.35), Stairs(0.2, 0.3, 4), Stairs(0.1, 0.45, 4))
RISES, RUNS = Span(0.025, 0.25, 0.025), Span(0.25, 0.52, 0.03)  # 10 by 10


def measure_checks(model: str, stairs: Sequence[Stairs], *, repeats: int) -> list[dict[str, Any]]:
    """One row a staircase: medians of wall and processor time [s], after one that warms up."""
    rows = []
    check_flight(model, replace(stairs[0], count=1))
    for flight in stairs:
        wall, processor = [], []
        for _ in range(repeats):
            begun, used = time.perf_counter(), time.process_time()
            check = check_flight(model, flight)
            wall.append(time.perf_counter() - begun)
            processor.append(time.process_time() - used)
        rows.append(
            {
                **asdict(flight),
                "feasible": check.feasible,
                "wall": float(np.median(wall)),
                "processor": float(np.median(processor)),
            }
        )
    return rows


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
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
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
