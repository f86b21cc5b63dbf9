"""Checks a certificate.json again, from nothing but its own numbers.

    python check_certificate.py certificate.json [--robot robot.urdf]

Needs numpy alone, and the modules `certificate_*.py` beside it: nothing of the planner or of the
prover. Exit status 0: all that it claims is true of the plan in it, at every time; 1: it is not,
or that cannot be shown; 2: the file cannot be read. With --robot its robot is compared with a URDF
as Drake's parser reads it. docs/certificates.md says what is claimed and why the bounds hold.
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace as Bag
from typing import Any

import numpy as np
from certificate_claims import Bound, feet, feet_items, rolling, shank_items, shanks, statics
from certificate_reading import (
    CLAIMS,
    SAME,
    RefusedError,
    numbers,
    read_course,
    read_plan,
    read_record,
    read_robot,
    require,
)

Record = dict[str, Any]

SHORTEST = 1e-7  # [s] below which nothing is halved any more
MOST = 3_000_000  # stretches that are looked at before giving up
ROUNDING = 1e-9
FARTHEST = 0.1  # [m] of a clearance; where there is more, that is what is told


def check(record: Record) -> None:
    """Refuses a certificate (with `RefusedError`) unless all it claims is shown to be true."""
    check_hash(record)
    check_content(record)


def check_hash(record: Record) -> None:
    """Refuses a record whose content is not what was hashed."""
    content = {k: v for k, v in record.items() if k != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    own = hashlib.sha256(text.encode()).hexdigest()
    require(record.get("sha256") == own, "the content is not what was hashed")


def check_content(record: Record) -> None:
    """The same but for the hash."""
    require(record["format"] == "drake_quad certificate", "the format")
    require(record["version"] == 3, "another version than 3, which this checks: make it again")
    work = read(record)
    least, asked = work.segments.claims.min(axis=0), [record["demanded"][c] for c in CLAIMS]
    claimed = numbers([record["claimed"][c] for c in CLAIMS], 5)
    require(np.all(claimed <= least), "a segment claims less than the whole")
    require(np.all(claimed >= numbers(asked, 5)), "less is claimed than was asked for")
    require(claimed.min() >= 0.0, "a claim is negative")
    cuts = cut(work)
    with np.errstate(divide="ignore", invalid="ignore"):
        settle(work, cuts, statics)
        settle(work, feet_items(work, cuts), feet)
        settle(work, shank_items(work, cuts), shanks)
        rolling(work)
    # Nothing farther than that is looked at: a greater claim would rest on nothing.
    require(work.segments.claims[:, 1:3].max() <= FARTHEST, f"clearances above {FARTHEST:g} m")


def read(record: Record) -> Bag:
    """Robot, course and plan of a record."""
    work = Bag(robot=read_robot(record["robot"]), course=read_course(record["course"]))
    plan = read_plan(record["tasks"], work.course, work.robot.foot_radius)
    work.body, work.roll, work.phases, work.segments, work.cells = plan
    return work


def cut(work: Bag) -> Bag:
    """Stretches of time in which all is smooth, each with its phase, segment and cell."""
    found = []
    for k, lasts in enumerate(work.body.lasts):
        mine = [np.flatnonzero(v.task == k) for v in (work.phases, work.segments, work.cells)]
        values = zip(mine, (work.phases, work.segments, work.cells), strict=True)
        ends = [np.append(v.start[m], lasts) for m, v in values]
        swings = mine[0][work.phases.swing[mine[0]] >= 0]
        apexes = work.phases.start[swings] + work.phases.apex_time[swings]
        backs = work.phases.start[swings] + work.phases.back[swings]
        knots = np.arange(work.body.pieces[k]) * work.body.knot[k]
        t = np.unique(
            np.clip(np.concatenate([*ends, apexes, backs, knots, work.roll.times[k]]), 0.0, lasts)
        )
        t = t[np.append(np.diff(t) > SAME, True)]
        t[0] = 0.0
        middle = 0.5 * (t[1:] + t[:-1])
        owners = [m[np.searchsorted(e, middle) - 1] for m, e in zip(mine, ends, strict=True)]
        found.append((np.full(len(middle), k), t[:-1], t[1:], *owners))
    names = ("task", "a", "b", "phase", "segment", "cell")
    return Bag(
        **{n: np.concatenate(c) for n, c in zip(names, zip(*found, strict=True), strict=True)}
    )


def settle(work: Bag, items: Bag, bound: Callable[[Bag, Bag], Bound]) -> None:
    """Halves items until `bound` shows each to be as claimed.

    `bound` returns of every item the least it may be over what is claimed, what that is in its
    middle, what is wrong if it is less, and whether to halve a shank's part rather than time.
    """
    looked = 0
    while len(items.a):
        looked += len(items.a)
        low, middle, what, along = bound(work, items)
        wrong = ~(middle >= -ROUNDING)
        if np.any(wrong):
            k = int(np.argmin(np.where(wrong, items.a, np.inf)))
            t = 0.5 * (items.a[k] + items.b[k])
            raise RefusedError(f"{what[k]} not as claimed at {t:.4f} s of task {items.task[k]}")
        again = ~(low >= -ROUNDING)
        short = again & (items.b - items.a < SHORTEST) & ~along
        require(not np.any(short) and looked < MOST, "a claim cannot be shown")
        one = {n: v[again] for n, v in vars(items).items()}
        two = {n: v.copy() for n, v in one.items()}
        time, part = ~along[again], along[again]
        middle = 0.5 * (one["a"] + one["b"])
        one["b"][time], two["a"][time] = middle[time], middle[time]
        if np.any(part):
            s = 0.5 * (one["s0"] + one["s1"])
            one["s1"][part], two["s0"][part] = s[part], s[part]
        items = Bag(**{n: np.concatenate([one[n], two[n]]) for n in one})


def main() -> int:
    """Reads the file, checks it and says what it found."""
    about = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser(
        description=about[0],
        epilog=about[2].partition("\n\n")[2],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("certificate", type=Path)
    parser.add_argument("--robot", type=Path, help="a URDF to compare the robot's numbers with")
    asked = parser.parse_args()
    try:
        record = read_record(asked.certificate)
    except (OSError, ValueError) as error:
        print(f"{asked.certificate}: cannot be read: {error}", file=sys.stderr)
        return 2
    try:
        check(record)
        if asked.robot is not None:
            from certificate_robot import compare_robot  # Drake, only if asked for

            compare_robot(record, asked.robot)
    except RefusedError as refusal:
        print(f"refused: {refusal}")
        return 1
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        print(f"refused: not a certificate: {type(error).__name__} {error}")
        return 1
    for name in CLAIMS:
        print(f"{name}: at least {record['claimed'][name]}")
    print("accepted: all that it claims holds at every time")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
