"""A map's heights made better by the feet: a foot that has landed tells how high its tread is.

How high a foot is in the world is known no better than how high the base is, and the state
estimator takes the base's height from the map. How much higher a foot stands than the other feet
follows from the legs' joints and from the trunk's tilt. So these differences are what is measured.

The state has the heights of the treads and what the differences may have wrong:

- the errors of the estimated tilt, along the flight and across it, which stay the same all the way;
- of each leg, an error of its own, by its joints and lengths, which stays as well;
- of each foot, an error of its stance, by what it sinks in and where on its sole it stands, which
  is another one each time that it lands.

The floor before the flight is where heights are counted from. The feet that land at one time are
one update of a Kalman filter (Kalman, "A New Approach to Linear Filtering and Prediction Problems",
Journal of Basic Engineering, 1960).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import BoolArray, FloatArray, IntArray, read_only
from drake_quad.perception.growing_map import FEET_APART, lane_places
from drake_quad.perception.stair_belief import NORMAL_95
from drake_quad.perception.stair_map import StairMap

LEG_SIGMA = 0.001  # [m] deviation of a foot's height by its leg
STANCE_SIGMA = 0.001  # [m] the same by how it stands
NOISE = 0.0003  # [m] the same from one moment to the next
NEAR_NOSING = 3.0  # deviations of a nosing's place within which a foot may be on either side
SAME_PLACE = 0.01  # [m] within which a foot that touches again has not made a step
OUTLIER = 4.0  # deviations from which a touchdown is not believed
LEAST_OUTLIER = 0.01  # [m] that it is off in any case; and within which two say the same
OTHER_PLACE = 0.05  # [m] between footprints of which both are not on one stone
TILTS, FEET = 2, 4
EXTRA = TILTS + 2 * FEET  # states behind the treads: tilts, legs, stances


@dataclass(frozen=True, eq=False)
class TouchdownHeights:
    """What the feet have told of a map's heights so far; arrays cannot be written to.

    Attributes:
        state: Heights of the treads in W [m], the errors of the tilt along and across the flight
            [rad], of the legs and of the stances (FL, FR, RL, RR) [m], (n + 10,).
        covariance: Its covariance, (n + 10, n + 10).
        touchdowns: How many touchdowns told each tread's height, (n,).
        doubted: How much higher than expected the last touchdown was on each tread that was not
            believed, and where it was in W, (n, 3) [m]; nan of a tread without one.
        places: Where each foot landed last, (4, 2) in W [m]; nan of one that has not.
        ignored: Which feet are no measure for others until they land again, (4,).
        contradicted: Treads on which two touchdowns were farther off the map than it may be, and by
            how much [m].
    """

    state: FloatArray
    covariance: FloatArray
    touchdowns: NDArray[np.intp]
    doubted: FloatArray
    places: FloatArray = field(default_factory=lambda: np.full((FEET, 2), np.nan))
    ignored: BoolArray = field(default_factory=lambda: np.zeros(FEET, dtype=bool))
    contradicted: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("state", "covariance", "doubted", "places"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        for counted in (self.touchdowns, self.ignored):
            counted.setflags(write=False)

    @property
    def count(self) -> int:
        """How many treads there are."""
        return len(self.touchdowns)


def heights_as_seen(known: StairMap, *, tilt_sigma: float) -> TouchdownHeights:
    """What is known of a map's heights before a foot has landed on a tread.

    Args:
        known: The map.
        tilt_sigma: Standard deviation of the estimated tilt of the trunk about each axis [rad].
    """
    count, sigmas = len(known.heights), known.height_errors / NORMAL_95
    covariance = np.zeros((count + EXTRA, count + EXTRA))
    covariance[:count, :count] = np.outer(sigmas, sigmas) * known.height_correlation
    extra = [tilt_sigma] * TILTS + [LEG_SIGMA] * FEET + [STANCE_SIGMA] * FEET
    covariance[count:, count:] = np.diag(np.square(extra))
    return TouchdownHeights(
        np.append(known.heights, np.zeros(EXTRA)), covariance, np.zeros(count, dtype=np.intp),
        np.full((count, 3), np.nan),
    )  # fmt: skip


def heights_on_grown_map(told: TouchdownHeights, known: StairMap) -> TouchdownHeights:
    """The same on a map that has grown: of treads that no foot has been on, as the map has them.

    How the errors of these go with the others' is left out.

    Args:
        told: What the feet have told on the map of before.
        known: The map as it is now, of whose heights those in `touched` are the feet's.
    """
    count = len(known.heights)
    new = heights_as_seen(known, tilt_sigma=0.0)
    kept = np.flatnonzero(known.touched_treads)
    old = np.append(kept, np.arange(told.count, told.count + EXTRA))
    at = np.append(kept, np.arange(count, count + EXTRA))
    state, covariance = new.state.copy(), new.covariance.copy()
    state[at] = told.state[old]
    covariance[at], covariance[:, at] = 0.0, 0.0
    covariance[np.ix_(at, at)] = told.covariance[np.ix_(old, old)]
    touchdowns = np.zeros(count, dtype=np.intp)
    touchdowns[kept] = told.touchdowns[kept]
    return replace(
        told, state=state, covariance=covariance, touchdowns=touchdowns,
        doubted=np.full((count, 3), np.nan),
    )  # fmt: skip


def treads_under(known: StairMap, feet: FloatArray, *, place_sigma: float) -> IntArray:
    """Which tread of a map each foot stands on.

    Args:
        known: The map.
        feet: Points in W, (k, 3) [m].
        place_sigma: Standard deviation of where the robot believes to be [m].

    Returns:
        0 for the floor, i for the tread behind nosing i - 1; -1 where the foot may be on either
        side of a nosing, or beyond the last tread of a flight whose end is not known, (k,).
    """
    s = lane_places(known, feet)
    doubt = NEAR_NOSING * np.hypot(known.place_errors / NORMAL_95, place_sigma)
    unclear = np.any(np.abs(s[:, None] - known.places) < doubt, axis=1)
    if not known.complete:
        unclear |= s > known.places[-1] + known.run
    return np.where(unclear, -1, np.searchsorted(known.places, s))


def add_touchdowns(
    told: TouchdownHeights,
    known: StairMap,
    feet: FloatArray,
    stands: BoolArray,
    landed: BoolArray,
    *,
    place_sigma: float = 0.0,
) -> TouchdownHeights:
    """The heights after feet have landed.

    Args:
        told: The heights before.
        known: The map.
        feet: Points of the ground under the feet, in W as estimated, (4, 3) [m].
        stands: Which of them stand firmly, (4,).
        landed: Which of these have not before, (4,).
        place_sigma: Standard deviation of where the robot believes to be [m].

    Returns:
        The heights; the same object if no foot has made a step. If it is not clear on which treads
        the feet stand, they are those of before, and feet may be ignored from now on.
    """
    stands = stands & np.isfinite(feet).all(axis=1)
    with np.errstate(invalid="ignore"):
        stepped = ~(np.linalg.norm(feet[:, :2] - told.places, axis=1) < SAME_PLACE)
    new = landed & stepped & stands
    if not new.any():
        return told
    on = np.full(FEET, -1)
    on[stands] = treads_under(known, feet[stands], place_sigma=place_sigma)
    places = np.where(new[:, None], feet[:, :2], told.places)
    # A foot of which it is not clear what it stands on is no measure for others, either.
    ignored = np.where(new, on < 0, told.ignored)
    told = replace(
        _with_new_stances(told, np.flatnonzero(new)), places=places, ignored=ignored.astype(bool)
    )
    told, rows = _believed(told, known, feet, on, stands & (on >= 0) & ~told.ignored, new)
    fresh = rows[new[rows]]
    if len(rows) < 2 or not len(fresh):
        return told
    y, H = _differences(told, known, feet, rows, on)
    R = NOISE**2 * (np.eye(len(y)) + 1.0)
    gain = np.linalg.solve(H @ told.covariance @ H.T + R, H @ told.covariance).T
    # Joseph's form: the covariance stays symmetric and positive, whatever is rounded.
    L = np.eye(len(told.state)) - gain @ H
    touchdowns, doubted = told.touchdowns.copy(), told.doubted.copy()
    treads = on[fresh][on[fresh] > 0] - 1
    np.add.at(touchdowns, treads, 1)
    doubted[treads] = np.nan
    return replace(
        told,
        state=told.state + gain @ (y - H @ told.state),
        covariance=L @ told.covariance @ L.T + gain @ R @ gain.T,
        touchdowns=touchdowns,
        doubted=doubted,
    )


def _with_new_stances(told: TouchdownHeights, legs: IntArray) -> TouchdownHeights:
    """The heights with stances of some legs of which nothing is known yet."""
    at = told.count + TILTS + FEET + legs
    state, covariance = told.state.copy(), told.covariance.copy()
    state[at] = 0.0
    covariance[at], covariance[:, at] = 0.0, 0.0
    covariance[at, at] = STANCE_SIGMA**2
    return replace(told, state=state, covariance=covariance)


def _differences(
    told: TouchdownHeights, known: StairMap, feet: FloatArray, rows: IntArray, on: IntArray
) -> tuple[FloatArray, FloatArray]:
    """How much higher each foot stands than the first of them (k - 1,) [m], and its rows H."""
    n = told.count
    s = lane_places(known, feet)
    across = np.array([-np.sin(known.yaw), np.cos(known.yaw)])
    aside = (feet[:, :2] - known.origin) @ across
    A = np.zeros((len(rows), n + EXTRA))
    A[:, n], A[:, n + 1] = s[rows], aside[rows]
    for i, row in enumerate(rows):
        if on[row]:
            A[i, on[row] - 1] = 1.0
        A[i, n + TILTS + row] = A[i, n + TILTS + FEET + row] = 1.0
    z = feet[rows, 2] - np.where(on[rows] == 0, known.floor, 0.0)
    return z[1:] - z[0], A[1:] - A[0]


def _believed(
    told: TouchdownHeights,
    known: StairMap,
    feet: FloatArray,
    on: IntArray,
    stands: BoolArray,
    new: BoolArray,
) -> tuple[TouchdownHeights, IntArray]:
    """Which feet are believed, and the heights with what is remembered of the others.

    Each foot is held against the others, the farthest off first. One that is too far off is no
    measure until it lands again. If it has just landed, it is remembered. The second one on a tread
    that says the same, from another place, is believed; or it contradicts the map, if both are
    farther off than a map may be.
    """
    while True:
        rows = np.flatnonzero(stands & ~told.ignored)
        if len(rows) < 2:
            return told, rows
        off, sigma = _offsets(told, known, feet, rows, on)
        share = np.abs(off) / np.maximum(OUTLIER * sigma, LEAST_OUTLIER)
        worst = int(np.argmax(share))
        if share[worst] <= 1.0:
            return told, rows
        foot, higher = int(rows[worst]), float(off[worst])
        tread = int(on[foot]) - 1
        # With two feet it is not known which of them is off, and neither is a measure. What lies on
        # the floor, or below one foot of all that stand on a tread, is no tread.
        unsure = len(rows) < 3 or tread < 0 or bool(np.all(on[rows] == on[foot]))
        if new[foot] and not unsure:
            before, *there = told.doubted[tread]
            apart = float(np.linalg.norm(feet[foot, :2] - there))
            if abs(before - higher) <= LEAST_OUTLIER and apart > OTHER_PLACE:
                if min(abs(before), abs(higher)) <= FEET_APART:
                    told = _with_open_tread(told, tread, higher)
                    continue
                contradicted = (*told.contradicted, (tread + 1, higher))
                told = replace(told, contradicted=contradicted)
            else:
                doubted = told.doubted.copy()
                doubted[tread] = [higher, *feet[foot, :2]]
                told = replace(told, doubted=doubted)
        ignored = told.ignored.copy()
        ignored[rows if len(rows) < 3 else foot] = True
        told = replace(told, ignored=ignored)


def _offsets(
    told: TouchdownHeights, known: StairMap, feet: FloatArray, rows: IntArray, on: IntArray
) -> tuple[FloatArray, FloatArray]:
    """How much higher than expected each foot is than the median of the others, and its deviation.

    Returns:
        Both of each of `rows` (k,) [m].
    """
    y, H = _differences(told, known, feet, rows, on)
    # Of each foot against the first one, itself with zeros.
    off = np.concatenate([[0.0], y - H @ told.state])
    A = np.vstack([np.zeros(H.shape[1]), H])
    found, sigma = np.zeros(len(rows)), np.zeros(len(rows))
    for k in range(len(rows)):
        others = np.arange(len(rows)) != k
        found[k] = off[k] - np.median(off[others])
        row = A[k] - A[others].mean(axis=0)
        sigma[k] = np.sqrt(row @ told.covariance @ row + NOISE**2 * (1.0 + 1.0 / others.sum()))
    return found, sigma


def _with_open_tread(told: TouchdownHeights, tread: int, sigma: float) -> TouchdownHeights:
    """The heights with a tread, counted from 0, that is known no better than to `sigma` [m]."""
    covariance = told.covariance.copy()
    covariance[tread, tread] += sigma**2
    return replace(told, covariance=covariance)


def map_with_touchdowns(known: StairMap, told: TouchdownHeights) -> StairMap:
    """The map with the heights that feet have told; treads that err alike go along.

    Args:
        known: The map.
        told: What the feet have told.
    """
    covariance = told.covariance[: told.count, : told.count]
    heights, sigmas = told.state[: told.count], np.sqrt(np.diag(covariance))
    height_errors = NORMAL_95 * sigmas
    scale = np.where(sigmas > 0.0, sigmas, 1.0)
    correlation = covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    floor, stairs, *rest = known.elements
    assert stairs.rises is not None
    rises = np.diff(heights, prepend=known.floor)
    used = len(heights) if known.complete else max(known.trusted, 1)
    return replace(
        known,
        elements=(floor, replace(stairs, rises=rises.tolist()), *rest),
        heights=heights,
        height_errors=height_errors,
        height_correlation=correlation,
        error_height=float(height_errors[:used].max()),
        touched=tuple((known.touched_treads | (told.touchdowns > 0)).tolist()),
    )
