"""The arithmetic of `evaluate`, pose by pose: a search looks at tens of thousands of them."""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from drake_quad.compiled import compiled, copy_vector
from drake_quad.design.kernel_distance import SHANK, THIGH, to_body
from drake_quad.design.kernel_forces import best_sway, share_weight, torque_used
from drake_quad.design.kernel_pose import angles, centre, place_points, tilt
from drake_quad.design.kernel_room import leg_room, room_apart, room_under, trunk_room
from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray

UNDER = 7  # points under the trunk that are looked at
STRIDE = 7  # between moments looked at in turn: unlike ones sooner tell what is in the way
LEAST_SHARE = 0.7  # of what counts in `lacking` that is the least over all: the rest is their mean
# Columns of the result.
REACH, JOINTS, TORQUE, MARGIN, LEGS, APART, TRUNK = range(7)
COLUMNS = 7


@compiled
def lacking(row: FloatArray, wanted: FloatArray) -> float:
    """What slacks (COLUMNS,) lack of the room wanted: less is better, and it only grows with more.

    Mostly the least share of the room wanted that there is, a little their mean.
    """
    least, mean = np.inf, 0.0
    for i in range(COLUMNS):
        share = min(row[i] / wanted[i], 1.0)
        least = min(least, share)
        mean += share / COLUMNS
    return -(LEAST_SHARE * least + (1.0 - LEAST_SHARE) * mean)


@compiled
def lacking_each(rows: FloatArray, wanted: FloatArray) -> FloatArray:
    """See `lacking`, for slacks in rows (C, COLUMNS): (C,)."""
    lacks = np.empty(len(rows))
    for c in range(len(rows)):
        lacks[c] = lacking(rows[c], wanted)
    return lacks


@compiled
def slacks(
    body: FloatArray,
    feet: FloatArray,
    swing: FloatArray,
    landed: NDArray[np.intp],
    rise: float,
    run: float,
    foot_radius: float,
    legs: FloatArray,
    limits: FloatArray,
    masses: FloatArray,
    coms: FloatArray,
    trunk: FloatArray,
    shanks: FloatArray,
    widest: float,
    wanted: FloatArray,
    found: FloatArray,
    enough: FloatArray,
) -> None:
    """The least room of each candidate over its moments, (C, COLUMNS), into `found`.

    Args:
        body: (C, N, 5) x, y, z, pitch, yaw (0) of B.
        feet: (C, N, 4, 3) [m].
        swing: (N,) row of the leg in the air.
        landed: (N, 4) at which moment each foot was set down, from where it rolls.
        rise: Of the staircase [m].
        run: Of the staircase [m].
        foot_radius: [m].
        legs: (4, 8), see `leg_scalar.leg_array`.
        limits: (3, 12) least and greatest angles [rad], torques [Nm].
        masses: (13,) of the trunk, then of the links leg by leg [kg].
        coms: (13, 3) their centres, in B and in the links' frames [m].
        trunk: Least and greatest x, y, z of the trunk in B, then of each of its parts (1 + K, 2, 3)
            [m].
        shanks: (2, 4, SHANK) how far ahead of the line from knee to foot a shank's middle is at its
            points, from the knee on, and its radius there [m].
        widest: Sway to either side [m].
        wanted: (COLUMNS,) the room that is enough; no sway is added for more margin.
        found: Result; what it holds already (of other stairs) counts.
        enough: (C,) what a candidate may lack to be of interest (see `lacking`): of one that lacks
            more no further moments are looked at.
    """
    q, points = np.empty((4, 3)), np.empty((4, SHANK + THIGH, 3))
    in_body, under = np.empty((SHANK, 3)), np.zeros((UNDER, 3))
    f, tilts = np.empty((4, 3)), np.empty((body.shape[1], 4))
    forces, com = np.zeros(4), np.empty(3)
    weight, whole = masses.sum() * GRAVITY, trunk[0]
    for c in range(body.shape[0]):
        row = found[c]
        for n in range(body.shape[1]):
            for k in range(4):
                if landed[n, k] == n:
                    tilts[n, k] = tilt(legs[k], body[c, n], feet[c, n, k], q[k])
        for moment in range(body.shape[1]):
            n = moment * STRIDE % body.shape[1]
            b, air = body[c, n], int(swing[n])
            cp, sp = cos(b[3]), sin(b[3])
            for k in range(4):
                # A foot is a ball, which its shank rolls on.
                leant = tilt(legs[k], b, feet[c, n, k], q[k])
                copy_vector(f[k], feet[c, n, k])
                if k != air:
                    f[k, 0] += foot_radius * (leant - tilts[landed[n, k], k])
            centre(b, q, legs, masses, coms, cp, sp, com)
            sway, margin = best_sway(com, f, air, widest, wanted[MARGIN])
            row[MARGIN] = min(row[MARGIN], margin)
            share_weight(com[0], com[1] + sway, f, air, weight, forces)
            for k in range(4):
                reach = angles(legs[k], b, f[k], sway, cp, sp, q[k])
                row[REACH] = min(row[REACH], reach)
                for j in range(3):
                    i = 3 * k + j
                    room = min(q[k, j] - limits[0, i], limits[1, i] - q[k, j])
                    row[JOINTS] = min(row[JOINTS], room)
                used = torque_used(legs[k], q[k], forces[k], cp, sp, limits[2, 3 * k : 3 * k + 3])
                row[TORQUE] = min(row[TORQUE], 1.0 - used)
            if lacking(row, wanted) > enough[c]:
                break  # before what takes longest
            for k in range(4):
                place_points(legs[k], q[k], b, sway, cp, sp, f[k], shanks[0, k], points[k])
                row[LEGS] = leg_room(points[k], shanks[1, k], rise, run, row[LEGS])
                to_body(points[k], b, sway, cp, sp, in_body)
                row[APART] = trunk_room(in_body, shanks[1, k], trunk, row[APART])
            for k in range(2):
                row[APART] = room_apart(
                    points[k], points[2 + k], shanks[1, k], shanks[1, 2 + k], row[APART]
                )
            for i in range(UNDER):
                x, low = whole[0, 0] + i / (UNDER - 1.0) * (whole[1, 0] - whole[0, 0]), whole[0, 2]
                under[i, 0], under[i, 2] = b[0] + cp * x + sp * low, b[2] - sp * x + cp * low
            row[TRUNK] = room_under(under, rise, run, row[TRUNK])
            if lacking(row, wanted) > enough[c]:
                break
