"""Body and feet over a cycle of candidate gaits on an endless staircase, swing by swing."""

from dataclasses import dataclass

import numpy as np

from drake_quad.design.candidate import Grid
from drake_quad.design.staircase import Staircase
from drake_quad.gait.legs import LEGS, SIGNS, WAVE_ORDER, BoolArray, FloatArray
from drake_quad.gait.quintic import quintic
from drake_quad.planning.pattern import LIFT_OFF

PHASES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of every swing, that are looked at


@dataclass(frozen=True, eq=False)
class Cycle:
    """C candidates at N moments: those of every leg's swing. W begins at the body's first place.

    Attributes:
        body: (C, N, 5) x, y, z, pitch, yaw of B; y is 0.
        feet: (C, N, 4, 3) foot sphere centres [m].
        standing: (N, 4).
        swing: (N,) row of the leg in the air.
    """

    body: FloatArray
    feet: FloatArray
    standing: BoolArray
    swing: FloatArray


def make_cycle(
    grid: Grid,
    stairs: Staircase,
    *,
    foot_radius: float,
    clearance: float,
    stance_length: float | None = None,
) -> Cycle:
    """Lays a cycle of every candidate.

    Args:
        grid: The candidates.
        stairs: What is walked on.
        foot_radius: [m].
        clearance: By which the foot's sphere clears what it passes [m].
        stance_length: Between front and rear feet, on level ground [m]; the pattern's if None.
    """
    pattern, beta = grid.pattern, grid.duty_factor
    moments = [(leg, float(s)) for leg in WAVE_ORDER for s in PHASES]
    count, n = len(grid), len(moments)
    at = np.array([LIFT_OFF[leg] + s * (1.0 - beta) for leg, s in moments])
    place = pattern.treads * at + pattern.ahead(beta)
    body = np.zeros((count, n, 5))
    up = stairs.rise >= 0.0
    level = stairs.rise == 0.0
    shift_body = 0.0 * grid.height if level else (grid.shift_up if up else grid.shift_down)
    phase = 0.0 * grid.height if level else grid.phase(stairs.run, up=up, foot_radius=foot_radius)
    body[..., 0] = stairs.run * place + shift_body[:, None]
    body[..., 2] = stairs.line(body[..., 0]) + grid.height[:, None]
    body[..., 3] = -grid.share[:, None] * np.arctan(stairs.slope)
    shift = 0.0
    if stance_length is not None:
        shift = 0.5 * (stance_length - pattern.stance * stairs.run)
    standing = np.ones((n, 4), dtype=bool)
    feet = np.zeros((count, n, 4, 3))
    half = 0.5 * grid.stagger * np.array([-1.0, -1.0, 1.0, 1.0])
    for leg in LEGS:
        row, first = leg.row, pattern.first(leg)
        feet[:, :, row, 1] = SIGNS[row, 1] * (0.5 * grid.width + half[row])[:, None]
        for k, (swinging, s) in enumerate(moments):
            begin = first + (pattern.treads if LIFT_OFF[leg] < LIFT_OFF[swinging] else 0)
            end = begin + (pattern.treads if leg == swinging else 0)
            along = begin + (end - begin) * float(quintic(np.array(s)))
            feet[:, k, row, 0] = stairs.run * along + SIGNS[row, 0] * shift + phase
            z = max(begin * stairs.rise, end * stairs.rise)
            if leg == swinging:
                standing[k, row] = False
                # Up and over, and then along: the arc's own shape is found when it is planned.
                z = {0.0: begin * stairs.rise, 1.0: end * stairs.rise}.get(s, z + clearance)
            feet[:, k, row, 2] = z + foot_radius
    swing = np.array([float(leg.row) for leg, _ in moments])
    return Cycle(body, feet, standing, swing)
