"""Figs. 1, 10, 11 and 12: the robot, its way, its trajectories and its margin."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import Segment, pose_robot
from drake_quad.report.style import BAND_OPACITY, kind_colour
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course
from paper.drawing import BODY, COLOURS, FAINT, Axes, Solids, View, new_figure, style_axes
from paper.study import TABLE_I, UP, CaseStudy, Samples, Zero, find_zeros

# ------------------------------------------------------------------------------------------------
# Figs. 1 and 10: the robot, and the robot on its way over the stairs.
# ------------------------------------------------------------------------------------------------


FROM_AHEAD = View(azimuth=-38.0, elevation=20.0)
FROM_CORNER = View(azimuth=128.0, elevation=30.0)  # inside of the turn: both flights' risers show
TRUNK, FLOOR, TREAD, OTHER_TREAD = "#D9D9D9", "#CFCBC4", "#E2DCD0", "#CDC4B3"
THIGH, SHANK, HIP = 0.028, 0.018, 0.045  # [m] radii as drawn


def robot_model(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 1: the robot in its initial configuration, its frame and its legs' numbers."""
    figure = new_figure(7.5, 5.6)
    axes = figure.subplots()
    body, feet = samples.body[0], samples.feet[0]
    solids, view = Solids(), FROM_AHEAD
    ground = Solids()
    ground.add_box(np.array([body[0], 0.0, -0.02]), (2.4, 1.7, 0.04), np.eye(3), FLOOR)
    ground.paint(axes, view, zorder=1.0)
    w = TABLE_I.workspace
    for centre, leg in zip(w.centres, LEGS, strict=True):
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * w.half_size + centre
        box = np.column_stack([corners + body[:2], np.zeros(4)])
        axes.fill(*view.flat(box).T, facecolor="none", edgecolor=COLOURS[leg], ls="--", lw=1.0,
                  zorder=1.5)  # fmt: skip
    _add_robot(solids, study.robot, body, feet)
    solids.paint(axes, view)
    peak = view.flat(body[:3] + np.array([0.0, 0.0, 0.55]))[1]
    axes.set_ylim(axes.get_ylim()[0], peak)
    for leg in LEGS:
        at = view.flat(feet[leg.row] + np.array([0.0, 0.12 * (1 if leg.row % 2 == 0 else -1), 0.0]))
        axes.text(*at, str(int(leg)), color=COLOURS[leg], fontsize=12, fontweight="bold",
                  ha="center", va="center", zorder=5)  # fmt: skip
    top = body[:3] + np.array([0.0, 0.0, 0.10])
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        tip = top + 0.34 * axis
        axes.annotate("", xy=view.flat(tip), xytext=view.flat(top), zorder=6,
                      arrowprops={"arrowstyle": "-|>", "color": BODY, "lw": 1.3})  # fmt: skip
        axes.text(*view.flat(top + 0.40 * axis), f"${name}$", fontsize=11, ha="center",
                  va="center", zorder=6)  # fmt: skip
    return figure


def traverse(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 10: the robot on the whole course, at five moments of the case study."""
    figure = new_figure(12.0, 5.6)
    axes = figure.subplots()
    solids = Solids()
    _add_course(solids, study.course)
    spin = next(s for s in study.segments if s.kind == "spin")
    walks = [s for s in study.segments if s.kind == "wave"]
    moments = [
        walks[0].start - 2.0,
        walks[0].start + 4.6 * TABLE_I.T,
        0.5 * (spin.start + spin.end),
        walks[1].start + 3.6 * TABLE_I.T,
        walks[1].end,
    ]
    for k, t in enumerate(moments):
        n = int(np.argmin(np.abs(samples.times - t)))
        _add_robot(solids, study.robot, samples.body[n], samples.feet[n])
        at = FROM_CORNER.flat(samples.body[n, :3] + np.array([0.0, 0.0, 0.55]))
        axes.text(*at, f"({'abcde'[k]}) {samples.times[n]:.0f} s", fontsize=9, ha="center",
                  va="center", zorder=9)  # fmt: skip
    solids.paint(axes, FROM_CORNER)
    return figure


def _add_course(solids: Solids, course: Course) -> None:
    """Adds the course's boxes, neighbouring treads in other shades."""
    treads = 0
    for box in course.boxes:
        colour = FLOOR
        if "tread" in box.name:
            treads += 1
            colour = (TREAD, OTHER_TREAD)[treads % 2]
        c, s = np.cos(box.yaw), np.sin(box.yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        solids.add_box(np.asarray(box.centre), box.size, R, colour)


def _add_robot(solids: Solids, robot: RobotModel, body: FloatArray, feet: FloatArray) -> None:
    """Adds the robot with its body at a pose (5,) and its feet (4, 3) in W."""
    q = pose_robot(robot, body[None], feet[None])[0][0]
    R, g = rotations(body), robot.geometry
    for low, high in robot.trunk_boxes:
        centre = body[:3] + R @ (0.5 * (low + high))
        solids.add_box(centre, high - low, R, TRUNK)
    abduction = q[:, 0]
    aside = np.stack([np.zeros(4), np.cos(abduction), np.sin(abduction)], axis=-1)
    hips_B = g.p_BH + g.offset[:, None] * aside
    knees_B = calc_knees(g, q)
    for leg in LEGS:
        row, colour = leg.row, COLOURS[leg]
        joint, hip, knee = (body[:3] + R @ p[row] for p in (g.p_BH, hips_B, knees_B))
        if np.linalg.norm(hip - joint) > 1e-6:
            solids.add_rod(joint, hip, HIP, TRUNK)
        solids.add_rod(hip, knee, THIGH, colour)
        solids.add_rod(knee, feet[row], SHANK, colour)


# ------------------------------------------------------------------------------------------------
# Figs. 11 and 12: the case study's trajectories, and its static margin over time.
# ------------------------------------------------------------------------------------------------


_ZERO_STYLE = {"transition": ("#C0392B", "s"), "wave": ("#5B2C83", "o")}
_NAMES = {
    "walk 2": "level walk, then up the stairs",
    "spin 3": "spin 90°",
    "walk 4": "down the stairs, then level walk",
    "transition to the centres": "to centres",
    "transition to the wave gait": "to wave",
    "transition to the spinning gait": "to spin",
}


def trajectories(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 11: body, leg 1 and leg 2 over the ground, x, y and z over time."""
    figure = new_figure(12.0, 7.6)
    panels = figure.subplots(3, 1, sharex=True)
    lines: list[tuple[str, str, FloatArray]] = [
        ("body", BODY, samples.body[:, :3]),
        ("leg 1", COLOURS[Leg(1)], samples.feet[:, 0]),
        ("leg 2", COLOURS[Leg(2)], samples.feet[:, 1]),
    ]
    for axis, (axes, name) in enumerate(zip(panels, "xyz", strict=True)):
        draw_segments(axes, study.segments, names=axis == 0)
        for label, colour, places in lines:
            axes.plot(samples.times, places[:, axis], color=colour, lw=1.4, label=label)
        style_axes(axes, "t [s]" if name == "z" else "", f"{name} [m]")
        axes.set_xlim(0.0, study.duration)
    panels[0].legend(fontsize=8, loc="lower right", ncols=3)
    return figure


def margins(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 12: the static margin over time, its zeros marked, and two close-ups."""
    figure = new_figure(12.0, 7.0)
    parts: Any = figure.subfigures(2, 1, height_ratios=[1.15, 1.0])
    upper, lower = parts
    zeros = find_zeros(study, samples)
    whole = upper.subplots()
    draw_segments(whole, study.segments, names=True)
    _draw_margin(whole, samples, zeros)
    whole.set_xlim(0.0, study.duration)
    style_axes(whole, "t [s]", "static margin [m]")
    whole.legend(fontsize=7.5, loc="upper center", ncols=4, bbox_to_anchor=(0.5, -0.14))
    first, spin = lower.subplots(1, 2, sharey=True)
    wave = next(s for s in study.segments if s.kind == "wave")
    turn = next(s for s in study.segments if s.kind == "spin")
    for axes, start, end, title in (
        (first, study.starts[UP], wave.start + 2.6 * TABLE_I.T, "the first transition, two cycles"),
        (spin, wave.end - 1.0, turn.end + 1.0, "wave → centres → spin"),
    ):
        draw_segments(axes, study.segments, names=False)
        _draw_margin(axes, samples, zeros)
        axes.set_xlim(start, end)
        style_axes(axes, "t [s]", "static margin [m]", title=title)
    return figure


def draw_segments(axes: Axes, segments: Sequence[Segment], *, names: bool) -> None:
    """Colours the segments behind axes over time, and names them along the top."""
    for segment in segments:
        axes.axvspan(segment.start, segment.end, facecolor=kind_colour(segment.kind),
                     alpha=BAND_OPACITY, edgecolor="none", zorder=0)  # fmt: skip
        if names and segment.end - segment.start > 5.0:
            name = _NAMES.get(segment.name, segment.name)
            axes.annotate(name, ((segment.start + segment.end) / 2, 1.0), xytext=(0, 3),
                          xycoords=("data", "axes fraction"), textcoords="offset points",
                          ha="center", fontsize=7, color=kind_colour(segment.kind))  # fmt: skip


def _draw_margin(axes: Axes, samples: Samples, zeros: Sequence[Zero]) -> None:
    """Draws the margin with massless legs, that of the whole robot, and the zeros."""
    axes.axhline(0.0, color="#C0392B", lw=0.8)
    axes.plot(samples.times, samples.margin_robot, color=FAINT, lw=0.8,
              label="whole robot's centre of mass")  # fmt: skip
    axes.plot(samples.times, samples.margin, color="#0B5394", lw=1.3,
              label="the paper's: body's centre, legs massless")  # fmt: skip
    for kind, (colour, marker) in _ZERO_STYLE.items():
        mine = [zero for zero in zeros if zero.kind == kind]
        where = "steps of transitions" if kind == "transition" else "switches 1→4, 2→3 of the wave"
        at = np.array([(zero.start + zero.end) / 2 for zero in mine])
        axes.plot(at, np.zeros(len(at)), marker=marker, ls="none", ms=5, color=colour,
                  mfc="white", mew=1.2, zorder=6, label=f"zero in {len(mine)} {where}")  # fmt: skip
        for zero in mine:
            axes.plot([zero.start, zero.end], [0.0, 0.0], color=colour, lw=3.0, zorder=5)
    axes.grid(axis="y", color="#E6E6E6", lw=0.6)
