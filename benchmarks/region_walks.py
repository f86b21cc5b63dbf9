"""Walks over a slope whose plans keep a margin over the hull, of friction, or of torque limits.

    python -m benchmarks.region_walks

The shipped robot, and one with half the torque in its left hips and knees, walk 3 m over a slope
in physics, under the whole-body controller, on their true state. The table has the least margin of
the kind that is named, planned and measured, and the outcome.
"""

import argparse
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import drake_quad as dq
from benchmarks.common import markdown_table, provenance
from benchmarks.page import ROOT
from drake_quad.stability.margin_kinds import FEASIBLE, FRICTION, HULL

MODEL = ROOT / "models" / "paper_quadruped.urdf"
SHARE = 0.5  # of the torque that is left in the weak robot's left hips and knees
COLUMNS = {HULL: "margin", FRICTION: "margin_friction", FEASIBLE: "margin_feasible"}
SCENARIO = (
    "course=[{kind: floor, length: 2.0}, {kind: slope, going: up, length: 1.5, height: 0.45}, "
    "{kind: floor, length: 2.0}]",
    "mission=[{kind: walk, distance: 3.0}]",
)
# Which robot, the margin that its plan keeps, and the margin that is told.
WALKS = (
    ("shipped", HULL, HULL),
    ("shipped", FRICTION, FRICTION),
    ("shipped", FEASIBLE, FEASIBLE),
    ("weak", HULL, FEASIBLE),
    ("weak", FEASIBLE, FEASIBLE),
)


def weakened(urdf: str, share: float) -> str:
    """A robot's URDF with so much of the torque left in its left hips' pitch and its left knees."""

    def weaker(found: re.Match[str]) -> str:
        return f'{found[1]}{share * float(found[2])}"'

    joint = r'(<joint name="[FR]L_(?:hip_pitch|knee)" type=.*?effort=")([^"]+)"'
    return re.sub(joint, weaker, urdf, flags=re.DOTALL)


def walk(model: str, kept: str) -> dict[str, Any]:
    """The summary of a walk by such a robot, whose plan keeps a margin of that kind."""
    overrides = (*SCENARIO, f"robot.model={model}", f"gait.margin={kept}",
                 "monitor.margins=feasible")  # fmt: skip
    return dq.simulate(dq.load_scenario("case_study", overrides)).summary


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.parse_args(arguments)
    rows = []
    with tempfile.TemporaryDirectory() as directory:
        weak = Path(directory) / "weak.urdf"
        weak.write_text(weakened(MODEL.read_text(encoding="utf-8"), SHARE), encoding="utf-8")
        models = {"shipped": str(MODEL), "weak": str(weak)}
        for robot, kept, told in WALKS:
            found = walk(models[robot], kept)
            planned, measured = (found[COLUMNS[told] + end]["minimum"] for end in ("_planned", ""))
            rows.append([robot, f"`{kept}`", told, f"{planned:.3f} m", f"{measured:.3f} m",
                         found["outcome"]])  # fmt: skip
            print("; ".join(rows[-1]), flush=True)
    columns = ["robot", "`gait.margin`", "of what", "planned", "measured", "outcome"]
    print(markdown_table(columns, rows))
    print(f"\n{provenance()}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
