"""Body and feet of a plan at any time, and the kernels that sample its table.

`ContactPlan` and `BodySpline` are the plan that is read and tested; here the same numbers lie so
that a compiled kernel takes them in one piece.
"""

from dataclasses import dataclass, field, fields
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.jit import jit
from drake_quad.math.curves import (
    BodySpline,
    quintic_acceleration_kernel,
    quintic_kernel,
    quintic_rate_kernel,
    sample_body,
)
from drake_quad.math.rotations import rotations
from drake_quad.planning.contact_plan import MOST_SWINGS, ContactPlan
from drake_quad.robot.kinematics import constants, pose
from drake_quad.robot.model import RobotModel
from drake_quad.stability.equilibrium_region import HULL
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course

# Columns of the table of phases: times [s], who stands (4), the feet (12) [m], and from SWING on
# the swings of MOST_SWINGS legs, SWING_COLUMNS each.
START, END, STANDING, FEET, SWING = 0, 1, 2, 6, 18
# Columns of one swing, from its first on: the row of the leg (-1 for none), from (3), to (3) [m],
# how long, when the apex [s], its height [m], and its arc: pivot (2) [m], turn [rad] (0: it goes
# straight), end over start distance.
FROM, TO, DURATION, APEX_TIME, APEX_Z, PIVOT, TURN, FARTHER = 1, 4, 7, 8, 9, 10, 12, 13
SWING_COLUMNS = 14
COLUMNS = SWING + MOST_SWINGS * SWING_COLUMNS


def phase_table(contacts: ContactPlan) -> FloatArray:
    """The phases of a contact plan as rows (n, COLUMNS), read-only."""
    table = np.zeros((len(contacts.phases), COLUMNS))
    for row, phase in zip(table, contacts.phases, strict=True):
        row[START], row[END] = phase.start, phase.end
        row[STANDING:FEET] = phase.standing
        row[FEET:SWING] = phase.feet.ravel()
        swings = row[SWING:].reshape(MOST_SWINGS, SWING_COLUMNS)
        swings[:, 0] = -1.0
        for mine, step in zip(swings, phase.steps, strict=False):
            swing = step.swing
            mine[0] = step.leg.row
            mine[FROM:TO], mine[TO:DURATION] = swing.p_start, swing.p_end
            mine[DURATION:PIVOT] = swing.duration, swing.apex_time, swing.apex_z
            mine[PIVOT:] = swing.arc
    return read_only(table)


@jit
def phase_index(phases: FloatArray, t: float) -> int:
    """Index of the phase at time `t` [s]; the first or last one outside of the plan."""
    low, high = 0, len(phases)
    while low < high:
        middle = (low + high) // 2
        if t < phases[middle, START]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


class PlannedFeet(NamedTuple):
    """The feet of a plan at one gait time, in W.

    Attributes:
        place: Places (4, 3) [m].
        velocity: First derivatives by gait time (4, 3).
        acceleration: Second derivatives by gait time (4, 3).
        standing: Which feet stand (4,).
        swing_phase: Phase of the swing, or of both, in [0, 1], nan if nobody swings.
        phase_rate: Its derivative by gait time [1/s], 0 if nobody swings.
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    standing: BoolArray
    swing_phase: float
    phase_rate: float


@jit
def sample_feet(phases: FloatArray, t: float) -> PlannedFeet:
    """The feet at gait time `t` [s] of a plan with these phases, see `phase_table`."""
    row = phases[phase_index(phases, t)]
    place, velocity, acceleration = np.empty((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))
    standing = np.empty(4, dtype=np.bool_)
    for k in range(4):
        standing[k] = row[STANDING + k] > 0.5
        for i in range(3):
            place[k, i] = row[FEET + 3 * k + i]
    if row[SWING] < 0.0:
        return PlannedFeet(place, velocity, acceleration, standing, np.nan, 0.0)
    for n in range(MOST_SWINGS):
        swing = row[SWING + n * SWING_COLUMNS : SWING + (n + 1) * SWING_COLUMNS]
        k = int(swing[0])
        if k >= 0:
            _sample_swing(swing, t - row[START], place[k], velocity[k], acceleration[k])
    rate = 1.0 / (row[END] - row[START])
    phase = (t - row[START]) * rate
    return PlannedFeet(place, velocity, acceleration, standing, phase, rate)


@jit
def swing_rows(row: FloatArray) -> tuple[int, int]:
    """The rows of the legs that swing in a phase of the table, -1 for none."""
    return int(row[SWING]), int(row[SWING + SWING_COLUMNS])


@jit
def _sample_swing(
    row: FloatArray,
    since: float,
    place: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Writes a foot's place (3,) and its derivatives, `since` [s] its lift-off, of one swing."""
    since = min(max(since, 0.0), row[DURATION])
    scale = 1.0 / row[DURATION]
    s = since * scale
    for i in range(2):
        way = row[TO + i] - row[FROM + i]
        place[i] = row[FROM + i] + way * quintic_kernel(s)
        velocity[i] = way * (quintic_rate_kernel(s) * scale)
        acceleration[i] = way * (quintic_acceleration_kernel(s) * scale * scale)
    if row[TURN] != 0.0:
        _round_pivot(row, s, scale, place, velocity, acceleration)
    apex_time, apex = row[APEX_TIME], row[APEX_Z]
    if since <= apex_time:
        scale, base, rise = 1.0 / apex_time, row[FROM + 2], apex - row[FROM + 2]
    else:
        scale, base, rise = 1.0 / (row[DURATION] - apex_time), apex, row[TO + 2] - apex
        since -= apex_time
    s = since * scale
    place[2] = base + rise * quintic_kernel(s)
    velocity[2] = rise * quintic_rate_kernel(s) * scale
    acceleration[2] = rise * quintic_acceleration_kernel(s) * scale * scale


@jit
def _round_pivot(
    row: FloatArray,
    s: float,
    scale: float,
    place: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Writes x and y of a swing along an arc at phase `s`, see `gait.swing.Swing.sample`."""
    turn, more = row[TURN], row[FARTHER] - 1.0
    q, dq, ddq = (
        quintic_kernel(s),
        quintic_rate_kernel(s) * scale,
        quintic_acceleration_kernel(s) * scale * scale,
    )
    grown, c, n = 1.0 + more * q, cos(turn * q), sin(turn * q)
    x0, y0 = row[FROM] - row[PIVOT], row[FROM + 1] - row[PIVOT + 1]
    out_x, out_y = c * x0 - n * y0, n * x0 + c * y0  # as far out as it began
    rate_x, rate_y = more * out_x - turn * grown * out_y, more * out_y + turn * grown * out_x
    bend_x = -turn * turn * grown * out_x - 2.0 * turn * more * out_y
    bend_y = -turn * turn * grown * out_y + 2.0 * turn * more * out_x
    place[0], place[1] = row[PIVOT] + grown * out_x, row[PIVOT + 1] + grown * out_y
    velocity[0], velocity[1] = rate_x * dq, rate_y * dq
    acceleration[0] = bend_x * dq * dq + rate_x * ddq
    acceleration[1] = bend_y * dq * dq + rate_y * ddq


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
            gives it at any time).
        revision: Number of times that the task was planned anew while it was under way.
        margin_kind: Region that the margin is measured in, one of
            `stability.equilibrium_region.KINDS`.
        joined: Time from which on the body's height and pitch follow from its place alone [s].
        course: The map that it was made on, where the map grows; None where it is the controller's
            from the beginning.
        goes_on: Whether another task follows, which is not known yet.
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
    tables: PlanTables = field(init=False)

    def __post_init__(self) -> None:
        body, phases = self.body, phase_table(self.contacts)
        tables = PlanTables(
            body.control, body.knot, phases, self.duration, self.index, self.revision
        )
        object.__setattr__(self, "tables", tables)

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


def evaluate(robot: RobotModel, plan: MotionPlan, times: FloatArray) -> PlanSamples:
    """The plan at `times` (N,) [s], with joint angles, centre of mass and static margin."""
    body = plan.body.samples(times)
    feet, standing = plan.contacts.feet_at(times)
    q, excess, com = pose_robot(robot, body[:, 0], feet)
    margin = stability_margins(com[:, :2], feet[..., :2], standing)
    return PlanSamples(times, body, feet, standing, q, excess, com, margin)
