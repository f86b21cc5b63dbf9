"""The sides of the support polygons, as rows of the body's program.

Where a leg lifts at the instant at which its diagonal lands, the two support triangles share that
diagonal alone: any path's margin is zero there (the wave gait at β = 0.75, twice a cycle). The
margin asked for falls to zero towards such a switch, so that it does not have to be zero elsewhere.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray
from drake_quad.gait.support import support_polygon
from drake_quad.planning.contact_plan import ContactPlan

CROSSING_TIME = 0.5  # [s] to either side of such a switch in which the margin is to be reached


@dataclass(frozen=True, eq=False)
class Sides:
    """Rows (k,), one for each side at each sample where it has to hold the robot.

    Attributes:
        sample: Index of the sampled time.
        normal: Inward unit normal, (k, 2).
        offset: Inward distance of the side from W's origin [m].
        weight: Of the margin asked for, in [0, 1].
    """

    sample: FloatArray
    normal: FloatArray
    offset: FloatArray
    weight: FloatArray


def make_sides(contacts: ContactPlan, times: FloatArray, guard: float) -> Sides:
    """Every side of every support polygon, at every sample where it has to hold the robot.

    Args:
        contacts: Who stands where, when.
        times: Sampled times (N,) [s].
        guard: For how long before lift-off and after touchdown three feet have to do already [s].

    Raises:
        PlanningError: If the standing feet are on one line.
    """
    crossings = _crossings(contacts)
    hulls, spans = [], []
    for phase in contacts.phases:
        hull = support_polygon(phase.feet[phase.standing, :2])
        if len(hull) < 3:
            raise PlanningError("the standing feet are on one line", feet=phase.feet.tolist())
        wide = 0.0 if phase.step is None else guard
        before = 0.0 if phase.start in crossings else wide
        after = 0.0 if phase.end in crossings else wide
        hulls.append(hull)
        spans.append((phase.start - before - 1e-9, phase.end + after + 1e-9))
    corner, following = (
        np.concatenate(hulls),
        np.concatenate([np.roll(h, -1, axis=0) for h in hulls]),
    )
    edge = following - corner
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=-1) / np.hypot(*edge.T)[:, None]
    inward = np.sum(normal * corner, axis=1)
    # Of every phase, sample by sample, all of its sides.
    begin, end = np.array(spans).T
    first, last = times.searchsorted(begin), times.searchsorted(end, side="right")
    corners = np.array([len(hull) for hull in hulls])
    rows = (last - first) * corners
    phase_of = np.repeat(np.arange(len(hulls)), rows)
    within = np.arange(len(phase_of)) - np.repeat(np.cumsum(rows) - rows, rows)
    sample = first[phase_of] + within // corners[phase_of]
    side = (np.cumsum(corners) - corners)[phase_of] + within % corners[phase_of]
    weight = np.ones(len(times))
    for crossing in crossings:
        weight = np.minimum(weight, np.abs(times - crossing) / CROSSING_TIME)
    return Sides(sample, normal[side], inward[side], weight[sample])


def _crossings(contacts: ContactPlan) -> set[float]:
    """When a leg lifts at the instant at which its diagonal lands [s]: both phases' boundary."""
    return {
        t
        for before, after in pairwise(contacts.phases)
        if before.step is not None
        and after.step is not None
        and before.step.leg.row + after.step.leg.row == 3
        for t in (before.end, after.start)
    }
