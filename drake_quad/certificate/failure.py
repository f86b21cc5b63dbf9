"""The earliest time at which a plan is not what it has to be: a bound is too low, or it jumps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.bounds import (
    FOOT,
    GROUND,
    JOINTS,
    MARGIN,
    REACH,
    ROUNDING,
    SHANK,
    SHARES,
    TORQUE,
    Bounds,
    Problem,
    Proof,
    bound_cells,
    halves,
)
from drake_quad.certificate.cells import Cells, pick
from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import LEGS

NEAR = 1e-3  # [s] to which the time is found
UNSURE = 0.2  # [m] in the course: no shank of a plan is there, its place is not known
# If several fail at once the first of these says most.
_ORDER = (REACH, JOINTS, MARGIN, SHARES, TORQUE, GROUND, FOOT, SHANK)


@dataclass(frozen=True)
class Failure:
    """Where a proof ends.

    Attributes:
        task: Index of the task.
        segment: Index of the segment, counted through all tasks.
        time: Time in the task [s]; everything before is proven.
        value: The least that the quantity is found to be in the segment [its unit].
        demand: The value demanded.
        reason: Words that say what is wrong.
    """

    task: int
    segment: int
    time: float
    value: float
    demand: float
    reason: str


def first_failure(problem: Problem, proof: Proof) -> Failure | None:
    """The earliest time that is not proven to meet the demand; None if the proof meets it.

    Cells that are not proven are halved, in the order of time, until one is that is no longer than
    NEAR. Where halves prove all of them, the proof as it is still claims less than is demanded: the
    first of its own cells is told then.
    """
    if np.all(proof.met):
        return None
    demand = proof.demand + ROUNDING
    below = np.flatnonzero(np.any(proof.bounds.low - ROUNDING < proof.demand, axis=1))
    open_cells = [(pick(proof.cells, below[k : k + 1]), pick(proof.bounds, below[k : k + 1]))
                  for k in reversed(range(len(below)))]  # fmt: skip
    first = open_cells[-1]
    while open_cells:
        cells, bounds = open_cells.pop()
        if 2.0 * cells.half[0] < NEAR:
            return _describe(problem, proof, cells, bounds)
        parts = halves(problem, cells)
        found = bound_cells(
            problem,
            parts,
            # What falls short elsewhere in the segment must not keep these from being looked at.
            best=np.maximum(proof.best, demand),
            tolerance=np.zeros(len(demand)),
            demand=demand,
        )
        bad = np.flatnonzero(np.any(found.low < demand, axis=1))
        open_cells += [(pick(parts, bad[k : k + 1]), pick(found, bad[k : k + 1]))
                       for k in reversed(range(len(bad)))]  # fmt: skip
    return _describe(problem, proof, *first)


def _describe(problem: Problem, proof: Proof, cells: Cells, bounds: Bounds) -> Failure:
    pieces, demand = problem.pieces, proof.demand
    bad = [c for c in _ORDER if bounds.low[0, c] < demand[c] + ROUNDING]
    column = bad[0]
    piece = int(cells.piece[0])
    value = float(proof.best[pieces.segment[piece], column])
    reason = _reason(problem, column, int(bounds.where[0, column]), value, float(demand[column]))
    if value >= demand[column]:
        reason += ", which is too near to it to be shown"
    return Failure(
        task=int(pieces.task[piece]),
        segment=int(pieces.segment[piece]),
        time=float(cells.middle[0] - cells.half[0]),
        value=value,
        demand=float(demand[column]),
        reason=reason,
    )


def _reason(problem: Problem, column: int, where: int, value: float, demand: float) -> str:
    """What is wrong, in words."""
    robot = problem.robot
    asked = f"{demand:.4f} m asked for"
    if column == MARGIN:
        return f"the static margin of the whole robot goes down to {value:.4f} m, {asked}"
    if column == FOOT:
        return f"a swing foot comes to {value:.4f} m from a riser or nosing, {asked}"
    if column == SHANK:
        leg = LEGS[where].short
        if value < -UNSURE:
            return f"leg {leg} is so straight, or folded, that little is known of its shank"
        return f"the knee or shank of {leg} comes to {value:.4f} m from the course, {asked}"
    if column == JOINTS:
        return f"joint {robot.joint_names[where]} goes {-value:.3f} rad beyond its limits"
    if column == TORQUE:
        name = robot.joint_names[where]
        return f"joint {name} needs {1.0 - value:.0%} of its torque limit to stand still"
    if column == REACH:
        return f"leg {LEGS[where].short} cannot reach: it lacks {-value:.4f} m"
    if column == GROUND:
        return f"a swing foot dips {-value:.4f} m into the ground that it steps from or onto"
    return "vertical forces of the standing feet that balance the robot were not found"


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
    """Checks that a mission is one motion, continuous to the acceleration, from rest to rest.

    Inside of a task the body's path is a uniform cubic B-spline, which is C2, and a swing is made
    of quintics that rest at lift-off, apex and touchdown: what can jump is the body where a task
    begins or ends, and a foot whose swing begins elsewhere than where it stands.

    Args:
        plans: The plans of the mission's tasks.
    """
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
