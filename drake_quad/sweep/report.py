"""A sweep's report.html, and its section of a Markdown page."""

import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from drake_quad.errors import InputError
from drake_quad.report.html import read_css, stand_alone
from drake_quad.sweep.charts import curves_svg, map_svg
from drake_quad.sweep.replays import otherwise, replays_in
from drake_quad.sweep.results import REPORT, read_table
from drake_quad.sweep.statistics import caveats_of, gate_words, grade
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import as_plain
from drake_quad.sweep.trials import repeat_into
from drake_quad.systems.stability_monitor import NO_SUPPORT
from drake_quad.util.files import MOST_TEXT, read_given_text, write_whole

# ------------------------------------------------------------------------------------------------
# What a sweep leaves for people: report.html.
# ------------------------------------------------------------------------------------------------


def write_sweep_report(study: Study, told: dict[str, Any], out: Path) -> None:
    """Writes report.html into `out`, the sweep's directory, where its table is.

    Trials that were run again into the directory that their command names are linked.
    """
    ends = otherwise(read_table(out), out)
    replays = {k: path.relative_to(out).as_posix() for k, path in replays_in(out).items()}
    worst = []
    for row in told["worst"]:
        command = repeat_into(row["command"], row["index"], out)
        link = replays.pop(row["index"], "")
        here = ends.get(row["index"], "")
        worst.append({**row, "link": link, "here": here, "repeat": command})
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
        undefined=StrictUndefined, trim_blocks=True,
    )  # fmt: skip
    # A single band is all trials over again.
    bands = {name: own for name, own in told["bands"].items() if len(own) > 1 and told["trials"]}
    maps = [Markup(map_svg(one, k)) for k, one in enumerate(told["maps"]) if told["trials"]]
    text = environment.get_template("sweep.html").render(
        told=told,
        name=out.resolve().name,
        grade=grade(told),
        css=Markup(read_css("report.css")),
        curves=Markup(curves_svg(bands)) if bands else "",
        maps=maps,
        worst=worst,
        replays=replays,
        bands=bands,
        no_support=NO_SUPPORT,
        caveats=caveats_of(told),
        asked=gate_words(told),
        cells=any(row["cell"] for row in worst),
        definition=_definition(study),
    )
    write_whole(out / REPORT, lambda to: to.write_text(text, encoding="utf-8"))


def _definition(study: Study) -> str:
    """The study as YAML, without what it leaves at the defaults."""
    plain, default = as_plain(study), as_plain(Study())
    plain["vary"] = [
        {key: value for key, value in vary.items() if value not in (None, "", [])}
        for vary in plain["vary"]
    ]
    shown = {key: value for key, value in plain.items() if value != default[key]}
    return str(yaml.safe_dump(shown, sort_keys=False, allow_unicode=True, width=100))


# ------------------------------------------------------------------------------------------------
# People's own words in Markdown: shown as they are, whatever they look like.
# ------------------------------------------------------------------------------------------------


# What Markdown, with tables and formulas, would take for its own anywhere in a line; `_` is none
# within a word, `[` none but of a link, `&` none but of an entity.
_MARKS = re.compile(r"[\\`*|$~]|(?<!\w)_|_(?!\w)|\](?=[(\[:])|&(?=#?\w+;)")
_BEGINNINGS = re.compile(r"^(?:(\d+)(?=[.)])|(?=[#>+=-]))")  # of a line: a list, a heading, ...


def in_line(words: str) -> str:
    """Within a line, or a table's cell: one line, without a mark.

    `<` is written as an entity, so that no comment is in it, which parts a page in sections.
    """
    return _MARKS.sub(r"\\\g<0>", " ".join(words.split())).replace("<", "&lt;")


def paragraph(words: str) -> str:
    """The same as a paragraph of its own: nor is its beginning a list's or a heading's."""
    return _BEGINNINGS.sub(r"\1\\", in_line(words))


# ------------------------------------------------------------------------------------------------
# A sweep's section of a Markdown page, and the pages that hold such sections.
# ------------------------------------------------------------------------------------------------


TITLE = """\
# Success maps

How often it works, and where it stops working. Each section is written by the command that it names
and holds figures of that command alone, at the commit that it names.
"""


def write_section(page: Path, told: dict[str, Any], command: str, name: str) -> None:
    """Writes the study's section of a Markdown page; all else on it stays.

    Where trials failed its curves are drawn, in a file in a directory that is called like the page.

    Raises:
        InputError: If it cannot be written.
    """
    written = section(told, command, name)
    bands = {title: own for title, own in told["bands"].items() if len(own) > 1}
    if told["causes"] and bands:
        drawn = page.with_suffix("") / f"{name}.svg"
        svg = stand_alone(curves_svg(bands))
        write_whole(drawn, lambda to: to.write_text(svg, encoding="utf-8"), option="--page")
        place = quote(drawn.relative_to(page.parent).as_posix())
        written += f"\n\n![Part of the trials that succeeded, over what varies]({place})"
    put_section(page, name, written)


def put_section(page: Path, name: str, written: str, *, option: str = "--page") -> None:
    """Writes `written` as the section `name` of a Markdown page; all else on it stays.

    Args:
        page: Its file.
        name: Of the section.
        written: What is to stand there.
        option: By which the page was asked for, to be named by errors.

    Raises:
        InputError: If it cannot be written.
    """
    text, begin, end = check_page(page, name, option=option)
    if begin not in text:
        text = text.rstrip("\n") + f"\n\n{begin}\n{end}\n"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    text = pattern.sub(lambda _: f"{begin}\n{written}\n{end}", text, count=1)
    write_whole(page, lambda to: to.write_text(text, encoding="utf-8"), option=option)


def check_page(page: Path, name: str, *, option: str = "--page") -> tuple[str, str, str]:
    """The page's text as it is, and the marks between which the section `name` goes.

    Args: as of `put_section`.

    Raises:
        InputError: If no section can be written there.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=option, field="page", value=str(page), remedy=remedy)

    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    try:
        if page.is_dir():
            raise refuse("is a directory; give a Markdown file in it")
        if page.exists() and not page.is_file():  # to be in place of /dev/null would harm
            raise refuse("is no file that could be written anew; give a Markdown file")
        text = read_given_text(page, most=MOST_TEXT) if page.exists() else TITLE
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) else "not a text file"
        raise refuse(f"cannot be read: {reason}; give a Markdown file") from None
    counts = text.count(begin), text.count(end)
    if counts not in ((0, 0), (1, 1)) or text.find(begin) > text.find(end):
        raise refuse(f"must have both {begin} and, after it, {end}, once each, or none of them")
    return text, begin, end


def section(told: dict[str, Any], command: str, name: str) -> str:
    """The section in Markdown: rate, bands, causes, and the commands that repeat failures."""
    versions = ", ".join(f"{library} {number}" for library, number in told["versions"].items())
    rate = told["rate"]
    about = [f"{paragraph(told['description'])}.", ""] if told["description"].strip() else []
    lines = [
        f"## {in_line(name)}", "", *about, "```", command, "```", "",
        f"commit {in_line(told['commit']) or 'unknown'}; {in_line(versions)}.", "",
        f"**{rate['good']} of {rate['trials']}** trials succeeded: {rate['text']}, exact bounds at"
        " 95 %" + (f"; {in_line(asked)}." if (asked := gate_words(told)) else "."),
    ]  # fmt: skip
    for line in caveats_of(told):
        lines += ["", line]
    for title, bands in told["bands"].items():
        if len(bands) > 1:
            lines += ["", f"| {in_line(title)} | trials | succeeded | with bounds at 95 % |"]
            lines += ["| --- | ---: | ---: | ---: |"]
            lines += [
                f"| {in_line(b['label'])} | {b['trials']} | {b['good']} | {b['text']} |"
                for b in bands
            ]
    known = {name: own for name, own in told["figures"].items() if own["least"] is not None}
    if known:
        lines += ["", "Over all trials that measured them, SI units:", ""]
        lines += ["| figure | least | 5 % | median | 95 % | greatest |"]
        lines += ["| --- | ---: | ---: | ---: | ---: | ---: |"]
        lines += [
            f"| {in_line(name)} | " + " | ".join(f"{value:.3g}" for value in own.values()) + " |"
            for name, own in known.items()
        ]
    if told["causes"]:
        lines += ["", "Those that failed:", ""]
        lines += [f"- {row['trials']} × {in_line(row['cause'])}" for row in told["causes"]]
        failed = [row for row in told["worst"] if row["outcome"] != "goal_reached"]
        lines += [
            "",
            f"The worst of them, trial {failed[0]['index']} ({failed[0]['outcome']}), again, at"
            " that commit:",
            "",
            "```",
            failed[0]["command"],
            "```",
        ]
    return "\n".join(lines)
