"""report.html: one self-contained page that says how a run went, and shows it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from drake_quad.report.figure_course import draw_footprints, draw_side
from drake_quad.report.figure_gait import draw_gait
from drake_quad.report.figure_joints import draw_forces, draw_speeds, draw_torques
from drake_quad.report.figure_margin import draw_margin
from drake_quad.report.figure_motion import draw_base_error, draw_trajectories
from drake_quad.report.replay import make_replay_html
from drake_quad.report.run_files import SCENARIO, Run, read_run
from drake_quad.report.style import KIND_COLOURS, LEG_COLOURS, LEG_NAMES
from drake_quad.report.svg import report_style, to_svg
from drake_quad.report.tables import segment_rows, summary_rows
from drake_quad.report.templates import read_css, render
from drake_quad.report.verdict import bounds, judge
from drake_quad.whole_files import write_whole

REPORT = "report.html"


@dataclass(frozen=True)
class FigureKind:
    """A figure of the page.

    Attributes:
        name: Of its place in the page.
        title: Over it.
        caption: Under it.
        draw: Makes it.
        physics: Whether it shows what a kinematic replay has not.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[Run], Figure]
    physics: bool = False


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
        "Measured less planned.",
        draw_base_error,
        physics=True,
    ),
)


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
        replay=make_replay_html(run) if replay and len(run.log) else "",
        segments=segment_rows(run),
        rows=summary_rows(run.summary),
        versions=run.summary.get("versions") or {},
        scenario_text=(run.directory / SCENARIO).read_text(encoding="utf-8"),
        kind_colours=KIND_COLOURS,
        legs=list(zip(LEG_NAMES, LEG_COLOURS, strict=True)),
    )
    path = run.directory / REPORT
    write_whole(path, lambda p: p.write_text(page, encoding="utf-8"))
    return path


def _draw_figures(run: Run) -> list[tuple[FigureKind, Markup]]:
    """The figures that the run's files can fill, as SVG."""
    if not len(run.log):
        return []
    with report_style():
        return [
            (kind, Markup(to_svg(kind.draw(run), name=kind.name, label=kind.title)))
            for kind in FIGURES
            if not (kind.physics and run.kinematic)
        ]
