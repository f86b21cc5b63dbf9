"""Reads a certificate for `check_certificate.py`, and refuses what is no robot or no motion.

numpy alone, and nothing of drake_quad.
"""

import json
import os
import stat
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace as Bag
from typing import Any

import numpy as np
from certificate_bounds import body_motion, roll_at
from certificate_course import distance, make_course
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Record = dict[str, Any]
Rows = list[tuple[Any, ...]]

CLAIMS = ("margin", "foot_clearance", "shank_clearance", "joint_room", "torque_room")
SAME = 1e-9  # [s], [m] by which what is to be the same may differ: rounding
# By how much the body may be off where a task begins: rounding, of its place [m], [rad], its rate
# [1/s] and its acceleration [1/s^2].
JUMPS = (1e-9, 1e-8, 1e-6)
STANDS = 1e-6  # [m] from the ground where a foot stands
SLOPE = 5e-3  # [m] by which its sphere may dip into a slope
ROLLED = 1e-6  # [m] that a foot may have rolled where it is set down
GAP = 1.0  # [s] between tasks, where all of them are laid out on one axis
_PHASE = ("task", "start", "end", "feet", "swing", "to", "lasts", "apex_time", "apex_z", "back")


MOST_BYTES = 64 << 20  # a thousand steps have 7 MiB


class RefusedError(Exception):
    """Why a certificate is not accepted."""


def read_record(path: Path) -> Any:
    """What a file holds as JSON; whatever it is, nothing is waited for, or read without end.

    Raises:
        OSError: It is no regular file, it has more than MOST_BYTES, or it cannot be read.
        ValueError: It is no JSON.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # of a pipe it would wait for a writer
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode):
            raise OSError("it must be a regular file")
        if found.st_size > MOST_BYTES:
            raise OSError(f"it has more than {MOST_BYTES >> 20} MiB")
        data: bytes | None = file.read(MOST_BYTES + 1)
    if data is None or len(data) > MOST_BYTES:  # files of /proc tell no size
        raise OSError("it must be a whole file")
    try:
        return json.loads(data)
    except RecursionError:
        raise ValueError("brackets within brackets, too deep to be read") from None


def require(condition: object, reason: str) -> None:
    """Refuses the certificate unless the condition holds."""
    if not condition:
        raise RefusedError(reason)


def numbers(values: Any, *shape: int) -> Floats:
    """A float array of that shape (-1: any length), all finite."""
    array = np.array(values, dtype=float)
    fits = array.ndim == len(shape) and all(
        n in (-1, m) for n, m in zip(shape, array.shape, strict=True)
    )
    require(fits and np.all(np.isfinite(array)), f"expected finite numbers of shape {shape}")
    return array


def read_robot(r: Record) -> Bag:
    """The robot's numbers, each of which has to make sense."""
    n = len(r["shank_places"])
    r = {"raised": [0.0] * 4, **r}  # of older records, whose hip axes met
    shapes = dict(hips=(4, 3), offsets=(4,), raised=(4,), thighs=(4,), shanks=(4,), knee_signs=(4,),
                  q_lower=(12,), q_upper=(12,), efforts=(12,), trunk_com=(3,), link_masses=(4, 3),
                  link_coms=(4, 3, 3), shank_places=(n,), shank_ahead=(4, n), shank_radii=(4, n),
                  trunk_mass=(), foot_radius=())  # fmt: skip
    robot = Bag(**{k: numbers(r[k], *shape) for k, shape in shapes.items()})
    robot.mass = robot.trunk_mass + robot.link_masses.sum()
    positive = (robot.thighs, robot.shanks, robot.efforts, robot.foot_radius, robot.mass)
    require(all(np.all(v > 0.0) for v in positive), "lengths, limits, mass have to be positive")
    require(min(robot.link_masses.min(), robot.trunk_mass) >= 0.0, "a mass is negative")
    require(np.all(np.abs(robot.knee_signs) == 1.0), "a knee bends forward or back")
    s = robot.shank_places
    good = n > 1 and s[0] == 0.0 and np.all(np.diff(s) > 0.0) and s[-1] <= 1.0
    require(good and robot.shank_radii.min() >= 0.0, "a shank goes from its knee on to its foot")
    return robot


def read_course(boxes: list[Record]) -> Bag:
    """The obstacles of the course's boxes."""
    centre = numbers([b["centre"] for b in boxes], -1, 3)
    size = numbers([b["size"] for b in boxes], -1, 3)
    yaw, pitch = (numbers([b[k] for b in boxes], -1) for k in ("yaw", "pitch"))
    require(size.min() > 0.0 and np.abs(pitch).max() < 1.0, "a box has a size, and lies")
    return make_course(centre, size, yaw, pitch)


def read_plan(tasks: list[Record], course: Bag, radius: float) -> tuple[Bag, Bag, Bag, Bag, Bag]:
    """Tasks, the feet's rolling, contact phases, segments and cells as flat arrays.

    Refuses a plan that is not one motion from the first to the last moment.
    """
    body = Bag(
        knot=numbers([t["knot"] for t in tasks], -1),
        first=np.cumsum([0, *(len(t["control"]) for t in tasks[:-1])]),
        pieces=np.array([len(t["control"]) - 3 for t in tasks]),
        control=np.concatenate([numbers(t["control"], -1, 5) for t in tasks]),
        lasts=numbers([t["duration"] for t in tasks], -1),
    )
    require(np.all(body.knot > 0.0) and np.all(body.lasts > 0.0), "time goes on")
    require(np.all(body.lasts <= body.pieces * body.knot + SAME), "the body's path is too short")
    require_one_motion(body)
    roll = read_roll(tasks, body.lasts)
    phases, segments, cells, feet = [], [], [], None
    for k, task in enumerate(tasks):
        begin = numbers(task["feet"], 4, 3)
        require(
            feet is None or np.abs(begin - feet).max() <= SAME, f"a foot jumps as task {k} begins"
        )
        require(all(stands(course, p, radius) for p in begin), "a foot stands on no ground")
        own, feet = read_steps(k, task, begin, course, radius)
        phases += own
        require_roll(roll, k, task, own, course, radius)
        edges = [(s["start"], s["end"]) for s in task["segments"]]
        covers(numbers(edges, -1, 2), body.lasts[k], "segments")
        segments += [
            (k, *e, [s[c] for c in CLAIMS]) for e, s in zip(edges, task["segments"], strict=True)
        ]
        cuts, shares = numbers(task["partition"], -1), numbers(task["shares"], -1, 4)
        require(len(cuts) == len(shares) + 1, "a cell has no witness")
        covers(np.column_stack([cuts[:-1], cuts[1:]]), body.lasts[k], "cells")
        cells += list(zip([k] * len(shares), cuts[:-1], cuts[1:], shares, strict=True))
    return (
        body,
        roll,
        columns(phases, _PHASE),
        columns(segments, ("task", "start", "end", "claims")),
        columns(cells, ("task", "start", "end", "shares")),
    )


def require_one_motion(body: Bag) -> None:
    """Refuses a body that is not continuous to its acceleration where tasks meet.

    Inside of a task it is: its path is a uniform cubic B-spline. The first task begins at rest,
    and the last one ends so.
    """
    tasks = np.arange(len(body.lasts))
    start = np.stack(body_motion(body, tasks, 0.0 * body.lasts))
    end = np.stack(body_motion(body, tasks, body.lasts))
    what = ("the body jumps", "the body's speed jumps", "the body's acceleration jumps")
    for k, (most, name) in enumerate(zip(JUMPS, what, strict=True)):
        jumps = np.abs(start[k, 1:] - end[k, :-1]).max(initial=0.0)
        require(jumps <= most, f"{name} where a task begins")
        rest = max(np.abs(start[k, 0]).max(), np.abs(end[k, -1]).max()) if k else 0.0
        require(rest <= most, f"{name} where the plan begins or ends, which is not at rest")


def read_steps(
    k: int, task: Record, feet: Floats, course: Bag, radius: float
) -> tuple[Rows, Floats]:
    """The contact phases of task k as rows of _PHASE, and where the feet end."""
    rows, lasts, t, feet = [], float(task["duration"]), 0.0, feet.copy()
    for step in task["steps"]:
        leg, off, on = step["leg"] - 1, float(step["lift_off"]), float(step["touchdown"])
        to, apex, z = numbers(step["to"], 3), float(step["apex_time"]), float(step["apex_z"])
        require(leg in range(4) and t - SAME <= off < on <= lasts + SAME, "steps overlap")
        require(abs(on - off - step["lasts"]) <= SAME, "a step lasts until its touchdown")
        back = float(step["back"])
        require(SAME < back <= on - off + SAME, "a foot is back on its way within its swing")
        require(SAME < apex < on - off - SAME and np.isfinite(z), "an apex is within its swing")
        require(np.abs(numbers(step["from"], 3) - feet[leg]).max() <= SAME, "a foot jumps")
        require(stands(course, to, radius), "a foot steps onto no ground")
        if off - t > SAME:
            rows.append((k, t, off, feet.copy(), -1, feet[0], 1.0, 0.5, 0.0, 1.0))
        rows.append((k, off, on, feet.copy(), leg, to, on - off, apex, z, back))
        feet[leg], t = to, on
    if lasts - t > SAME:
        rows.append((k, t, lasts, feet.copy(), -1, feet[0], 1.0, 0.5, 0.0, 1.0))
    return rows, feet


def read_roll(tasks: list[Record], lasts: Floats) -> Bag:
    """How far feet have rolled from where they were set down, of all tasks on one axis of time."""
    times = [numbers(t["roll"]["times"], -1) for t in tasks]
    offsets = [
        numbers(t["roll"]["offset"], len(v), 4, 2) for t, v in zip(tasks, times, strict=True)
    ]
    for t, end in zip(times, lasts, strict=True):
        # Nearer ones would be taken for one time, and rolling between them be passed over.
        good = len(t) > 1 and np.all(np.diff(t) > SAME) and t[0] == 0.0
        require(good and abs(t[-1] - end) <= SAME, "feet roll from a task's begin to its end")
    start = np.cumsum([0.0, *(lasts[:-1] + GAP)])
    return Bag(
        start=start,
        times=times,
        when=np.concatenate([t + s for t, s in zip(times, start, strict=True)]),
        offset=np.concatenate(offsets),
    )


def roll_now(roll: Bag, k: int, t: float) -> Floats:
    """How far the four feet have rolled at a time of task k (4, 2)."""
    return roll_at(roll, np.full(4, k), np.arange(4), np.full(4, t))


def require_roll(roll: Bag, k: int, task: Record, phases: Rows, course: Bag, radius: float) -> None:
    """Refuses feet that have rolled where they are set down, or off the ground."""
    before = 0.0 if k == 0 else roll_now(roll, k - 1, roll.times[k - 1][-1])
    jump = np.abs(roll_now(roll, k, 0.0) - before).max()
    require(jump <= SAME, "a foot has rolled before it begins to, or jumps")
    t = roll.times[k]
    for step in task["steps"]:
        ends = [float(step[name]) for name in ("lift_off", "touchdown")]
        away = [np.abs(t - end).min() for end in ends]
        # Else its rolling could jump there, between a knot in the air and one on the ground.
        require(max(away) <= SAME, "a foot's rolling has no knot as it lifts off or lands")
        at = roll_now(roll, k, ends[1])[step["leg"] - 1]
        require(np.abs(at).max() <= ROLLED, "a foot has rolled as it is set down")
    own = columns(phases, _PHASE)
    phase = np.clip(np.searchsorted(own.start, t, side="right") - 1, 0, len(own.start) - 1)
    mine = np.abs(roll.when - roll.start[k] - t[:, None]).argmin(axis=1)
    feet = own.feet[phase].copy()
    feet[..., :2] += roll.offset[mine]
    stand = own.swing[phase][:, None] != np.arange(4)
    good = all(stands(course, p, radius, SLOPE) for p in np.unique(feet[stand], axis=0))
    require(good, "a foot rolls off its ground")


def covers(edges: Floats, lasts: float, what: str) -> None:
    """Refuses stretches (n, 2) that do not follow one another from 0 to the end."""
    good = len(edges) and np.all(edges[:, 1] > edges[:, 0])
    good = good and np.abs(edges[1:, 0] - edges[:-1, 1]).max(initial=0.0) <= SAME
    require(
        good and abs(edges[0, 0]) <= SAME and abs(edges[-1, 1] - lasts) <= SAME,
        f"{what} leave a gap",
    )


def columns(rows: Rows, names: Sequence[str]) -> Bag:
    """Rows of values as named arrays."""
    return Bag(**{n: np.array(c) for n, c in zip(names, zip(*rows, strict=True), strict=True)})


def stands(course: Bag, p: Floats, radius: float, above: float = STANDS) -> bool:
    """Whether a foot's sphere at p (3,) rests on a box, and is in none.

    On a slope it may be `above` it, as rolling is told along the level.
    """
    boxes = np.flatnonzero(~course.face)
    d, up = distance(course, boxes, np.tile(p, (len(boxes), 1)))
    tilted = course.axes[boxes, 2, 2] < 1.0
    rests = (d - radius <= np.where(tilted, above, STANDS)) & (up > 0.7)
    out = np.all(d - radius >= -np.where(tilted, SLOPE, STANDS))
    return bool(np.any(rests) and out)
