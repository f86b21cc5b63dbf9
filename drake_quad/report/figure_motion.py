"""The paper's Fig. 11 for a run, and how far the body was from its plan."""

import numpy as np
from matplotlib.figure import Figure

from drake_quad.gait.legs import Leg
from drake_quad.report.axes import draw_line, label_time, make_axes
from drake_quad.report.background import draw_background
from drake_quad.report.motion import base_motion, calc_foot_centres
from drake_quad.report.run_files import Run
from drake_quad.report.style import INK, LEG_COLOURS, LEG_NAMES, MUTED, THREE_COLOURS

TRACKED = (Leg.FRONT_LEFT, Leg.FRONT_RIGHT)  # legs 1 and 2, as in the paper's Fig. 11


def draw_trajectories(run: Run) -> Figure:
    """x, y, z of the body, of leg 1 and of leg 2 in W over time, planned and measured.

    Feet are their spheres' centres. Source: the paper's Fig. 11.
    """
    log = run.log
    figure, axes = make_axes(3, 3, height=5.6, share_y="row")
    feet, planned_feet = calc_foot_centres(run), log.feet("desired")
    columns = [("body", INK, base_motion(run).p_WB, log.vector("base_desired"))]
    for row in (leg.row for leg in TRACKED):
        columns.append(
            (f"leg {LEG_NAMES[row]}", LEG_COLOURS[row], feet[:, row], planned_feet[:, row])
        )
    word = "replayed" if run.kinematic else "measured"
    for column, (name, colour, measured, planned) in zip(axes.T, columns, strict=True):
        column[0].set_title(name)
        for axis, k in zip(column, range(3), strict=True):
            draw_line(axis, log.t, measured[:, k], color=colour, lw=1.4, label=word)
            style = {"color": MUTED, "lw": 0.9, "ls": (0, (4, 2)), "label": "planned"}
            draw_line(axis, log.t, planned[:, k], **style)
        draw_background(list(column), run)
    for axis, name in zip(axes[:, 0], "xyz", strict=True):
        axis.set_ylabel(f"{name} [m]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
    label_time(axes[-1])
    return figure


def draw_base_error(run: Run) -> Figure:
    """Measured less planned: the body's place [mm] and its attitude [deg] over time."""
    log, base = run.log, base_motion(run)
    figure, axes = make_axes(2, height=3.6)
    place = 1e3 * (base.p_WB - log.vector("base_desired"))
    pitch, yaw = log.number("base_desired_pitch"), log.number("base_desired_yaw")
    planned = np.stack([np.zeros(len(log)), pitch, yaw], axis=-1)
    turn = np.remainder(base.rpy - planned + np.pi, 2 * np.pi) - np.pi
    for values, names, axis in (
        (place, "xyz", axes[0, 0]),
        (np.degrees(turn), ("roll", "pitch", "yaw"), axes[1, 0]),
    ):
        for k, colour in enumerate(THREE_COLOURS):
            draw_line(axis, log.t, values[:, k], color=colour, lw=1.0, label=names[k])
        if axis.lines:
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axis.axhline(0.0, color=MUTED, lw=0.7)
    draw_background(list(axes[:, 0]), run, label=axes[0, 0])
    axes[0, 0].set_ylabel("place [mm]")
    axes[1, 0].set_ylabel("attitude [deg]")
    label_time(axes[-1])
    return figure
