"""Proves a plan's figures for all motions and stairs that are within tolerances of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.bounds import make_demand, pose_problem, prove
from drake_quad.certificate.cells import Pieces, cut_pieces
from drake_quad.certificate.certify import CLAIMS
from drake_quad.certificate.clearance import LEVEL, TILTED, Obstacles, find_box_obstacles
from drake_quad.certificate.failure import Failure, first_failure
from drake_quad.certificate.tolerances import Tolerances
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
    """
    obstacles = find_box_obstacles(boxes)
    whole = cut_pieces(plans)
    room = foothold_room(whole, obstacles, robot.foot_radius)

    def within(share: float) -> tuple[dict[str, float], Failure | None]:
        some = asked.scaled(share)
        pieces = cut_pieces(plans, some.late)
        problem = pose_problem(robot, shank, pieces, obstacles, some)
        proof = prove(problem, make_demand())
        held = room - some.foot - some.run
        least = proof.claims.min(axis=0).tolist()
        figures = dict(zip((*CLAIMS, FOOTHOLD), (*least, float(held.min())), strict=True))
        found = [
            f
            for f in (first_failure(problem, proof), first_beyond_edge(whole, held))
            if f is not None
        ]
        return figures, min(found, key=lambda f: (f.task, f.time), default=None)

    figures, failure = within(1.0)
    if failure is None:
        return RobustProof(asked, 1.0, figures, None, None)
    low, high, best = 0, STEPS, dict[str, float]()
    while high - low > 1:
        middle = (low + high) // 2
        figures, fails = within(middle / STEPS)
        if fails is None:
            low, best = middle, figures
        else:
            high, failure = middle, fails
    return RobustProof(asked, low / STEPS, best, high / STEPS, failure)


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
