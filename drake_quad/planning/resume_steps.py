"""Lays the steps with which a robot gets back to a plan from the feet as they really stand."""

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import LEGS, BoolArray, FloatArray
from drake_quad.gait.transition import enumerate_transitions
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.motion_plan import Segment, Stance
from drake_quad.planning.plan_transition import lay_transition
from drake_quad.planning.resume_rest import RECOVERY, Rest
from drake_quad.planning.settings import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.terrain import Lane

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


def lay_recovery(
    builder: StepBuilder,
    rest: Rest,
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
        rest: What the plan has left.
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
    stays = in_place(lane, feet, rest.feet, tolerance=tolerance, foot_radius=foot_radius)
    goal = np.where(stays[:, None], feet, rest.feet)[:, :2]
    steps: list[dict[str, object]] = []
    for places in (_backed_off(builder, goal), goal):
        if in_turn:
            steps += _lay_in_turn(builder, places, stance, settings)
            continue
        part = lay_transition(builder, places, settings, body=stance.body, name=RECOVERY)
        steps += part.details["steps"] if part is not None else []
    builder.wait(max(settings.shift_time, LEAST_JOIN))
    return Segment(RECOVERY, "transition", 0.0, builder.time, {"steps": steps})


def lay_rest(builder: StepBuilder, rest: Rest, *, join: float, duration: float) -> None:
    """Adds the remaining steps from time `join` on, in their old rhythm.

    A swing that begins where it was to begin is the old one; any other is planned anew.
    """
    for step in rest.steps:
        at = join + step.lift_off - rest.time
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
) -> list[dict[str, object]]:
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
    steps: list[dict[str, object]] = []
    for step in best.steps:
        builder.wait(settings.shift_time)
        p_from, lift_off = builder.feet[step.leg.row, :2].tolist(), builder.time
        to = goal[step.leg.row]
        builder.step(step.leg, to, settings.swing_time, lift_off=lift_off)
        steps.append({"leg": int(step.leg), "margin": float(step.margin), "start": lift_off,
                      "end": builder.time, "from": p_from, "to": to.tolist()})  # fmt: skip
    return steps
