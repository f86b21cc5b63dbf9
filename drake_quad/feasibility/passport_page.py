"""A passport as a page of Markdown, as a table's cells, and as files."""

import json
from pathlib import Path

from drake_quad.feasibility.passport import BuiltOtherwise, Entry, Passport
from drake_quad.feasibility.standard_stairs import BUILDS
from drake_quad.util.files import write_whole

PASSPORT = "passport.json"
ANSWERS = {"yes": "yes", "no": "no, proven", "unknown": "unknown"}
PREFERRED = {"margin": "margin", "balanced": "margin and speed", "speed": "speed"}


def write_passport(passport: Passport, directory: Path) -> None:
    """Writes passport.json, passport.md and the picture, passport.svg and passport.png.

    Raises:
        InputError: If they cannot be written.
    """
    from drake_quad.feasibility.passport_picture import save_passport_picture

    text = json.dumps(passport.as_dict(), indent=2) + "\n"
    write_whole(directory / PASSPORT, lambda to: to.write_text(text, encoding="utf-8"))
    page = passport_page(passport)
    write_whole(directory / "passport.md", lambda to: to.write_text(page, encoding="utf-8"))
    save_passport_picture(passport, directory)


def passport_page(passport: Passport, picture: str = "passport.svg") -> str:
    """The passport as a page of Markdown.

    Args:
        passport: The passport.
        picture: Path of its picture from the page.
    """
    yes = [one for one in passport.entries if one.verdict == "yes"]
    tried = any(one.trials for one in passport.entries)
    lines = [
        f"# {passport.name}: stairs that it climbs",
        "",
        f"{len(yes)} of {len(passport.entries)} kinds of stairs by common rules, flights of "
        f"{passport.count} steps, up and, after a turn, down. Robot mass {passport.mass:.1f} kg, "
        f"legs {passport.leg:.2f} m. The gaits are designed for {PREFERRED[passport.prefer]}. The "
        f"answers assume {passport.assumes}." + (f" {passport.drawn}" if passport.drawn else ""),
        "",
        f"![Flights to scale, with answers]({picture})",
        "",
        "| " + " | ".join(passport_columns(tried=tried)) + " |",
        "|---|---|---|---:|---:|---|" + "---|" * (1 + 2 * tried),
    ]
    lines += [
        "| " + " | ".join(passport_cells(one, tried=tried)) + " |" for one in passport.entries
    ]
    lines += ["", "Rules: " + "; ".join(f"{one.stairs.name}: {one.stairs.source}"
                                         for one in passport.entries) + "."]  # fmt: skip
    return "\n".join(lines) + "\n"


def passport_columns(*, tried: bool) -> list[str]:
    """Heads of the table."""
    heads = ["stairs", "rise × run [m]", "answer", "margin [mm]", "speed [m/s]", "nearest limit"]
    heads.append(" or ".join(build.name for build in BUILDS))
    return [*heads, "reached the goal", "cost of transport"] if tried else heads


def passport_cells(entry: Entry, *, tried: bool) -> list[str]:
    """A row of the table, for people."""
    answer = ANSWERS[entry.verdict]
    if entry.short and entry.wanted is not None:
        answer = f"yes, below the {1e3 * entry.wanted:.0f} mm wanted"
    row = [
        entry.stairs.name,
        f"{entry.stairs.rise:g} × {entry.stairs.run:g}",
        answer,
        "-" if entry.margin is None else f"{1e3 * entry.margin:.0f}",
        "-" if entry.speed is None else f"{entry.speed:.3f}",
        entry.limit or "-",
        _built_cell(entry),
    ]
    return [*row, *_tried_cells(entry)] if tried else row


def _built_cell(entry: Entry) -> str:
    """What is made of the same flight, built otherwise."""
    if not entry.others or entry.margin is None:
        return "-"
    told = [_built_words(other, entry.margin) for other in entry.others]
    return told[0] if len(set(told)) == 1 else "; ".join(told)


def _built_words(other: BuiltOtherwise, closed: float) -> str:
    """The plan's margin, or that it is the same."""
    if other.margin is None:
        return "unknown"
    if other.same_gait and abs(other.margin - closed) < 0.5e-3:
        return "the same"
    return f"{1e3 * other.margin:.0f} mm" + ("" if other.same_gait else ", another gait")


def _tried_cells(entry: Entry) -> list[str]:
    """Rate, and the joints' work over weight and way."""
    if entry.trials is None:
        return ["-", "-"]
    cost = entry.trials["cost_of_transport"]
    return [entry.trials["text"], "-" if cost is None else f"{cost:.2f}"]
