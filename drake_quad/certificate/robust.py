"""Proves a plan's figures for all motions and stairs that are within tolerances of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.bounds import (
    ROUNDING,
    Problem,
    Proof,
    make_demand,
    pose_problem,
    prove,
)
from drake_quad.certificate.cells import Pieces, Spans, cut_pieces
from drake_quad.certificate.certify import CLAIMS
from drake_quad.certificate.clearance import TILTED
from drake_quad.certificate.failure import Failure, first_failure
from drake_quad.certificate.obstacles import LEVEL, Obstacles, find_box_obstacles
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel, ShankProfile
from drake_quad.terrain.boxes import Box

FOOTHOLD_CAP = 1.0  # [m]; larger distances from an edge are told as this
STEPS = 20  # shares of the tolerances are sought in steps of one over this
FOOTHOLD = "foothold_room"


@dataclass(frozen=True, eq=False)
class RobustProof:
    """What holds of a plan for all that is within tolerances of it.

    Attributes:
        asked: The tolerances.
        share: What all of them can be multiplied by, at most 1, so that the figures are positive.
        figures: What is proven within this share of them, by name: the certificate's claims, and
            how far standing feet are from edges and higher steps; empty if nothing is.
        fails_at: The next greater share, within which it fails; None if it holds within all.
        failure: Where it first fails there.
    """

    asked: Tolerances
    share: float
    figures: dict[str, float]
    fails_at: float | None
    failure: Failure | None


def prove_within(
    robot: RobotModel,
    shank: ShankProfile,
    plans: Sequence[MotionPlan],
    boxes: Sequence[Box],
    asked: Tolerances,
    *,
    always: Tolerances = NONE,
) -> RobustProof:
    """Proves what holds of a plan at every time, for all that is within tolerances of it.

    Where it does not hold within all of them, the greatest share of them is sought within which it
    does.

    Args:
        robot: The robot.
        shank: How thick its shanks are.
        plans: The mission's tasks, each beginning where the one before ends.
        boxes: The course, as mapped.
        asked: The tolerances.
        always: Further tolerances, of which no share is sought: it is to hold within all of these.
            Without figures it does not, whatever the share.
    """
    obstacles = find_box_obstacles(boxes)
    whole = cut_pieces(plans)
    room = foothold_room(whole, obstacles, robot.foot_radius)

    def within(share: float, only: Spans | None = None) -> tuple[Problem, Proof]:
        """Bounds within a share of them; only as good as the demand, if of some times alone."""
        some = always.with_more(asked.scaled(share))
        pieces = cut_pieces(plans, some.late, only)
        problem = pose_problem(robot, shank, pieces, obstacles, some)
        return problem, prove(problem, make_demand(), fine=only is None)

    def left(share: float) -> FloatArray:
        return room - (always.foot + always.run) - share * (asked.foot + asked.run)

    def figures_of(proof: Proof, share: float) -> dict[str, float]:
        least = [*proof.claims.min(axis=0).tolist(), float(left(share).min())]
        return dict(zip((*CLAIMS, FOOTHOLD), least, strict=True))

    failed, proof = within(1.0)
    if np.all(proof.met) and left(1.0).min() > 0.0:
        return RobustProof(asked, 1.0, figures_of(proof, 1.0), None, None)
    # What holds within more holds within less: only the times that fail are looked at again.
    low, high, where = 0, STEPS, first_failure(failed, proof)
    late = always.late + asked.late
    spans = failing_spans(failed.pieces, proof, late)
    while high - low > 1:
        middle = (low + high) // 2
        fails = None
        if len(spans.task):
            problem, proof = within(middle / STEPS, spans)
            fails = first_failure(problem, proof)
        if fails is None and left(middle / STEPS).min() > 0.0:
            low = middle
            continue
        high, where = middle, fails
        spans = failing_spans(problem.pieces, proof, late) if fails else NEVER
    ends = (where, first_beyond_edge(whole, left(high / STEPS)))
    failure = min((f for f in ends if f), key=lambda f: (f.task, f.time), default=None)
    while low > 0 or (low == 0 and always != NONE):
        _, proof = within(low / STEPS)
        if np.all(proof.met) and left(low / STEPS).min() > 0.0:
            return RobustProof(
                asked, low / STEPS, figures_of(proof, low / STEPS), high / STEPS, failure
            )
        low -= 1  # how time is divided has a share in bounds, too
    return RobustProof(asked, 0.0, {}, high / STEPS, failure)


NEVER = Spans(np.zeros(0, dtype=int), np.zeros(0), np.zeros(0))


def failing_spans(pieces: Pieces, proof: Proof, late: float) -> Spans:
    """The pieces in which something is not proven, and what is left of a touchdown before them."""
    open_cells = np.any(proof.bounds.low - ROUNDING < proof.demand, axis=1)
    bad = np.unique(proof.cells.piece[open_cells])
    return Spans(pieces.task[bad], pieces.start[bad] - late, pieces.end[bad] + late)


def first_beyond_edge(pieces: Pieces, room: FloatArray) -> Failure | None:
    """The first time that a standing foot may be beyond its tread's edge, or in a higher step."""
    bad = np.flatnonzero(room.min(axis=1) <= 0.0)
    if len(bad) == 0:
        return None
    first = bad[np.lexsort((pieces.start[bad], pieces.task[bad]))[0]]
    leg = int(np.argmin(room[first]))
    value = float(room[first, leg])
    reason = (
        f"foot {LEGS[leg].short} may stand {-value:.4f} m beyond the edge of its tread, or in the "
        "next one"
    )
    return Failure(
        task=int(pieces.task[first]),
        segment=int(pieces.segment[first]),
        time=float(pieces.start[first]),
        value=value,
        demand=0.0,
        reason=reason,
    )


def foothold_room(pieces: Pieces, obstacles: Obstacles, radius: float) -> FloatArray:
    """How far standing feet are from the edges of what they stand on, and from higher steps.

    The feet roll evenly in a piece: between two places that are L apart, and a and b from a convex
    set, no place is nearer to it than (a + b - L) / 2.

    Args:
        pieces: The plan.
        obstacles: The course.
        radius: Radius of the feet [m].

    Returns:
        (pieces, 4) [m]: FOOTHOLD_CAP where a foot is in the air, or nothing is near.
    """
    room = np.full(pieces.standing.shape, FOOTHOLD_CAP)
    piece, leg = np.nonzero(pieces.standing)
    centre = pieces.feet[piece, leg]
    lowest = centre - [0.0, 0.0, radius]
    on = np.concatenate([pieces.roll[piece, leg], np.zeros((len(piece), 1))], axis=1)
    for k, face in enumerate(obstacles.face):
        tilted = obstacles.axes[k, 2, 2] < 1.0
        if face:
            height = (lowest - obstacles.centre[k]) @ obstacles.axes[k, 2] - obstacles.half[k, 2]
            points, counts, thick = lowest, np.abs(height) <= (TILTED if tilted else LEVEL), 0.0
        else:
            higher = np.full(len(piece), not tilted) & (obstacles.top[k] > lowest[:, 2] + LEVEL)
            points, counts, thick = centre, higher, radius
        near = np.linalg.norm(points - obstacles.centre[k], axis=1)
        reach = float(np.linalg.norm(obstacles.half[k])) + FOOTHOLD_CAP
        some = np.flatnonzero(counts & (near < reach))
        which = np.full(len(some), k)
        ends = [obstacles.distance(points[some] + w * on[some], which)[0] for w in (0.0, 1.0)]
        least = 0.5 * (ends[0] + ends[1] - np.linalg.norm(on[some], axis=1)) - thick
        np.minimum.at(room, (piece[some], leg[some]), least)
    return room
