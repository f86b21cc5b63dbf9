"""How fast the gait clock may run for a margin to stay above what is demanded."""

import numpy as np

from drake_quad.control.ports import Balance
from drake_quad.control.push_reflex import balance_margin
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.motion_plan import MotionPlan

LOOK_AHEAD = 0.4  # [s]
BRAKING = 2.5  # times that, in which the margin may run out at most: the body comes to rest late
STOPPED = 0.02  # of the clock's full rate, below which it stands


def allowed_rate(now: float, ahead: float, demanded: float) -> float:
    """The rate in [0, 1] at which a margin does not fall below what is demanded.

    It runs freely where the margin grows, or falls so slowly that it would take BRAKING times the
    time looked ahead to get to what is demanded; else as much slower as leaves it that time. So as
    the margin nears what is demanded the clock comes to a stand.

    Args:
        now: The margin [m].
        ahead: That at the end of the time looked ahead [m].
        demanded: [m].
    """
    if ahead >= now:
        return 1.0
    return min(max((now - demanded) / (BRAKING * (now - ahead)), 0.0), 1.0)


def guarded_rate(
    plan: MotionPlan, t: float, balance: FloatArray, standing: BoolArray, demanded: float
) -> float:
    """The rate that the clock may have now; 0 if it is next to nothing.

    The margin is that of the capture point over the feet that stand, and a while ahead that of
    the same moved as the plan moves the body.

    Args:
        plan: That is followed.
        t: Gait time [s].
        balance: See Balance.
        standing: (4,) who is to stand.
        demanded: [m].
    """
    later = min(t + LOOK_AHEAD, plan.duration)
    moved = balance.copy()
    moved[Balance.COM : Balance.COM + 2] += (plan.body.sample(later) - plan.body.sample(t))[0, :2]
    who = np.asarray(standing, dtype=np.bool_)
    # A leg that lifts off soon gives its load away before: not if the others are not enough.
    then = np.asarray(plan.contacts.phase(later).standing, dtype=np.bool_)
    fewer = not np.array_equal(then, who) and bool(np.all(who | ~then))
    if fewer and balance_margin(moved, then) < demanded:
        return 0.0
    rate = allowed_rate(balance_margin(balance, who), balance_margin(moved, who), demanded)
    return rate if rate > STOPPED else 0.0
