"""The static stability margin against shapely's: the same numbers, and in what time.

    python -m benchmarks.margin

Ours is `drake_quad.stability.support_polygon`: `stability_margin` for one sample (it runs at the
controller's rate), `stability_margins` for many (plans, logs). The peer is shapely (GEOS) put
together to give the same signed distance: hull, containment, distance to the hull or to its
boundary.
"""

import argparse
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from benchmarks.common import markdown_table, median_time, provenance
from drake_quad.common import BoolArray, FloatArray
from drake_quad.stability.support_polygon import stability_margin, stability_margins


def random_samples(count: int, *, seed: int = 0) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Points (N, 2) [m], feet (N, 4, 2) [m] and who stands (N, 4): on three or four feet."""
    random = np.random.default_rng(seed)
    corners = np.array([[0.4, 0.27], [0.4, -0.27], [-0.4, 0.27], [-0.4, -0.27]])
    feet = corners + random.uniform(-0.3, 0.3, (count, 4, 2))
    standing = np.ones((count, 4), dtype=np.bool_)
    lifted = random.integers(0, 8, count)  # half of the samples stand on all four
    swing = np.flatnonzero(lifted < 4)
    standing[swing, lifted[swing]] = False
    return random.uniform(-0.5, 0.5, (count, 2)), feet, standing


def shapely_margin(point: FloatArray, feet: FloatArray) -> float:
    """One sample's signed margin [m] by shapely; `feet` (n, 2) are those that stand."""
    hull = shapely.convex_hull(shapely.multipoints(feet))
    p = shapely.Point(point)
    if hull.covers(p):
        return float(hull.exterior.distance(p))
    return -float(hull.distance(p))


def shapely_margins(points: FloatArray, feet: FloatArray, standing: BoolArray) -> FloatArray:
    """Many samples' signed margins (N,) [m] by shapely's vectorised calls."""
    # A foot in the air is put where a standing one is: the hull stays the same.
    stand_in = np.take_along_axis(feet, np.argmax(standing, axis=1)[:, None, None], axis=1)
    hulls = shapely.convex_hull(shapely.multipoints(np.where(standing[:, :, None], feet, stand_in)))
    p = shapely.points(points)
    outside = np.asarray(shapely.distance(hulls, p))
    inside = np.asarray(shapely.distance(shapely.boundary(hulls), p))
    return np.where(outside > 0.0, -outside, inside)


def measure(*, count: int = 20000, singles: int = 500, repeats: int = 9) -> dict[str, Any]:
    """Times both and compares their values.

    Args:
        count: Samples of the vectorised comparison.
        singles: Samples that are taken one by one.
        repeats: Number of timings, whose median counts.
    """
    points, feet, standing = random_samples(count)
    pairs = [(points[k], feet[k][standing[k]]) for k in range(min(singles, count))]
    ours = stability_margins(points, feet, standing)
    theirs = shapely_margins(points, feet, standing)
    single = [stability_margin(p, f) - shapely_margin(p, f) for p, f in pairs]

    def each(function: Any) -> float:
        return median_time(lambda: [function(p, f) for p, f in pairs], repeats=repeats) / len(pairs)

    def all_at_once(function: Any) -> float:
        return median_time(lambda: function(points, feet, standing), repeats=repeats) / count

    return {
        "largest_difference": float(max(np.max(np.abs(ours - theirs)), np.max(np.abs(single)))),
        "one": {"ours": each(stability_margin), "shapely": each(shapely_margin)},
        "many": {"ours": all_at_once(stability_margins), "shapely": all_at_once(shapely_margins)},
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=20000, help="samples at once")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    result = measure(count=options.count, repeats=options.repeats)
    if options.json:
        print(json.dumps(result))
        return
    names = {"one": "one sample a call", "many": f"{options.count} samples a call"}
    rows = [
        [
            names[key],
            f"{1e6 * result[key]['ours']:.2f} µs",
            f"{1e6 * result[key]['shapely']:.2f} µs",
            f"{result[key]['shapely'] / result[key]['ours']:.1f} ×",
        ]
        for key in names
    ]
    print(markdown_table(("a margin", "drake_quad", "shapely", "shapely / ours"), rows))
    print(f"\nlargest difference {result['largest_difference']:.1e} m\n{provenance('shapely')}")


if __name__ == "__main__":
    main()
