"""Lays a walk along a lane: transition to the wave gait's desired configuration, then the wave."""

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.contact_table import wave_table
from drake_quad.gait.legs import LEGS, SIGNS, FloatArray, Leg
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.lattice import Lattice, make_lattice
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import Segment, Stance
from drake_quad.planning.plan_transition import lay_transition
from drake_quad.planning.route import Route, robot_stance
from drake_quad.planning.settings import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.planning.tread_phase import (
    body_lift,
    body_shift,
    tilting_ground,
    tread_offset,
)
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course, Lane

# A walk begins where the body's program ended the task before, to its tolerance: without some slack
# ten microns make a walk of whole strides a cycle longer.
STRIDE_SLACK = 1e-4
EDGE_CLEARANCE = 0.01  # [m] between the foot's sphere and a nosing or riser


def lay_walk(
    robot: RobotModel, course: Course, settings: PlanSettings, task: Task, stance: Stance
) -> tuple[ContactPlan, Route, tuple[Segment, ...]]:
    """Returns the steps, the body's nominal route and the segments of a walk.

    Raises:
        PlanningError: If the lane has no room for it.
    """
    lane = course.lanes[task.lane]
    start = float(lane.coordinates(stance.body[:2])[0])
    pattern = settings.pattern
    n = pattern.treads
    lattice = make_lattice(
        lane,
        start=start,
        goal=task.goal,
        spacing=settings.stride / n * (1.0 + STRIDE_SLACK),
        behind=pattern.behind,
        ahead=pattern.beyond,
        per_cycle=n,
        per_tread=pattern.per_tread,
        deep=settings.deep_tread,
    )
    builder = StepBuilder(
        lane,
        stance.feet,
        foot_radius=robot.foot_radius,
        clearance=settings.swing_clearance,
        map_error_place=settings.map_error_place,
        map_error_height=settings.map_error_height,
    )
    segments = []

    lateral = robot_stance(settings)[:, 1]

    def place(leg: Leg, k: int) -> FloatArray:
        return lane.point(
            foothold(lane, lattice, leg, k, settings, robot.foot_radius),
            lateral[leg.row],
        )

    if settings.via_centres:
        centres = lane.point(start + robot_stance(settings)[:, 0], robot_stance(settings)[:, 1])
        segments.append(lay_transition(builder, centres, settings, body=stance.body,
                                       name="transition to the centres"))  # fmt: skip
    desired = np.stack([place(leg, pattern.first(leg)) for leg in LEGS])
    segments.append(lay_transition(builder, desired, settings, body=stance.body,
                                   name="transition to the wave gait",
                                   gait="wave"))  # fmt: skip
    moved = builder.time
    builder.wait(settings.shift_time)
    begin = builder.time
    table = wave_table(duty_factor=settings.duty_factor, cycle_time=settings.cycle_time)
    half_cycle = 0.5 * table.cycle_time + settings.switch_wait
    for cycle in range(lattice.cycles):
        for beat, (leg, lift_off, _) in enumerate(table.swing_intervals()):
            to = place(leg, pattern.first(leg) + n * (cycle + 1))
            # The second and the fourth leg are those diagonal to the leg that has just landed.
            waited = (2 * cycle + (beat + 1) // 2) * settings.switch_wait
            at = begin + cycle * table.cycle_time + lift_off + waited
            builder.step(leg, to, table.swing_time, lift_off=at)
    builder.time = begin + lattice.cycles * 2.0 * half_cycle
    stride = float(np.max(lattice.s[n:] - lattice.s[:-n]))
    segments.append(
        Segment(
            task.name,
            "wave",
            moved,
            builder.time,
            {
                "duty_factor": settings.duty_factor,
                "cycle_time": settings.cycle_time,
                "cycles": lattice.cycles,
                "treads": n,
                "stride": stride,
                "stroke": stride * settings.duty_factor,
                **_waits(settings),
            },
        )
    )
    builder.wait(settings.shift_time)
    segments.append(Segment("settle", "stand", segments[-1].end, builder.time))  # type: ignore[union-attr]

    times, s = _nominal(lattice, settings, (moved, begin), half_cycle, builder.time)
    xy = lane.point(s)
    xy[0] = stance.body[:2]
    half = 0.5 * settings.workspace.P_x

    def ground(p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        at, _ = lane.coordinates(p_W)
        lift = body_lift(lattice, at, settings)
        if settings.pitch_along_slope > 0.0:
            height, slope = tilting_ground(lattice, at, settings)
            return height + lift, slope
        behind, here, ahead = (lattice.height(at + d) for d in (-half, 0.0, half))
        return 0.25 * (behind + 2 * here + ahead) + lift, (ahead - behind) / (2 * half)

    yaw = np.concatenate([[stance.body[4]], np.full(len(times) - 1, lane.yaw)])
    yaw[1:] += 2 * np.pi * np.round((stance.body[4] - lane.yaw) / (2 * np.pi))
    route = Route(times, xy, yaw, ground, lane, start=stance.body[:4], joined=begin)
    return builder.finish(), route, tuple(s for s in segments if s is not None)


def _nominal(
    lattice: Lattice,
    settings: PlanSettings,
    start: tuple[float, float],
    half_cycle: float,
    end: float,
) -> tuple[FloatArray, FloatArray]:
    """Times [s] and the body's places along the lane [m] if margins did not matter.

    Over the lattice's places at an even pace, `body_ahead` places ahead of them but for the ends.

    Args:
        lattice: The places.
        settings: The gait's.
        start: When the transition to the gait ends, and when its first cycle begins [s].
        half_cycle: How long half a cycle takes [s].
        end: When the walk ends [s].
    """
    moved, begin = start
    beats = np.arange(2 * lattice.cycles + 1)
    times = np.concatenate([[0.0], begin + half_cycle * beats, [end]])
    at = 0.5 * settings.pattern.treads * beats
    ahead = np.full(len(beats), settings.body_ahead)
    ahead[[0, -1]] = 0.0
    ahead += _recentred(settings)
    places = lattice.behind + np.concatenate([[0.0], at + ahead, [at[-1]]])
    s = np.interp(places, np.arange(len(lattice.s)), lattice.s)
    shift = body_shift(lattice, s, settings)
    shift[[0, 1, -2, -1]] = 0.0  # walks begin and end at rest over their places
    s += shift
    if settings.uniform_body:  # it stays where it is through the transition
        times, s = np.insert(times, 1, moved), np.insert(s, 1, s[0])
    return times, s


def _recentred(settings: PlanSettings) -> float:
    """How far ahead of its places a body without sway goes, that its strokes be centred [places].

    The paper's two treads a cycle are centred at β = 3/4; a longer stroke, R = λβ, needs the body
    half of the difference ahead. It goes there on four feet before the first cycle, and back after
    the last. An optimised path finds its own way.
    """
    return settings.pattern.ahead(settings.duty_factor) if settings.uniform_body else 0.0


def _waits(settings: PlanSettings) -> dict[str, float]:
    """What a report is to say of the waits at switches, if there are any [s]."""
    if settings.switch_wait == 0.0:
        return {}
    lasts = settings.cycle_time + 2.0 * settings.switch_wait
    return {"switch_wait": settings.switch_wait, "cycle_lasts": lasts}


def foothold(
    lane: Lane, lattice: Lattice, leg: Leg, k: int, settings: PlanSettings, foot_radius: float
) -> float:
    """Where along the lane `leg` stands for place `k` of the lattice (0: under the body's start).

    The place itself on stairs; elsewhere the feet keep the gait's stance length P_x by an offset
    of ±(P_x - stance)/2, the stance of the pattern being 3/2 spacings in the two-tread gait. No
    footprint is nearer to a nosing or riser than the foot is wide.
    """
    i = int(np.clip(k + lattice.behind, 0, len(lattice.s) - 1))
    below, above = max(i - 1, 0), min(i + 1, len(lattice.s) - 1)
    spacing = (lattice.s[above] - lattice.s[below]) / (above - below)
    offset = 0.5 * (settings.workspace.P_x - settings.pattern.stance * spacing) * SIGNS[leg.row, 0]
    if settings.on_centre and lattice.on_tread[i]:
        offset = 0.0
    offset += tread_offset(lattice, i, spacing, settings)
    low, high = _level_stretch(lane, float(lattice.s[i]))
    margin = foot_radius + EDGE_CLEARANCE
    at, rise = lane.risers()
    rises = bool(np.any(rise[np.isclose(at, high)] > 0.0))
    low, high = low + margin, high - margin
    if low > high:
        raise PlanningError(
            f"the tread at {lattice.s[i]:.2f} m is {high - low + 2 * margin:.3f} m deep, "
            f"too narrow for a foot of {2 * foot_radius:.3f} m",
            place=float(lattice.s[i]),
        )
    if rises:  # as far as the tread is deep enough
        high = max(high - settings.riser_setback, low)
    return float(np.clip(lattice.s[i] + offset, low, high))


def _level_stretch(lane: Lane, s: float) -> tuple[float, float]:
    """From riser to riser around `s` [m]; infinite where the lane ends first.

    A flight's last tread is flush with what follows: the stretch may be longer than the tread.
    """
    here = int(lane.interval(s))
    other = np.flatnonzero(lane.heights != lane.heights[here])
    before, after = other[other < here], other[other > here]
    return (
        float(lane.breaks[before[-1] + 1]) if len(before) else -np.inf,
        float(lane.breaks[after[0]]) if len(after) else np.inf,
    )
