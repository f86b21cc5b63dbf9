"""The case study under Drake's contact approximations and time steps, and a flight under CENIC.

Does the result hang on how contact is solved? Every row is a whole run of the same scenario, of
which nothing but the contact approximation and the plant's time step (or CENIC and its accuracy)
is another. Run it from the repository's top:

    python -m benchmarks.contact_solvers --workers 2 --out docs/contact_solvers.md

The page is written again after every run that ends, so that an interrupt leaves what there is; what
a person has added to it under "What it shows" stays, and may then need another look.
"""

import argparse
import datetime
import json
import multiprocessing
import shlex
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.common import markdown_table, provenance

APPROXIMATIONS = ("lagged", "similar", "sap")
TIME_STEPS = (0.0005, 0.001, 0.002, 0.0025)  # [s]
PERIOD = 0.005  # [s] of the controller and of the log, unless the step does not divide it
ACCURACIES = (1e-2, 1e-3, 1e-4)  # of CENIC's error control

REMARKS = "\n## What it shows\n"
HEADER = (
    "solver",
    "step / accuracy",
    "outcome",
    "min margin [m]",
    "min ZMP margin [m]",
    "samples under 3 feet",
    "samples with non-foot contact",
    "base error [mm]",
    "slip [mm]",
    "clock waited [s]",
    "peak torque / limit",
    "cost of transport",
    "real-time factor",
)

PAGE = """\
# Contact solvers

Does the result hang on how contact is solved? Each row is a whole run in which nothing but the
contact approximation and the time step (or CENIC and its accuracy) is another.
The controller and the log run at 200 Hz; at 2 ms, of which 5 ms is no multiple, at 250 Hz.
In all runs the controller is told the robot's true state, contact flags have no error, and the map
is exact.

```
{command}
```

{date}; {provenance}.
Up to {workers} runs at once on a busy machine, so the real-time factors are low and noisy
(`docs/benchmarks.md` has the ones that count); no other figure depends on the load.
{tables}
Minima are over the run; *base error* is the largest distance of the base from its plan; *slip* is
the longest way that a standing foot slid in one stance; a sample is one tick of the controller. An
outcome in brackets is the reason why the run ended early.
"""

CENIC_NOTE = """\
CENIC is Drake's error-controlled integrator of the continuous plant (`time_step: 0`,
`integration_scheme: cenic`): no time step to choose, but an accuracy. The controller's ticks bound
its steps to 5 ms. It is an independent check of the discrete solvers.

CENIC in Drake 1.51.1 takes the joints' desired velocity v_d with the wrong sign: a single joint
with gains p and d that is told q_d = 0 and a v_d comes to rest at -d v_d / p; with a time step, or
under the integrators `implicit_euler` and `runge_kutta3`, at +d v_d / p (`benchmarks/cenic.py`). In
the rows `cenic` the benchmark gives it -v_d where a Drake has that fault; the row `cenic, v_d as
given` is without. The plant's `net_actuation` port has the right sign all the same, so it does not
show what CENIC applied: torque and cost of transport are left out.
"""

RAW = "cenic, v_d as given"
CENIC = ("cenic", RAW)


@dataclass(frozen=True)
class Case:
    """One run of the table.

    Attributes:
        scenario: A shipped scenario's name, or a file.
        solver: A discrete contact approximation, or one of `CENIC`.
        setting: The plant's time step [s], for CENIC the integrator's accuracy.
        overrides: Further `path=value` overrides.
    """

    scenario: str
    solver: str
    setting: float
    overrides: tuple[str, ...] = ()

    @property
    def all_overrides(self) -> tuple[str, ...]:
        """Everything that makes the scenario into this case."""
        own: tuple[str, ...] = (
            f"simulation.plant.discrete_contact_approximation={self.solver}",
            f"simulation.plant.time_step={self.setting!r}",
            f"controller.period={self.period!r}",
            f"simulation.log_period={self.period!r}",
        )
        if self.solver in CENIC:
            own = (
                "simulation.plant.time_step=0.0",
                "simulation.simulator.integration_scheme=cenic",
                f"simulation.simulator.accuracy={self.setting!r}",
            )
        return (*self.overrides, *own)

    @property
    def period(self) -> float:
        """The controller's period [s]: the largest whole number of steps within 5 ms."""
        if self.solver in CENIC:
            return PERIOD
        return round(self.setting * int(PERIOD / self.setting + 1e-9), 9)


def measure(case: Case) -> dict[str, Any]:
    """Runs `case` and returns its summary without the segments.

    An input or planning error is an outcome of its own: the other rows are still worth having.
    """
    from benchmarks.cenic import corrected
    from drake_quad.errors import DrakeQuadError
    from drake_quad.scenario.load import load_scenario
    from drake_quad.simulation.run import simulate

    try:
        with corrected() if case.solver == "cenic" else nullcontext():
            summary = simulate(load_scenario(case.scenario, case.all_overrides)).summary
    except DrakeQuadError as error:
        return {"outcome": "error", "reason": str(error)}
    return {key: value for key, value in summary.items() if key != "segments"}


def row(case: Case, summary: dict[str, Any]) -> list[str]:
    """The table's row of a run."""
    setting = f"{case.setting:.0e}" if case.solver in CENIC else f"{1e3 * case.setting:g} ms"
    outcome = summary["outcome"]
    if outcome != "goal_reached":
        outcome = f"{outcome} ({summary['reason']})"

    def text(value: float | None, form: str, scale: float = 1.0) -> str:
        return "-" if value is None else format(scale * value, form)

    get = summary.get
    torque, transport = get("torque_ratio_max"), get("cost_of_transport")
    if case.solver in CENIC:
        torque = transport = None
    return [
        case.solver,
        setting,
        outcome,
        text(get("margin", {}).get("minimum"), ".4f"),
        text(get("zmp_margin", {}).get("minimum"), ".4f"),
        text(get("samples_under_three_feet"), ".0f"),
        text(get("nonfoot_contact_samples"), ".0f"),
        text(get("base_error_max"), ".2f", 1e3),
        text(get("slip_max"), ".3f", 1e3),
        text(get("clock_waited"), ".2f"),
        text(torque, ".2f"),
        text(transport, ".3f"),
        text(get("real_time_factor"), ".1f"),
    ]


def page(cases: Sequence[Case], done: dict[Case, dict[str, Any]], *, workers: int) -> str:
    """The Markdown page of the runs that are done, in the order of `cases`."""
    tables = ""
    for name in dict.fromkeys(case.scenario for case in cases):
        mine = [case for case in cases if case.scenario == name and case in done]
        tables += f"\n## `{name}`\n\n"
        if any(case.solver in CENIC for case in mine):
            tables += CENIC_NOTE + "\n"
        tables += markdown_table(HEADER, [row(case, done[case]) for case in mine]) + "\n"
    # The command as a reader would give it, whatever this was started as.
    words = ["python", "-m", "benchmarks.contact_solvers", *sys.argv[1:]]
    return PAGE.format(
        command=shlex.join(words),
        date=datetime.date.today().isoformat(),
        provenance=provenance(),
        workers=workers,
        tables=tables,
    )


def rewrite(out: Path, text: str) -> None:
    """Writes `text` to `out`, and after it what a person has added there under `REMARKS`."""
    before = out.read_text(encoding="utf-8") if out.exists() else ""
    _, mark, remarks = before.partition(REMARKS)
    out.write_text(text + mark + remarks, encoding="utf-8")


def study(
    cases: Sequence[Case], *, workers: int, out: Path | None = None
) -> dict[Case, dict[str, Any]]:
    """Runs all cases, `workers` at a time, and rewrites the page `out` after each."""
    done: dict[Case, dict[str, Any]] = {}
    context = multiprocessing.get_context("spawn")  # Drake and forks do not mix
    with ProcessPoolExecutor(max_workers=workers, mp_context=context) as pool:
        futures = {pool.submit(measure, case): case for case in cases}
        for future in as_completed(futures):
            case = futures[future]
            done[case] = future.result()
            print(" | ".join([case.scenario, *row(case, done[case])]), file=sys.stderr, flush=True)
            if out is not None:
                rewrite(out, page(cases, done, workers=workers))
    return done


def make_cases(options: argparse.Namespace) -> list[Case]:
    """The table's runs, in its order."""
    overrides = tuple(options.set)
    discrete = [
        Case(options.scenario, solver, step, overrides)
        for solver in options.approximations
        for step in options.time_steps
    ]
    if not options.accuracies:
        return discrete
    beside = Case(options.cenic_scenario, "lagged", 0.001, overrides)
    cenic = [Case(options.cenic_scenario, "cenic", a, overrides) for a in options.accuracies]
    raw = Case(options.cenic_scenario, RAW, options.accuracies[-1], overrides)
    return [*discrete, beside, *cenic, raw]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--workers", type=int, default=1, help="runs at a time")
    parser.add_argument("--scenario", default="case_study", help="of the discrete solvers")
    parser.add_argument("--cenic-scenario", default="descend", help="of CENIC: a shorter one")
    parser.add_argument("--approximations", nargs="*", default=APPROXIMATIONS)
    parser.add_argument("--time-steps", nargs="*", type=float, default=TIME_STEPS, help="[s]")
    parser.add_argument("--accuracies", nargs="*", type=float, default=ACCURACIES, help="of CENIC")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    parser.add_argument("--out", type=Path, help="the Markdown page to write")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the table and prints it."""
    options = parse(arguments)
    cases = make_cases(options)
    done = study(cases, workers=options.workers, out=options.out)
    if options.json:
        runs = [{"case": vars(case), "summary": done[case]} for case in cases]
        print(json.dumps({"runs": runs}))
    else:
        print(page(cases, done, workers=options.workers))


if __name__ == "__main__":
    main()
