"""The sides of the true regions of balance, in place of those of the feet's hulls.

They are rows of the body's program as `body_sides.py` makes them. Where the region is for certain
the hull (level treads, drives of any strength) the hull's rows stay as they are. With torque limits
a region is that of one posture: it is taken along the path found so far, and again along the next.
"""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import stability_margin
from drake_quad.planning.body_sides import Sides
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.footing import Footing, Stances
from drake_quad.stability.level import LEVEL

Indices = NDArray[np.intp]
HELD = 0.25  # [s] for which a region counts, half of it before its time and half after
SAME = 1e-6  # [m] within which a region is the hull
APART = 1e-3  # [m] corners nearer than this are one: sides between them have no sure direction


def region_sides(
    sides: Sides, footing: Footing, contacts: ContactPlan, times: FloatArray, body: FloatArray
) -> Sides:
    """The sides of the regions at every sample where the hulls' are.

    Where there is no region, there are those without the drives' limits, or of the hull: whoever
    measures the path's margin finds out.

    Args:
        sides: Of the hulls.
        footing: Of which regions are made.
        contacts: Who stands where, when.
        times: Sampled times (N,) [s].
        body: Poses along the path found so far, (N, 5).
    """
    # A sample is looked at once for every phase whose feet have to hold the robot at it: around
    # touchdowns and lift-offs also for the one before or after.
    seen = np.unique(np.stack([sides.phase, sides.sample]), axis=1)
    phase, sample = seen
    who = np.stack([p.standing for p in contacts.phases])[phase]
    stances = footing.stances(body[sample], contacts.feet_at(times)[0][sample], who)
    eased = np.ones(len(times))
    eased[sides.sample] = sides.weight
    kept = np.ones(len(sides.sample), dtype=np.bool_)
    parts = []
    for group in _groups(phase, times[sample]):
        corners = None if np.all(stances.hulls[group]) else _corners(stances, group)
        if corners is not None:
            of_group = np.isin(sides.sample, sample[group])
            kept &= ~(of_group & (sides.phase == phase[group[0]]))
            parts.append(_sides(corners, sample[group], eased, int(phase[group[0]])))
    parts.append(Sides(*(getattr(sides, f.name)[kept] for f in fields(Sides))))
    return Sides(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Sides)))


def _groups(phase: Indices, times: FloatArray) -> list[Indices]:
    """Rows of one phase that follow one another, in groups that share a region."""
    found: list[Indices] = []
    for mine in np.split(np.arange(len(phase)), np.flatnonzero(np.diff(phase)) + 1):
        since = times[mine] - times[mine[0]]
        count = max(int(np.ceil(since[-1] / HELD)), 1)
        slot = np.minimum((since * count / max(since[-1], 1e-9)).astype(int), count - 1)
        found += np.split(mine, np.flatnonzero(np.diff(slot)) + 1)
    return found


def _corners(stances: Stances, group: Indices) -> FloatArray | None:
    """The corners of the region in the middle of a group; None if it has no inside, or is the hull.

    Of a hull all rows are exact, those of a group are held.
    """
    k = int(group[len(group) // 2])
    region = stances.region(k)
    feet = stances.places[k, stances.standing[k], :2]
    if np.all(stances.normals[k, stances.standing[k], 2] >= 1.0 - LEVEL) and (
        all(region.margin(x, y) > -SAME for x, y in feet.tolist())
        and all(stability_margin(corner, feet) > -SAME for corner in region.corners)
    ):
        return None
    corners = _apart(region.corners)
    if len(corners) < 3 and stances.limits is not None:
        corners = _apart(stances.region(k, drives=False).corners)
    return corners if len(corners) >= 3 else None


def _sides(corners: FloatArray, samples: Indices, eased: FloatArray, phase: int) -> Sides:
    """Every side of a counterclockwise polygon (k, 2) at each of some samples."""
    edge = np.roll(corners, -1, axis=0) - corners
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=-1) / np.hypot(*edge.T)[:, None]
    offset = np.sum(normal * corners, axis=1)
    n, k = len(samples), len(corners)
    sample = np.repeat(samples, k)
    return Sides(
        sample, np.tile(normal, (n, 1)), np.tile(offset, n), eased[sample], np.full(n * k, phase)
    )


def _apart(corners: FloatArray) -> FloatArray:
    """The corners without those that are almost where the one before is."""
    kept: list[FloatArray] = []
    for corner in corners:
        if not kept or np.hypot(*(corner - kept[-1])) > APART:
            kept.append(corner)
    while len(kept) > 1 and np.hypot(*(kept[0] - kept[-1])) <= APART:
        kept.pop()
    return np.array(kept).reshape(-1, 2)
