r"""The same trials under Drake's contact solvers, under CENIC and in MuJoCo: do they agree?

Trials are those of studies/solvers.yaml, three steps up on grounds from slippery to rough, so that
some fail. Run it from the repository's top:

    python -m benchmarks.cross_check --trials 20 --page docs/success_maps.md

Two studies are for Drake against MuJoCo, at 0.03 to 0.1 and at 0.3 to 1:

    python -m benchmarks.cross_check --study studies/engines_slippery.yaml \
        --trials 40 --engines lagged MuJoCo
    python -m benchmarks.cross_check --study studies/engines_rough.yaml \
        --trials 40 --engines lagged MuJoCo

Results go to a file of JSON lines as they come; `--resume` goes on with it after an interrupt. A
trial that takes longer, or more memory, than the study's `limits` is ended, and counted as failed.
"""

import argparse
import shlex
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path

import numpy as np

from benchmarks.common import markdown_table, text
from benchmarks.cross_trials import ENGINES, FIGURES, VALUES, work
from benchmarks.engine import carry_on
from benchmarks.page import describe, errors_in_a_line
from benchmarks.study import Result
from drake_quad.sweep.report import check_page, put_section
from drake_quad.sweep.statistics import rate_of
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.sweep.trials import Trial, make_trials

SOLVERS = Path(__file__).resolve().parents[1] / "studies" / "solvers.yaml"
SOLVER = "simulation.plant.discrete_contact_approximation"
FRICTION = "simulation.friction"
NAME = "cross_check"
TITLES = {
    "lagged": "Drake's contact solver *lagged* (1 ms)",
    "similar": "Drake's *similar* (1 ms)",
    "sap": "Drake's *sap* (1 ms)",
    "CENIC": "Drake's error-controlled integrator CENIC (accuracy 1e-3, with the sign of the "
    "joints' speeds put right, see [contact solvers](contact_solvers.md))",
    "MuJoCo": "[MuJoCo](mujoco.md) (1 ms)",
}
RATES = (
    "engine",
    "reached the goal, with exact bounds at 95 %",
    "of these: smallest margin at once [m]",
    "longest slip of a foot in a stance [mm]",
)

SECTION = """\
## {name}

The same {trials} trials, the first of `studies/{study}`, under each of: {engines}. What is drawn is
the same under each: friction, masses, centre of mass, rises. The controller is told none of it, and
has the true state. Margins are the smallest that last 10 ms: on slippery ground feet chatter under
some engines, and bear nothing for single samples between others under load. *At once* is the
smallest of all samples.

{description}
{rates}

*Agree* is the part of the trials in which both reach the goal or both do not; *failed in both* of
those that failed in either; margins are compared where both reach the goal.

{pairs}

Trial by trial, in order of friction: the smallest margin [m] of those that reached the goal, and
what became of the others.

{trials_table}
"""


def trials_of(study: Study, base: Base, count: int, engines: Sequence[str]) -> list[Trial]:
    """The study's first draws under each engine, all engines before the next draw."""
    axis = next(k for k, vary in enumerate(study.vary) if vary.path == SOLVER)
    friction = next(k for k, vary in enumerate(study.vary) if vary.path == FRICTION)
    solvers = study.vary[axis].values or []
    study = replace(study, trials=max(study.trials, count))
    found: list[Trial] = []
    for trial in make_trials(study, base, first=0, last=count * len(solvers)):
        if trial.values[axis] != solvers[0]:  # common draws: the others' are the same
            continue
        draw, drawn = trial.index // len(solvers), trial.values[friction]
        overrides = tuple(text for text in trial.overrides if not text.startswith(SOLVER))
        for engine in engines:
            found.append(
                replace(
                    trial,
                    index=len(found),
                    values=(draw, drawn, engine),
                    overrides=overrides,
                    figures=FIGURES,
                    success=(),
                )
            )
    return found


def good(result: Result) -> bool:
    """Whether the goal was reached."""
    return bool(result["outcome"] == "goal_reached")


def engine_row(engine: str, results: Sequence[Result]) -> list[str]:
    """How it went under one engine."""
    count = sum(map(good, results))
    at_once = [r["margin_at_once"] for r in results if good(r)]
    slips = [r["slip_max"] for r in results if good(r) and r.get("slip_max") is not None]
    return [
        engine,
        f"{count} of {len(results)}: {rate_of(count, len(results)).text()}",
        text(min(at_once, default=None), ".3f"),
        text(max(slips, default=None), ".0f", 1e3),
    ]


def pair_row(one: Sequence[Result], other: Sequence[Result]) -> list[str]:
    """How far two engines agree on the same draws."""
    both = [(a, b) for a, b in zip(one, other, strict=True)]
    same = sum(good(a) == good(b) for a, b in both)
    either = [(a, b) for a, b in both if not (good(a) and good(b))]
    in_both = sum(not good(a) and not good(b) for a, b in either)
    margins = [abs(a["margin"] - b["margin"]) for a, b in both if good(a) and good(b)]
    spread = [float(f(margins)) if margins else None for f in (np.median, np.max)]
    return [
        f"{one[0]['engine']}, {other[0]['engine']}",
        f"{same} of {len(both)}: {rate_of(same, len(both)).text()}",
        f"{in_both} of {len(either)}" if either else "-",
        *(text(value, ".1f", 1e3) for value in spread),
    ]


def section(
    results: Sequence[Result], engines: Sequence[str], words: Sequence[str], study: Path = SOLVERS
) -> str:
    """The page's section, of the draws that are done under every engine."""
    by_engine = {e: {r["draw"]: r for r in results if r["engine"] == e} for e in engines}
    draws = sorted(set.intersection(*(set(done) for done in by_engine.values())))
    draws.sort(key=lambda draw: by_engine[engines[0]][draw]["friction"])
    done = {engine: [by_engine[engine][draw] for draw in draws] for engine in engines}
    rates = [engine_row(engine, done[engine]) for engine in engines]
    pairs = [pair_row(done[a], done[b]) for a, b in combinations(engines, 2)] if draws else []
    rows = [
        [
            str(draw),
            f"{by_engine[engines[0]][draw]['friction']:.3f}",
            *(_cell(by_engine[engine][draw]) for engine in engines),
        ]
        for draw in draws
    ]
    header = ("engines", "agree", "failed in both", "margins differ, median [mm]", "at most [mm]")
    return SECTION.format(
        name=name_of(study),
        study=study.name,
        engines=", ".join(TITLES[engine] for engine in engines),
        trials=len(draws),
        description=describe(
            ["python -m benchmarks.cross_check", shlex.join(words)], libraries_of(engines)
        ),
        rates=markdown_table(RATES, rates),
        pairs=markdown_table(header, pairs),
        trials_table=markdown_table(("trial", "friction", *engines), rows),
    ).rstrip("\n")


def name_of(study: Path) -> str:
    """The name of the page's section: a study other than the usual one has its own."""
    return NAME if study.resolve() == SOLVERS else study.stem


def libraries_of(engines: Sequence[str]) -> list[str]:
    """What the engines need besides Drake."""
    return ["mujoco"] if "MuJoCo" in engines else []


def _cell(result: Result) -> str:
    return text(result["margin"], ".3f") if good(result) else str(result["outcome"])


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--study", type=Path, default=SOLVERS)
    parser.add_argument("--trials", type=int, default=20, help="draws, each under every engine")
    parser.add_argument("--engines", nargs="+", choices=list(ENGINES), default=list(ENGINES))
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--recycle", type=int, default=10, help="runs to a process")
    parser.add_argument(
        "--lines", type=Path, default=Path("runs/cross_check.jsonl"), help="records"
    )
    parser.add_argument("--resume", action="store_true", help="go on with --lines")
    parser.add_argument("--page", type=Path, help="the Markdown page to write a section of")
    options = parser.parse_args(arguments)
    # What the figures depend on; where they are kept, and in how many parts, is not told.
    options.words = ["--trials", str(options.trials)]
    if options.study.resolve() != SOLVERS:
        options.words += ["--study", str(options.study)]
    if options.engines != list(ENGINES):
        options.words += ["--engines", *options.engines]
    for name in ("trials", "workers", "recycle"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} must be 1 or more")
    for library in libraries_of(options.engines):
        if find_spec(library) is None:
            parser.error(f"no {library} is installed here: install it, or give other --engines")
    return options


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out the trials that are not done, prints the section and writes it."""
    options = parse(arguments)
    with errors_in_a_line(NAME):
        study, base = load_study_and_base(options.study)
        if options.page is not None:
            check_page(options.page, name_of(options.study))
        results = carry_on(
            study,
            base,
            trials_of(study, base, options.trials, options.engines),
            work,
            names=VALUES,
            chosen={"of": NAME, "engines": options.engines},
            options=options,
            libraries=libraries_of(options.engines),
        )
        written = section(results, options.engines, options.words, options.study)
        if options.page is not None:
            put_section(options.page, name_of(options.study), written)
    print(written)


if __name__ == "__main__":
    main()
