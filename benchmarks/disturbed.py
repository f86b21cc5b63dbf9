"""Runs with one disturbance each that the controller is not told of, as a table.

Slippery ground, loads, weak drives, late sensors, an estimated state. Run it from the repository's
top:

    python -m benchmarks.disturbed --workers 2

Results go to a file of JSON lines as they come; `--resume` goes on with it after an interrupt.
"""

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.common import markdown_table, text
from benchmarks.engine import carry_on
from benchmarks.page import check_out, describe, errors_in_a_line, write_section
from benchmarks.study import COMMON, Result, make_trial, study_of
from drake_quad.robot.loader import load_robot
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.trials import Trial, figures_of, repeat, work

IK = "controller.kind=ik"  # at the same period: nothing else is another
FRICTION = 0.3
PAYLOAD = 20.0  # [kg]
PLACES = ((0.35, 0.1), (0.35, -0.1), (-0.35, 0.1), (-0.35, -0.1), (0.0, 0.0))  # x, y in B [m]
PLACE_NAMES = ("front left", "front right", "rear left", "rear right", "middle")
TOP = 0.15  # [m] z in B of the payload's middle
STRENGTH = 0.6
DELAYS = (0.002, 0.004, 0.006, 0.008, 0.010, 0.012, 0.014)  # [s]
SEEDS = range(5)
QUICK = (
    "course=[{kind: floor, length: 3.0}, {kind: stairs, going: up, rise: 0.13, run: 0.5, count: 3},"
    " {kind: landing, length: 2.5}]",
    "mission=[]",
)

HEADER = (
    "disturbance",
    "controller",
    "outcome",
    "smallest margin [m]",
    "base error [mm]",
    "peak torque / limit",
    "slip [mm]",
    "clock waited [s]",
    "samples with non-foot contact",
)

SECTION = """\
## Disturbances

{description}
Each row is a whole run of `{scenario}`{quick} with one disturbance that the controller is not
told of, unless the row says so. *Base error* is the largest distance of the base from where the
controller wants it; *slip* the longest way that a standing foot slid in one stance. Where a row
names no seed, nothing in it is random.

{table}
{failures}"""


def make_cases(joints: Sequence[str]) -> list[tuple[str, tuple[str, ...], bool]]:
    """What the rows are: name, overrides, and whether it tells to run the IK controller too."""
    cases: list[tuple[str, tuple[str, ...], bool]] = [("none", (), True)]
    slippery = f"simulation.friction={FRICTION}"
    cases.append((f"friction {FRICTION}", (slippery,), True))
    told = f"controller.friction={FRICTION}"
    cases.append((f"friction {FRICTION}, the controller told", (slippery, told), False))
    for (x, y), place in zip(PLACES, PLACE_NAMES, strict=True):
        load = f"disturbances.payload={{mass: {PAYLOAD}, x: {x}, y: {y}, z: {TOP}}}"
        cases.append((f"payload of {PAYLOAD:g} kg, {place}", (load,), True))
    for joint in joints:
        weak = f"disturbances.motor_strength=[{{joint: {joint}, factor: {STRENGTH}}}]"
        cases.append((f"{joint} at {100 * STRENGTH:g} %", (weak,), False))
    for delay in DELAYS:
        late = f"disturbances.sensor_delay={delay!r}"
        cases.append((f"sensors {1e3 * delay:g} ms late", (late,), True))
    for seed in SEEDS:
        estimated = ("estimator.kind=ekf", f"simulation.seed={seed}")
        cases.append((f"estimated state, seed {seed}", estimated, False))
    return cases


def make_trials(study: Study, base: Base, *, only: str = "", controller: str = "") -> list[Trial]:
    """The table's runs, in its order.

    Args:
        study: Study that draws all runs.
        base: Its scenario.
        only: Part of the names of the disturbances wanted; all if empty.
        controller: Part of the names of the controllers wanted; all if empty.
    """
    joints = load_robot(base.load(study.set).robot.model).joint_names
    trials: list[Trial] = []
    for name, own, both in make_cases(joints):
        for kind in ("whole_body", "ik") if both else ("whole_body",):
            if only not in name or controller not in kind:
                continue
            more = (*((IK,) if kind == "ik" else ()), *own)
            values, figures = (name, kind), figures_of(study)
            trials.append(make_trial(study, base, len(trials), values, more=more, figures=figures))
    return trials


def row(result: Result) -> list[str]:
    """The table's row of a run."""
    get = result.get
    return [
        result["name"],
        result["controller"],
        result["outcome"],
        text(get("margin"), ".3f"),
        text(get("base_error_max"), ".0f", 1e3),
        text(get("torque_ratio_max"), ".2f"),
        text(get("slip_max"), ".1f", 1e3),
        text(get("clock_waited"), ".2f"),
        text(get("nonfoot_contact_samples"), ".0f"),
    ]


def section(options: argparse.Namespace, results: Sequence[Result]) -> str:
    """The page's section."""
    failed = [result for result in results if result["outcome"] != "goal_reached"]
    items = [f"- {r['name']}, {r['controller']}: {r['reason']}: `{r['command']}`" for r in failed]
    failures = "\nThose that did not reach the goal, with the command that repeats each:\n\n"
    return SECTION.format(
        description=describe(["python -m benchmarks.disturbed", shlex.join(options.words)]),
        scenario=options.scenario,
        quick=" on a short course" if options.quick else "",
        table=markdown_table(HEADER, [row(result) for result in results]),
        failures=failures + "\n".join(items) if items else "",
    )


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenario", default="case_study")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--quick", action="store_true", help="on a short course")
    parser.add_argument("--only", default="", help="disturbances with this in their names")
    parser.add_argument("--controller", default="", help="only this: whole_body or ik")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--recycle", type=int, default=10, help="runs to a process")
    parser.add_argument("--lines", type=Path, default=Path("runs/disturbed.jsonl"), help="records")
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    parser.add_argument("--out", type=Path, help="the Markdown page to write a section of")
    parser.add_argument("--json", type=Path, help="file for the runs")
    options = parser.parse_args(arguments)
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    for name in ("workers", "recycle"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} must be 1 or more")
    return options


def study(options: argparse.Namespace) -> list[Result]:
    """Carries out the runs that are not done: all results, in the table's order."""
    overrides = (*COMMON, *(QUICK if options.quick else ()), *options.set)
    made, base = study_of(options.scenario, overrides)
    trials = make_trials(made, base, only=options.only, controller=options.controller)
    chosen = {"of": "disturbances", "only": options.only, "controller": options.controller}
    names = ["name", "controller"]
    results = carry_on(made, base, trials, work, names=names, chosen=chosen, options=options)
    commands = [repeat(trial) for trial in trials]
    return [{**r, "command": c} for r, c in zip(results, commands, strict=True)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out the study, prints its section and writes what was asked for."""
    options = parse(arguments)
    with errors_in_a_line("disturbed"):
        check_out(options.out, "disturbances")
        results = study(options)
        written = section(options, results)
        if options.out is not None:
            write_section(options.out, "disturbances", written)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({"runs": results}, indent=1) + "\n")
    print(written)


if __name__ == "__main__":
    main()
