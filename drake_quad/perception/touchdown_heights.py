"""A map's heights made better by the feet: a foot that has landed tells how high its tread is.

How high a foot is in the world is known no better than how high the base is, and the state
estimator takes the base's height from the map. How much higher a foot stands than the other feet
follows from the legs' joints and from the trunk's tilt. So these differences are what is measured.

The state has the heights of the treads and the error of the estimated tilt along the flight. That
error is taken to stay the same all the way, because a tilt that is estimated wrongly makes each
step too high, or each too low. The floor before the flight is where heights are counted from.
A touchdown is one update of a Kalman filter (Kalman, "A New Approach to Linear Filtering and
Prediction Problems", Journal of Basic Engineering, 1960).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray, read_only
from drake_quad.perception.growing_map import FEET_APART, lane_places
from drake_quad.perception.stair_belief import NORMAL_95
from drake_quad.perception.stair_map import StairMap

FOOT_SIGMA = 0.0015  # [m] deviation of a foot's height over its tread: joints, and what it sinks in
NEAR_NOSING = 3.0  # deviations of a nosing's place within which a foot may be on either side


@dataclass(frozen=True, eq=False)
class TouchdownHeights:
    """What the feet have told of a map's heights so far; arrays cannot be written to.

    Attributes:
        state: Heights of the treads in W [m], then the error of the estimated tilt [rad], (n + 1,).
        covariance: Its covariance, (n + 1, n + 1).
        touchdowns: How many touchdowns told each tread's height, (n,).
        off: By how much a touchdown's height differed most from what was expected [m].
    """

    state: FloatArray
    covariance: FloatArray
    touchdowns: NDArray[np.intp]
    off: float = 0.0

    def __post_init__(self) -> None:
        for name in ("state", "covariance"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def contradicts(self) -> bool:
        """Whether a foot found its tread farther off the map than any map is believed to be."""
        return self.off > FEET_APART


def heights_as_seen(known: StairMap, *, tilt_sigma: float) -> TouchdownHeights:
    """What is known of a map's heights before a foot has landed on a tread.

    Args:
        known: The map.
        tilt_sigma: Standard deviation of the estimated tilt of the trunk along the flight [rad].
    """
    count, sigmas = len(known.heights), known.height_errors / NORMAL_95
    covariance = np.zeros((count + 1, count + 1))
    covariance[:-1, :-1] = np.outer(sigmas, sigmas) * known.height_correlation
    covariance[-1, -1] = tilt_sigma**2
    none = np.zeros(count, dtype=np.intp)
    return TouchdownHeights(np.append(known.heights, 0.0), covariance, none)


def heights_on_grown_map(told: TouchdownHeights, known: StairMap) -> TouchdownHeights:
    """The same on a map that has grown: of treads that no foot has been on, as the map has them.

    How these err together with the others is left out.

    Args:
        told: What the feet have told on the map of before.
        known: The map as it is now; the heights of treads that feet have told are those of before.
    """
    count, before = len(known.heights), len(told.touchdowns)
    new = heights_as_seen(known, tilt_sigma=0.0)
    kept = np.flatnonzero(told.touchdowns)
    old, at = np.append(kept, before), np.append(kept, count)
    state, covariance = new.state.copy(), new.covariance.copy()
    state[at] = told.state[old]
    covariance[at], covariance[:, at] = 0.0, 0.0
    covariance[np.ix_(at, at)] = told.covariance[np.ix_(old, old)]
    touchdowns = np.zeros(count, dtype=np.intp)
    touchdowns[kept] = told.touchdowns[kept]
    return TouchdownHeights(state, covariance, touchdowns, told.off)


def treads_under(known: StairMap, feet: FloatArray) -> NDArray[np.intp]:
    """Which tread of a map each foot stands on.

    Args:
        known: The map.
        feet: Points in W, (k, 3) [m].

    Returns:
        0 for the floor, i for the tread behind nosing i - 1; -1 where the foot may be on either
        side of a nosing, or beyond the last tread of a flight whose end is not known, (k,).
    """
    s = lane_places(known, feet)
    doubt = NEAR_NOSING * known.place_errors / NORMAL_95
    unclear = np.any(np.abs(s[:, None] - known.places) < doubt, axis=1)
    if not known.complete:
        unclear |= s > known.places[-1] + known.run
    return np.where(unclear, -1, np.searchsorted(known.places, s))


def add_touchdown(
    told: TouchdownHeights, known: StairMap, feet: FloatArray, landed: int
) -> TouchdownHeights:
    """The heights after a foot has landed.

    Args:
        told: The heights before.
        known: The map.
        feet: Points of the ground under the feet that stand, in W as estimated, (k, 3) [m].
        landed: Row of the foot that has landed last.

    Returns:
        The heights; the same object where it is not clear on which treads the feet stand.
    """
    on = treads_under(known, feet)
    others = np.flatnonzero((on >= 0) & (np.arange(len(feet)) != landed))
    if on[landed] < 0 or not len(others):
        return told
    count = len(told.touchdowns)
    # A column for each tread, the floor before them, and the tilt behind them.
    rows = np.zeros((len(others), count + 2))
    rows[:, on[landed]] += 1.0
    rows[np.arange(len(others)), on[others]] -= 1.0
    s = lane_places(known, feet)
    rows[:, -1] = s[landed] - s[others]
    higher = feet[landed, 2] - feet[others, 2] - rows[:, 0] * known.floor
    H = rows[:, 1:]
    innovation = higher - H @ told.state
    # All differences have the error of the foot that has landed.
    R = FOOT_SIGMA**2 * (np.eye(len(others)) + 1.0)
    gain = np.linalg.solve(H @ told.covariance @ H.T + R, H @ told.covariance).T
    # Joseph's form: the covariance stays symmetric and positive, whatever is rounded.
    L = np.eye(count + 1) - gain @ H
    touchdowns = told.touchdowns.copy()
    if on[landed]:
        touchdowns[on[landed] - 1] += 1
    return TouchdownHeights(
        told.state + gain @ innovation,
        L @ told.covariance @ L.T + gain @ R @ gain.T,
        touchdowns,
        max(told.off, float(abs(np.median(innovation)))),
    )


def map_with_touchdowns(known: StairMap, told: TouchdownHeights) -> StairMap:
    """The map with the heights that feet have told; treads that err alike go along.

    Args:
        known: The map.
        told: What the feet have told.
    """
    covariance = told.covariance[:-1, :-1]
    heights, sigmas = told.state[:-1], np.sqrt(np.diag(covariance))
    height_errors = NORMAL_95 * sigmas
    floor, stairs, *rest = known.elements
    assert stairs.rises is not None
    rises = np.diff(heights, prepend=known.floor)
    used = len(heights) if known.complete else max(known.trusted, 1)
    return replace(
        known,
        elements=(floor, replace(stairs, rises=rises.tolist()), *rest),
        heights=heights,
        height_errors=height_errors,
        height_correlation=covariance / np.outer(sigmas, sigmas),
        error_height=float(height_errors[:used].max()),
        touched=tuple((known.touched_treads | (told.touchdowns > 0)).tolist()),
    )
