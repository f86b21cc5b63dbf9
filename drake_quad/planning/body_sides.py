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
    samples, normals, offsets, weights = [], [], [], []
    crossings = _crossings(contacts)
    for phase in contacts.phases:
        hull = support_polygon(phase.feet[phase.standing, :2])
        if len(hull) < 3:
            raise PlanningError("the standing feet are on one line", feet=phase.feet.tolist())
        edge = np.roll(hull, -1, axis=0) - hull
        normal = np.stack([-edge[:, 1], edge[:, 0]], axis=-1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        wide = 0.0 if phase.step is None else guard
        before = 0.0 if phase.start in crossings else wide
        after = 0.0 if phase.end in crossings else wide
        mine = np.flatnonzero(
            (times >= phase.start - before - 1e-9) & (times <= phase.end + after + 1e-9)
        )
        weight = np.ones(len(mine))
        for crossing in crossings:
            weight = np.minimum(weight, np.abs(times[mine] - crossing) / CROSSING_TIME)
        weights.append(np.repeat(weight, len(hull)))
        samples.append(np.repeat(mine, len(hull)))
        normals.append(np.tile(normal, (len(mine), 1)))
        offsets.append(np.tile(np.einsum("ij,ij->i", normal, hull), len(mine)))
    return Sides(
        np.concatenate(samples),
        np.concatenate(normals),
        np.concatenate(offsets),
        np.concatenate(weights),
    )


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
