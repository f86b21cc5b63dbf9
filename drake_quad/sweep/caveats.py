"""What has to be said beside a rate wherever it stands: console, report, published sections."""

from typing import Any

import pyarrow as pa

from drake_quad.sweep.draws import Draws
from drake_quad.sweep.study_config import Study

KINEMATIC = "Kinematic trials are among them: no physics, so they prove nothing."
SHARED = (
    "All cells have the same draws: bounds hold in each alone, and may be too narrow over several."
)


def caveats_of(told: dict[str, Any]) -> list[str]:
    """Sentences without which the rate would say more than was found.

    Args:
        told: The findings of a sweep, as of `tell`.
    """
    lines = []
    if not told["complete"]:
        lines.append(f"{told['trials']} of the {told['asked']} trials of the study are done.")
    if told["given_up"]:
        lines.append(
            f"{told['given_up']} that began before others of them are not done: those that end "
            "early are more of these than of all."
        )
    if told["kinematic"]:
        lines.append(KINEMATIC)
    if told["sharing"] > 1:
        lines.append(SHARED)
    if told["repeats"]:
        lines.append(
            f"{told['repeats']} came out exactly as another of the same cell: nothing in them is "
            "random, they are no evidence of their own, and the bounds are too narrow."
        )
    return lines


def gate_words(told: dict[str, Any]) -> str:
    """What was asked for, and whether it was kept; nothing of a study that asks for nothing."""
    if told["gate"] is None or told["passed"] is None:
        return ""
    of = "" if told["gate_each"] is None else f" of each {told['gate_each']}"
    word = ("kept" if told["passed"] else "missed") + ("" if told["complete"] else " so far")
    none = f"; no trial of {', '.join(told['gate_untried'])}" if told["gate_untried"] else ""
    return f"asked for at least {100 * told['gate']:g} %{of}: {word}{none}"


def grade(told: dict[str, Any]) -> str:
    """The rate's colour: good, warn or bad; without a gate all have to succeed."""
    rate = told["rate"]
    if told["passed"] is False or not rate["good"]:
        return "bad"
    well = told["passed"] if told["gate"] is not None else rate["good"] == rate["trials"]
    return "good" if well and told["complete"] and not told["kinematic"] else "warn"


def given_up(table: pa.Table) -> int:
    """How many trials are not done that come before one that is.

    Trials begin in order. Of those under way when a sweep is stopped the ones that end early are
    in its table, and they fail more often than others, as a fall ends a trial.
    """
    indices = table["index"].to_pylist()
    return max(indices, default=-1) + 1 - len(indices)


def repeats(study: Study, table: pa.Table) -> int:
    """How many trials are another one of their cell over again, but for a seed that nothing reads.

    Of a study that draws anything there are none: a draw that comes twice is evidence as others.
    """
    if study.trials == 1 or Draws(study).drawn:
        return 0
    own = [name for name in table.column_names if name.startswith(("vary.", "figure."))]
    rows = table.select([*own, "outcome", "reason"]).to_pylist()
    return len(rows) - len({repr(row) for row in rows})
