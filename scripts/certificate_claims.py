"""What a certificate claims, bounded over stretches of time, for `check_certificate.py`.

Of every item (a stretch, with the leg or obstacle in question) each function returns the least
that a quantity may be over what is claimed of it, what it is in the middle, what is wrong if it is
less, and whether a shank's part is to be halved next, not time. numpy alone, nothing of drake_quad.
"""

from types import SimpleNamespace as Bag

import numpy as np
from certificate_bounds import (
    GRAVITY,
    masses,
    move_body,
    move_foot,
    move_leg,
    roll_at,
    torques,
    turn,
)
from certificate_course import distance
from certificate_reading import SAME, SLOPE, STANDS, require
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]
Bound = tuple[Floats, Floats, NDArray[np.str_], Bools]

ROLLS = 1e-3  # [m] to which feet roll as their shanks turn


def supports(feet: Floats, stands: Bools) -> tuple[Floats, Floats, Floats, Floats]:
    """What feet (N, 4, 2), of which some stand, make of a centre of mass, with them as they are.

    Returns what turns (1, com) about `middle` into shares of the weight, `middle`, and normals and
    offsets of the polygon's sides.
    """
    middle = np.einsum("nk,nki->ni", stands / stands.sum(axis=1)[:, None], feet)
    p = (feet - middle[:, None]) * stands[..., None]
    balance = np.stack([stands.astype(float), p[..., 0], p[..., 1]], axis=1)
    square = balance @ np.swapaxes(balance, 1, 2)
    require(np.all(np.linalg.det(square) > 1e-9), "standing feet are in a line")
    inverse = np.swapaxes(np.linalg.inv(square) @ balance, 1, 2)
    normal, offset = np.zeros((len(feet), 12, 2)), np.full((len(feet), 12), -1e3)
    pairs = [(i, j) for i in range(4) for j in range(4) if i != j]
    for side, (i, j) in enumerate(pairs):
        way = feet[:, j] - feet[:, i]
        inward = np.stack([-way[:, 1], way[:, 0]], axis=1) / np.hypot(*way.T)[:, None]
        left = np.einsum("nki,ni->nk", feet - feet[:, i, None], inward)
        is_side = stands[:, i] & stands[:, j] & np.all((left >= -1e-12) | ~stands, axis=1)
        normal[is_side, side] = inward[is_side]
        offset[is_side, side] = np.einsum("ni,ni->n", inward, feet[:, i])[is_side]
    require(np.all((offset > -1e3).sum(axis=1) > 2), "standing feet are in a line")
    return inverse, middle, normal, offset


def legs_of(work: Bag, items: Bag, leg: Ints) -> tuple[Floats, Floats, Bag]:
    """Body, feet and legs of items, one leg each."""
    body, off = move_body(work.body, items.task, items.a, items.b)
    foot, foot_off = move_foot(work.phases, work.roll, items.phase, leg, items.a, items.b)
    return body, off, move_leg(work.robot, leg, body, off, foot, foot_off)


def statics(work: Bag, items: Bag) -> Bound:
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
    # Feet that stand roll a little; the polygon's reach in any direction changes by no more.
    feet = state.foot.reshape(n, 4, 3)[..., :2]
    stands = work.phases.swing[items.phase][:, None] != np.arange(4)
    rolls = np.where(stands, state.foot_off.reshape(n, 4), 0.0).max(axis=1)
    inverse, centre, normal, offset = supports(feet, stands)
    margin = (np.einsum("ksi,ki->ks", normal, com[:, :2]) - offset).min(axis=1)
    # Forces: the witness of the cell, moved on so that it balances here.
    shares = work.cells.shares[items.cell]
    require(not np.any(shares[~stands]), "a foot in the air bears")
    missing = 1.0 - shares.sum(axis=1)[:, None]
    lever = com[:, :2] - centre - np.einsum("kl,kli->ki", shares, feet - centre[:, None])
    shares = shares + np.einsum("kls,ks->kl", inverse, np.concatenate([missing, lever], axis=1))
    size = np.linalg.norm(inverse, axis=2)
    kept = 1.0 - rolls * size.sum(axis=1)
    moment = (away + rolls * np.abs(shares).sum(axis=1)) / np.where(kept > 0.0, kept, np.nan)
    moved = size * moment[:, None]
    weight = GRAVITY * robot.mass
    load = (weight * shares).ravel()
    torque, torque_off = torques(
        robot, leg, state, (points, moments), (body, off), (np.abs(load), (weight * moved).ravel())
    )
    limits = [robot.efforts, robot.q_lower, robot.q_upper]
    effort, lower, upper = (v.reshape(4, 3)[leg] for v in limits)
    room = 1.0 - np.abs(torque) / effort
    angle = np.minimum(state.q - lower, upper - state.q)
    claim = work.segments.claims[items.segment]

    def each(values: Floats) -> Floats:
        return values.reshape(n, 12).min(axis=1)

    middle = np.stack(
        [margin - claim[:, 0], each(angle) - claim[:, 3], each(room) - claim[:, 4],
         np.where(stands, shares, 1.0).min(axis=1)], axis=1,
    )  # fmt: skip
    low = np.stack(
        [margin - away - rolls - claim[:, 0], each(angle - state.off) - claim[:, 3],
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


def feet_items(work: Bag, cuts: Bag) -> Bag:
    """Swing feet and the obstacles that they may be near, with the distance they are to keep."""
    phases, course, radius = work.phases, work.course, work.robot.foot_radius
    swinging = np.flatnonzero(phases.swing[cuts.phase] >= 0)
    count = len(course.face)
    rows = np.repeat(swinging, count)
    items = Bag(**{k: v[rows] for k, v in vars(cuts).items()})
    items.obstacle = np.tile(np.arange(count), len(swinging))
    leg = phases.swing[items.phase]
    begin = phases.feet[items.phase, leg].copy()
    task, start = phases.task[items.phase], phases.start[items.phase]
    begin[:, :2] += roll_at(work.roll, task, leg, start)
    ends = np.stack([begin, phases.to[items.phase]])
    room = np.stack([distance(course, items.obstacle, p)[0] - radius for p in ends])
    box = ~course.face[items.obstacle]
    level = np.abs(ends[..., 2] - radius - course.top[items.obstacle]) <= STANDS
    stands_on = np.where(course.axes[items.obstacle, 2, 2] < 1.0, room <= SLOPE, level)
    own = box & stands_on.any(axis=0)
    clearance = work.segments.claims[items.segment, 1]
    keeps = np.minimum(clearance, 0.5 * room.min(axis=0))
    items.keep = np.where(own, np.minimum(room.min(axis=0), 0.0) - STANDS, keeps) + radius
    return items


def feet(work: Bag, items: Bag) -> Bound:
    """Distances of swing feet from obstacles."""
    leg = work.phases.swing[items.phase]
    at, off = move_foot(work.phases, work.roll, items.phase, leg, items.a, items.b)
    room = distance(work.course, items.obstacle, at)[0] - items.keep
    what = np.full(len(room), "the room of a swing foot is")
    return room - off, room, what, np.zeros(len(room), dtype=bool)


def shank_items(work: Bag, cuts: Bag) -> Bag:
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


def shanks(work: Bag, items: Bag) -> Bound:
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


def rolling(work: Bag) -> None:
    """Refuses feet that do not roll as their shanks turn, to ROLLS, from touchdown to lift-off.

    A ball of radius r goes by r (w x z) while its shank turns by w = 1/2 sum (e x de) over the axes
    e of its frame: u from foot to knee, what is ahead of the shank, and across.
    """
    roll, radius = work.roll, work.robot.foot_radius
    for k, t in enumerate(roll.times):
        mine = np.flatnonzero(work.phases.task == k)
        start = work.phases.start[mine]
        # A knot at a switch belongs to what follows it; the last one to what it ends.
        phase = mine[np.clip(np.searchsorted(start, t + SAME, side="right") - 1, 0, None)]
        four = Bag(task=np.full(4 * len(t), k), phase=np.repeat(phase, 4), a=np.repeat(t, 4))
        four.b = four.a
        _, _, state = legs_of(work, four, np.tile(np.arange(4), len(t)))
        u = (state.knee - state.foot).reshape(-1, 4, 3) / work.robot.shanks[:, None]
        ahead = state.ahead.reshape(-1, 4, 3)
        axes = np.stack([ahead, np.cross(u, ahead), u])
        turned = 0.5 * np.cross(axes[:, :-1], np.diff(axes, axis=1)).sum(axis=0)
        goes = radius * np.cross(turned, [0.0, 0.0, 1.0])[..., :2]
        first = np.searchsorted(roll.when, roll.start[k] - SAME)
        off = np.diff(roll.offset[first : first + len(t)], axis=0) - goes
        for leg in range(4):
            total, stands = np.zeros(2), work.phases.swing[phase] != leg
            for i in range(len(t) - 1):
                total = total + off[i, leg] if stands[i] else np.zeros(2)
                require(np.abs(total).max() <= ROLLS, "a foot does not roll as its shank turns")
