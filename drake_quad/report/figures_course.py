"""Figures along the course: footprints, side view, paths of base and feet."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from drake_quad.common import FloatArray
from drake_quad.report.axes import draw_event_shading, draw_line, label_time, make_axes, signed
from drake_quad.report.derived import (
    base_motion,
    calc_foot_centres,
    find_least_margin,
    margin_points,
    touchdowns,
)
from drake_quad.report.style import (
    BAD,
    COM_COLOUR,
    GOOD,
    GRID,
    INK,
    LEG_COLOURS,
    LEG_NAMES,
    LESS_COLOUR,
    MUTED,
    PAPER,
    THREE_COLOURS,
    WIDTH,
)
from drake_quad.robot.legs import Leg
from drake_quad.runs.reader import RecordedRun
from drake_quad.stability.support_polygon import support_polygon
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

HEADING_WEIGHT = 0.5  # [m/rad] on a landing, both lanes are near: the heading tells them apart

AROUND, BEYOND = 1.0, 0.15  # [m] shown around what was walked on, and beyond the course
TALLEST = 8.0  # [in] of the view from above
MARKERS = ("o", "s", "o", "s")  # left feet round, right feet square

TRACKED = (Leg.FRONT_LEFT, Leg.FRONT_RIGHT)  # legs 1 and 2, as in the paper's Fig. 11


@dataclass(frozen=True, eq=False)
class SideView:
    """A run seen from the side, along the lanes one after another.

    Attributes:
        com: (N, 2) along the course and height [m]; nan between two lanes.
        feet: (N, 4, 2) the lowest points of the feet, likewise.
        lane: (N,) index of the lane that the body is on; -1 where its place is not known.
    """

    com: FloatArray
    feet: FloatArray
    lane: np.ndarray[tuple[int, ...], np.dtype[np.intp]]


def lane_starts(course: Course) -> FloatArray:
    """How far along the course each lane begins, (n,) [m]."""
    lengths = [lane.length for lane in course.lanes]
    return np.concatenate([[0.0], np.cumsum(lengths)[:-1]])


def arc_length(run: RecordedRun) -> SideView:
    """The centre of mass and the feet of a run, seen from the side."""
    base, com, feet = base_motion(run), run.log.vector("com"), calc_foot_centres(run)
    cost = np.stack(
        [
            distance_to(lane, base.p_WB) + HEADING_WEIGHT * np.abs(_turn(base.rpy[:, 2], lane.yaw))
            for lane in run.world.lanes
        ]
    )
    known = np.isfinite(cost).all(axis=0)
    lane_of = np.where(known, np.argmin(np.where(known, cost, 0.0), axis=0), -1)
    com_out = np.full((len(com), 2), np.nan)
    feet_out = np.full((len(com), 4, 2), np.nan)
    for k, (lane, start) in enumerate(zip(run.world.lanes, lane_starts(run.world), strict=True)):
        mine = lane_of == k
        s, _ = lane.coordinates(com[mine])
        com_out[mine] = np.column_stack([start + s, com[mine, 2]])
        s, _ = lane.coordinates(feet[mine])
        feet_out[mine] = np.stack([start + s, feet[mine, :, 2] - run.robot.foot_radius], axis=-1)
    return SideView(com_out, feet_out, lane_of)


def distance_to(lane: Lane, p_W: FloatArray) -> FloatArray:
    """Horizontal distance of places (N, 2 or 3) in W from the lane's middle line, (N,) [m]."""
    s, lateral = lane.coordinates(p_W)
    beyond = np.maximum(np.maximum(-s, s - lane.length), 0.0)
    return np.asarray(np.hypot(beyond, lateral))


def _turn(a: FloatArray, b: float) -> FloatArray:
    """The angle a - b [rad], in [-π, π)."""
    return np.asarray(np.remainder(a - b + np.pi, 2.0 * np.pi) - np.pi)


def draw_footprints(run: RecordedRun) -> Figure:
    """The course from above with footprints, paths, and the support polygon of least margin."""
    low, high = _walked(run)
    size = high - low
    height = float(np.clip(WIDTH * size[1] / size[0] + 0.9, 2.6, TALLEST))
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axis = figure.subplots()
    _draw_ground(axis, run.world)
    if run.world is not run.course:
        _draw_map(axis, run.course)
    base, com = base_motion(run).p_WB, run.log.vector("com")
    _draw_path(axis, base, color=MUTED, lw=1.0, ls=(0, (4, 2)), label="body")
    _draw_path(axis, com, color=COM_COLOUR, lw=1.4, label="centre of mass")
    prints = touchdowns(run)
    for row, (colour, marker) in enumerate(zip(LEG_COLOURS, MARKERS, strict=True)):
        places = [p.p_WF[:2] for p in prints if p.row == row]
        if places:
            style = {"color": colour, "marker": marker, "ms": 4.5, "mew": 0, "ls": ""}
            axis.plot(*np.array(places).T, **style, label=f"leg {LEG_NAMES[row]}")
    _draw_least(axis, run)
    axis.set_aspect("equal")
    axis.set_xlim(low[0], high[0])
    axis.set_ylim(low[1], high[1])
    axis.grid(visible=False)
    axis.set_xlabel("x in W [m]")
    axis.set_ylabel("y in W [m]")
    if axis.get_legend_handles_labels()[0]:
        figure.legend(loc="outside upper center", ncols=8)
    return figure


def draw_side(run: RecordedRun) -> Figure:
    """The course from the side, its lanes one after another, with feet and centre of mass."""
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axis = figure.subplots()
    for lane, start in zip(run.world.lanes, lane_starts(run.world), strict=True):
        d, z = lane.profile(0.0, lane.length)
        axis.fill_between(start + d, z, z.min() - 0.12, color=GRID, lw=0)
        axis.plot(start + d, z, color=INK, lw=1.0)
        if start > 0.0:
            axis.axvline(start, color=MUTED, lw=0.8, ls=(0, (2, 2)))
            axis.annotate("turn", (start, 1.0), xycoords=("data", "axes fraction"), ha="center")
    if run.world is not run.course:
        _draw_map_profile(axis, run.course)
    view = arc_length(run)
    for row, colour in enumerate(LEG_COLOURS):
        label = f"foot {LEG_NAMES[row]}"
        _draw_side_path(axis, view.feet[:, row], view.lane, color=colour, lw=0.9, label=label)
    style = {"color": COM_COLOUR, "lw": 1.4, "label": "centre of mass"}
    _draw_side_path(axis, view.com, view.lane, **style)
    axis.set_xlabel("along the course [m]")
    axis.set_ylabel("z in W [m]")
    if axis.get_legend_handles_labels()[0]:
        figure.legend(loc="outside upper center", ncols=6)
    return figure


def _walked(run: RecordedRun) -> tuple[FloatArray, FloatArray]:
    """The corners (2,), (2,) of the part of the course to show [m]: where the robot has been."""
    low, high = run.world.bounds()[:, :2] + np.array([[-BEYOND], [BEYOND]])
    places = base_motion(run).p_WB[:, :2]
    places = places[np.isfinite(places).all(axis=1)]
    if len(places):
        low = np.maximum(low, places.min(axis=0) - AROUND)
        high = np.minimum(high, places.max(axis=0) + AROUND)
    # A robot that is off its course altogether leaves nothing to show of it.
    return low, np.maximum(high, low + 0.5)


def _draw_ground(axis: Axes, course: Course) -> None:
    """Outlines of treads, floors and landings, the higher the darker, and the nosings."""
    tops = np.array([box.top for box in course.boxes])
    span = float(np.ptp(tops)) or 1.0
    for box in sorted(course.boxes, key=lambda b: b.top):
        shade = 0.25 + 0.75 * (box.top - tops.min()) / span
        axis.add_patch(Polygon(box.corners(), facecolor=GRID, alpha=shade, lw=0, zorder=0.5))
        axis.add_patch(Polygon(box.corners(), facecolor="none", edgecolor=GRID, lw=0.8, zorder=0.6))
    for ends in course.nosings():
        axis.plot(ends[:, 0], ends[:, 1], color=MUTED, lw=1.4, zorder=0.7)


def _draw_map(axis: Axes, course: Course) -> None:
    """The nosings where the map has them."""
    label = "nosings as mapped"
    for ends in course.nosings():
        axis.plot(ends[:, 0], ends[:, 1], color=LESS_COLOUR, lw=0.8, zorder=0.8, label=label)
        label = ""


def _draw_map_profile(axis: Axes, course: Course) -> None:
    """The ground as the map has it, a line from the side."""
    label = "ground as mapped"
    for lane, start in zip(course.lanes, lane_starts(course), strict=True):
        d, z = lane.profile(0.0, lane.length)
        axis.plot(start + d, z, color=LESS_COLOUR, lw=0.8, label=label)
        label = ""


def _draw_path(axis: Axes, p_W: np.ndarray, **style: object) -> None:
    """A path from above, one sample in so many that none is missed."""
    known = np.isfinite(p_W).all(axis=1)
    if np.any(known):
        x, y = p_W[known, 0], p_W[known, 1]
        step = max(1, len(x) // 2500)
        axis.plot(x[::step], y[::step], **style)


def _draw_side_path(axis: Axes, p: np.ndarray, lane: np.ndarray, **style: object) -> None:
    """A path from the side, broken where the lane changes."""
    breaks = np.flatnonzero(np.diff(lane)) + 1
    p = np.insert(p, breaks, np.nan, axis=0)
    step = max(1, len(p) // 2500)
    keep = np.unique(
        np.concatenate([np.arange(0, len(p), step), np.flatnonzero(np.isnan(p[:, 0]))])
    )
    if np.any(np.isfinite(p)):
        axis.plot(p[keep, 0], p[keep, 1], **style)


def _draw_least(axis: Axes, run: RecordedRun) -> None:
    """The support polygon and the centre of mass at the moment of the least margin."""
    least = find_least_margin(run)
    if least is None:
        return
    k = least.sample
    feet = run.log.feet("position")[k, run.log.flags("bearing")[k], :2]
    colour = GOOD if least.margin >= 0.0 else BAD
    if len(feet):
        hull = support_polygon(feet)
        axis.add_patch(Polygon(hull, facecolor=colour, alpha=0.25, lw=0, zorder=3))
        axis.add_patch(Polygon(hull, facecolor="none", edgecolor=colour, lw=1.4, zorder=3))
    com = margin_points(run)[k]
    axis.plot(*com[:2], "x", color=INK, ms=7, mew=1.8, zorder=4)
    axis.annotate(
        signed(least.sentence),
        com[:2],
        xytext=(18, 18),
        textcoords="offset points",
        fontweight="bold",
        bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 1.5},
        arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8},
        zorder=5,
    )


def draw_trajectories(run: RecordedRun) -> Figure:
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
        draw_event_shading(list(column), run)
    for axis, name in zip(axes[:, 0], "xyz", strict=True):
        axis.set_ylabel(f"{name} [m]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
    label_time(axes[-1])
    return figure


def draw_base_error(run: RecordedRun) -> Figure:
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
    draw_event_shading(list(axes[:, 0]), run, label=axes[0, 0])
    axes[0, 0].set_ylabel("position [mm]")
    axes[1, 0].set_ylabel("attitude [deg]")
    label_time(axes[-1])
    return figure
