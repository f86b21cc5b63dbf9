"""What is left of a plan at a gait time: feet, steps, segments, and the body's remaining route."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.math.curves import BodySpline, greville, join_weights
from drake_quad.planning.body_reference import BodyReference, GroundProfile
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance
from drake_quad.planning.problem import PlanSettings
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

RECOVERY = "recovery"
ROUTE_PERIOD = 0.1  # [s] between the points of the remaining route
BEYOND = 0.3  # [m] for which the ground's slope goes on past what the plan's body passes
JUST_LIFTED = 1e-6  # [s] after a lift-off, within which the foot still stands
ON_GROUND = 0.02  # [m] of height within which a footprint counts as on a lane's ground


@dataclass(frozen=True, eq=False)
class RemainingPlan:
    """What a plan has left.

    Attributes:
        time: When it begins, in the plan [s]: the touchdown of steps under way, or at once.
        feet: Where the feet are to stand then, (4, 3) in W [m].
        steps: The steps from then on.
    """

    time: float
    feet: FloatArray
    steps: tuple[Step, ...]


def remaining_plan(plan: MotionPlan, t: float) -> RemainingPlan:
    """What `plan` has left at gait time `t` [s]; the steps under way count as done.

    A step that the clock stands at the very lift-off of is not under way.
    """
    phase = plan.contacts.phase(t)
    feet = np.array(phase.feet)
    time = float(np.clip(t, 0.0, plan.duration))
    if phase.steps and t > phase.start + JUST_LIFTED:
        for step in phase.steps:
            feet[step.leg.row] = step.swing.p_end
        time = phase.end
    if time > plan.duration - 1e-9:
        return RemainingPlan(plan.duration, plan.contacts.final_feet, ())
    steps = tuple(s for s in plan.contacts.steps if s.lift_off >= time - JUST_LIFTED)
    return RemainingPlan(time, read_only(feet), steps)


def find_lane(course: Course, plan: MotionPlan, foot_radius: float) -> Lane:
    """The lane of the course that a plan's footprints are on: of two, the one headed alike."""
    feet = np.stack([*plan.contacts.feet, *(s.swing.p_end for s in plan.contacts.steps)])
    yaw = float(plan.end.body[4])

    def fits(lane: Lane) -> tuple[int, float]:
        s, lateral = lane.coordinates(feet)
        wide = np.abs(lateral) <= lane.half_widths[lane.interval(s)]
        level = np.abs(lane.height(s) + foot_radius - feet[:, 2]) <= ON_GROUND  # nan: no
        return int(np.sum(wide & level)), float(np.round(np.cos(yaw - lane.yaw), 6))

    return max(course.lanes, key=fits)


def remaining_segments(
    plan: MotionPlan, remaining: RemainingPlan, recovery: Segment
) -> tuple[Segment, ...]:
    """The recovery and the plan's remaining segments after it, in the new plan's time.

    What is left of an earlier recovery becomes part of this one.
    """
    delay = recovery.end - remaining.time
    left = []
    for segment in plan.segments:
        if segment.end <= remaining.time + 1e-9:
            continue
        details: dict[str, Any] = dict(segment.details)
        if "steps" in details:
            details["steps"] = [
                {**step, "start": step["start"] + delay, "end": step["end"] + delay}
                for step in details["steps"]
                if step["start"] >= remaining.time - JUST_LIFTED
            ]
        start = max(segment.start, remaining.time) + delay
        left.append(Segment(segment.name, segment.kind, start, segment.end + delay, details))
    if left and left[0].name == RECOVERY:
        steps = recovery.details["steps"] + left[0].details["steps"]
        recovery = Segment(RECOVERY, recovery.kind, 0.0, left[0].end, {"steps": steps})
        left = left[1:]
    return (recovery, *left)


def remaining_route(
    plan: MotionPlan,
    remaining: RemainingPlan,
    lane: Lane,
    stance: Stance,
    settings: PlanSettings,
    *,
    join: float,
    duration: float,
) -> BodyReference:
    """From the stance's body to where the plan has it, and on as the plan's body goes.

    Args:
        plan: The plan that is left.
        remaining: What it has left.
        lane: The lane that it is on.
        stance: Where the body is now.
        settings: Settings that the body's height is read from.
        join: When the new plan joins the old one [s].
        duration: When the new plan ends [s].
    """
    count = max(int(np.ceil((plan.duration - remaining.time) / ROUTE_PERIOD)), 1) + 1
    at = np.linspace(remaining.time, plan.duration, count)
    body = plan.body.samples(at)[:, 0]
    turns = 2 * np.pi * np.round((stance.body[4] - body[0, 4]) / (2 * np.pi))
    times = np.concatenate([[0.0], join + at - remaining.time, [max(duration, join + 1e-3)]])
    xy = np.concatenate([stance.body[None, :2], body[:, :2], body[-1:, :2]])
    yaw = np.concatenate([stance.body[4:], body[:, 4] + turns, body[-1:, 4] + turns])
    return BodyReference(times, xy, yaw, _ground_of(plan, lane, settings), lane)


def join_pose(spline: BodySpline, stance: Stance, *, duration: float, join: float) -> BodySpline:
    """The spline, but with height and pitch that begin as the stance has them.

    Args:
        spline: Its height and pitch follow the ground from the first.
        stance: Where the body is at first.
        duration: Duration of the path [s].
        join: Time from which on height and pitch are the path's own [s].
    """
    control = np.array(spline.control)
    knot = spline.knot
    fade = join_weights(duration, knot, join)
    control[:, 2:4] += fade[:, None] * (stance.body[2:4] - control[0, 2:4])
    return BodySpline(knot, control)


def _ground_of(plan: MotionPlan, lane: Lane, settings: PlanSettings) -> GroundProfile:
    """The mean ground under the body, read off the plan's own body, along the lane.

    The body's height is a function of the place along the lane, but for a recovery's, and until a
    plan has joined the ground's height.
    """
    times = greville(plan.duration, plan.body.knot)
    clean = plan.segments[0].end if plan.segments[0].name == RECOVERY else plan.joined
    control = plan.body.control[times >= min(clean, plan.duration) - 1e-9]
    s_all = lane.coordinates(control[:, :2])[0]
    order = np.unique(np.round(s_all, 2), return_index=True)[1]
    s, z = s_all[order], control[order, 2] - settings.body_height
    slope = -np.tan(control[order, 3])
    low, high = min(s[0] + 0.1, s[-1]), max(s[-1] - 0.1, s[0])
    rise = (np.interp(low, s, z) - z[0]) / max(low - s[0], 0.1)
    fall = (z[-1] - np.interp(high, s, z)) / max(s[-1] - high, 0.1)
    s = np.concatenate([[s[0] - BEYOND], s, [s[-1] + BEYOND]])
    z = np.concatenate([[z[0] - BEYOND * rise], z, [z[-1] + BEYOND * fall]])
    slope = np.concatenate([slope[:1], slope, slope[-1:]])

    def ground(p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        at = lane.coordinates(p_W)[0]
        return np.interp(at, s, z), np.interp(at, s, slope)

    return ground
