"""Figs. 4 and 5, and what is not in the paper: the robot on stairs, and treads a cycle."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import wave_schedule
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.lane import Lane
from paper.drawing import (
    BODY,
    COLOURS,
    FAINT,
    GROUND,
    Axes,
    dimension,
    draw_centre,
    draw_foot,
    draw_support,
    name_leg,
    new_figure,
    style_axes,
    top_view,
)
from paper.gaits import StairSwing, stair_swing
from paper.margins import ONE, ONE_SPREAD, TWO, TreadGait, dense_phases
from paper.study import TABLE_I, UP, CaseStudy, climbing_cycle, sample_plan, wave_cycles

# ------------------------------------------------------------------------------------------------
# Figs. 4 and 5: the robot climbing stairs, from its right side, and the swing leg's path.
# ------------------------------------------------------------------------------------------------


def leg_joints(robot: RobotModel, body: FloatArray, feet: FloatArray) -> FloatArray:
    """Returns (4, 3, 3): hip, knee and foot of each leg in W [m].

    Args:
        robot: The robot.
        body: (5,) the body's pose in W.
        feet: (4, 3) foot centres in W.
    """
    q = pose_robot(robot, body[None], feet[None])[0][0]
    R_WB, g = rotations(body), robot.geometry
    p_WH, p_WK = (body[:3] + p @ R_WB.T for p in (g.p_BH, calc_knees(g, q)))
    return np.stack([p_WH, p_WK, feet], axis=1)


def stair_climbing(study: CaseStudy) -> Figure:
    """Returns Fig. 4: a cycle of the wave gait on the stairs, one panel a swing."""
    figure = new_figure(12.0, 7.4)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    steps = wave_cycles(study.plans[UP])[climbing_cycle(study)]
    begin = steps[0].lift_off
    for axes, step in zip(panels.flat, steps, strict=True):
        _draw_swing_phase(axes, study, step)
        sampled = sample_plan(study, UP, start=step.lift_off, end=step.touchdown).margin
        start, end = ((t - begin) / TABLE_I.T for t in (step.lift_off, step.touchdown))
        style_axes(axes, "x [m]", "z [m]", title=(
            f"{start:.2f} T to {end:.2f} T: leg {int(step.leg)} swings, margin "
            f"{round(sampled.min(), 3) + 0.0:.3f} to {sampled.max():.3f} m"))  # fmt: skip
    return figure


def _draw_swing_phase(axes: Axes, study: CaseStudy, step: Step) -> None:
    """Draws the robot in the middle of a swing, and where its body is at both ends of it."""
    plan, lane = study.plans[UP], study.course.lanes[0]
    middle = plan.sample((step.lift_off + step.touchdown) / 2)
    body = middle.body[0]
    _draw_lane(axes, lane)
    joints = leg_joints(study.robot, body, middle.feet)
    for leg in (Leg(1), Leg(3), Leg(2), Leg(4)):  # the right legs are nearer
        near = leg in (Leg(2), Leg(4))
        axes.plot(*joints[leg.row][:, [0, 2]].T, color=COLOURS[leg], lw=3.2 if near else 2.0,
                  marker="o", ms=3, zorder=5 if near else 3,
                  solid_capstyle="round")  # fmt: skip
        foot = middle.feet[leg.row]
        draw_foot(axes, leg, foot[[0, 2]], solid=leg != step.leg, size=7)
        axes.annotate(str(int(leg)), foot[[0, 2]], xytext=(10 if near else -10, 5),
                      textcoords="offset points", ha="center", fontsize=9, color=COLOURS[leg],
                      fontweight="bold", zorder=9)  # fmt: skip
    path = step.swing.positions(np.linspace(0, step.swing.duration, 120))
    axes.plot(path[:, 0], path[:, 2], color=COLOURS[step.leg], lw=1.2, ls="--", zorder=6)
    for end in (step.swing.p_start, step.swing.p_end):
        axes.plot(end[0], end[2], marker="o", ms=7, mfc="none", color=COLOURS[step.leg], zorder=6)
    half = study.robot.geometry.p_BH[0, 0] + 0.06
    for t, style in ((step.lift_off, ":"), (None, "-"), (step.touchdown, ":")):
        x, z = (body if t is None else plan.body.sample(t)[0])[[0, 2]]
        fill = {"facecolor": "#E6E6E6", "alpha": 0.85} if t is None else {"facecolor": "none"}
        corners = np.array([[-half, -0.07], [half, -0.07], [half, 0.07], [-half, 0.07]])
        edge = BODY if t is None else FAINT
        axes.fill(*np.add(corners, (x, z)).T, edgecolor=edge, ls=style, lw=1.0, zorder=4, **fill)
    draw_centre(axes, (body[0], body[2]))
    axes.set_aspect("equal")


def _draw_lane(axes: Axes, lane: Lane) -> None:
    """Draws the stairs of a lane, the treads numbered."""
    axes.set(xlim=(4.1, 7.2), ylim=(-0.12, 1.62))
    d, z = lane.profile(3.6, 7.6)
    axes.fill_between(3.6 + d, z, -0.3, color=GROUND, lw=0, zorder=1)
    axes.plot(3.6 + d, z, color="#6B655C", lw=1.0, zorder=2)
    for number, (_, b, height) in enumerate(lane.treads(lane.flights[0]), start=1):
        axes.text(b - 0.07, height - 0.075, str(number), fontsize=8, ha="center", va="center",
                  color="#5B554D", zorder=3, clip_on=True)  # fmt: skip


def swing_path() -> Figure:
    """Returns Fig. 5: the swing leg's path up and down two treads, and over time."""
    figure = new_figure(11.0, 5.7)
    panels = figure.subplots(2, 2, height_ratios=[1.25, 1.0])
    for column, going in enumerate((1, -1)):
        right = stair_swing(going=going, chosen=1 if going > 0 else 0)
        wrong = stair_swing(going=going, chosen=0 if going > 0 else 1)
        _draw_path(panels[0, column], right, wrong, going)
        _draw_over_time(panels[1, column], right)
    return figure


def _draw_path(axes: Axes, right: StairSwing, wrong: StairSwing, going: int) -> None:
    """Draws the swing over its stairs, the other choice of riser, and the paper's lengths."""
    colour = COLOURS[Leg(1)]
    x_f, z_f = right.swing.p_end[0], right.swing.p_end[2]
    corners = np.array(
        [[-0.36, 0], [0.25, 0], [0.25, z_f / 2], [0.75, z_f / 2], [0.75, z_f], [1.36, z_f]]
    )
    axes.fill_between(corners[:, 0], corners[:, 1], -0.7, color=GROUND, lw=0)
    axes.plot(*corners.T, color="#6B655C", lw=1.0)
    times = np.linspace(0, right.swing.duration, 300)
    for swing, style, name in ((wrong, ":", "the other riser as $d_s$, $h_s$"),
                               (right, "-", "equations (1)–(3)")):  # fmt: skip
        path = swing.swing.positions(times)
        axes.plot(path[:, 0], path[:, 2], color=colour if style == "-" else "#C0392B", ls=style,
                  lw=2.0 if style == "-" else 1.3, label=name, zorder=4)  # fmt: skip
    for k, (x, z) in enumerate(right.nosings):
        height = right.heights[k]
        axes.plot([x, x], [z, z + height], color=BODY, lw=1.2, zorder=5)
        text = rf"$\Delta h$ = {height:.2f} m" if k == right.chosen else f"{height:.3f} m"
        axes.annotate(text, (x, z + height), xytext=(-5 * going, 9), textcoords="offset points",
                      fontsize=8, ha="right" if going > 0 else "left", zorder=6)  # fmt: skip
    for end, solid in ((right.swing.p_start, True), (right.swing.p_end, False)):
        draw_foot(axes, Leg(1), end[[0, 2]], solid=solid)
    low = min(0.0, z_f) - 0.1
    d_s, h_s = right.nosings[right.chosen]
    dimension(axes, (0.0, low), (float(d_s), low), f"$d_s$ = {d_s:.2f} m")
    dimension(axes, (0.0, low - 0.09), (float(x_f), low - 0.09), f"$x_f$ = {x_f:.2f} m")
    side = -0.18 if going > 0 else 1.18
    dimension(axes, (side, 0.0), (side, float(z_f)), f"$z_f$ = {z_f:+.2f} m".replace("-", "−"))
    axes.set(xlim=(-0.36, 1.36), ylim=(low - 0.15, max(0.0, z_f) + 0.17))
    axes.set_aspect("equal")
    axes.legend(fontsize=7.5, loc="upper left" if going > 0 else "upper right")
    up = f"up: the last riser, $h_s$ = 2H = {h_s:.2f} m"
    down = f"down: the first riser, $h_s$ = {h_s:.0f}"
    style_axes(axes, "x [m]", "z [m]", title=up if going > 0 else down)


def _draw_over_time(axes: Axes, swing: StairSwing) -> None:
    """Draws x and z of the swing over time."""
    times = np.linspace(0, swing.swing.duration, 300)
    path = swing.swing.positions(times)
    axes.plot(times, path[:, 0], color=BODY, lw=1.5, label="x")
    axes.plot(times, path[:, 2], color=COLOURS[Leg(1)], lw=1.8, label="z")
    t_s = swing.swing.apex_time
    axes.axvline(t_s, color=FAINT, lw=0.9, ls="--")
    axes.annotate(f"$t_s$ = {t_s:.3f} s", (t_s, 0.1), xytext=(4, 0), textcoords="offset points",
                  xycoords=("data", "axes fraction"), fontsize=8)  # fmt: skip
    axes.set_xlim(0, swing.swing.duration)
    axes.grid(color="#E6E6E6", lw=0.6)
    style_axes(axes, "t [s]", "x, z [m]")
    axes.legend(fontsize=8, loc="center left")


# ------------------------------------------------------------------------------------------------
# One tread a cycle against two: support polygons swing by swing, and the margins.
# ------------------------------------------------------------------------------------------------


BETAS_DRAWN = np.linspace(0.75, 0.95, 21)
_LINES = {TWO: ("#0B5394", "-"), ONE: ("#C0392B", "-"), ONE_SPREAD: ("#C0392B", "--")}


def treads(*_: object) -> Figure:
    """Returns the figure that is not in the paper: its introduction's claim, tried."""
    figure = new_figure(12.0, 8.0)
    parts: Any = figure.subfigures(3, 1, height_ratios=[1.0, 1.0, 1.25])
    for part, gait, letter in zip(parts, (TWO, ONE), "ab", strict=False):
        part.suptitle(f"({letter}) {gait.name}", fontsize=10, x=0.01, ha="left")
        table = wave_schedule(duty_factor=TABLE_I.beta, cycle_time=1.0)
        for axes, (leg, start, end) in zip(
            part.subplots(1, 4), table.swing_intervals(), strict=True
        ):
            _draw_support(axes, gait, start, end)
            least = gait.margins(TABLE_I.beta, np.linspace(start, end - 1e-9, 51)).min()
            axes.set_title(
                f"leg {int(leg)} swings: at least {round(least, 3) + 0.0:.3f} m", fontsize=8.5
            )
    over_time, over_beta = parts[2].subplots(1, 2)
    phases = dense_phases(TABLE_I.beta)
    for gait, (colour, style) in _LINES.items():
        look: dict[str, Any] = {"color": colour, "ls": style, "lw": 1.5}
        over_time.plot(phases, gait.margins(TABLE_I.beta, phases), label=gait.name, **look)
        over_beta.plot(BETAS_DRAWN, [gait.least_margin(b) for b in BETAS_DRAWN], **look)
    for axes in (over_time, over_beta):
        axes.axhline(0.0, color="#666666", lw=0.8)
        axes.grid(axis="y", color="#E6E6E6", lw=0.6)
    over_time.set_xlim(0.0, 1.0)
    over_time.set_ylim(-0.1, 0.31)
    over_time.legend(fontsize=7.5, loc="upper center")
    title = f"(c) through a cycle, β = {TABLE_I.beta}"
    style_axes(over_time, "t / T", "static margin [m]", title=title)
    style_axes(over_beta, "β", "least static margin [m]", title="(d) the least of a cycle")
    return figure


def _draw_support(axes: Axes, gait: TreadGait, start: float, end: float) -> None:
    """Draws the feet and who stands in the middle of a swing, and the way of the body meanwhile."""
    middle = 0.5 * (start + end)
    feet = gait.feet(TABLE_I.beta, [middle])[0]
    table = wave_schedule(duty_factor=TABLE_I.beta, cycle_time=1.0)
    standing = table.standing(middle)
    top_view(axes, labels=False)
    axes.set(xlim=(-0.75, 1.0), ylim=(-0.46, 0.46))
    draw_support(axes, feet, standing)
    half = 0.5 * gait.stride * (end - start)
    axes.plot([-half, half], [0.0, 0.0], color="#222222", lw=2.0, zorder=5)
    draw_centre(axes)
    for leg in LEGS:
        draw_foot(axes, leg, feet[leg.row], solid=bool(standing[leg.row]), size=7)
        name_leg(axes, leg, feet[leg.row], offset=(0, 11 if leg.row % 2 == 0 else -11))
