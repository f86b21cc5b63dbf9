"""The estimated state against the truth, and what the filter believes its error to be."""

import numpy as np
from matplotlib.figure import Figure

from drake_quad.gait.legs import FloatArray
from drake_quad.report.axes import draw_line, label_time, make_axes
from drake_quad.report.background import draw_background
from drake_quad.report.columns import runs_of
from drake_quad.report.motion import base_motion
from drake_quad.report.run_files import Run
from drake_quad.report.style import INK, LEG_COLOURS, LESS_COLOUR

FLAGS = 0.025  # of the axes' height, for each leg's row of flags


def was_estimated(run: Run) -> bool:
    """Whether there is anything to show."""
    return bool(np.any(np.isfinite(run.log.number("base_estimated_x"))))


def estimate_errors(run: Run) -> FloatArray:
    """Errors of place [m], heading and tilt [rad], (N, 3); all but the heading are sizes."""
    base = base_motion(run)
    place = np.linalg.norm(run.log.vector("base_estimated") - base.p_WB, axis=1)
    roll, pitch, yaw = run.log.vector("base_estimated", ("roll", "pitch", "yaw")).T
    up = np.stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], -1)
    # Of both the world's vertical in B: the sine of the angle is exact where it is small.
    true_up = base.R_WB[:, 2]
    tilt = np.arctan2(
        np.linalg.norm(np.cross(up, true_up), axis=1), np.einsum("ij,ij->i", up, true_up)
    )
    turn = np.remainder(yaw - base.rpy[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    return np.stack([place, turn, tilt], axis=-1)


def believed_errors(run: Run) -> FloatArray:
    """What the filter believes the same to be, (N, 3): one standard deviation."""
    turn = run.log.vector("deviation_turn")
    place = np.linalg.norm(run.log.vector("deviation_base"), axis=1)
    return np.stack([place, turn[:, 2], np.hypot(turn[:, 0], turn[:, 1])], axis=-1)


def draw_estimate(run: Run) -> Figure:
    """Errors of place [mm], of heading and of tilt [deg] over time; slips along the bottom."""
    figure, axes = make_axes(3, height=5.0)
    scale = np.array([1e3, *np.degrees([1.0, 1.0])])
    errors, believed = scale * estimate_errors(run), scale * believed_errors(run)
    names = ("place [mm]", "heading [deg]", "tilt [deg]")
    draw_background(list(axes[:, 0]), run, label=axes[0, 0])
    for k, (axis, name) in enumerate(zip(axes[:, 0], names, strict=True)):
        style = {"color": LESS_COLOUR, "lw": 1.0, "ls": (0, (4, 2))}
        draw_line(axis, run.log.t, believed[:, k], label="believed, one deviation", **style)
        if k == 1:  # the heading's error has a sign
            draw_line(axis, run.log.t, -believed[:, k], **style)
        draw_line(axis, run.log.t, errors[:, k], color=INK, lw=1.2, label="error")
        # At first the filter believes little: that would flatten all the rest.
        top = 1.15 * max(_greatest(errors[:, k]), _greatest(believed[:, k], 0.98), 1e-6)
        axis.set_ylim(-top if k == 1 else 0.0, top)
        axis.set_ylabel(name)
    slips, t = run.log.flags("slip_estimated"), run.log.t
    for row, colour in enumerate(LEG_COLOURS):
        spans = [(t[a], t[min(b, len(t) - 1)] - t[a]) for a, b in runs_of(slips[:, row])]
        axes[0, 0].broken_barh(
            spans,
            ((3 - row) * FLAGS, FLAGS),
            transform=axes[0, 0].get_xaxis_transform(),
            facecolor=colour,
            edgecolor=colour,
            lw=0.6,
        )
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    label_time(axes[-1])
    return figure


def _greatest(values: FloatArray, share: float = 1.0) -> float:
    """The size that this share of the known values stays within; 0 of none."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.quantile(known, share)) if known.size else 0.0
