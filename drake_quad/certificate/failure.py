"""The earliest time at which a plan is not what was asked for, and why."""

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
from drake_quad.robot.legs import LEGS

NEAR = 1e-3  # [s] to which the time is found
_ROUNDS = 30
# If several fail at once the first of these says most.
_ORDER = (REACH, JOINTS, MARGIN, SHARES, TORQUE, GROUND, FOOT, SHANK)


@dataclass(frozen=True)
class Failure:
    """Where a proof ends.

    Attributes:
        task: Index of the task.
        segment: Index of the segment, counted through all tasks.
        time: In the task [s]; everything before is proven.
        value: The least that the quantity is found to be in the segment [its unit].
        demand: What was asked for.
        reason: For people: what is wrong.
    """

    task: int
    segment: int
    time: float
    value: float
    demand: float
    reason: str


def first_failure(problem: Problem, proof: Proof) -> Failure | None:
    """The earliest time that is not proven to be as asked for; None if all is."""
    if np.all(proof.met):
        return None
    demand = proof.demand + ROUNDING
    below = np.flatnonzero(np.any(proof.bounds.low < demand, axis=1))
    cells, bounds = pick(proof.cells, below[:1]), pick(proof.bounds, below[:1])
    later = below[1:]
    for _ in range(_ROUNDS):
        if 2.0 * cells.half[0] < NEAR:
            break
        parts = halves(problem, cells)
        found = bound_cells(
            problem,
            parts,
            best=proof.best.copy(),
            tolerance=np.zeros(len(demand)),
            demand=demand,
        )
        bad = np.flatnonzero(np.any(found.low < demand, axis=1))
        if len(bad):
            cells, bounds = pick(parts, bad[:1]), pick(found, bad[:1])
        elif len(later):  # both halves are good: the next one is the first
            cells, bounds = pick(proof.cells, later[:1]), pick(proof.bounds, later[:1])
            later = later[1:]
        else:
            return None
    return _describe(problem, proof, cells, bounds)


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
    return "no vertical forces of the standing feet balance the robot"
