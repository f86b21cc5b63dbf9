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
from drake_quad.common import BoolArray, FloatArray
from drake_quad.perception.stair_map import StairMap
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.log import columns_of
from drake_quad.runs.metrics import between_samples
from drake_quad.runs.schema import Columns
from drake_quad.runs.seen import true_crossings
from drake_quad.runs.tracking import DRIFT, LIFT, lacks_foot, lacks_support, limits_of, track
from drake_quad.simulation.plan_report import tolerances_of
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain.course import Course

ROUNDING = 1e-9  # by which a share may be passed, and of [m], [deg], [s] what counts as nothing
# What a run adds to a proof.
HELD = ("drift", "run_share", "unproven_time", "margin", "covered", "kept")


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


def inside_box(
    known: StairMap,
    world: Course,
    *,
    drift: float = 0.0,
    lifts: tuple[float, float] = (0.0, 0.0),
    reach: float = 0.0,
) -> bool:
    """Whether the true stairs are in a map's box, along its lane and at both sides of it.

    Whether treads overhang, or have nothing between them, is not compared.

    Args:
        known: The map.
        world: The course as it really is.
        drift: How far the robot was off its place as a whole: to the robot, all stairs are [m].
        lifts: By how much it was higher than planned as a whole, at least and at most [m].
        reach: How far from the middle of the lane feet are put down [m].
    """
    count = len(known.places) if known.complete else known.trusted
    direction = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    across = np.array([-direction[1], direction[0]])
    place, height = believed_box(known)
    for aside in {-reach, 0.0, reach}:
        true = true_crossings(world, known.origin + aside * across, direction)
        end = known.places[-1] + known.elements[2].length if known.complete else np.inf
        more = count < len(true) and known.complete and true[count, 0] < end
        if len(true) < count or more:
            return False
        off = true[:count] - np.column_stack([known.places, known.heights])[:count]
        if np.any(np.abs(off[:, 0]) + drift > place):
            return False
        if any(np.any(np.abs(off[:, 1] - lift) > height) for lift in lifts):
            return False
    return True


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
        stood on fewer feet than planned or was planned anew; `unproven_time`, for how long a foot
        did not bear that was to stand, which the proof leaves out [s]; `margin`, the least that the
        run had [m]; `covered`, whether the proof is about the rest of what the run did; `kept`,
        whether it had the margin then that is proven, None if it is not covered.
    """
    told = [{**proof, **dict.fromkeys(HELD), "covered": False} for proof in proofs]
    if table.num_rows == 0:
        return told
    c = columns_of(table)
    tolerances = tolerances_of(p.scenario.certify.tolerances, p.robot)
    limits = limits_of(replace(tolerances, rise=0.0))
    found = track(c, p.robot, plans, period, drifts=True)
    found["foot_height_max"] = _over_ground(c, p.world)
    least = between_samples(c, "margin")
    for one, stretch in zip(told, stretches_of(p, plans), strict=True):
        mine = np.isin(c["task"], [plan.index for plan in stretch.plans])
        if not np.any(mine):
            continue
        # What was least since the sample before the first one is of the stretch before.
        margins = np.append(c["margin"][mine][0], least[mine][1:])
        margin = float(np.min(margins))
        drift = float(found[DRIFT][mine].max())
        lift = found[LIFT][mine]
        share = _share(found, limits, mine)
        late = tolerances.late * one["share"]
        lost = lacks_support(c)[mine] | (c["plan_revision"][mine] > 0)
        # The proof counts on a foot until it is to lift off, and feet are unloaded before that.
        unproven = lacks_foot(c, late)[mine]
        one["unproven_time"] = float(np.diff(c["t"], prepend=c["t"][0])[mine][unproven].sum())
        one["drift"], one["margin"] = drift, margin if np.isfinite(margin) else None
        one["run_share"] = None if np.any(lost) or not np.isfinite(share) else share
        one["covered"] = bool(
            one["proven"]
            and one["run_share"] is not None
            and share <= one["share"] + ROUNDING
            and one["margin"] is not None
            and _is_as_filed(p.disturbances)
            and inside_box(
                stretch.map, p.world, drift=drift,
                lifts=(float(lift.min()), float(lift.max())), reach=_reach(stretch),
            )
        )  # fmt: skip
        if one["covered"]:
            proven = margins[~unproven]
            one["kept"] = bool(np.all(proven >= one["proven"]["margin"]))
    return told


def _share(found: Mapping[str, FloatArray], limits: Mapping[str, float], mine: BoolArray) -> float:
    """The least that all tolerances can be multiplied by so that these samples are within them."""
    most = {name: float(np.max(found[name][mine])) for name in limits}
    shares = [
        most[name] / limits[name] if limits[name] > 0.0 else np.inf
        for name in limits
        if not most[name] <= ROUNDING
    ]
    return float(np.max(shares)) if shares else 0.0


def _over_ground(c: Columns, world: Course) -> FloatArray:
    """How far standing feet are over the true ground, or in it, at most (N,) [m].

    Where a tread is off is a matter of the box, and no error of tracking.
    """
    found = np.zeros(len(c["t"]))
    for leg in SHORT_NAMES:
        x, y, z = (c[f"{leg}_position_{k}"] for k in "xyz")
        stands = (c[f"{leg}_standing_planned"] > 0.5) & (c[f"{leg}_bearing"] > 0.5)
        off = np.abs(z - world.height(x, y))
        found = np.maximum(found, np.where(stands & np.isfinite(off), off, 0.0))
    return found


def _reach(stretch: MappedStretch) -> float:
    """How far from the middle of its lane a stretch's plans put feet down [m]."""
    known = stretch.map
    steps = [step.swing.p_end for plan in stretch.plans for step in plan.contacts.steps]
    across = np.array([-np.sin(known.yaw), np.cos(known.yaw)])
    aside = (np.reshape(steps, (-1, 3))[:, :2] - known.origin) @ across
    return float(np.abs(aside).max(initial=0.0))


def _is_as_filed(there: Disturbances) -> bool:
    """Whether robot and drives of a run are as the robot's file says, and carry nothing."""
    strengths = there.motor_strength.values()
    return (
        there.mass_factor == 1.0
        and there.payload_mass == 0.0
        and not any(there.com_offset)
        and all(strength == 1.0 for strength in strengths)
    )
