"""A sweep's section of a Markdown page, and the pages that hold such sections."""

import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

from drake_quad.errors import InputError
from drake_quad.given_files import MOST_TEXT, read_given_text
from drake_quad.report.svg import stand_alone
from drake_quad.sweep.caveats import caveats_of
from drake_quad.sweep.charts import curves_svg
from drake_quad.sweep.markdown import in_line, paragraph
from drake_quad.sweep.verdict import gate_words
from drake_quad.whole_files import write_whole

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
