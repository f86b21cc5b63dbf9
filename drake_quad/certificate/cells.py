"""Cuts a plan into polynomial pieces, and these into cells of time.

A piece ends at every knot of the body's spline and of the feet's rolling, every lift-off, touchdown
and apex, wherever a swing foot has lost what it had rolled, and at every end of a segment.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from drake_quad.certificate.enclosure import UNIT, Enclosure, compose
from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.planning.contact_plan import FootRoll, Phase, Step
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
    parts: list[Pieces] = []
    segments = phases = 0
    for task, plan in enumerate(plans):
        ends, roll = [s.end for s in plan.segments], plan.contacts.roll
        inner = np.sort([*ends] if roll is None else [*ends, *roll.times])
        landed: int | None = None  # row of the leg whose swing was the last
        found: list[_Stretch] = []
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
                standing = np.array(phase.standing)
                if landed is not None and 0.5 * (a + b) < firm:
                    standing[landed] = False
                found.append(_Stretch(a, b, phases, phase, standing))
            phases += 1
            landed = None if step is None else step.leg.row
        if found:
            parts.append(_pieces_of(plan, found, task, segments))
        segments += len(plan.segments)
    return join_cells(parts)


class _Stretch(NamedTuple):
    """From where to where a piece is, in which contact phase, and who is counted on."""

    start: float
    end: float
    number: int
    phase: Phase
    standing: BoolArray


def _pieces_of(plan: MotionPlan, cuts: list[_Stretch], task: int, segments: int) -> Pieces:
    """The pieces of one task, before which there are so many segments."""
    a, b = np.array([cut.start for cut in cuts]), np.array([cut.end for cut in cuts])
    ends, roll = [s.end for s in plan.segments], plan.contacts.roll
    begin, on = _roll(roll, a, b)
    swing, foot = np.full(len(cuts), -1), np.zeros((len(cuts), 3, FOOT))
    steps = [(k, cut.phase.step) for k, cut in enumerate(cuts) if cut.phase.step is not None]
    which = np.array([k for k, _ in steps], dtype=int)
    if steps:
        row, lift = (
            np.array([step.leg.row for _, step in steps]),
            np.array([step.lift_off for _, step in steps]),
        )
        lifted = _roll(roll, lift, lift)[0][np.arange(len(steps)), row]
        swing[which] = row
        foot[which] = _swing_feet([step for _, step in steps], a[which], b[which], lifted)
        begin[which, row], on[which, row] = lifted, 0.0
    feet = np.array([cut.phase.feet for cut in cuts])
    feet[..., :2] += begin
    landing = feet[:, 0].copy()
    if steps:
        landing[which] = [step.swing.p_end for _, step in steps]
    return Pieces(
        start=a,
        end=b,
        task=np.full(len(cuts), task),
        segment=segments + np.minimum(np.searchsorted(ends, 0.5 * (a + b)), len(ends) - 1),
        phase=np.array([cut.number for cut in cuts]),
        body=_body(plan, a, b),
        swing=swing,
        foot=foot,
        feet=feet,
        roll=on,
        standing=np.array([cut.standing for cut in cuts]),
        landing=landing,
    )


def _roll(roll: FootRoll | None, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far the feet have rolled at each a (P,), and roll on until b, (P, 4, 2) each [m]."""
    if roll is None:
        return np.zeros((len(a), 4, 2)), np.zeros((len(a), 4, 2))
    begin = roll.at(a)
    return begin, roll.at(b) - begin


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


def _body(plan: MotionPlan, a: FloatArray, b: FloatArray) -> FloatArray:
    """The body's five cubics on each [a, b] (P,), which no knot divides (P, 5, BODY)."""
    knot, control = plan.body.knot, plan.body.control
    first = np.clip((0.5 * (a + b) / knot).astype(int), 0, len(control) - 4)
    powers = np.array([(_SPLINE @ control[i : i + 4]).T for i in first.tolist()])
    return compose(powers, (a / knot - first)[:, None], ((b - a) / knot)[:, None])


def _swing_feet(steps: list[Step], a: FloatArray, b: FloatArray, lifted: FloatArray) -> FloatArray:
    """Swing feet's three quintics, each on one of the stretches [a, b] (S,), (S, 3, FOOT).

    Neither apex nor `step.back` divides a stretch. At lift-off they had rolled by `lifted` (S, 2).
    """
    swings, middle = [step.swing for step in steps], 0.5 * (a + b)
    p_start, p_end = np.array([s.p_start for s in swings]), np.array([s.p_end for s in swings])
    lift, back = np.array([s.lift_off for s in steps]), np.array([s.back for s in steps])
    duration, apex_time, apex_z = (
        np.array([getattr(swing, name) for swing in swings])
        for name in ("duration", "apex_time", "apex_z")
    )
    along = compose(_QUINTIC, (a - lift) / duration, (b - a) / duration)
    foot = (p_end - p_start)[:, :, None] * along[:, None]
    foot[:, :, 0] += p_start
    falls = middle > lift + apex_time
    base = np.where(falls, apex_z, p_start[:, 2])
    rise = np.where(falls, p_end[:, 2] - apex_z, apex_z - p_start[:, 2])
    begin = np.where(falls, apex_time, 0.0)
    lasts = np.where(falls, duration - apex_time, apex_time)
    foot[:, 2] = rise[:, None] * compose(_QUINTIC, (a - lift - begin) / lasts, (b - a) / lasts)
    foot[:, 2, 0] += base
    early = middle < lift + back
    lost = compose(_QUINTIC, ((a - lift) / back)[early], ((b - a) / back)[early])
    foot[early, :2] -= lifted[early, :, None] * lost[:, None]
    foot[early, :2, 0] += lifted[early]
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
