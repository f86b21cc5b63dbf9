"""Writes a run's report: report.html and its figures."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from drake_quad.report.derived import clock_stops, push_events
from drake_quad.report.figures_course import (
    draw_base_error,
    draw_footprints,
    draw_side,
    draw_trajectories,
)
from drake_quad.report.figures_gait import (
    NAMES,
    draw_clock,
    draw_forces,
    draw_gait,
    draw_speeds,
    draw_torques,
    stood_still,
)
from drake_quad.report.figures_margin import (
    draw_estimate,
    draw_margin,
    draw_regions,
    was_estimated,
    was_measured,
)
from drake_quad.report.html import pack, read_css, render, report_style, round_recording, to_svg
from drake_quad.report.replay import make_replay_html
from drake_quad.report.style import KIND_COLOURS, LEG_COLOURS, LEG_NAMES, MODE_COLOURS, PUSH_COLOUR
from drake_quad.report.tables import bounds, push_rows, recovery_rows, segment_rows, summary_rows
from drake_quad.report.verdict import grade_run
from drake_quad.runs.reader import SCENARIO, RecordedRun, load_run
from drake_quad.stability.safety import safe_margin
from drake_quad.util.files import MOST_YAML, read_given_text, write_whole

# ------------------------------------------------------------------------------------------------
# The figures of a run's page, in their order, with what is said of each.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FigureKind:
    """A figure of the page.

    Attributes:
        name: Of its place in the page.
        title: Over it.
        caption: Under it.
        draw: Makes it.
        physics: Whether it shows what a kinematic replay has not.
        wanted: Whether a run has anything to show in it.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[RecordedRun], Figure]
    physics: bool = False
    wanted: Callable[[RecordedRun], bool] = lambda _: True


FIGURES = (
    FigureKind(
        "margin",
        "Stability margin",
        "Distance from the projected centre of mass of the whole robot to the nearest side of the "
        "support polygon: positive inside. Measured over the feet that bear, planned over those "
        "that were to. The zero-moment point's margin counts the accelerations too.",
        draw_margin,
    ),
    FigureKind(
        "regions",
        "Margins within friction and torque, and pushes",
        "Signed distance of the centre of mass from the border of where the feet's forces can "
        "balance it: within their friction cones; within the joints' torque limits too; and with "
        "what its acceleration asks for besides the weight. Dashed as planned. Bands: red outside, "
        "amber under a margin that is safe. Below, the capture point's distance from where the "
        "feet's pressure can hold it, and the least push of all directions that would take a step.",
        draw_regions,
        physics=True,
        wanted=was_measured,
    ),
    FigureKind(
        "footprints",
        "Footprints from above",
        "Where each foot stood (left round, right square), the paths of body and centre of mass, "
        "and the support polygon at the moment of the least margin. The higher the ground, the "
        "stronger its tint; lines across are nosings.",
        draw_footprints,
    ),
    FigureKind(
        "side",
        "The course from the side",
        "The lanes of the course laid out straight, with the lowest points of the feet and the "
        "centre of mass.",
        draw_side,
    ),
    FigureKind(
        "trajectories",
        "Trajectories of the body, leg 1 and leg 2",
        "Body centre and foot centres in the world frame.",
        draw_trajectories,
    ),
    FigureKind(
        "gait",
        "Gait diagram",
        "A bar while a foot stands: pale or outlined as planned, full as sensed (more than 1 % of "
        "the robot's weight on it). Red: it was to stand and lost "
        "the ground, beyond 0.1 s of delay at touchdown or lift-off.",
        draw_gait,
    ),
    FigureKind(
        "torques",
        "Joint torques against their limits",
        "Ratio to the limit, dashed at ±1; the ring marks the greatest of all.",
        draw_torques,
        physics=True,
    ),
    FigureKind(
        "speeds",
        "Joint speeds against their limits",
        "Ratio to the limit, dashed at ±1; the ring marks the greatest of all.",
        draw_speeds,
    ),
    FigureKind(
        "forces",
        "Foot forces",
        "Vertical force on each foot; dashed, a quarter of the robot's weight.",
        draw_forces,
        physics=True,
    ),
    FigureKind(
        "error",
        "The body against its plan",
        "Measured less what the controller wants: the plan, or aside of it for an unknown load.",
        draw_base_error,
        physics=True,
    ),
    FigureKind(
        "clock",
        "The gait clock's waiting",
        "Where the clock stood still and what for, and how long in all.",
        draw_clock,
        physics=True,
        wanted=stood_still,
    ),
    FigureKind(
        "estimate",
        "The estimated state against the truth",
        "Errors of the base's place, heading and tilt (sizes, but for the heading), and what the "
        "filter believes them to be. Nothing that the robot feels shows its place or its heading: "
        "they drift. Marks along the bottom: feet taken for slipping, in their legs' colours.",
        draw_estimate,
        physics=True,
        wanted=was_estimated,
    ),
)


# ------------------------------------------------------------------------------------------------
# report.html: one self-contained page that says how a run went, and shows it.
# ------------------------------------------------------------------------------------------------


REPORT = "report.html"


def write_report(directory: RecordedRun | str | Path, *, replay: bool = True) -> Path:
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
    run = directory if isinstance(directory, RecordedRun) else load_run(directory)
    page = render(
        "report.html",
        css=Markup(read_css("report.css")),
        run=run,
        verdict=grade_run(run),
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


def _marks(run: RecordedRun) -> list[tuple[str, str]]:
    """What the page has to explain of its figures over time: names and colours."""
    there = {band.mode for band in clock_stops(run)}
    marks = [(NAMES[mode], colour) for mode, colour in MODE_COLOURS.items() if mode in there]
    return [*marks, ("push", PUSH_COLOUR)] if push_events(run) else marks


def _draw_figures(run: RecordedRun) -> list[tuple[FigureKind, Markup]]:
    """The figures that the run's files can fill, as SVG."""
    if not len(run.log):
        return []
    with report_style():
        return [
            (kind, Markup(to_svg(kind.draw(run), name=kind.name, label=kind.title)))
            for kind in FIGURES
            if not (kind.physics and run.kinematic) and kind.wanted(run)
        ]
