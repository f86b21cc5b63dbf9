"""Kicks at many moments of a run, from all sides: how often the robot is back in its gait.

A kick is a horizontal force at the trunk's origin for 0.1 s. Its impulse is the robot's mass times
the speed given. Run it from the repository's top:

    python -m benchmarks.pushes --scenario case_study --speed 0.3 --moments 40 --workers 2

Results go to a file of JSON lines as they come; `--resume` goes on with it after an interrupt.
"""

import argparse
import json
import shlex
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.common import markdown_table
from benchmarks.engine import carry_on
from benchmarks.page import check_out, describe, errors_in_a_line, write_section
from benchmarks.push_curve import draw_curve
from benchmarks.push_moments import make_pushes, moments
from benchmarks.push_trials import BACK, FIGURES, PATIENCE, VALUES, prepare_undisturbed, work
from benchmarks.study import GOOD, Result, make_trial, study_of, with_common
from drake_quad.sweep.statistics import rate_of

HEADER = ("speed [m/s]", "trials", "ok", "fell", "stopped", "ok, with bounds at 95 %")
LISTED = 40  # failures on the page; all are among the lines

SECTION = """\
## Pushes

{description}
Kicks of 0.1 s, horizontal, at the trunk's origin, of an impulse of the robot's mass times the
speed given: `{scenario}` at {moments} moments spread over all segments of the run, from
{directions} directions each, relative to the heading. Each trial is a copy of one undisturbed run
with a push of its own. It is *ok* if {tail:g} s after the push (at most {patience:g} s more) the
gait clock runs again and the base is within {back:g} m of where the controller wants it. Of these
trials {far} went on to the end of the run instead: {reached} of them reached the goal.

The bounds are Clopper and Pearson's, exact for independent trials. The moments and directions are
a grid and not drawn, and pushes at one moment have much in common: read them as no more than that.
There is nothing random in a trial, so there are no seeds.

{tables}

{failures}"""


def section(options: argparse.Namespace, results: Sequence[Result]) -> str:
    """The page's section."""
    far = [result for result in results if result["to_goal"]]
    return SECTION.format(
        description=describe(["python -m benchmarks.pushes", shlex.join(options.words)]),
        scenario=options.scenario,
        moments=len({result["time"] for result in results}),
        directions=options.directions,
        tail=options.tail,
        patience=PATIENCE,
        back=BACK,
        far=len(far),
        reached=sum(result["outcome"] == "goal_reached" for result in far),
        tables="\n\n".join(_tables(results)),
        failures=_failures(options, results),
    )


def _tables(results: Sequence[Result]) -> list[str]:
    """By speed with bounds, then by what else there is: how many were ok of how many."""
    rows = []
    for speed in _speeds(results):
        outcomes = [result["outcome"] for result in results if result["speed"] == speed]
        rate = rate_of(sum(outcome in GOOD for outcome in outcomes), len(outcomes))
        fell = outcomes.count("fell")
        # Others, as those that took too long, are stopped; their reasons are among the failures.
        counts = (rate.trials, rate.good, fell, rate.trials - rate.good - fell)
        rows.append([f"{speed:g}", *map(str, counts), rate.text()])
    return [
        markdown_table(HEADER, rows),
        "How many were ok, of how many:",
        _table("segment, ground", results, _stretch),
        _table("leg in the air", results, lambda result: result["leg"] or "none"),
        _table("direction [°], left positive", results, lambda r: f"{r['direction_deg']:g}"),
    ]


def _speeds(results: Sequence[Result]) -> list[float]:
    return sorted({result["speed"] for result in results})


def _stretch(result: Result) -> str:
    if result["segment"] is None:
        return "not known"
    return f"{result['segment']}, {result['ground']}"


def _table(title: str, results: Sequence[Result], key: Callable[[Result], str]) -> str:
    """Those that were ok, grouped by `key` in the order of the trials, a column a speed."""
    rows = []
    for name in dict.fromkeys(key(result) for result in results):
        row = [name]
        for speed in _speeds(results):
            mine = [r for r in results if key(r) == name and r["speed"] == speed]
            row.append(f"{sum(r['outcome'] in GOOD for r in mine)} of {len(mine)}")
        rows.append(row)
    return markdown_table((title, *(f"{speed:g} m/s" for speed in _speeds(results))), rows)


def name_of(result: Result) -> str:
    """What to call a trial."""
    leg = result["leg"]
    air = f", {leg} in the air at {result['swing_phase']:.2f}" if leg else ""
    return (
        f"{result['time']:g} s ({_stretch(result)}{air}), {result['speed']:g} m/s to "
        f"{result['direction_deg']:g}°"
    )


def _failures(options: argparse.Namespace, results: Sequence[Result]) -> str:
    """Those that were not ok, and how to repeat one."""
    failed = [result for result in results if result["outcome"] not in GOOD]
    if not failed:
        return "No trial failed."
    items = [f"- {name_of(r)}: {r['outcome']}: {r['reason']}" for r in failed[:LISTED]]
    if len(failed) > LISTED:
        items.append(f"- and {len(failed) - LISTED} more")
    command = repeat(options.scenario, options.overrides, failed[0])
    text = "\n".join(items)
    return (
        f"Those that failed:\n\n{text}\n\nThe first of them again, as a run:\n\n```\n{command}\n```"
    )


def repeat(scenario: str, overrides: Sequence[str], trial: Result) -> str:
    """The command that repeats a trial as a whole run."""
    push = ", ".join(
        f"{key}: {trial[key]!r}" for key in ("time", "duration", "speed", "direction_deg")
    )
    words = ["drake-quad", "run", scenario]
    for override in (*overrides, f"disturbances.pushes=[{{{push}}}]"):
        words += ["--set", override]
    return shlex.join(words)


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--scenario", default="case_study")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--speed", nargs="+", type=float, default=[0.3], help="[m/s]")
    parser.add_argument("--moments", type=int, default=40, help="at least one a segment")
    parser.add_argument("--directions", type=int, default=8, help="evenly all round")
    parser.add_argument("--tail", type=float, default=15.0, help="[s] after the push begins")
    parser.add_argument("--to-goal", type=int, default=8, help="one in so many goes on to the goal")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--recycle", type=int, default=250, help="trials to a process")
    parser.add_argument("--lines", type=Path, default=Path("runs/pushes.jsonl"), help="records")
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    parser.add_argument("--out", type=Path, help="the Markdown page to write a section of")
    parser.add_argument("--json", type=Path, help="file for rates and trials")
    options = parser.parse_args(arguments)
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    for name in ("moments", "directions", "workers", "recycle", "to_goal"):
        if getattr(options, name) < 1:
            parser.error(f"--{name.replace('_', '-')} must be 1 or more")
    if not (options.tail > 0.0 and all(0.0 < speed < 100.0 for speed in options.speed)):
        parser.error("--tail and --speed must be more than 0")
    return options


def study(options: argparse.Namespace) -> list[Result]:
    """Carries out the trials that are not done: all results."""
    overrides = with_common(options.scenario, options.set)
    options.overrides = overrides
    made, base = study_of(options.scenario, overrides)
    p = prepare_undisturbed(base, overrides)
    dt = float(p.scenario.simulation.plant.time_step)
    pushes = make_pushes(
        moments(p.plan, options.moments, time_step=dt),
        speeds=options.speed,
        directions=options.directions,
        to_goal=options.to_goal,
    )
    # All processes take from one queue in the order of times, in which their own runs go on.
    trials = [
        make_trial(made, base, index, [push[name] for name in VALUES], figures=FIGURES)
        for index, push in enumerate(pushes)
    ]
    names = ("speed", "moments", "directions", "tail", "to_goal")
    chosen = {"of": "pushes", **{name: getattr(options, name) for name in names}}
    one = partial(work, tail=options.tail)
    return carry_on(made, base, trials, one, names=VALUES, chosen=chosen, options=options)


def figures(results: Sequence[Result]) -> list[dict[str, Any]]:
    """By speed: how many trials, how many were ok, and the rate's exact bounds."""
    rates = []
    for speed in _speeds(results):
        mine = [result["outcome"] in GOOD for result in results if result["speed"] == speed]
        rate = rate_of(sum(mine), len(mine))
        told = {"trials": rate.trials, "ok": rate.good, "low": rate.low, "high": rate.high}
        rates.append({"speed": speed, **told})
    return rates


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out the study, prints its section and writes what was asked for."""
    options = parse(arguments)
    with errors_in_a_line("pushes"):
        check_out(options.out, "pushes")
        results = study(options)
        rates = figures(results)
        text = section(options, results)
        if options.out is not None:
            if len(rates) > 1:
                figure = options.out.parent / "figures" / "push_curve.svg"
                draw_curve(rates, figure)
                text += (
                    f"\n\n![Share of pushes withstood over their speed](figures/{figure.name})\n"
                )
            write_section(options.out, "pushes", text)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({"rates": rates, "trials": results}, indent=1) + "\n")
    print(text)


if __name__ == "__main__":
    main()
