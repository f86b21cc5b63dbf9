"""The sides of the support polygons, as rows of the body's program.

Where a leg lifts at the instant at which its diagonal lands, the two support triangles share that
diagonal alone: any path's margin is zero there (the wave gait at β = 0.75, twice a cycle). The
margin asked for falls to zero towards such a switch, so that it does not have to be zero elsewhere.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan

NARROW = 1e-5  # [m] beside such a diagonal: an interior-point solver needs an inside
CROSSING_TIME = 0.5  # [s] to either side of such a switch in which the margin is to be reached


@dataclass(frozen=True, eq=False)
class Sides:
    """Rows (k,), one for each side at each sample where it has to hold the robot.

    Attributes:
        sample: Index of the sampled time.
        normal: Inward unit normal, (k, 2).
        offset: Inward distance of the side from W's origin [m].
        weight: Of the margin asked for, in [0, 1].
        phase: Index of the contact phase whose feet it is of.
    """

    sample: NDArray[np.intp]
    normal: FloatArray
    offset: FloatArray
    weight: FloatArray
    phase: NDArray[np.intp]


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
        hull = phase.corners
        if len(hull) < 3:
            raise PlanningError("the standing feet are on one line", feet=phase.feet.tolist())
        wide = 0.0 if phase.step is None else guard
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
        roll = contacts.roll.at(times)
        corner, next_corner = (
            at + roll[sample, which[side]]
            for at, which in ((corner, leg), (next_corner, following))
        )
    edge = next_corner - corner
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=-1) / np.hypot(*edge.T)[:, None]
    inward = np.sum(normal * corner, axis=1)
    weight = np.ones(len(times))
    for crossing in crossings:
        weight = np.minimum(weight, np.abs(times - crossing) / CROSSING_TIME)
    weight = weight[sample]
    return Sides(sample, normal, inward - np.where(weight > 0.0, 0.0, NARROW), weight, phase_of)


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
