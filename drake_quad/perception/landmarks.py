"""Flights of the map as landmarks: how far an image of one says that the estimated pose is off.

A robot that walks by its legs and its IMU drifts along the ground and in heading, since nothing
that it feels shows them. An image of a flight whose place is known shows both, and where the
flight's sides are in view also how far aside the robot is. Localisation by a map's features:
S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", MIT Press 2005, chapter 7.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray, read_only
from drake_quad.estimation.landmark_correction import LandmarkSighting
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.flight_sides import find_sides
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import LEAST_PLACE, CameraPose, StairTracker
from drake_quad.terrain.course import Course
from drake_quad.terrain.lane import Flight, Lane

FARTHEST = 2.5  # [m] ahead of the camera, beyond which a nosing is not looked for
MOST_STEPS = 6  # of a flight that are looked for
MOST_TURN = 0.35  # [rad] between the camera's heading and the flight's
EVEN = 0.012  # [m] by which the rises, or runs, of a flight may differ: its steps look alike
MAP_PLACE = 0.003  # [m] deviation of a nosing's place from the map's
MAP_HEIGHT = 0.005  # [m] the same of the height of the ground before a flight
MAP_YAW = math.radians(0.1)  # [rad] the same of a nosing's direction
MAP_SIDE = 0.003  # [m] the same of the place of a flight's sides
MOST_OFF = 0.35  # of a run; farther off, a step might be taken for another
UNSEEN = np.inf


@dataclass(frozen=True)
class MappedFlight:
    """A flight of the map, as much of it as lies ahead of a camera.

    Attributes:
        lane: The lane that it is on.
        places: Places of its nosings along the lane, (n,) [m].
        belief: The same as a belief told from the camera's place, to begin a fit from.
    """

    lane: Lane
    places: FloatArray
    belief: StairBelief


def flight_ahead(course: Course, pose: CameraPose, *, stamp: float) -> MappedFlight | None:
    """The nearest flight ahead of a camera on the lane that it looks along.

    Args:
        course: The map.
        pose: Pose of the camera.
        stamp: Time of the image [s].

    Returns:
        The flight; None if there is none within FARTHEST, or with steps that differ by more than
        EVEN, which no fit could tell from each other.
    """
    nearest: MappedFlight | None = None
    for lane in course.lanes:
        turned = (pose.heading - lane.yaw + math.pi) % math.tau - math.pi
        s, lateral = (float(x) for x in lane.coordinates(pose.p_WC))
        if abs(turned) > MOST_TURN or not -lane.run_in <= s <= lane.length + lane.run_out:
            continue
        if abs(lateral) > float(lane.half_widths.max()):
            continue
        for flight in lane.flights:
            found = _ahead_on(lane, flight, pose, s=s, lateral=lateral, stamp=stamp)
            if found is not None and (
                nearest is None or found.belief.places[0] < nearest.belief.places[0]
            ):
                nearest = found
    return nearest


def _ahead_on(
    lane: Lane, flight: Flight, pose: CameraPose, *, s: float, lateral: float, stamp: float
) -> MappedFlight | None:
    """What of a flight lies ahead of a camera that is at `s`, `lateral` of its lane [m]."""
    nosings = lane.breaks[flight.first : flight.last + 1]
    heights = lane.heights[flight.first - 1 : flight.last + 1]
    ahead = np.flatnonzero((nosings - s > LEAST_PLACE) & (nosings - s < FARTHEST))[:MOST_STEPS]
    if not len(ahead):
        return None
    first, last = int(ahead[0]), int(ahead[-1]) + 1
    places, levels = nosings[first:last], heights[first : last + 1]
    rises, runs = np.diff(heights), np.diff(nosings)
    if np.ptp(rises) > EVEN or (len(runs) and np.ptp(runs) > EVEN) or np.any(rises == 0.0):
        return None
    n, half = len(places), float(lane.half_widths[flight.first])
    deviations = np.concatenate([np.zeros(n), np.full(n + 1, MAP_HEIGHT), np.zeros(4)])
    belief = StairBelief(
        stamp=stamp,
        origin=pose.p_WC[:2],
        passed=0,
        places=places - s,
        heights=levels,
        yaw=lane.yaw + flight.yaw,
        overhang=flight.overhang,
        rise=float(rises.mean()),
        run=float(runs.mean()) if len(runs) else float(np.diff(lane.breaks)[flight.first]),
        covariance=np.diag(deviations**2),
        count_least=n,
        count_most=n,
        is_open=flight.open,
        right=-half - lateral,
        left=half - lateral,
    )
    return MappedFlight(lane, places, belief)


def sight_flight(
    tracker: StairTracker,
    depth: NDArray[np.floating],
    model: CameraModel,
    pose: CameraPose,
    course: Course,
    *,
    stamp: float,
) -> LandmarkSighting | None:
    """What an image of the map's nearest flight says of the estimated pose.

    Args:
        tracker: Fits the flight.
        depth: Distances along the optical axis [m], (height, width); 0 where there is none.
        model: Intrinsics.
        pose: Pose of the camera as estimated when the image was taken, and its tilt's deviations.
        course: The map.
        stamp: That time [s].

    Returns:
        The sighting; None if no flight is ahead, or if what is seen does not agree with one.
    """
    mapped = flight_ahead(course, pose, stamp=stamp)
    if mapped is None:
        return None
    tilted = replace(
        pose, turn_sigmas=np.array([*pose.turn_sigmas[:2], 0.0]), place_sigmas=np.zeros(3)
    )
    seen = tracker.follow(depth, tilted, mapped.belief, stamp=stamp)
    if seen is None:
        return None
    n, lane = len(seen.places), mapped.lane
    # Told across and along the stairs as they are seen, which no error of the heading changes.
    here, _ = lane.coordinates(pose.p_WC)
    off = float(here) + seen.places - mapped.places[seen.passed : seen.passed + n]
    columns = [*range(n), 2 * n + 1]  # the places and the yaw
    C = np.array(seen.covariance)[np.ix_(columns, columns)]
    C[range(n), range(n)] += MAP_PLACE**2
    weights = 1.0 / np.diag(C)[:n]
    M = np.zeros((3, n + 1))
    M[0, :n], M[1, n] = weights / weights.sum(), 1.0
    shift = float(M[0, :n] @ off)
    if abs(shift) > MOST_OFF * abs(seen.run):
        return None
    turn = (seen.yaw - mapped.belief.yaw + math.pi) % math.tau - math.pi
    aside, unsure = 0.0, UNSEEN
    sides = find_sides(depth, model, pose, seen, mapped.belief)
    if sides is not None:
        aside, unsure = sides.off(mapped.belief), sides.sigma**2 + MAP_SIDE**2
        M[2, n] = -sides.distance  # what the yaw has wrong turns the sides about the camera
    covariance = M @ C @ M.T + np.diag([MAP_PLACE**2, MAP_YAW**2, unsure])
    direction = np.array([math.cos(mapped.belief.yaw), math.sin(mapped.belief.yaw)])
    return LandmarkSighting(
        stamp,
        read_only(direction),
        read_only(pose.p_WC),
        read_only(np.array([shift, turn, aside])),
        read_only(covariance),
    )
