"""Writes a run's report: report.html and its figures."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from drake_quad.report.axes import signed
from drake_quad.report.derived import clock_stops, find_least_margin, has_massless_legs, push_events
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
from drake_quad.report.figures_revisions import draw_revisions, has_grown, revision_rows
from drake_quad.report.figures_seen import draw_sight, seen_rows, was_seen
from drake_quad.report.overlay import Regions
from drake_quad.report.replay import make_replay_html, pack, round_recording
from drake_quad.report.style import (
    KIND_COLOURS,
    LEG_COLOURS,
    LEG_NAMES,
    MODE_COLOURS,
    PUSH_COLOUR,
    read_css,
    render,
    report_style,
    to_svg,
)
from drake_quad.report.tables import (
    bounds,
    entries_of,
    push_rows,
    recovery_rows,
    segment_rows,
    summary_rows,
)
from drake_quad.runs.reader import SCENARIO, RecordedRun, run_of
from drake_quad.runs.summary_figures import look_up
from drake_quad.scenario.build import disturbances_of
from drake_quad.stability.safety import (
    NO_SUPPORT,
    Safety,
    judge_safety,
    margin_words,
    safe_margin,
)
from drake_quad.util.files import MOST_YAML, read_given_text, write_whole

REPORT = "report.html"


@dataclass(frozen=True)
class FigureKind:
    """A figure of the page.

    Attributes:
        name: Name of the section, for links.
        title: Title over the figure.
        caption: Caption under it.
        draw: Function that draws it.
        physics: Whether it shows quantities that a kinematic replay lacks.
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
        "seen",
        "The stairs as they were seen",
        "What the map was made of: the last depth image that the robot took from its start, with "
        "the errors of its camera, and the nosings that were found in it with their intervals of "
        "95 %. The ground is drawn as it is; the robot was not told.",
        draw_sight,
        wanted=was_seen,
    ),
    FigureKind(
        "revisions",
        "How the map changed",
        "If the end of a flight is not seen from the start, the robot climbs the steps that it "
        "knows, stands on a tread, and looks again. A foot that lands tells how high its tread is. "
        "Nosings are drawn as each look told them, and as feet have found them, with their "
        "intervals of 95 %; below are the errors. The ground is drawn as it is; the robot was not "
        "told.",
        draw_revisions,
        wanted=has_grown,
    ),
    FigureKind(
        "margin",
        "Stability margin",
        "Distance from the projected centre of mass of the whole robot to the nearest side of the "
        "support polygon, positive inside. The measured margin takes the feet that carry load, the "
        "planned margin the feet that should. The margin of the zero-moment point also accounts "
        "for accelerations.",
        draw_margin,
    ),
    FigureKind(
        "regions",
        "Margins within friction and torque, and pushes",
        "Signed distance of the centre of mass from the border of the region in which forces on "
        "the feet can balance it: forces within their friction cones; within the joints' torque "
        "limits too; and with the acceleration of the body included. Dashed lines are planned. Red "
        "is outside, amber less than a safe margin. Below: the distance of the capture point from "
        "the border of the region in which the feet can hold it, and the weakest push, in any "
        "direction, that would force a step.",
        draw_regions,
        physics=True,
        wanted=was_measured,
    ),
    FigureKind(
        "footprints",
        "Footprints from above",
        "Places where each foot stood (left round, right square), the paths of body and centre of "
        "mass, and the support polygon at the smallest margin. Higher ground is darker; the "
        "lines across it are nosings.",
        draw_footprints,
    ),
    FigureKind(
        "side",
        "The course from the side",
        "The course with its turns unfolded, the soles of the feet, and the centre of mass.",
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
        "A bar marks the time for which a foot stands: pale or outlined as planned, solid as "
        "sensed (it carries more than 1 % of the robot's weight). Red: the foot should have stood "
        "and did not, apart from 0.1 s of delay at touchdown or lift-off.",
        draw_gait,
    ),
    FigureKind(
        "torques",
        "Joint torques against their limits",
        "Torque divided by the joint's limit; dashed lines are the limits, the ring marks the "
        "largest ratio.",
        draw_torques,
        physics=True,
    ),
    FigureKind(
        "speeds",
        "Joint speeds against their limits",
        "Speed divided by the joint's limit; dashed lines are the limits, the ring marks the "
        "largest ratio.",
        draw_speeds,
    ),
    FigureKind(
        "forces",
        "Foot forces",
        "Vertical force on each foot. The dashed line is a quarter of the robot's weight, its "
        "payload included.",
        draw_forces,
        physics=True,
    ),
    FigureKind(
        "error",
        "Deviation of the body from its plan",
        "Measured minus desired pose. The controller desires the planned pose, or one beside it to "
        "balance a payload that it has detected.",
        draw_base_error,
        physics=True,
    ),
    FigureKind(
        "clock",
        "Waiting times of the gait clock",
        "When and why the gait clock stood still, and for how long in total.",
        draw_clock,
        physics=True,
        wanted=stood_still,
    ),
    FigureKind(
        "estimate",
        "The estimated state against the truth",
        "Errors of the base's position, heading and tilt (absolute values, except for the "
        "heading), and one standard deviation of each as the filter estimates it. Position and "
        "heading drift, unless a camera sees flights of the map: dots are what it saw. Marks along "
        "the bottom: feet that the filter takes for slipping, in the colours of their legs.",
        draw_estimate,
        physics=True,
        wanted=was_estimated,
    ),
)


def write_report(directory: RecordedRun | str | Path, *, replay: bool = True) -> Path:
    """Writes `report.html` beside a finished run's files.

    The page needs no network and no other file. It leaves out what the run's files lack.

    Args:
        directory: The run, or its directory.
        replay: Whether to embed the 3D replay, which is most of the page's size.

    Returns:
        The page's path.

    Raises:
        InputError: The directory holds no run.
    """
    run = run_of(directory)
    page = render(
        "report.html",
        css=Markup(read_css("report.css")),
        run=run,
        verdict=grade_run(run),
        bounds=bounds(run),
        figures=_draw_figures(run),
        replay=pack(round_recording(make_replay_html(run))) if replay and len(run.log) else "",
        safe=safe_margin(run.robot),
        massless=has_massless_legs(run),
        region=Regions(run),
        segments=segment_rows(run),
        seen=seen_rows(run),
        revisions=revision_rows(run),
        seen_words=str(run.seen.get("words", "")),
        pushes=push_rows(run),
        other_mass=_other_mass(run),
        recoveries=recovery_rows(run),
        differs=run.world is not run.course,
        marks=_marks(run),
        rows=summary_rows(run.summary),
        versions=run.summary.get("versions") or {},
        scenario_text=read_given_text(run.directory / SCENARIO, most=MOST_YAML),
        kind_colours=_kind_colours(run),
        legs=list(zip(LEG_NAMES, LEG_COLOURS, strict=True)),
    )
    path = run.directory / REPORT
    write_whole(path, lambda p: p.write_text(page, encoding="utf-8"))
    return path


def _kind_colours(run: RecordedRun) -> dict[str, str]:
    """The colours of the kinds of segments that a run has, for the key of its figures."""
    kinds = {band.kind for band in run.log.bands()}
    return {kind: colour for kind, colour in KIND_COLOURS.items() if kind in kinds}


def _other_mass(run: RecordedRun) -> str:
    """How much faster a push made the robot than one of its file's mass; empty of that mass."""
    mass = run.robot.mass
    factor = mass / disturbances_of(run.scenario, run.robot).mass_of(mass)
    return "" if abs(factor - 1.0) < 0.005 else f"{factor:.2f} times"


def _marks(run: RecordedRun) -> list[tuple[str, str]]:
    """Names and colours of the marks in figures over time."""
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


@dataclass(frozen=True)
class RunVerdict:
    """The verdict at the head of the page.

    Attributes:
        grade: Grade that gives the colour: `good`, `warn` or `bad`.
        word: The verdict in a word or two.
        sentence: The verdict with the figures that matter.
        least_time: Time of the smallest margin [s]; None if it is not known.
    """

    grade: str
    word: str
    sentence: str
    least_time: float | None


def grade_run(run: RecordedRun) -> RunVerdict:
    """The verdict on a run, from its summary and its log."""
    outcome = str(run.summary.get("outcome", ""))
    grade, word = {
        "goal_reached": ("good", "Reached the goal"),
        "fell": ("bad", "Fell"),
        "stopped": ("bad", "Stopped"),
    }.get(outcome, ("bad", outcome.replace("_", " ").capitalize() or "Unfinished"))
    log = run.log
    lasted = float(log.t[-1]) if len(log) else look_up(run.summary, "simulated_time")
    sentence = ""
    if math.isfinite(lasted):
        sentence = f"{'Done after' if outcome == 'goal_reached' else 'After'} {lasted:.1f} s"
        named = [band.name or band.kind for band in log.bands() if band.name or band.kind]
        if outcome != "goal_reached" and named:  # a robot that waits for a plan has no segment
            sentence += f" ({named[-1]})"
        reason = str(run.summary.get("reason") or "").strip()
        if reason and outcome != "goal_reached":
            sentence += f": {reason.removeprefix(outcome).lstrip(': ')}"
        sentence = sentence.rstrip(": ") + ". "
    text, time, least = _least(run)
    safety = judge_safety(run.summary, safe_margin(run.robot))
    if grade == "good" and (safety.safe is not True or least < 0.0):
        grade = "warn"
    if run.kinematic:
        word = f"{word}: kinematic replay, no physics"
    sentence += text + _pushed(run) + _told(safety)
    return RunVerdict(grade, word, signed(sentence.strip()), time)


def _told(safety: Safety) -> str:
    """The verdict on safety, as a sentence; empty for a replay without physics."""
    return f" {safety.words[0].upper()}{safety.words[1:]}." if safety.safe is not None else ""


def _pushed(run: RecordedRun) -> str:
    """How often the robot was pushed, and how fast it recovered; empty if it was not pushed."""
    # The summary says nothing about pushes after the run ended.
    told = [e for e in entries_of(run.summary, "pushes") if e.get("recovered") is not None]
    if not told:
        return ""
    times = [f"{look_up(e, 'recovery_time'):.1f} s" for e in told if e["recovered"]]
    lost = len(told) - len(times)
    parts = [f"recovered in {', '.join(times)}"] if times else []
    if lost:
        parts.append("not recovered" if not times else f"not recovered from {lost}")
    often = "once" if len(told) == 1 else f"{len(told)} times"
    return f" Pushed {often}, {'; '.join(parts)}."


def _least(run: RecordedRun) -> tuple[str, float | None, float]:
    """The smallest margin: a sentence, its time [s], and the margin [m]."""
    least, noun = find_least_margin(run), "planned" if run.kinematic else "measured"
    if least is None:
        known = look_up(run.summary, "margin.minimum")
        words = f"Smallest {noun} margin: {margin_words(known)}."
        return words if math.isfinite(known) else "", None, known
    where = run.log.text("segment")[least.sample]
    when = f"at {least.time:.1f} s" + (f" ({where})" if where else "")
    of = " (legs without mass)" if has_massless_legs(run) else ""
    text = f"The smallest {noun} static margin{of} was {least.words}, {when}."
    if least.margin <= NO_SUPPORT:
        text = f"There was no margin {when}, where {least.words}."
    return text, least.time, least.margin
