"""How fast a plan goes along the flights of its course, and which limit is nearest to it.

A joint's speed is looked at 24 times in every swing and over 2 ms: a swing's peak may last for a
twentieth of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.planning.contact_plan import sample_times, swing_times
from drake_quad.planning.mission import MissionPlan
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.planning.problem import Task
from drake_quad.planning.zmp import sample_zmp
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course

PER_SWING = 24  # moments of every swing at which joints' speeds are looked at
HALF = 1e-3  # [s] before and after such a moment
ZMP_EVERY = 0.02  # [s] between the samples of the zero-moment point
ALONG = 0.02  # [s] between the samples of the body's way along a flight
SPEED_SPARE = 0.2  # of a joint's speed limit that is wanted to be left
JOINTS = ("abduction", "hip", "knee")


@dataclass(frozen=True)
class FlightPace:
    """How fast a plan goes along one flight.

    Attributes:
        task: The task's name.
        going: `up` or `down`.
        length: Length of all of the flight's treads along the lane [m].
        time: Time that the body takes for that length, from half a tread before the first riser to
            half a tread beyond the last [s].
        speed: The one over the other [m/s].
    """

    task: str
    going: str
    length: float
    time: float
    speed: float


@dataclass(frozen=True)
class JointPeak:
    """Where a plan asks for the most of a joint's speed.

    Attributes:
        joint: The joint's name in the robot's file.
        leg: The leg, such as `RL`.
        kind: One of JOINTS.
        speed: Speed that the plan asks for [rad/s].
        limit: The joint's limit [rad/s].
        swing: Whether the leg swings at that moment.
        task: The task's name.
        time: Time in the task [s].
    """

    joint: str
    leg: str
    kind: str
    speed: float
    limit: float
    swing: bool
    task: str
    time: float

    @property
    def share(self) -> float:
        """The speed over its limit."""
        return self.speed / self.limit

    @property
    def words(self) -> str:
        """The joint and the moment, for people."""
        when = "in swing" if self.swing else "while its foot stands"
        return f"{self.kind} speed of {self.leg} {when}"


@dataclass(frozen=True)
class PlanPace:
    """How fast a plan is, and what that asks of the robot.

    Attributes:
        flights: Each flight of the course in the order in which it is walked.
        peak: The most that is asked of any joint's speed.
        zmp_margin: Least margin of the zero-moment point over the standing feet, all links moving
            [m]; infinite if nothing moves.
    """

    flights: tuple[FlightPace, ...]
    peak: JointPeak | None
    zmp_margin: float

    @property
    def slowest(self) -> FlightPace | None:
        """The flight with the least speed; None if there is no flight."""
        return min(self.flights, key=lambda f: f.speed, default=None)


def measure_pace(
    robot: RobotModel, course: Course, tasks: Sequence[Task], mission: MissionPlan
) -> PlanPace:
    """Measures how fast a mission's plans are on the flights, and what they ask of the joints.

    Args:
        robot: The robot.
        course: The ground.
        tasks: The mission's tasks.
        mission: Their plans.
    """
    flights: list[FlightPace] = []
    peak, zmp = None, np.inf
    for plan in mission.plans:
        task = tasks[plan.index]
        if task.kind == "walk":
            flights += flight_paces(course, task, plan)
        if plan.contacts.steps:
            mine = joint_peak(robot, task, plan)
            peak = mine if peak is None or mine.share > peak.share else peak
            zmp = min(zmp, zmp_margin(robot, plan))
    return PlanPace(tuple(flights), peak, zmp)


def zmp_margin(robot: RobotModel, plan: MotionPlan) -> float:
    """Least margin of the zero-moment point of a task's plan, every ZMP_EVERY [m]."""
    return float(sample_zmp(robot, plan.contacts, plan.body, ZMP_EVERY).margin.min())


def flight_paces(course: Course, task: Task, plan: MotionPlan) -> list[FlightPace]:
    """How fast a walk's plan goes along each flight of its lane."""
    lane = course.lanes[task.lane]
    times = np.linspace(0.0, plan.duration, int(np.ceil(plan.duration / ALONG)) + 2)
    along, _ = lane.coordinates(plan.body.samples(times)[:, 0, :2])
    farthest = np.maximum.accumulate(along)  # a body that sways back has been there already
    found = []
    for flight in lane.flights:
        breaks = lane.breaks[flight.first : flight.last + 2]
        first, last = float(breaks[0]), float(breaks[-2])
        run = float(np.mean(np.diff(breaks)))
        start, end = first - 0.5 * run, last + 0.5 * run
        if farthest[-1] < end or farthest[0] > start:
            continue  # the walk begins or ends on it
        begun, ended = (float(np.interp(s, farthest, times)) for s in (start, end))
        took, length = ended - begun, end - start
        found.append(FlightPace(task.name, flight.going, length, took, length / took))
    return found


FINER = 33  # samples around the one at which a joint is quickest


def joint_peak(robot: RobotModel, task: Task, plan: MotionPlan) -> JointPeak:
    """The most that a plan asks of any joint's speed, against its limit."""
    times = np.union1d(sample_times(plan.contacts), swing_times(plan.contacts, PER_SWING))
    times = times[(times > HALF) & (times < plan.duration - HALF)]
    most = int(np.argmax((joint_speeds(robot, plan, times)[0] / robot.speed).max(axis=1)))
    # Between these samples it may be a little more.
    times = np.linspace(times[max(most - 1, 0)], times[min(most + 1, len(times) - 1)], FINER)
    speed, standing = joint_speeds(robot, plan, times)
    share = speed / robot.speed
    k, j = np.unravel_index(int(np.argmax(share)), share.shape)
    row = int(j) // 3
    return JointPeak(
        joint=robot.joint_names[j],
        leg=LEGS[row].short,
        kind=JOINTS[int(j) % 3],
        speed=float(speed[k, j]),
        limit=float(robot.speed[j]),
        swing=not standing[k, row],
        task=task.name,
        time=float(times[k]),
    )


def joint_speeds(
    robot: RobotModel, plan: MotionPlan, times: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Speeds of the joints (N, 12) [rad/s] at times (N,) [s], and which feet stand (N, 4)."""
    before, after = (evaluate(robot, plan, times + d) for d in (-HALF, HALF))
    moved = np.abs(after.q - before.q).reshape(len(times), 12)
    return moved / (2.0 * HALF), before.standing & after.standing


@dataclass(frozen=True)
class NearestLimit:
    """The limit that a plan comes nearest to.

    Attributes:
        limit: `margin`, `zmp`, `speed`, `torque` or `clearance`.
        words: What and where, for people.
        left: What is left of it, over what is wanted to be left; less than 1 is less than wanted.
    """

    limit: str
    words: str
    left: float


def nearest_limit(
    pace: PlanPace,
    *,
    margin: float | None,
    torque: float,
    room: float,
    part: str,
    wanted: dict[str, float],
) -> NearestLimit:
    """Says which limit a plan comes nearest to, each measured by what is wanted to be left of it.

    Args:
        pace: What the plan asks of the joints, and its zero-moment point.
        margin: The plan's least static margin [m]; None if it is balanced by its motion.
        torque: Smallest share of a joint's torque limit that is left.
        room: The plan's least weighted clearance from the stairs [m].
        part: The part of the robot that this is of.
        wanted: What is wanted to be left of each, by `objective.NAMES`.
    """
    bounds = [
        NearestLimit("zmp", "margin of the zero-moment point", pace.zmp_margin / wanted["margin"]),
        NearestLimit("torque", "torque of a joint at rest", torque / wanted["torque"]),
        NearestLimit("clearance", f"clearance of {part}", room / wanted["legs"]),
    ]
    if margin is not None:
        bounds.insert(0, NearestLimit("margin", "static margin", margin / wanted["margin"]))
    if pace.peak is not None:
        left = (1.0 - pace.peak.share) / SPEED_SPARE
        bounds.append(NearestLimit("speed", pace.peak.words, left))
    return min(bounds, key=lambda b: b.left)
