"""Where the feet of a plan are at any time: steps, phases, and feet that roll.

One leg swings at a time, or two that lift off together and land together (a trot's diagonal pair).
"""

from bisect import bisect_right
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import BoolArray, FloatArray, IntArray, read_only
from drake_quad.gait.swing import Swing, swing_positions
from drake_quad.jit import jit
from drake_quad.math.curves import quintic
from drake_quad.robot.legs import Leg
from drake_quad.robot.model import RobotModel
from drake_quad.stability.support_polygon import support_order


@dataclass(frozen=True, eq=False)
class FootRoll:
    """Displacements of the feet from where they were set down.

    Attributes:
        times: (N,) [s].
        offset: (N, 4, 2) in W [m], linear in between; of a foot in the air that of its lift-off.
    """

    times: FloatArray
    offset: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """The displacements (M, 4, 2) [m] at `times` (M,) [s]."""
        flat = self.offset.reshape(len(self.times), 8)
        columns = [np.interp(times, self.times, flat[:, k]) for k in range(8)]
        return np.stack(columns, axis=-1).reshape(-1, 4, 2)


# A swing foot is back on its planned way at 1 / LET_GO of its swing: before it is beside a nosing
# that the way itself only just clears.
LET_GO = 3.0
SAMPLE_PERIOD = 0.1  # [s] at which plans are looked at, and the body's program has its rows
MOST_SWINGS = 2  # legs in the air at once
SAME_TIME = 1e-9  # [s] within which two switches are one


@dataclass(frozen=True, eq=False)
class Step:
    """One swing of one leg. Points are foot sphere centres in W [m], times are in the plan [s]."""

    leg: Leg
    lift_off: float
    touchdown: float
    swing: Swing

    @property
    def back(self) -> float:
        """Time after lift-off at which the foot has lost what it had rolled [s]."""
        return (self.touchdown - self.lift_off) / LET_GO


@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of time [s] with one set of standing feet, all at rest in W.

    Attributes:
        start: When it begins [s].
        end: When it ends [s].
        standing: Who stands, (4,).
        feet: Where each foot stands, or (swing leg) stood last, (4, 3) [m].
        steps: The steps under way: none, one, or two that last from its start to its end.
    """

    start: float
    end: float
    standing: BoolArray
    feet: FloatArray
    steps: tuple[Step, ...] = ()

    @property
    def step(self) -> Step | None:
        """The step under way where one leg swings at most; None if all stand.

        Raises:
            ValueError: Two legs swing.
        """
        if len(self.steps) > 1:
            raise ValueError(f"{len(self.steps)} legs swing from {self.start} s on: see `steps`")
        return self.steps[0] if self.steps else None

    @cached_property
    def corners(self) -> IntArray:
        """Rows of the legs at the corners of its support polygon, counterclockwise."""
        rows = np.flatnonzero(self.standing)
        return rows[support_order(self.feet[rows, :2])]


@dataclass(frozen=True, eq=False)
class ContactPlan:
    """Steps in time order, from a stance of four feet at t = 0.

    One leg is in the air at most, or two whose steps begin and end at the same times.

    Attributes:
        feet: Where the feet stand at first, (4, 3) [m], in W.
        steps: The steps.
        duration: When the plan ends [s].
        roll: How far the feet roll from where they are set down; None: not at all.
        phases: The plan as a gapless sequence of phases.

    Raises:
        ValueError: A step begins before those before it have ended.
    """

    feet: FloatArray
    steps: tuple[Step, ...]
    duration: float
    roll: FootRoll | None = None
    phases: tuple[Phase, ...] = field(init=False)
    _starts: tuple[float, ...] = field(init=False)
    # Of each phase: which steps' it is (P, MOST_SWINGS), -1 for none; the feet; who stands.
    _swings: NDArray[np.intp] = field(init=False)
    _feet: FloatArray = field(init=False)
    _standing: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        phases: list[Phase] = []
        feet, t = np.array(self.feet), 0.0
        everyone = np.ones(4, dtype=bool)
        swings, done = [], 0
        for steps in swings_together(self.steps):
            begin, end = steps[0].lift_off, steps[0].touchdown
            if begin > t + SAME_TIME:
                phases.append(Phase(t, begin, everyone, read_only(feet)))
                swings.append((-1,) * MOST_SWINGS)
            elif begin < t - OVERLAP:
                raise ValueError(
                    f"leg {steps[0].leg.short} lifts off at {begin} s, before the legs in the air "
                    f"land at {t} s: steps at one time begin and end together"
                )
            standing = everyone.copy()
            for step in steps:
                standing[step.leg.row] = False
            phases.append(Phase(begin, end, standing, read_only(feet), steps))
            swings.append((done, done + 1 if len(steps) > 1 else -1))
            for step in steps:
                feet[step.leg.row] = step.swing.p_end
            t, done = end, done + len(steps)
        if self.duration > t + SAME_TIME:
            phases.append(Phase(t, self.duration, everyone, read_only(feet)))
            swings.append((-1,) * MOST_SWINGS)
        object.__setattr__(self, "phases", tuple(phases))
        object.__setattr__(self, "_starts", tuple(p.start for p in phases))
        object.__setattr__(self, "_swings", np.array(swings, dtype=np.intp))
        object.__setattr__(self, "_feet", np.array([p.feet for p in phases]))
        object.__setattr__(self, "_standing", np.array([p.standing for p in phases]))
        object.__setattr__(self, "feet", read_only(self.feet))

    def rolled(self, roll: FootRoll) -> "ContactPlan":
        """The same plan with feet that roll."""
        plan = copy(self)
        object.__setattr__(plan, "roll", roll)
        return plan

    @property
    def final_feet(self) -> FloatArray:
        """Where the feet were set down that stand at the end, (4, 3) [m]."""
        feet = np.array(self.feet)
        for step in self.steps:
            feet[step.leg.row] = step.swing.p_end
        return read_only(feet)

    def phase_index(self, t: float) -> int:
        """Index of the phase at time `t` [s]; the first or last one outside of the plan."""
        return max(bisect_right(self._starts, t) - 1, 0)

    def phase_indices(self, times: FloatArray) -> IntArray:
        """The same at each of some times (N,) [s]."""
        return np.asarray(np.maximum(np.searchsorted(self._starts, times, side="right") - 1, 0))

    def phase(self, t: float) -> Phase:
        """The phase at time `t` [s]."""
        return self.phases[self.phase_index(t)]

    def feet_at(self, times: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Returns the feet's places (N, 4, 3) [m] and who stands (N, 4) at `times` (N,) [s]."""
        index = self.phase_indices(times)
        feet, standing = self._feet[index], self._standing[index]
        roll = None if self.roll is None else self.roll.at(times)
        if roll is not None:
            feet[..., :2] += roll
        if not self.steps:
            return feet, standing
        starts = np.array([step.lift_off for step in self.steps])
        back = np.array([step.back for step in self.steps])
        rows = np.array([step.leg.row for step in self.steps])
        for swing in self._swings[index].T:
            mine = np.flatnonzero(swing >= 0)
            if len(mine) == 0:
                continue
            swing = swing[mine]
            legs = rows[swing]
            feet[mine, legs] = swing_positions(
                [step.swing for step in self.steps], swing, times[mine] - starts[swing]
            )
            if self.roll is not None:
                left = 1.0 - quintic(np.minimum((times[mine] - starts[swing]) / back[swing], 1.0))
                feet[mine, legs, :2] += left[:, None] * self.roll.at(starts)[swing, legs]
        return feet, standing


OVERLAP = 1e-6  # [s] by which rounding may let a step begin before the one before has ended


def swings_together(steps: Sequence[Step]) -> list[tuple[Step, ...]]:
    """Steps in time order, those that begin and end together as one (at most MOST_SWINGS)."""
    found: list[tuple[Step, ...]] = []
    for step in steps:
        last = found[-1] if found else ()
        if (
            0 < len(last) < MOST_SWINGS
            and abs(step.lift_off - last[0].lift_off) <= SAME_TIME
            and abs(step.touchdown - last[0].touchdown) <= SAME_TIME
        ):
            found[-1] = (*last, step)
        else:
            found.append((step,))
    return found


def sample_times(contacts: ContactPlan, period: float = SAMPLE_PERIOD) -> FloatArray:
    """An even grid, `period` [s] apart at most, and every lift-off and touchdown, sorted [s]."""
    even = np.linspace(0.0, contacts.duration, int(np.ceil(contacts.duration / period)) + 1)
    switches = [p.start for p in contacts.phases] + [contacts.duration]
    return np.unique(np.round(np.concatenate([even, switches]), 9))


def swing_times(contacts: ContactPlan, count: int) -> FloatArray:
    """So many moments of every swing, evenly from lift-off to touchdown (N,) [s]."""
    ends = [np.linspace(s.lift_off, s.touchdown, count) for s in contacts.steps]
    return np.concatenate(ends) if ends else np.zeros(1)


def roll_feet(
    robot: RobotModel,
    times: FloatArray,
    body: FloatArray,
    q: FloatArray,
    standing: BoolArray,
    begin: FloatArray,
) -> FootRoll:
    """How far standing feet roll along a sampled plan: they are balls, and the shank above turns.

    A ball of radius r on level ground moves by r (ω × z) while it turns by ω, and it turns with its
    shank. That turns with the body's pitch about a level axis, with the leg's abduction about the
    body's x axis, and with hip and knee about the leg's own y axis (yaw turns it about the ground's
    normal, which moves nothing): some millimetres in the course of a stance, forward as the knee
    goes forward, and to the side as the body sways, however much the shank leans. The controller
    lets feet roll, and sets each down where the plan has it. In the air a foot keeps what it had
    rolled here; `ContactPlan.feet_at` has how it loses that.

    Args:
        robot: The robot.
        times: Sampled times (N,), every lift-off and touchdown among them [s].
        body: (N, 5) poses in W.
        q: (N, 4, 3) joint angles [rad].
        standing: (N, 4), from each time to the next.
        begin: How far they have rolled before (4, 2) [m].
    """
    offset = np.empty((len(times), 4, 2))
    body = np.ascontiguousarray(body)  # kernels are compiled anew for other layouts
    _roll(robot.foot_radius, times, body, q, standing, begin, offset)
    return FootRoll(times, offset)


@jit
def _roll(
    radius: float,
    times: FloatArray,
    body: FloatArray,
    q: FloatArray,
    standing: BoolArray,
    begin: FloatArray,
    offset: FloatArray,
) -> None:
    """The arithmetic of `roll_feet`, into `offset`."""
    for k in range(4):
        x, y = begin[k, 0], begin[k, 1]
        offset[0, k, 0], offset[0, k, 1] = x, y
        for n in range(1, len(times)):
            if standing[n - 1, k]:
                on_x, on_y = _goes(body[n - 1], body[n], q[n - 1, k], q[n, k])
                x += radius * on_x
                y += radius * on_y
            elif standing[n, k]:  # it lands here
                x, y = 0.0, 0.0
            offset[n, k, 0], offset[n, k, 1] = x, y


@jit
def _goes(
    body0: FloatArray, body1: FloatArray, q0: FloatArray, q1: FloatArray
) -> tuple[float, float]:
    """ω × z along x and y of W, from one body pose (5,) and a leg's angles (3,) to the next."""
    pitch, yaw = 0.5 * (body0[3] + body1[3]), 0.5 * (body0[4] + body1[4])
    out = 0.5 * (q0[0] + q1[0])
    cp, sp, cy, sy, ca, sa = cos(pitch), sin(pitch), cos(yaw), sin(yaw), cos(out), sin(out)
    tilts, abducts = body1[3] - body0[3], q1[0] - q0[0]
    bends = q1[1] + q1[2] - q0[1] - q0[2]
    # Of each axis (x, y, z) the part that moves a ball: (y, -x).
    on_x = tilts * cy + abducts * sy * cp + bends * (ca * cy + sa * sy * sp)
    on_y = tilts * sy - abducts * cy * cp + bends * (ca * sy - sa * cy * sp)
    return on_x, on_y
