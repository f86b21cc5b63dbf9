"""How fast the body follows its path: as the gait clock runs, but brought to rest like a pendulum.

A clock that waits for a foot stops at once. A body that did so too would push its centre of
pressure beyond its feet; one that comes to rest over any fixed time does it where it is quick,
high or near an edge. Braked in proportion to its own speed, by the rate of a pendulum of its
height, it would keep the centre of pressure on its capture point, which is the least that stopping
needs (on a level, straight path; Pratt et al., "Capture Point: A Step toward Humanoid Push
Recovery", Humanoids 2006). Here it goes back from where it came to rest to where the clock stands,
too: the centre of pressure begins on the capture point, goes up to 8 % farther, and then comes
back. On the way the body is ahead of the clock by three quarters of the pendulum's time at most.
That may be more than `plan_body`'s guard: what the plan keeps beyond its switches is not relied on.
"""

from math import isnan, sqrt

from drake_quad.compiled import compiled
from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import FloatArray

LEAST_HEIGHT = 0.1  # [m] that a body over its feet is taken for: fallen, it has none
CATCH_UP = 2.0  # [1/s] of its lead by which the body is slower than a clock that runs


@compiled
def pendulum_rate(height: float) -> float:
    """Of a point that is balanced at a height [m], as a linear inverted pendulum [1/s]."""
    return sqrt(GRAVITY / max(height, LEAST_HEIGHT))


@compiled
def height_over(base: float, feet: FloatArray) -> float:
    """The base's height [m] over the mean of its feet (4, 3) in W [m].

    The base and not the centre of mass, and all feet: it changes little, and does not jump as a
    foot lifts off.
    """
    return base - 0.25 * (feet[0, 2] + feet[1, 2] + feet[2, 2] + feet[3, 2])


@compiled
def next_body_rate(
    body_rate: float, lead: float, rate: float, pendulum: float, period: float
) -> tuple[float, float, float]:
    """Goes on a tick. Rates are gait time by time, without a unit: 1 is as planned.

    Under a clock that stands the body goes back to where that is as fast as it can without coming
    past it (critically damped); with one that runs it waits to be caught up.

    Args:
        body_rate: By which the body goes along its path; not a number before the first tick.
        lead: How far it is ahead of the clock [s].
        rate: The clock's, 0 to 1.
        pendulum: See `pendulum_rate` [1/s].
        period: A tick [s].

    Returns:
        The body's rate and its lead [s] a tick later, and how fast the rate changes [1/s].
    """
    if isnan(body_rate):
        body_rate = rate
    # In between for a clock that creeps: it is no other than one that stands.
    back = rate * CATCH_UP + (1.0 - rate) * 0.25 * pendulum
    change = min(pendulum, 1.0 / period) * (rate - back * lead - body_rate)
    body_rate += change * period
    return body_rate, lead + (body_rate - rate) * period, change
