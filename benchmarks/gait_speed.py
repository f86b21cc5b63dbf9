"""How fast robots climb with gaits whose times are chosen, and how much margin that leaves.

    python -m benchmarks.gait_speed
    python -m benchmarks.gait_speed --robots paper_quadruped go2 --physics balanced

Every robot is given by its name, on four steps, up, a turn and down. Its gait is found for margin
as `drake-quad check` finds it, and then made quick, once to keep 0.8 of that margin (`balanced`)
and once to be safe (`speed`). Speeds are of the body on the slower flight. Rows are kept as they
come; `--resume` goes on with them.
"""

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.common import markdown_table, provenance
from drake_quad.errors import DrakeQuadError
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.gait_design.quicken import find_quicker
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import leg_length
from drake_quad.runs.summary_lines import LEAST_TOUCH
from drake_quad.scenario.load import save_scenario
from drake_quad.scenario.motion_config import PREFER
from drake_quad.simulation.run import simulate
from drake_quad.terrain.elements import Stairs

COUNT = 4
# What each climbs: the steepest of the three flights of docs/robots.md that it has a plan for.
FLIGHTS = {
    "paper_quadruped": (0.178, 0.28),
    "anymal_c": (0.178, 0.28),
    "anymal_b": (0.12, 0.30),
    "spot": (0.178, 0.28),
    "b1": (0.178, 0.28),
    "b2": (0.178, 0.28),
    "a2": (0.178, 0.28),
    "go1": (0.12, 0.30),
    "go2": (0.12, 0.30),
    "a1": (0.12, 0.30),
    "aliengo": (0.178, 0.28),
    "laikago": (0.178, 0.28),
    "solo12": (0.12, 0.30),
    "mini_cheetah": (0.12, 0.30),
    "hyqreal1": (0.12, 0.30),
    "hyq": (0.178, 0.28),
}
PAPER_SPEED, PAPER_LEG = 0.125, 1.22  # [m/s], [m] of the paper's robot
Row = dict[str, Any]


def measured(answer: Feasibility) -> Row:
    """Speed, time and margins of an answer's plan, and its nearest limit."""
    pace, bound = answer.pace, answer.bound
    assert pace is not None and bound is not None and answer.designed is not None
    proven = answer.certificate
    assert proven is not None
    return {
        "speed": answer.speed,
        "time": answer.flight_time,
        "duration": answer.designed.plan.duration,
        "margin": answer.margin,
        "zmp_margin": pace.zmp_margin,
        "joint_share": None if pace.peak is None else pace.peak.share,
        "bound": bound.words,
        "certified": proven.failure is None,
        "not_certified": "" if proven.failure is None else proven.failure.reason,
        "proven": proven.least,
    }


def in_physics(answer: Feasibility, source: str) -> Row:
    """How a run of the answer's scenario ends, its least margin, and what touches besides."""
    summary = simulate(answer.scenario, source=source).summary
    return {
        "outcome": summary["outcome"],
        "margin": summary["margin"]["minimum"],
        "touched": summary["nonfoot_contact_samples"],
        "under_three_feet": summary["time_under_three_feet"],
        "swing_force": summary["swing_force_max"],
        "safe": summary["safety"]["safe"],
        "tracking": summary["tracking"],
    }


def measure_robot(
    name: str, rise: float, run: float, *, physics: Sequence[str], save: Path | None
) -> Row:
    """One robot on its flight, with each of the gaits of PREFER; some of them in physics."""
    robot = load_robot(name)
    begun = time.process_time()
    slow = check_flight(name, Stairs(rise, run, COUNT), nearest=False, robot=robot)
    row: Row = {
        "robot": name,
        "rise": rise,
        "run": run,
        "paper_speed": PAPER_SPEED * (leg_length(robot) / PAPER_LEG) ** 0.5,
        "search_time": time.process_time() - begun,
    }
    if slow.designed is None:
        return row | {"reason": slow.reason}
    for prefer in PREFER:
        begun = time.process_time()
        preference = GaitPreference(prefer)
        found = find_quicker(slow.designed, robot, preference)
        answer = Feasibility(
            found.scenario, found, "", {}, robot, preference=preference, slow=slow.designed
        )  # fmt: skip
        row[prefer] = measured(answer) | {"search_time": time.process_time() - begun}
        if save is not None:
            save_scenario(found.scenario, save / f"{name}_{prefer}.yaml")
        if prefer in physics:
            row[prefer]["physics"] = in_physics(answer, name)
    return row


def _cell(found: Row | None) -> str:
    """Speed, and the margin planned and measured."""
    if found is None:
        return "no plan"
    ran = found.get("physics")
    words = f"{found['speed']:.3f} m/s, {1e3 * found['margin']:.0f} mm"
    words += "" if found["certified"] else ", not certified"
    if ran is None:
        return words
    touched = f", {ran['touched']} samples with contacts" if ran["touched"] else ""
    if (ran.get("swing_force") or 0.0) >= LEAST_TOUCH:
        touched += f", a swing foot touches with {ran['swing_force']:.0f} N"
    return f"{words}; {ran['outcome']}, {1e3 * ran['margin']:.0f} mm{touched}"


def speed_table(rows: Sequence[Row]) -> str:
    """The rows as Markdown: speed and planned margin; where it was run, outcome and measured."""
    header = ("robot", "4 steps of", "the paper's, scaled", *PREFER, "nearest limit, balanced")
    return markdown_table(
        header,
        [
            [
                row["robot"],
                f"{row['rise']:g} × {row['run']:g} m",
                f"{row['paper_speed']:.3f} m/s",
                *(_cell(row.get(prefer)) for prefer in PREFER),
                row["balanced"]["bound"] if "balanced" in row else row.get("reason", ""),
            ]
            for row in rows
        ],
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures robot by robot, and prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--robots", nargs="+", default=list(FLIGHTS), choices=list(FLIGHTS))
    parser.add_argument("--physics", nargs="*", default=[], choices=PREFER, help="what is run")
    parser.add_argument("--save", type=Path, help="directory to write the scenarios into")
    parser.add_argument("--lines", type=Path, default=Path("runs/gait_speed.jsonl"), help="rows")
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    options = parser.parse_args(arguments)
    for folder in (options.lines.parent, *([options.save] if options.save else [])):
        folder.mkdir(parents=True, exist_ok=True)
    if not options.resume:
        options.lines.write_text("", encoding="utf-8")
    known = [json.loads(line) for line in options.lines.read_text(encoding="utf-8").splitlines()]
    rows = {row["robot"]: row for row in known}
    for name in options.robots:
        if name in rows:
            continue
        rise, run = FLIGHTS[name]
        try:
            rows[name] = measure_robot(
                name, rise, run, physics=options.physics, save=options.save
            )  # fmt: skip
        except DrakeQuadError as error:
            rows[name] = {"robot": name, "rise": rise, "run": run, "paper_speed": float("nan"),
                          "reason": str(error)}  # fmt: skip
        with options.lines.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(rows[name]) + "\n")
    print(speed_table([rows[name] for name in options.robots]))
    print(f"\n{provenance()}")


if __name__ == "__main__":
    main()
