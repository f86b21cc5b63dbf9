"""A sweep's report.html, and its section of a Markdown page."""

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pyarrow as pa
import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from drake_quad.errors import InputError, PlanningError
from drake_quad.report.lcm_replay import write_scene_log
from drake_quad.report.page import REPORT as RUN_REPORT, write_report
from drake_quad.report.style import read_css, stand_alone
from drake_quad.runs.result import write_files
from drake_quad.simulation.run import simulate
from drake_quad.sweep.charts import curves_svg, map_svg
from drake_quad.sweep.findings import worst_first
from drake_quad.sweep.results import REPORT, read_table
from drake_quad.sweep.statistics import caveats_of, gate_words, grade
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.study_loading import as_plain
from drake_quad.sweep.trials import TRIALS_DIRECTORY, directory_of, make_trials, repeat_into
from drake_quad.systems.stability_monitor import NO_SUPPORT
from drake_quad.util.files import (
    MOST_JSON,
    MOST_TEXT,
    plain_of,
    read_given,
    read_given_text,
    write_whole,
)

# What Markdown, with tables and formulas, would take for its own anywhere in a line; `_` is none
# within a word, `[` none but of a link, `&` none but of an entity.
_MARKS = re.compile(r"[\\`*|$~]|(?<!\w)_|_(?!\w)|\](?=[(\[:])|&(?=#?\w+;)")
_BEGINNINGS = re.compile(r"^(?:(\d+)(?=[.)])|(?=[#>+=-]))")  # of a line: a list, a heading, ...

TITLE = """\
# Success maps

How often the robot succeeds, and under which conditions it stops succeeding. The command and the
commit that a section names have made all of its figures.
"""

# Trials with these outcomes had no run, or would end this process too.
NO_RUN = ("refused", "infeasible", "crashed", "killed", "memory", "timeout", "error")


def write_sweep_report(study: Study, findings: dict[str, Any], out: Path) -> None:
    """Writes report.html into `out`, the sweep's directory, with links to replays in it."""
    ends = otherwise(read_table(out), out)
    replays = {k: path.relative_to(out).as_posix() for k, path in replays_in(out).items()}
    worst = []
    for row in findings["worst"]:
        command = repeat_into(row["command"], row["index"], out)
        link = replays.pop(row["index"], "")
        here = ends.get(row["index"], "")
        worst.append({**row, "link": link, "here": here, "repeat": command})
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
        undefined=StrictUndefined, trim_blocks=True,
    )  # fmt: skip
    # A single band would repeat the rate of all trials.
    bands = {
        name: own for name, own in findings["bands"].items() if len(own) > 1 and findings["trials"]
    }
    maps = [Markup(map_svg(one, k)) for k, one in enumerate(findings["maps"]) if findings["trials"]]
    text = environment.get_template("sweep.html").render(
        findings=findings,
        name=out.resolve().name,
        grade=grade(findings),
        css=Markup(read_css("report.css")),
        curves=Markup(curves_svg(bands)) if bands else "",
        maps=maps,
        worst=worst,
        replays=replays,
        bands=bands,
        no_support=NO_SUPPORT,
        caveats=caveats_of(findings),
        asked=gate_words(findings),
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


def in_line(words: str) -> str:
    """Words within a line or a table's cell, with every mark escaped.

    `<` becomes an entity, so that words cannot hold a comment, by which a page has its sections.
    """
    return _MARKS.sub(r"\\\g<0>", " ".join(words.split())).replace("<", "&lt;")


def paragraph(words: str) -> str:
    """Words as a paragraph: as `in_line`, and its beginning is no list's or heading's."""
    return _BEGINNINGS.sub(r"\1\\", in_line(words))


def write_section(page: Path, findings: dict[str, Any], command: str, name: str) -> None:
    """Writes the study's section of a Markdown page; all else on it stays.

    If trials failed, its curves go into a file in a directory that has the page's name.

    Raises:
        InputError: If it cannot be written.
    """
    written = section(findings, command, name)
    bands = {title: own for title, own in findings["bands"].items() if len(own) > 1}
    if findings["causes"] and bands:
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
        name: Name of the section.
        written: Text of the section.
        option: Option that asked for the page, named by errors.

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
    """The page's text, and the marks between which the section `name` stands.

    Args:
        page: The page's file.
        name: Name of the section.
        option: Option that asked for the page, named by errors.

    Raises:
        InputError: If no section can be written there.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=option, field="page", value=str(page), remedy=remedy)

    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    try:
        if page.is_dir():
            raise refuse("is a directory; give a Markdown file in it")
        if page.exists() and not page.is_file():  # replacing /dev/null would do harm
            raise refuse("is no file that could be written anew; give a Markdown file")
        text = read_given_text(page, most=MOST_TEXT) if page.exists() else TITLE
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) else "not a text file"
        raise refuse(f"cannot be read: {reason}; give a Markdown file") from None
    counts = text.count(begin), text.count(end)
    if counts not in ((0, 0), (1, 1)) or text.find(begin) > text.find(end):
        raise refuse(f"must have both {begin} and, after it, {end}, once each, or none of them")
    return text, begin, end


def section(findings: dict[str, Any], command: str, name: str) -> str:
    """The section in Markdown: rate, bands, causes, and the commands that repeat failures."""
    versions = ", ".join(f"{library} {number}" for library, number in findings["versions"].items())
    rate = findings["rate"]
    about = (
        [f"{paragraph(findings['description'])}.", ""] if findings["description"].strip() else []
    )
    lines = [
        f"## {in_line(name)}", "", *about, "```", command, "```", "",
        f"commit {in_line(findings['commit']) or 'unknown'}; {in_line(versions)}.", "",
        f"**{rate['good']} of {rate['trials']}** trials succeeded: {rate['text']}, exact bounds at"
        " 95 %" + (f"; {in_line(asked)}." if (asked := gate_words(findings)) else "."),
    ]  # fmt: skip
    for line in caveats_of(findings):
        lines += ["", line]
    for title, bands in findings["bands"].items():
        if len(bands) > 1:
            lines += ["", f"| {in_line(title)} | trials | succeeded | with bounds at 95 % |"]
            lines += ["| --- | ---: | ---: | ---: |"]
            lines += [
                f"| {in_line(b['label'])} | {b['trials']} | {b['good']} | {b['text']} |"
                for b in bands
            ]
    known = {name: own for name, own in findings["figures"].items() if own["least"] is not None}
    if known:
        lines += ["", "Over all trials that measured them, in SI units:", ""]
        lines += ["| figure | least | 5 % | median | 95 % | greatest |"]
        lines += ["| --- | ---: | ---: | ---: | ---: | ---: |"]
        lines += [
            f"| {in_line(name)} | " + " | ".join(f"{value:.3g}" for value in own.values()) + " |"
            for name, own in known.items()
        ]
    if findings["causes"]:
        lines += ["", "Causes of failure:", ""]
        lines += [f"- {row['trials']} × {in_line(row['cause'])}" for row in findings["causes"]]
        failed = [row for row in findings["worst"] if row["outcome"] != "goal_reached"]
        lines += [
            "",
            f"To run the worst of them again at that commit, trial {failed[0]['index']} "
            f"({in_line(failed[0]['outcome'])}):",
            "",
            "```",
            failed[0]["command"],
            "```",
        ]
    return "\n".join(lines)


def replayable(table: pa.Table, count: int) -> list[int]:
    """Indices of the worst trials that had a run, the worst first, `count` at most."""
    indices, outcomes = table["index"].to_pylist(), table["outcome"].to_pylist()
    return [indices[k] for k in worst_first(table) if outcomes[k] not in NO_RUN][:count]


def replays_in(out: Path) -> dict[int, Path]:
    """The report of each trial that was run again, by index."""
    found = sorted((out / TRIALS_DIRECTORY).glob(f"*/{RUN_REPORT}"))
    return {int(path.parent.name): path for path in found if path.parent.name.isdecimal()}


def otherwise(table: pa.Table, out: Path) -> dict[int, str]:
    """Outcomes of trials that were run again and ended otherwise than in the sweep, by index.

    Numerical libraries choose their instructions by the processor: on another processor the last
    digits differ, and a trial that nearly fell may fall.
    """
    ended = dict(zip(table["index"].to_pylist(), table["outcome"].to_pylist(), strict=True))
    found = {}
    for index, report in replays_in(out).items():
        summary = None
        with suppress(OSError):  # a report alone does not say how it ended
            summary = plain_of(read_given(report.parent / "summary.json", most=MOST_JSON))
        outcome = (summary or {}).get("outcome")
        # A missed bound is the sweep's judgement: the run itself reached its goal.
        was = ended.get(index, "").replace("bound_missed", "goal_reached")
        if isinstance(outcome, str) and outcome != was:
            found[index] = outcome
    return found


def make_replays(
    study: Study, base: Base, indices: Sequence[int], out: Path,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[list[int], dict[int, str]]:  # fmt: skip
    """Runs those of the trials again that have no report yet.

    A run that is stopped leaves nothing: its files would be taken for the whole trial's.

    Returns:
        Indices of those that ran; and why others have no run here, by index: a plan that was just
        possible on the sweep's processor may be impossible on another.

    Raises:
        InputError: If their files cannot be written.
    """
    there = replays_in(out)
    made: list[int] = []
    without: dict[int, str] = {}
    for index in indices:
        if index in there:
            continue
        (trial,) = make_trials(study, base, first=index, last=index + 1)
        try:
            result = simulate(base.load(list(trial.overrides)), source=base.name, stop=stop)
        except (InputError, PlanningError) as error:
            without[index] = str(error)
            continue
        if stop():
            break
        directory = directory_of(index, out)
        directory.mkdir(parents=True, exist_ok=True)
        write_files(result, result.scenario, directory)
        write_scene_log(directory)
        write_report(directory)  # last, because it marks the files as whole
        made.append(index)
    return made, without
