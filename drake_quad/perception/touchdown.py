"""A belief made better by a foot that has landed on a tread: the best height sensor there is.

One Kalman update (Kalman, "A new approach to linear filtering and prediction problems", 1960) with
one measurement, the height of one tread. Through the covariance it moves the other treads as well,
and rise and places as far as they go with it.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_quad.perception.stair_belief import StairBelief


@dataclass(frozen=True, kw_only=True)
class FootContact:
    """A foot on the ground.

    Attributes:
        along: Its place along the climb from the belief's origin [m].
        height: Height of the ground under it in W [m].
        place_sigma: Deviation of the place [m].
        height_sigma: Deviation of the height [m], from the legs' kinematics and the base's.
    """

    along: float
    height: float
    place_sigma: float
    height_sigma: float


def tread_under(belief: StairBelief, touchdown: FootContact) -> int | None:
    """Which of the belief's heights is that of the tread under a foot.

    Args:
        belief: The stairs.
        touchdown: The foot.

    Returns:
        0 for the floor before the first nosing told, i for the tread behind nosing i - 1; None
        where the foot may be on either side of a nosing, or beyond the tread seen last.
    """
    at = int(np.searchsorted(belief.places, touchdown.along))
    for i in (at - 1, at):
        if 0 <= i < len(belief.places):
            doubt = 3.0 * float(np.hypot(belief.place_sigmas[i], touchdown.place_sigma))
            if abs(touchdown.along - belief.places[i]) < doubt:
                return None
    if at == len(belief.places) and touchdown.along > belief.places[-1] + belief.run:
        return None
    return at


def refine_by_touchdown(
    belief: StairBelief, touchdown: FootContact
) -> tuple[StairBelief, float] | None:
    """The belief after a foot has landed.

    Args:
        belief: The stairs as they were believed to be.
        touchdown: The foot.

    Returns:
        The better belief, and by how many deviations the foot's height is off what was expected: a
        figure far beyond 3 contradicts what was seen. None where no tread is known to be under it.
    """
    tread = tread_under(belief, touchdown)
    if tread is None:
        return None
    n = len(belief.places)
    k = n + tread
    variance = float(belief.covariance[k, k]) + touchdown.height_sigma**2
    innovation = touchdown.height - float(belief.heights[tread])
    gain = belief.covariance[:, k] / variance
    state = np.concatenate(
        [belief.places, belief.heights, [belief.yaw, belief.overhang, belief.rise, belief.run]]
    )
    state = state + gain * innovation
    # Joseph's form: it stays symmetric and positive, whatever is rounded.
    L = np.eye(len(state))
    L[:, k] -= gain
    covariance = L @ belief.covariance @ L.T + np.outer(gain, gain) * touchdown.height_sigma**2
    yaw, overhang, rise, run = (float(x) for x in state[2 * n + 1 :])
    better = replace(
        belief, places=state[:n], heights=state[n : 2 * n + 1], yaw=yaw, overhang=overhang,
        rise=rise, run=run, covariance=covariance,
    )  # fmt: skip
    return better, innovation / float(np.sqrt(variance))
