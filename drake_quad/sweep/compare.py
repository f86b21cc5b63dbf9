"""Two sweeps side by side: is the second worse, and could that be chance?"""

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest, fisher_exact

from drake_quad.errors import InputError
from drake_quad.sweep.rates import causes_of, rate_of
from drake_quad.sweep.sweep import FINDINGS
from drake_quad.sweep.table import read_table
from drake_quad.sweep.told import rate_told

SIGNIFICANT = 0.05  # greatest probability of chance at which two rates are called different
LISTED = 10  # trials that only one of the two succeeded in


def compare_sweeps(before: Path, after: Path) -> dict[str, Any]:
    """Compares the rates of two sweeps.

    Fisher's exact test takes the trials of each as drawn on their own. Where both are of one study,
    a trial of the one is that of the other but for the program, and McNemar's exact test looks at
    those that changed: it finds smaller differences, and decides.

    Raises:
        InputError: If there is no sweep in one of the directories.
    """
    sides = {"before": _side(before), "after": _side(after)}
    one, other = (side["table"] for side in sides.values())
    good = [sum(table["success"].to_pylist()) for table in (one, other)]
    counts = [[good[0], len(one) - good[0]], [good[1], len(other) - good[1]]]
    told: dict[str, Any] = {
        name: {key: value for key, value in side.items() if key != "table"}
        for name, side in sides.items()
    }
    told["fisher_p"] = float(fisher_exact(counts).pvalue)
    told["paired"] = paired = (
        _paired(one, other) if sides["before"]["study"] == sides["after"]["study"] else None
    )
    rates = [told[name]["rate"]["rate"] for name in ("before", "after")]
    # Of what the test looks at: one side may have trials that the other has not.
    worse = len(paired["lost"]) > len(paired["won"]) if paired else rates[1] < rates[0]
    told["p"], told["verdict"] = paired["p"] if paired else told["fisher_p"], "no different"
    if told["p"] < SIGNIFICANT:
        told["verdict"] = "worse" if worse else "better"
    return told


def print_comparison(told: dict[str, Any], console: Console) -> None:
    """Prints both rates, the verdict with its probability, causes, and trials that changed."""
    table = Table("", "before", "after", box=None)
    sides = [told["before"], told["after"]]
    table.add_row("sweep", *(side["directory"] for side in sides))
    table.add_row("commit", *(side["commit"] or "-" for side in sides))
    table.add_row("succeeded", *(f"{s['rate']['good']} of {s['rate']['trials']}" for s in sides))
    table.add_row("with bounds at 95 %", *(side["rate"]["text"] for side in sides))
    causes = [dict(side["causes"]) for side in sides]
    for cause in sorted(causes[0] | causes[1]):
        table.add_row(cause, *(str(own.get(cause, 0)) for own in causes))
    console.print(table, highlight=False, markup=False)
    colour = {"worse": "red", "better": "green"}.get(told["verdict"], "bold")
    test = "McNemar's, of the same trials" if told["paired"] else "Fisher's"
    console.print(
        f"[{colour}]{told['verdict']}[/]: by chance with p = {told['p']:.3g} ({test} exact test)",
        highlight=False,
    )
    for side in sides:
        if not side["complete"]:
            console.print(
                f"{side['directory']} is part of its study: trials that end early come first",
                markup=False, highlight=False, soft_wrap=True,
            )  # fmt: skip
    for word in ("lost", "won") if told["paired"] else ():
        trials = told["paired"][word]
        if trials:
            more = " ..." if len(trials) > LISTED else ""
            listed = ", ".join(map(str, trials[:LISTED])) + more
            console.print(f"{len(trials)} {word}: trials {listed}", highlight=False)


def _side(directory: Path) -> dict[str, Any]:
    """What is told of one sweep, and its table."""
    table = read_table(directory)
    if not len(table):
        remedy = "holds no trial: nothing to compare"
        raise InputError(source=str(directory), field="trials", value=0, remedy=remedy)
    try:
        found = json.loads((directory / FINDINGS).read_text(encoding="utf-8"))
        study, commit, complete = found["study"], found["commit"], found["complete"]
    except (OSError, ValueError, KeyError, TypeError):
        remedy = "not there, or not a sweep's; give the directory of a `drake-quad sweep`"
        path = str(directory / FINDINGS)
        raise InputError(source=str(directory), field=FINDINGS, value=path, remedy=remedy) from None
    return {
        "directory": str(directory),
        "study": study,
        "commit": commit,
        "complete": complete,
        "rate": rate_told(rate_of(sum(table["success"].to_pylist()), len(table))),
        "causes": causes_of(table["outcome"].to_pylist(), table["reason"].to_pylist()),
        "table": table,
    }


def _paired(one: pa.Table, other: pa.Table) -> dict[str, Any]:
    """McNemar's exact test of the trials that both have, and which of them changed."""
    before = dict(zip(one["index"].to_pylist(), one["success"].to_pylist(), strict=True))
    after = dict(zip(other["index"].to_pylist(), other["success"].to_pylist(), strict=True))
    both = sorted(before.keys() & after.keys())
    lost = [k for k in both if before[k] and not after[k]]
    won = [k for k in both if after[k] and not before[k]]
    changed = len(lost) + len(won)
    p = float(binomtest(len(lost), changed).pvalue) if changed else 1.0
    return {"trials": len(both), "lost": lost, "won": won, "p": p}
