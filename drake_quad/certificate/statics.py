"""Static forces and torques, enclosed over stretches of time.

Vertical forces that balance the robot's weight are linear in its centre of mass: shares of the
weight f(t) = witness + K (com(t) - com at the stretch's middle) balance it at every time, if the
feet stay. Where they roll, by D(t) from the matrix B of their balance (B K = 1), the shares

    f - K (1 + D K)^-1 D f

balance the weight: with no foot off by more than `away`, |D f| <= away |f|, the sum of shares, and
|D K| <= k = away times the sum of K's rows, they are off by at most |K_i| away |f| / (1 - k).
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.enclosure import Enclosure, widen
from drake_quad.certificate.legs import Frame, Legs, Moments
from drake_quad.certificate.support import Support
from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.robot_model import RobotModel

_CHOICES = np.linspace(0.02, 0.98, 25)  # of a force distribution over four feet


@dataclass(frozen=True, eq=False)
class Statics:
    """Forces and torques that hold the robot still, over each cell.

    Attributes:
        witness: Shares of the weight, upwards, at the middle of each cell (N, 4).
        shares: The shares over the cell (N, 4).
        torques: Of abduction, hip pitch and knee, (N, 4) each [Nm].
    """

    witness: FloatArray
    shares: Enclosure
    torques: tuple[Enclosure, Enclosure, Enclosure]


def enclose_statics(
    robot: RobotModel,
    support: Support,
    frame: Frame,
    legs: Legs,
    moments: Moments,
) -> Statics:
    """Vertical forces of the standing feet that balance the weight, and the torques they ask for.

    Where four feet stand one of the forces may be chosen: it is so that the torques are the
    smallest part of their limits.
    """
    share, free = support.share, support.free
    x, y = moments.com
    shares = x * share[..., 1] + y * share[..., 2] + share[..., 0]
    empty, loaded = _torques(robot, frame, legs, moments)
    freedom = _choose(robot, shares, free, empty, loaded)
    shares = _roll(shares + freedom[:, None] * free, support)
    torques = (
        empty[0] + loaded[0] * shares,
        empty[1] + loaded[1] * shares,
        empty[2] + loaded[2] * shares,
    )
    return Statics(shares.centre, shares, torques)


def _roll(shares: Enclosure, support: Support) -> Enclosure:
    """The shares with feet that roll, see above."""
    away, half = support.away[:, None], shares.half
    size = np.linalg.norm(support.share, axis=2)  # of K's rows; the first column only adds to it
    k = away * size.sum(axis=1, keepdims=True)
    left = np.where(k < 1.0, 1.0 - k, np.nan)
    total = (np.abs(shares.centre) + shares.radius).sum(axis=1, keepdims=True)
    speed = (np.abs(shares.rate) + shares.rate_radius).sum(axis=1, keepdims=True)
    moved = size * away * total / left
    # The rate of each factor in turn: of (1 + D K)^-1, of D, of f.
    rate = size * (
        (k / half) * away * total / left**2 + (away / half * total + away * speed) / left
    )
    return widen(shares, moved, rate)


def _torques(
    robot: RobotModel, frame: Frame, legs: Legs, moments: Moments
) -> tuple[tuple[Enclosure, ...], tuple[Enclosure, ...]]:
    """Torques of unloaded legs, and what the whole weight on a foot adds to its leg's (N, 4).

    A joint holds up what hangs on it: the links' first moments beyond it, less the ground's force
    times the foot's place. Gravity in B is -g (-sin pitch, 0, cos pitch).
    """
    g, M, shank = GRAVITY, robot.mass, robot.geometry.shank
    aside, ahead = frame.cos_pitch, -frame.sin_pitch
    upward = legs.cos_abduction * aside
    x, z = legs.foot
    knee_x, knee_z = legs.sin_shank * -shank, legs.cos_shank * -shank

    def pitch(px: Enclosure, pz: Enclosure) -> Enclosure:
        return pz * ahead - px * upward

    empty = (
        moments.leg_across * aside * g,
        pitch(*moments.thigh) * g,
        pitch(*moments.shank) * g,
    )
    loaded = (
        legs.across * aside * (-g * M),
        pitch(x, z) * (-g * M),
        pitch(knee_x, knee_z) * (-g * M),
    )
    return empty, loaded


def _choose(
    robot: RobotModel,
    shares: Enclosure,
    free: FloatArray,
    empty: tuple[Enclosure, ...],
    loaded: tuple[Enclosure, ...],
) -> FloatArray:
    """How much of `free` to add to the shares (N,), 0 where there is no freedom."""
    room = shares.centre - shares.radius  # what has to stay at least 0
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = -room / free
    low = np.where(free > 0.0, limit, -np.inf).max(axis=1)
    high = np.where(free < 0.0, limit, np.inf).min(axis=1)
    chosen = np.zeros(len(free))
    mine = np.any(free != 0.0, axis=1) & np.isfinite(low) & np.isfinite(high)
    if not np.any(mine):
        return chosen
    narrow = low[mine] > high[mine]
    middle = 0.5 * (low[mine] + high[mine])
    least, most = np.where(narrow, middle, low[mine]), np.where(narrow, middle, high[mine])
    tries = least[:, None] + (most - least)[:, None] * _CHOICES
    worst = np.zeros_like(tries)
    for j in range(3):
        for row in range(4):
            share = shares.centre[mine, row, None] + tries * free[mine, row, None]
            torque = empty[j].centre[mine, row, None] + loaded[j].centre[mine, row, None] * share
            worst = np.fmax(worst, np.abs(torque) / robot.effort[3 * row + j])
    best = np.argmin(worst, axis=1)
    chosen[mine] = tries[np.arange(len(tries)), best]
    return chosen
