"""A picture of a planned climb: the robot over a cycle up and one down, and the margin."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.check_drawing import REAR, draw_moment
from drake_quad.check_moments import Stretch, find_stretches
from drake_quad.design.shape import read_shape
from drake_quad.designer_plan import Designed
from drake_quad.errors import InputError
from drake_quad.planning.motion_plan import evaluate
from drake_quad.robot.robot_model import RobotModel
from drake_quad.whole_files import write_whole

KINDS = (".svg", ".png", ".pdf")
PERIOD = 0.05  # [s] between the samples of the margin
INK, UP, DOWN = "#333333", "#3c7d3c", "#8a4f9e"


def check_picture(path: Path | None) -> None:
    """Makes sure before any work that a picture can be of the path's kind.

    Raises:
        InputError: If not.
    """
    if path is not None and path.suffix.lower() not in KINDS:
        remedy = f"a picture's file ends in {', '.join(KINDS)}"
        raise InputError(source="--picture", field="picture", value=str(path), remedy=remedy)


def save_picture(designed: Designed, robot: RobotModel, path: Path) -> None:
    """Writes the picture, in the format of the path's ending.

    Raises:
        InputError: If it cannot be written.
    """
    figure = draw_check(designed, robot)
    kind = path.suffix.lstrip(".").lower()
    with matplotlib.rc_context({"svg.hashsalt": robot.name, "svg.fonttype": "none"}):
        metadata = {"Date": None} if kind == "svg" else None
        write_whole(
            path,
            lambda to: figure.savefig(to, format=kind, dpi=110, metadata=metadata),
            option="--picture",
        )


def draw_check(designed: Designed, robot: RobotModel) -> Figure:
    """The figure: a row of moments each way, and below them the margin of the whole mission."""
    stretches = find_stretches(designed, robot)
    shape = read_shape(robot)
    columns = max((len(s.times) for s in stretches), default=1)
    rows = len(stretches)
    with matplotlib.rc_context({"font.size": 9, "axes.spines.top": False}):
        figure = Figure(figsize=(15.0, 2.75 * rows + 2.4), layout="constrained")
        grid = figure.add_gridspec(rows + 1, columns, height_ratios=[*[1.0] * rows, 0.8])
        for row, stretch in enumerate(stretches):
            samples = evaluate(robot, stretch.plan, stretch.times)
            for k in range(len(stretch.times)):
                ax = figure.add_subplot(grid[row, k])
                draw_moment(ax, robot, shape, stretch.lane, samples, k)
                _label(ax, stretch, k)
        _margin(figure.add_subplot(grid[rows, :]), designed, robot, stretches)
    gait = designed.scenario.gait
    figure.suptitle(
        f"{designed.scenario.description}: {gait.treads} tread{'s' if gait.treads > 1 else ''} "
        f"a cycle, least static margin {1e3 * designed.margin:.0f} mm",
        fontsize=11,
        parse_math=False,
    )
    return figure


def _label(ax: Axes, stretch: Stretch, k: int) -> None:
    """When it is, and who swings."""
    phase = (stretch.times[k] - stretch.start) / stretch.cycle_time
    who = stretch.in_air[k]
    swings = f"{who} swings" if who else "four feet stand"
    ax.set_title(f"{100 * phase:.0f} % of a cycle: {swings}", fontsize=8.5, color=INK)
    if k == 0:
        ax.set_ylabel(f"going {stretch.going}, m", fontsize=10)


def _margin(
    ax: Axes, designed: Designed, robot: RobotModel, stretches: tuple[Stretch, ...]
) -> None:
    """The static margin over the whole mission, with the moments above marked."""
    mission = designed.plan
    top = 0.0
    for plan, begun in zip(mission.plans, mission.starts, strict=True):
        times = np.linspace(0.0, plan.duration, int(np.ceil(plan.duration / PERIOD)) + 1)
        margin = evaluate(robot, plan, times).margin
        top = max(top, float(margin.max()))
        ax.plot(begun + times, 1e3 * margin, "-", color=INK, lw=0.9)
        ax.axvline(begun, color="#cccccc", lw=0.8, zorder=0)
    for plan, begun in zip(mission.plans, mission.starts, strict=True):
        if plan.duration > 0.08 * mission.duration:
            name = max(plan.segments, key=lambda s: s.end - s.start).name
            ax.text(begun, 1.03e3 * top, f" {name}", color=INK, parse_math=False)
    for stretch in stretches:
        begun, colour = mission.starts[stretch.plan.index], UP if stretch.going == "up" else DOWN
        ax.axvspan(begun + stretch.start, begun + stretch.start + stretch.cycle_time,
                   color=colour, alpha=0.18, lw=0)  # fmt: skip
        for t in stretch.times:
            ax.axvline(begun + t, color=colour, lw=0.9)
    ax.axhline(1e3 * designed.margin, color=REAR, lw=0.9, ls="--")
    ax.annotate(f"least, {1e3 * designed.margin:.0f} mm", (0.0, 1e3 * designed.margin), (4, -11),
                textcoords="offset points", color=REAR)  # fmt: skip
    ax.set_xlim(0.0, mission.duration)
    ax.set_ylim(0.0, 1.15e3 * top)
    ax.set_xlabel("time, s (the marks are the moments above)")
    ax.set_ylabel("static margin, mm")
