"""Plans the rest of a task anew from the feet as they stand.

After a push, or where the ground was not as mapped, the feet are not where the plan has them. The
fewest stable steps put them there, as they would stand after the step that was under way; then
the plan's own remaining steps follow, in their own rhythm.
"""

from dataclasses import replace
from math import isnan
from typing import Any, NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.gait.transition import enumerate_transitions
from drake_quad.planning.contact_plan import Step, sample_times
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance, evaluate
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.remaining_plan import (
    RECOVERY,
    RemainingPlan,
    find_lane,
    join_pose,
    remaining_plan,
    remaining_route,
    remaining_segments,
)
from drake_quad.planning.stance_margin import footing_of
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.planning.transition_footsteps import plan_transition_footsteps, take_step
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

ROUNDING = 1e-9  # [m]
LEAST_JOIN = 1.0  # [s] on four feet before the plan goes on: the body's path starts from rest
BACK_OFF = (0.04, 0.08, 0.12, 0.16)  # [m] from a riser that a foot stands too close to


def in_place(
    lane: Lane, feet: FloatArray, goal: FloatArray, *, tolerance: float, foot_radius: float
) -> BoolArray:
    """Which feet may stay: near their places, on the same level (or slope), whole on it, (4,)."""
    near = np.linalg.norm((feet - goal)[:, :2], axis=1) <= tolerance
    at = lane.coordinates(goal)[0]
    around = lane.coordinates(feet)[0] + foot_radius * np.array([[-1.0], [0.0], [1.0]])
    planned = lane.height(at) + lane.gradient(at) * (around - at)
    level = np.abs(lane.height(around) - planned) < ROUNDING  # nan: no
    return np.asarray(near & np.all(level, axis=0))


def plan_recovery_footsteps(
    builder: StepBuilder,
    remaining: RemainingPlan,
    stance: Stance,
    settings: PlanSettings,
    *,
    foot_radius: float,
    tolerance: float,
    in_turn: bool,
) -> Segment:
    """Adds the steps from the stance to the feet that the plan has, and the wait behind them.

    Args:
        builder: Collects the steps; its feet are the stance's.
        remaining: What the plan has left.
        stance: Where body and feet are.
        settings: Mode, times and limits of transitions.
        foot_radius: [m].
        tolerance: A foot this near to its place stays [m].
        in_turn: Each foot straight to its place in the order that looks best, stable or not as
            the search sees it (the body's path may still find a way); else the fewest stable.

    Raises:
        PlanningError: If there is no such transition, or a leg does not clear the ground.
    """
    lane, feet = builder.lane, builder.feet
    stays = in_place(lane, feet, remaining.feet, tolerance=tolerance, foot_radius=foot_radius)
    goal = np.where(stays[:, None], feet, remaining.feet)[:, :2]
    steps: list[dict[str, Any]] = []
    for places in (_backed_off(builder, goal), goal):
        if in_turn:
            steps += _lay_in_turn(builder, places, stance, settings)
            continue
        part = plan_transition_footsteps(builder, places, settings, body=stance.body, name=RECOVERY)
        steps += part.details["steps"] if part is not None else []
    builder.wait(max(settings.shift_time, LEAST_JOIN))
    return Segment(RECOVERY, "transition", 0.0, builder.time, {"steps": steps})


def plan_remaining_footsteps(
    builder: StepBuilder, remaining: RemainingPlan, *, join: float, duration: float
) -> None:
    """Adds the remaining steps from time `join` on, in their old rhythm.

    A swing that begins where it was to begin is the old one; any other is planned anew.
    """
    for step in remaining.steps:
        at = join + step.lift_off - remaining.time
        row, swing = step.leg.row, step.swing
        if np.array_equal(builder.feet[row], swing.p_start):
            builder.steps.append(Step(step.leg, at, at + swing.duration, swing))
            builder.feet[row] = swing.p_end
        else:
            builder.step(step.leg, swing.p_end[:2], swing.duration, lift_off=at, pivot=swing.pivot)
    builder.time = duration


def _backed_off(builder: StepBuilder, goal: FloatArray) -> FloatArray:
    """The feet's places (4, 2), but for feet too close to a riser for their swing: off it."""
    places = np.array(builder.feet[:, :2])
    for leg in LEGS:
        here = builder.feet[leg.row]
        if np.linalg.norm(goal[leg.row] - here[:2]) < 1e-6 or _clears(builder, here, goal[leg.row]):
            continue
        s, lateral = builder.lane.coordinates(here[:2])
        for back in BACK_OFF:
            ways = [builder.lane.point(s + way * back, lateral) for way in (-1.0, 1.0)]
            ways = [
                w
                for w in ways
                if _clears(builder, here, w)
                and _clears(builder, np.array([*w, builder.ground(w)]), goal[leg.row])
            ]
            if ways:
                places[leg.row] = ways[0]
                break
    return places


def _clears(builder: StepBuilder, p_from: FloatArray, to: FloatArray) -> bool:
    """Whether a swing from `p_from` (3,) to `to` (2,) clears the ground."""
    try:
        builder.swing(p_from, to, 1.0)
    except PlanningError:
        return False
    return True


def _lay_in_turn(
    builder: StepBuilder, goal: FloatArray, stance: Stance, settings: PlanSettings
) -> list[dict[str, Any]]:
    """Moves each foot straight to its place, in the order with the best margins."""
    c, s = np.cos(stance.body[4]), np.sin(stance.body[4])
    R_WB = np.array([[c, -s], [s, c]])
    start, end = ((p - stance.body[:2]) @ R_WB for p in (builder.feet[:, :2], goal))
    count = int(np.sum(np.any(start != end, axis=1)))
    if not count:
        return []
    best = enumerate_transitions(
        start, end, steps=count, mode="shift", max_shift=settings.max_shift
    )[0]
    return [take_step(builder, s, goal[s.leg.row], settings) for s in best.steps]


TOLERANCE = 0.03  # [m] from its place, within which a foot stays where it stands
MARGIN_ENOUGH = 0.04  # [m] below which another way is tried, unless the plan itself had less
MARGIN_GOOD = 0.02  # [m] with which another way will do
WIDER = 1.5  # times the boxes and the shift that the gait keeps to; the legs' reach is checked
MODEST = 0.05  # [m] of static margin, where the gait's own would stretch a leg too far
SLOWER = 1.5  # times the transition's time on four feet


class _Way(NamedTuple):
    """One way back.

    Attributes:
        factor: Factor on the boxes and the shift.
        margin: Margin beyond which more is worth nothing [m], lest the path stretch legs for it.
        tolerance: A foot this near to its place stays [m].
        in_turn: Each foot in turn straight to its place, or the fewest stable steps.
        pace: Factor on the time on four feet.
    """

    factor: float = 1.0
    margin: float = np.inf
    tolerance: float = TOLERANCE
    in_turn: bool = False
    pace: float = 1.0


_WAYS = (
    _Way(),
    _Way(factor=WIDER, margin=MODEST),
    _Way(margin=MODEST),
    _Way(factor=WIDER, margin=MODEST, in_turn=True),
    _Way(factor=WIDER, margin=MODEST, tolerance=0.0, pace=SLOWER),
    _Way(factor=WIDER, margin=MODEST, tolerance=0.0, in_turn=True, pace=SLOWER),
)


def replan_task(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    plan: MotionPlan,
    t: float,
    stance: Stance,
) -> MotionPlan:
    """Plans the rest of a task from the stance that the robot is really in.

    Args:
        robot: The robot.
        course: The ground.
        settings: Those that `plan` was made with.
        plan: The plan that was followed, itself perhaps the result of this function.
        t: The gait time that it was followed to [s].
        stance: The body's pose as desired, and the feet as they stand: four on the
            ground and at rest, on whatever floor or tread.

    Returns:
        A plan of the same task from `stance` at its time 0 to the same goal: the segment
        `recovery`, then what was left of the others.

    Raises:
        PlanningError: If no way back is stable, with the reason.
    """
    enough = MARGIN_ENOUGH if isnan(plan.margin) else min(MARGIN_ENOUGH, plan.margin - 0.02)
    if plan.margin > 0.0:  # plans without a margin of their own, crossings, may have none here
        enough = max(enough, 0.0)
    best: tuple[float, MotionPlan] | None = None
    reason: PlanningError | None = None
    for way in _WAYS:
        try:
            found = _resume(robot, course, _widened(settings, way), plan, t, stance, way)
        except PlanningError as problem:
            reason = reason or problem
            continue
        best = max(best or found, found, key=lambda f: f[0])
        if best[0] >= (enough if way is _WAYS[0] else min(enough, MARGIN_GOOD)):
            break
    if best is None:
        assert reason is not None
        raise reason
    if best[0] <= min(0.0, enough) and not settings.uniform_body:
        raise PlanningError(
            f"the best way back to the plan has a static margin of {best[0]:.3f} m",
            margin=best[0],
            feet=stance.feet.tolist(),
        )
    return best[1]


def _widened(settings: PlanSettings, way: _Way) -> PlanSettings:
    """The settings with wider boxes, a larger shift of the body, and more time on four feet."""
    box = settings.workspace
    return replace(
        settings,
        workspace=replace(box, R_x=way.factor * box.R_x, R_y=way.factor * box.R_y),
        max_shift=way.factor * settings.max_shift,
        margin_desired=min(way.margin, settings.margin_desired),
        shift_time=way.pace * settings.shift_time,
    )


def _resume(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    plan: MotionPlan,
    t: float,
    stance: Stance,
    way: _Way,
) -> tuple[float, MotionPlan]:
    """One way back: its margin [m], less what is out of a leg's reach and limits, and the plan."""
    lane = find_lane(course, plan, robot.foot_radius)
    remaining = remaining_plan(plan, t)
    builder = StepBuilder.of_settings(lane, stance.feet, robot.foot_radius, settings)
    recovery = plan_recovery_footsteps(
        builder,
        remaining,
        stance,
        settings,
        foot_radius=robot.foot_radius,
        tolerance=way.tolerance,
        in_turn=way.in_turn,
    )
    join = recovery.end
    duration = join + plan.duration - remaining.time
    plan_remaining_footsteps(builder, remaining, join=join, duration=duration)
    contacts = builder.finish()
    route = remaining_route(plan, remaining, lane, stance, settings, join=join, duration=duration)
    footing = footing_of(robot, course, settings)
    body, contacts, believed = plan_body(robot, contacts, route, settings, footing)
    body = join_pose(body, stance, duration=duration, join=join)
    segments = remaining_segments(plan, remaining, recovery)
    resumed = MotionPlan(
        plan.index, contacts, body, segments, np.nan, plan.revision + 1, settings.margin
    )
    samples = evaluate(robot, resumed, sample_times(contacts))
    margins = samples.margin
    if footing is not None:
        margins = footing.stances(samples.body[:, 0], samples.feet, samples.standing).margins()
    margin = believed if settings.dynamic else float(margins.min())
    q = samples.q.reshape(-1, 12)
    over = np.maximum(robot.q_lower - q, q - robot.q_upper)
    excess = max(float(samples.reach_excess.max()), float(over.max()), 0.0)
    return margin - excess, replace(resumed, margin=margin)


NEGLIGIBLE = 0.005  # [m]: what feet sink in, and maps are off by


def project_to_map(course: Course, feet: FloatArray, foot_radius: float) -> FloatArray:
    """The feet (4, 3) in W, all as much higher or lower as puts them on the map's ground [m].

    By the median of the feet, for one may stand beyond an edge that is not where the map has it. A
    plan from there is the map's, and the controller adds by how much the ground was found higher or
    lower, as it does all along. A plan from the feet's own heights would step to the map's.

    Args:
        course: The map.
        feet: The feet's sphere centres where they stand (4, 3) in W [m].
        foot_radius: [m].
    """
    error = feet[:, 2] - foot_radius - course.height(feet[:, 0], feet[:, 1])
    known = error[np.isfinite(error)]
    higher = float(np.median(known)) if len(known) else 0.0
    if abs(higher) < NEGLIGIBLE:
        return feet
    return read_only(feet - [0.0, 0.0, higher])
