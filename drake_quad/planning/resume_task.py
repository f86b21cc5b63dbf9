"""Plans the rest of a task anew, from the feet as they really stand.

After a push, or where the ground was not as mapped, the feet are not where the plan has them. The
fewest stable steps put them there, as they would stand after the step that was under way; then
the plan's own remaining steps follow, in their own rhythm.
"""

from dataclasses import replace
from math import isnan
from typing import NamedTuple

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.planning.body_path import plan_body
from drake_quad.planning.contact_plan import sample_times
from drake_quad.planning.footing import footing_of
from drake_quad.planning.motion_plan import MotionPlan, Stance, evaluate
from drake_quad.planning.resume_rest import (
    find_lane,
    join_pose,
    rest_of,
    rest_route,
    rest_segments,
)
from drake_quad.planning.resume_steps import lay_recovery, lay_rest
from drake_quad.planning.settings import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Course

TOLERANCE = 0.03  # [m] from its place, within which a foot stays where it stands
MARGIN_ENOUGH = 0.04  # [m] below which another way is tried, unless the plan itself had less
MARGIN_GOOD = 0.02  # [m] with which another way will do
WIDER = 1.5  # times the boxes and the shift that the gait keeps to; the legs' reach is checked
MODEST = 0.05  # [m] of static margin, where the gait's own would stretch a leg too far
SLOWER = 1.5  # times the transition's time on four feet


class _Way(NamedTuple):
    """One way back.

    Attributes:
        room: Times the boxes and the shift.
        margin: The body's path asks for no more margin than this [m], lest it stretch legs for it.
        tolerance: A foot this near to its place stays [m].
        in_turn: Each foot in turn straight to its place, or the fewest stable steps.
        pace: Times the time on four feet.
    """

    room: float = 1.0
    margin: float = np.inf
    tolerance: float = TOLERANCE
    in_turn: bool = False
    pace: float = 1.0


_WAYS = (
    _Way(),
    _Way(room=WIDER, margin=MODEST),
    _Way(margin=MODEST),
    _Way(room=WIDER, margin=MODEST, in_turn=True),
    _Way(room=WIDER, margin=MODEST, tolerance=0.0, pace=SLOWER),
    _Way(room=WIDER, margin=MODEST, tolerance=0.0, in_turn=True, pace=SLOWER),
)


def resume_task(
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
        stance: The body's pose, where it is told to be, and the feet as they stand: four on the
            ground and at rest, on whatever floor or tread.

    Returns:
        A plan of the same task from `stance` at its time 0 to the same goal: the segment
        `recovery`, then what was left of the others.

    Raises:
        PlanningError: If no way back is stable, with the reason.
    """
    enough = MARGIN_ENOUGH if isnan(plan.margin) else min(MARGIN_ENOUGH, plan.margin - 0.02)
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
    """The settings with more room for the legs and the body, and more time on four feet."""
    box = settings.workspace
    return replace(
        settings,
        workspace=replace(box, R_x=way.room * box.R_x, R_y=way.room * box.R_y),
        max_shift=way.room * settings.max_shift,
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
    rest = rest_of(plan, t)
    builder = StepBuilder(
        lane,
        stance.feet,
        foot_radius=robot.foot_radius,
        clearance=settings.swing_clearance,
        map_error_place=settings.map_error_place,
        map_error_height=settings.map_error_height,
    )
    recovery = lay_recovery(builder, rest, stance, settings, foot_radius=robot.foot_radius,
                            tolerance=way.tolerance, in_turn=way.in_turn)  # fmt: skip
    join = recovery.end
    duration = join + plan.duration - rest.time
    lay_rest(builder, rest, join=join, duration=duration)
    contacts = builder.finish()
    route = rest_route(plan, rest, lane, stance, settings, join=join, duration=duration)
    footing = footing_of(robot, course, settings)
    body, contacts, believed = plan_body(robot, contacts, route, settings, footing)
    body = join_pose(body, stance, duration=duration, join=join)
    segments = rest_segments(plan, rest, recovery)
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
