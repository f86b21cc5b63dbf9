"""A map that grows: one look after the other adds steps to a flight, until its end is seen.

A flight that ends higher than the camera is not seen to its end from its foot. So the robot climbs
what it has seen, stops on a tread, and looks again. What it sees from there is matched with the
map by the heights of the treads, for a step more or less is a whole rise. Nosings that are in view
again are told anew, from nearer; those that the camera has passed stay as they were, for feet stand
on them. The lane stays the one of the first look.

The map's heights are those of the treads as first seen, or as feet have found them since
(`touchdown_heights`). What the feet stand higher than that is taken off each later look, so that
the treads ahead fit those below.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray, IntArray
from drake_quad.errors import PlanningError
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_map import (
    StairMap,
    check_width,
    lay_flight,
    sees_end,
    width_about,
    width_of_steps,
)
from drake_quad.terrain.elements import Element

TRUSTED_PLACE = (
    0.025  # [m] of half a 95 % interval of a nosing's place, up to which it is planned on
)
SIGMAS = 4.0  # deviations by which two looks at one nosing may differ
LEAST_PLACE, LEAST_HEIGHT = 0.05, 0.03  # [m] by which they may differ in any case
SHARE = 0.35  # of a run or a rise, by which they may differ at most
FEET_APART = 0.04  # [m] by which two feet may stand higher above each other than the map has it


def trust(found: StairMap, *, reach: float, yaw_sigma: float) -> StairMap:
    """A map of first steps with how many of them are known well enough to be planned on.

    The places' errors then have the heading's in them, which later looks do not tell anew.

    Args:
        found: The map.
        reach: How far from the lane's middle line feet are put down [m].
        yaw_sigma: Deviation of the climb's heading [rad].
    """
    errors = np.hypot(found.place_errors, NORMAL_95 * reach * yaw_sigma)
    good = errors <= TRUSTED_PLACE
    count = len(good) if np.all(good) else int(np.argmin(good))
    if found.complete or count == 0:
        trusted = len(good) if found.complete else 0
        return replace(found, trusted=trusted, place_errors=errors)
    return replace(
        found,
        trusted=count,
        place_errors=errors,
        error_place=float(errors[:count].max()),
        error_height=float(found.height_errors[:count].max()),
    )


def lane_places(known: StairMap, p_W: FloatArray) -> FloatArray:
    """Places along a map's lane of points (..., 2 or 3) in W [m]."""
    direction = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    return np.asarray((p_W[..., :2] - known.origin) @ direction)


def ground_height(known: StairMap, s: FloatArray) -> FloatArray:
    """Height in W of a map's ground at `s` (k,) along its lane [m]."""
    levels = np.concatenate([[known.floor], known.heights])
    return np.asarray(levels[np.searchsorted(known.places, s)])


def mean_rise(known: StairMap) -> float:
    """Mean rise of a map's steps [m]."""
    return float(known.heights[-1] - known.floor) / len(known.heights)


def feet_offset(known: StairMap, feet: FloatArray) -> float:
    """How much higher than the map has it the ground is under the feet [m].

    Args:
        known: The map.
        feet: Points in W where feet stand, (k, 3) [m].

    Raises:
        PlanningError: The feet do not stand as high above each other as the map has them.
    """
    if not len(feet):
        return 0.0
    apart = feet_apart(known, feet)
    if apart > FEET_APART:
        raise PlanningError(
            f"the feet contradict the map: treads that they stand on differ in height by "
            f"{apart:.2f} m more, or less, than it has",
            off=apart,
        )
    return float(np.median(feet[:, 2] - ground_height(known, lane_places(known, feet))))


def feet_apart(known: StairMap, feet: FloatArray) -> float:
    """How much the ground under the feet differs from the map's, beyond what all feet share [m]."""
    return float(np.ptp(feet[:, 2] - ground_height(known, lane_places(known, feet))))


def datum_error(known: StairMap, feet: FloatArray) -> float:
    """Half of the widest 95 % interval of the heights of the treads under the feet [m]."""
    errors = np.concatenate([[0.0], known.height_errors])
    return float(errors[np.searchsorted(known.places, lane_places(known, feet))].max())


def describe_standing(known: StairMap, feet: FloatArray) -> str:
    """Where a robot stands on a map, for people.

    Args:
        known: The map.
        feet: Its feet, (4, 3) in W [m].
    """
    on = sorted({int(k) for k in np.searchsorted(known.places, lane_places(known, feet))})
    low, high = on[0], on[-1]
    if high == 0:
        return "on four feet before the flight"
    if low == high:
        return f"on four feet on step {high}"
    return f"on four feet on steps {low} to {high}" if low else f"with its fore feet on step {high}"


class Match(NamedTuple):
    """Which nosings of a map a look shows.

    Attributes:
        first: Index in the map of the first nosing that the look tells.
        below: How many that it tells are not in view.
        places: The places of those that it tells along the map's lane, (n,) [m].
        heights: The heights of their treads in the map's heights, (n,) [m].
        place_errors: Half of the 95 % interval of each place, along the lane, (n,) [m].
        height_errors: The same of each height, (n,) [m].
    """

    first: int
    below: int
    places: FloatArray
    heights: FloatArray
    place_errors: FloatArray
    height_errors: FloatArray


def match_look(
    known: StairMap, belief: StairBelief, level: Level | None, *, offset: float, reach: float
) -> Match:
    """Which nosings of the map a look shows, if it agrees with the map.

    Args:
        known: The map.
        belief: What was seen.
        level: What was seen beyond it, and how many of its nosings are not in view.
        offset: How much higher the ground is than the map has it [m].
        reach: How far from the lane's middle line feet are put down [m].

    Raises:
        PlanningError: It shows nothing that the map has, or something else than the map.
    """
    if not belief.going_up:
        raise PlanningError("what is seen contradicts the map: it leads down")
    lane = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    away = float((belief.origin - known.origin) @ belief.direction)
    places = (belief.places + away) / float(lane @ belief.direction)
    heights = belief.heights[1:] - offset
    turned = np.hypot(belief.sigma("yaw"), belief.yaw - known.yaw)
    errors = np.hypot(NORMAL_95 * belief.place_sigmas, NORMAL_95 * reach * turned)
    height_errors = NORMAL_95 * belief.height_sigmas[1:]
    below = 0 if level is None else min(level.below_view, len(places))
    mine, count = np.arange(below, len(places)), len(known.places)
    run, rise = known.run, mean_rise(known)
    best: tuple[float, int] | None = None
    if not below and abs(places[0] - known.places[-1] - run) <= SHARE * run:
        # Of the map nothing is in view but its last tread: the next step is told.
        best = (abs(belief.heights[0] - offset - known.heights[-1]), count)
    for first in range(-below, count):
        both = mine[(mine + first < count) & (mine + first >= 0)]
        if not len(both):
            continue
        off = float(np.abs(heights[both] - known.heights[both + first]).mean())
        best = min(best or (off, first), (off, first))
    if best is None:
        raise PlanningError("none of the steps that the map has is in view")
    first = best[1]
    both = mine[(mine + first < count) & (mine + first >= 0)]
    if not len(both):
        if best[0] > SHARE * rise:
            raise PlanningError("none of the steps that the map has is in view")
        return Match(first, below, places, heights, errors, height_errors)
    for name, told, map_has, sigma, least, most in (
        ("place", places, known.places, (errors, known.place_errors), LEAST_PLACE, SHARE * run),
        ("height", heights, known.heights, (height_errors, known.height_errors), LEAST_HEIGHT,
         SHARE * rise),
    ):  # fmt: skip
        apart = np.abs(told[both] - map_has[both + first])
        spread = np.hypot(sigma[0][both], sigma[1][both + first]) / NORMAL_95
        allowed = np.minimum(np.maximum(SIGMAS * spread, least), most)
        k = int(np.argmax(apart - allowed))
        if apart[k] > allowed[k]:
            raise PlanningError(
                f"what is seen contradicts the map: the {name} of step {int(both[k] + first) + 1} "
                f"is {apart[k]:.2f} m off",
                off=float(apart[k]),
            )
    return Match(first, below, places, heights, errors, height_errors)


def grow_map(
    known: StairMap,
    belief: StairBelief | None,
    level: Level | None,
    *,
    feet: FloatArray,
    landing: float,
    reach: float,
    look: int,
    back: tuple[Element, ...] = (),
) -> StairMap:
    """The map with what a further look shows.

    Args:
        known: The map before.
        belief: What was seen; None if nothing speaks for stairs.
        level: What was seen beyond the last nosing.
        feet: Points in W where feet stand, (k, 3) [m].
        landing: How far the ground is level beyond the last nosing [m].
        reach: How far from the lane's middle line feet are put down [m].
        look: Number of the look, the first being 0.
        back: What the course ends with once it is known: `return`, if the robot is to come back.

    Raises:
        PlanningError: What is seen, or felt, contradicts the map.
    """
    if belief is None:
        raise PlanningError("no steps are seen from here")
    offset = feet_offset(known, feet)
    found = match_look(known, belief, level, offset=offset, reach=reach)
    # What the feet stand higher is not just what the treads ahead are: by as much as that differs
    # from foot to foot, and as the heights of the treads under them are off themselves.
    datum = float(np.hypot(feet_apart(known, feet), datum_error(known, feet))) if len(feet) else 0.0
    seen_errors = found.height_errors
    found = found._replace(height_errors=np.hypot(seen_errors, datum))
    end_seen, count = sees_end(belief, level), found.first + len(found.places)
    if end_seen and count < len(known.places):
        raise PlanningError(
            f"what is seen contradicts the map: the flight ends after {count} steps, and "
            f"{len(known.places)} were seen"
        )
    size = max(count, len(known.places))
    # A nosing that is in view again is told anew, unless its place was known better.
    told = np.arange(found.first + found.below, count)
    before = np.concatenate([known.place_errors, np.full(size - len(known.places), np.inf)])
    better = found.place_errors[found.below :] <= before[told]
    # Once feet have told heights, they are told anew only if they are known better so.
    retold = better
    if known.touched_treads.any():
        heights_before = np.concatenate(
            [known.height_errors, np.full(size - len(known.places), np.inf)]
        )
        retold = better & (found.height_errors[found.below :] <= heights_before[told])
    touched = np.concatenate([known.touched_treads, np.zeros(size - len(known.places), dtype=bool)])
    touched[told[retold]] = False
    columns = []
    for old, new, which in (
        (known.places, found.places, better), (known.heights, found.heights, retold),
        (known.place_errors, found.place_errors, better),
        (known.height_errors, found.height_errors, retold),
    ):  # fmt: skip
        column = np.concatenate([old, np.full(size - len(old), np.inf)])
        column[told[which]] = new[found.below :][which]
        columns.append(column)
    places, heights, place_errors, height_errors = columns
    mine = told[retold] - found.first
    correlation = _correlation(known, belief, size, told[retold], mine, seen_errors[mine], datum)
    told = told[better]
    seen_in = [*known.seen_in, *[look] * (size - len(known.places))]
    for k in told:
        seen_in[k] = look
    aside = np.array([-np.sin(known.yaw), np.cos(known.yaw)])
    ends = belief.origin + belief.places[[0, -1], None] * belief.direction
    lateral = [float(x) for x in (ends - known.origin) @ aside]
    beyond = 0.0 if level is None else width_about(lateral[-1], level.right, level.left)
    flight = known.elements[1]
    steps = np.diff(np.concatenate([[known.floor], heights]))
    if np.any(steps <= 0.0) or np.any(np.diff(places) <= 0.0):
        raise PlanningError("what is seen contradicts the map: steps would be in no order")
    width = _width(known, belief, level, lateral=lateral, reach=reach)
    doubt = ""
    if end_seen:
        doubt = _doubt(max(width, beyond), known.turning_space if back else 0.0)
    complete = end_seen and not doubt
    elements = lay_flight(
        places, heights, floor=known.floor, run=known.run, width=width, beyond=beyond,
        landing=landing if complete else None, reach=reach, is_open=bool(flight.open),
        overhang=flight.overhang,
    )  # fmt: skip
    grown = replace(
        known,
        elements=(*elements, *back) if complete else elements,
        places=places,
        heights=heights,
        place_errors=place_errors,
        height_errors=height_errors,
        height_correlation=correlation,
        error_place=float(place_errors.max()),
        error_height=float(height_errors.max()),
        complete=complete,
        doubt=doubt,
        seen_in=tuple(seen_in),
        touched=tuple(touched.tolist()),
    )
    return trust(grown, reach=reach, yaw_sigma=0.0)


def _correlation(
    known: StairMap,
    belief: StairBelief,
    size: int,
    told: IntArray,
    seen: IntArray,
    seen_errors: FloatArray,
    datum: float,
) -> FloatArray:
    """How errors of heights go together: of those told anew, and of those that stay.

    Args:
        known: The map before.
        belief: What was seen.
        size: How many steps the map has now.
        told: Indices in the map of the heights that are told anew.
        seen: Their indices in the belief.
        seen_errors: Half of the 95 % interval of each as seen [m].
        datum: The same of the height that all of them are counted from [m].
    """
    found = np.eye(size)
    stay = np.setdiff1d(np.arange(len(known.heights)), told)
    found[np.ix_(stay, stay)] = known.height_correlation[np.ix_(stay, stay)]
    alike = np.outer(seen_errors, seen_errors) * belief.height_correlation[np.ix_(seen, seen)]
    widths = np.hypot(seen_errors, datum)
    found[np.ix_(told, told)] = (alike + datum**2) / np.outer(widths, widths)
    return found


def _doubt(width: float, turning: float) -> str:
    """Why a flight that was seen to its end is not planned to its end yet; empty if it may be.

    Args:
        width: Width of the landing, as far as it is seen [m].
        turning: Width that the robot needs to turn on it; 0 if it does not turn [m].
    """
    if width < turning:
        return f"{width:.2f} m of the landing are seen, and {turning:.2f} m are wanted to turn on"
    return ""


def _width(
    known: StairMap,
    belief: StairBelief,
    level: Level | None,
    *,
    lateral: list[float],
    reach: float,
) -> float:
    """Width about the lane of a flight of which more has been seen [m].

    Near a nosing the image may be narrower than the flight: on a side where the treads in view
    reach its edge the flight is taken to be as wide as it was, if they are seen where feet go.

    Args:
        known: The map before.
        belief: What was seen.
        level: Whether the treads are cut by the image's sides.
        lateral: How far the climb's line is to the left of the lane's, at its ends [m].
        reach: How far from the lane's middle line feet are put down [m].

    Raises:
        PlanningError: Too little of the treads is seen.
    """
    right, left = belief.right, belief.left
    seen = min(width_about(x, right, left) for x in lateral)
    if level is not None and seen >= 2.0 * reach:
        right = -np.inf if level.cut_right else right
        left = np.inf if level.cut_left else left
    width = min(width_about(x, right, left) for x in lateral)
    along = np.interp(belief.places, belief.places[[0, -1]], lateral)
    return min(known.elements[1].width or seen, check_width(width), width_of_steps(along, level))
