"""A plan of body and feet at any time.

`ContactPlan` and `BodySpline` are the plan that is read and tested; here the same numbers lie so
that a compiled kernel takes them in one piece.
"""

from dataclasses import dataclass, field, fields
from math import isnan
from typing import Any, NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.math.curves import (
    BodySpline,
    sample_body,
)
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_plan import ContactPlan, FootRoll, roll_feet, sample_times
from drake_quad.planning.phase_table import phase_table, sample_feet
from drake_quad.robot.kinematics import constants, pose
from drake_quad.robot.model import RobotModel
from drake_quad.stability.margin_kinds import HULL
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course
from drake_quad.util.display import one_line

ROUNDED = 2e-9  # [s] by which sampled times may be off the switches that they are
SEGMENT_KINDS = ("stand", "transition", "wave", "trot", "spin")


@dataclass(frozen=True, eq=False)
class Stance:
    """A robot at rest on four feet: the body's pose and the foot sphere centres, in W.

    Attributes:
        body: x, y, z [m], pitch, yaw [rad] of B in W.
        feet: (4, 3) [m].
        roll: How far the feet have rolled since they were set down there (4, 2) [m].
    """

    body: FloatArray
    feet: FloatArray
    roll: FloatArray = field(default_factory=lambda: np.zeros((4, 2)))


@dataclass(frozen=True, eq=False)
class Segment:
    """A named stretch of a plan.

    Attributes:
        name: Name that people read, for example `climb 1`.
        kind: One of SEGMENT_KINDS.
        start: When it begins [s].
        end: When it ends [s].
        details: What more there is to say of it (`steps`, `duty_factor`, ...), for reports.
    """

    name: str
    kind: str
    start: float
    end: float
    details: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PlanSample:
    """What is desired at one gait time. Angles [rad], lengths [m], in W.

    The feet as the controller is to set them down; it lets them roll, which `evaluate` foresees.

    Attributes:
        body: (3, 5) value, velocity and acceleration of x, y, z, pitch, yaw.
        feet: (4, 3) foot sphere centres.
        feet_velocity: (4, 3).
        feet_acceleration: (4, 3).
        standing: (4,) who is to stand.
        swing_phase: Phase of the swing, or of both, in [0, 1], nan if nobody swings.
        phase_index: Index of the contact phase.
    """

    body: FloatArray
    feet: FloatArray
    feet_velocity: FloatArray
    feet_acceleration: FloatArray
    standing: BoolArray
    swing_phase: float
    phase_index: int


class PlanTables(NamedTuple):
    """A plan as the control loop's kernels take it.

    Attributes:
        control: Control points of the body's spline (n, 5).
        knot: Their spacing [s].
        phases: The contact phases, see `phase_table`.
        duration: Duration of the plan [s].
        task: Index of the plan's task in the mission.
        revision: Number of times that the task was planned anew.
    """

    control: FloatArray
    knot: float
    phases: FloatArray
    duration: float
    task: int
    revision: int


@dataclass(frozen=True, eq=False)
class MotionPlan:
    """One task (a walk, a spin, a stand), planned from rest to rest.

    Attributes:
        index: Place of the task in the mission.
        contacts: The feet's part.
        body: The body's part.
        segments: What it is made of, in time order.
        margin: Smallest static margin that the body's program found [m] (sampled; `evaluate`
            gives it at any time); nan of a task in which nothing moves.
        revision: Number of times that the task was planned anew while it was under way.
        margin_kind: Region that the margin is measured in, one of
            `stability.margin_kinds.KINDS`.
        joined: Time from which on the body's height and pitch follow from its place alone [s].
        course: The map that it was made on, where the map grows; None where it is the controller's
            from the beginning.
        goes_on: Whether another task follows, which is not known yet.
        revises_map: Whether the map is revised by what feet have found before the next task.
        tables: The plan as arrays, for kernels.
    """

    index: int
    contacts: ContactPlan
    body: BodySpline
    segments: tuple[Segment, ...]
    margin: float
    revision: int = 0
    margin_kind: str = HULL
    joined: float = 0.0
    course: Course | None = None
    goes_on: bool = False
    revises_map: bool = False
    tables: PlanTables = field(init=False)

    def __post_init__(self) -> None:
        body, phases = self.body, phase_table(self.contacts)
        tables = PlanTables(
            body.control, body.knot, phases, self.duration, self.index, self.revision
        )
        object.__setattr__(self, "tables", tables)

    def __repr__(self) -> str:
        what = self.segments[0].name if self.segments else "nothing"
        margin = "" if isnan(self.margin) else f"static margin {self.margin:.3f} m"
        steps = f"{len(self.contacts.steps)} steps in {self.duration:.1f} s"
        return one_line(self, f"task {self.index + 1}, from '{what}' on", steps, margin)

    def __deepcopy__(self, memo: object) -> "MotionPlan":
        """A plan never changes, so that Drake may copy a Context without copying the plan."""
        return self

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self.contacts.duration

    @property
    def end(self) -> Stance:
        """The stance that it ends in."""
        body = sample_body(self.body.control, self.body.knot, self.duration)[0]
        roll = np.zeros((4, 2))
        if self.contacts.roll is not None:
            roll = self.contacts.roll.at(np.array([self.duration]))[0]
        return Stance(body, self.contacts.final_feet, roll)

    def segment_name(self, t: float) -> str:
        """Name of the segment at time `t` [s]."""
        return self.segments[self.segment_index(t)].name

    def segment_index(self, t: float) -> int:
        """Index of the segment at time `t` [s]."""
        for k, segment in enumerate(self.segments):
            if t < segment.end:
                return k
        return len(self.segments) - 1

    def sample(self, t: float) -> PlanSample:
        """What is desired at gait time `t` [s] since the task began."""
        body = sample_body(self.body.control, self.body.knot, t)
        feet, velocity, acceleration, standing, s, _ = sample_feet(self.tables.phases, t)
        index = self.contacts.phase_index(t)
        return PlanSample(body, feet, velocity, acceleration, standing, s, index)


ALIKE = 1e-6  # [m], [rad], [s] within which plans made from the same stance are the same


def is_same_plan(one: MotionPlan, other: MotionPlan) -> bool:
    """Whether two plans are the same motion, to ALIKE: a run makes each task's plan once more."""
    a, b = one.tables, other.tables
    return (
        (a.task, a.revision, a.control.shape, a.phases.shape)
        == (b.task, b.revision, b.control.shape, b.phases.shape)
        and abs(a.knot - b.knot) <= ALIKE
        and float(np.abs(a.control - b.control).max()) <= ALIKE
        and float(np.abs(a.phases - b.phases).max()) <= ALIKE
    )


@dataclass(frozen=True, eq=False)
class PlanSamples:
    """A plan at many times (N,): the figures that certify it.

    Attributes:
        times: (N,) [s].
        body: (N, 3, 5), see PlanSample.
        feet: (N, 4, 3) [m] in W.
        standing: (N, 4).
        q: (N, 4, 3) joint angles [rad].
        reach_excess: (N, 4) how far a foot is out of its leg's reach [m].
        com: (N, 3) the whole robot's centre of mass in W [m].
        margin: (N,) static margin [m].
    """

    times: FloatArray
    body: FloatArray
    feet: FloatArray
    standing: BoolArray
    q: FloatArray
    reach_excess: FloatArray
    com: FloatArray
    margin: FloatArray

    def every(self, stride: int) -> "PlanSamples":
        """Every so many of them, from the first on."""
        return PlanSamples(**{f.name: getattr(self, f.name)[::stride] for f in fields(self)})


def calc_feet_in_body(body: FloatArray, feet: FloatArray) -> FloatArray:
    """Feet in B (N, 4, 3) [m], of body poses (N, 5) and feet (N, 4, 3) in W."""
    return np.asarray(np.einsum("nji,nlj->nli", rotations(body), feet - body[:, None, :3]))


def pose_robot(
    robot: RobotModel, body: FloatArray, feet: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inverse kinematics and centre of mass of many poses at once.

    Args:
        robot: The robot.
        body: (N, 5) body poses in W.
        feet: (N, 4, 3) feet in W [m].

    Returns:
        q (N, 4, 3) [rad], excess of reach (N, 4) [m], centre of mass in W (N, 3) [m].
    """
    # Copies: kernels are compiled anew for arrays that are read-only.
    return pose(*constants(robot), np.array(body, order="C"), np.array(feet, order="C"))


def roll_along(
    robot: RobotModel,
    contacts: ContactPlan,
    path: BodySpline,
    times: FloatArray,
    begin: FloatArray,
) -> ContactPlan:
    """The contacts, with feet that roll as they do along a path.

    Args:
        robot: The robot.
        contacts: Who stands where, when; how its feet rolled along another path is a beginning.
        path: The body's path.
        times: Times at which it is sampled, every lift-off and touchdown among them (N,) [s].
        begin: How far they have rolled before (4, 2) [m].
    """
    body = path.samples(times)[:, 0]
    feet, _ = contacts.feet_at(times)
    _, standing = contacts.feet_at(times + ROUNDED)  # a switch belongs to what follows it
    standing[-1] = True  # also where a plan ends as a foot touches down
    q, _, _ = pose_robot(robot, body, feet)
    roll = roll_feet(robot, times, body, q, standing, begin)
    fewer = sample_times(contacts, path.knot)  # a certificate's pieces end at each
    return contacts.rolled(FootRoll(fewer, roll.at(fewer)))


def evaluate(robot: RobotModel, plan: MotionPlan, times: FloatArray) -> PlanSamples:
    """The plan at `times` (N,) [s], with joint angles, centre of mass and static margin."""
    body = plan.body.samples(times)
    feet, standing = plan.contacts.feet_at(times)
    q, excess, com = pose_robot(robot, body[:, 0], feet)
    margin = stability_margins(com[:, :2], feet[..., :2], standing)
    return PlanSamples(times, body, feet, standing, q, excess, com, margin)
