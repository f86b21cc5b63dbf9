"""The region of balance: agreement with an independent program, and the time of one query.

    python -m benchmarks.region
    python -m benchmarks.region --stances 10000

A query is region and margin from feet, normals and friction, as the monitor asks it; with torque
limits also the legs' limits from the joints' angles. Beside it is the margin over the feet's hull.
The independent program is SciPy's HiGHS in other unknowns: the shares of the pyramids' edges and
the centre of mass. It is asked for the region's reach in 32 directions.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.optimize import linprog

from benchmarks.common import markdown_table, provenance
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.loader import load_robot
from drake_quad.stability.capture_point import (
    Pendulum,
    directions,
    find_pressure_area,
    pressure_reach,
    push_budget,
)
from drake_quad.stability.equilibrium_region import (
    MOST_FORCE,
    Contacts,
    Pyramid,
    find_region,
    joint_limits,
    make_contacts,
    tangents,
)
from drake_quad.stability.support_polygon import stability_margin

ROBOT = "package://drake_quad_models/paper_quadruped.urdf"
WAYS = directions(32)
CORNERS = np.array([[0.4, 0.27], [0.4, -0.27], [-0.4, 0.27], [-0.4, -0.27]])
DIFFERENT = 1e-6  # [m] beyond which two reaches are not the same


def random_stance(random: np.random.Generator) -> Contacts:
    """Two to four feet, 0.6 m of heights, ground tilted by up to 34°, friction 0.2 to 1.2."""
    n = int(random.integers(2, 5))
    xy = CORNERS[random.permutation(4)[:n]] + random.uniform(-0.2, 0.2, (n, 2))
    turn, lean = random.uniform(0.0, 2.0 * np.pi, n), random.uniform(0.0, 0.6, n)
    normals = np.stack(
        [np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=-1
    )
    places = np.column_stack([xy, random.uniform(-0.3, 0.3, n)])
    return make_contacts(places, normals, random.uniform(0.2, 1.2, n))


def edge_wrenches(contacts: Contacts, pyramid: Pyramid) -> tuple[FloatArray, FloatArray]:
    """Wrenches of the pyramids' edges about W's origin (k, 6), and whose they are (k, feet)."""
    columns, owners = [], []
    for i, (p, n, mu) in enumerate(
        zip(contacts.places, contacts.normals, contacts.friction, strict=True)
    ):
        along, left = tangents(n, pyramid.heading)
        for k in range(pyramid.sides):
            turn = 2.0 * np.pi * (k + 0.5) / pyramid.sides
            f = n + mu * (np.cos(turn) * along + np.sin(turn) * left)
            columns.append([*f, *np.cross(p, f)])
            owners.append(np.eye(len(contacts))[i])
    return np.array(columns), np.array(owners)


def independent_reach(contacts: Contacts, pyramid: Pyramid) -> FloatArray | None:
    """How far the static region goes along WAYS (32,) [m]; None of an empty one."""
    edges, caps = edge_wrenches(contacts, pyramid)
    W = edges.T
    reach = []
    for x, y in WAYS:
        found = linprog(
            x * W[4] - y * W[3],  # c = (-My, Mx)
            A_eq=W[[0, 1, 2, 5]],
            b_eq=[0.0, 0.0, 1.0, 0.0],
            A_ub=caps.T,
            b_ub=np.full(len(contacts), MOST_FORCE),
            bounds=(0.0, None),
        )
        if found.status == 2:
            return None
        reach.append(-float(found.fun))
    return np.array(reach)


def compare(stances: int, *, seed: int = 0) -> dict[str, Any]:
    """Ours against the independent program, over random stances."""
    random = np.random.default_rng(seed)
    worst, disagree, empty = 0.0, 0, 0
    for _ in range(stances):
        contacts = random_stance(random)
        region, theirs = find_region(contacts), independent_reach(contacts, Pyramid())
        if theirs is None or not len(region.corners):
            empty += 1
            disagree += (theirs is None) != (not len(region.corners))
            continue
        gap = float(np.abs(np.max(WAYS @ region.corners.T, axis=1) - theirs).max())
        worst = max(worst, gap)
        disagree += gap > DIFFERENT
    return {"stances": stances, "worst": worst, "disagreements": disagree, "empty": empty}


def queries(count: int, *, seed: int = 0) -> dict[str, list[Callable[[], Any]]]:
    """What is timed, by its name: calls for `count` stances each."""
    random = np.random.default_rng(seed)
    robot = load_robot(ROBOT)
    found: dict[str, list[Callable[[], Any]]] = {
        "hull": [], "friction": [], "friction, random stances": [], "feasible": [], "push": []
    }  # fmt: skip
    for _ in range(count):
        standing = np.ones(4, dtype=bool)
        if random.random() < 0.7:
            standing[random.integers(0, 4)] = False
        treads = 0.13 * np.array([2.0, 1.0, 0.0, 0.0]) + random.uniform(-0.02, 0.02, 4)
        feet = np.column_stack([CORNERS + random.uniform(-0.1, 0.1, (4, 2)), treads])
        body = np.array([0.0, 0.0, 0.95, random.uniform(-0.1, 0.1), 0.0])
        R = rotations(body)
        q = pose_robot(robot, body[None], feet[None])[0][0]
        contacts = make_contacts(feet[standing], friction=0.8)
        x, y = random.uniform(-0.1, 0.1, 2).tolist()
        other = random_stance(random)
        pendulum = Pendulum(x, y, 0.95, ground=float(contacts.places[:, 2].mean()))
        static = find_region(contacts)

        def hull(p: Any = contacts.places[:, :2], at: Any = (x, y)) -> Any:
            return stability_margin(at, p)

        def friction(c: Contacts = contacts, x: float = x, y: float = y) -> Any:
            return find_region(c).margin(x, y)

        def rough(c: Contacts = other, x: float = x, y: float = y) -> Any:
            return find_region(c).margin(x, y)

        def feasible(
            c: Contacts = contacts, who: Any = standing, R: Any = R, q: Any = q,
            x: float = x, y: float = y,
        ) -> Any:  # fmt: skip
            return find_region(c, limits=joint_limits(robot, R, q, who)).margin(x, y)

        def push(c: Contacts = contacts, body: Pendulum = pendulum, static: Any = static) -> Any:
            far = pressure_reach(static, find_pressure_area(c, body), body, WAYS)
            return push_budget(static, far, body, WAYS)

        calls: tuple[Callable[[], Any], ...] = (hull, friction, rough, feasible, push)
        for name, call in zip(found, calls, strict=True):
            found[name].append(call)
    return found


def measure(count: int) -> dict[str, dict[str, float]]:
    """Median and 99th percentile of a query's wall time [s]."""
    result = {}
    for name, calls in queries(count).items():
        calls[0]()
        seconds = []
        for call in calls:
            begun = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - begun)
        result[name] = {
            "median": float(np.median(seconds)),
            "p99": float(np.percentile(seconds, 99)),
        }
    return result


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--stances", type=int, default=300, help="compared with the other program")
    parser.add_argument("--queries", type=int, default=1000, help="timed, of each kind")
    parser.add_argument("--seed", type=int, default=0, help="of the stances that are compared")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    result = {
        "agreement": compare(options.stances, seed=options.seed),
        "time": measure(options.queries),
    }
    if options.json:
        print(json.dumps(result))
        return
    rows = [
        [name, f"{1e3 * t['median']:.3f} ms", f"{1e3 * t['p99']:.3f} ms"]
        for name, t in result["time"].items()
    ]
    print(markdown_table(("one query", "median", "99 %"), rows))
    a = result["agreement"]
    print(
        f"\n{a['stances']} random stances in {len(WAYS)} directions ({a['empty']} without a region)"
        f": {a['disagreements']} disagree, largest difference {a['worst']:.1e} m"
        f"\n{provenance('scipy', 'daqp')}"
    )


if __name__ == "__main__":
    main()
