"""The robot as a linear inverted pendulum: its capture point, and where its pressure can be.

A point mass at constant height h over a pressure centre p accelerates by ω² (c - p), ω² = g / h.
Where its velocity carries it, the capture point ξ = c + v / ω, is where the pressure must come to
for it to come to rest (Pratt et al., "Capture point: a step toward humanoid push recovery",
Humanoids 2006).
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from drake_quad.gait.gravity import GRAVITY
from drake_quad.gait.legs import read_only
from drake_quad.stability.contacts import Contacts, Pyramid
from drake_quad.stability.project import Shadow, outline
from drake_quad.stability.region import ForceLimits, Region, X, Y, Z, force_rows

LEAST_HEIGHT = 0.1  # [m] of the centre of mass over the ground


@dataclass(frozen=True)
class Pendulum:
    """The robot as a point mass in motion.

    Attributes:
        x: Of its centre of mass in W [m].
        y: The same.
        z: The same.
        vx: Of its velocity in W [m/s].
        vy: The same.
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
        """Over the ground [m]."""
        return max(self.z - self.ground, LEAST_HEIGHT)

    @property
    def rate(self) -> float:
        """ω [1/s]."""
        return sqrt(GRAVITY / self.height)

    @property
    def capture(self) -> tuple[float, float]:
        """ξ in W [m]."""
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
        contacts: That bear.
        body: The robot.
        limits: Of the legs' joints.
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
    corners = outline(Shadow(A, lower, upper, C, np.array([body.x, body.y])))
    return Region(read_only(np.array(corners).reshape(-1, 2)))
