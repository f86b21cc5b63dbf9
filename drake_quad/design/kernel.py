"""The arithmetic of `evaluate`, pose by pose: a search looks at tens of thousands of them."""

from math import acos, atan2, cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from drake_quad.compiled import compiled
from drake_quad.design.kernel_distance import (
    SHANK,
    THIGH,
    apart,
    from_stairs,
    line_from_stairs,
    to_body,
)
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.box_distance import from_box, line_from_box
from drake_quad.robot.shank_outline import ROOM_WORTH, SHANK_POINTS

SWAYS = 9  # that are tried, evenly from side to side
UNDER = 7  # points under the trunk that are looked at
GRAVITY = 9.81
LEAST_AREA = 1e-9
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
        legs: (4, 7) hip x, y, z, offset, thigh, shank, knee sign.
        limits: (3, 12) least and greatest angles [rad], torques [Nm].
        masses: (13,) of the trunk, then of the links leg by leg [kg].
        coms: (13, 3) their centres, in B and in the links' frames [m].
        trunk: (2, 3) least and greatest x, y, z of the trunk in B [m].
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
    weight = masses.sum() * GRAVITY
    for c in range(body.shape[0]):
        row = found[c]
        for n in range(body.shape[1]):
            for k in range(4):
                if landed[n, k] == n:
                    tilts[n, k] = _tilt(legs[k], body[c, n], feet[c, n, k], q[k])
        for i in range(body.shape[1]):
            if lacking(row, wanted) > enough[c]:
                break
            n = i * STRIDE % body.shape[1]
            b, air = body[c, n], int(swing[n])
            cp, sp = cos(b[3]), sin(b[3])
            for k in range(4):
                # A foot is a ball, which its shank rolls on.
                tilt = _tilt(legs[k], b, feet[c, n, k], q[k])
                f[k, :] = feet[c, n, k]
                if k != air:
                    f[k, 0] += foot_radius * (tilt - tilts[landed[n, k], k])
            _centre(b, q, legs, masses, coms, cp, sp, com)
            sway, margin = _sway(com, f, air, widest, wanted[MARGIN])
            row[MARGIN] = min(row[MARGIN], margin)
            _share(com[0], com[1] + sway, f, air, weight, forces)
            for k in range(4):
                reach = _angles(legs[k], b, f[k], sway, cp, sp, q[k])
                row[REACH] = min(row[REACH], reach)
                for j in range(3):
                    i = 3 * k + j
                    room = min(q[k, j] - limits[0, i], limits[1, i] - q[k, j])
                    row[JOINTS] = min(row[JOINTS], room)
                used = _torques(legs[k], q[k], forces[k], cp, sp, limits[2, 3 * k : 3 * k + 3])
                row[TORQUE] = min(row[TORQUE], 1.0 - used)
                _points(legs[k], q[k], b, sway, cp, sp, f[k], shanks[0, k], points[k])
                to_body(points[k], b, sway, cp, sp, in_body)
                for i in range(SHANK):
                    p, radius = points[k, i], shanks[1, k, i]
                    room = from_stairs(p[0], p[2], rise, run) - radius
                    thick = min(radius, shanks[1, k, max(i - 1, 0)])
                    if i > 0:
                        room = min(room, line_from_stairs(points[k, i - 1], p, rise, run) - thick)
                    row[LEGS] = min(row[LEGS], room * ROOM_WORTH[i])
                    room = from_box(in_body[i], trunk[0], trunk[1]) - radius
                    if i > 0:
                        line = line_from_box(
                            in_body[i - 1], in_body[i], trunk[0], trunk[1], row[APART] + thick
                        )
                        room = min(room, line - thick)
                    row[APART] = min(row[APART], room)
            for i in range(2):
                room = apart(points[i], points[2 + i], shanks[1, i], shanks[1, 2 + i])
                row[APART] = min(row[APART], room)
            for i in range(UNDER):
                x, low = trunk[0, 0] + i / (UNDER - 1.0) * (trunk[1, 0] - trunk[0, 0]), trunk[0, 2]
                under[i, 0], under[i, 2] = b[0] + cp * x + sp * low, b[2] - sp * x + cp * low
                row[TRUNK] = min(row[TRUNK], from_stairs(under[i, 0], under[i, 2], rise, run))
                if i > 0:
                    line = line_from_stairs(under[i - 1], under[i], rise, run)
                    row[TRUNK] = min(row[TRUNK], line)


@compiled
def _tilt(leg: FloatArray, b: FloatArray, foot: FloatArray, q: FloatArray) -> float:
    """How far a shank leans ahead [rad], the body not swaying; writes its leg's angles."""
    _angles(leg, b, foot, 0.0, cos(b[3]), sin(b[3]), q)
    return b[3] + q[1] + q[2]


@compiled
def _angles(
    leg: FloatArray, b: FloatArray, foot: FloatArray, sway: float, cp: float, sp: float,
    q: FloatArray,
) -> float:  # fmt: skip
    """Writes a leg's angles; returns by how much it is short of its reach's ends [m]."""
    dx, dz = foot[0] - b[0], foot[2] - b[2]
    x = cp * dx - sp * dz - leg[0]
    y = foot[1] - b[1] - sway - leg[1]
    z = sp * dx + cp * dz - leg[2]
    d, l1, l2 = leg[3], leg[4], leg[5]
    across = y * y + z * z - d * d
    down = -sqrt(max(across, 1e-12))
    a = atan2(z, y) - atan2(down, d)
    q[0] = (a + pi) % (2.0 * pi) - pi
    distance = sqrt(x * x + down * down)
    room = min(l1 + l2 - distance, distance - abs(l1 - l2))
    reach = min(max(distance, abs(l1 - l2) + 1e-6), l1 + l2 - 1e-6)
    bend = (reach * reach - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    q[2] = leg[6] * acos(min(max(bend, -1.0), 1.0))
    q[1] = atan2(-x, -down) - atan2(l2 * sin(q[2]), l1 + l2 * cos(q[2]))
    return room if across > 0.0 else min(room, -sqrt(-across))


@compiled
def _centre(
    b: FloatArray, q: FloatArray, legs: FloatArray, masses: FloatArray, coms: FloatArray,
    cp: float, sp: float, com: FloatArray,
) -> None:  # fmt: skip
    """Writes the whole robot's centre of mass in W (3,) [m]."""
    total, mx, my, mz = masses[0], masses[0] * coms[0, 0], masses[0] * coms[0, 1], 0.0
    mz = masses[0] * coms[0, 2]
    for k in range(4):
        leg = legs[k]
        ca, sa = cos(q[k, 0]), sin(q[k, 0])
        for j in range(3):
            m, p = masses[1 + 3 * k + j], coms[1 + 3 * k + j]
            if j == 0:
                x, y, z = p[0], p[1], p[2]
            else:
                angle = q[k, 1] + (q[k, 2] if j == 2 else 0.0)
                c, s = cos(angle), sin(angle)
                x, y, z = c * p[0] + s * p[2], leg[3] + p[1], -s * p[0] + c * p[2]
                if j == 2:
                    x -= leg[4] * sin(q[k, 1])
                    z -= leg[4] * cos(q[k, 1])
            mx += m * (leg[0] + x)
            my += m * (leg[1] + ca * y - sa * z)
            mz += m * (leg[2] + sa * y + ca * z)
            total += m
    mx, my, mz = mx / total, my / total, mz / total
    com[0], com[1], com[2] = b[0] + cp * mx + sp * mz, b[1] + my, b[2] - sp * mx + cp * mz


@compiled
def _sway(
    com: FloatArray, feet: FloatArray, air: int, widest: float, wanted: float
) -> tuple[float, float]:
    """The least sway that gives the margin wanted, or that of the best margin; and the margin."""
    best, best_value, best_margin = 0.0, -np.inf, -np.inf
    for i in range(SWAYS):
        share = -1.0 + 2.0 * i / (SWAYS - 1)
        margin = _margin(com[0], com[1] + share * widest, feet, air)
        value = min(margin, wanted) - 1e-3 * abs(share)
        if value > best_value:
            best, best_value, best_margin = share * widest, value, margin
    return best, best_margin


@compiled
def _margin(x: float, y: float, feet: FloatArray, air: int) -> float:
    """Distance of a point from the sides of three feet's triangle, inside positive [m]."""
    least = np.inf
    for k in range(4):
        if k == air:
            continue
        # The side between the other two, and which way is in.
        i, j = -1, -1
        for m in range(4):
            if m != air and m != k:
                if i < 0:
                    i = m
                else:
                    j = m
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        length = max(sqrt(ex * ex + ey * ey), 1e-9)
        inward = ex * (feet[k, 1] - feet[i, 1]) - ey * (feet[k, 0] - feet[i, 0])
        here = (ex * (y - feet[i, 1]) - ey * (x - feet[i, 0])) / length
        least = min(least, here if inward > 0.0 else -here)
    return least


@compiled
def _share(
    x: float, y: float, feet: FloatArray, air: int, weight: float, forces: FloatArray
) -> None:
    """Writes the vertical forces (4,) of three feet that carry the weight at x, y [N]."""
    for k in range(4):
        forces[k] = 0.0
        if k == air:
            continue
        i, j = -1, -1
        for m in range(4):
            if m != air and m != k:
                if i < 0:
                    i = m
                else:
                    j = m
        ax, ay = feet[i, 0] - x, feet[i, 1] - y
        bx, by = feet[j, 0] - x, feet[j, 1] - y
        cx, cy = feet[k, 0] - feet[i, 0], feet[k, 1] - feet[i, 1]
        ex, ey = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
        whole = ex * cy - ey * cx
        area = ax * by - ay * bx
        forces[k] = weight * area / (whole if abs(whole) > LEAST_AREA else LEAST_AREA)


@compiled
def _torques(
    leg: FloatArray, q: FloatArray, force: float, cp: float, sp: float, effort: FloatArray
) -> float:
    """The greatest share of its limit that a joint needs for a vertical force at the foot."""
    sa, ca = sin(q[0]), cos(q[0])
    both = q[1] + q[2]
    xk, zk = -leg[5] * sin(both), -leg[5] * cos(both)
    x, z = -leg[4] * sin(q[1]) + xk, -leg[4] * cos(q[1]) + zk
    y_up = ca * leg[3] - sa * z
    fx, fz = sp * force, -cp * force  # what the foot pushes down with, in B
    t0 = y_up * fz
    t1 = z * fx - ca * x * fz
    t2 = zk * fx - ca * xk * fz
    return max(abs(t0) / effort[0], max(abs(t1) / effort[1], abs(t2) / effort[2]))


@compiled
def _points(
    leg: FloatArray, q: FloatArray, b: FloatArray, sway: float, cp: float, sp: float,
    foot: FloatArray, offsets: FloatArray, points: FloatArray,
) -> None:  # fmt: skip
    """Writes points of the shank from the knee on, then of the thigh, in W (SHANK + THIGH, 3)."""
    sa, ca = sin(q[0]), cos(q[0])
    x, z = -leg[4] * sin(q[1]), -leg[4] * cos(q[1])
    knee, hip = np.empty(3), np.empty(3)
    for part in range(2):
        px, pz = (x, z) if part == 0 else (0.0, 0.0)
        bx = leg[0] + px
        by = leg[1] + ca * leg[3] - sa * pz
        bz = leg[2] + sa * leg[3] + ca * pz
        into = knee if part == 0 else hip
        into[0], into[1] = b[0] + cp * bx + sp * bz, b[1] + sway + by
        into[2] = b[2] - sp * bx + cp * bz
    c, s = cos(q[1] + q[2]), sin(q[1] + q[2])
    ax, ay, az = cp * c - sp * ca * s, sa * s, -sp * c - cp * ca * s  # the shank's x in W
    for i in range(SHANK):
        for j in range(3):
            points[i, j] = knee[j] + SHANK_POINTS[i] * (foot[j] - knee[j])
        points[i, 0] += offsets[i] * ax
        points[i, 1] += offsets[i] * ay
        points[i, 2] += offsets[i] * az
    for i in range(THIGH):
        share = (i + 1.0) / (THIGH + 1.0)
        for j in range(3):
            points[SHANK + i, j] = knee[j] + share * (hip[j] - knee[j])
