"""What a sweep leaves for people: report.html, and a section of a Markdown page."""

import re
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from drake_quad.errors import InputError
from drake_quad.report.templates import read_css
from drake_quad.sweep.charts import curves_svg, map_svg
from drake_quad.sweep.markdown import in_line, paragraph
from drake_quad.sweep.replays import otherwise, replays_in
from drake_quad.sweep.study import as_plain
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.sweep import REPORT
from drake_quad.sweep.table import read_table
from drake_quad.sweep.trials import repeat_into
from drake_quad.whole_files import write_whole

# Said of studies with `draws: common`.
SHARED = (
    "All cells have the same draws: bounds hold in each alone, and may be too narrow over several."
)
TITLE = """\
# Success maps

How often it works, and where it stops working. Each section is written by the command that it names
and holds figures of that command alone, at the commit that it names.
"""


def write_report(study: Study, told: dict[str, Any], out: Path) -> None:
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
    bands = {name: own for name, own in told["bands"].items() if any(b["trials"] for b in own)}
    text = environment.get_template("sweep.html").render(
        told=told,
        name=out.resolve().name,
        grade=grade(told),
        css=Markup(read_css("report.css")),
        curves=Markup(curves_svg(bands)) if bands else "",
        maps=[Markup(map_svg(one, k)) for k, one in enumerate(told["maps"])] if bands else [],
        worst=worst,
        replays=replays,
        shared=SHARED if told["sharing"] > 1 else "",
        cells=any(row["cell"] for row in worst),
        definition=_definition(study),
    )
    write_whole(out / REPORT, lambda to: to.write_text(text, encoding="utf-8"))


def grade(told: dict[str, Any]) -> str:
    """The colour of the page's head: good, warn or bad; without a gate all have to succeed."""
    rate = told["rate"]
    if told["passed"] is False or not rate["good"]:
        return "bad"
    well = told["passed"] if told["gate"] is not None else rate["good"] == rate["trials"]
    return "good" if well and told["complete"] and not told["kinematic"] else "warn"


def write_section(page: Path, told: dict[str, Any], command: str, name: str) -> None:
    """Writes the study's section of a Markdown page; all else on it stays.

    Raises:
        InputError: If it cannot be written.
    """
    put_section(page, name, section(told, command, name))


def put_section(page: Path, name: str, written: str) -> None:
    """Writes `written` as the section `name` of a Markdown page; all else on it stays.

    Raises:
        InputError: If it cannot be written.
    """
    text, begin, end = check_page(page, name)
    if begin not in text:
        text = text.rstrip("\n") + f"\n\n{begin}\n{end}\n"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    text = pattern.sub(lambda _: f"{begin}\n{written}\n{end}", text, count=1)
    write_whole(page, lambda to: to.write_text(text, encoding="utf-8"), option="--page")


def check_page(page: Path, name: str) -> tuple[str, str, str]:
    """The page's text as it is, and the marks between which the section `name` goes.

    Raises:
        InputError: If no section can be written there.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source="--page", field="page", value=str(page), remedy=remedy)

    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    try:
        if page.is_dir():
            raise refuse("is a directory; give a Markdown file in it")
        text = page.read_text(encoding="utf-8") if page.exists() else TITLE
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
        f"commit {told['commit'] or 'unknown'}; {versions}.", "",
        f"**{rate['good']} of {rate['trials']}** trials succeeded: {rate['text']}, exact bounds at"
        " 95 %." + ("" if told["complete"] else f" The study asks for {told['asked']} trials."),
    ]  # fmt: skip
    if told["sharing"] > 1:
        lines += ["", SHARED]
    for title, bands in told["bands"].items():
        if len(bands) > 1:
            lines += ["", f"| {in_line(title)} | trials | succeeded | with bounds at 95 % |"]
            lines += ["| --- | ---: | ---: | ---: |"]
            lines += [
                f"| {in_line(b['label'])} | {b['trials']} | {b['good']} | {b['text']} |"
                for b in bands
            ]
    if told["causes"]:
        lines += ["", "Those that failed:", ""]
        lines += [f"- {row['trials']} × {in_line(row['cause'])}" for row in told["causes"]]
        failed = [row for row in told["worst"] if row["outcome"] != "goal_reached"]
        lines += ["", "The first of them again:", "", "```", failed[0]["command"], "```"]
    return "\n".join(lines)


def _definition(study: Study) -> str:
    """The study as YAML, without what it leaves at the defaults."""
    plain, default = as_plain(study), as_plain(Study())
    plain["vary"] = [
        {key: value for key, value in vary.items() if value not in (None, "", [])}
        for vary in plain["vary"]
    ]
    shown = {key: value for key, value in plain.items() if value != default[key]}
    return str(yaml.safe_dump(shown, sort_keys=False, allow_unicode=True, width=100))
