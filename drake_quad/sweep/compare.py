"""Two sweeps side by side."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
from rich.console import Console
from rich.table import Table

from drake_quad.errors import InputError, printable
from drake_quad.sweep.findings import (
    ENDED,
    count_duplicates,
    count_skipped,
    draws_shared,
    is_fixed,
    rate_as_dict,
)
from drake_quad.sweep.provenance import bearing
from drake_quad.sweep.results import (
    FINDINGS,
    REMEDY,
    STUDY,
    TEXT,
    TRUTH,
    Kind,
    read_definition,
    read_plain,
    read_table,
)
from drake_quad.sweep.sampling import Draws
from drake_quad.sweep.statistics import (
    Finding,
    apart_draws,
    apart_trials,
    causes_of,
    caveats_of,
    paired_draws,
    paired_trials,
    rate_of,
)
from drake_quad.sweep.study import Study, Vary
from drake_quad.sweep.trials import count_trials

# ------------------------------------------------------------------------------------------------
# Which trials of two sweeps are the same, and which of one sweep share their luck.
# ------------------------------------------------------------------------------------------------


SAME = ["index", "seed", "overrides"]  # columns by which a trial is the same


@dataclass(frozen=True)
class Swept:
    """A sweep, to be compared.

    Attributes:
        table: Its trials.
        definition: Its study, as plain data.
        study: The same, of what bears on which trials there are: not checked.
    """

    table: pa.Table
    definition: dict[str, Any]
    study: Study

    @property
    def sharing(self) -> int:
        """How many trials share each draw: the grid's cells, if draws are common; else 1."""
        return draws_shared(self.study)

    def success(self) -> dict[int, bool]:
        """Whether each trial succeeded, by index."""
        columns = (self.table[name].to_pylist() for name in ("index", "success"))
        return dict(zip(*columns, strict=True))

    def ended(self) -> list[int]:
        """Which trials did not end by themselves, by index."""
        columns = (self.table[name].to_pylist() for name in ("index", "outcome"))
        return [index for index, outcome in zip(*columns, strict=True) if outcome in ENDED]


def swept(table: pa.Table, definition: dict[str, Any]) -> Swept:
    """A sweep of what its files hold.

    Raises:
        ValueError: If `definition` is no study's, or one without trials.
    """
    try:
        bearing(definition)
        study = Study(
            vary=[Vary(**vary) for vary in definition["vary"]],
            draws=definition["draws"], trials=definition["trials"],
        )  # fmt: skip
        if Draws(study).count > 0:
            return Swept(table, definition, study)
    except (KeyError, TypeError, AttributeError, StopIteration):
        pass
    raise ValueError("no study's definition")


def differing_figures(one: Swept, other: Swept) -> list[str]:
    """The fields in which the studies differ, of those that bear on their trials."""
    before, after = (bearing(side.definition) for side in (one, other))
    # A field that one does not have is of a later program, whose default is what was done before.
    # As text, in which the order of `cases` counts.
    fields = [name for name in before if name in after]
    return [name for name in fields if json.dumps(before[name]) != json.dumps(after[name])]


def why_apart(one: Swept, other: Swept) -> str:
    """Why trials of one sweep are not those of the other; empty if they are.

    A trial is the same if its scenario's name, its overrides and its seed are: what was changed in
    the files of scenario and robots is then compared, as what was in the program.
    """
    names = [side.definition["scenario"] for side in (one, other)]
    if names[0] != names[1]:
        return f"their scenarios are {names[0]} and {names[1]}"
    rows = [
        {row.pop("index"): row for row in side.table.select(SAME).to_pylist()}
        for side in (one, other)
    ]
    both = sorted(rows[0].keys() & rows[1].keys())
    if not both:
        return "no trial was done in both"
    unlike = [index for index in both if rows[0][index] != rows[1][index]]
    if unlike:
        which = f"{len(unlike)} of {len(both)} trials have other overrides or seeds"
        return f"{which}, trial {unlike[0]} the first"
    return ""


def compare_paired(one: Swept, other: Swept) -> tuple[dict[str, Any], Finding]:
    """The trials that both have and that changed; and whether that could be chance."""
    before, after = one.success(), other.success()
    both = sorted(before.keys() & after.keys())
    change = {index: after[index] - before[index] for index in both}
    paired: dict[str, Any] = {"trials": len(both)}
    for name, side in (("before", before), ("after", after)):
        paired[name] = sum(side[k] for k in both)  # of them, how many succeeded
    paired |= {w: [k for k in both if change[k] == s] for w, s in (("lost", -1), ("won", 1))}
    # Of one and the same trials: common to one sweep's cells, draws are common to the other's.
    sharing = max(one.sharing, other.sharing)
    if sharing == 1:
        return paired, paired_trials(list(change.values()))
    draws: Counter[int] = Counter()
    for index in both:
        draws[index // sharing] += change[index]
    signs = [(sum_ > 0) - (sum_ < 0) for sum_ in draws.values()]
    paired["draws"] = {"worse": signs.count(-1), "better": signs.count(1), "same": signs.count(0)}
    return paired, paired_draws(list(draws.values()))


def compare_unpaired(one: Swept, other: Swept) -> Finding | None:
    """Whether the rates differ by more than chance; None where no test can tell."""
    sides = [side.success() for side in (one, other)]
    if one.sharing != other.sharing:
        return None
    if one.sharing == 1:
        return apart_trials([sum(side.values()) for side in sides], [len(side) for side in sides])
    return apart_draws(*(_rates(side, one.sharing) for side in sides))


def _rates(success: dict[int, bool], sharing: int) -> Sequence[float]:
    """Of each draw that was done in every cell: of some cells a rate is another thing."""
    done = Counter(index // sharing for index in success)
    good = Counter(index // sharing for index, well in success.items() if well)
    return [good[draw] / sharing for draw, cells in done.items() if cells == sharing]


# ------------------------------------------------------------------------------------------------
# Two sweeps side by side: is the second worse, and could that be chance?.
# ------------------------------------------------------------------------------------------------


KEPT: dict[str, Kind] = {"study": TEXT, "commit": TEXT, "complete": TRUTH}  # of the findings
LISTED = 10  # trials that only one of the two succeeded in
UNLIKE = "draws that all cells share are compared only with such of a grid of as many cells"


def compare_sweeps(before: Path, after: Path) -> dict[str, Any]:
    """Compares the rates of two sweeps.

    Trials of both that have the same index, overrides and seed are the same but for the program and
    the files: where all that both have are, a test of those that changed decides. It finds smaller
    differences than one that takes the trials of each sweep as drawn on their own, which decides
    where they are not.

    Raises:
        InputError: If there is no sweep in one of the directories, or its files are spoilt.
    """
    (one, one_told), (other, other_told) = _side(before), _side(after)
    told: dict[str, Any] = {"before": one_told, "after": other_told}
    told["differ"] = differing_figures(one, other)
    told["unpaired"] = why = why_apart(one, other) or None
    told["paired"], found = (
        (None, compare_unpaired(one, other)) if why else compare_paired(one, other)
    )
    told |= {name: getattr(found, name, None) for name in ("test", "unit", "units", "p")}
    told["sharing"] = max(one.sharing, other.sharing)
    told["verdict"] = "cannot be told" if found is None else found.verdict
    told["why"] = _why(found)
    if told["paired"] and all(is_fixed(side.study, side.table) for side in (one, other)):
        return told | _of_fixed(told["paired"], {*one.ended(), *other.ended()})
    return told


def _of_fixed(paired: dict[str, Any], ended: set[int]) -> dict[str, Any]:
    """The verdict where nothing is random: cells are no sample, and no chance is in what changed.

    But for trials that were `ended`: how long a trial takes is the machine's.
    """
    lost, won = (set(paired[word]) for word in ("lost", "won"))
    verdict = "worse" if lost - ended else "better" if won - ended else "no different"
    why = "nothing is random in these studies: what changed was changed by program or files"
    if verdict == "no different" and lost | won:
        verdict = "cannot be told"
        why = (
            "what changed is trials that ran out of time or memory, or were killed: run them again"
        )
    return {"verdict": verdict, "why": why, "test": None, "unit": None, "units": None, "p": None}


def print_comparison(told: dict[str, Any], console: Console) -> None:
    """Prints both rates, the verdict with its probability, causes, and trials that changed."""
    table = Table("", "before", "after", box=None)
    sides = [told["before"], told["after"]]
    table.add_row("sweep", *(side["directory"] for side in sides))
    table.add_row("commit", *(printable(side["commit"]) or "-" for side in sides))
    table.add_row("succeeded", *(f"{s['rate']['good']} of {s['rate']['trials']}" for s in sides))
    table.add_row("with bounds at 95 %", *(side["rate"]["text"] for side in sides))
    causes = [dict(side["causes"]) for side in sides]
    for cause in sorted(causes[0] | causes[1]):
        table.add_row(printable(cause), *(str(own.get(cause, 0)) for own in causes))
    console.print(table, highlight=False, markup=False)
    colour = {"worse": "red", "better": "green"}.get(told["verdict"], "bold")
    chance = f"by chance with p = {told['p']:.3g} ({told['test']})" if told["test"] else ""
    why = ": ".join(filter(None, (chance, told["why"])))
    console.print(f"[{colour}]{told['verdict']}[/]: {why}", highlight=False, soft_wrap=True)
    for line in _remarks(told):
        console.print(printable(line), markup=False, highlight=False, soft_wrap=True)
    for side in sides:
        for line in caveats_of(side):
            console.print(
                f"{side['directory']}: {line}", markup=False, highlight=False, soft_wrap=True
            )
    for word in ("lost", "won") if told["paired"] else ():
        trials = told["paired"][word]
        if trials:
            more = " ..." if len(trials) > LISTED else ""
            listed = ", ".join(map(str, trials[:LISTED])) + more
            console.print(f"{len(trials)} {word}: trials {listed}", highlight=False)


def _why(found: Finding | None) -> str | None:
    """Why nothing can be told, if it cannot."""
    if found is None:
        return UNLIKE
    if found.verdict != "cannot be told":
        return None
    count = " and ".join(map(str, found.units))
    return f"{count} {found.unit}s are too few, p is {found.least:.3g} even if they differ most"


def _remarks(told: dict[str, Any]) -> list[str]:
    """What the test counts, and why it is the one that it is."""
    lines = []
    if told["unit"] == "draw":
        lines.append(
            f"what is counted is draws: all {told['sharing']} cells share each, its trials are no "
            "evidence of their own"
        )
    paired, sizes = told["paired"], [side["trials"] for side in (told["before"], told["after"])]
    if paired and paired["trials"] < max(sizes):
        good = " and ".join(str(paired[when]) for when in ("before", "after"))
        lines.append(
            f"told by the {paired['trials']} trials that both have: {good} of them succeeded"
        )
    if told["paired"] and "draws" in told["paired"]:
        draws = told["paired"]["draws"]
        lines.append("draws: " + ", ".join(f"{count} {word}" for word, count in draws.items()))
    if told["unpaired"]:
        lines.append(f"the trials are not paired: {told['unpaired']}")
    if told["differ"]:
        lines.append(f"the studies differ in {', '.join(told['differ'])}")
    return lines


def _side(directory: Path) -> tuple[Swept, dict[str, Any]]:
    """A sweep, and what is told of it.

    Raises:
        InputError: If there is none, or its files are spoilt.
    """
    table = read_table(directory)
    if not len(table):
        remedy = "holds no trial: nothing to compare"
        raise InputError(source=str(directory), field="trials", value=0, remedy=remedy)
    found = read_plain(directory, FINDINGS, KEPT)
    definition = read_definition(directory, STUDY)
    try:
        whole = swept(table, definition)
    except ValueError as problem:
        path = str(directory / STUDY)
        remedy = f"{problem}; {REMEDY}"
        raise InputError(source=path, field="definition", value="...", remedy=remedy) from None
    return whole, {
        "directory": str(directory),
        **{key: found[key] for key in KEPT},
        "trials": len(table),
        "asked": count_trials(whole.study),
        "given_up": count_skipped(table),
        "kinematic": "mode" in table.column_names and "kinematic" in table["mode"].to_pylist(),
        "sharing": whole.sharing,
        "repeats": count_duplicates(whole.study, table),
        "rate": rate_as_dict(rate_of(sum(table["success"].to_pylist()), len(table))),
        "causes": causes_of(table["outcome"].to_pylist(), table["reason"].to_pylist()),
    }
