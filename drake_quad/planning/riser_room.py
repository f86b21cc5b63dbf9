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


def riser_room(lane: Lane, contacts: ContactPlan, foot_radius: float) -> tuple[float, float]:
    """The least room that feet have that a plan sets down, and the setback that they need.

    Of the riser ahead alone: that is where feet roll to. One whose centre is beyond it, by more
    than its radius, would not be seen; so far none rolls.

    A foot is set down with room before the riser ahead, and rolls towards it as the body goes on.
    One that touches it scrapes up along it in its swing.

    Args:
        lane: That the robot walks along.
        contacts: The plan, with feet that roll.
        foot_radius: [m].

    Returns:
        The room [m], negative where a foot would be inside a riser, infinite where there are none;
        and the setback beyond EDGE_CLEARANCE with which all that have less than ENOUGH, rolling as
        they do here, would have KEPT [m].
    """
    steps = contacts.steps
    before = [step.lift_off - JUST for step in steps]  # when they have rolled farthest
    times = np.union1d(sample_times(contacts), before)
    feet, _ = contacts.feet_at(times)
    s, _ = lane.coordinates(feet)
    least, rolled = inf, 0.0
    for k, step in enumerate(steps):
        end = next((t.lift_off for t in steps[k + 1 :] if t.leg is step.leg), inf)
        mine = s[(times >= step.touchdown) & (times < end), step.leg.row]
        room = room_at(lane, mine, foot_radius)
        if len(room) and room.min() < ENOUGH:
            rolled = max(rolled, float(room[0] - room.min()))
        least = min(least, float(room.min(initial=inf)))
    return least, max(rolled + KEPT - EDGE_CLEARANCE, 0.0)


def room_at(lane: Lane, s: FloatArray, foot_radius: float) -> FloatArray:
    """From feet at `s` (n,) along a lane to the riser ahead of each that leads up (n,) [m]."""
    at, rise = lane.risers()
    room = np.full(len(s), inf)
    ahead = at[rise > 0.0]
    k = np.searchsorted(ahead, s)
    has = k < len(ahead)
    room[has] = ahead[k[has]] - s[has] - foot_radius
    return room
