"""The room between feet that stand, rolled as they are, and the risers ahead of them."""

from math import inf

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.plan_walk import EDGE_CLEARANCE
from drake_quad.terrain import Lane

KEPT = 0.004  # [m] that feet keep from risers as they roll; they are set down farther off
JUST = 1e-6  # [s] before a lift-off
ENOUGH = 0.001  # [m] with which no plan is made anew
ROLLS = 0.6  # of its radius, that a foot mostly rolls forward in a stance


def likely_setback(foot_radius: float) -> float:
    """What footprints keep from a riser ahead, beyond EDGE_CLEARANCE, at a first guess [m]."""
    return max(ROLLS * foot_radius + KEPT - EDGE_CLEARANCE, 0.0)


def riser_room(lane: Lane, contacts: ContactPlan, foot_radius: float) -> float:
    """The least room that feet have that a plan sets down; negative if one is inside a riser.

    Of the riser ahead alone: that is where feet roll to. One whose centre is beyond it, by more
    than its radius, would not be seen; so far none rolls.

    A foot is set down with room before the riser ahead, and rolls towards it as the body goes on.
    One that touches it scrapes up along it in its swing.

    Args:
        lane: That the robot walks along.
        contacts: The plan, with feet that roll.
        foot_radius: [m].

    Returns:
        The room [m]; infinite where there are no risers.
    """
    before = [step.lift_off - JUST for step in contacts.steps]  # when they have rolled farthest
    times = np.union1d(sample_times(contacts), before)
    feet, standing = contacts.feet_at(times)
    begun = np.full(4, inf)
    for step in reversed(contacts.steps):
        begun[step.leg.row] = step.touchdown
    s, _ = lane.coordinates(feet[standing & (times[:, None] >= begun)])
    return float(room_at(lane, s, foot_radius).min(initial=inf))


def room_at(lane: Lane, s: FloatArray, foot_radius: float) -> FloatArray:
    """From feet at `s` (n,) along a lane to the riser ahead of each that leads up (n,) [m]."""
    at, rise = lane.risers()
    room = np.full(len(s), inf)
    ahead = at[rise > 0.0]
    k = np.searchsorted(ahead, s)
    has = k < len(ahead)
    room[has] = ahead[k[has]] - s[has] - foot_radius
    return room
