"""report.html: one self-contained page that says how a run went, and shows it."""

from pathlib import Path

from markupsafe import Markup

from drake_quad.given_files import MOST_YAML, read_given_text
from drake_quad.report.bounds import bounds
from drake_quad.report.figure_clock import NAMES
from drake_quad.report.figure_list import FIGURES, FigureKind
from drake_quad.report.happenings import mode_bands, push_marks
from drake_quad.report.packing import pack, round_recording
from drake_quad.report.replay import make_replay_html
from drake_quad.report.run_files import SCENARIO, Run, read_run
from drake_quad.report.style import KIND_COLOURS, LEG_COLOURS, LEG_NAMES, MODE_COLOURS, PUSH_COLOUR
from drake_quad.report.svg import report_style, to_svg
from drake_quad.report.tables import segment_rows, summary_rows
from drake_quad.report.tables_pushes import push_rows, recovery_rows
from drake_quad.report.templates import read_css, render
from drake_quad.report.verdict import judge
from drake_quad.stability.safety import safe_margin
from drake_quad.whole_files import write_whole

REPORT = "report.html"


def build_report(directory: Run | str | Path, *, replay: bool = True) -> Path:
    """Writes `report.html` beside a finished run's files.

    It needs nothing else: no network, no other file. What the run's files lack, it leaves out.

    Args:
        directory: The run's, or the run.
        replay: Whether to embed the 3D replay, which makes up most of the page's size.

    Returns:
        The page's path.

    Raises:
        InputError: The directory holds no run.
    """
    run = directory if isinstance(directory, Run) else read_run(directory)
    page = render(
        "report.html",
        css=Markup(read_css("report.css")),
        run=run,
        verdict=judge(run),
        bounds=bounds(run),
        figures=_draw_figures(run),
        replay=pack(round_recording(make_replay_html(run))) if replay and len(run.log) else "",
        safe=safe_margin(run.robot),
        segments=segment_rows(run),
        pushes=push_rows(run),
        recoveries=recovery_rows(run),
        differs=run.world is not run.course,
        marks=_marks(run),
        rows=summary_rows(run.summary),
        versions=run.summary.get("versions") or {},
        scenario_text=read_given_text(run.directory / SCENARIO, most=MOST_YAML),
        kind_colours=KIND_COLOURS,
        legs=list(zip(LEG_NAMES, LEG_COLOURS, strict=True)),
    )
    path = run.directory / REPORT
    write_whole(path, lambda p: p.write_text(page, encoding="utf-8"))
    return path


def _marks(run: Run) -> list[tuple[str, str]]:
    """What the page has to explain of its figures over time: names and colours."""
    there = {band.mode for band in mode_bands(run)}
    marks = [(NAMES[mode], colour) for mode, colour in MODE_COLOURS.items() if mode in there]
    return [*marks, ("push", PUSH_COLOUR)] if push_marks(run) else marks


def _draw_figures(run: Run) -> list[tuple[FigureKind, Markup]]:
    """The figures that the run's files can fill, as SVG."""
    if not len(run.log):
        return []
    with report_style():
        return [
            (kind, Markup(to_svg(kind.draw(run), name=kind.name, label=kind.title)))
            for kind in FIGURES
            if not (kind.physics and run.kinematic) and kind.wanted(run)
        ]
