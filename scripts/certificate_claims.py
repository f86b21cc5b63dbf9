"""What a certificate claims, bounded over stretches of time, for `check_certificate.py`.

Of every item (a stretch, with the leg or obstacle in question) each function returns the least
that a quantity may be over what is claimed of it, what it is in the middle, what is wrong if it is
less, and whether a shank's part is to be halved next, not time. numpy alone, nothing of drake_quad.
"""

from types import SimpleNamespace as Bag

import numpy as np
from certificate_bounds import GRAVITY, masses, move_body, move_foot, move_leg, torques, turn
from certificate_course import distance
from certificate_reading import SLOPE, STANDS, require


def supports(phases):
    """Of each phase: shares of the weight from (1, com), normals and offsets of its sides."""
    n = len(phases.start)
    inverse, normal, offset = np.zeros((n, 4, 3)), np.zeros((n, 12, 2)), np.full((n, 12), -1e3)
    for k in range(n):
        mine = [leg for leg in range(4) if leg != phases.swing[k]]
        p = phases.feet[k, mine, :2]
        inverse[k, mine] = np.linalg.pinv(np.vstack([np.ones(len(p)), p.T]))
        sides = 0
        for i in range(len(p)):
            for j in range(len(p)):
                way = p[j] - p[i]
                if i == j or not np.hypot(*way) > 0.0:
                    continue
                inward = np.array([-way[1], way[0]]) / np.hypot(*way)
                if np.all((p - p[i]) @ inward >= -1e-12):
                    normal[k, sides], offset[k, sides] = inward, inward @ p[i]
                    sides += 1
        require(sides > 2, "standing feet are in a line")
    return inverse, normal, offset


def legs_of(work, items, leg):
    """Body, feet and legs of items, one leg each."""
    body, off = move_body(work.body, items.task, items.a, items.b)
    foot, foot_off = move_foot(work.phases, items.phase, leg, items.a, items.b)
    return body, off, move_leg(work.robot, leg, body, off, foot, foot_off)


def statics(work, items):
    """Margin, joint angles, torques and forces of items."""
    robot, n = work.robot, len(items.a)
    four = Bag(**{k: np.repeat(v, 4) for k, v in vars(items).items()})
    leg = np.tile(np.arange(4), n)
    body, off, state = legs_of(work, four, leg)
    points, moments = masses(robot, leg, state)
    # Centre of mass: the trunk and the links turn with the body, the links with their joints too.
    m = robot.link_masses[leg]
    first = np.einsum("kl,kli->ki", m, points).reshape(n, 4, 3).sum(axis=1)
    com_B = (first + robot.trunk_mass * robot.trunk_com) / robot.mass
    pose, spread = body[::4], off[::4]
    com = pose[:, :3] + turn(2, pose[:, 4], turn(1, pose[:, 3], com_B))
    away = np.linalg.norm(spread[:, :3], axis=1)
    away += (spread[:, 3] + spread[:, 4]) * np.linalg.norm(com_B, axis=1)
    away += (moments * state.off).sum(axis=1).reshape(n, 4).sum(axis=1) / robot.mass
    sides = np.einsum("ksi,ki->ks", work.normal[items.phase], com[:, :2])
    margin = (sides - work.offset[items.phase]).min(axis=1)
    # Forces: the witness of the cell, moved on so that it balances here.
    inverse = work.inverse[items.phase]
    shares = work.cells.shares[items.cell]
    feet = work.phases.feet[items.phase][..., :2]
    stands = work.phases.swing[items.phase][:, None] != np.arange(4)
    require(not np.any(shares[~stands]), "a foot in the air bears")
    balance = np.concatenate(
        [1.0 - shares.sum(axis=1)[:, None], com[:, :2] - np.einsum("kl,kli->ki", shares, feet)],
        axis=1,
    )
    shares = shares + np.einsum("kls,ks->kl", inverse, balance)
    moved = np.linalg.norm(inverse[..., 1:], axis=2) * away[:, None]
    weight = GRAVITY * robot.mass
    load = (weight * shares).ravel()
    torque, torque_off = torques(
        robot, leg, state, points, moments, body, off, np.abs(load), (weight * moved).ravel()
    )
    limits = [robot.efforts, robot.q_lower, robot.q_upper]
    effort, lower, upper = (v.reshape(4, 3)[leg] for v in limits)
    room = 1.0 - np.abs(torque) / effort
    angle = np.minimum(state.q - lower, upper - state.q)
    claim = work.segments.claims[items.segment]

    def each(values):
        return values.reshape(n, 12).min(axis=1)

    middle = np.stack(
        [margin - claim[:, 0], each(angle) - claim[:, 3], each(room) - claim[:, 4],
         np.where(stands, shares, 1.0).min(axis=1)], axis=1,
    )  # fmt: skip
    low = np.stack(
        [margin - away - claim[:, 0], each(angle - state.off) - claim[:, 3],
         each(room - torque_off / effort) - claim[:, 4],
         np.where(stands, shares - moved, 1.0).min(axis=1)], axis=1,
    )  # fmt: skip
    names = np.array(["the static margin is", "joint angles are", "torques are", "forces are"])
    middle = np.where(np.isnan(middle), -1.0, middle)
    return (
        low.min(axis=1),
        middle.min(axis=1),
        names[middle.argmin(axis=1)],
        np.zeros(n, dtype=bool),
    )


def feet_items(work, cuts):
    """Swing feet and the obstacles that they may be near, with the distance they are to keep."""
    phases, course, radius = work.phases, work.course, work.robot.foot_radius
    swinging = np.flatnonzero(phases.swing[cuts.phase] >= 0)
    count = len(course.face)
    rows = np.repeat(swinging, count)
    items = Bag(**{k: v[rows] for k, v in vars(cuts).items()})
    items.obstacle = np.tile(np.arange(count), len(swinging))
    leg = phases.swing[items.phase]
    ends = np.stack([phases.feet[items.phase, leg], phases.to[items.phase]])
    room = np.stack([distance(course, items.obstacle, p)[0] - radius for p in ends])
    box = ~course.face[items.obstacle]
    level = np.abs(ends[..., 2] - radius - course.top[items.obstacle]) <= STANDS
    stands_on = np.where(course.axes[items.obstacle, 2, 2] < 1.0, room <= SLOPE, level)
    own = box & stands_on.any(axis=0)
    clearance = work.segments.claims[items.segment, 1]
    keeps = np.minimum(clearance, 0.5 * room.min(axis=0))
    items.keep = np.where(own, np.minimum(room.min(axis=0), 0.0) - STANDS, keeps) + radius
    return items


def feet(work, items):
    """Distances of swing feet from obstacles."""
    leg = work.phases.swing[items.phase]
    at, off = move_foot(work.phases, items.phase, leg, items.a, items.b)
    room = distance(work.course, items.obstacle, at)[0] - items.keep
    what = np.full(len(room), "the room of a swing foot is")
    return room - off, room, what, np.zeros(len(room), dtype=bool)


def shank_items(work, cuts):
    """All parts of shanks and the boxes that they are near over a stretch of time."""
    robot, boxes = work.robot, np.flatnonzero(~work.course.face)
    parts = len(robot.shank_places) - 1
    rows = np.repeat(np.arange(len(cuts.a)), 4 * len(boxes))
    items = Bag(**{k: v[rows] for k, v in vars(cuts).items()})
    items.leg = np.tile(np.repeat(np.arange(4), len(boxes)), len(cuts.a))
    items.box = np.tile(boxes, 4 * len(cuts.a))
    one = Bag(**{k: np.repeat(v, 4) for k, v in vars(cuts).items()})
    _, _, state = legs_of(work, one, np.tile(np.arange(4), len(cuts.a)))
    at, span = 0.5 * (state.knee + state.foot), np.linalg.norm(state.knee - state.foot, axis=1)
    thick = (np.abs(robot.shank_ahead) + robot.shank_radii).max()
    reach = 0.5 * span + np.maximum(state.knee_off, state.foot_off) + thick
    owner = np.repeat(np.arange(len(at)), len(boxes))
    room = distance(work.course, items.box, at[owner])[0] - reach[owner]
    near = np.flatnonzero(~(room >= work.segments.claims[items.segment, 2]))
    items = Bag(**{k: np.repeat(v[near], parts) for k, v in vars(items).items()})
    items.part = np.tile(np.arange(parts), len(near))
    items.s0, items.s1 = np.zeros(len(items.a)), np.ones(len(items.a))
    return items


def shanks(work, items):
    """Distances of parts of shanks from boxes."""
    robot = work.robot
    _, _, state = legs_of(work, items, items.leg)
    line, off = [], 0.0
    for s in (items.s0, items.s1):
        place, ahead = (
            (1.0 - s) * v[items.part] + s * v[items.part + 1]
            if v.ndim == 1
            else (1.0 - s) * v[items.leg, items.part] + s * v[items.leg, items.part + 1]
            for v in (robot.shank_places, robot.shank_ahead)
        )
        line.append(
            (1.0 - place)[:, None] * state.knee
            + place[:, None] * state.foot
            + ahead[:, None] * state.ahead
        )
        moved = (
            (1.0 - place) * state.knee_off
            + place * state.foot_off
            + np.abs(ahead) * state.ahead_off
        )
        off = np.maximum(off, moved)
    thick = np.maximum(
        robot.shank_radii[items.leg, items.part], robot.shank_radii[items.leg, items.part + 1]
    )
    half = 0.5 * np.linalg.norm(line[1] - line[0], axis=1)
    room = distance(work.course, items.box, 0.5 * (line[0] + line[1]))[0]
    room = room - thick - work.segments.claims[items.segment, 2]
    what = np.full(len(room), "the room of a shank is")
    return room - off - half, np.where(np.isnan(room), -1.0, room), what, half > off
