"""A run's result, and the files that it leaves behind."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.runs.seen import IMAGE, SEEN, SeenRecord
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import save_scenario
from drake_quad.stability.safety import margin_words
from drake_quad.util.display import html_table, one_line
from drake_quad.util.files import Write, is_number, user_path, write_together

MADE_OF_THEM = ("report.html", "scene.lcmlog")  # what reports make of a run's files


@dataclass(eq=False)
class RunResult:
    """A finished (or ended) run.

    Attributes:
        outcome: `goal_reached`, `fell` or `stopped`.
        reason: Reason of its end, in a sentence.
        summary: Content of summary.json.
        table: Content of log.parquet.
        scenario: Scenario as it was run, in full.
        seen: What the map was made of; None if it was told.
    """

    outcome: str
    reason: str
    summary: dict[str, Any]
    table: pa.Table = field(repr=False)
    scenario: Scenario = field(repr=False)
    seen: SeenRecord | None = field(default=None, repr=False)

    def save(self, directory: str | Path) -> Path:
        """Writes summary.json, log.parquet and scenario.yaml into a directory.

        Args:
            directory: The directory; it is made if it is not there.

        Returns:
            The directory.

        Raises:
            InputError: If they cannot be written, with the reason.
        """
        directory = user_path(directory)
        write_files(self, self.scenario, directory)
        return directory

    def __repr__(self) -> str:
        return one_line(self, self.scenario.description, f"{self.outcome}: {self.reason}")

    def _repr_html_(self) -> str:
        """The outcome and the figures that matter, where a notebook shows it."""
        return summary_html(self.summary)


def summary_html(summary: Mapping[str, Any]) -> str:
    """The outcome and the figures that matter as a table in HTML, for a notebook.

    Args:
        summary: Contents of summary.json; what it lacks is left out.
    """

    def figure(*path: str) -> Any:
        value: Any = summary
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        return value

    rows = [("outcome", f"{figure('outcome') or 'unknown'}: {figure('reason') or 'no reason'}")]
    if isinstance(lacks := figure("safety", "lacks"), list):
        rows.append(("safe", "; ".join(map(str, lacks)) or "yes"))
    for name, path, unit in (
        ("smallest static margin", ("margin", "minimum"), "m"),
        ("smallest margin of the zero-moment point", ("zmp_margin", "minimum"), "m"),
        ("simulated", ("simulated_time",), "s"),
    ):
        if is_number(value := figure(*path)):
            rows.append((name, margin_words(value) if unit == "m" else f"{value:.3f} {unit}"))
    if figure("assumes"):
        rows.append(("these figures assume", str(figure("assumes"))))
    return html_table(rows)


def write_files(result: RunResult, scenario: Scenario, directory: Path) -> None:
    """Writes summary.json, log.parquet and scenario.yaml into `directory`, and what was seen.

    None of them is ever half, and none is beside another run's: an older run's files stay all if
    these cannot be written, and go, its report too, if they can.

    Raises:
        InputError: If they cannot be written, with the reason.
    """
    text = json.dumps(result.summary, indent=2) + "\n"
    seen = _seen_files(result.seen, directory)
    old = [directory / name for name in (*MADE_OF_THEM, SEEN, IMAGE)]
    write_together(
        {
            directory / "scenario.yaml": lambda p: save_scenario(scenario, p),
            **seen,
            directory / "log.parquet": lambda p: write_log(result.table, p),
            directory / "summary.json": lambda p: p.write_text(text, encoding="utf-8"),
        },
        gone=[path for path in old if path not in seen],
    )


def _seen_files(seen: SeenRecord | None, directory: Path) -> dict[Path, Write]:
    """What writes the files of what was seen."""
    if seen is None:
        return {}
    text = json.dumps(seen.told, indent=2) + "\n"
    return {
        directory / SEEN: lambda p: p.write_text(text, encoding="utf-8"),
        directory / IMAGE: seen.write_image,
    }


def write_log(table: pa.Table, path: Path) -> None:
    """Writes a log as Parquet; floats byte by byte, which halves them."""
    floats = [f.name for f in table.schema if pa.types.is_floating(f.type)]
    others = [f.name for f in table.schema if f.name not in floats]
    pq.write_table(
        table, path, compression="zstd", use_dictionary=others, use_byte_stream_split=floats
    )
