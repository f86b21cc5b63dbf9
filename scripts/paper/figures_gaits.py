"""Figs. 2, 3, 6 to 9: configurations, transitions and the spin, seen from above."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Rectangle

from drake_quad.gait.schedule import spin_schedule
from drake_quad.gait.transition import Transition
from drake_quad.gait.workspace import (
    Workspace,
    body_turn,
    spin_arc,
    spin_cycles,
    spin_middles,
    spin_phi_max,
)
from drake_quad.robot.legs import LEGS, Leg
from paper.drawing import (
    BODY,
    COLOURS,
    FAINT,
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
    style_axes,
    top_view,
)
from paper.finding import order_of
from paper.findings_spin import NARROW_BOXES, equation_6_radicand
from paper.gaits import (
    MAX_SHIFT,
    QUARTER_TURN,
    WORKSPACE,
    find_alternatives,
    paper_wave_transition,
    quarter_turn_arc,
    spin_angles,
    spin_feet,
    spin_goal,
    wave_goal,
)
from paper.study import TABLE_I

# ------------------------------------------------------------------------------------------------
# Figs. 2, 3, 6 and 7: configurations and transitions, seen from above.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# Figs. 8 and 9: the geometry of the spin, and the feet's places through a cycle of it.
# ------------------------------------------------------------------------------------------------


BETA_DRAWN = 0.80  # Table I's 0.75 leaves the intervals on four feet no length to draw


def spin_geometry() -> Figure:
    """Returns Fig. 8: circle, box and angles where equations (4)-(6) hold, and with Table I."""
    figure = new_figure(10.5, 4.4)
    left, right = figure.subplots(1, 2)
    _draw_geometry(left, NARROW_BOXES)
    left.set_title(f"(a) $R_y$ = {NARROW_BOXES.R_y} m: the circle meets both lengths", fontsize=9.5)
    _draw_geometry(right, WORKSPACE)
    right.set_title(
        f"(b) Table I, $R_y$ = {WORKSPACE.R_y} m: "
        rf"$P_x^2 - 2P_yR_y - R_y^2$ = −{-equation_6_radicand(WORKSPACE):.2f} m² < 0",
        fontsize=9.5,
    )
    return figure


def _draw_geometry(axes: Axes, workspace: Workspace) -> None:
    """Draws leg 1's box, the circle through its centre, and the angles δ, φ, γ."""
    w, colour = workspace, COLOURS[Leg(1)]
    axes.set_aspect("equal")
    axes.set(xlim=(-0.07, 0.84), ylim=(-0.06, 0.60))
    style_axes(axes, "x [m]", "y [m]")
    axes.axhline(0, color=FAINT, lw=0.8, ls="-.")
    axes.axvline(0, color=FAINT, lw=0.8, ls="-.")
    centre = w.centres[0]
    axes.add_patch(Rectangle(tuple(centre - w.half_size), w.R_x, w.R_y, fill=False, ls="--",
                             edgecolor=colour))  # fmt: skip
    axes.plot(*centre, marker="+", color=colour, ms=8)
    draw_centre(axes)
    radius = np.hypot(w.P_x, w.P_y) / 2
    lo, hi = spin_arc(w)
    around = np.radians(np.linspace(-8, 98, 200))
    axes.plot(radius * np.cos(around), radius * np.sin(around), color="#AAAAAA", lw=0.9, ls=":")
    along = np.linspace(lo, hi, 90)
    axes.plot(radius * np.cos(along), radius * np.sin(along), color=colour, lw=2.6)
    for angle, name, offset in ((lo, "$A_1$", (15, -3)), (hi, "$B_1$", (6, 11))):
        end = radius * np.array([np.cos(angle), np.sin(angle)])
        axes.plot(*end, marker="o", color=colour, ms=6)
        axes.plot([0, end[0]], [0, end[1]], color=BODY, lw=0.8)
        axes.annotate(
            name, end, xytext=offset, textcoords="offset points", fontsize=10, ha="center"
        )
    _draw_angle(axes, 0.0, lo, 0.27, rf"$\delta$ = {np.degrees(lo):.3f}°", 0.29)
    _draw_angle(axes, lo, hi, 0.17, rf"$\varphi$ = {np.degrees(hi - lo):.2f}°", 0.2)
    _draw_angle(axes, hi, np.pi / 2, 0.27, rf"$\gamma$ = {90 - np.degrees(hi):.3f}°", 0.31)
    x, y = 0.49 * np.cos(0.6 * hi + 0.4 * lo), 0.49 * np.sin(0.6 * hi + 0.4 * lo)
    axes.text(x + 0.02, y + 0.02, f"r = {radius:.4f} m", fontsize=8.5, color="#666666")
    top, bottom = centre[1] + w.R_y / 2, centre[1] - w.R_y / 2
    box = centre[0] + w.R_x / 2
    axes.text(box - 0.01, top + 0.012, rf"$(P_y+R_y)/2$ = {top:.2f} m", fontsize=8, ha="right")
    axes.text(box - 0.01, bottom + 0.012, rf"$(P_y-R_y)/2$ = {bottom:.2f} m", fontsize=8,
              ha="right")  # fmt: skip


def _draw_angle(axes: Axes, start: float, end: float, radius: float, text: str, out: float) -> None:
    """Draws an angle [rad] at the origin, `radius` [m] from it, and its name `out` from it."""
    axes.add_patch(Arc((0, 0), 2 * radius, 2 * radius, theta1=np.degrees(start),
                       theta2=np.degrees(end), color=BODY, lw=1.2))  # fmt: skip
    middle = (start + end) / 2
    small = end - start < 0.1
    if small and middle < 0.5:
        axes.text(0.13, -0.04, text, fontsize=9)
    elif small:
        axes.text(0.035, 0.30, text, fontsize=9, rotation=90, va="center")
    else:
        axes.text(out * np.cos(middle), out * np.sin(middle), text, fontsize=9, va="center",
                  ha="left" if middle < 1.2 else "center",
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip


def spin_cycle() -> Figure:
    """Returns Fig. 9: where the feet are, in B, in the six intervals of a counterclockwise spin."""
    figure = new_figure(11.0, 8.2)
    parts: Any = figure.subfigures(2, 1, height_ratios=[2.0, 1.15])
    upper, lower = parts
    _, phi = spin_cycles(QUARTER_TURN, BETA_DRAWN, spin_phi_max(WORKSPACE))
    table = spin_schedule(duty_factor=BETA_DRAWN, cycle_time=1.0)
    swings = table.swing_intervals()
    ends = [swings[0][1], swings[0][2], swings[1][1], swings[1][2], swings[2][2], swings[3][1], 1.0]
    turns = np.degrees(body_turn(BETA_DRAWN, phi))
    for k, axes in enumerate(np.ravel(upper.subplots(2, 3))):
        leg = table.swing_leg((ends[k] + ends[k + 1]) / 2)
        who = f"leg {int(leg)} swings" if leg else "all feet stand"
        turn = f"$\\Delta\\Omega$ = {turns[0]:.0f}°" if leg else (
            f"$\\Delta\\Omega'$ = {turns[1]:.0f}°")  # fmt: skip
        top_view(axes, room=0.17, labels=False)
        axes.set_title(f"[$t_{k}$–$t_{k + 1}$]: {who}, {turn}", fontsize=9)
        _draw_interval(axes, leg, phi, ends[k], ends[k + 1])
    upper.suptitle(f"(a) the feet relative to the body, drawn for β = {BETA_DRAWN:.2f}, φ = "
                   f"{np.degrees(phi):.0f}°", fontsize=10, x=0.01, ha="left")  # fmt: skip
    lower.suptitle("(b) angle of each foot from the middle of its arc through a 90° cycle",
                   fontsize=10, x=0.01, ha="left")  # fmt: skip
    for axes, beta in zip(
        lower.subplots(1, 2, sharey=True), (BETA_DRAWN, TABLE_I.beta), strict=True
    ):
        _draw_angles(axes, beta)
    return figure


def _draw_interval(axes: Axes, leg: Leg | None, phi: float, start: float, end: float) -> None:
    """Draws the feet's ways in one interval: from the solid circles to the open ones."""
    draw_boxes(axes, WORKSPACE)
    draw_centre(axes)
    phases = np.linspace(start, np.nextafter(end, 0.0), 30)
    feet = spin_feet(WORKSPACE, phi=phi, duty_factor=BETA_DRAWN, phases=phases)
    standing = np.array([other != leg for other in LEGS])
    draw_support(axes, feet[0], standing)
    for other in LEGS:
        way: Any = feet[:, other.row]
        axes.plot(*way.T, color=COLOURS[other], lw=1.8 if other == leg else 1.2,
                  ls="--" if other == leg else "-", zorder=4)  # fmt: skip
        draw_foot(axes, other, way[0], size=7)
        draw_foot(axes, other, way[-1], solid=False, size=7)
        outward = 1.32 * way[len(way) // 2]
        axes.text(*outward, str(int(other)), color=COLOURS[other], fontsize=9, ha="center",
                  va="center", fontweight="bold")  # fmt: skip


def _draw_angles(axes: Axes, beta: float) -> None:
    """Draws the feet's angles through a cycle with the duty factor `beta`."""
    _, phi = spin_cycles(QUARTER_TURN, beta, spin_phi_max(WORKSPACE))
    phases = np.linspace(0.0, 1.0, 801)
    angles = np.degrees(spin_angles(phi=phi, duty_factor=beta, phases=phases))
    for leg in LEGS:
        axes.plot(TABLE_I.T * phases, angles[:, leg.row], color=COLOURS[leg], lw=1.5,
                  label=f"leg {int(leg)}")  # fmt: skip
    room = np.degrees(spin_phi_max(WORKSPACE)) / 2
    for sign in (-1, 1):
        axes.axhline(sign * np.degrees(phi) / 2, color=FAINT, lw=0.8, ls="--")
        axes.axhline(sign * room, color=BODY, lw=0.9)
    axes.text(0.1, room + 1.5, "the box's edge, ±φ_max/2".replace("φ_max", r"$\varphi_{max}$"),
              fontsize=7.5)  # fmt: skip
    ends = np.unique(np.round(np.ravel([t[1:] for t in spin_schedule(
        duty_factor=beta, cycle_time=TABLE_I.T).swing_intervals()]), 9))  # fmt: skip
    for t in ends:
        axes.axvline(t, color="#CCCCCC", lw=0.7)
    axes.set(xlim=(0, TABLE_I.T), ylim=(-52, 56))
    style_axes(axes, "t [s]", "angle [°]", title=f"β = {beta:.2f}, φ = {np.degrees(phi):.1f}°")
    axes.legend(fontsize=7.5, ncols=4, loc="lower right")
