"""Plans one task from the present stance, with footprints kept off risers."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import inf

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.math.curves import BodySpline, knot_count
from drake_quad.planning.body_reference import BodyReference
from drake_quad.planning.contact_plan import ContactPlan, FootRoll, sample_times
from drake_quad.planning.foothold_pattern import TROT
from drake_quad.planning.motion_plan import MotionPlan, Segment, Stance, evaluate
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import EDGE_CLEARANCE, KNOT, PlanSettings, Task
from drake_quad.planning.spin_footsteps import plan_spin_footsteps
from drake_quad.planning.stance_margin import Footing, footing_of, refuse_stance
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.planning.zmp import ZMP_CHECK_PERIOD, ZmpSamples, sample_zmp
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Lane

KEPT = 0.004  # [m] that feet keep from risers as they roll; they are set down farther off
JUST = 1e-6  # [s] before a lift-off
ANEW = 3  # times at most that a walk is planned anew for feet that roll to a riser
RISING = 17  # moments of a swing's rise that are looked at
GOOD_GAP = 0.001  # [m] with which no plan is made anew
ROLLS = 0.6  # of its radius, that a foot mostly rolls forward in a stance


def initial_setback(foot_radius: float) -> float:
    """A first guess of `PlanSettings.riser_setback` [m]."""
    return max(ROLLS * foot_radius + KEPT - EDGE_CLEARANCE, 0.0)


def riser_gap(lane: Lane, contacts: ContactPlan, foot_radius: float) -> tuple[float, float]:
    """Smallest gap between a foot, as it rolls, and the riser ahead of it; the setback it needs.

    A foot is set down off the riser ahead, and rolls towards it as the body goes on. One that
    touches it scrapes up along it in its swing. A foot that swings still is where it rolled to at
    first, so it may touch the riser as it rises, too. Risers behind are not checked. A foot whose
    centre is beyond the riser, by more than its radius, would not be seen; so far none rolls.

    Args:
        lane: The lane that the robot walks along.
        contacts: The plan, with feet that roll.
        foot_radius: [m].

    Returns:
        The gap [m], negative where a foot would be inside a riser, infinite where there are none,
        of feet that stand and of those that rise; and the setback beyond EDGE_CLEARANCE with which
        all feet whose gap is less than GOOD_GAP, rolling as they do here, would have KEPT [m].
    """
    steps = contacts.steps
    before = [step.lift_off - JUST for step in steps]  # when they have rolled farthest
    rise = [step.lift_off + step.swing.apex_time * np.linspace(0.0, 1.0, RISING) for step in steps]
    times = np.unique(np.concatenate([sample_times(contacts), before, *rise]))
    feet, _ = contacts.feet_at(times)
    s, _ = lane.coordinates(feet)
    least, rolled = inf, 0.0
    for k, step in enumerate(steps):
        following = next((t for t in steps[k + 1 :] if t.leg is step.leg), None)
        end = inf if following is None else following.lift_off
        row, stands = step.leg.row, (times >= step.touchdown) & (times < end)
        gap = gap_to_riser(lane, s[stands, row], foot_radius)
        if following is not None and len(gap):
            rises = (times >= end) & (times <= end + following.swing.apex_time)
            rising = gap_as_it_rises(lane, s[rises, row], feet[rises, row, 2], foot_radius)
            gap = np.concatenate([gap, rising])
        if len(gap) and gap.min() < GOOD_GAP:
            rolled = max(rolled, float(gap[0] - gap.min()))
        least = min(least, float(gap.min(initial=inf)))
    return least, max(rolled + KEPT - EDGE_CLEARANCE, 0.0)


def gap_to_riser(lane: Lane, s: FloatArray, foot_radius: float) -> FloatArray:
    """From feet at `s` (n,) along a lane to the riser ahead of each that leads up (n,) [m]."""
    at, rise = lane.risers()
    gap = np.full(len(s), inf)
    ahead = at[rise > 0.0]
    k = np.searchsorted(ahead, s)
    has = k < len(ahead)
    gap[has] = ahead[k[has]] - s[has] - foot_radius
    return gap


def gap_as_it_rises(lane: Lane, s: FloatArray, z: FloatArray, foot_radius: float) -> FloatArray:
    """From a foot that rises to the riser that was ahead of it at first, if that leads up (n,) [m].

    Args:
        lane: The lane.
        s: Where the foot's centre is along it, one after the other (n,) [m].
        z: Its heights (n,) [m].
        foot_radius: [m].
    """
    at, rise = lane.risers()
    ahead = at[rise > 0.0]
    k = int(np.searchsorted(ahead, s[0])) if len(s) else len(ahead)
    if k == len(ahead):
        return np.full(len(s), inf)
    above = np.maximum(z - float(lane.height(ahead[k])), 0.0)
    beside = ahead[k] - s
    # Above the nosing it is the corner that is nearest, and nothing once the foot is beyond it.
    far = np.where(above > 0.0, np.hypot(np.maximum(beside, 0.0), above), beside)
    return np.asarray(far - foot_radius)


MARGIN_ENOUGH = 0.06  # [m] below which another way is tried
BLEED = 1.0  # [s] after a transition, in which the body's path still is as the transition left it
Laid = tuple[ContactPlan, BodyReference, tuple[Segment, ...]]


def plan_task(
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    task: Task,
    stance: Stance,
    *,
    index: int,
    warm_start: MotionPlan | None = None,
) -> MotionPlan:
    """Plans `task` from `stance` on.

    Args:
        robot: The robot.
        course: The ground.
        settings: Gait and body parameters.
        task: What to do.
        stance: Where body and feet are, at rest.
        index: The task's place in the mission.
        warm_start: A plan of the same task with other times, whose path is begun with; see
            `plan_body`.

    Raises:
        PlanningError: If there is no plan, with the reason.
    """
    footing = footing_of(robot, course, settings)
    if task.kind == "stand":
        ends = np.array([0.0, task.duration])
        still = FootRoll(ends, np.stack([stance.roll, stance.roll]))
        contacts = ContactPlan(stance.feet, (), task.duration, still)
        control = np.tile(stance.body, (knot_count(task.duration, KNOT), 1))
        segment = Segment(task.name, "stand", 0.0, task.duration)
        spline = BodySpline(KNOT, control)
        plan = MotionPlan(
            index, contacts, spline, (segment,), float("nan"), margin_kind=settings.margin
        )
        if footing is not None:
            _check(footing, plan)
        return plan
    lay = partial(_lay, robot, course, task=task, stance=stance)
    finish = partial(_plan_gait, robot, stance=stance, index=index, footing=footing)
    if task.kind == "walk" and not settings.uniform_body:
        lane = course.lanes[task.lane]
        settings, laid, plan = _off_risers(
            lane, robot.foot_radius, settings, lay, finish, warm_start
        )
    else:
        laid = lay(settings)
        plan = finish(settings, laid, warm_start=warm_start)
    if plan.margin < MARGIN_ENOUGH and not (settings.via_centres or settings.uniform_body):
        # The fewest steps leave little margin: the paper's way, through the centres, takes more
        # steps and may leave more.
        by_centres = replace(settings, via_centres=True)
        other = lay(by_centres)
        if not _same_steps(laid[0], other[0]) and _held_up_first(robot, plan, settings):
            # No plan there, or none that can be better, leaves the one that there is.
            with suppress(PlanningError):
                again = finish(by_centres, other, beat=plan.margin)
                plan = max(plan, again, key=lambda p: p.margin)
    if footing is not None and not settings.uniform_body and plan.margin <= 0.0:
        _check(footing, plan)
    return plan


def _lay(
    robot: RobotModel, course: Course, settings: PlanSettings, *, task: Task, stance: Stance
) -> Laid:
    lay = plan_walk_footsteps if task.kind == "walk" else plan_spin_footsteps
    return lay(robot, course, settings, task, stance)


def _off_risers(
    lane: Lane,
    foot_radius: float,
    settings: PlanSettings,
    lay: Callable[[PlanSettings], Laid],
    finish: Callable[..., MotionPlan],
    warm_start: MotionPlan | None,
) -> tuple[PlanSettings, Laid, MotionPlan]:
    """A walk whose feet keep off risers as they roll; its own path determines how far.

    Made anew, from other footprints, if they roll farther than feet mostly do: from there they may
    roll farther still. Where there is no plan from these, one from others will do.

    Raises:
        PlanningError: If there is none at all.
    """

    def make(
        setback: float, warm_start: MotionPlan | None
    ) -> tuple[PlanSettings, Laid, MotionPlan]:
        set_back = replace(settings, riser_setback=setback)
        laid = lay(set_back)
        return set_back, laid, finish(set_back, laid, warm_start=warm_start)

    least = settings.riser_setback
    setback = max(least, initial_setback(foot_radius))
    try:
        first = make(setback, warm_start)
    except PlanningError:
        if setback == least:
            raise
        return make(least, warm_start)
    best, (most, needed) = first, riser_gap(lane, first[2].contacts, foot_radius)
    for _ in range(ANEW):
        if most >= GOOD_GAP or needed <= setback:
            break
        setback = needed
        try:
            again = make(setback, best[2])
        except PlanningError:
            break
        gap, needed = riser_gap(lane, again[2].contacts, foot_radius)
        if gap <= most:
            break
        best, most = again, gap
    return best


def _same_steps(a: ContactPlan, b: ContactPlan) -> bool:
    """Whether two plans step alike, as they do where the robot is at the centres anyway."""
    if len(a.steps) != len(b.steps):
        return False
    return all(
        s.leg is t.leg and s.lift_off == t.lift_off and np.array_equal(s.swing.p_end, t.swing.p_end)
        for s, t in zip(a.steps, b.steps, strict=True)
    )


def _held_up_first(robot: RobotModel, plan: MotionPlan, settings: PlanSettings) -> bool:
    """Whether a plan's least margin is of the transition that it begins with.

    If it is later, of the gait, no other transition to that gait leaves more. Where the margin is
    another than the static one over the feet's hull it is not looked at, and may be.
    """
    if settings.dynamic or plan.margin_kind != HULL:
        return True
    samples = evaluate(robot, plan, sample_times(plan.contacts))
    least = float(samples.times[np.argmin(samples.margin)])
    begun = max((s.end for s in plan.segments if s.kind == "transition"), default=0.0)
    return least < begun + BLEED


def _plan_gait(
    robot: RobotModel,
    settings: PlanSettings,
    laid: Laid,
    *,
    stance: Stance,
    index: int,
    footing: Footing | None,
    beat: float | None = None,
    warm_start: MotionPlan | None = None,
) -> MotionPlan:
    contacts, route, segments = laid
    body, contacts, margin = plan_body(
        robot, contacts, route, settings, footing, stance.roll, beat=beat, warm_start=warm_start
    )
    if settings.dynamic:
        segments = _with_zmp(segments, sample_zmp(robot, contacts, body, ZMP_CHECK_PERIOD))
    joined = route.joined if route.starts_off(settings) else 0.0
    return MotionPlan(
        index, contacts, body, segments, margin, margin_kind=settings.margin, joined=joined
    )


def _check(footing: Footing, plan: MotionPlan) -> None:
    """The margin of the region of balance is positive.

    Raises:
        PlanningError: With where it is not.
    """
    times = sample_times(plan.contacts)
    feet, standing = plan.contacts.feet_at(times)
    margins = footing.stances(plan.body.samples(times)[:, 0], feet, standing).margins()
    k = int(np.argmin(margins))
    if margins[k] <= 0.0:
        t = float(times[k])
        where = f"in '{plan.segment_name(t)}', {t:.1f} s into its task"
        raise refuse_stance(footing, float(margins[k]), standing[k], where)


def _with_zmp(segments: tuple[Segment, ...], zmp: ZmpSamples) -> tuple[Segment, ...]:
    """The segments, each with the smallest margin of its zero-moment point [m] in its details.

    Where two feet stand at times, its largest distance from their line is there, too.
    """
    found = []
    for segment in segments:
        mine = (zmp.times >= segment.start - 1e-9) & (zmp.times <= segment.end + 1e-9)
        margin = float(zmp.margin[mine].min()) if np.any(mine) else None
        details = {**segment.details, "zmp_margin_min": margin}
        if segment.kind == TROT:
            details["zmp_line_distance_max"] = float(zmp.off_line[mine].max(initial=0.0))
        found.append(replace(segment, details=details))
    return tuple(found)
