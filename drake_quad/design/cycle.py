"""Body and feet over a cycle of candidate gaits on an endless staircase, swing by swing."""

from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from drake_quad.design.candidate import Grid
from drake_quad.design.staircase import Staircase
from drake_quad.gait.legs import LEGS, SIGNS, WAVE_ORDER, BoolArray, FloatArray
from drake_quad.gait.quintic import quintic
from drake_quad.planning.pattern import LIFT_OFF
from drake_quad.planning.route import body_pitch

PHASES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of every swing, that are looked at


@dataclass(frozen=True, eq=False)
class Cycle:
    """C candidates at N moments: those of every leg's swing. W begins at the body's first place.

    Attributes:
        body: (C, N, 5) x, y, z, pitch, yaw of B; y is 0.
        feet: (C, N, 4, 3) foot sphere centres [m].
        standing: (N, 4).
        swing: (N,) row of the leg in the air.
        landed: (N, 4) the moment at which each foot was set down last; cycles follow one another.
    """

    body: FloatArray
    feet: FloatArray
    standing: BoolArray
    swing: FloatArray
    landed: NDArray[np.intp]


def make_cycle(
    grid: Grid,
    stairs: Staircase,
    *,
    foot_radius: float,
    clearance: float,
    stance_length: float | None = None,
) -> Cycle:
    """Lays a cycle of every candidate, or as many as it takes until all treads are alike.

    Args:
        grid: The candidates.
        stairs: What is walked on.
        foot_radius: [m].
        clearance: By which the foot's sphere clears what it passes [m].
        stance_length: Between front and rear feet, on level ground [m]; the pattern's if None.
    """
    pattern, beta = grid.pattern, grid.duty_factor
    # Places a tread: on level ground places are alike. And as many cycles as it takes until all
    # feet stand alike on other treads.
    per = 1 if stairs.rise == 0.0 else pattern.per_tread
    cycles = per // gcd(per, pattern.treads)
    beats = [(c, leg) for c in range(cycles) for leg in WAVE_ORDER]
    at = np.concatenate([c + LIFT_OFF[leg] + PHASES * (1.0 - beta) for c, leg in beats])
    body = _body(grid, stairs, at, per)
    ahead = np.repeat([-SIGNS[leg.row, 0] for _, leg in beats], len(PHASES))
    body[..., 0] += grid.surge[:, None] * ahead
    lift = 0.0 if stairs.rise >= 0.0 else grid.lift_down[:, None]
    body[..., 2] = stairs.line(body[..., 0]) + grid.height[:, None] + lift

    swings = np.repeat([[leg == other for _, other in beats] for leg in LEGS], len(PHASES), axis=1)
    steps = [[c + (LIFT_OFF[leg] < LIFT_OFF[other]) for c, other in beats] for leg in LEGS]
    first = np.array([[pattern.first(leg)] for leg in LEGS])
    begin = first + pattern.treads * np.repeat(steps, len(PHASES), axis=1)  # places, (4, N)
    along, up = _ways(stairs, begin, begin + pattern.treads * swings, per, clearance)
    if stance_length is not None:
        along += 0.5 * SIGNS[:, :1] * (stance_length - pattern.stance * stairs.run)
    feet = np.empty((len(grid), len(at), 4, 3))
    feet[..., 0] = along.T
    if stairs.rise != 0.0:
        phase = grid.phase(stairs.run, up=stairs.rise > 0.0, foot_radius=foot_radius)
        feet[..., 0] += phase[:, None, None]
    half = 0.5 * grid.stagger * np.array([-1.0, -1.0, 1.0, 1.0])
    feet[..., 1] = SIGNS[:, 1] * (0.5 * grid.width[:, None] + half)[:, None, :]
    feet[..., 2] = up.T + foot_radius
    swing = np.repeat([float(leg.row) for _, leg in beats], len(PHASES))
    return Cycle(body, feet, ~swings.T, swing, _landed(cycles))


def _body(grid: Grid, stairs: Staircase, at: FloatArray, per: int) -> FloatArray:
    """The bodies (C, N, 5) at times (N,) [cycles], with no height yet."""
    pattern = grid.pattern
    treads = (pattern.treads * at + pattern.ahead(grid.duty_factor) - 0.5 * (per - 1)) / per
    body = np.zeros((len(grid), len(at), 5))
    body[..., 0] = stairs.run * treads
    if stairs.rise != 0.0:
        body[..., 0] += (grid.shift_up if stairs.rise > 0.0 else grid.shift_down)[:, None]
    body[..., 3] = body_pitch(grid.share, stairs.slope)[:, None]
    return body


def _ways(
    stairs: Staircase, begin: NDArray[np.intp], end: NDArray[np.intp], per: int, clearance: float
) -> tuple[FloatArray, FloatArray]:
    """How far along the stairs and how high feet are, (4, N) [m], from places to places (4, N).

    Up and over, and then along: the arc's own shape is found when it is planned.
    """
    s = np.tile(PHASES, begin.shape[1] // len(PHASES))
    share = quintic(s)
    tread, goal = begin // per, end // per
    # How far ahead of its tread's middle each place is.
    here, there = (stairs.run * ((place % per + 0.5) / per - 0.5) for place in (begin, end))
    along = stairs.run * (tread + (goal - tread) * share) + here + share * (there - here)
    low, high = tread * stairs.rise, goal * stairs.rise
    over = np.where(begin != end, np.maximum(low, high) + clearance, low)
    return along, np.where(s == 0.0, low, np.where(s == 1.0, high, over))


def _landed(cycles: int) -> NDArray[np.intp]:
    """See Cycle; the end of each leg's swing, or of its swing in the cycle before."""
    last = len(PHASES) - 1
    landed = np.empty((cycles, 4, len(PHASES), 4), dtype=np.intp)
    for c in range(cycles):
        for beat in range(4):
            for other, leg in enumerate(WAVE_ORDER):
                earlier = other < beat
                before = c if earlier else (c - 1) % cycles
                landed[c, beat, :, leg.row] = (4 * before + other) * len(PHASES) + last
            own = (4 * c + beat) * len(PHASES) + last
            landed[c, beat, last, WAVE_ORDER[beat].row] = own
    return landed.reshape(-1, 4)
