"""Footsteps of a walk along a lane: a transition to the gait, and its cycles."""

from collections.abc import Sequence

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.body_reference import (
    BodyReference,
    body_lift,
    robot_stance,
    sideways_shift,
    tilting_ground,
    tread_offset,
)
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.foothold_grid import FootholdGrid, make_foothold_grid
from drake_quad.planning.foothold_pattern import TROT
from drake_quad.planning.gait_cycles import add_trot_cycles, add_wave_cycles
from drake_quad.planning.motion_plan import Segment, Stance
from drake_quad.planning.problem import EDGE_CLEARANCE, PlanSettings, Task
from drake_quad.planning.settled_places import flight_at, flight_places
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.planning.transition_footsteps import plan_transition_footsteps
from drake_quad.robot.legs import LEGS, SIGNS, Leg
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

EDGE_ROOM = 0.002  # [m] beyond what the map may be off, that feet keep from edges
SAME_PLACE = 0.03  # [m] from where a foot is to stand, within which it stays, on a flight


WAITS = 1.25  # places by which a foot may be back before a flight, where a foot is set down


def walk_start(lane: Lane, settings: PlanSettings, stance: Stance) -> float:
    """The place that the body of a walk starts from, along the lane [m].

    It is where the body is, on level ground. On a flight the body may stand ahead of its place: the
    place is the one whose footprints are nearest to those of the feet. A foot that stands before
    the flight may be up to a place farther back than its footprint: none stands close to a riser.

    Args:
        lane: The lane.
        settings: The gait's.
        stance: Where body and feet are.
    """
    body, feet = (np.asarray(lane.coordinates(p)[0]) for p in (stance.body[:2], stance.feet))
    pattern, deep = settings.pattern, settings.deep_tread
    flight = next((f for s in feet if (f := flight_at(lane, float(s), deep)) is not None), None)
    if flight is None:
        return float(body)
    places = flight_places(lane, flight, pattern.per_tread)
    gap = float(places[1] - places[0])
    before = places[0] - gap * np.arange(pattern.behind + 2, 0, -1)
    places = np.concatenate([before, places, places[-1] + gap * np.arange(1, pattern.beyond + 3)])
    first = np.array([pattern.first(leg) for leg in LEGS])
    starts = range(-int(first.min()), len(places) - int(first.max()))
    before_flight = feet < float(lane.breaks[flight.first])

    def off(k: int) -> float:
        """How far the feet are from the footprints of the place `k`, in all [m]."""
        back = places[k + first] - feet
        waits = before_flight & (back > 0.0) & (back <= WAITS * gap)
        return float(np.abs(back[~waits]).sum())

    return float(places[min(starts, key=off)])


def _as_they_stand(lane: Lane, feet: FloatArray, desired: FloatArray) -> FloatArray:
    """The places (4, 2) with those of feet that stand just there, but for a little, as they are.

    A map that was looked at again has its treads some millimetres elsewhere; nobody steps for that.
    """
    near = np.linalg.norm(feet[:, :2] - desired, axis=1) < SAME_PLACE
    same = lane.interval(lane.coordinates(feet)[0]) == lane.interval(lane.coordinates(desired)[0])
    return np.where((near & same)[:, None], feet[:, :2], desired)


# A walk begins where the body's program ended the task before, to its tolerance: without some slack
# ten microns make a walk of whole strides a cycle longer.
STRIDE_SLACK = 1e-4


def plan_walk_footsteps(
    robot: RobotModel, course: Course, settings: PlanSettings, task: Task, stance: Stance
) -> tuple[ContactPlan, BodyReference, tuple[Segment, ...]]:
    """Returns the steps, the body's nominal route and the segments of a walk.

    Raises:
        PlanningError: If the lane has no room for it.
    """
    lane = course.lanes[task.lane]
    pattern = settings.pattern
    n = pattern.treads
    start = walk_start(lane, settings, stance)
    lattice = make_foothold_grid(
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
    builder = StepBuilder.of_settings(lane, stance.feet, robot.foot_radius, settings)
    segments = []

    lateral = robot_stance(settings)[:, 1]

    def place(leg: Leg, k: int) -> FloatArray:
        return lane.point(
            foothold(lane, lattice, leg, k, settings, robot.foot_radius),
            lateral[leg.row],
        )

    if settings.via_centres:
        centres = lane.point(start + robot_stance(settings)[:, 0], robot_stance(settings)[:, 1])
        segments.append(plan_transition_footsteps(builder, centres, settings, body=stance.body,
                                       name="transition to the centres"))  # fmt: skip
    desired = np.stack([place(leg, pattern.first(leg)) for leg in LEGS])
    if lattice.starts_on_flight:
        desired = _as_they_stand(lane, builder.feet, desired)
    gait = "trot" if pattern.gait == TROT else "wave gait"
    segments.append(plan_transition_footsteps(builder, desired, settings, body=stance.body,
                                   name=f"transition to the {gait}",
                                   gait="wave"))  # fmt: skip
    moved = builder.time
    builder.wait(settings.shift_time)
    begin = builder.time

    def next_place(leg: Leg, cycle: int) -> FloatArray:
        return place(leg, pattern.first(leg) + n * (cycle + 1))

    add_cycles = add_trot_cycles if pattern.gait == TROT else add_wave_cycles
    halves = add_cycles(builder, settings, lattice.cycles, next_place)
    builder.time = halves[-1]
    stride = float(np.max(lattice.s[n:] - lattice.s[:-n]))
    segments.append(
        Segment(
            task.name,
            pattern.gait,
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

    times, s = _nominal(lattice, settings, moved, halves, builder.time)
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
    route = BodyReference(times, xy, yaw, ground, lane, start=stance.body[:4], joined=begin)
    return builder.finish(), route, tuple(s for s in segments if s is not None)


def _nominal(
    lattice: FootholdGrid,
    settings: PlanSettings,
    moved: float,
    halves: Sequence[float],
    end: float,
) -> tuple[FloatArray, FloatArray]:
    """Times [s] and the body's places along the lane [m] if margins did not matter.

    Over the lattice's places at an even pace, `body_ahead` places ahead of them but for the ends.

    Args:
        lattice: The places.
        settings: The gait's.
        moved: When the transition to the gait ends [s].
        halves: When each half of a cycle begins, and the last one ends [s].
        end: When the walk ends [s].
    """
    beats = np.arange(2 * lattice.cycles + 1)
    times = np.concatenate([[0.0], halves, [end]])
    at = 0.5 * settings.pattern.treads * beats
    ahead = np.full(len(beats), settings.body_ahead)
    level = [not lattice.starts_on_flight, not lattice.ends_on_flight]
    ahead[np.array([0, -1])[level]] = 0.0
    ahead += _recentred(settings)
    ends = [0.0 if level[0] else ahead[0], at[-1] + (0.0 if level[1] else ahead[-1])]
    places = lattice.behind + np.concatenate([ends[:1], at + ahead, ends[1:]])
    s = np.interp(places, np.arange(len(lattice.s)), lattice.s)
    shift = sideways_shift(lattice, s, settings)
    # On level ground walks begin and end at rest over their places, on a flight as on their way.
    shift[np.array([0, 1, -2, -1])[np.repeat(level, 2)]] = 0.0
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
    pattern = settings.pattern
    centred = settings.uniform_body or pattern.gait == TROT
    return pattern.ahead(settings.duty_factor) if centred else 0.0


def _waits(settings: PlanSettings) -> dict[str, float]:
    """What a report is to say of the waits at switches, if there are any [s]."""
    if settings.switch_wait == 0.0:
        return {}
    lasts = settings.cycle_time + 2.0 * settings.switch_wait
    return {"switch_wait": settings.switch_wait, "cycle_lasts": lasts}


def foothold(
    lane: Lane, lattice: FootholdGrid, leg: Leg, k: int, settings: PlanSettings, foot_radius: float
) -> float:
    """Where along the lane `leg` stands for place `k` of the lattice (0: under the body's start).

    The place itself on stairs; elsewhere the feet keep the gait's stance length P_x by an offset
    of ±(P_x - stance)/2, the stance of the pattern being 3/2 spacings in the two-tread gait. No
    footprint is nearer to a nosing or riser than the foot is wide, and than the map may be off.
    """
    i = int(np.clip(k + lattice.behind, 0, len(lattice.s) - 1))
    below, above = max(i - 1, 0), min(i + 1, len(lattice.s) - 1)
    spacing = (lattice.s[above] - lattice.s[below]) / (above - below)
    offset = 0.5 * (settings.workspace.P_x - settings.pattern.stance * spacing) * SIGNS[leg.row, 0]
    if settings.on_centre and lattice.on_tread[i]:
        offset = 0.0
    offset += tread_offset(lattice, i, spacing, settings)
    offset += _towards_middle(lane, float(lattice.s[i]), settings)
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
    # Of an edge that may be off feet keep clear all the same, as far as the tread is deep enough.
    unsure = settings.map_error_place + EDGE_ROOM - EDGE_CLEARANCE
    if unsure > 0.0:
        unsure = min(unsure, 0.5 * (high - low))
        low, high = low + unsure, high - unsure
    if rises:  # likewise
        high = max(high - settings.riser_setback, low)
    return float(np.clip(lattice.s[i] + offset, low, high))


def _towards_middle(lane: Lane, s: float, settings: PlanSettings) -> float:
    """How far ahead of a place at `s` feet stand, to be nearer to its tread's middle [m].

    The ground before a flight counts as a tread more, as far as the first one is deep.
    """
    if settings.places_together == 0.0:
        return 0.0
    for flight in lane.close_flights(settings.deep_tread):
        edges = lane.treads(flight)[:, :2]
        begin, end = edges[0]
        for low, high in [(2.0 * begin - end, begin), *edges.tolist()]:
            if low <= s < high:
                return settings.places_together * (0.5 * (low + high) - s)
    return 0.0


def _level_stretch(lane: Lane, s: float) -> tuple[float, float]:
    """From edge to edge around `s` [m]; infinite where the lane ends first.

    A flight's last tread is flush with what follows: the stretch may be longer than the tread.
    """
    here = int(lane.interval(s))
    before = lane.edges[lane.edges <= lane.breaks[here]]
    after = lane.edges[lane.edges >= lane.breaks[here + 1]]
    return (
        float(before[-1]) if len(before) else -np.inf,
        float(after[0]) if len(after) else np.inf,
    )
