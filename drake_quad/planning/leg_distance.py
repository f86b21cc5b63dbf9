"""Room between a robot's legs: of shanks from each other, and from thighs, compiled."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.shank_room import knee_axes, shank_middles
from drake_quad.robot.leg_kinematics import calc_knees
from drake_quad.robot.robot_model import RobotModel

PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])  # of legs, by their rows
TINY = 1e-12
ENOUGH = 0.02  # [m]: nobody asks how much more it is


def room_between_legs(robot: RobotModel, p_BF: FloatArray, q: FloatArray) -> FloatArray:
    """Room between the legs of each of PAIRS (N, 6), at most ENOUGH, negative where they touch [m].

    Args:
        robot: The robot.
        p_BF: (N, 4, 3) feet in B [m].
        q: (N, 4, 3) the joints' angles there [rad].
    """
    knees = calc_knees(robot.geometry, q)
    middles = shank_middles(robot.shank_offsets, knees, p_BF, knee_axes(q))
    hips = np.broadcast_to(robot.geometry.p_BH, knees.shape)[:, :, None]
    points = np.concatenate([hips, middles], axis=2)
    return legs_apart(points, robot.shank_radii, ENOUGH)


@compiled
def between_lines(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> float:
    """Distance of the line from p to q from that from r to s, all (3,) [m].

    Ericson, "Real-Time Collision Detection" (2005), section 5.1.9.
    """
    a = e = f = b = c = 0.0
    for i in range(3):
        along, other, gap = q[i] - p[i], s[i] - r[i], p[i] - r[i]
        a += along * along
        e += other * other
        f += other * gap
        b += along * other
        c += along * gap
    t, u = 0.0, 0.0
    if a <= TINY:
        u = min(max(f / e, 0.0), 1.0) if e > TINY else 0.0
    elif e <= TINY:
        t = min(max(-c / a, 0.0), 1.0)
    else:
        square = a * e - b * b
        t = min(max((b * f - c * e) / square, 0.0), 1.0) if square > TINY else 0.0
        u = (b * t + f) / e
        if u < 0.0:
            u, t = 0.0, min(max(-c / a, 0.0), 1.0)
        elif u > 1.0:
            u, t = 1.0, min(max((b - c) / a, 0.0), 1.0)
    total = 0.0
    for i in range(3):
        away = p[i] + t * (q[i] - p[i]) - r[i] - u * (s[i] - r[i])
        total += away * away
    return sqrt(total)


@compiled
def legs_apart(points: FloatArray, radii: FloatArray, enough: float) -> FloatArray:
    """Room between the legs of each of PAIRS (N, 6) [m], negative where they would touch.

    Pairs that surely have `enough` [m] are told to have just that.

    Args:
        points: (N, 4, 1 + K, 3) each leg's hip, then its shank's middles from the knee on [m].
        radii: (4, K) of the shanks there; thighs are as thick as knees [m].
        enough: [m].
    """
    N, M = points.shape[0], points.shape[2]
    found = np.full((N, len(PAIRS)), enough)
    for n in range(N):
        for k in range(len(PAIRS)):
            one, two = PAIRS[k, 0], PAIRS[k, 1]
            square = 0.0  # of the gap between the boxes about both
            for axis in range(3):
                a_low = a_high = points[n, one, 0, axis]
                b_low = b_high = points[n, two, 0, axis]
                for j in range(1, M):
                    a, b = points[n, one, j, axis], points[n, two, j, axis]
                    a_low, a_high = min(a_low, a), max(a_high, a)
                    b_low, b_high = min(b_low, b), max(b_high, b)
                gap = max(max(b_low - a_high, a_low - b_high), 0.0)
                square += gap * gap
            if sqrt(square) - radii[one].max() - radii[two].max() >= enough:
                continue
            for i in range(M - 1):
                for j in range(M - 1):
                    if i == 0 and j == 0:
                        continue  # thighs turn beside the trunk, where there is room for both
                    thick = max(radii[one, i], radii[one, max(i - 1, 0)])
                    thick += max(radii[two, j], radii[two, max(j - 1, 0)])
                    away = between_lines(
                        points[n, one, i], points[n, one, i + 1],
                        points[n, two, j], points[n, two, j + 1],
                    )  # fmt: skip
                    found[n, k] = min(found[n, k], away - thick)
    return found
