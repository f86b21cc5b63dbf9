"""The nominal body path: route, height, pitch and phase on the treads."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray
from drake_quad.planning.foothold_grid import FootholdGrid
from drake_quad.planning.problem import PlanSettings
from drake_quad.stability.margins import FALLEN_TILT
from drake_quad.terrain.lane import Lane

ROUNDING = 1e-9  # [m], [rad] within which a body begins at its ground's height and pitch


class GroundProfile(Protocol):
    """Mean height of the ground under the body [m] and its slope, along places (N, 2) in W."""

    def __call__(self, p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns heights (N,) [m] and slopes (N,) (rise over run along the heading)."""
        ...


@dataclass(frozen=True, eq=False)
class BodyReference:
    """Where the body is to be if margins did not matter: piecewise linear in time.

    Attributes:
        times: (k,) [s].
        xy: (k, 2) in W [m].
        yaw: (k,) [rad].
        ground: The ground under the body.
        lane: Whose ground shanks are to keep clear of; None: it is level, they need not.
        start: x, y, z [m] and pitch [rad] of the body at first, (4,); None: as over the ground.
        joined: Time from which height and pitch are those over the ground [s].
    """

    times: FloatArray
    xy: FloatArray
    yaw: FloatArray
    ground: GroundProfile
    lane: Lane | None = None
    start: FloatArray | None = None
    joined: float = 0.0

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns places (N, 2) and yaws (N,) at `times` (N,)."""
        xy = np.stack([np.interp(times, self.times, self.xy[:, k]) for k in range(2)], axis=-1)
        return xy, np.interp(times, self.times, self.yaw)

    def starts_off(self, settings: PlanSettings) -> bool:
        """Whether the body begins at another height or pitch than belongs to the ground there."""
        if self.start is None:
            return False
        height, slope = self.ground(self.start[None, :2])
        pitch = body_pitch(settings.pitch_along_slope, slope)
        off = self.start[2:] - [height[0] + settings.body_height, pitch[0]]
        return bool(np.any(np.abs(off) > ROUNDING))


MOST_PITCH = FALLEN_TILT - 0.06  # [rad]: a body on its way is not quite as it is meant to be


def body_pitch(share: ArrayLike, slope: ArrayLike) -> FloatArray:
    """Pitch of a body that tilts with a share of the ground's slope, and is never too steep [rad].

    Args:
        share: Share of the slope's angle.
        slope: Slope, rise over run along the heading.
    """
    pitch = -np.asarray(share) * np.arctan(slope)
    return np.asarray(np.clip(pitch, -MOST_PITCH, MOST_PITCH))


def robot_stance(settings: PlanSettings) -> FloatArray:
    """Where the feet stand in B at rest: the workspaces' centres, staggered, (4, 2) [m]."""
    stance = np.array(settings.workspace.centres)
    half = 0.5 * settings.stance_stagger
    stance[:, 1] += np.sign(stance[:, 1]) * np.array([-half, -half, half, half])
    return stance


def level_pose(p_xy: FloatArray, yaw: float, ground: float, settings: PlanSettings) -> FloatArray:
    """The body's pose (5,) at rest on level ground."""
    return np.array([*p_xy, ground + settings.body_height, 0.0, yaw])


FULL = 1.0 / 3.0  # share of the flight's slope from which feet stand as on the flight, and
OVER_EDGES = 0.3  # how far the body goes down for feet behind an edge: more folds the others
EARLY = 0.15  # from which the body is shifted as there: before the first foot is on it


def steepness(lattice: FootholdGrid, s: FloatArray, reach: float) -> FloatArray:
    """The slope around `s` (N,), by the steepest on the way: 1 up, -1 down, 0 on level ground.

    Averaged over `reach` [m] to either side, so that it comes and goes as feet reach the flight.
    """
    places, heights = lattice.knots
    rises, runs = np.diff(heights), np.maximum(np.diff(places), 1e-9)
    steepest = float(np.max(np.abs(rises / runs), initial=0.0))
    if steepest == 0.0:
        return np.zeros_like(s)
    slope = (lattice.height(s + reach) - lattice.height(s - reach)) / (2.0 * reach)
    return np.asarray(np.clip(slope / steepest, -1.0, 1.0))


def half_window(lattice: FootholdGrid, settings: PlanSettings) -> float:
    """How far ahead of and behind the body its feet are, at most: half a stance, half a stride [m].

    On the flights' places; on level ground alone, half the gait's stance.
    """
    places, heights = lattice.knots
    rises, runs = np.diff(heights), np.diff(places)
    if not np.any(rises):
        return 0.5 * settings.workspace.P_x
    run = float(np.min(runs[rises != 0.0]))
    pattern = settings.pattern
    return 0.5 * run / pattern.per_tread * (pattern.stance + pattern.treads)


def tilting_ground(
    lattice: FootholdGrid, s: FloatArray, settings: PlanSettings
) -> tuple[FloatArray, FloatArray]:
    """Height (N,) [m] and slope (N,) of the ground for a body that tilts with the stairs.

    The line through the ground under front and rear feet. Over an edge they are taken as far apart
    as they ever are, which keeps the body low enough for a foot that is still down behind it; in a
    hollow as far as the hips, so that it does not rise before the feet do.
    """
    found = []
    for half in (0.5 * settings.workspace.P_x, half_window(lattice, settings)):
        behind, ahead = lattice.height(s - half), lattice.height(s + half)
        found.append((0.5 * (behind + ahead), (ahead - behind) / (2.0 * half)))
    (near, near_slope), (far, far_slope) = found
    share = np.where(far < near, OVER_EDGES, 0.0)
    return near + share * (far - near), near_slope + share * (far_slope - near_slope)


def tread_offset(lattice: FootholdGrid, i: int, spacing: float, settings: PlanSettings) -> float:
    """How far ahead of place `i` the feet stand there [m], places being `spacing` [m] apart."""
    if settings.tread_phase_up == settings.tread_phase_down == 0.0:
        return 0.0
    # All feet of a stance that is partly on the flight stand as on the flight.
    reach = settings.pattern.stance * spacing
    share = float(steepness(lattice, lattice.s[i : i + 1], reach)[0])
    phase = settings.tread_phase_up if share > 0.0 else settings.tread_phase_down
    return phase * spacing * settings.pattern.per_tread * min(abs(share) / FULL, 1.0)


def sideways_shift(lattice: FootholdGrid, s: FloatArray, settings: PlanSettings) -> FloatArray:
    """How far ahead of its places (N,) the body goes besides [m]."""
    share = steepness(lattice, s, half_window(lattice, settings))
    shift = np.where(share > 0.0, settings.body_shift_up, settings.body_shift_down)
    # Short legs lose margin to a body that is still ahead as they step off the flight.
    whole = EARLY if settings.pattern.per_tread == 1 else FULL
    return np.asarray(shift * np.minimum(np.abs(share) / whole, 1.0))


def body_lift(lattice: FootholdGrid, s: FloatArray, settings: PlanSettings) -> FloatArray:
    """How much higher the body goes at `s` (N,) than its height on level ground [m]."""
    if settings.lift_down == 0.0:
        return np.zeros_like(s)
    share = steepness(lattice, s, half_window(lattice, settings))
    return np.asarray(settings.lift_down * np.clip(-share / FULL, 0.0, 1.0))
