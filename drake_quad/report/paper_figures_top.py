"""Figs. 2, 3, 6 and 7: configurations and transitions, seen from above."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_quad.gait.transition import Transition
from drake_quad.gait.workspace import spin_arc, spin_middles
from drake_quad.report.paper_drawing import (
    COLOURS,
    Axes,
    arrow,
    dimension,
    draw_body,
    draw_boxes,
    draw_centre,
    draw_foot,
    draw_support,
    name_leg,
    new_figure,
    top_view,
)
from drake_quad.report.paper_findings import order_of
from drake_quad.report.paper_study import TABLE_I
from drake_quad.report.paper_transitions import (
    MAX_SHIFT,
    WORKSPACE,
    find_alternatives,
    paper_wave_transition,
    quarter_turn_arc,
    spin_goal,
    wave_goal,
)
from drake_quad.robot.legs import LEGS, Leg

_OUTWARD = {Leg(1): (0, 13), Leg(2): (0, -13), Leg(3): (0, 13), Leg(4): (0, -13)}


def wave_configuration() -> Figure:
    """Returns Fig. 2: where the feet are as a cycle of the wave gait begins."""
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    top_view(axes)
    axes.set(xlim=(-1.02, 1.0), ylim=(-0.76, 0.58))
    draw_body(axes)
    draw_boxes(axes, WORKSPACE)
    draw_centre(axes)
    for leg, foot in zip(LEGS, wave_goal(), strict=True):
        draw_foot(axes, leg, foot, size=10)
        name_leg(axes, leg, foot, offset=_OUTWARD[leg])
        offset = foot[0] - WORKSPACE.centres[leg.row, 0]
        fraction = TABLE_I.stroke / abs(offset)
        text = f"{'+' if offset > 0 else '−'}R/{fraction:.0f} = {offset:+.3f} m".replace("-", "−")
        side = {Leg(1): "left", Leg(3): "right"}.get(leg, "center")
        axes.text(foot[0], foot[1] + np.sign(foot[1]) * 0.15, text, fontsize=8,
                  color=COLOURS[leg], ha=side, va="center")  # fmt: skip
    w = WORKSPACE
    x, y = w.P_x / 2, w.P_y / 2
    dimension(axes, (x - w.R_x / 2, -0.57), (x + w.R_x / 2, -0.57), f"$R_x$ = {w.R_x} m")
    dimension(axes, (-x, -0.68), (x, -0.68), f"$P_x$ = {w.P_x} m")
    dimension(axes, (0.89, -y - w.R_y / 2), (0.89, -y + w.R_y / 2), f"$R_y$\n{w.R_y} m")
    dimension(axes, (-0.9, -y), (-0.9, y), f"$P_y$\n{w.P_y} m")
    axes.text(-0.2, -0.1, "swing order 1–4–2–3", fontsize=8, ha="center", va="center")
    arrow(axes, np.array([0.12, 0.0]), np.array([0.42, 0.0]))
    axes.text(0.27, 0.05, "heading", fontsize=8, ha="center")
    return figure


def spin_configuration() -> Figure:
    """Returns Fig. 6: where the feet are as a cycle of the spinning gait begins."""
    figure = new_figure(7.0, 4.8)
    axes = figure.subplots()
    top_view(axes)
    draw_body(axes)
    draw_boxes(axes, WORKSPACE)
    draw_centre(axes)
    draw_arcs(axes)
    for leg, foot in zip(LEGS, spin_goal(), strict=True):
        draw_foot(axes, leg, foot, size=10)
        name_leg(axes, leg, foot, offset=(15 if foot[0] > 0 else -15, 0))
    _, phi = quarter_turn_arc()
    text = f"counterclockwise, 1–3–4–2\n90° in one cycle, φ = {np.degrees(phi):.1f}°"
    axes.text(0.0, -0.10, text, fontsize=8, ha="center", va="center")
    turning = np.radians(np.linspace(40, 140, 50))
    axes.plot(0.15 * np.cos(turning), 0.15 * np.sin(turning), color="#222222", lw=1.2)
    tip = 0.15 * np.column_stack([np.cos(turning[-4:]), np.sin(turning[-4:])])
    arrow(axes, tip[0], tip[-1])
    return figure


def draw_arcs(axes: Axes) -> None:
    """Draws the spin's circle, each foot's longest arc on it, and the part that 90° uses."""
    radius = np.hypot(WORKSPACE.P_x, WORKSPACE.P_y) / 2
    _, phi = quarter_turn_arc()
    lo, hi = spin_arc(WORKSPACE)
    around = np.linspace(0, 2 * np.pi, 361)
    axes.plot(radius * np.cos(around), radius * np.sin(around), color="#BBBBBB", lw=0.8, ls=":")
    for leg, middle in zip(LEGS, spin_middles(WORKSPACE), strict=True):
        for span, width, alpha in ((hi - lo, 1.0, 0.9), (phi, 4.0, 0.35)):
            angles = np.linspace(middle - span / 2, middle + span / 2, 90)
            axes.plot(radius * np.cos(angles), radius * np.sin(angles), lw=width, alpha=alpha,
                      color=COLOURS[leg], zorder=3, solid_capstyle="butt")  # fmt: skip


def wave_transition() -> Figure:
    """Returns Fig. 3: the paper's five steps to the wave gait, and two other ways."""
    ways = find_alternatives(wave_goal())
    return _transitions(
        [
            ("(a) the paper's own order", paper_wave_transition()),
            ("(b) five steps planned for margin", ways.still),
            (f"(c) the body shifting by at most {MAX_SHIFT} m", ways.shifting),
        ]
    )


def spin_transition() -> Figure:
    """Returns Fig. 7: five steps to the spinning gait, and the four of a body that shifts."""
    ways = find_alternatives(spin_goal())
    return _transitions(
        [
            ("(a) five steps, body still", ways.still),
            (f"(b) the body shifting by at most {MAX_SHIFT} m", ways.shifting),
        ]
    )


def _transitions(rows: list[tuple[str, Transition]]) -> Figure:
    """Returns a figure with a row of panels, one a step, for each transition."""
    figure = new_figure(12.0, 2.25 * len(rows))
    parts: Any = figure.subfigures(len(rows), 1)
    for part, (name, transition) in zip(parts, rows, strict=True):
        part.suptitle(
            f"{name}: legs {order_of(transition)}, least margin {_metres(transition.margin_min)}",
            fontsize=10, x=0.01, ha="left",
        )  # fmt: skip
        panels = part.subplots(1, 5)
        shifts = np.abs([step.shift for step in transition.steps])
        feet = np.array(transition.start)
        for k, axes in enumerate(panels):
            if k >= len(transition.steps):
                axes.set_axis_off()
                continue
            step = transition.steps[k]
            top_view(axes, room=0.18 + shifts.max(), labels=False)
            axes.set_title(
                f"step {k + 1}: leg {int(step.leg)}, {_metres(step.margin)}", fontsize=8.5
            )
            _draw_step(axes, feet, step.leg, step.p_to, shift=step.shift)
            feet[step.leg.row] = step.p_to
    return figure


def _draw_step(
    axes: Axes, feet: np.ndarray, leg: Leg, p_to: np.ndarray, *, shift: np.ndarray
) -> None:
    """Draws one step: the feet (4, 2) before it, the swing leg's way, the support polygon."""
    draw_boxes(axes, WORKSPACE, body=shift)  # the boxes go with the body
    draw_support(axes, feet, np.array([other != leg for other in LEGS]))
    draw_centre(axes, shift)
    for other in LEGS:
        if other != leg:
            draw_foot(axes, other, feet[other.row])
        name_leg(axes, other, feet[other.row], offset=_OUTWARD[other])
    axes.plot(*feet[leg.row], marker="x", ms=5, color=COLOURS[leg], zorder=4)
    draw_foot(axes, leg, p_to, solid=False)
    arrow(axes, feet[leg.row], p_to, colour=COLOURS[leg])


def _metres(margin: float) -> str:
    """Returns a margin as text, without a minus for a zero."""
    return f"{round(margin, 3) + 0.0:.3f} m"
