"""Writes the tables of docs/log_format.md and docs/scenario.md anew from the program itself.

    python -m scripts.make_reference

What stands between `<!-- generated: NAME -->` and `<!-- end -->` is replaced; a test compares the
committed pages with what this would write.
"""

import dataclasses
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from drake_quad.runs.schema import EVERY, SIGNALS
from drake_quad.runs.summary_figures import SUMMARY
from drake_quad.scenario.config import MissionElement, MotorStrengthConfig, PushConfig, Scenario
from drake_quad.terrain.elements import FIELDS_OF_KIND, Element
from drake_quad.util.schema import BOUNDS, CHOICES, TEXT, UNIT, FieldBound

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table in Markdown."""
    lines = [f"| {' | '.join(row)} |\n" for row in (heads, *rows)]
    lines.insert(1, f"|{'---|' * len(heads)}\n")
    return re.sub(r"(?<=\|)  (?=\|)", " ", "".join(lines))


def log_columns() -> str:
    """The log's columns, a table for each kind of run that has them."""
    found = []
    for where in dict.fromkeys(signal.where for signal in SIGNALS):
        rows = [(f"`{s.pattern}`", s.unit, s.frame, s.text) for s in SIGNALS if s.where == where]
        lead = f"{where}:" if where == EVERY else f"{where}, besides:"
        found.append(f"{lead}\n\n{table(('column', 'unit', 'frame', 'meaning'), rows)}")
    return "\n".join(found)


def summary_keys() -> str:
    """The summary's keys."""
    rows = [(f"`{f.key}`" + (" *" if f.kind == "spread" else ""), f.unit, f.text) for f in SUMMARY]
    return table(("key", "unit", "meaning"), rows)


def limits(bounds: Iterable[FieldBound], choices: Iterable[str]) -> str:
    """What a field may be: its words, or the numbers between its bounds."""
    if words := [f"`{word}`" for word in choices]:
        return ", ".join(words)
    bounds = list(bounds)
    least, above = (max((getattr(b, n) for b in bounds), default=-math.inf)
                    for n in ("least", "above"))  # fmt: skip
    most, below = (min((getattr(b, n) for b in bounds), default=math.inf)
                   for n in ("most", "below"))  # fmt: skip
    low, high = max(least, above), min(most, below)
    if not math.isfinite(high):
        return "" if not math.isfinite(low) else f"{'>' if low == above else '≥'} {low:g}"
    if not math.isfinite(low):
        return f"{'<' if high == below else '≤'} {high:g}"
    outside = [f"{low:g}"] * (low == above) + [f"{high:g}"] * (high == below)
    return f"{low:g} to {high:g}" + (f", without {' and '.join(outside)}" if outside else "")


def default_of(field: dataclasses.Field[Any]) -> str:
    """A field's default, as YAML has it; nothing of what the documents explain in words."""
    if field.default_factory is not dataclasses.MISSING:
        made = field.default_factory()
        return "[]" if made == [] else ""
    if isinstance(field.default, str):
        return f"`{field.default}`" if field.default else "(none)"
    if field.default is None or isinstance(field.default, bool):
        return {True: "true", False: "false", None: ""}[field.default]
    return str(field.default)


def own_fields(schema: Any, prefix: str = "") -> Iterable[tuple[str, dataclasses.Field[Any]]]:
    """The fields below a dataclass with their dotted paths; a list is one field."""
    for field in dataclasses.fields(schema):
        if dataclasses.is_dataclass(field.type):
            yield from own_fields(field.type, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}", field


def rows_of(schema: Any, *, defaults: bool, skip: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """The rows of a table of fields: path, maybe default, unit, limits, meaning."""
    return [
        (
            f"`{path}`",
            *([default_of(field)] if defaults else []),
            field.metadata.get(UNIT, ""),
            limits(field.metadata.get(BOUNDS, ()), field.metadata.get(CHOICES, ())),
            field.metadata[TEXT],
        )
        for path, field in own_fields(schema)
        if path not in skip
    ]


def scenario_fields() -> str:
    """Every field of a scenario but those of its lists."""
    rows = rows_of(Scenario, defaults=True, skip=("course", "mission"))
    return table(("field", "default", "unit", "limits", "meaning"), rows)


def course_fields() -> str:
    """The fields of a stretch of the course, with the kinds that have them."""
    found = []
    for path, *rest in rows_of(Element, defaults=False):
        kinds = [kind for kind, fields in FIELDS_OF_KIND.items() if path.strip("`") in fields]
        missing = [kind for kind in FIELDS_OF_KIND if kind not in kinds]
        words = ", ".join(kinds) if len(missing) > 1 else f"all but {missing[0]}"
        found.append((path, words if kinds else "all", *rest))
    return table(("`course[i].`", "of", "unit", "limits", "meaning"), found)


def list_fields(name: str, schema: Any) -> str:
    """The fields of an element of another list."""
    heads = (f"`{name}[i].`", "unit", "limits", "meaning")
    return table(heads, rows_of(schema, defaults=False))


BLOCKS: dict[str, Callable[[], str]] = {
    "log_columns": log_columns,
    "summary_keys": summary_keys,
    "scenario_fields": scenario_fields,
    "course_fields": course_fields,
    "mission_fields": lambda: list_fields("mission", MissionElement),
    "push_fields": lambda: list_fields("disturbances.pushes", PushConfig),
    "motor_fields": lambda: list_fields("disturbances.motor_strength", MotorStrengthConfig),
}


def renew(text: str) -> str:
    """A page with its generated parts as the schema has them."""
    return BLOCK.sub(lambda found: f"{found[1]}\n{BLOCKS[found[2]]()}\n{found[3]}", text)


def main() -> None:
    """Renews the pages that have generated parts."""
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if (renewed := renew(text)) != text:
            page.write_text(renewed, encoding="utf-8")
            print(f"renewed {page.name}")


if __name__ == "__main__":
    main()
