"""A further look at a flight that the robot stands on: what is known of it helps to see the rest.

From a tread little of a flight may be left to see. So heading, rise, run, overhang and the kind of
risers are believed to be those of the map, and the steps of the map are fitted to the image where
a search finds nothing that agrees with them.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.growing_map import feet_offset, lane_places, match_look, mean_rise
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.stair_tracker import CameraPose, StairTracker

NEAREST = 0.08  # [m] ahead of the camera, from which a nosing may be the first that is told
FURTHER = 0.01  # [m] deviation of place and height of a step that is taken to follow
BOARD = 0.04  # [m] height of a nosing's face, which stands before the riser
HEADING = 0.005  # [rad] deviation of a map's heading, beside the camera's and the robot's own


def continued(known: StairMap, further: int) -> tuple[FloatArray, FloatArray]:
    """Places and heights of a map's nosings, and of so many more like them that follow."""
    more = np.arange(1.0, further + 1.0)
    places = np.concatenate([known.places, known.places[-1] + more * known.run])
    heights = np.concatenate([known.heights, known.heights[-1] + more * mean_rise(known)])
    return places, heights


def nosings_in_view(
    known: StairMap, model: CameraModel, pose: CameraPose, *, further: int = 0
) -> NDArray[np.intp]:
    """Which nosings of a map lie ahead of a camera and above the lower edge of its image.

    Args:
        known: The map.
        model: Intrinsics.
        pose: Pose of the camera.
        further: How many steps like those of the map are looked for beyond its last one.
    """
    direction = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    places, heights = continued(known, further)
    nosings = np.column_stack([known.origin + places[:, None] * direction, heights])
    _, down, ahead = ((nosings - pose.p_WC) @ pose.R_WC).T
    row = model.cy + model.fy * down / np.maximum(ahead, 1e-6)
    near = places - float(lane_places(known, pose.p_WC))
    seen = (ahead > 0.0) & (row <= model.height - 1) & (row >= 0) & (near > NEAREST)
    return np.flatnonzero(seen)


def look_again(
    tracker: StairTracker,
    depth: NDArray[np.floating],
    model: CameraModel,
    pose: CameraPose,
    known: StairMap,
    *,
    feet: FloatArray,
    stamp: float,
) -> StairBelief | None:
    """The stairs that an image taken on a known flight shows.

    They are searched for anew, with the height of the ground before the first nosing from the map:
    that nosing may lie below the image, where the fit still has to have it. If that finds nothing
    that agrees with the map, the steps of the map are fitted to the image, and one more. A last
    step that the map does not have is not told while its tread may be out of sight
    (`without_doubtful_last`).

    Args:
        tracker: Searches.
        depth: The image.
        model: Intrinsics.
        pose: Pose of the camera when it was taken.
        known: The map.
        feet: Points in W where feet stand, (k, 3) [m].
        stamp: Time of the image [s].

    Returns:
        The first belief that agrees with the map; of several that do not, the first; None where
        nothing speaks for stairs.
    """
    try:
        offset = feet_offset(known, feet)
    except PlanningError:
        offset = 0.0
    seen = nosings_in_view(known, model, pose, further=1)
    if not len(seen):
        return None
    here = float(lane_places(known, pose.p_WC))
    flight = steps_ahead(known, pose, offset=offset, further=int(seen[0] == len(known.places)))
    other: StairBelief | None = None
    for first in (seen[0] - 1, seen[0], seen[0] + 1):
        if first < 0 or first >= len(known.places) or known.places[first] - here < NEAREST:
            continue
        before = known.floor if first == 0 else known.heights[first - 1]
        ground = np.array([[*pose.p_WC[:2], before + offset]])
        belief = tracker.update(depth, pose, stamp=stamp, feet=ground, of=flight)
        if belief is not None and _agrees(known, belief, offset):
            return without_doubtful_last(belief, known, pose)
        other = other or belief
    belief = tracker.update(depth, pose, stamp=stamp, last=flight, of=flight)
    if belief is not None and _agrees(known, belief, offset):
        return without_doubtful_last(belief, known, pose)
    return other


def without_doubtful_last(belief: StairBelief, known: StairMap, pose: CameraPose) -> StairBelief:
    """A belief without its last step, if that is new and its tread may be out of sight.

    Of a nosing that is a little above the camera there are pixels of its face and of the riser
    behind it. The riser's upper end then fits as a nosing, lower by the height of the face and
    further by the overhang. From the next tread the step is seen from above.

    Args:
        belief: What was seen, and agrees with the map.
        known: The map; what it has is told again however it is seen.
        pose: Pose of the camera.

    Returns:
        The belief, or it without its last step; then its end is not told either.
    """
    n = len(belief.places)
    nosing = belief.origin + belief.places[-1] * belief.direction
    mapped = float(lane_places(known, nosing)) <= known.places[-1] + 0.5 * known.run
    if n < 2 or mapped or pose.p_WC[2] - belief.nosing_height(n - 1) > BOARD:
        return belief
    kept = np.delete(np.arange(2 * n + 5), [n - 1, 2 * n])
    return replace(
        belief,
        places=belief.places[:-1],
        heights=belief.heights[:-1],
        covariance=belief.covariance[np.ix_(kept, kept)],
        count_least=belief.count_least - 1,
        count_most=None,
    )


def _agrees(known: StairMap, belief: StairBelief, offset: float) -> bool:
    """Whether what is seen agrees with the map."""
    try:
        match_look(known, belief, None, offset=offset, reach=0.0)
    except PlanningError:
        return False
    return True


def steps_ahead(known: StairMap, pose: CameraPose, *, offset: float, further: int) -> StairBelief:
    """A map's flight, told from below a camera.

    Args:
        known: The map.
        pose: Pose of the camera.
        offset: How much higher the ground is than the map has it [m].
        further: How many steps like those of the map are taken to follow.
    """
    stairs, n = known.elements[1], len(known.places) + further
    lane = np.array([np.cos(known.yaw), np.sin(known.yaw)])
    here = float(lane_places(known, pose.p_WC))
    lateral = float((pose.p_WC[:2] - known.origin) @ np.array([-lane[1], lane[0]]))
    places, heights = continued(known, further)
    unsure, yaw = [NORMAL_95 * FURTHER] * further, NORMAL_95 * HEADING
    halves = [*known.place_errors, *unsure, 0.0, *known.height_errors, *unsure, yaw, 0.0, 0.0, 0.0]
    half = 0.5 * (stairs.width or 0.0)
    return StairBelief(
        stamp=-np.inf,
        origin=pose.p_WC[:2],
        passed=0,
        places=places - here,
        heights=np.concatenate([[known.floor], heights]) + offset,
        yaw=known.yaw,
        overhang=stairs.overhang or 0.0,
        rise=mean_rise(known),
        run=known.run,
        covariance=np.diag(np.square(halves) / NORMAL_95**2),
        count_least=n,
        count_most=n if known.complete else None,
        is_open=bool(stairs.open),
        right=-half - lateral,
        left=half - lateral,
    )
