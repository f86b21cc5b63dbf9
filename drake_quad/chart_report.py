"""What `drake-quad chart` prints, and writes as JSON."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from drake_quad.whole_files import write_whole


def write_chart(told: dict[str, Any], directory: Path) -> None:
    """Writes chart.json."""
    text = json.dumps(told, indent=2) + "\n"
    write_whole(directory / "chart.json", lambda to: to.write_text(text, encoding="utf-8"))


def print_chart(told: dict[str, Any], directory: Path, console: Console) -> None:
    """Prints how many of the stairs can be climbed, the highest of each run, and where it is."""
    cells = told["cells"]
    works = [cell for cell in cells if cell["margin"] is not None]
    colour, total = "green" if works else "red", len(told["rises"]) * len(told["runs"])
    looked = "" if told["complete"] else f", of which {len(cells)} were looked at"
    climbs = f"{told['name']} climbs {len(works)} of {total} stairs"
    console.print(Text.assemble((climbs, f"bold {colour}"), looked))
    table = Table("run", "highest rise", "margin", "what is in the way above", box=None)
    for run in told["runs"]:
        here = [cell for cell in cells if cell["run"] == run]
        best = max((c for c in here if c["margin"] is not None), key=_rise, default=None)
        above = min(
            (c for c in here if c["limit"] and (best is None or c["rise"] > best["rise"])),
            key=_rise,
            default=None,
        )
        table.add_row(
            f"{run:g} m",
            "-" if best is None else f"{best['rise']:g} m",
            "-" if best is None else f"{1e3 * best['margin']:.0f} mm",
            "-" if above is None else told["limits"][above["limit"]],
        )
    console.print(table, highlight=False)
    console.print(Text(f"look at {directory / 'chart.png'}"), soft_wrap=True)


def _rise(cell: dict[str, Any]) -> float:
    return float(cell["rise"])
