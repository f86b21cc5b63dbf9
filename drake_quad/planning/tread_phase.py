"""Where on the treads feet stand, and how far ahead of them the body goes: by the slope there."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.lattice import Lattice
from drake_quad.planning.settings import PlanSettings

FULL = 1.0 / 3.0  # share of the flight's slope from which feet stand as on the flight, and
OVER_EDGES = 0.3  # how far the body goes down for feet behind an edge: more folds the others
EARLY = 0.15  # from which the body is shifted as there: before the first foot is on it


def steepness(lattice: Lattice, s: FloatArray, reach: float) -> FloatArray:
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


def half_window(lattice: Lattice, settings: PlanSettings) -> float:
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
    lattice: Lattice, s: FloatArray, settings: PlanSettings
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


def tread_offset(lattice: Lattice, i: int, spacing: float, settings: PlanSettings) -> float:
    """How far ahead of place `i` the feet stand there [m], places being `spacing` [m] apart."""
    if settings.tread_phase_up == settings.tread_phase_down == 0.0:
        return 0.0
    # All feet of a stance that is partly on the flight stand as on the flight.
    reach = settings.pattern.stance * spacing
    share = float(steepness(lattice, lattice.s[i : i + 1], reach)[0])
    phase = settings.tread_phase_up if share > 0.0 else settings.tread_phase_down
    return phase * spacing * settings.pattern.per_tread * min(abs(share) / FULL, 1.0)


def body_shift(lattice: Lattice, s: FloatArray, settings: PlanSettings) -> FloatArray:
    """How far ahead of its places (N,) the body goes besides [m]."""
    share = steepness(lattice, s, half_window(lattice, settings))
    shift = np.where(share > 0.0, settings.body_shift_up, settings.body_shift_down)
    # Short legs lose margin to a body that is still ahead as they step off the flight.
    whole = EARLY if settings.pattern.per_tread == 1 else FULL
    return np.asarray(shift * np.minimum(np.abs(share) / whole, 1.0))


def body_lift(lattice: Lattice, s: FloatArray, settings: PlanSettings) -> FloatArray:
    """How much higher the body goes at `s` (N,) than its height on level ground [m]."""
    if settings.lift_down == 0.0:
        return np.zeros_like(s)
    share = steepness(lattice, s, half_window(lattice, settings))
    return np.asarray(settings.lift_down * np.clip(-share / FULL, 0.0, 1.0))
