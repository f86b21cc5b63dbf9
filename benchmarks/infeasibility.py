"""How far the lowest rise that is proven impossible is from the highest one with a plan.

    python -m benchmarks.infeasibility
    python -m benchmarks.infeasibility --plans go1 a1
    python -m benchmarks.infeasibility --columns

For each robot that is installed: the lowest rise for which bisection finds a proof, to 5 mm, on
flights of four steps, with the time of the last search that found one and of the last that did
not. `--plans` looks for the highest rise with a plan too, to 10 mm, with quick searches.
`--columns` asks instead in how many columns of the chart (runs of 0.22 to 0.40 m) a rise of 0.30
m is proven impossible.
"""

import argparse
import time
from collections.abc import Sequence
from typing import Any

from benchmarks.check import STEEPEST
from benchmarks.common import markdown_table, provenance
from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight
from drake_quad.infeasibility.boxes import ClimbClass
from drake_quad.infeasibility.proof import prove_infeasible
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.terrain.elements import Stairs

RUNS = (0.28, 0.30)  # [m]
COLUMNS = tuple(round(0.22 + 0.02 * k, 2) for k in range(10))  # [m]
TOP = 0.30  # [m] highest rise of the chart that is asked for
COUNT = 4
FINE, COARSE = 0.005, 0.01  # [m]


def measure_proofs(robot: RobotModel, run: float) -> dict[str, Any]:
    """The lowest rise with a proof [m], the number of its boxes, and both times [s]."""
    low, high = 0.05, 2.0 * leg_length(robot)
    row: dict[str, Any] = {"rise": None, "boxes": 0, "found": 0.0, "given_up": 0.0}
    while high - low > FINE:
        middle = 0.5 * (low + high)
        begun = time.perf_counter()
        proof = prove_infeasible(robot, ClimbClass(middle, run, COUNT))
        took = time.perf_counter() - begun
        if proof is None:
            low = middle
            row["given_up"] = max(took, row["given_up"])
        else:
            high = middle
            row |= {"rise": middle, "boxes": proof.boxes, "found": max(took, row["found"])}
    return row


def highest_plan(name: str, robot: RobotModel, run: float) -> float | None:
    """The highest rise, to 10 mm, for which a quick search finds a plan; None if none [m]."""
    low, high = 0, round(0.7 * leg_length(robot) / COARSE)
    while high - low > 1:
        middle = (low + high) // 2
        stairs = Stairs(round(middle * COARSE, 3), run, COUNT)
        found = check_flight(name, stairs, nearest=False, thorough=False, robot=robot)
        low, high = (middle, high) if found.feasible else (low, middle)
    return round(low * COARSE, 3) if low else None


def installed(names: Sequence[str]) -> list[tuple[str, RobotModel]]:
    """The robots of these names whose packages are installed."""
    found = []
    for name in names:
        try:
            found.append((name, load_robot(name)))
        except InputError:
            continue
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("robots", nargs="*", metavar="NAME", help="by default all")
    parser.add_argument("--plans", action="store_true", help="look for the highest plans too")
    parser.add_argument("--columns", action="store_true", help="count columns of the chart instead")
    options = parser.parse_args(arguments)
    robots = installed(options.robots or list(STEEPEST))
    if options.columns:
        for name, robot in robots:
            proven = [prove_infeasible(robot, ClimbClass(TOP, r, COUNT)) for r in COLUMNS]
            count = sum(one is not None for one in proven)
            print(f"{name}: {count} of {len(COLUMNS)} columns proven at {TOP:g} m", flush=True)
        return
    rows = []
    for name, robot in robots:
        for run in RUNS:
            proof = measure_proofs(robot, run)
            plan = highest_plan(name, robot, run) if options.plans else None
            known = STEEPEST[name]
            rows.append(
                [
                    name,
                    f"{leg_length(robot):.2f} m",
                    f"{run:g} m",
                    f"{known[0]:g} × {known[1]:g} m" if plan is None else f"{plan:g} m",
                    "-" if proof["rise"] is None else f"{proof['rise']:.3f} m",
                    f"{proof['boxes']}",
                    f"{proof['found']:.1f} s, {proof['given_up']:.1f} s",
                ]
            )
            print(*rows[-1], flush=True)
    header = ("robot", "leg", "run", "climbs", "proven no from", "boxes", "proof, none found")
    print(f"\n{markdown_table(header, rows)}\n\n{provenance()}")


if __name__ == "__main__":
    main()
