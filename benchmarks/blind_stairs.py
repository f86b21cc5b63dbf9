"""Stairs that are not as the map has them: a whole run for each of many seeds.

The seed draws by how much the real course differs from the map that the controller plans on. Run
it from the repository's top:

    python -m benchmarks.blind_stairs --seeds 100 --workers 2

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
from benchmarks.study import GOOD, Result, make_trial, study_of, with_common
from drake_quad.scenario.config import Scenario
from drake_quad.sweep.statistics import rate_of
from drake_quad.sweep.trials import figures_of, work

OUTCOMES = ("goal_reached", "fell", "stopped", "refused")
SPREADS = (
    ("smallest margin [m]", "margin", ".3f", 1.0),
    ("clock waited [s]", "clock_waited", ".2f", 1.0),
    ("base error [mm]", "base_error_max", ".0f", 1e3),
    ("longest slip [mm]", "slip_max", ".1f", 1e3),
    ("peak torque / limit", "torque_ratio_max", ".2f", 1.0),
    ("samples with non-foot contact", "nonfoot_contact_samples", ".0f", 1.0),
)

SECTION = """\
## Blind stairs

{description}
Whole runs of `{scenario}`, seeds {first} to {last}. The seed draws, evenly, by how much the world
differs from the map: {errors}.
The controller is told the map. A run is *refused* where no such course can be built, or the robot
cannot begin on it; it counts against the rate.

{table}

Of the runs to the goal, the figures in their order:

{spreads}

In {touching} of {runs} runs something else than a foot touched the course.

{failures}"""


def section(options: argparse.Namespace, scenario: Scenario, results: Sequence[Result]) -> str:
    """The page's section."""
    # What ended otherwise, as one that took too long, is stopped; its reason is among the failures.
    outcomes = [r["outcome"] if r["outcome"] in OUTCOMES else "stopped" for r in results]
    rate = rate_of(outcomes.count("goal_reached"), len(results)).text()
    row = [*(str(outcomes.count(outcome)) for outcome in OUTCOMES), rate]
    header = ("runs", *OUTCOMES, "goal_reached, with exact bounds at 95 %")
    return SECTION.format(
        description=describe(["python -m benchmarks.blind_stairs", shlex.join(options.words)]),
        scenario=options.scenario,
        first=options.first,
        last=options.first + options.seeds - 1,
        errors=_errors(scenario),
        table=markdown_table(header, [[str(len(results)), *row]]),
        spreads=_spreads([result for result in results if result["outcome"] == "goal_reached"]),
        touching=sum(bool(result.get("nonfoot_contact_samples")) for result in results),
        runs=len(results),
        failures=_failures(options, results),
    )


def _errors(scenario: Scenario) -> str:
    """The scenario's errors of the world, in words."""
    world = scenario.world
    sign = "up to ±" if world.random else ""
    parts = (
        ("all rises", sign, 1e3 * world.rise_error, " mm"),
        ("all runs", sign, 1e3 * world.run_error, " mm"),
        ("the place of each flight", sign, 1e3 * world.position_error, " mm"),
        ("the direction of each flight about its middle", sign, world.yaw_error_deg, "°"),
        ("the height of each tread besides", "up to ±", 1e3 * world.tread_error, " mm"),
    )
    told = [f"{what} by {how}{value:g}{unit}" for what, how, value, unit in parts if value]
    return ", ".join(told) or "by nothing"


def _spreads(results: Sequence[Result]) -> str:
    rows = []
    for title, key, form, scale in SPREADS:
        values = sorted(result[key] for result in results if result[key] is not None)
        n = len(values)
        ranks = (values[0], values[n // 2], values[-1]) if n else (None, None, None)
        rows.append([title, *(text(value, form, scale) for value in ranks)])
    return markdown_table(("", "least", "median", "greatest"), rows)


def _failures(options: argparse.Namespace, results: Sequence[Result]) -> str:
    """Those that did not reach the goal, each with the command that repeats it."""
    failed = [result for result in results if result["outcome"] not in GOOD]
    if not failed:
        return "No run failed."
    items = [
        f"- {r['outcome']}: {r['reason']}: `{repeat(options.scenario, options.overrides, r)}`"
        for r in failed
    ]
    return "Those that failed, with the command that repeats each:\n\n" + "\n".join(items)


def repeat(scenario: str, overrides: Sequence[str], trial: Result) -> str:
    """The command that repeats a trial."""
    words = ["drake-quad", "run", scenario, "--seed", str(trial["seed"])]
    for override in overrides:
        words += ["--set", override]
    return shlex.join(words)


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenario", default="blind_errors")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--seeds", type=int, default=100, help="how many")
    parser.add_argument("--first", type=int, default=0, help="seed")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--recycle", type=int, default=10, help="runs to a process")
    parser.add_argument(
        "--lines", type=Path, default=Path("runs/blind_stairs.jsonl"), help="records"
    )
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    parser.add_argument("--out", type=Path, help="the Markdown page to write a section of")
    parser.add_argument("--json", type=Path, help="file for the rate and the runs")
    options = parser.parse_args(arguments)
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    for name in ("seeds", "workers", "recycle"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} must be 1 or more")
    if options.first < 0:
        parser.error("--first must not be negative")
    return options


def study(options: argparse.Namespace) -> tuple[Scenario, list[Result]]:
    """Carries out the runs that are not done: the scenario, and all results."""
    options.overrides = with_common(options.scenario, options.set)
    made, base = study_of(options.scenario, options.overrides)
    figures = figures_of(made)
    trials = [
        make_trial(
            made, base, seed, [seed], more=[f"simulation.seed={seed}"], figures=figures, seed=seed
        )
        for seed in range(options.first, options.first + options.seeds)
    ]
    chosen = {"of": "blind stairs", "first": options.first, "seeds": options.seeds}
    results = carry_on(made, base, trials, work, names=["seed"], chosen=chosen, options=options)
    return base.load(made.set), results


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out the study, prints its section and writes what was asked for."""
    options = parse(arguments)
    with errors_in_a_line("blind_stairs"):
        check_out(options.out, "blind stairs")
        scenario, results = study(options)
        written = section(options, scenario, results)
        if options.out is not None:
            write_section(options.out, "blind stairs", written)
    if options.json is not None:
        rate = rate_of(sum(result["outcome"] in GOOD for result in results), len(results))
        told = {"runs": len(results), "ok": rate.good, "low": rate.low, "high": rate.high}
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({"rate": told, "runs": results}, indent=1) + "\n")
    print(written)


if __name__ == "__main__":
    main()
