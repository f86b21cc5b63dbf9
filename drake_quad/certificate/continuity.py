"""Whether a plan is one motion: continuous to the acceleration wherever two parts of it meet.

Inside of a task the body's path is a uniform cubic B-spline, which is C2, and a swing is made of
quintics that rest at lift-off, apex and touchdown: what can jump is the body where a task begins or
ends, and a foot that is told to be elsewhere than where it stands. Bodies do not roll in plans.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.failure import Failure
from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import LEGS

# What is the same but for rounding: places [m], [rad], their rates and accelerations [1/s, 1/s^2].
SAME = np.array([1e-9, 1e-8, 1e-6])
AXES = ("x", "y", "z", "pitch", "yaw")
_WHAT = ("", "'s rate", "'s acceleration")
_UNITS = (("m", "rad"), ("m/s", "rad/s"), ("m/s^2", "rad/s^2"))


@dataclass(frozen=True, eq=False)
class Joins:
    """The places where a plan's parts meet, and the greatest jumps there.

    Attributes:
        count: Joins of tasks, the mission's begin and end among them.
        body: Greatest jumps of x, y, z, pitch, yaw, of their rates and accelerations (3, 5).
        feet: Greatest jump of a foot [m], also at lift-offs and touchdowns.
        failure: The first jump; None if there is none.
    """

    count: int
    body: FloatArray
    feet: float
    failure: Failure | None


def check_joins(plans: Sequence[MotionPlan]) -> Joins:
    """Looks at every join of the plans of a mission's tasks, which begins and ends at rest."""
    greatest, most, failure, segment = np.zeros((3, 5)), 0.0, None, 0
    before: tuple[FloatArray, FloatArray] | None = None
    for k, plan in enumerate(plans):
        ends = np.array([0.0, plan.duration])
        body, feet = plan.body.samples(ends), plan.contacts.feet_at(ends)[0]
        still = np.vstack([body[0, :1], np.zeros((2, 5))])  # a robot that stands where it begins
        last, stood = (still, feet[0]) if before is None else before
        found = [(0.0, np.abs(body[0] - last), np.linalg.norm(feet[0] - stood, axis=1))]
        found += [(t, np.zeros((3, 5)), jumps) for t, jumps in _foot_jumps(plan)]
        if k == len(plans) - 1:
            rest = np.vstack([np.zeros((1, 5)), np.abs(body[1, 1:])])
            found.append((plan.duration, rest, np.zeros(4)))
        for t, jump, foot in found:
            greatest, most = np.maximum(greatest, jump), max(most, float(foot.max()))
            if failure is None and (np.any(jump > SAME[:, None]) or np.any(foot > SAME[0])):
                at = segment + plan.segment_index(t)
                failure = _failure(k, at, t, jump, foot)
        before, segment = (body[1], feet[1]), segment + len(plan.segments)
    return Joins(len(plans) + 1, greatest, most, failure)


def _foot_jumps(plan: MotionPlan) -> list[tuple[float, FloatArray]]:
    """By time [s], how far a foot is elsewhere as it lifts off or comes down (4,) [m].

    A swing that does not last from lift-off to touchdown does not rest at both, either.
    """
    feet, found = np.array(plan.contacts.feet), []
    for step in plan.contacts.steps:
        row, swing = step.leg.row, step.swing
        jump = np.zeros(4)
        jump[row] = np.linalg.norm(swing.p_start - feet[row])
        late = abs(step.touchdown - step.lift_off - swing.duration)
        if late > SAME[0]:
            jump[row] += np.linalg.norm(swing.p_end - swing.p_start)
        found.append((step.lift_off, jump))
        feet[row] = swing.p_end
    return found


def _failure(task: int, segment: int, t: float, jump: FloatArray, foot: FloatArray) -> Failure:
    over = jump / SAME[:, None]
    if over.max() > 1.0:
        order = int(np.flatnonzero(np.any(over > 1.0, axis=1))[0])
        axis = int(np.argmax(over[order]))
        value = float(jump[order, axis])
        reason = (
            f"the body's {AXES[axis]}{_WHAT[order]} jumps by {value:.4g} {_UNITS[order][axis > 2]}"
        )
        return Failure(task, segment, t, value, float(SAME[order]), reason)
    row = int(np.argmax(foot))
    value = float(foot[row])
    reason = f"foot {LEGS[row].short} jumps by {value:.4g} m"
    return Failure(task, segment, t, value, float(SAME[0]), reason)
