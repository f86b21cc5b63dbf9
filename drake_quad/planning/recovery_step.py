"""Where to put a foot down to catch a push.

The capture point leaves the pivot (`stability.capture_point`); the best that the feet on the ground
can do meanwhile is to press where they are nearest to it. The foot goes where the feet that then
stand hold the capture point with the most margin.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.jit import jit
from drake_quad.robot.kinematics import solve_legs
from drake_quad.robot.legs import LEGS, SIGNS, Leg
from drake_quad.robot.model import LegGeometry, RobotModel
from drake_quad.stability.capture_point import FallingPendulum, fall, ground_reach, nearest_support
from drake_quad.stability.support_polygon import stability_margin, stability_margins
from drake_quad.terrain.course import Course, box_tops, top_at

FOOTING = 0.015  # [m] of level ground around the foot's sphere
APART = 0.08  # [m] between feet
CLEARANCE = 0.02  # [m] of a foot on its way above whatever it passes that is above its own ground
LEVEL = 1e-3  # [m] of height within which ground is level
RING = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi * np.arange(8) / 8.0])
ALONG = np.linspace(0.0, 1.0, 13)[1:]  # samples on the way


class StepTargetMap:
    """The course as a foot that must be put down at once sees it.

    Args:
        course: The ground.
        foot_radius: Radius of the foot spheres [m].
    """

    def __init__(self, course: Course, foot_radius: float) -> None:
        self.foot_radius = foot_radius
        self._nosings = course.nosings()[:, :, :2]
        self._tops = box_tops(course)

    def height(self, places: FloatArray) -> FloatArray:
        """Height of the ground in W at `places` (..., 2) [m]; nan where there is none."""
        flat = np.ascontiguousarray(places.reshape(-1, 2))
        return _heights(flat, self._tops).reshape(places.shape[:-1])

    def whole(self, places: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) have level ground, or one slope, all around the foot, (N,)."""
        around_foot = self.foot_radius + FOOTING
        around = self.height(places[:, None, :] + around_foot * RING) - self.height(places)[:, None]
        half = len(RING) // 2
        bend = around[:, :half] + around[:, half:]  # of opposite points: on a plane they cancel
        level = np.all(np.abs(bend) <= 2.0 * LEVEL, axis=1)  # nan: no
        if not len(self._nosings):
            return np.asarray(level)
        a, b = self._nosings[:, 0], self._nosings[:, 1]
        edge = _distance(places[:, None, :], a, b).min(axis=1)
        return np.asarray(level & (edge >= around_foot))

    def open_way(self, foot: FloatArray, places: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) the foot's centre, now at `foot` (3,), can go to straight.

        It passes nothing that is higher than its own ground and higher than it is itself.
        """
        points = foot[:2] + ALONG[:, None] * (places - foot[:2])[:, None, :]
        passed = np.nan_to_num(self.height(points), nan=-np.inf)
        own = np.nan_to_num(self.height(foot[None, :2]), nan=-np.inf)[0]
        return np.asarray(
            passed.max(axis=1) <= max(own, foot[2] - self.foot_radius - CLEARANCE) + LEVEL
        )

    def free_of(self, places: FloatArray, foot: FloatArray, others: FloatArray) -> BoolArray:
        """Which of `places` (N, 2) are clear of the `others` (m, 3), and on the way there too.

        A foot that is already nearer to another than is liked comes no nearer on its way.
        """
        other = others[:, :2]
        there = np.linalg.norm(places[:, None, :] - other, axis=-1)
        here = np.linalg.norm(foot[:2] - other, axis=-1)
        way = _distance(other, np.broadcast_to(foot[:2], (len(places), 1, 2)), places[:, None, :])
        near = way < np.minimum(APART, here) - 1e-9
        return np.asarray(np.all((there >= APART) & ~near, axis=1))


@jit
def _heights(points: FloatArray, tops: FloatArray) -> FloatArray:
    """`Course.height` of points (N, 2), of the course's `box_tops`."""
    found = np.empty(len(points))
    for k in range(len(points)):
        found[k], _, _ = top_at(tops, points[k, 0], points[k, 1])
    return found


def _distance(p: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Distances (...) of points p (..., 2) from the segments a-b (..., 2) [m], broadcast."""
    ab = b - a
    length = np.maximum(np.sum(ab * ab, axis=-1), 1e-12)
    t = np.clip(np.sum((p - a) * ab, axis=-1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - a - t[..., None] * ab, axis=-1))


RADII = np.linspace(0.05, 0.45, 9)  # [m] of the fan about the foot
SPOKES = 16
SPEED = 2.5  # [m/s] of the foot on average; at most 4.7, which is 5.5 rad/s for a leg of 0.85 m
SHORTEST = 0.12  # [s]
LIFT = 0.03  # [m] by which a foot that stands is raised
BATCH = 24  # places looked at closely at a time
REACH_SLACK = 0.03  # [m] by which the leg is to be longer than it must be
MARGIN_ENOUGH = 0.08  # [m] beyond which more is worth nothing
WORTHWHILE = 1e-3  # [m] of margin for which a standing foot is lifted at all
PRICE = 0.02  # [m] of margin that a metre of distance must bring


@dataclass(frozen=True, eq=False)
class RecoveryStep:
    """A foot to be put down at once.

    Attributes:
        leg: Its leg.
        p_W: Where its sphere's centre is to be, (3,) in W [m].
        duration: How long the foot takes to get there [s].
        margin: Margin of the predicted capture point over the feet that then stand [m].
    """

    leg: Leg
    p_W: FloatArray
    duration: float
    margin: float


def choose_recovery_step(
    robot: RobotModel,
    ground: StepTargetMap,
    state: FallingPendulum,
    *,
    swing: int | None = None,
    touchdown: FloatArray | None = None,
) -> RecoveryStep | None:
    """Chooses which foot to put down where.

    Args:
        robot: The robot.
        ground: The course.
        state: The robot as it is.
        swing: Row of the leg in the air; None if none is, and then any leg may be lifted.
        touchdown: Where the swing was to end, (2,) or (3,) in W [m].

    Returns:
        The catch; None if no foot can be put down anywhere that helps. With a leg in the air
        something always helps, straight down if nothing else is needed, where there is ground.
        On four feet nothing is done while the capture point is among them.
    """
    if swing is not None:
        return _best(robot, ground, state, swing, touchdown, lifted=True)
    held = stability_margin(state.capture, state.feet[state.standing, :2])
    if held >= 0.0:
        return None
    found = [c for leg in LEGS if (c := _best(robot, ground, state, leg.row, None, lifted=False))]
    if not found:
        return None
    best = max(found, key=_score)
    pivot = nearest_support(state.capture, state.feet[state.standing, :2])
    idle = fall(state.capture, pivot, state.omega, np.array([best.duration]))[0]
    if best.margin <= stability_margin(idle, state.feet[state.standing, :2]) + WORTHWHILE:
        return None
    return best


def _score(catch: RecoveryStep) -> tuple[float, float, float]:
    """Margin as far as it counts, then haste, then margin: rounded, so that frames don't matter."""
    enough = min(catch.margin, MARGIN_ENOUGH)
    return round(enough, 6), round(-catch.duration, 6), round(catch.margin, 6)


def _best(
    robot: RobotModel,
    ground: StepTargetMap,
    state: FallingPendulum,
    row: int,
    touchdown: FloatArray | None,
    *,
    lifted: bool,
) -> RecoveryStep | None:
    """The best place for one leg."""
    foot = state.feet[row]
    bears = np.array(state.standing)
    bears[row] = False
    places = _fan(foot[:2], state.yaw, float(SIGNS[row, 1]), touchdown)
    pivot = nearest_support(state.capture, state.feet[bears, :2])

    if not lifted:
        places = places[1:]  # to put it down where it stands helps nobody
    z = ground.height(places) + robot.foot_radius
    places, z = places[~np.isnan(z)], z[~np.isnan(z)]
    if not len(places):
        return None
    distance = np.linalg.norm(places - foot[:2], axis=1)
    way = np.hypot(distance, z - foot[2]) + (0.0 if lifted else 2.0 * LIFT)
    durations = np.maximum(SHORTEST, way / SPEED)
    capture = fall(state.capture, pivot, state.omega, durations)
    feet = np.tile(state.feet[:, :2], (len(places), 1, 1))
    feet[:, row] = places
    bears[row] = True
    margins = stability_margins(capture, feet, np.tile(bears, (len(places), 1)))
    # Rounded, so that of equals the first is taken whatever the frame.
    score = np.round(np.minimum(margins, MARGIN_ENOUGH) - PRICE * distance, 9)

    p_W = np.column_stack([places, z])
    moved = ground_reach(state, pivot, durations)
    others = np.delete(state.feet, row, axis=0)
    ranked = np.argsort(-score, kind="stable")
    for first in range(0, len(ranked), BATCH):  # the best ones mostly do
        k = ranked[first : first + BATCH]
        ok = ground.free_of(places[k], foot, others)
        ok &= ground.whole(places[k]) & ground.open_way(foot, places[k])
        ok &= _reachable(robot, state, row, p_W[k], 0.0 * moved[k], REACH_SLACK)
        ok &= _reachable(robot, state, row, p_W[k], moved[k], 0.0)
        if ok.any():
            best = int(k[np.argmax(ok)])
            found = float(durations[best]), float(margins[best])
            return RecoveryStep(LEGS[row], read_only(p_W[best]), *found)
    return None


def _fan(foot: FloatArray, yaw: float, side: float, touchdown: FloatArray | None) -> FloatArray:
    """Straight down, the planned touchdown, and a fan about the foot that is mirrored by legs."""
    angle = 2.0 * np.pi * np.arange(SPOKES) / SPOKES
    x, y = np.cos(angle), side * np.sin(angle)
    c, s = np.cos(yaw), np.sin(yaw)
    spokes = np.column_stack([c * x - s * y, s * x + c * y])
    planned = np.empty((0, 2)) if touchdown is None else np.asarray(touchdown)[None, :2]
    fan = (RADII[:, None, None] * spokes).reshape(-1, 2)
    return np.concatenate([foot[None], planned, foot + fan])


def _reachable(
    robot: RobotModel,
    state: FallingPendulum,
    row: int,
    p_W: FloatArray,
    moved: FloatArray,
    slack: float,
) -> BoolArray:
    """Which places (N, 3) the leg reaches from the body moved by (N, 2), within its limits."""
    c, s = np.cos(state.yaw), np.sin(state.yaw)
    d = p_W - state.p_WB
    d[:, :2] -= moved
    p_BF = np.column_stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]])
    g, one = robot.geometry, slice(row, row + 1)
    leg = LegGeometry(
        g.p_BH[one], g.offset[one], g.thigh[one], g.shank[one], g.knee_sign[one], g.raised[one]
    )
    p_HF = p_BF - g.p_BH[row]
    length = np.linalg.norm(p_HF, axis=1, keepdims=True)
    q, excess = solve_legs(leg, p_BF[:, None])
    _, beyond = solve_legs(leg, (p_BF + slack / np.maximum(length, 1e-9) * p_HF)[:, None])
    limits = slice(3 * row, 3 * row + 3)
    within = (q[:, 0] >= robot.q_lower[limits]) & (q[:, 0] <= robot.q_upper[limits])
    reached = (excess[:, 0] == 0.0) & (beyond[:, 0] == 0.0)  # nan: no
    return np.asarray(reached & within.all(axis=1))
