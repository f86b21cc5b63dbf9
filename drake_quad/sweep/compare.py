"""Two sweeps side by side."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
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
from drake_quad.sweep.provenance import fields_of_trials
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
from drake_quad.util.display import folded, html_table, one_line

SAME = ["index", "seed", "overrides"]  # columns by which a trial is the same

KEPT: dict[str, Kind] = {"study": TEXT, "commit": TEXT, "complete": TRUTH}  # from sweep.json
LISTED = 10  # trials that only one of the two succeeded in
UNLIKE = "where all cells share their draws, a sweep is compared only with one of as many cells"


@dataclass(frozen=True)
class Swept:
    """A sweep, to be compared.

    Attributes:
        table: Its trials.
        definition: Its study, as plain data.
        study: Its study, with the fields that decide which trials there are; it is not checked.
    """

    table: pa.Table
    definition: dict[str, Any]
    study: Study

    @property
    def sharing(self) -> int:
        """Number of trials that share each draw: the grid's cells, if draws are common; else 1."""
        return draws_shared(self.study)

    def success(self) -> dict[int, bool]:
        """Whether each trial succeeded, by index."""
        columns = (self.table[name].to_pylist() for name in ("index", "success"))
        return dict(zip(*columns, strict=True))

    def drawn(self) -> dict[int, tuple[Any, ...]]:
        """Seed of each trial, and its overrides but for those that all trials have, by index."""
        all_have = self.definition["set"]
        found = {}
        for row in self.table.select(SAME).to_pylist():
            own = row["overrides"]
            if own[: len(all_have)] == all_have:
                own = own[len(all_have) :]
            found[row["index"]] = (row["seed"], *own)
        return found

    def ended(self) -> list[int]:
        """Indices of the trials that did not end by themselves."""
        columns = (self.table[name].to_pylist() for name in ("index", "outcome"))
        return [index for index, outcome in zip(*columns, strict=True) if outcome in ENDED]


def swept(table: pa.Table, definition: dict[str, Any]) -> Swept:
    """The sweep that a table and a definition describe.

    Raises:
        ValueError: If `definition` is not a study, or has no trials.
    """
    try:
        fields_of_trials(definition)
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
    """The fields in which the studies differ, of those that decide their trials."""
    before, after = (fields_of_trials(side.definition) for side in (one, other))
    # A field that only one has is a later program's: its default is what was done before.
    # As text, in which the order of `cases` counts.
    fields = [name for name in before if name in after]
    return [name for name in fields if json.dumps(before[name]) != json.dumps(after[name])]


def why_apart(one: Swept, other: Swept) -> str:
    """Why trials of one sweep are not those of the other; empty if they are.

    A trial is the same if its scenario's name, what was drawn for it, and its seed are. What all
    trials of a study are set to may differ, as where two controllers are compared. Changes of the
    scenario's file and of the robots' are then compared, like changes of the program.
    """
    names = [side.definition["scenario"] for side in (one, other)]
    if names[0] != names[1]:
        return f"their scenarios are {names[0]} and {names[1]}"
    rows = [side.drawn() for side in (one, other)]
    both = sorted(rows[0].keys() & rows[1].keys())
    if not both:
        return "no trial was done in both"
    unlike = [index for index in both if rows[0][index] != rows[1][index]]
    if unlike:
        which = f"{len(unlike)} of {len(both)} trials have other draws or seeds"
        return f"{which}, trial {unlike[0]} the first"
    return ""


def compare_paired(one: Swept, other: Swept) -> tuple[dict[str, Any], Finding]:
    """The trials that both have, those that changed, and whether that could be chance."""
    before, after = one.success(), other.success()
    both = sorted(before.keys() & after.keys())
    change = {index: after[index] - before[index] for index in both}
    paired: dict[str, Any] = {"trials": len(both)}
    for name, side in (("before", before), ("after", after)):
        paired[name] = sum(side[k] for k in both)  # number of them that succeeded
    paired |= {w: [k for k in both if change[k] == s] for w, s in (("lost", -1), ("won", 1))}
    # The trials are the same ones: draws common to one sweep's cells are common to the other's.
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
    """Whether the rates differ by more than chance; None if there is no test for that."""
    sides = [side.success() for side in (one, other)]
    if one.sharing != other.sharing:
        return None
    if one.sharing == 1:
        return apart_trials([sum(side.values()) for side in sides], [len(side) for side in sides])
    return apart_draws(*(_rates(side, one.sharing) for side in sides))


def _rates(success: dict[int, bool], sharing: int) -> Sequence[float]:
    """The rate of each draw that was carried out in every cell, for only these are alike."""
    done = Counter(index // sharing for index in success)
    good = Counter(index // sharing for index, well in success.items() if well)
    return [good[draw] / sharing for draw, cells in done.items() if cells == sharing]


@dataclass(frozen=True)
class Comparison:
    """Whether a second sweep is worse than a first, and whether that could be chance.

    Attributes:
        before: Figures of the first sweep: directory, commit, trials, rate, causes of failure.
        after: Figures of the second sweep, likewise.
        differ: Fields in which the studies differ, of those that decide the trials.
        unpaired: Why trials of one sweep are not those of the other; None if they are.
        paired: Trials that both sweeps have, and those that one of them lost; None if unpaired.
        test: Name of the test; None if there is none.
        unit: What the test counts, `trial` or `draw`.
        units: Number of units: of both sweeps if they are paired, else of each.
        p: Probability of a difference at least as great by chance.
        sharing: Number of trials that share each draw.
        verdict: `worse`, `better`, `no different` or `cannot be told`.
        why: Why that is the verdict, where the probability does not say it.
    """

    before: dict[str, Any]
    after: dict[str, Any]
    differ: list[str]
    unpaired: str | None
    paired: dict[str, Any] | None
    test: str | None
    unit: str | None
    units: tuple[int, ...] | None
    p: float | None
    sharing: int
    verdict: str
    why: str | None

    def as_dict(self) -> dict[str, Any]:
        """The comparison as plain values, as `drake-quad compare --json` prints it."""
        return asdict(self)

    @property
    def reason(self) -> str:
        """The probability and its test, and what else explains the verdict."""
        chance = f"by chance with p = {self.p:.3g} ({self.test})" if self.test else ""
        return ": ".join(filter(None, (chance, self.why)))

    def __repr__(self) -> str:
        return one_line(self, self.verdict, "" if self.p is None else f"p = {self.p:.3g}", self.why)

    def _repr_html_(self) -> str:
        """Both rates and the verdict, where a notebook shows it."""
        rows = [("the second is", f"{self.verdict}: {self.reason}")]
        for name, side in (("before", self.before), ("after", self.after)):
            rate = side["rate"]
            text = f"{rate['good']} of {rate['trials']} succeeded, {rate['text']}"
            rows.append((f"{name}, {side['directory']}", text))
        return html_table(rows)


def compare_sweeps(before: str | Path, after: str | Path) -> Comparison:
    """Compares the rates of two sweeps.

    Trials of both that have the same index, overrides and seed are the same but for the program and
    the files: where all that both have are, a test of those that changed decides. It finds smaller
    differences than one that takes the trials of each sweep as drawn on their own, which decides
    where they are not.

    Raises:
        InputError: If there is no sweep in one of the directories, or its files are spoilt.
    """
    (one, one_figures), (other, other_figures) = _side(Path(before)), _side(Path(after))
    why_unpaired = why_apart(one, other) or None
    paired: dict[str, Any] | None = None
    if why_unpaired:
        finding = compare_unpaired(one, other)
    else:
        paired, finding = compare_paired(one, other)
    comparison = Comparison(
        before=one_figures,
        after=other_figures,
        differ=differing_figures(one, other),
        unpaired=why_unpaired,
        paired=paired,
        test=finding.test if finding else None,
        unit=finding.unit if finding else None,
        units=finding.units if finding else None,
        p=finding.p if finding else None,
        sharing=max(one.sharing, other.sharing),
        verdict=finding.verdict if finding else "cannot be told",
        why=_why(finding),
    )
    if paired and all(is_fixed(side.study, side.table) for side in (one, other)):
        verdict, why = _verdict_if_fixed(paired, {*one.ended(), *other.ended()})
        return replace(
            comparison, verdict=verdict, why=why, test=None, unit=None, units=None, p=None
        )
    return comparison


def _verdict_if_fixed(paired: dict[str, Any], ended: set[int]) -> tuple[str, str]:
    """The verdict, and why, where nothing is random: what changed is not chance.

    Trials in `ended` were cut off for time or memory, which depends on the machine.
    """
    lost, won = (set(paired[word]) for word in ("lost", "won"))
    verdict = "worse" if lost - ended else "better" if won - ended else "no different"
    if verdict == "no different" and lost | won:
        return "cannot be told", (
            "what changed is trials that ran out of time or memory, or were killed: run them again"
        )
    return verdict, "nothing is random in these studies: the program or the files made the change"


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Prints both rates, the verdict with its probability, causes, and trials that changed."""

    def say(line: str) -> None:
        console.print(printable(line), markup=False, highlight=False, soft_wrap=True)

    table = Table("", "before", "after", box=None)
    sides = [comparison.before, comparison.after]
    table.add_row("sweep", *(side["directory"] for side in sides))
    table.add_row("commit", *(printable(side["commit"]) or "-" for side in sides))
    table.add_row("succeeded", *(f"{s['rate']['good']} of {s['rate']['trials']}" for s in sides))
    table.add_row("with bounds at 95 %", *(side["rate"]["text"] for side in sides))
    causes = [dict(side["causes"]) for side in sides]
    for cause in sorted(causes[0] | causes[1]):
        table.add_row(printable(cause), *(str(own.get(cause, 0)) for own in causes))
    console.print(folded(table), highlight=False, markup=False)
    colour = {"worse": "red", "better": "green"}.get(comparison.verdict, "bold")
    verdict = f"[{colour}]{comparison.verdict}[/]: {comparison.reason}"
    console.print(verdict, highlight=False, soft_wrap=True)
    for line in _remarks(comparison):
        say(line)
    for side in sides:
        for line in caveats_of(side):
            say(f"{side['directory']}: {line}")
    for word in ("lost", "won"):
        trials = comparison.paired[word] if comparison.paired else []
        if trials:
            more = " ..." if len(trials) > LISTED else ""
            listed = ", ".join(map(str, trials[:LISTED])) + more
            say(f"{len(trials)} {word}: trials {listed}")


def _why(finding: Finding | None) -> str | None:
    """Why there is no verdict; None if there is one."""
    if finding is None:
        return UNLIKE
    if finding.verdict != "cannot be told":
        return None
    count = " and ".join(map(str, finding.units))
    least = f"p is {finding.least:.3g} even if they differ most"
    return f"{count} {finding.unit}s are too few, {least}"


def _remarks(comparison: Comparison) -> list[str]:
    """What the test counts, and why it is the one that it is."""
    lines = []
    if comparison.unit == "draw":
        lines.append(
            f"the test counts draws: all {comparison.sharing} cells share each of them, and the "
            "trials of one draw are not independent of each other"
        )
    paired = comparison.paired
    if paired and paired["trials"] < max(comparison.before["trials"], comparison.after["trials"]):
        good = " and ".join(str(paired[when]) for when in ("before", "after"))
        lines.append(
            f"compared by the {paired['trials']} trials that both have: {good} of them succeeded"
        )
    if paired and "draws" in paired:
        lines.append("draws: " + ", ".join(f"{n} {word}" for word, n in paired["draws"].items()))
    if comparison.unpaired:
        lines.append(f"the trials are not paired: {comparison.unpaired}")
    if comparison.differ:
        lines.append(f"the studies differ in {', '.join(comparison.differ)}")
    return lines


def _side(directory: Path) -> tuple[Swept, dict[str, Any]]:
    """A sweep, and its figures as plain values.

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
