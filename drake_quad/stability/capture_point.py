"""The linear inverted pendulum: capture point, ZMP support area, push budget.

A point mass at constant height h over a pressure centre p accelerates by ω² (c - p), ω² = g / h.
Where its velocity carries it, the capture point ξ = c + v / ω, is where the pressure must come to
for it to come to rest (Pratt et al., "Capture point: a step toward humanoid push recovery",
Humanoids 2006).

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
place, and comes down where the other feet happen to find ground: it needs a margin of some part of
the throw around its place, `swing_back`. How much depends on the controller, not on the pendulum;
SWING_BACK is what pushes in the simulation need (`benchmarks/push_budget.py`).

The law is exact for the pendulum that holds its pressure there, with the forces' own limits,
friction (and torque) on uneven ground. What a robot does beyond a pendulum, by turning its trunk
or its legs, could add to it; what its controller does not do takes away from it.

The pendulum (Kajita et al. 2001) falls away from its pivot z; its capture point ξ = c + ċ/ω (Pratt
et al. 2006) leaves it as ξ(T) = z + (ξ - z) e^(ωT).
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray, read_only
from drake_quad.stability.equilibrium_region import (
    Contacts,
    ForceLimits,
    Pyramid,
    Region,
    X,
    Y,
    Z,
    force_rows,
)
from drake_quad.stability.projection import PolytopeProjection, project_polygon
from drake_quad.stability.support_polygon import (
    nearest_on_segment,
    stability_margin,
    support_polygon,
)

LEAST_HEIGHT = 0.1  # [m] of the centre of mass over the ground


@dataclass(frozen=True)
class Pendulum:
    """The robot as a point mass in motion.

    Attributes:
        x: x of its centre of mass in W [m].
        y: y of its centre of mass in W [m].
        z: z of its centre of mass in W [m].
        vx: x of its velocity in W [m/s].
        vy: y of its velocity in W [m/s].
        ground: Height in W that its pressure centre is counted at [m].
    """

    x: float
    y: float
    z: float
    vx: float = 0.0
    vy: float = 0.0
    ground: float = 0.0

    @property
    def height(self) -> float:
        """Height over the ground [m]."""
        return max(self.z - self.ground, LEAST_HEIGHT)

    @property
    def rate(self) -> float:
        """The pendulum's rate ω [1/s]."""
        return sqrt(GRAVITY / self.height)

    @property
    def capture(self) -> tuple[float, float]:
        """The capture point ξ in W [m]."""
        return self.x + self.vx / self.rate, self.y + self.vy / self.rate


def find_pressure_area(
    contacts: Contacts,
    body: Pendulum,
    *,
    limits: ForceLimits | None = None,
    pyramid: Pyramid | None = None,
) -> Region:
    """Where the pressure centre of a pendulum can be by what the feet can give, at this moment.

    The support area of the zero-moment point (Caron, Pham and Nakamura 2017): forces on the feet
    without a moment about the centre of mass, whose sum carries the weight and points from the
    pressure centre to the centre of mass. On level ground with much friction it is the hull of the
    feet; elsewhere it changes with the place of the centre of mass.

    Args:
        contacts: The contacts that bear.
        body: The robot.
        limits: Limits of the legs' joints.
        pyramid: How friction is made of planes.
    """
    if not len(contacts):
        return Region(read_only(np.zeros((0, 2))))
    x, y, z = (contacts.places - [body.x, body.y, body.z]).T
    A, lower, upper = force_rows(contacts, limits, pyramid or Pyramid(), equations=4)
    A[-4, Z] = 1.0
    A[-3, Y], A[-3, Z] = -z, y
    A[-2, X], A[-2, Z] = z, -x
    A[-1, X], A[-1, Y] = -y, x
    lower[-4:] = upper[-4:] = [1.0, 0.0, 0.0, 0.0]
    C = np.zeros((2, 3 * len(contacts)))
    C[0, X] = C[1, Y] = -body.height
    corners = project_polygon(PolytopeProjection(A, lower, upper, C, np.array([body.x, body.y])))
    return Region(read_only(np.array(corners).reshape(-1, 2)))


SWING_BACK = 0.5  # of a throw, that the robot may miss its place by when it comes back


def directions(count: int) -> FloatArray:
    """Unit vectors (count, 2) all around, the first along x."""
    turn = 2.0 * pi / count * np.arange(count)
    return np.stack([np.cos(turn), np.sin(turn)], axis=-1)


def way_out(region: Region, x: float, y: float, ways: FloatArray) -> FloatArray:
    """How far from (x, y) to the region's border along unit vectors (m, 2) [m]; 0 from outside.

    Args:
        region: Convex.
        x: x of the point in W [m].
        y: y of the point in W [m].
        ways: Unit vectors (m, 2).
    """
    corners = region.corners
    if len(corners) < 3:
        return np.zeros(len(ways))
    after = np.concatenate([corners[1:], corners[:1]])
    along = after - corners
    normal = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    inside = np.sum(normal * (corners - [x, y]), axis=-1)
    if np.any(inside <= 0.0):
        return np.zeros(len(ways))
    speed = ways @ normal.T
    return np.asarray(
        np.where(speed > 0.0, inside / np.where(speed > 0.0, speed, 1.0), np.inf)
    ).min(axis=-1)


def pressure_reach(region: Region, area: Region, body: Pendulum, ways: FloatArray) -> FloatArray:
    """How far the capture point can move until no foot holds it any more, by direction (m,) [m].

    Args:
        region: The static region over the feet that bear.
        area: Area from `find_pressure_area` of the same feet and this body.
        body: The robot.
        ways: (m, 2) unit vectors in W.
    """
    x, y = body.capture
    return np.minimum(way_out(region, x, y, ways), way_out(area, x, y, ways))


def push_budget(
    region: Region,
    far: FloatArray,
    body: Pendulum,
    ways: FloatArray,
    legs: FloatArray | None = None,
    *,
    swing_back: float = 0.0,
) -> FloatArray:
    """The largest pushes by direction that need no step, as speeds of the whole robot (m,) [m/s].

    Args:
        region: The static region over the feet that bear.
        far: Distances (m,) from `pressure_reach` of the same feet, body and ways [m].
        body: The robot.
        ways: (m, 2) unit vectors in W, which way it is pushed.
        legs: (m,) how far the legs let the centre of mass go [m], see `leg_stroke_left`; None:
            anywhere.
        swing_back: Share of a throw by which the robot may miss its place as it comes back.
    """
    x, y = body.capture
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
        pressure: (m,) distance of the pressure centre from the robot [m].
        legs: (m,) distance that the legs allow from there [m].
    """
    short = np.sqrt(np.maximum(2.0 * pressure * legs - legs**2, 0.0))
    return np.where(legs < pressure, short, pressure)


def capture_margin(region: Region, area: Region, body: Pendulum) -> float:
    """Signed distance of the capture point from the border of both [m], inside positive.

    Outside it is the greater of the two distances: from both it may be farther. -inf of no region.
    """
    x, y = body.capture
    return min(region.margin(x, y), area.margin(x, y))


@dataclass(frozen=True, eq=False)
class FallingPendulum:
    """The robot at the moment that it is pushed. All in W.

    Attributes:
        feet: Foot sphere centres, (4, 3) [m].
        standing: Which feet bear, (4,).
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


def ground_reach(state: FallingPendulum, pivot: FloatArray, times: FloatArray) -> FloatArray:
    """How far the centre of mass, and the body with it, will have moved at `times`, (N, 2) [m]."""
    growth = state.omega * times[:, None]
    lean, speed = state.com - pivot, state.capture - state.com
    return np.asarray(lean * (np.cosh(growth) - 1.0) + speed * np.sinh(growth))
