"""Writes the table of docs/robots.md: what each robot does, planned and in physics.

Every robot is given by its name alone, on level ground (it stands, walks 2 m, turns by 90 degrees)
and on the stairs named. Run it from the repository's top:

    python scripts/robots_table.py --out docs/robots.md

It takes two to ten minutes a robot. Rows are kept as they come; `--resume` goes on with them.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from drake_quad.errors import DrakeQuadError
from drake_quad.feasibility.check import check_flight
from drake_quad.gait_design.candidates import hip_length
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.robot.loader import load_robot
from drake_quad.robot.model import leg_length
from drake_quad.runs.result import RunResult
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.run import simulate
from drake_quad.terrain.elements import Stairs

ROBOTS = (
    "anymal_c", "anymal_b", "spot", "b1", "b2", "a2", "go1", "go2", "a1", "aliengo", "laikago",
    "solo12", "mini_cheetah", "hyqreal1", "hyq",
)  # fmt: skip
STAIRS = ((0.178, 0.28), (0.12, 0.30), (0.10, 0.30))
COUNT = 4
BEGIN, END = "<!-- begin robots -->", "<!-- end robots -->"
LEVEL = """
robot: {{model: '{name}'}}
course: [{{kind: floor, length: {length:.1f}, width: {width:.1f}}}]
start: {{distance: {start:.2f}}}
mission:
  - {{kind: stand, duration: 1.0}}
  - {{kind: walk, distance: 2.0}}
  - {{kind: spin, angle_deg: 90.0}}
  - {{kind: stand, duration: 1.0}}
"""


def level_run(name: str) -> str:
    """Stands, walks 2 m and turns by 90 degrees in physics: the outcome and smallest margin."""
    robot = load_robot(name)
    size = hip_length(robot) + leg_length(robot)
    text = LEVEL.format(name=name, length=2.0 + 3.0 * size, width=3.0 * size, start=1.2 * size)
    return _told(simulate(parse_scenario(text, source=name)))


def stairs_run(name: str, rise: float, run_: float, *, physics: bool) -> str:
    """A flight up, a turn and down again: planned, and in physics if asked for."""
    stairs, preference = Stairs(rise, run_, COUNT), GaitPreference.asked()
    check = check_flight(name, stairs, preference=preference, nearest=False)
    if check.designed is None:
        return "no plan"
    planned = f"planned {check.designed.margin:.3f} m at {check.speed:.3f} m/s"
    if not physics:
        return planned
    return f"{planned}; {_told(simulate(check.designed.scenario, source=name))}"


def _told(result: RunResult) -> str:
    margin = result.summary["margin"]["minimum"]
    touched = result.summary["nonfoot_contact_samples"]
    words = f"{result.outcome}, {margin:.3f} m"
    return words + (f", {touched} samples with contacts of other parts" if touched else "")


def row(name: str, *, physics: bool) -> list[str]:
    """The table's row of a robot."""
    try:
        robot = load_robot(name)
        cells = [name, f"{robot.mass:.1f}", f"{leg_length(robot):.2f}", level_run(name)]
    except DrakeQuadError as error:
        return [name, "", "", str(error).replace("|", "/"), *[""] * len(STAIRS)]
    for rise, run_ in STAIRS:
        try:
            cells.append(stairs_run(name, rise, run_, physics=physics))
        except DrakeQuadError as error:
            cells.append(str(error).replace("|", "/"))
    return cells


def table(rows: Sequence[Sequence[str]]) -> str:
    """Markdown."""
    header = ["robot", "mass [kg]", "leg [m]", "level ground, in physics"]
    header += [f"{COUNT} steps of {rise:g} × {run_:g} m" for rise, run_ in STAIRS]
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Makes the rows one by one, and writes the table when all are there."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--no-physics", action="store_true", help="plan stairs only")
    parser.add_argument("--lines", type=Path, default=Path("runs/robots.jsonl"), help="rows")
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    parser.add_argument("--out", type=Path, help="page between whose markers the table goes")
    options = parser.parse_args(arguments)
    options.lines.parent.mkdir(parents=True, exist_ok=True)
    if not options.resume:
        options.lines.write_text("", encoding="utf-8")
    known = [json.loads(line) for line in options.lines.read_text(encoding="utf-8").splitlines()]
    rows = {cells[0]: cells for cells in known}
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("robots", total=len(options.robots))
        for name in options.robots:
            if name not in rows:
                rows[name] = row(name, physics=not options.no_physics)
                with options.lines.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps(rows[name]) + "\n")
                progress.console.print(" | ".join(rows[name]))
            progress.advance(task)
    text = table([rows[name] for name in options.robots])
    if options.out is None:
        print(text)
        return
    page = options.out.read_text(encoding="utf-8")
    head, _, rest = page.partition(BEGIN)
    _, _, tail = rest.partition(END)
    if not tail:
        sys.exit(f"scripts/robots_table.py: {options.out}: no {BEGIN} and {END} in it")
    planned = " --no-physics" if options.no_physics else ""
    command = f"python scripts/robots_table.py{planned} --out docs/robots.md"
    body = f"{BEGIN}\n```sh\n{command}\n```\n\n{text}\n{END}"
    options.out.write_text(head + body + tail, encoding="utf-8")


if __name__ == "__main__":
    main()
