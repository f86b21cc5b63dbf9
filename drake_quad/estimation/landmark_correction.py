"""The filter corrected by a landmark: a flight of the map that the camera has seen."""

from math import isfinite
from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.estimation.filter import correct_with, innovation_covariance
from drake_quad.estimation.filter_state import (
    CAMERA,
    E_CAMERA,
    E_POSITION,
    E_ROTATION,
    ERRORS,
    LANDMARK_OFF,
    LANDMARKS,
    POSITION,
    SIGHTED,
    Record,
)
from drake_quad.jit import jit


class LandmarkSighting(NamedTuple):
    """By how much the estimated pose of the base is off, as one image of a mapped flight shows it.

    All are what was estimated less what the map has. Arrays cannot be written to.

    Attributes:
        stamp: Time at which the image was taken [s]; -inf for none.
        direction: Unit vector of the climb in W by the map, (2,).
        eye: Where the camera was estimated to be, in W (3,) [m].
        off: Along the climb [m], about the vertical [rad], and to the left [m], (3,).
        covariance: Covariance of `off`, (3, 3): of the image and the map alone, without that of
            the estimated pose, and of how the camera is turned on the robot. `inf` for what was
            not seen.
    """

    stamp: float
    direction: FloatArray
    eye: FloatArray
    off: FloatArray
    covariance: FloatArray


NO_SIGHTING = LandmarkSighting(
    -np.inf,
    read_only(np.array([1.0, 0.0])),
    read_only(np.zeros(3)),
    read_only(np.zeros(3)),
    read_only(np.diag([np.inf] * 3)),
)


@jit
def correct_by_landmark(m: FloatArray, landmark: LandmarkSighting, models: Record) -> int:
    """Corrects the robot's place along the ground and its heading, once by each sighting.

    The estimate is turned about the vertical and moved along the ground as one piece, feet and all.
    Tilt, height, speed and the IMU's biases stay as they are, and are considered as they are known
    (S. F. Schmidt, 1966): they are known better by other means, and what the camera has wrong is
    not white. That is also why a sighting counts for a part of what it tells
    (`landmarks_alike`). What the camera has wrong all the time is estimated, too.

    Args:
        m: The filter's memory.
        landmark: The newest sighting.
        models: The filter's constants, see `filter_model`.

    Returns:
        How many of the three figures were believed; -1 if the sighting is not a new one.
    """
    if not landmark.stamp > m[SIGHTED]:
        return -1
    m[SIGHTED] = landmark.stamp
    m[LANDMARKS] += 1.0
    s = models[0].settings
    cx, cy = landmark.direction[0], landmark.direction[1]
    x, y, z = landmark.eye[0], landmark.eye[1], landmark.eye[2]
    H, off, noise = np.zeros((3, ERRORS)), np.empty(3), np.empty(3)
    for row in range(3):
        H[row, E_CAMERA + row] = 1.0
        if row == 1:
            H[row, E_ROTATION + 2] = 1.0
            continue
        nx, ny = (cx, cy) if row == 0 else (-cy, cx)
        # n · (ξ_p + θ × eye)
        H[row, E_POSITION], H[row, E_POSITION + 1] = nx, ny
        H[row, E_ROTATION], H[row, E_ROTATION + 1] = -z * ny, z * nx
        H[row, E_ROTATION + 2] = x * ny - y * nx
    for row in range(3):
        off[row] = landmark.off[row] + m[CAMERA + row]
        noise[row] = s.landmarks_alike * landmark.covariance[row, row]
        m[LANDMARK_OFF + row] = off[row] if isfinite(noise[row]) else 0.0
    believed, heading, delta = 0, False, np.zeros(ERRORS)
    # What the image has wrong of the flight's heading is part of the two others' errors: without
    # it the three are independent, and go in one after the other. A heading that is not believed
    # tells nothing of the others, either.
    for row in (1, 0, 2):
        if not isfinite(noise[row]):
            continue
        if heading:
            share = landmark.covariance[row, 1] / landmark.covariance[1, 1]
            off[row] -= share * off[1]
            noise[row] -= share * share * noise[1]
            for a in range(ERRORS):
                H[row, a] -= share * H[1, a]
        if _correct(m, H[row], off[row], noise[row], s.gate, delta):
            believed += 1
            heading = heading or row == 1
    return believed


@jit
def _correct(
    m: FloatArray, h: FloatArray, off: float, noise: float, gate: float, delta: FloatArray
) -> bool:
    """Corrects by one figure; returns whether it was believed.

    Args:
        m: The filter's memory.
        h: What the figure changes by with each error (ERRORS,).
        off: The figure as it was before the sighting's others were taken.
        noise: Variance of the figure.
        gate: Greatest squared Mahalanobis distance that is believed.
        delta: What the sighting's others have corrected; this one's correction is added (ERRORS,).
    """
    for a in range(ERRORS):
        off -= h[a] * delta[a]
    column, variance = innovation_covariance(m, h, noise)
    if off * off > gate * variance:
        return False
    x, y, z = m[POSITION], m[POSITION + 1], m[POSITION + 2]
    turn = column[E_ROTATION + 2] / variance
    # The base's own gain along the ground; its error is ξ_p + θ × p.
    ahead = column[E_POSITION] + z * column[E_ROTATION + 1] - y * column[E_ROTATION + 2]
    aside = column[E_POSITION + 1] + x * column[E_ROTATION + 2] - z * column[E_ROTATION]
    gain = np.zeros(ERRORS)
    gain[E_ROTATION + 2] = turn
    for k in range(5):
        gain[E_POSITION + 3 * k] = ahead / variance + turn * y
        gain[E_POSITION + 3 * k + 1] = aside / variance - turn * x
    for k in range(3):
        gain[E_CAMERA + k] = column[E_CAMERA + k] / variance
    correct_with(m, gain, column, variance, off)
    for a in range(ERRORS):
        delta[a] += gain[a] * off
    return True
