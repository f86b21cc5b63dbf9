"""Which trials of two sweeps are the same, and which of one sweep share their luck."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from drake_quad.sweep.draws import Draws
from drake_quad.sweep.evidence import ENDED
from drake_quad.sweep.provenance import bearing
from drake_quad.sweep.significance import (
    Finding,
    apart_draws,
    apart_trials,
    paired_draws,
    paired_trials,
)
from drake_quad.sweep.study_config import Study, Vary

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
        return shared_by(self.study)

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


def shared_by(study: Study) -> int:
    """How many trials share each of its draws."""
    return Draws(study).cells if study.draws == "common" else 1


def differing(one: Swept, other: Swept) -> list[str]:
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


def pair(one: Swept, other: Swept) -> tuple[dict[str, Any], Finding]:
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


def apart(one: Swept, other: Swept) -> Finding | None:
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
