"""Proofs that no statically stable climb exists: the search for one, and its record.

The claim, for a robot and a flight up of `count` steps: there is no motion from all four feet on
the floor to all four on the landing in which, at every time,

- at least three feet stand, and the fourth stands or moves: one foot moves at a time;
- a standing foot's centre is above the tread (floor, landing) that it stands on, a foot's radius
  above it, and its ball is not inside the next riser; where on the tread is free, and which;
- the robot's centre of mass, its moving legs included, is above the polygon of the standing feet,
  also of those three that carry while the fourth leaves or reaches its place;
- knees and hips stay within their limits, and a leg hangs: in the leg's own plane the foot is not
  above its hip;
- the line under the trunk, in the middle of its width, is not inside the stairs;
- pitch, roll and yaw of the trunk are at most those of `ClimbClass`, to both sides.

Everything else is free: gait, order and timing, footholds, lateral positions, the trunk's height
and path. Torque, friction, collisions of legs, and the way that a foot swings are not used. So a
proof is about much more than the gaits that this program plans, and it is found only for rises
that are much higher; where there is none, nothing follows.

The proof is a boundary between two levels, and moments that are impossible there and without
which there is no way past it (`climb.py`). For each of these moments a tree halves the box of all
the trunk's poses until interval bounds close every part (`boxes.py`); branch and bound as in
Moore, Kearfott and Cloud (2009). `scripts/check_no.py` verifies the record without this package.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drake_quad.certificate.certify import digest
from drake_quad.common import FloatArray
from drake_quad.infeasibility.boxes import OPEN, ClimbClass, close_boxes, root_box
from drake_quad.infeasibility.climb import FEET, Moment, find_way
from drake_quad.infeasibility.robot_bounds import RobotBounds, bounds_of
from drake_quad.robot.model import RobotModel

FORMAT, VERSION = "drake_quad proof of infeasibility", 1
AXES = "xzp"  # a node of a tree that halves the box along x, z or pitch
WEIGHTS = np.array([1.0, 1.0, 0.4])  # [m, m, m/rad] of the widths that are compared
MOST_BOXES = 200_000  # of one moment, before giving up
GRID = (16, 16, 7)  # poses along x, z and pitch that are looked at before any box
FINEST = 2e-3  # [m] width below which a box is not halved any more


@dataclass(frozen=True)
class Refutation:
    """A tree that closes all poses of a moment.

    Attributes:
        moment: The moment that is impossible.
        tree: A string for each level of the tree, a letter a node: an axis of AXES of a box that is
            halved, or the reason that closes it. The next level has the lower halves of all boxes
            that are halved, in order, then their upper halves.
    """

    moment: Moment
    tree: tuple[str, ...]


@dataclass(frozen=True)
class InfeasibilityProof:
    """A proof that a robot cannot climb a flight.

    Attributes:
        climb: The flight and the class of motions.
        boundary: Level below the boundary that cannot be passed.
        refutations: The moments that are impossible, each with its tree.
    """

    climb: ClimbClass
    boundary: int
    refutations: tuple[Refutation, ...]

    @property
    def boxes(self) -> int:
        """Number of boxes that close the poses of all moments."""
        levels = [level for one in self.refutations for level in one.tree]
        return sum(sum(letter not in AXES for letter in level) for level in levels)


def prove_infeasible(robot: RobotModel, climb: ClimbClass) -> InfeasibilityProof | None:
    """Looks for a proof that a robot cannot climb; None if none is found, which proves nothing."""
    bounds = bounds_of(robot)
    last = climb.count - 1
    for boundary in sorted({0, min(1, last), last}):
        found = _refute_boundary(bounds, climb, boundary)
        if found is not None:
            return InfeasibilityProof(climb, boundary, found)
    return None


def _refute_boundary(
    bounds: RobotBounds, climb: ClimbClass, boundary: int
) -> tuple[Refutation, ...] | None:
    """Refutations without which there is a way past a boundary; None if some way is left.

    A moment is looked at only if it is on a way that is left so far.
    """
    found: dict[Moment, Refutation] = {}
    possible: set[Moment] = set()
    while (way := find_way(found)) is not None:
        unknown = [moment for moment in way if moment not in possible]
        if not unknown:
            return None
        tree = refute_moment(bounds, climb, boundary, unknown[0])
        if tree is None:
            possible.add(unknown[0])
        else:
            found[unknown[0]] = Refutation(unknown[0], tree)
    for moment in list(found):
        if find_way(found.keys() - {moment}) is None:
            del found[moment]
    return tuple(found.values())


def refute_moment(
    bounds: RobotBounds, climb: ClimbClass, boundary: int, moment: Moment
) -> tuple[str, ...] | None:
    """A tree that closes all poses of a mixed moment, see `Refutation`; None if there is none.

    It gives up at the first pose for which no condition is violated, for then no tree exists.
    """
    boxes = root_box(bounds, climb, boundary)[None]
    levels: list[str] = []
    looked = 0
    if boxes[0, 0, 1] > boxes[0, 1, 1]:
        return ()  # no feet reach from one side to the other: there are no poses at all
    grids = [np.linspace(low, high, n) for low, high, n in zip(*boxes[0], GRID, strict=True)]
    poses = np.stack(np.meshgrid(*grids), axis=-1).reshape(-1, 3)
    points = np.stack([poses, poses], axis=1)
    if np.any(close_boxes(bounds, climb, boundary, moment, points) == OPEN):
        return None
    while len(boxes):
        looked += len(boxes)
        if looked > MOST_BOXES:
            return None
        letters = close_boxes(bounds, climb, boundary, moment, boxes)
        parts = letters == OPEN
        open_boxes = boxes[parts]
        middle = 0.5 * (open_boxes[:, 0] + open_boxes[:, 1])
        points = np.stack([middle, middle], axis=1)
        if np.any(close_boxes(bounds, climb, boundary, moment, points) == OPEN):
            return None
        widths = (open_boxes[:, 1] - open_boxes[:, 0]) * WEIGHTS
        if np.any(widths.max(axis=-1, initial=np.inf, where=len(widths) > 0) < FINEST):
            return None
        axis = np.argmax(widths, axis=-1)
        letters[parts] = np.array(list(AXES))[axis]
        levels.append("".join(letters))
        boxes = halve(open_boxes, axis)
    return tuple(levels)


def halve(boxes: FloatArray, axis: np.ndarray[Any, np.dtype[np.intp]]) -> FloatArray:
    """The lower halves of boxes (N, 2, 3) along an axis each (N,), then the upper halves."""
    rows = np.arange(len(boxes))
    lower, upper = boxes.copy(), boxes.copy()
    middle = 0.5 * (boxes[rows, 0, axis] + boxes[rows, 1, axis])
    lower[rows, 1, axis], upper[rows, 0, axis] = middle, middle
    return np.concatenate([lower, upper])


def proof_record(
    proof: InfeasibilityProof, robot: RobotModel, *, file_digest: str = ""
) -> dict[str, Any]:
    """A proof as plain values, with the robot's numbers that it follows from and its own hash.

    Args:
        proof: The proof.
        robot: The robot that it is about.
        file_digest: Digest of the robot's file, which tells files apart.
    """
    g = robot.geometry
    record = {
        "format": FORMAT,
        "version": VERSION,
        "claim": "no statically stable climb of the class exists",
        "robot": {
            "name": robot.name,
            "file_digest": file_digest,
            "trunk": robot.trunk,
            "joints": list(robot.joint_names),
            "hips": g.p_BH.tolist(),
            "offsets": g.offset.tolist(),
            "raised": g.raised.tolist(),
            "thighs": g.thigh.tolist(),
            "shanks": g.shank.tolist(),
            "q_lower": robot.q_lower.tolist(),
            "q_upper": robot.q_upper.tolist(),
            "efforts": robot.effort.tolist(),
            "trunk_mass": float(robot.trunk_mass),
            "trunk_com": robot.trunk_com.tolist(),
            "link_masses": robot.link_mass.tolist(),
            "link_coms": robot.link_com.tolist(),
            "foot_radius": float(robot.foot_radius),
            "trunk_box": robot.trunk_box.tolist(),
        },
        "climb": asdict(proof.climb),
        "boundary": proof.boundary,
        "moments": [
            {
                "above": [bool(one.moment.above >> leg & 1) for leg in range(FEET)],
                "mover": one.moment.mover,
                "tree": list(one.tree),
            }
            for one in proof.refutations
        ],
    }
    return {**record, "sha256": digest(record)}
