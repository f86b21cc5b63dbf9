"""Draws a planned climb: the robot through a gait cycle up and one down, and the margin."""

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from drake_quad.common import FloatArray
from drake_quad.feasibility.check_words import treads_in_words
from drake_quad.feasibility.result import margin_name
from drake_quad.feasibility.robot_picture import FRONT, INK, REAR
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.tempo import static_margin
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, Segment, evaluate
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.legs import LEGS, SHORT_NAMES
from drake_quad.robot.model import SHANK_POINTS, LinkOutline, RobotModel, link_outline_of
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.terrain.lane import Lane

TRUNK, GROUND, EDGE = "#dcdcdc", "#d8d0c4", "#8f8474"
FAR_FIRST = (0, 2, 1, 3)  # from its right the left legs are behind

MOMENTS = 6  # of a cycle
SEARCH = 400  # samples of a walk among which the middle of a flight is sought

PERIOD = 0.05  # [s] between the samples of the margin
UP, DOWN = "#3c7d3c", "#8a4f9e"


def draw_moment(
    ax: Axes, robot: RobotModel, shape: LinkOutline, lane: Lane, samples: PlanSamples, k: int
) -> None:
    """Draws the robot at sample `k`, in the lane's (s, z) [m]."""
    body, feet, q = samples.body[k, 0], samples.feet[k], samples.q[k]
    R = rotations(body)

    def flat(p_B: FloatArray) -> FloatArray:
        """Points (..., 3) in B as (..., 2) in the picture."""
        return _flat(lane, body[:3] + np.asarray(p_B) @ R.T)

    knees_B = calc_knees(robot.geometry, q)
    side = robot.geometry.p_HP
    hips, knees, soles = flat(robot.geometry.p_BH + side), flat(knees_B), _flat(lane, feet)
    size = float(np.max(robot.geometry.reach))
    middle = _flat(lane, body[None, :3])[0]
    half = 0.5 * float(shape.trunk_upper[0] - shape.trunk_lower[0]) + 0.55 * size
    _ground(ax, lane, middle[0] - half, middle[0] + half)
    low, high = shape.trunk_lower, shape.trunk_upper
    corners = np.array(
        [[low[0], 0, low[2]], [high[0], 0, low[2]], [high[0], 0, high[2]], [low[0], 0, high[2]]]
    )
    ax.add_patch(Polygon(flat(corners), fc=TRUNK, ec=INK, lw=1.0, alpha=0.85, zorder=4))
    for row in FAR_FIRST:
        near = row in FAR_FIRST[-2:]
        colour = FRONT if LEGS[row].short.startswith("F") else REAR
        look = {"alpha": 1.0 if near else 0.45, "zorder": 5 if near else 3}
        ax.plot(*np.array([hips[row], knees[row]]).T, "-", color=colour, lw=2.6,
                solid_capstyle="round", **look)  # fmt: skip
        outline = _shank(knees[row], soles[row], shape.shank_offsets[row], shape.shank_radii[row])
        ax.add_patch(Polygon(outline, fc=colour, ec=colour, lw=0.8, **look))
        swings = not samples.standing[k, row]
        ax.add_patch(Circle(soles[row], robot.foot_radius, fc=colour, ec=colour, lw=0.8, **look))
        if swings:
            ax.plot(*soles[row], "o", color="white", mec=colour, mew=1.6, ms=6.5, **look)
        ax.plot(*hips[row], "o", color="white", mec=colour, ms=3.5, **look)
        ax.plot(*knees[row], "o", color="white", mec=colour, ms=3.5, **look)
    com = _flat(lane, samples.com[k][None])[0]
    ax.plot(
        [com[0], com[0]], [com[1], float(lane.height(com[0]))], ":", color=INK, lw=1.0, zorder=6
    )
    ax.plot(*com, "o", color="white", mec=INK, ms=5, zorder=7)
    # Every moment shows as much around the body, so that all are drawn to one scale.
    below = float(np.max(samples.body[:, 0, 2] - samples.feet[..., 2].min(axis=1))) + 0.15 * size
    above = float(high[2]) + half * abs(float(np.sin(samples.body[:, 0, 3]).min())) + 0.05 * size
    ax.set_aspect("equal")
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ax.set_ylim(middle[1] - below, middle[1] + above)
    ax.tick_params(labelsize=7)


def _flat(lane: Lane, p_W: FloatArray) -> FloatArray:
    """Points (..., 3) in W as (..., 2): along the lane, and up."""
    s, _ = lane.coordinates(p_W[..., :2])
    return np.stack([s, p_W[..., 2]], axis=-1)


def _ground(ax: Axes, lane: Lane, start: float, end: float) -> None:
    """The course's profile, filled downwards; treads' overhangs are not drawn."""
    start, end = max(start, -lane.run_in), min(end, lane.length + lane.run_out)
    d, z = lane.profile(start, end)
    ax.fill_between(start + d, z, np.min(z) - 5.0, color=GROUND, lw=0, zorder=1)
    ax.plot(start + d, z, "-", color=EDGE, lw=1.2, zorder=2)


def _shank(
    knee: FloatArray, foot: FloatArray, offsets: FloatArray, radii: FloatArray
) -> FloatArray:
    """A shank's outline (n, 2), as thick as its collision geometry."""
    along = (foot - knee) / max(float(np.linalg.norm(foot - knee)), 1e-9)
    ahead = np.array([-along[1], along[0]])
    share = np.append(SHANK_POINTS, 1.0)[:, None]
    middle, wide = (np.append(v, v[-1])[:, None] for v in (offsets, radii))
    line = knee + share * (foot - knee) + middle * ahead
    return np.concatenate([line + wide * ahead, (line - wide * ahead)[::-1]])


@dataclass(frozen=True, eq=False)
class Stretch:
    """A gait cycle of a walk.

    Attributes:
        going: `up`, `down` or `on`.
        plan: Plan of the walk.
        lane: Lane of the walk.
        start: Start of the cycle in the plan's time [s].
        cycle_time: Length of the cycle [s].
        times: Moments to draw (MOMENTS,), in the plan's time [s].
        in_air: Short name of the leg that swings at each moment; empty if none does.
    """

    going: str
    plan: MotionPlan
    lane: Lane
    start: float
    cycle_time: float
    times: FloatArray
    in_air: tuple[str, ...]


def find_stretches(designed: Designed, robot: RobotModel) -> tuple[Stretch, ...]:
    """A cycle in the middle of the first flight up, and of the first down; else of a walk."""
    scenario = designed.scenario
    course = course_of(scenario, source="check", foot_radius=robot.foot_radius)
    walks = [
        (plan, course.lanes[task.lane], segment)
        for task, plan in zip(
            mission_of(scenario, course, source="check"), designed.plan.plans, strict=True
        )
        for segment in plan.segments
        if segment.kind == "wave"
    ]
    found: dict[str, Stretch] = {}
    for plan, lane, segment in walks:
        for flight in lane.flights:
            treads = lane.treads(flight)
            middle = 0.5 * float(treads[0, 0] + treads[-1, 1])
            if flight.going not in found:
                found[flight.going] = _cycle(flight.going, plan, lane, segment, middle)
    if not found and walks:
        plan, lane, segment = walks[0]
        found["on"] = _cycle("on", plan, lane, segment, 0.5 * lane.length)
    return tuple(found[going] for going in ("up", "down", "on") if going in found)


def _cycle(going: str, plan: MotionPlan, lane: Lane, segment: Segment, middle: float) -> Stretch:
    """The cycle in which the body is nearest to a place along the lane [m]."""
    times = np.linspace(segment.start, segment.end, SEARCH)
    s, _ = lane.coordinates(plan.body.samples(times)[:, 0, :2])
    cycle = float(segment.details["cycle_time"])
    whole = (float(times[int(np.argmin(np.abs(s - middle)))]) - segment.start) // cycle
    last = max((segment.end - segment.start) // cycle - 1.0, 0.0)
    start = segment.start + min(whole, last) * cycle
    moments = start + cycle * (np.arange(MOMENTS) + 0.5) / MOMENTS
    standing = plan.contacts.feet_at(moments)[1]
    names = tuple("".join(n for n, on in zip(SHORT_NAMES, s, strict=True) if not on)
                  for s in standing)  # fmt: skip
    return Stretch(going, plan, lane, start, cycle, moments, names)


def draw_check(designed: Designed, robot: RobotModel) -> Figure:
    """The figure: a row of moments each way, and below them the margin of the whole mission."""
    stretches = find_stretches(designed, robot)
    shape = link_outline_of(robot)
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
    way = treads_in_words(gait.treads, gait.places_per_tread)
    figure.suptitle(
        f"{designed.scenario.description}: {way} "
        f"a cycle, smallest {margin_name(designed.plan)} {1e3 * designed.margin:.0f} mm",
        fontsize=11,
        parse_math=False,
    )
    return figure


def _label(ax: Axes, stretch: Stretch, k: int) -> None:
    """Writes when in the cycle the moment is, and which leg swings."""
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
    least = static_margin(robot, designed)
    ax.axhline(1e3 * least, color=REAR, lw=0.9, ls="--")
    ax.annotate(f"smallest, {1e3 * least:.0f} mm", (0.0, 1e3 * least), (4, -11),
                textcoords="offset points", color=REAR)  # fmt: skip
    ax.set_xlim(0.0, mission.duration)
    low = 0.0 if least >= 0.0 else least - 0.1 * top  # with room for its words
    ax.set_ylim(1e3 * low, 1.15e3 * top)
    ax.set_xlabel("time, s (the marks are the moments above)")
    ax.set_ylabel("static margin, mm")
