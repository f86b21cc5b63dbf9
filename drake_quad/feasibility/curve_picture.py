"""Draws and writes speed against margin, as `drake-quad check --curve` found it."""

import json
from pathlib import Path

from matplotlib.figure import Figure

from drake_quad.feasibility.robot_picture import save_picture
from drake_quad.gait_design.speed_curve import SpeedCurve
from drake_quad.scenario.load import save_scenario
from drake_quad.util.files import write_whole

BLUE, ORANGE, GREY = "#0068A8", "#B8480A", "#E3E7EA"


def draw_speed_curve(curve: SpeedCurve, title: str) -> Figure:
    """The points of a curve, the static margin and the zero-moment point's.

    Args:
        curve: The points.
        title: What was asked.
    """
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axis = figure.add_subplot()
    speeds = [p.speed for p in curve.points]
    axis.plot([1e3 * p.margin for p in curve.points], speeds, "o-", color=BLUE,
              label="static margin")  # fmt: skip
    axis.plot([1e3 * p.zmp_margin for p in curve.points], speeds, "D--", color=ORANGE, ms=4,
              lw=1.0, label="margin of the zero-moment point")  # fmt: skip
    for k, point in enumerate(curve.points, start=1):
        axis.annotate(f"{k}", (1e3 * point.margin, point.speed), xytext=(6, 5),
                      textcoords="offset points", color=BLUE, fontsize=8)  # fmt: skip
    axis.set_xlabel("least planned margin [mm]")
    axis.set_ylabel("speed on the flight [m/s]")
    axis.set_title(title, loc="left", fontsize=10)
    axis.set_xlim(left=0.0)
    axis.set_ylim(bottom=0.0)
    axis.grid(color=GREY, lw=0.6)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, loc="best", fontsize=8)
    return figure


def save_speed_curve(curve: SpeedCurve, directory: Path, title: str) -> None:
    """Writes curve.json, curve.svg, curve.png, and the scenario of each point as point_1.yaml on.

    Args:
        curve: The points.
        directory: Where to write; it is made if it is not there.
        title: What was asked.

    Raises:
        InputError: If a file cannot be written.
    """
    directory.mkdir(parents=True, exist_ok=True)
    text = json.dumps(curve.as_dict(), indent=2) + "\n"
    write_whole(
        directory / "curve.json",
        lambda to: to.write_text(text, encoding="utf-8"),
        option="--curve",
    )
    for k, point in enumerate(curve.points, start=1):
        scenario = point.designed.scenario
        write_whole(
            directory / f"point_{k}.yaml",
            lambda to, scenario=scenario: save_scenario(scenario, to),  # type: ignore[misc]
            option="--curve",
        )
    figure = draw_speed_curve(curve, title)
    for ending in ("svg", "png"):
        save_picture(figure, directory / f"curve.{ending}", salt=curve.robot, option="--curve")
