"""What a run's robot had seen, against what there really is: for its summary, files and report.

Places are along the line of the belief: from the point below the camera, along the climb as it is
believed to head.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.perception.sight import MapRevision, Sight
from drake_quad.perception.stair_belief import Estimate, StairBelief
from drake_quad.perception.stair_map import describe_belief
from drake_quad.terrain.course import Course

SEEN, IMAGE = "seen.json", "seen_depth.png"
MILLIMETRE = 0.001  # [m] of a unit of the image's file


@dataclass(frozen=True, eq=False)
class SeenRecord:
    """What was seen, as a run's files have it.

    Attributes:
        told: Content of seen.json, plain values.
        depth: The last image [m], (height, width); 0 where there is none.
    """

    told: Mapping[str, Any]
    depth: FloatArray = field(repr=False)

    def write_image(self, path: Path) -> None:
        """Writes the image as PNG of 16 bits a pixel, in millimetres: `drake-quad see` reads it."""
        from PIL import Image

        units = np.clip(np.round(self.depth / MILLIMETRE), 0.0, 65535.0).astype(np.uint16)
        Image.fromarray(units).save(path, format="PNG")


def true_crossings(world: Course, origin: FloatArray, direction: FloatArray) -> FloatArray:
    """Where a line crosses the nosings of a course, (m, 2): distance and height, by distance [m].

    Args:
        world: The course.
        origin: Where the line begins in W, (2,) [m].
        direction: Its unit vector, (2,).
    """
    found = []
    for right, left in world.nosings():
        across = left[:2] - right[:2]
        A = np.column_stack([direction, -across])
        if abs(np.linalg.det(A)) < 1e-9:
            continue
        distance, share = np.linalg.solve(A, right[:2] - origin)
        if distance > 0.0 and 0.0 <= share <= 1.0:
            found.append((float(distance), float(right[2])))
    return np.array(sorted(found)).reshape(-1, 2)


def _true_yaw(world: Course, near: float) -> float | None:
    """Yaw of the climb over the first nosing, the one of two ways that is nearer to `near`."""
    nosings = world.nosings()
    if not len(nosings):
        return None
    across = nosings[0, 1, :2] - nosings[0, 0, :2]
    yaw = float(np.arctan2(-across[0], across[1]))
    return near + float(np.remainder(yaw - near + 0.5 * np.pi, np.pi) - 0.5 * np.pi)


def _compare(value: float, half_width: float, true: float | None) -> dict[str, Any]:
    """A figure with its 95 % interval and the truth, None where there is nothing to compare."""
    told = {"value": float(value), "half_width": float(half_width), "true": true}
    error = None if true is None else float(value) - true
    inside = None if error is None else bool(abs(error) <= half_width)
    return {**told, "error": error, "inside": inside}


def _estimate(estimate: Estimate, true: float | None, scale: float = 1.0) -> dict[str, Any]:
    return _compare(
        scale * estimate.value, scale * estimate.half_width, None if true is None else scale * true
    )


def _nosings(belief: StairBelief, true: FloatArray) -> list[dict[str, Any]]:
    """Each nosing's place and height against those of the true one of the same number."""
    rows = []
    for i, (place, sigma) in enumerate(zip(belief.places, belief.place_sigmas, strict=True)):
        there = i < len(true)
        k = i + 1 if belief.going_up else i
        place_width = Estimate(value=float(place), sigma=float(sigma)).half_width
        height = Estimate(value=belief.nosing_height(i), sigma=float(belief.height_sigmas[k]))
        rows.append(
            {
                "place": _compare(place, place_width, float(true[i, 0]) if there else None),
                "height": _estimate(height, float(true[i, 1]) if there else None),
            }
        )
    return rows


def record_sight(
    sight: Sight,
    world: Course,
    revisions: Sequence[MapRevision] = (),
    proofs: Sequence[Mapping[str, Any]] = (),
) -> SeenRecord:
    """What was seen, beside what there is.

    Args:
        sight: What was seen from the start.
        world: The course as it really is.
        revisions: The maps that the robot had on its way, that of the start first.
        proofs: What is proven of the stretches that were planned on these, plain values; see
            `simulation.belief_proof`.
    """
    belief = sight.belief
    used = [revision.map for revision in revisions if not revision.reason]
    last = used[-1] if used else sight.map
    told: dict[str, Any] = {
        "words": describe_belief(belief),
        "refused": sight.refused,
        "stamp": sight.stamp if np.isfinite(sight.stamp) else None,
        "images": sight.images,
        "stairs": belief is not None,
        "level_seen": None if sight.level is None else sight.level.length,
        "map": None if last is None else last.describe(),
        "error_place": None if sight.map is None else sight.map.error_place,
        "error_height": None if sight.map is None else sight.map.error_height,
        "revisions": [_revision(revision, world) for revision in revisions],
        "proofs": [dict(proof) for proof in proofs],
    }
    if belief is not None:
        true = true_crossings(world, belief.origin, belief.direction)
        n = len(belief.places)
        whole = len(true) >= n
        steps = np.diff(true[:n], axis=0).mean(axis=0) if whole and n > 1 else (None, None)
        first = float(world.height(*belief.origin)) if n and whole else None
        rise = None if first is None else (float(true[n - 1, 1]) - first) / n
        if not belief.going_up:
            rise = None
        told |= {
            "origin": [float(x) for x in belief.origin],
            "count_least": belief.count_least,
            "count_most": belief.count_most,
            "count_true": len(true),
            "rise": _estimate(belief.estimate("rise"), rise),
            "run": _estimate(belief.estimate("run"), None if steps[0] is None else float(steps[0])),
            "yaw_deg": _estimate(
                belief.estimate("yaw"), _true_yaw(world, belief.yaw), float(np.degrees(1.0))
            ),
            "nosings": _nosings(belief, true),
        }
    return SeenRecord(told, sight.depth)


def _revision(revision: MapRevision, world: Course) -> dict[str, Any]:
    """A map that the robot had on its way, beside what there is, along the map's lane."""
    known = revision.map
    direction = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    true = true_crossings(world, known.origin, direction)
    columns = (known.places, known.place_errors, known.heights, known.height_errors)
    nosings = []
    for k, (place, place_width, height, height_width) in enumerate(zip(*columns, strict=True)):
        there = k < len(true)
        nosings.append(
            {
                "place": _compare(place, place_width, float(true[k, 0]) if there else None),
                "height": _compare(height, height_width, float(true[k, 1]) if there else None),
                "look": known.seen_in[k],
                "touched": bool(known.touched_treads[k]),
            }
        )
    return {
        "number": revision.number,
        "looked": revision.looked,
        "stamp": revision.stamp,
        "words": _words(revision),
        "reason": revision.reason,
        "steps": len(known.places),
        "planned_on": known.trusted,
        "complete": known.complete,
        "nosings": nosings,
    }


def _words(revision: MapRevision) -> str:
    """What a revision is made of, in a few words for people."""
    if revision.looked:
        return describe_belief(revision.belief)
    return f"its feet told the height of {revision.stood_on} of {len(revision.map.heights)} steps"


def seen_figures(told: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of `record_sight`'s values that a summary has.

    Args:
        told: The values.
    """
    nosings = told.get("nosings", [])
    places, heights = ([row[name] for row in nosings] for name in ("place", "height"))
    figures = {name: told.get(name) for name in ("stairs", "images", "count_least", "count_most")}
    figures |= {
        "climbed": not told["refused"],
        "count_true": told.get("count_true"),
        "level_seen": told["level_seen"],
        "place_error_max": _largest(places),
        "place_error_told": told["error_place"],
        "places_inside": _share_inside(places),
        "height_error_max": _largest(heights),
        "height_error_told": told["error_height"],
        "heights_inside": _share_inside(heights),
    }
    figures |= _figures_of_map(told) | _figures_of_proofs(told.get("proofs", []))
    for name, key in (("rise", "rise"), ("run", "run"), ("yaw_deg", "yaw")):
        figure = told.get(name, {})
        unit = "_deg" if name == "yaw_deg" else ""
        figures[f"{key}_error{unit}"] = figure.get("error")
        figures[f"{key}_inside"] = figure.get("inside")
    return figures


def _figures_of_map(told: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of the map as it was in the end, where the robot looked again on its way."""
    revisions = told.get("revisions", [])
    used = [entry for entry in revisions if not entry["reason"]]
    last = used[-1] if used else {}
    places, heights = (
        [row[name] for row in last.get("nosings", [])] for name in ("place", "height")
    )
    return {
        "looks": max(1, sum(entry["looked"] for entry in revisions)),
        "map_treads_touched": sum(row["touched"] for row in last["nosings"]) if last else None,
        "map_steps": last.get("steps"),
        "map_complete": last.get("complete"),
        "map_place_error_max": _largest(places),
        "map_places_inside": _share_inside(places),
        "map_height_error_max": _largest(heights),
        "map_heights_inside": _share_inside(heights),
    }


def _figures_of_proofs(proofs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What is proven of all stretches, for all stairs that their maps take for possible."""
    if not proofs:
        return dict.fromkeys(
            ("box_inside", "box_proven", "box_share", "box_margin", "box_covered", "box_kept")
        )
    kept = [proof["kept"] for proof in proofs if proof.get("covered")]
    proven = all(proof["proven"] for proof in proofs)
    return {
        "box_inside": all(proof["inside"] for proof in proofs),
        "box_proven": proven,
        "box_share": min(proof["share"] for proof in proofs) if proven else None,
        "box_margin": min(proof["proven"]["margin"] for proof in proofs) if proven else None,
        "box_covered": len(kept),
        "box_kept": all(kept) if kept else None,
    }


def _largest(rows: Sequence[Mapping[str, Any]]) -> float | None:
    errors = [abs(row["error"]) for row in rows if row["error"] is not None]
    return max(errors, default=None)


def _share_inside(rows: Sequence[Mapping[str, Any]]) -> float | None:
    """Share of the figures whose truth is in their interval; one that is not there is not."""
    return sum(row["inside"] is True for row in rows) / len(rows) if rows else None
