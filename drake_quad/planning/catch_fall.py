"""How a pushed robot falls: the linear inverted pendulum over the feet that bear.

The pendulum (Kajita et al. 2001) falls away from its pivot z; its capture point ξ = c + ċ/ω (Pratt
et al. 2006) leaves it as ξ(T) = z + (ξ - z) e^(ωT).
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.gait.support import stability_margin, support_polygon
from drake_quad.gait.transition_lift import nearest_on_segment


@dataclass(frozen=True, eq=False)
class FallingBody:
    """The robot at the moment that it is pushed. All in W.

    Attributes:
        feet: Foot sphere centres, (4, 3) [m].
        standing: Who bears, (4,).
        p_WB: The body's centre, (3,) [m].
        yaw: The body's heading [rad]; it is taken to be level.
        com: The centre of mass, (2,) [m].
        capture: The capture point, (2,) [m].
        omega: The pendulum's rate √(g/h) [1/s].
    """

    feet: FloatArray
    standing: BoolArray
    p_WB: FloatArray
    yaw: float
    com: FloatArray
    capture: FloatArray
    omega: float


def nearest_support(point: FloatArray, feet: FloatArray) -> FloatArray:
    """The point of the feet's support polygon that is nearest to `point` (2,) [m].

    Without any foot there is nothing to press on: the point itself.
    """
    if not len(feet) or stability_margin(point, feet) >= 0.0:
        return np.array(point)
    corners = [(float(x), float(y)) for x, y in support_polygon(feet)]
    here = (float(point[0]), float(point[1]))
    near = [nearest_on_segment(here, corners[k - 1], b) for k, b in enumerate(corners)]
    return np.array(min(near, key=lambda q: np.hypot(q[0] - here[0], q[1] - here[1])))


def fall(capture: FloatArray, pivot: FloatArray, omega: float, times: FloatArray) -> FloatArray:
    """Where the capture point will be at `times` (N,), (N, 2) [m]."""
    return np.asarray(pivot + np.exp(omega * times)[:, None] * (capture - pivot))


def com_shift(state: FallingBody, pivot: FloatArray, times: FloatArray) -> FloatArray:
    """How far the centre of mass, and the body with it, will have moved at `times`, (N, 2) [m]."""
    growth = state.omega * times[:, None]
    lean, speed = state.com - pivot, state.capture - state.com
    return np.asarray(lean * (np.cosh(growth) - 1.0) + speed * np.sinh(growth))
