"""How fast the body follows its path: as the gait clock runs, but brought to rest like a pendulum.

A clock that waits for a foot stops at once. A body that did so too would push its centre of
pressure beyond its feet; one that comes to rest over any fixed time does it where it is quick,
high or near an edge. Braked in proportion to its own speed, by the rate of a pendulum of its
height, it keeps the centre of pressure where it is brought to rest: on its capture point, and no
way of stopping needs less room (Pratt et al., "Capture Point: A Step toward Humanoid Push
Recovery", Humanoids 2006). So for a while it is ahead of the clock on its path. The plan's margins
hold for about that long on either side of a switch (`plan_body`'s guard).
"""

from math import isnan, sqrt

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

GRAVITY = 9.81
LOWEST = 0.05  # [m] what a body's height over its feet is taken for at least: fallen, it has none
CATCH_UP = 2.0  # [1/s] in which the clock catches up with the body, while it runs


@compiled
def pendulum_rate(height: float) -> float:
    """Of a point that is balanced at a height [m], as a linear inverted pendulum [1/s]."""
    return sqrt(GRAVITY / max(height, LOWEST))


@compiled
def next_body_rate(
    body_rate: float, lead: float, rate: float, pendulum: float, period: float
) -> tuple[float, float, float]:
    """Rate and lead a tick later, and how fast the rate changes in it.

    Under a clock that stands the body goes back to where the clock is as soon as it can without
    coming there twice (critically damped).

    Args:
        body_rate: By which the body's path goes on; not a number before the first tick.
        lead: How far the body is ahead of the clock [s].
        rate: The clock's.
        pendulum: See `pendulum_rate` [1/s].
        period: A tick [s].
    """
    if isnan(body_rate):
        body_rate = rate
    back = CATCH_UP if rate > 0.0 else 0.25 * pendulum
    change = min(pendulum, 1.0 / period) * (rate - back * lead - body_rate)
    body_rate += change * period
    return body_rate, lead + (body_rate - rate) * period, change


@compiled
def height_over(base: float, feet: FloatArray) -> float:
    """The base's height [m] over the mean of its feet (4, 3)."""
    return base - 0.25 * (feet[0, 2] + feet[1, 2] + feet[2, 2] + feet[3, 2])
