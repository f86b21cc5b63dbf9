"""What a sweep leaves for people: report.html."""

from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from drake_quad.report.templates import read_css
from drake_quad.sweep.charts import curves_svg, map_svg
from drake_quad.sweep.replays import otherwise, replays_in
from drake_quad.sweep.section import SHARED
from drake_quad.sweep.study import as_plain
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.sweep import REPORT
from drake_quad.sweep.table import read_table
from drake_quad.sweep.trials import repeat_into
from drake_quad.whole_files import write_whole


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


def _definition(study: Study) -> str:
    """The study as YAML, without what it leaves at the defaults."""
    plain, default = as_plain(study), as_plain(Study())
    plain["vary"] = [
        {key: value for key, value in vary.items() if value not in (None, "", [])}
        for vary in plain["vary"]
    ]
    shown = {key: value for key, value in plain.items() if value != default[key]}
    return str(yaml.safe_dump(shown, sort_keys=False, allow_unicode=True, width=100))
