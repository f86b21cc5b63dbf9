"""The body program's half-planes for balance: support polygons, equilibrium regions.

Where a leg lifts at the instant at which its diagonal lands, the two support triangles share that
diagonal alone: any path's margin is zero there (the wave gait at β = 0.75, twice a cycle). The
margin demanded falls to zero towards such a switch, so that it need not be zero elsewhere.

Regions of balance are rows of the body's program as support polygons are. Where the region is for
certain the hull (level treads, drives of any strength) the hull's rows stay as they are. With
torque limits a region is that of one posture: it is taken along the path found so far, and again
along the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.errors import PlanningError
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.stance_margin import Footing, Stances
from drake_quad.stability.equilibrium_region import LEVEL
from drake_quad.stability.support_polygon import stability_margin

NARROW = 1e-5  # [m] beside such a diagonal: an interior-point solver needs an inside
CROSSING_TIME = 0.5  # [s] to either side of such a switch in which the margin is to be reached


@dataclass(frozen=True, eq=False)
class Sides:
    """Rows (k,), one for each side at each sample where it has to hold the robot.

    Attributes:
        sample: Index of the sampled time.
        normal: Inward unit normal, (k, 2).
        offset: Inward distance of the side from W's origin [m].
        weight: Share of the desired margin that has to hold there, in [0, 1].
        phase: Index of the contact phase whose feet the side joins.
    """

    sample: IntArray
    normal: FloatArray
    offset: FloatArray
    weight: FloatArray
    phase: IntArray


def make_sides(contacts: ContactPlan, times: FloatArray, guard: float) -> tuple[Sides, Sides]:
    """Every side of every support polygon, at every sample where it has to hold the robot.

    Two feet, while two legs swing, have a line instead of a polygon: one row says where it is, and
    two sides, across it, are at its ends.

    Args:
        contacts: Who stands where, when.
        times: Sampled times (N,) [s].
        guard: Time before lift-off and after touchdown in which the feet that stay have to do
            already [s].

    Returns:
        The sides; and the lines of two feet, to which the weight has no meaning.

    Raises:
        PlanningError: If the standing feet are on one line, though one leg swings at most.
    """
    crossings = _crossings(contacts)
    hulls, spans = [], []
    for phase in contacts.phases:
        hull = phase.corners
        if len(hull) < 3 and len(phase.steps) < 2:
            raise PlanningError("the standing feet are on one line", feet=phase.feet.tolist())
        wide = guard if phase.steps else 0.0
        before = 0.0 if phase.start in crossings else wide
        after = 0.0 if phase.end in crossings else wide
        hulls.append(hull)
        spans.append((phase.start - before - 1e-9, phase.end + after + 1e-9))
    leg = np.concatenate(hulls)
    corners = np.array([len(hull) for hull in hulls])
    ends = np.cumsum(corners)
    following = np.concatenate([leg[1:], leg[:1]])
    following[ends - 1] = leg[ends - corners]
    # Of every phase, sample by sample, all of its sides.
    begin, end = np.array(spans).T
    first, last = times.searchsorted(begin), times.searchsorted(end, side="right")
    rows = (last - first) * corners
    phase_of = np.repeat(np.arange(len(hulls)), rows)
    within = np.arange(len(phase_of)) - np.repeat(np.cumsum(rows) - rows, rows)
    sample = first[phase_of] + within // corners[phase_of]
    side = (ends - corners)[phase_of] + within % corners[phase_of]
    feet = np.stack([phase.feet[:, :2] for phase in contacts.phases])
    corner, next_corner = (feet[phase_of, which[side]] for which in (leg, following))
    if contacts.roll is not None:
        # Where it has to hold already, or still, a foot has rolled as far as in the phase itself.
        spans_of = np.array([(phase.start, phase.end) for phase in contacts.phases])[phase_of]
        at = np.clip(times[sample], *spans_of.T)
        roll, beyond = contacts.roll.at(times)[sample], at != times[sample]
        roll[beyond] = contacts.roll.at(at[beyond])
        rows_of = np.arange(len(sample))
        corner = corner + roll[rows_of, leg[side]]
        next_corner = next_corner + roll[rows_of, following[side]]
    edge = next_corner - corner
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=-1) / np.hypot(*edge.T)[:, None]
    inward = np.sum(normal * corner, axis=1)
    weight = np.ones(len(times))
    for crossing in crossings:
        weight = np.minimum(weight, np.abs(times - crossing) / CROSSING_TIME)
    weight = weight[sample]
    offset = inward - np.where(weight > 0.0, 0.0, NARROW)
    sides = Sides(sample, normal, offset, weight, phase_of)
    two = corners[phase_of] == 2
    if not np.any(two):
        return sides, pick_sides(sides, two)
    # A line is gone along to and fro: from either end a side across it begins there.
    across = np.asarray(edge / np.hypot(*edge.T)[:, None])
    at_ends = replace(sides, normal=across, offset=np.sum(across * corner, axis=1))
    found = join_sides([pick_sides(sides, ~two), pick_sides(at_ends, two)])
    return found, pick_sides(replace(sides, offset=inward), two & (within % corners[phase_of] == 0))


def pick_sides(sides: Sides, which: BoolArray) -> Sides:
    """Some of them."""
    return Sides(*(getattr(sides, f.name)[which] for f in fields(Sides)))


def join_sides(parts: Sequence[Sides]) -> Sides:
    """All of them, in order."""
    return Sides(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Sides)))


def _crossings(contacts: ContactPlan) -> set[float]:
    """When a leg lifts at the instant at which its diagonal lands [s]: both phases' boundary."""
    return {
        t
        for before, after in pairwise(contacts.phases)
        if len(before.steps) == 1
        and len(after.steps) == 1
        and before.steps[0].leg.row + after.steps[0].leg.row == 3
        for t in (before.end, after.start)
    }


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
        sides: The hulls' sides.
        footing: Ground and drives, of which regions are made.
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
    parts.append(pick_sides(sides, kept))
    return join_sides(parts)


def _groups(phase: IntArray, times: FloatArray) -> list[IntArray]:
    """Rows of one phase that follow one another, in groups that share a region."""
    found: list[IntArray] = []
    for mine in np.split(np.arange(len(phase)), np.flatnonzero(np.diff(phase)) + 1):
        since = times[mine] - times[mine[0]]
        count = max(int(np.ceil(since[-1] / HELD)), 1)
        slot = np.minimum((since * count / max(since[-1], 1e-9)).astype(int), count - 1)
        found += np.split(mine, np.flatnonzero(np.diff(slot)) + 1)
    return found


def _corners(stances: Stances, group: IntArray) -> FloatArray | None:
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


def _sides(corners: FloatArray, samples: IntArray, eased: FloatArray, phase: int) -> Sides:
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
