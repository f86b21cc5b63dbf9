"""What is proven of plans on a map that was seen: for all stairs that are believed to be possible.

A map has an interval of 95 % for each nosing's place and height. The widest of those that are
planned on are the sides of a box of stairs. A proof holds for all stairs in the box, and within a
share of the tolerances of tracking, see `certificate.robust`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
import pyarrow as pa

from drake_quad.certificate.kinematics import shank_of
from drake_quad.certificate.robust import prove_within
from drake_quad.certificate.tolerances import Tolerances
from drake_quad.perception.stair_map import StairMap
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.runs.log import columns_of
from drake_quad.runs.metrics import between_samples
from drake_quad.runs.seen import true_crossings
from drake_quad.runs.tracking import DRIFT, lacks_support, limits_of, track
from drake_quad.simulation.plan_report import tolerances_of
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.terrain.course import Course


@dataclass(frozen=True, eq=False)
class MappedStretch:
    """Plans that were made on one map, one after the other.

    Attributes:
        map: The map.
        course: The same as a course.
        plans: The plans.
    """

    map: StairMap
    course: Course
    plans: tuple[MotionPlan, ...]


def stretches_of(p: PreparedScenario, plans: Sequence[MotionPlan]) -> tuple[MappedStretch, ...]:
    """The plans of a run by the map that they were made on, without those made anew on the way.

    Args:
        p: What was prepared, with the map's revisions if it grew.
        plans: The plans of all tasks, and their revisions.
    """
    if p.sight is None or p.sight.map is None or p.sight.refused:
        return ()
    first = [plan for plan in plans if plan.revision == 0]
    maps = [r.map for r in p.revisions if not r.reason] or [p.sight.map]
    found = []
    groups = groupby(first, key=lambda plan: id(plan.course))
    for (_, group), known in zip(groups, maps, strict=False):
        mine = tuple(group)
        course = mine[0].course
        if course is None:
            course = known.course(foot_radius=p.robot.foot_radius)
        found.append(MappedStretch(known, course, mine))
    return tuple(found)


def believed_box(known: StairMap) -> tuple[float, float]:
    """How far a map's nosings that are planned on may be off, in place and in height [m]."""
    return known.error_place, known.error_height


def inside_box(known: StairMap, world: Course, *, drift: float = 0.0) -> bool:
    """Whether the true stairs are in a map's box.

    Args:
        known: The map.
        world: The course as it really is.
        drift: How far the robot was off its place as a whole: to the robot, all stairs are [m].
    """
    count = len(known.places) if known.complete else known.trusted
    direction = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    true = true_crossings(world, known.origin, direction)[:count]
    if len(true) < count:
        return False
    place, height = believed_box(known)
    return bool(
        np.all(np.abs(true[:, 0] - known.places[:count]) + drift <= place)
        and np.all(np.abs(true[:, 1] - known.heights[:count]) <= height)
    )


def prove_believed(p: PreparedScenario, plans: Sequence[MotionPlan]) -> list[dict[str, Any]]:
    """Proves each stretch of a run for all stairs that its map takes for possible.

    Args:
        p: What was prepared, with the map's revisions if it grew.
        plans: The plans of all tasks, and their revisions.

    Returns:
        Of each stretch plain values: `tasks`, how many there are; `place` and `height`, the box
        [m]; `inside`, whether the true stairs are in it; `proven`, the figures that hold for all
        stairs in it, or none; `share` of the tolerances of tracking within which they do; `reason`
        why not within more, empty if within all.
    """
    tracking = replace(tolerances_of(p.scenario.certify.tolerances, p.robot), rise=0.0, run=0.0)
    shank, told = shank_of(p.robot), []
    for stretch in stretches_of(p, plans):
        place, height = believed_box(stretch.map)
        box = Tolerances(run=place, rise=height)
        proof = prove_within(
            p.robot, shank, stretch.plans, stretch.course.boxes, tracking, always=box
        )
        told.append(
            {
                "tasks": len(stretch.plans),
                "place": place,
                "height": height,
                "inside": inside_box(stretch.map, p.world),
                "proven": proof.figures,
                "share": proof.share,
                "reason": proof.failure.reason if proof.failure else "",
            }
        )
    return told


def hold_against(
    proofs: Sequence[Mapping[str, Any]],
    p: PreparedScenario,
    plans: Sequence[MotionPlan],
    table: pa.Table,
    *,
    period: float,
) -> list[dict[str, Any]]:
    """What a run showed of the proofs of its stretches.

    Args:
        proofs: What `prove_believed` returned.
        p: What was prepared, with the map's revisions if it grew.
        plans: The plans that were followed, and their revisions.
        table: Log of the run.
        period: The controller's period [s]; 0 in a replay.

    Returns:
        The proofs, each with `drift`, how far the robot was off its place as a whole [m];
        `run_share`, the share of the tolerances of tracking that the run needed besides, None if it
        stood on fewer feet than planned or was planned anew; `margin`, the least that it had [m];
        `covered`, whether the proof is about what the run did; `kept`, whether it then had the
        margin that is proven, None if it is not covered.
    """
    stretches = stretches_of(p, plans)
    if table.num_rows == 0:
        return [dict(proof) for proof in proofs]
    c = columns_of(table)
    tolerances = tolerances_of(p.scenario.certify.tolerances, p.robot)
    limits = limits_of(replace(tolerances, rise=0.0))
    found = track(c, p.robot, plans, period, drifts=True)
    least, unsupported = between_samples(c, "margin"), lacks_support(c)
    told = []
    for proof, stretch in zip(proofs, stretches, strict=True):
        mine = np.isin(c["task"], [plan.index for plan in stretch.plans])
        most = {name: float(found[name][mine].max(initial=0.0)) for name in limits}
        # Treads that are higher than mapped are in the box, and no matter of tracking.
        most["foot_height_max"] = max(most["foot_height_max"] - stretch.map.error_height, 0.0)
        shares = [most[name] / limits[name] for name in limits]
        planned_anew = np.any(c["plan_revision"][mine] > 0)
        share = None if planned_anew or np.any(unsupported[mine]) else max(shares)
        drift = float(found[DRIFT][mine].max(initial=0.0))
        covered = bool(
            np.any(mine)
            and proof["proven"]
            and share is not None
            and share <= proof["share"]
            and _is_as_filed(p)
            and inside_box(stretch.map, p.world, drift=drift)
        )
        margin = float(np.nanmin(least[mine], initial=np.inf))
        kept = margin >= proof["proven"]["margin"] if covered else None
        told.append(
            {
                **proof,
                "drift": drift,
                "run_share": share,
                "margin": margin if np.isfinite(margin) else None,
                "covered": covered,
                "kept": kept,
            }
        )
    return told


def _is_as_filed(p: PreparedScenario) -> bool:
    """Whether the robot of the run is as its file says, in mass and where it is, and unloaded."""
    there = p.disturbances
    return there.mass_of(p.robot.mass) == p.robot.mass and not any(there.com_offset)
