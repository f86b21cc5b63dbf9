"""Cuts a plan into polynomial pieces, and these into cells of time.

A piece ends at every knot of the body's spline and of the feet's rolling, every lift-off, touchdown
and apex, wherever a swing foot has lost what it had rolled, and at every end of a segment.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np

from drake_quad.certificate.enclosure import UNIT, Enclosure, compose
from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.planning.contact_plan import FootRoll, Step
from drake_quad.planning.motion_plan import MotionPlan

BODY, FOOT = 4, 6  # coefficients of the body's cubics and of the swing foot's quintics
SLIVER = 1e-7  # [s]; a knot this near to a switch is no piece of its own: the spline is C2 there
_QUINTIC = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
_SPLINE = np.array(
    [[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]
) / 6.0  # fmt: skip


@dataclass(frozen=True, eq=False)
class Pieces:
    """P pieces in time order, of all tasks; polynomials in w, which runs from 0 to 1 in a piece.

    Attributes:
        start: Begin of each in its task's time (P,) [s].
        end: End of each (P,) [s].
        task: Index of its task (P,).
        segment: Index of its segment, counted through all tasks (P,).
        phase: Index of its contact phase, counted through all tasks (P,).
        body: Coefficients of x, y, z, pitch, yaw (P, 5, BODY).
        swing: Row of the swing leg, -1 for none (P,).
        foot: Coefficients of the swing foot's x, y, z (P, 3, FOOT); 0 where nobody swings.
        feet: Where each foot stands as the piece begins, or stood last (P, 4, 3) [m] in W.
        roll: How far each rolls on in the piece, evenly (P, 4, 2) [m]; of the swing foot in `foot`.
        standing: Who stands (P, 4).
        landing: Where the swing foot comes down (P, 3); `feet` of FL where nobody swings.
    """

    start: FloatArray
    end: FloatArray
    task: IntArray
    segment: IntArray
    phase: IntArray
    body: FloatArray
    swing: IntArray
    foot: FloatArray
    feet: FloatArray
    roll: FloatArray
    standing: BoolArray
    landing: FloatArray


@dataclass(frozen=True, eq=False)
class Spans:
    """Stretches of time: the task (n,), the begin and the end of each (n,) [s]."""

    task: IntArray
    start: FloatArray
    end: FloatArray

    def touch(self, task: int, start: float, end: float) -> bool:
        """Whether a stretch of time has a part in any of them."""
        return bool(np.any((self.task == task) & (self.end > start) & (self.start < end)))


def cut_pieces(plans: Sequence[MotionPlan], late: float = 0.0, only: Spans | None = None) -> Pieces:
    """Cuts the plans of a mission's tasks into pieces.

    Args:
        plans: The plans.
        late: For so long after its touchdown a foot is not counted on [s], or until the next
            lift-off, before which the clock waits for it.
        only: Times of which pieces are wanted; None: of all.
    """
    rows: list[tuple[object, ...]] = []
    segments = phases = 0
    for task, plan in enumerate(plans):
        ends, roll = [s.end for s in plan.segments], plan.contacts.roll
        inner = np.sort([*ends] if roll is None else [*ends, *roll.times])
        landed: int | None = None  # row of the leg whose swing was the last
        for phase in plan.contacts.phases:
            step = phase.step
            if only is not None and not only.touch(task, phase.start, phase.end):
                phases += 1
                landed = None if step is None else step.leg.row
                continue
            cuts = [phase.start, phase.end]
            if step is not None:
                cuts += [step.lift_off + step.swing.apex_time, step.lift_off + step.back]
            firm = phase.start if landed is None or step is not None else phase.start + late
            cuts += [firm] if phase.start + SLIVER < firm < phase.end - SLIVER else []
            inside = inner[inner.searchsorted(phase.start + SLIVER, side="right") :
                           inner.searchsorted(phase.end - SLIVER, side="left")]  # fmt: skip
            cuts += inside.tolist()
            cuts = _with_knots(cuts, plan.body.knot)
            for a, b in pairwise(cuts):
                if only is not None and not only.touch(task, a, b):
                    continue
                begin, on = _roll(roll, a, b)
                foot = np.zeros((3, FOOT))
                if step is not None:
                    lifted = _roll(roll, step.lift_off, step.lift_off)[0][step.leg.row]
                    foot = _foot(step, a, b, lifted)
                    begin[step.leg.row], on[step.leg.row] = lifted, 0.0
                feet = np.array(phase.feet)
                feet[:, :2] += begin
                standing = np.array(phase.standing)
                if landed is not None and 0.5 * (a + b) < firm:
                    standing[landed] = False
                segment = segments + min(int(np.searchsorted(ends, 0.5 * (a + b))), len(ends) - 1)
                rows.append(
                    (
                        a, b, task, segment, phases,
                        _body(plan, a, b),
                        -1 if step is None else step.leg.row,
                        foot,
                        feet,
                        on,
                        standing,
                        feet[0] if step is None else step.swing.p_end,
                    )
                )  # fmt: skip
            phases += 1
            landed = None if step is None else step.leg.row
        segments += len(plan.segments)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Pieces(*columns)


def _roll(roll: FootRoll | None, a: float, b: float) -> tuple[FloatArray, FloatArray]:
    """How far the feet have rolled at a, and roll on until b, (4, 2) each [m]."""
    if roll is None:
        return np.zeros((4, 2)), np.zeros((4, 2))
    begin, end = roll.at(np.array([a, b]))
    return begin, end - begin


def _with_knots(cuts: list[float], knot: float) -> list[float]:
    """The cuts in order, and the knots between them; of what is a sliver apart, the first."""
    ends = [min(cuts), max(cuts)]
    first, last = int(np.ceil(ends[0] / knot)), int(np.floor(ends[1] / knot))
    found = np.array(ends)
    for more in (np.array(cuts), np.arange(first, last + 1) * knot):
        apart = np.abs(more[:, None] - found).min(axis=1) > SLIVER
        found = np.sort(np.concatenate([found, more[apart]]))
        found = found[np.append(True, np.diff(found) > SLIVER)]
    return [*found.tolist()[:-1], ends[1]]


def _body(plan: MotionPlan, a: float, b: float) -> FloatArray:
    """The body's five cubics on [a, b], which no knot divides (5, BODY)."""
    knot, control = plan.body.knot, plan.body.control
    i = min(max(int(0.5 * (a + b) / knot), 0), len(control) - 4)
    powers = (_SPLINE @ control[i : i + 4]).T
    return compose(powers, a / knot - i, (b - a) / knot)


def _foot(step: Step, a: float, b: float, lifted: FloatArray) -> FloatArray:
    """The swing foot's three quintics on [a, b] (3, FOOT).

    Neither apex nor `step.back` divides the stretch. At lift-off it had rolled by `lifted` (2,).
    """
    swing = step.swing
    along = compose(_QUINTIC, (a - step.lift_off) / swing.duration, (b - a) / swing.duration)
    foot = (swing.p_end - swing.p_start)[:, None] * along
    foot[:, 0] += swing.p_start
    base, rise, begin, lasts = (
        swing.p_start[2],
        swing.apex_z - swing.p_start[2],
        0.0,
        swing.apex_time,
    )
    if 0.5 * (a + b) > step.lift_off + swing.apex_time:
        base, rise = swing.apex_z, swing.p_end[2] - swing.apex_z
        begin, lasts = swing.apex_time, swing.duration - swing.apex_time
    foot[2] = rise * compose(_QUINTIC, (a - step.lift_off - begin) / lasts, (b - a) / lasts)
    foot[2, 0] += base
    if 0.5 * (a + b) < step.lift_off + step.back:
        lost = compose(_QUINTIC, (a - step.lift_off) / step.back, (b - a) / step.back)
        foot[:2] -= lifted[:, None] * lost
        foot[:2, 0] += lifted
    return foot


@dataclass(frozen=True, eq=False)
class Cells:
    """N stretches of pieces, with their polynomials in tau, which runs from -1 to 1 in each.

    Attributes:
        piece: Which piece (N,).
        low: Where it begins in its piece, in w (N,).
        high: Where it ends (N,).
        half: Half its length (N,) [s].
        middle: Its middle in its task's time (N,) [s].
        body: Coefficients (N, 5, BODY).
        foot: Coefficients (N, 3, FOOT).
    """

    piece: IntArray
    low: FloatArray
    high: FloatArray
    half: FloatArray
    middle: FloatArray
    body: FloatArray
    foot: FloatArray

    def body_enclosure(self, k: int) -> Enclosure:
        """The k-th of x, y, z, pitch, yaw, (N, 1)."""
        return self._enclose(self.body[:, k])

    def feet_enclosure(self, pieces: Pieces, axis: int) -> Enclosure:
        """One coordinate of all four feet, (N, 4)."""
        swing = np.arange(4) == pieces.swing[self.piece][:, None]
        moving = self._enclose(self.foot[:, axis])
        place, rolls = pieces.feet[self.piece][:, :, axis], np.zeros((len(self.piece), 4))
        if axis < 2:
            on = pieces.roll[self.piece][:, :, axis]
            place = place + 0.5 * (self.low + self.high)[:, None] * on
            rolls = 0.5 * (self.high - self.low)[:, None] * on
        pad = 8.0 * UNIT * (1.0 + np.abs(place) + np.abs(rolls))
        return Enclosure(
            np.where(swing, moving.centre, place),
            np.where(swing, moving.time, rolls),
            np.zeros((*place.shape, 0)),
            np.where(swing, moving.error, pad),
            np.where(swing, moving.rest, pad),
        )

    def standing_feet(self, pieces: Pieces) -> tuple[FloatArray, FloatArray]:
        """Where the feet are in the middle (N, 4, 2), and how far off they may be (N, 4) [m]."""
        on = pieces.roll[self.piece]
        middle = 0.5 * (self.low + self.high)[:, None, None]
        away = 0.5 * (self.high - self.low)[:, None] * np.linalg.norm(on, axis=-1)
        return pieces.feet[self.piece][..., :2] + middle * on, away

    def _enclose(self, powers: FloatArray) -> Enclosure:
        """Polynomials (N, n) in tau as enclosures (N, 1)."""
        size = np.abs(powers)
        pad = 64.0 * UNIT * (1.0 + size.sum(axis=-1, keepdims=True))
        rest = size[:, 2:].sum(axis=-1, keepdims=True) + pad
        none = np.zeros((len(powers), 1, 0))
        return Enclosure(powers[:, :1], powers[:, 1:2], none, pad, rest)


T = TypeVar("T")


def pick(values: T, which: IntArray | BoolArray | slice) -> T:
    """Some of the cells, or of their bounds."""
    return type(values)(**{k: v[which] for k, v in vars(values).items()})


def join_cells(parts: list[T]) -> T:
    """All of them as one."""
    return type(parts[0])(
        **{k: np.concatenate([vars(part)[k] for part in parts]) for k in vars(parts[0])}
    )


def make_cells(pieces: Pieces, piece: IntArray, low: FloatArray, high: FloatArray) -> Cells:
    """The stretches from `low` to `high` (N,), in w, of pieces `piece` (N,)."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    length = (pieces.end - pieces.start)[piece]
    return Cells(
        piece=piece,
        low=low,
        high=high,
        half=half * length,
        middle=pieces.start[piece] + middle * length,
        body=compose(pieces.body[piece], middle[:, None], half[:, None]),
        foot=compose(pieces.foot[piece], middle[:, None], half[:, None]),
    )
