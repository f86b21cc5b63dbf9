"""Where the centre of mass may be above given feet: the region of balance, exactly.

The static region is that of Bretl and Lall (2008): all places of the centre of mass over which
some forces on the feet, each within its friction pyramid, carry the weight. With the joints'
torque limits it is the feasible region of Orsolino et al. ("Feasible region: an actuation-aware
extension of the support region", IEEE Transactions on Robotics 36(4), 2020), which holds for the
posture that the limits were taken in. Under way, with the force and the moment that the motion
needs in place of the weight, it is the slice of the contact wrench cone at the height of the
centre of mass (Caron, Pham and Nakamura, "ZMP support areas for multi-contact mobility under
frictional constraints", IEEE Transactions on Robotics 33(1), 2017).

Forces are in units of the robot's weight; so are moments, which makes them lengths.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.gait.support import margin_of_floats
from drake_quad.stability.contacts import Contacts, Pyramid, pyramid_rows
from drake_quad.stability.project import NONE, Shadow, outline

MOST_FORCE = 10.0  # of the weight, that a foot pushes with at most: no region is without end
LEAST_LIFT = 0.05  # of the weight; with less the robot is falling and has no region


@dataclass(frozen=True)
class Demand:
    """What the feet's forces are to come to, in units of the weight, in W.

    Attributes:
        force: Their sum; at rest (0, 0, 1), else (a + g) / |g| of the centre of mass.
        moment: About the centre of mass [m]: the change of angular momentum there.
        height: Of the centre of mass [m]; it counts where the force is not vertical.
    """

    force: tuple[float, float, float] = (0.0, 0.0, 1.0)
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height: float = 0.0


AT_REST = Demand()
X, Y, Z = (slice(k, None, 3) for k in range(3))  # of the forces (3 n,)


@dataclass(frozen=True, eq=False)
class ForceLimits:
    """What the legs' joints can hold: lower ≤ rows f ≤ upper, in units of the weight.

    Attributes:
        rows: (n, 3, 3), a row a joint, of each contact's force in W [m].
        lower: (n, 3) [m].
        upper: (n, 3) [m].
    """

    rows: FloatArray
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Region:
    """A convex polygon of places of the centre of mass.

    Attributes:
        corners: (k, 2) counterclockwise in W [m], read-only; two for a line, one for a point,
            none where nothing can be in balance.
    """

    corners: FloatArray

    def margin(self, x: float, y: float) -> float:
        """Signed distance of (x, y) from the border [m], inside positive; -inf of no region."""
        return margin_of_floats(x, y, self.corners.tolist())

    def reach(self, x: float, y: float) -> float:
        """How far it goes along the unit vector (x, y) from W's origin [m]; -inf of no region."""
        return float(np.max(self.corners @ [x, y], initial=-np.inf))


def find_region(
    contacts: Contacts,
    *,
    limits: ForceLimits | None = None,
    demand: Demand = AT_REST,
    pyramid: Pyramid | None = None,
) -> Region:
    """The region of balance over contacts.

    Args:
        contacts: That bear.
        limits: Of the legs' joints, in the contacts' order; none: any force will do.
        demand: What the forces are to come to.
        pyramid: How friction is made of planes.
    """
    if not len(contacts) or demand.force[2] < LEAST_LIFT:
        return Region(read_only(np.zeros((0, 2))))
    corners = outline(make_shadow(contacts, limits, demand, pyramid))
    return Region(read_only(np.array(corners).reshape(-1, 2)))


def make_shadow(
    contacts: Contacts,
    limits: ForceLimits | None = None,
    demand: Demand = AT_REST,
    pyramid: Pyramid | None = None,
) -> Shadow:
    """The forces (3 n,) that meet a demand, and where the centre of mass is by them.

    With F, L the demand and M the moment of the forces about a point at height z: M = c × F + L.
    Its x and y say where c is; its z is one more equation.
    """
    # About the middle of the feet: what is near to the origin loses fewer digits.
    middle = contacts.places.mean(axis=0)
    x, y, z = (contacts.places - middle).T
    Fx, Fy, Fz = demand.force
    rise = demand.height - middle[2]
    C, d = np.zeros((2, 3 * len(contacts))), np.zeros(2)
    C[0, X], C[0, Z] = -z / Fz, x / Fz
    C[1, Y], C[1, Z] = -z / Fz, y / Fz
    d[0] = (rise * Fx + demand.moment[1]) / Fz
    d[1] = (rise * Fy - demand.moment[0]) / Fz
    A, lower, upper = force_rows(contacts, limits, pyramid or Pyramid(), equations=4)
    A[-4, X] = A[-3, Y] = A[-2, Z] = 1.0
    A[-1, X], A[-1, Y] = -y, x
    A[-1] += Fx * C[1] - Fy * C[0]
    lower[-4:] = upper[-4:] = [*demand.force, demand.moment[2] + Fy * d[0] - Fx * d[1]]
    return Shadow(A, lower, upper, C, d + middle[:2])


def force_rows(
    contacts: Contacts, limits: ForceLimits | None, pyramid: Pyramid, *, equations: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and bounds of what each contact can push with, with room for equations after them.

    Returns:
        A (m, 3 n), lower (m,), upper (m,); the last `equations` rows are zero.
    """
    n, sides = len(contacts), pyramid.sides
    own = 1 + sides + (0 if limits is None else 3)
    m = n * own + equations
    A, lower, upper = np.zeros((m, 3 * n)), np.full(m, -NONE), np.zeros(m)
    for k in range(n):
        row, of_foot = k * own, slice(3 * k, 3 * k + 3)
        x, y, z = contacts.normals[k].tolist()
        A[row, of_foot], upper[row] = (x, y, z), MOST_FORCE
        A[row + 1 : row + 1 + sides, of_foot] = pyramid_rows(
            (x, y, z), float(contacts.friction[k]), pyramid
        )
        if limits is not None:
            last = slice(row + 1 + sides, row + own)
            A[last, of_foot] = limits.rows[k]
            lower[last], upper[last] = limits.lower[k], limits.upper[k]
    return A, lower, upper
