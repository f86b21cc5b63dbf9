"""What a sweep leaves for people: report.html."""

from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from drake_quad.report.templates import read_css
from drake_quad.sweep.caveats import caveats_of
from drake_quad.sweep.charts import curves_svg, map_svg
from drake_quad.sweep.replays import otherwise, replays_in
from drake_quad.sweep.study import as_plain
from drake_quad.sweep.study_config import Study
from drake_quad.sweep.sweep import REPORT
from drake_quad.sweep.table_read import read_table
from drake_quad.sweep.trials import repeat_into
from drake_quad.sweep.verdict import gate_words, grade
from drake_quad.systems.stability_monitor import NO_SUPPORT
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
