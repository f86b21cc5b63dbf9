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
    up = stairs.rise >= 0.0
    level = stairs.rise == 0.0
    per = 1 if level else pattern.per_tread  # places a tread: on level ground places are alike
    # As many cycles as there are until all feet stand alike on other treads.
    cycles = per // gcd(per, pattern.treads)
    moments = [(c, leg, float(s)) for c in range(cycles) for leg in WAVE_ORDER for s in PHASES]
    count, n = len(grid), len(moments)
    at = np.array([c + LIFT_OFF[leg] + s * (1.0 - beta) for c, leg, s in moments])
    place = (pattern.treads * at + pattern.ahead(beta) - 0.5 * (per - 1)) / per  # in treads
    body = np.zeros((count, n, 5))
    shift_body = 0.0 * grid.height if level else (grid.shift_up if up else grid.shift_down)
    phase = 0.0 * grid.height if level else grid.phase(stairs.run, up=up, foot_radius=foot_radius)
    ahead = np.array([-SIGNS[leg.row, 0] for _, leg, _ in moments])
    body[..., 0] = stairs.run * place + shift_body[:, None] + grid.surge[:, None] * ahead
    lift = 0.0 if up else grid.lift_down[:, None]
    body[..., 2] = stairs.line(body[..., 0]) + grid.height[:, None] + lift
    body[..., 3] = body_pitch(grid.share, stairs.slope)[:, None]
    shift = 0.0
    if stance_length is not None:
        shift = 0.5 * (stance_length - pattern.stance * stairs.run)
    half = 0.5 * grid.stagger * np.array([-1.0, -1.0, 1.0, 1.0])

    steps = np.array([[pattern.treads * c for c, _, _ in moments]] * 4)
    swings = np.array([[leg == other for _, other, _ in moments] for leg in LEGS])
    steps += [
        [pattern.treads * (LIFT_OFF[leg] < LIFT_OFF[m]) for _, m, _ in moments] for leg in LEGS
    ]
    begin = np.array([[pattern.first(leg)] for leg in LEGS]) + steps  # places (4, N), from and to
    end = begin + pattern.treads * swings
    from_tread, tread = begin // per, end // per
    s = np.array([s for _, _, s in moments])
    share = quintic(s)

    # How far ahead of its tread's middle each foot's place is, from and to (4, N) [m].
    own, own_end = (stairs.run * ((place % per + 0.5) / per - 0.5) for place in (begin, end))
    along = stairs.run * (from_tread + (tread - from_tread) * share) + own + share * (own_end - own)
    along += SIGNS[:, :1] * shift
    # Up and over, and then along: the arc's own shape is found when it is planned.
    low, high = from_tread * stairs.rise, tread * stairs.rise
    over = np.where(swings, np.maximum(low, high) + clearance, low)
    heights = np.where(s == 0.0, low, np.where(s == 1.0, high, over))
    feet = np.empty((count, n, 4, 3))
    feet[..., 0] = along.T + phase[:, None, None]
    feet[..., 1] = SIGNS[:, 1] * (0.5 * grid.width[:, None] + half)[:, None, :]
    feet[..., 2] = heights.T + foot_radius
    swing = np.array([float(leg.row) for _, leg, _ in moments])
    return Cycle(body, feet, ~swings.T, swing, _landed(cycles))


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
