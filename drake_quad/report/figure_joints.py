"""How near the joints came to their limits, and what the feet bore."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray
from drake_quad.report.axes import draw_line, label_time, make_axes
from drake_quad.report.background import draw_background
from drake_quad.report.run_files import Run
from drake_quad.report.style import BAD, LEG_COLOURS, LEG_NAMES, MUTED, THREE_COLOURS

JOINTS = ("abduction", "hip pitch", "knee")


def torque_ratios(run: Run) -> FloatArray:
    """Joint torques over their limits, signed, (N, 4, 3)."""
    torque = run.log.numbers([f"tau_{name}" for name in run.robot.joint_names])
    return np.asarray(torque / run.robot.effort).reshape(-1, 4, 3)


def speed_ratios(run: Run) -> FloatArray:
    """Joint speeds over their limits, signed, (N, 4, 3)."""
    joints = run.layout.v_joints - run.layout.num_positions
    return np.asarray(run.velocities[:, joints] / run.robot.speed).reshape(-1, 4, 3)


def draw_torques(run: Run) -> Figure:
    """Torque over limit of the joints, a panel a leg."""
    return _draw_ratios(run, torque_ratios(run), "torque / limit")


def draw_speeds(run: Run) -> Figure:
    """Speed over limit of the joints, a panel a leg."""
    return _draw_ratios(run, speed_ratios(run), "speed / limit")


def draw_forces(run: Run) -> Figure:
    """The vertical force on each foot [N], and what a quarter of the weight is."""
    force = run.log.feet("force")[..., 2]
    figure, axes = make_axes(2, 2, height=3.8, share_y=True)
    weight = GRAVITY * run.robot.mass
    for row, axis in enumerate(axes.ravel()):
        draw_line(axis, run.log.t, force[:, row], color=LEG_COLOURS[row], lw=0.8)
        axis.axhline(0.25 * weight, color=MUTED, lw=0.8, ls=(0, (4, 2)))
        axis.set_title(f"leg {LEG_NAMES[row]}")
    known = force[np.isfinite(force)]
    if known.size:
        # A touchdown's spike of one sample would flatten all that matters.
        top = 1.3 * float(np.quantile(known, 0.999))
        axes[0, 0].set_ylim(-0.02 * top, max(top, 0.5 * weight))
    draw_background(list(axes.ravel()), run)
    for axis in axes[:, 0]:
        axis.set_ylabel("vertical force [N]")
    label_time(axes[-1])
    return figure


def _draw_ratios(run: Run, ratios: FloatArray, label: str) -> Figure:
    """(N, 4, 3) ratios over time with their limits ±1 and the greatest marked."""
    figure, axes = make_axes(2, 2, height=4.6, share_y=True)
    bound = float(np.nanmax(np.abs(ratios), initial=0.0)) if np.any(np.isfinite(ratios)) else 0.0
    reach = 1.1 * max(bound, 1.0)
    for row, axis in enumerate(axes.ravel()):
        for joint, colour in enumerate(THREE_COLOURS):
            style = {"color": colour, "lw": 0.8, "label": JOINTS[joint]}
            draw_line(axis, run.log.t, ratios[:, row, joint], **style)
        axis.set_ylim(-reach, reach)
        for limit in (-1.0, 1.0):
            axis.axhline(limit, color=BAD, lw=1.0, ls=(0, (5, 2)))
        axis.set_title(_greatest(run, ratios[:, row], f"leg {LEG_NAMES[row]}"))
    draw_background(list(axes.ravel()), run)
    _mark_greatest(run, ratios, list(axes.ravel()))
    for axis in axes[:, 0]:
        axis.set_ylabel(label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
    label_time(axes[-1])
    return figure


def _greatest(run: Run, ratios: FloatArray, name: str) -> str:
    """A panel's title: which of the leg's joints came nearest to its limit, and when."""
    if not np.any(np.isfinite(ratios)):
        return f"{name}: not in the log"
    k, joint = np.unravel_index(int(np.nanargmax(np.abs(ratios))), ratios.shape)
    return f"{name}: {abs(ratios[k, joint]):.2f} at most, {JOINTS[joint]}, {run.log.t[k]:.1f} s"


def _mark_greatest(run: Run, ratios: FloatArray, axes: list[Axes]) -> None:
    """Rings the greatest of all."""
    if np.any(np.isfinite(ratios)):
        k, row, joint = np.unravel_index(int(np.nanargmax(np.abs(ratios))), ratios.shape)
        ring = {"ms": 8, "mfc": "none", "mec": BAD, "mew": 1.6}
        axes[row].plot([run.log.t[k]], [ratios[k, row, joint]], "o", **ring)
