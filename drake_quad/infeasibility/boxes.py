"""Interval bounds that close a box of trunk poses at one moment of a climb.

A pose is x and z of B's origin in the world [m] and the pitch [rad], where x is along the flight,
z is up, and x = 0 at the first riser; roll and yaw lie anywhere in intervals of the class. y does
not matter, as stairs are as wide as one likes. Bounds are those of interval arithmetic (Moore,
Kearfott and Cloud, *Introduction to Interval Analysis*, SIAM 2009), in plain floats: a box is
closed only if a condition is violated by more than `SLACK`, which is thousands of times the
rounding errors of the few sums and products that it takes.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.infeasibility.climb import FEET, Moment
from drake_quad.infeasibility.robot_bounds import RobotBounds

SLACK = 1e-9  # [m]
ROOT = 2e-12  # [m^2] under a root: twice what the independent checker adds, so that it agrees
OPEN = "."
LEG_REASONS = "abcd"  # foot FL, FR, RL, RR reaches no place on its side
SUPPORT, TRUNK = "s", "t"

Interval = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class ClimbClass:
    """The motions and the stairs that a proof is about.

    Attributes:
        rise: Rise of the steps [m].
        run: Run of the treads [m].
        count: Number of steps.
        pitch: The trunk's pitch is at most this, up or down [rad].
        roll: Likewise its roll [rad].
        yaw: Likewise its heading, from straight up the flight [rad].
    """

    rise: float
    run: float
    count: int
    pitch: float = 0.7
    roll: float = 0.2
    yaw: float = 0.2


def root_box(robot: RobotBounds, climb: ClimbClass, boundary: int) -> FloatArray:
    """Least and greatest x, z and pitch (2, 3) of all poses of a mixed moment.

    Some foot is at x <= edge and z <= boundary * rise + radius, another one at x >= edge and
    z >= (boundary + 1) rise + radius, and all are within reach of hips that are near B's origin.
    """
    far = float(np.max(robot.reach) + np.max(np.linalg.norm(robot.hips, axis=-1))) + 1e-3
    edge, low = boundary * climb.run, boundary * climb.rise + robot.foot_radius
    return np.array(
        [
            [edge - far, low + climb.rise - far, -climb.pitch],
            [edge + far, low + far, climb.pitch],
        ]
    )


def places_on(climb: ClimbClass, radius: float, level: int) -> tuple[float, float]:
    """Least and greatest x of the centre of a foot that stands on a level [m].

    The centre is above the level's own ground, and the ball not inside the next riser.
    """
    low = (level - 1) * climb.run if level > 0 else -np.inf
    if level == climb.count:
        return low, np.inf
    return low, level * climb.run - (radius if climb.rise >= radius else 0.0)


def close_boxes(
    robot: RobotBounds, climb: ClimbClass, boundary: int, moment: Moment, boxes: FloatArray
) -> FloatArray:
    """For each box (N, 2, 3) the code of a reason that no pose in it works (N,), or OPEN."""
    reasons = np.full(len(boxes), OPEN)
    turn = TurnedBoxes(climb, boxes)
    low, high = np.full(len(boxes), np.inf), np.full(len(boxes), -np.inf)
    for leg in range(FEET):
        above = bool(moment.above >> leg & 1)
        first, last = reachable_places(robot, climb, boundary, leg, above=above, turn=turn)
        reasons[(first > last) & (reasons == OPEN)] = LEG_REASONS[leg]
        if leg != moment.mover:
            low, high = np.minimum(low, first), np.maximum(high, last)
    com = turn.x_of((robot.com_lower, robot.com_upper))
    outside = (com[1] < low - SLACK) | (com[0] > high + SLACK)
    reasons[outside & (reasons == OPEN)] = SUPPORT
    reasons[trunk_inside(robot, climb, turn) & (reasons == OPEN)] = TRUNK
    return reasons


class TurnedBoxes:
    """Boxes of poses with the intervals of the rotation's first and third row.

    R_WB = Rz(yaw) Ry(pitch) Rx(roll), so that its rows are, with s and c for sine and cosine,
    x: (cy cp, cy sp sr - sy cr, cy sp cr + sy sr) and z: (-sp, cp sr, cp cr).
    """

    def __init__(self, climb: ClimbClass, boxes: FloatArray) -> None:
        self.x = boxes[:, 0, 0], boxes[:, 1, 0]
        self.z = boxes[:, 0, 1], boxes[:, 1, 1]
        least, most = boxes[:, 0, 2], boxes[:, 1, 2]
        sp: Interval = (np.sin(least), np.sin(most))  # pitch is within a quarter turn
        nearest = np.where((least <= 0.0) & (most >= 0.0), 0.0, np.minimum(abs(least), abs(most)))
        cp: Interval = (np.cos(np.maximum(abs(least), abs(most))), np.cos(nearest))
        one = np.ones(len(boxes))
        sr, cr = (
            (-np.sin(climb.roll) * one, np.sin(climb.roll) * one),
            (np.cos(climb.roll) * one, one),
        )
        sy, cy = (-np.sin(climb.yaw) * one, np.sin(climb.yaw) * one), (np.cos(climb.yaw) * one, one)
        self.row_x = (
            times(cy, cp),
            plus(times(cy, times(sp, sr)), minus(times(sy, cr))),
            plus(times(cy, times(sp, cr)), times(sy, sr)),
        )
        self.row_z = (minus(sp), times(cp, sr), times(cp, cr))
        # B's z axis in W: what R_WB's last column is.
        self.up = (
            self.row_x[2],
            plus(times(sy, times(sp, cr)), minus(times(cy, sr))),
            times(cp, cr),
        )

    def x_of(self, point: Interval) -> Interval:
        """World x of a point of B, given as least and greatest coordinates (3,)."""
        return plus(self.x, self._row(self.row_x, point))

    def z_of(self, point: Interval) -> Interval:
        """World z of a point of B."""
        return plus(self.z, self._row(self.row_z, point))

    @staticmethod
    def _row(row: tuple[Interval, Interval, Interval], point: Interval) -> Interval:
        total = times(row[0], (point[0][0], point[1][0]))
        for k in (1, 2):
            total = plus(total, times(row[k], (point[0][k], point[1][k])))
        return total


def reachable_places(
    robot: RobotBounds,
    climb: ClimbClass,
    boundary: int,
    leg: int,
    *,
    above: bool,
    turn: TurnedBoxes,
) -> Interval:
    """Least and greatest x of foot centres that a leg may reach on its side; inf, -inf if none."""
    hip = robot.hips[leg]
    hx, hz = turn.x_of((hip, hip)), turn.z_of((hip, hip))
    reach = robot.reach[leg]
    first, last = np.full(len(hx[0]), np.inf), np.full(len(hx[0]), -np.inf)
    levels = range(boundary + 1, climb.count + 1) if above else range(boundary + 1)
    for level in levels:
        height = level * climb.rise + robot.foot_radius
        dz: Interval = (height - hz[1], height - hz[0])
        nearest = np.where((dz[0] <= 0.0) & (dz[1] >= 0.0), 0.0, np.minimum(abs(dz[0]), abs(dz[1])))
        within = nearest <= reach + SLACK
        if not np.any(within):
            continue
        # Near full stretch a root makes much of rounding: it is of a little more.
        half = np.sqrt(np.maximum(reach**2 - nearest**2, 0.0) + ROOT) + SLACK
        near, far = _hanging(robot.rise[leg], reach, dz, turn)
        start, end = places_on(climb, robot.foot_radius, level)
        low = np.maximum(np.maximum(hx[0] - half, hx[0] + near), start)
        high = np.minimum(np.minimum(hx[1] + half, hx[1] + far), end)
        there = within & (low <= high + SLACK)
        first = np.where(there, np.minimum(first, low), first)
        last = np.where(there, np.maximum(last, np.maximum(low, high)), last)
    return first, last


def _hanging(rise: float, reach: float, dz: Interval, turn: TurnedBoxes) -> Interval:
    """Bounds of x from hip to foot for feet that are at most `rise` above their hip in B.

    B's z axis is (ux, uy, uz) in W, and ux dx + uy dy + uz dz <= rise, where |dy| <= reach.
    """
    ux, uy, uz = turn.up
    most = rise + reach * np.maximum(abs(uy[0]), abs(uy[1])) - times(uz, dz)[0] + SLACK
    low, high = np.full(len(most), -np.inf), np.full(len(most), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead, behind = ux[0] > 1e-6, ux[1] < -1e-6
        high[ahead] = np.where(most >= 0.0, most / ux[0], most / ux[1])[ahead]
        low[behind] = np.where(most >= 0.0, most / ux[1], most / ux[0])[behind]
    return low - SLACK, high + SLACK


def trunk_inside(robot: RobotBounds, climb: ClimbClass, turn: TurnedBoxes) -> BoolArray:
    """Whether a point under the trunk is inside the stairs at all poses of a box (N,)."""
    inside = np.zeros(len(turn.x[0]), dtype=bool)
    for point in robot.trunk:
        x, z = turn.x_of((point, point)), turn.z_of((point, point))
        # Stairs only rise along x: over the whole interval the ground is as high as at its start.
        level = np.clip(np.floor((x[0] - SLACK) / climb.run) + 1.0, 0.0, climb.count)
        inside |= z[1] < level * climb.rise - SLACK
    return inside


def plus(a: Interval, b: Interval) -> Interval:
    """Sum of intervals."""
    return a[0] + b[0], a[1] + b[1]


def minus(a: Interval) -> Interval:
    """The negative of an interval."""
    return -a[1], -a[0]


def times(a: Interval, b: Interval) -> Interval:
    """Product of intervals."""
    ends = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    return (
        np.minimum(np.minimum(ends[0], ends[1]), np.minimum(ends[2], ends[3])),
        np.maximum(np.maximum(ends[0], ends[1]), np.maximum(ends[2], ends[3])),
    )
