"""The push budget against pushes in the simulation: how much of what it says do stances take?

    python -m benchmarks.push_budget --trials 200 --lines runs/push_budget.jsonl

Each trial stands the robot on four feet, its feet and its body somewhere, on level ground or on
stairs, and pushes it through its centre of mass, somewhere to. Catching steps are switched off.
It is pushed by 90 % of its budget; then, of the first `--sought` trials, the push that topples it
is sought by halving. `ratio` is predicted over actual: 1 is exact, less is on the safe side. What
counts as survived, and as toppled, `push_stances` says. A stance that the controller does not hold
unpushed, with fewer than three feet on the ground as the push begins, has no budget: it is counted
apart. How far a foot slid or hopped is told
beside.
Each trial has a generator of its own, so that they can be run in pieces: with `--lines` those
that are in the file already are not run again.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.common import markdown_table, provenance
from benchmarks.push_stances import LEAST, SCENARIO, End, Trial, draw, push_in
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario

SHARE = 0.9  # of the budget that no push may topple by
HALVINGS = 5
CONFIDENCE = 0.95


class Bench:
    """The robot on its course."""

    def __init__(self, kind: str, seed: int) -> None:
        overrides = [f"controller.kind={kind}"]
        self._scenario = parse_scenario(SCENARIO, source="push_budget", overrides=overrides)
        self._robot = load_robot(self._scenario.robot.model)
        self._course = course_of(self._scenario, foot_radius=self._robot.foot_radius)
        self._seed = seed

    def trial(self, index: int) -> Trial:
        """A trial by its number."""
        random = np.random.default_rng([self._seed, index])
        return draw(random, self._robot, self._course, self._scenario.simulation.friction)

    def push(self, trial: Trial, share: float) -> End:
        """How a push by such a share of its budget ends."""
        v = share * trial.budget
        return push_in(self._scenario, self._robot, self._course, trial, v)

    def measure(self, index: int, *, sought: bool) -> dict[str, Any]:
        """What a trial's budget is, whether 90 % of it was survived, and what would not be."""
        trial = self.trial(index)
        end = self.push(trial, SHARE)
        row = {
            "trial": index,
            "on_stairs": trial.on_stairs,
            "direction": float(np.degrees(np.arctan2(trial.way[1], trial.way[0]))),
            "budget": trial.budget,
            "pendulums": trial.pendulums,
            "stood": end.stood,
            "toppled": end.toppled,
            "feet": end.feet,
            "survived": end.survived,
            "slid": end.slid,
        }
        if sought:
            low, high = (SHARE, 2.0) if end.survived else (0.0, SHARE)
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                holds = self.push(trial, middle).survived
                low, high = (middle, high) if holds else (low, middle)
            row["ratio"] = 2.0 / (low + high)
        return row


def read_lines(path: Path | None) -> dict[int, dict[str, Any]]:
    """The trials of a file, by their number."""
    if path is None or not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {row["trial"]: row for row in rows}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """By ground: how many toppled under 90 %, with exact bounds, and predicted over actual."""
    found = []
    for name, mine in (
        ("level", [r for r in rows if not r["on_stairs"]]),
        ("stairs", [r for r in rows if r["on_stairs"]]),
        ("all", list(rows)),
    ):
        if not mine:
            continue
        fallen = sum(not r["stood"] for r in mine)
        mine = [r for r in mine if r["stood"]]
        if not mine:
            found.append([name, str(fallen), "0", *[""] * 5])
            continue
        toppled = sum(r["toppled"] for r in mine)
        lost = sum(not r["survived"] for r in mine)
        most = binomtest(toppled, len(mine)).proportion_ci(CONFIDENCE, method="exact").high
        ratios = [r["ratio"] for r in mine if "ratio" in r]
        told = ["", ""]
        if ratios:
            told = [f"{np.median(ratios):.2f}", f"{min(ratios):.2f} to {max(ratios):.2f}"]
        found.append(
            [name, str(fallen), str(len(mine)), str(toppled), f"{100 * most:.1f} %", str(lost),
             str(len(ratios)), *told]
        )  # fmt: skip
    header = ("ground", "not held unpushed", "pushed", "toppled at 90 %", "at most (95 %)",
              "not survived", "sought", "median predicted / actual", "range")  # fmt: skip
    return markdown_table(header, found)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument(
        "--sought", type=int, default=10, help="of them, to be pushed till they fall"
    )
    parser.add_argument("--kind", default="ik", choices=("ik", "whole_body"), help="of controller")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--lines", type=Path, help="file to go on with, a line a trial")
    options = parser.parse_args(arguments)
    bench = Bench(options.kind, options.seed)
    known = read_lines(options.lines)
    for index in range(options.trials):
        sought = index < options.sought
        if index in known and not (sought and "ratio" not in known[index]):
            continue
        known[index] = row = bench.measure(index, sought=sought)
        print(json.dumps(row), flush=True)
        if options.lines is not None:
            options.lines.parent.mkdir(parents=True, exist_ok=True)
            with options.lines.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(row) + "\n")
    print(table([known[k] for k in sorted(known) if k < options.trials]))
    print(f"\ncontroller {options.kind}; {provenance()}")


__all__ = ["LEAST", "SCENARIO", "Bench", "draw", "main", "read_lines", "table"]

if __name__ == "__main__":
    main()
