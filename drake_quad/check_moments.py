"""Which moments of a planned mission show how it climbs: a cycle amid a flight up, and one down."""

from dataclasses import dataclass

import numpy as np

from drake_quad.designer_plan import Designed
from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.planning.motion_plan import MotionPlan, Segment
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario import course_of, mission_of
from drake_quad.terrain import Lane

MOMENTS = 6  # of a cycle
SEARCH = 400  # samples of a walk among which the middle of a flight is sought


@dataclass(frozen=True, eq=False)
class Stretch:
    """A cycle of a walk.

    Attributes:
        going: `up`, `down` or `on`.
        plan: The walk's.
        lane: That it is on.
        start: When the cycle begins, in the plan's time [s].
        cycle_time: How long it is [s].
        times: The moments (MOMENTS,), in the plan's time [s].
        in_air: Who is in the air at each, by its short name; empty if nobody.
    """

    going: str
    plan: MotionPlan
    lane: Lane
    start: float
    cycle_time: float
    times: FloatArray
    in_air: tuple[str, ...]


def find_stretches(designed: Designed, robot: RobotModel) -> tuple[Stretch, ...]:
    """A cycle amid the first flight up and one amid the first down; of a walk if there is none."""
    scenario = designed.scenario
    course = course_of(scenario, source="check", foot_radius=robot.foot_radius)
    walks = [
        (plan, course.lanes[task.lane], segment)
        for task, plan in zip(
            mission_of(scenario, course, source="check"), designed.plan.plans, strict=True
        )
        for segment in plan.segments
        if segment.kind == "wave"
    ]
    found: dict[str, Stretch] = {}
    for plan, lane, segment in walks:
        for flight in lane.flights:
            treads = lane.treads(flight)
            middle = 0.5 * float(treads[0, 0] + treads[-1, 1])
            if flight.going not in found:
                found[flight.going] = _cycle(flight.going, plan, lane, segment, middle)
    if not found and walks:
        plan, lane, segment = walks[0]
        found["on"] = _cycle("on", plan, lane, segment, 0.5 * lane.length)
    return tuple(found[going] for going in ("up", "down", "on") if going in found)


def _cycle(going: str, plan: MotionPlan, lane: Lane, segment: Segment, middle: float) -> Stretch:
    """The cycle in which the body is nearest to a place along the lane [m]."""
    times = np.linspace(segment.start, segment.end, SEARCH)
    s, _ = lane.coordinates(plan.body.samples(times)[:, 0, :2])
    cycle = float(segment.details["cycle_time"])
    whole = (float(times[int(np.argmin(np.abs(s - middle)))]) - segment.start) // cycle
    last = max((segment.end - segment.start) // cycle - 1.0, 0.0)
    start = segment.start + min(whole, last) * cycle
    moments = start + cycle * (np.arange(MOMENTS) + 0.5) / MOMENTS
    standing = plan.contacts.feet_at(moments)[1]
    names = tuple("".join(n for n, on in zip(SHORT_NAMES, s, strict=True) if not on)
                  for s in standing)  # fmt: skip
    return Stretch(going, plan, lane, start, cycle, moments, names)
