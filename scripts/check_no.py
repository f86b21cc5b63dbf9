"""Checks a proof that a robot cannot climb given stairs, from nothing but the file's own numbers.

    python check_no.py proof.json [--robot robot.urdf]

Needs numpy alone, and nothing of drake_quad. Exit status 0: the claim follows; 1: it does not, or
that cannot be shown; 2: the file cannot be read. With --robot its numbers are compared with a
URDF as Drake's parser reads it. docs/infeasibility.md says what is claimed, of which motions, and
why.
"""

import argparse
import hashlib
import json
import sys
from itertools import product
from pathlib import Path
from types import SimpleNamespace as Bag
from typing import Any

import numpy as np
from certificate_reading import RefusedError, numbers, read_record, require
from numpy.typing import NDArray

Record = dict[str, Any]
Floats = NDArray[np.float64]

CERTAIN = 5e-10  # [m] by which a condition must be violated: far more than rounding
ROOT = 1e-12  # [m^2] added under a root, which near full stretch makes much of rounding
MOST = 2_000_000  # boxes that are looked at before giving up
SHAPES = dict(hips=(4, 3), offsets=(4,), raised=(4,), thighs=(4,), shanks=(4,), q_lower=(12,),
              q_upper=(12,), trunk_mass=(), trunk_com=(3,), link_masses=(4, 3), link_coms=(4, 3, 3),
              foot_radius=(), trunk_box=(2, 3))  # fmt: skip
QUARTER = 0.5 * np.pi
# What is beyond these is no robot, and CERTAIN would be less than the rounding of its numbers.
LONGEST, HEAVIEST, TURNED = 100.0, 1e6, 100.0  # [m], [kg], [rad]
POINTS = 13  # under the trunk, from its rear end to its front


class Span:
    """Intervals [lo, hi], arrays of them at a time."""

    def __init__(self, lo: Any, hi: Any = None) -> None:
        self.lo = np.asarray(lo, dtype=float)
        self.hi = self.lo if hi is None else np.asarray(hi, dtype=float)

    def __add__(self, other: "Span") -> "Span":
        return Span(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: "Span") -> "Span":
        return Span(self.lo - other.hi, self.hi - other.lo)

    def __mul__(self, other: "Span") -> "Span":
        ends = [a * b for a, b in product((self.lo, self.hi), (other.lo, other.hi))]
        return Span(np.minimum.reduce(ends), np.maximum.reduce(ends))

    def nearest_zero(self) -> Floats:
        """The smallest magnitude in each interval."""
        return np.maximum(np.maximum(self.lo, -self.hi), 0.0)

    def largest(self) -> Floats:
        """The largest magnitude in each interval."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))


def check(record: Record) -> None:
    """Refuses a proof (with `RefusedError`) unless its claim follows from its robot and stairs."""
    content = {k: v for k, v in record.items() if k != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    own = hashlib.sha256(text.encode()).hexdigest()
    require(record.get("sha256") == own, "the content is not what was hashed")
    check_content(record)


def check_content(record: Record) -> None:
    """The same but for the hash."""
    require(record["format"] == "drake_quad proof of infeasibility", "the format")
    require(record["version"] == 1, "the version")
    require(record["claim"] == "no statically stable climb of the class exists", "the claim")
    robot, climb = read_robot(record["robot"]), read_climb(record["climb"])
    boundary = whole(record["boundary"], "boundary")
    require(0 <= boundary < climb.count, "there is no such boundary")
    refuted = set()
    for moment in record["moments"]:
        above, mover = moment["above"], whole(moment["mover"], "mover")
        require(len(above) == 4 and all(a is True or a is False for a in above), "sides of feet")
        require(0 <= mover < 4, "a foot moves")
        require(any(above) and not all(above), "feet on both sides of the boundary")
        check_tree(robot, climb, boundary, above, mover, moment["tree"])
        refuted.add((tuple(above), mover))
    require(not connected(refuted), "a way from the floor to the landing is left")


def whole(value: Any, what: str) -> int:
    """A whole number, which true and false are not."""
    require(type(value) is int, f"{what} is a whole number")
    return int(value)


def read_climb(values: Record) -> Bag:
    """The flight and the ranges of the trunk's angles."""
    require(set(values) == {"rise", "run", "count", "pitch", "roll", "yaw"}, "what is claimed")
    names = ("rise", "run", "pitch", "roll", "yaw")
    climb = Bag(**{k: float(numbers(values[k])) for k in names})
    climb.count = whole(values["count"], "count")
    require(climb.rise > 0.0 and climb.run > 0.0 and 1 <= climb.count <= 1000, "there are stairs")
    require(max(climb.rise, climb.run) <= LONGEST, "steps that stairs have")
    angles = (climb.pitch, climb.roll, climb.yaw)
    require(all(0.0 <= a <= 1.5 for a in angles), "angles are within a quarter turn")
    return climb


def read_robot(values: Record) -> Bag:
    """Bounds on a robot from its numbers, each of which has to make sense."""
    r = Bag(**{k: numbers(values[k], *shape) for k, shape in SHAPES.items()})
    masses = np.append(r.link_masses, r.trunk_mass)
    require(masses.min() >= 0.0 and masses.sum() > 0.0, "masses")
    require(min(r.thighs.min(), r.shanks.min(), r.foot_radius) > 0.0, "lengths are positive")
    lengths = (r.hips, r.offsets, r.raised, r.thighs, r.shanks, r.trunk_com, r.link_coms,
               r.foot_radius, r.trunk_box)  # fmt: skip
    require(max(np.abs(v).max() for v in lengths) <= LONGEST, "lengths that a robot has")
    require(masses.max() <= HEAVIEST, "masses that a robot has")
    angles = np.abs(np.append(r.q_lower, r.q_upper))
    require(angles.max() <= TURNED, "angles that a joint has")
    lower, upper = r.q_lower.reshape(4, 3), r.q_upper.reshape(4, 3)
    require(np.all(lower <= upper), "limits are in order")
    require(np.all(r.trunk_box[0] <= r.trunk_box[1]), "the trunk's box is in order")
    found = Bag(hips=r.hips, radius=float(r.foot_radius), reach=[], up=[])
    moment = Span(r.trunk_mass * r.trunk_com)
    for k in range(4):
        (a0, h0, k0), (a1, h1, k1) = lower[k], upper[k]
        # The foot's distance from the hip pitch axis grows with the cosine of the knee.
        straight = wave(1.0, 0.0, k0, k1).hi
        legs = r.thighs[k] ** 2 + r.shanks[k] ** 2 + 2.0 * r.thighs[k] * r.shanks[k] * straight
        far = np.sqrt(max(legs, 0.0)) + abs(r.raised[k])
        found.reach.append(float(np.hypot(far, r.offsets[k])))
        turned = max(abs(a0), abs(a1)) > QUARTER
        up = found.reach[-1] if turned else wave(0.0, r.offsets[k], a0, a1).hi
        found.up.append(float(up))
        moment = moment + leg_moment(r, k, (a0, a1), (h0, h1), (h0 + k0, h1 + k1))
    found.com = Span(moment.lo / masses.sum(), moment.hi / masses.sum())
    ahead = np.linspace(r.trunk_box[0, 0], r.trunk_box[1, 0], POINTS)
    found.under = [np.array([x, 0.0, r.trunk_box[0, 2]]) for x in ahead]
    return found


def leg_moment(
    r: Bag, k: int, hip: tuple[float, float], pitch: tuple[float, float], shank: tuple[float, float]
) -> Span:
    """Range of mass times centre, in B, of a leg whose three links turn within these angles."""
    m, c, d = r.link_masses[k], r.link_coms[k], r.offsets[k]
    # Of the leg's plane: thigh about the hip pitch axis, the knee's mass, shank about the knee.
    along, down = m[1] * c[1, 0], m[1] * c[1, 2] - m[2] * r.thighs[k]
    ahead, below = m[2] * c[2, 0], m[2] * c[2, 2]
    x = Span(m[0] * c[0, 0]) + wave(along, down, *pitch) + wave(ahead, below, *shank)
    z = wave(down, -along, *pitch) + wave(below, -ahead, *shank)
    z = z + Span(m[0] * c[0, 2] + (m[1] + m[2]) * r.raised[k])
    y = m[0] * c[0, 1] + m[1] * (d + c[1, 1]) + m[2] * (d + c[2, 1])
    sides = [(wave(y, -each, *hip), wave(each, y, *hip)) for each in (z.lo, z.hi)]
    low = [x.lo, min(s[0].lo for s in sides), min(s[1].lo for s in sides)]
    high = [x.hi, max(s[0].hi for s in sides), max(s[1].hi for s in sides)]
    whole_leg = m.sum() * r.hips[k]
    return Span(whole_leg + np.array(low), whole_leg + np.array(high))


def wave(c: Any, s: Any, first: float, last: float) -> Span:
    """Range of c cos t + s sin t: its values at the ends, and where its slope is zero between."""
    peak = np.arctan2(s, c)
    turns = np.arange(np.ceil((first - peak) / np.pi), np.floor((last - peak) / np.pi) + 1.0)
    t = np.concatenate([[first, last], peak + turns * np.pi])
    values = c * np.cos(t) + s * np.sin(t)
    return Span(values.min(), values.max())


def check_tree(
    robot: Bag, climb: Bag, boundary: int, above: list[bool], mover: int, tree: list[str]
) -> None:
    """Refuses a tree unless its boxes cover all poses of a moment and all are closed."""
    # All hips are within `far` of B's origin or their feet, on both sides of the boundary's edge.
    far = max(robot.reach) + np.sqrt((robot.hips**2).sum(axis=1)).max() + 1e-3
    edge, floor = boundary * climb.run, boundary * climb.rise + robot.radius
    lo = np.array([[edge - far, floor + climb.rise - far, -climb.pitch]])
    hi = np.array([[edge + far, floor + far, climb.pitch]])
    if not tree:
        require(lo[0, 1] > hi[0, 1], "a tree without boxes")
        return
    looked = 0
    for level in tree:
        require(isinstance(level, str) and len(level) == len(lo) > 0, "boxes are missing")
        looked += len(level)
        require(looked <= MOST, "there are too many boxes")
        letters = np.array(list(level))
        kinds, violated = "abcdst", violations(robot, climb, boundary, above, mover, lo, hi)
        halved = np.isin(letters, list("xzp"))
        closed = np.zeros(len(letters), dtype=bool)
        for kind, holds in zip(kinds, violated, strict=True):
            closed |= (letters == kind) & holds
        require(np.all(halved | closed), "a box is not closed by the reason that is given")
        axis = np.array(["xzp".index(letter) for letter in letters[halved]], dtype=int)
        lo, hi = lo[halved], hi[halved]
        rows, middle = np.arange(len(lo)), 0.5 * (lo + hi)
        low_end, high_start = hi.copy(), lo.copy()
        low_end[rows, axis] = middle[rows, axis]
        high_start[rows, axis] = middle[rows, axis]
        lo, hi = np.concatenate([lo, high_start]), np.concatenate([low_end, hi])
    require(len(lo) == 0, "boxes are left open")


def violations(
    robot: Bag, climb: Bag, boundary: int, above: list[bool], mover: int, lo: Floats, hi: Floats
) -> list[NDArray[np.bool_]]:
    """For each box whether each foot, support and trunk rule out all of its poses."""
    x, z = Span(lo[:, 0], hi[:, 0]), Span(lo[:, 1], hi[:, 1])
    rotation = rotations(climb, lo[:, 2], hi[:, 2])
    found, first, last = [], [], []
    for leg in range(4):
        p = Span(robot.hips[leg])
        hip = x + dot(rotation[0], p), z + dot(rotation[2], p)
        start, end = places(robot, climb, boundary, leg, above[leg], hip, rotation)
        found.append(start > end)
        if leg != mover:
            first.append(start)
            last.append(end)
    com = x + dot(rotation[0], robot.com)
    ahead = com.lo > np.maximum.reduce(last) + CERTAIN
    found.append(ahead | (com.hi < np.minimum.reduce(first) - CERTAIN))
    inside = np.zeros(len(lo), dtype=bool)
    for point in robot.under:
        at = x + dot(rotation[0], Span(point))
        highest = z + dot(rotation[2], Span(point))
        # The ground under the interval's rear end, which no ground ahead is lower than.
        risers = sum((at.lo - CERTAIN >= k * climb.run).astype(float) for k in range(climb.count))
        inside |= highest.hi < climb.rise * risers - CERTAIN
    found.append(inside)
    return found


def rotations(climb: Bag, first: Floats, last: Floats) -> list[list[Span]]:
    """The matrix Rz(yaw) Ry(pitch) Rx(roll) over boxes of pitch, roll and yaw."""
    cp = Span(np.minimum(np.cos(first), np.cos(last)), np.cos(Span(first, last).nearest_zero()))
    sp = Span(np.sin(first), np.sin(last))
    cr, sr = Span(np.cos(climb.roll), 1.0), Span(-np.sin(climb.roll), np.sin(climb.roll))
    cy, sy = Span(np.cos(climb.yaw), 1.0), Span(-np.sin(climb.yaw), np.sin(climb.yaw))
    return [
        [cy * cp, cy * (sp * sr) - sy * cr, cy * (sp * cr) + sy * sr],
        [sy * cp, sy * (sp * sr) + cy * cr, sy * (sp * cr) - cy * sr],
        [Span(0.0) - sp, cp * sr, cp * cr],
    ]


def dot(row: list[Span], p: Span) -> Span:
    """A row of the matrix times a vector (3,)."""
    parts = [row[k] * Span(p.lo[k], p.hi[k]) for k in range(3)]
    return parts[0] + parts[1] + parts[2]


def places(
    robot: Bag,
    climb: Bag,
    boundary: int,
    leg: int,
    above: bool,
    hip: tuple[Span, Span],
    rotation: list[list[Span]],
) -> tuple[Floats, Floats]:
    """Rearmost and foremost x at which a foot may stand on its side; inf, -inf where nowhere."""
    reach, up = robot.reach[leg], robot.up[leg]
    start, end = np.full(len(hip[0].lo), np.inf), np.full(len(hip[0].lo), -np.inf)
    for level in range(boundary + 1, climb.count + 1) if above else range(boundary + 1):
        rear = -np.inf if level == 0 else (level - 1) * climb.run
        front = np.inf if level == climb.count else level * climb.run
        if climb.rise >= robot.radius:
            front -= robot.radius  # the ball is not inside the next riser
        drop = Span(level * climb.rise + robot.radius) - hip[1]
        near = drop.nearest_zero()
        wide = np.sqrt(np.maximum(reach**2 - near**2, 0.0) + ROOT) + CERTAIN
        low, high = hip[0].lo - wide, hip[0].hi + wide
        # B's z: ux dx + uy dy + uz dz <= up, with |dy| <= reach, is a bound of dx if ux has a sign.
        ux, uy, uz = (rotation[k][2] for k in range(3))
        most = up + reach * uy.largest() - (uz * drop).lo + CERTAIN
        for sign, slope in ((1.0, ux), (-1.0, Span(0.0) - ux)):
            sure = slope.lo > 1e-6
            divisor = np.where(most >= 0.0, slope.lo, slope.hi)
            bound = most / np.where(sure, divisor, 1.0) + CERTAIN
            if sign > 0.0:
                high = np.where(sure, np.minimum(high, hip[0].hi + bound), high)
            else:
                low = np.where(sure, np.maximum(low, hip[0].lo - bound), low)
        low, high = np.maximum(low, rear), np.minimum(high, front)
        there = (near <= reach + CERTAIN) & (low <= high + CERTAIN)
        start = np.where(there, np.minimum(start, low), start)
        end = np.where(there, np.maximum(end, np.maximum(low, high)), end)
    return start, end


def connected(refuted: set[tuple[tuple[bool, ...], int]]) -> bool:
    """Whether feet can go one by one from all below to all above without the refuted moments."""
    states = list(product((False, True), repeat=4))
    group = {state: k for k, state in enumerate(states)}
    for state in states:
        for mover in range(4):
            other = (*state[:mover], not state[mover], *state[mover + 1 :])
            if (state, mover) not in refuted and (other, mover) not in refuted:
                joined, gone = group[state], group[other]
                group = {s: joined if g == gone else g for s, g in group.items()}
    return group[(False,) * 4] == group[(True,) * 4]


def main() -> int:
    """Reads the file, checks it and says what it found."""
    about = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser(
        description=about[0],
        epilog=about[2].partition("\n\n")[2],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("proof", type=Path)
    parser.add_argument("--robot", type=Path, help="a URDF to compare the robot's numbers with")
    asked = parser.parse_args()
    try:
        record = read_record(asked.proof)
    except (OSError, ValueError) as error:
        print(f"{asked.proof}: cannot be read: {error}", file=sys.stderr)
        return 2
    try:
        check(record)
        if asked.robot is not None:
            from certificate_robot import compare_robot  # Drake, only if asked for

            compare_robot(record, asked.robot)
    except (RefusedError, RuntimeError) as refusal:  # Drake's own: the URDF has other links
        print(f"refused: {refusal}")
        return 1
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        print(f"refused: not a proof: {type(error).__name__} {error}")
        return 1
    climb = record["climb"]
    print(
        f"{record['robot']['name']}, {climb['count']} steps of {climb['rise']} m on treads of "
        f"{climb['run']} m: trunk within {climb['pitch']} rad of pitch, {climb['roll']} of roll, "
        f"{climb['yaw']} of yaw"
    )
    print("accepted: no statically stable climb of the class exists")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
