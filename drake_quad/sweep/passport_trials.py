"""A passport's trials in physics: each flight with a plan, up and back, drawn a little otherwise.

A repetition is one flight up and down again, as ASTM E2804 counts robots on stairs: 29 of 29 are a
rate of 90 % with a confidence of 95 %.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from drake_quad.errors import InputError
from drake_quad.feasibility.passport import Passport
from drake_quad.sweep.journal import NAME
from drake_quad.sweep.run import SweepRequest, run_sweep
from drake_quad.util.files import write_whole
from drake_quad.util.numbers import is_integer

# What is never quite as in the file. The map is exact, and the state is the true one.
STUDY = """# Trials of a passport: friction, masses, and a kick somewhere. The map is exact, and the
# controller is given the true state.
description: "{name}, {stairs}: friction, masses, a kick"
scenario: {scenario}
set:
  - monitor.margins=hull
  - "disturbances.pushes=[{{time: 1.0, speed: 0.1, direction_deg: 0.0}}]"
trials: {trials}
sampling: random
vary:
  - {{path: simulation.friction, uniform: [0.4, 1.0], bands: 3}}
  - {{path: disturbances.mass_factor, uniform: [0.9, 1.1]}}
  - {{path: disturbances.com_offset.x, uniform: [-0.02, 0.02]}}
  - {{path: disturbances.com_offset.y, uniform: [-0.02, 0.02]}}
  - {{path: "disturbances.pushes[0].time", name: kick time, uniform: [2.0, {until:.0f}.0]}}
  - {{path: "disturbances.pushes[0].speed", name: kick speed, uniform: [0.01, 0.1]}}
  - {{path: "disturbances.pushes[0].direction_deg", name: kick direction, uniform: [-180.0, 180.0]}}
success:
  - {{figure: nonfoot_contact_samples, most: 0}}
figures: [cost_of_transport]
limits: {{wall_time: 3600.0}}
gate: {{rate: 0.9}}
"""


# What a rate stands beside.
DRAWN = (
    "Trials: up and down in physics, friction from 0.4 to 1.0, mass ± 10 %, its centre ± 2 cm, a "
    "kick of up to 0.1 m/s; with an exact map, ideal drives, and a controller that is given the "
    "true state. A trial succeeds if the goal is reached and nothing but feet touches."
)
MOST_TRIALS = 10_000


def check_trials(trials: int) -> None:
    """Makes sure that there can be so many trials.

    Raises:
        InputError: If not.
    """
    if not (is_integer(trials) and 1 <= trials <= MOST_TRIALS):
        remedy = f"give a whole number, 1 to {MOST_TRIALS}"
        raise InputError(source="--trials", field="trials", value=trials, remedy=remedy)


def _write(text: str, to: Path) -> None:
    to.write_text(text, encoding="utf-8")


def run_trials(
    passport: Passport,
    directory: Path,
    trials: int,
    *,
    workers: int,
    console: Console,
    stop: Callable[[], bool] = lambda: False,
    done: Callable[[dict[str, dict[str, Any]]], object] = lambda _: None,
) -> dict[str, dict[str, Any]]:
    """Runs so many trials on each of the stairs that there is a plan for.

    It goes on with the trials of the same passport that were interrupted.

    Args:
        passport: The passport, whose scenarios are in the directory.
        directory: Where a study and its results are written for each.
        trials: How many of each.
        workers: Number of processes.
        console: Console for progress.
        stop: Whether to stop.
        done: Called with what there is after the trials of each of the stairs.

    Returns:
        By the scenarios' files: `good`, `trials`, `low` and `high` (bounds of the rate at 95 %),
        `text`, the smallest margin of all [m] and the median cost of transport.
    """
    found: dict[str, dict[str, Any]] = {}
    for entry in passport.entries:
        if not entry.scenario or stop():
            continue
        flight = 2.0 * (entry.time or 60.0)
        text = STUDY.format(
            name=passport.name, stairs=entry.stairs.name, scenario=entry.scenario, trials=trials,
            until=max(flight, 10.0),
        )  # fmt: skip
        stem = entry.scenario.removesuffix(".yaml")
        study = directory / f"{stem}_trials.yaml"
        write_whole(study, partial(_write, text))
        console.print(f"{entry.stairs.name}: {trials} trials", highlight=False)
        out = directory / f"{stem}_{trials}_trials"
        resume = (out / NAME).exists()
        asked = SweepRequest(study=study, out=out, workers=workers, resume=resume)
        told = run_sweep(asked, console, stop, lambda: None)
        rate, figures = told["rate"], told["figures"]
        if not rate["trials"]:
            continue
        found[entry.scenario] = {
            "good": rate["good"], "trials": rate["trials"], "low": rate["low"],
            "high": rate["high"], "text": f"{rate['good']} of {rate['trials']}: {rate['text']}",
            "margin": figures.get("margin.minimum", {}).get("least"),
            "cost_of_transport": figures.get("cost_of_transport", {}).get("median"),
        }  # fmt: skip
        done(found)
    return found
