"""How hard a stance can be pushed, by direction, before it takes a step.

A push of speed Δv throws the capture point ξ by Δv / ω. The robot comes to rest over ξ, without a
step, if the pressure can stay at ξ until it is there (Koolen et al., "Capturability-based analysis
and control of legged locomotion, part 1", International Journal of Robotics Research 31(9), 2012).
On the way there the wrench that this needs goes in a straight line from that of the first moment
to that of rest over ξ, and what the feet can give is convex. So the two ends decide: ξ has to be

- in the static region, to rest there;
- in the area where the pressure can be at first, which friction makes smaller.

On its way it is not to stretch a leg too far. With the pressure held at a place P beyond ξ it turns
back before it is there: from a pendulum's energy, v² - ω² (c - P)² constant, at P - √(P² - ξ²), all
counted from where it was pushed. So legs that let it go R < P allow ξ = √(2 P R - R²).

What is thrown comes back. A robot of stiff joints rocks on one leading foot and back over its
place, and comes down where the other feet happen to find ground: it needs room of some part of the
throw around its place, `swing_back`. How much is the controller's, not the pendulum's; SWING_BACK
is what pushes in the simulation ask for (`benchmarks/push_budget.py`).

The law is exact for the pendulum that holds its pressure there, with the forces' own limits,
friction (and torque) on uneven ground. What a robot does beyond a pendulum, by turning its trunk
or its legs, could add to it; what its controller does not do takes away from it.
"""

from math import pi

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.stability.pendulum import Pendulum
from drake_quad.stability.region import Region

SWING_BACK = 0.5  # of a throw, that the robot may miss its place by when it comes back


def directions(count: int) -> FloatArray:
    """Unit vectors (count, 2) all around, the first along x."""
    turn = 2.0 * pi / count * np.arange(count)
    return np.stack([np.cos(turn), np.sin(turn)], axis=-1)


def way_out(region: Region, x: float, y: float, ways: FloatArray) -> FloatArray:
    """How far from (x, y) to the region's border along unit vectors (m, 2) [m]; 0 from outside.

    Args:
        region: Convex.
        x: In W [m].
        y: The same.
        ways: (m, 2).
    """
    corners = region.corners
    if len(corners) < 3:
        return np.zeros(len(ways))
    after = np.concatenate([corners[1:], corners[:1]])
    along = after - corners
    normal = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    room = np.sum(normal * (corners - [x, y]), axis=-1)
    if np.any(room <= 0.0):
        return np.zeros(len(ways))
    speed = ways @ normal.T
    return np.asarray(np.where(speed > 0.0, room / np.where(speed > 0.0, speed, 1.0), np.inf)).min(
        axis=-1
    )


def push_budget(
    region: Region,
    area: Region,
    body: Pendulum,
    ways: FloatArray,
    legs: FloatArray | None = None,
    *,
    swing_back: float = 0.0,
) -> FloatArray:
    """The largest pushes by direction that need no step, as speeds of the whole robot (m,) [m/s].

    Args:
        region: The static region over the feet that bear.
        area: From `find_pressure_area` of the same feet and this body.
        body: The robot.
        ways: (m, 2) unit vectors in W, which way it is pushed.
        legs: (m,) how far the legs let the centre of mass go [m], see `leg_way`; None: anywhere.
        swing_back: Of a throw, by which the robot may miss its place as it comes back, any way.
    """
    x, y = body.capture
    far = np.minimum(way_out(region, x, y, ways), way_out(area, x, y, ways))
    thrown = ways @ np.array([x - body.x, y - body.y])  # already, by its own velocity
    if legs is not None:
        far = np.minimum(far, np.maximum(held_back(far + thrown, legs) - thrown, 0.0))
    if swing_back > 0.0:
        most = max(region.margin(body.x, body.y), 0.0) / swing_back
        far = np.minimum(far, np.maximum(most - thrown, 0.0))
    return np.asarray(body.rate * far)


def held_back(pressure: FloatArray, legs: FloatArray) -> FloatArray:
    """How far ξ may be thrown if the pressure can be so far away, and the robot go so far (m,) [m].

    Args:
        pressure: (m,) from the robot [m].
        legs: (m,) from there [m].
    """
    short = np.sqrt(np.maximum(2.0 * pressure * legs - legs**2, 0.0))
    return np.where(legs < pressure, short, pressure)


def capture_margin(region: Region, area: Region, body: Pendulum) -> float:
    """Signed distance of the capture point from the border of both [m], inside positive.

    Outside it is the greater of the two distances: from both it may be farther. -inf of no region.
    """
    x, y = body.capture
    return min(region.margin(x, y), area.margin(x, y))
