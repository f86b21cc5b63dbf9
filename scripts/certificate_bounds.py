"""How far everything may be from where it is in the middle of a stretch of time.

For `check_certificate.py`. Lipschitz bounds throughout; numpy alone, and nothing of drake_quad.
Written apart from the prover on purpose: that one encloses derivatives and uses the mean value
theorem; here a foot is somewhere in a ball, and angles are bounded by the triangles that it makes.
"""

from types import SimpleNamespace as Bag

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

GRAVITY = 9.81  # [m/s^2]


def quintic(s: Floats) -> Floats:
    """The swing's 10 s^3 - 15 s^4 + 6 s^5."""
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


def steepest(low: Floats, high: Floats) -> Floats:
    """The greatest rate of `quintic` between two phases: 30 s^2 (1 - s)^2 peaks at 1/2."""
    s = np.clip(0.5, low, high)
    return 30.0 * (s * (1.0 - s)) ** 2


def move_body(body: Bag, task: Ints, a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Pose of the body (K, 5) in the middle of [a, b] of tasks (K,), and how far off it may be."""
    middle, half = 0.5 * (a + b), 0.5 * (b - a)[:, None]
    r = middle / body.knot[task]
    i = np.clip(np.floor(r).astype(int), 0, body.pieces[task] - 1)
    u, knot = (r - i)[:, None], body.knot[task][:, None]
    p0, p1, p2, p3 = (body.control[body.first[task] + i + j] for j in range(4))
    w0, w3, w1 = (1.0 - u) ** 3 / 6.0, u**3 / 6.0, 2.0 / 3.0 - u**2 + u**3 / 2.0
    value = w0 * p0 + w1 * p1 + (1.0 - w0 - w1 - w3) * p2 + w3 * p3
    d0, d1, d2 = (p1 - p0) / knot, (p2 - p1) / knot, (p3 - p2) / knot
    rate = 0.5 * (1.0 - u) ** 2 * d0 + (0.5 + u - u**2) * d1 + 0.5 * u**2 * d2
    bend = np.maximum(np.abs(d1 - d0), np.abs(d2 - d1)) / knot
    return value, half * (np.abs(rate) + half * bend)


def body_motion(body: Bag, task: Ints, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Pose of the body at times of tasks (K,), its rate and its acceleration (K, 5) each."""
    r = t / body.knot[task]
    i = np.clip(np.floor(r).astype(int), 0, body.pieces[task] - 1)
    u, knot = (r - i)[:, None], body.knot[task][:, None]
    p0, p1, p2, p3 = (body.control[body.first[task] + i + j] for j in range(4))
    d0, d1, d2 = (p1 - p0) / knot, (p2 - p1) / knot, (p3 - p2) / knot
    rate = 0.5 * (1.0 - u) ** 2 * d0 + (0.5 + u - u**2) * d1 + 0.5 * u**2 * d2
    acceleration = ((1.0 - u) * (d1 - d0) + u * (d2 - d1)) / knot
    return move_body(body, task, t, t)[0], rate, acceleration


def roll_at(roll: Bag, task: Ints, leg: Ints, t: Floats) -> Floats:
    """How far feet (K,) have rolled at times (K,), within which no knot divides them (K, 2)."""
    when, found = roll.start[task] + t, np.empty((len(leg), 2))
    for k in range(4):
        mine = leg == k
        for axis in range(2):
            found[mine, axis] = np.interp(when[mine], roll.when, roll.offset[:, k, axis])
    return found


def move_foot(
    phases: Bag, roll: Bag, phase: Ints, leg: Ints, a: Floats, b: Floats
) -> tuple[Floats, Floats]:
    """Where a foot is in the middle of [a, b] (K, 3), and how far from there it may be (K,).

    A foot in the air loses what it had rolled at lift-off, by a quintic, until it is back.
    """
    task = phases.task[phase]
    begin, end = (roll_at(roll, task, leg, t) for t in (a, b))
    at, away = swing_foot(phases, phase, leg, a, b)
    rolled, off = 0.5 * (begin + end), 0.5 * np.linalg.norm(end - begin, axis=1)
    k = np.flatnonzero(phases.swing[phase] == leg)
    p = phase[k]
    lifted, back = roll_at(roll, task[k], leg[k], phases.start[p]), phases.back[p]
    low, high = ((t[k] - phases.start[p]) / back for t in (a, b))
    middle = np.clip(0.5 * (low + high), 0.0, 1.0)
    rolled[k] = lifted * (1.0 - quintic(middle))[:, None]
    fastest = steepest(np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0))
    off[k] = 0.5 * (high - low) * fastest * np.linalg.norm(lifted, axis=1)
    at[:, :2] += rolled
    return at, away + off


def swing_foot(phases: Bag, phase: Ints, leg: Ints, a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The same of feet that do not roll."""
    at, away = phases.feet[phase, leg], np.zeros(len(leg))
    k = np.flatnonzero(phases.swing[phase] == leg)
    p, begin = phase[k], at[k]
    a, b = a[k] - phases.start[p], b[k] - phases.start[p]
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    lasts, apex, way = phases.lasts[p], phases.apex_time[p], phases.to[p] - begin
    at[k] = begin + way * quintic(middle / lasts)[:, None]
    along = np.hypot(way[:, 0], way[:, 1]) * steepest(a / lasts, b / lasts) / lasts
    up = middle < apex
    since, time = np.where(up, 0.0, apex), np.where(up, apex, lasts - apex)
    base = np.where(up, begin[:, 2], phases.apex_z[p])
    rise = np.where(up, phases.apex_z[p], phases.to[p, 2]) - base
    at[k, 2] = base + rise * quintic((middle - since) / time)
    lift = np.abs(rise) * steepest((a - since) / time, (b - since) / time) / time
    away[k] = half * np.hypot(along, lift)
    return at, away


def turn(axis: int, angle: Floats, v: Floats) -> Floats:
    """Vectors (K, 3) turned about x (0), y (1) or z (2)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s, turned = np.cos(angle), np.sin(angle), v.copy()
    turned[:, i], turned[:, j] = c * v[:, i] - s * v[:, j], s * v[:, i] + c * v[:, j]
    return turned


def move_leg(
    robot: Bag, leg: Ints, body: Floats, body_off: Floats, foot: Floats, foot_off: Floats
) -> Bag:
    """The leg's joints and points in the middle, and how far each may be off; nan out of reach."""
    l1, l2, d = robot.thighs[leg], robot.shanks[leg], robot.offsets[leg]
    h = robot.raised[leg]  # of the hip pitch axis over the abduction axis
    sign, hip = robot.knee_signs[leg], robot.hips[leg]
    shift, spin = np.linalg.norm(body_off[:, :3], axis=1), body_off[:, 3] + body_off[:, 4]
    w = foot - body[:, :3]
    foot_B = turn(1, -body[:, 3], turn(2, -body[:, 4], w))
    v = foot_B - hip
    ball = foot_off + shift + spin * np.linalg.norm(w, axis=1)
    # From the front: the foot at distance rho of the hip, the leg's plane at distance d.
    rho = np.hypot(v[:, 1], v[:, 2])
    least = np.where(rho - ball > np.abs(d), rho - ball, np.nan)
    stretch = least / np.sqrt(least**2 - d**2)
    z = -np.sqrt(np.where(rho > np.abs(d), rho**2 - d**2, np.nan))
    q1 = np.arctan2(v[:, 2], v[:, 1]) - np.arctan2(z, d)
    q1 -= 2.0 * np.pi * np.round(q1 / (2.0 * np.pi))
    tilt = np.arcsin(np.minimum(ball / rho, 1.0)) + ball * np.abs(d) * stretch / least**2
    # In its plane, from the hip pitch axis: a triangle of thigh, shank and the distance D.
    z = z - h
    D = np.hypot(v[:, 0], z)
    ball2 = stretch * ball
    near, far = D - ball2, D + ball2
    good = (near > np.abs(l1 - l2)) & (far < l1 + l2)
    k, k_near, k_far = (
        np.arccos(np.clip((x**2 - l1**2 - l2**2) / (2.0 * l1 * l2), -1.0, 1.0))
        for x in (D, near, far)
    )
    bend = np.where(good, np.maximum(k_near - k, k - k_far), np.nan)
    lever = np.maximum(np.abs(l1 * np.cos(k_near) + l2), np.abs(l1 * np.cos(k_far) + l2))
    q2 = np.arctan2(-v[:, 0], -z) - sign * np.arctan2(l2 * np.sin(k), l1 + l2 * np.cos(k))
    q2 -= 2.0 * np.pi * np.round(q2 / (2.0 * np.pi))
    swing = np.arcsin(np.minimum(ball2 / D, 1.0)) + bend * l2 * lever / near**2
    q = np.stack([q1, q2, sign * k], axis=1)
    off = np.stack([tilt, swing, bend], axis=1)
    zero = np.zeros(len(leg))
    plane = np.stack([zero, d, h], axis=1)
    knee_B = hip + turn(0, q1, plane + turn(1, q2, np.stack([zero, zero, -l1], axis=1)))
    knee = body[:, :3] + turn(2, body[:, 4], turn(1, body[:, 3], knee_B))
    ahead = turn(1, q2 + q[:, 2], np.tile([1.0, 0.0, 0.0], (len(leg), 1)))
    ahead = turn(2, body[:, 4], turn(1, body[:, 3], turn(0, q1, ahead)))
    knee_off = shift + spin * np.linalg.norm(knee_B, axis=1) + tilt * np.hypot(l1 + np.abs(h), d)
    knee_off += swing * l1
    return Bag(
        q=q, off=off, ball=ball, hip=hip, axle=hip + turn(0, q1, plane), foot_B=foot_B,
        knee_B=knee_B, knee=knee, knee_off=knee_off, foot=foot, foot_off=foot_off, ahead=ahead,
        ahead_off=spin + off.sum(axis=1),
    )  # fmt: skip


def masses(robot: Bag, leg: Ints, state: Bag) -> tuple[Floats, Floats]:
    """Centres of mass of hip, thigh, shank in B (K, 3, 3), and moments that turn with each joint.

    The moments (K, 3) [kg m] are upper bounds: link masses times lengths, however the leg bends.
    """
    m, c, q = robot.link_masses[leg], robot.link_coms[leg], state.q
    size = np.linalg.norm(c, axis=2)
    points = np.stack(
        [
            state.hip + turn(0, q[:, 0], c[:, 0]),
            state.axle + turn(0, q[:, 0], turn(1, q[:, 1], c[:, 1])),
            state.knee_B + turn(0, q[:, 0], turn(1, q[:, 1] + q[:, 2], c[:, 2])),
        ],
        axis=1,
    )
    at_knee = m[:, 2] * size[:, 2]
    at_hip = m[:, 1] * size[:, 1] + m[:, 2] * robot.thighs[leg] + at_knee
    out = np.hypot(robot.offsets[leg], robot.raised[leg])
    at_side = m[:, 0] * size[:, 0] + at_hip + (m[:, 1] + m[:, 2]) * out
    return points, np.stack([at_side, at_hip, at_knee], axis=1)


def torques(
    robot: Bag,
    leg: Ints,
    state: Bag,
    masses: tuple[Floats, Floats],
    body: tuple[Floats, Floats],
    load: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Torques (K, 3) that hold a leg still with a load under its foot, and how far off.

    Args:
        robot: The robot.
        leg: Number of the leg, (K,).
        state: The leg's joints and points.
        masses: What `masses` gives of the leg.
        body: Pose of the body (K, 5), and how far off it is.
        load: Force on the foot (K,) [N], and how far off it is.
    """
    (points, moments), (pose, pose_off), (force, force_off) = masses, body, load
    up = np.stack([-np.sin(pose[:, 3]), np.zeros(len(leg)), np.cos(pose[:, 3])], axis=1)
    m, zero = robot.link_masses[leg], np.zeros((len(leg), 3))
    x, y = np.eye(3)[0] + zero, np.eye(3)[1] + zero
    sideways = turn(0, state.q[:, 0], y)
    axes = (x, sideways, sideways)
    value, off = np.empty_like(zero), np.empty_like(zero)
    lean = state.off[:, 0] + pose_off[:, 3]  # of a joint's axis, and of what is up
    bends = state.off.sum(axis=1)
    shank = robot.shanks[leg] * bends
    side = np.hypot(robot.offsets[leg], robot.raised[leg]) * state.off[:, 0]
    moves = (state.ball, state.ball + side, shank)
    for j, (axis, at) in enumerate(zip(axes, (state.hip, state.axle, state.knee_B), strict=True)):
        lever = state.foot_B - at
        wrench = -force[:, None] * np.cross(lever, up)
        for k in range(j, 3):
            wrench += GRAVITY * m[:, k, None] * np.cross(points[:, k] - at, up)
        value[:, j] = np.einsum("ki,ki->k", axis, wrench)
        arm = np.linalg.norm(lever, axis=1)
        off[:, j] = GRAVITY * moments[:, j] * (bends + lean)
        off[:, j] += (force + force_off) * (moves[j] + arm * lean) + force_off * arm
    return value, off
