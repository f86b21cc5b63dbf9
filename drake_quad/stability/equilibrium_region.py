"""Regions of static equilibrium: with friction alone, and with torque limits too.

The static region is that of Bretl and Lall (2008): all places of the centre of mass over which
some forces on the feet, each within its friction pyramid, carry the weight. With the joints'
torque limits it is the feasible region of Orsolino et al. ("Feasible region: an actuation-aware
extension of the support region", IEEE Transactions on Robotics 36(4), 2020), which holds for the
posture that the limits were taken in. Under way, with the force and the moment that the motion
needs in place of the weight, it is the slice of the contact wrench cone at the height of the
centre of mass (Caron, Pham and Nakamura, "ZMP support areas for multi-contact mobility under
frictional constraints", IEEE Transactions on Robotics 33(1), 2017).

Forces are in units of the robot's weight; so are moments, which makes them lengths.

On level treads (normals vertical, heights any) each foot can carry its part of the weight straight
up, so that the hull is always in balance. Nothing beyond a side of it is, if the plane through that
side and each other foot is no steeper than 1 / μ. For take a side along t, with the outward normal
u and the slope ν along t, and add to u·c = Σ (u·x_i fz_i - z_i u·fxy_i) the multiples of the
equations Σ fxy = 0 and Σ (x × f)_z = 0 that make the horizontal forces of the side's own feet drop
out. What is left of a foot that is d_i inside of the side and h_i off its height is at most

    fz_i (-d_i + μ √(h_i² + (ν d_i)²)),

and the root over d_i is the gradient of the plane through the side and the foot. The sum is at most
0, so u·c is at most the side's: q.e.d. Stairs of 0.18 x 0.28 m are 0.64 steep: for feet that stand
alike on their treads friction counts from 1.56 on, for others somewhat sooner. Where feet stand on
tilted ground, on slopes or on nosings, there is no such law.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from math import cos, hypot, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import GRAVITY, BoolArray, FloatArray, read_only
from drake_quad.robot.kinematics import calc_holding, calc_jacobians
from drake_quad.robot.model import RobotModel
from drake_quad.stability.projection import NONE, PolytopeProjection, project_polygon
from drake_quad.stability.support_polygon import stability_margin, support_polygon

PARALLEL = 0.99  # cosine above which a direction is too near to the normal to lie in the plane


@dataclass(frozen=True, eq=False)
class Contacts:
    """Point contacts that can push but not pull, in W.

    Attributes:
        places: (n, 3) where the forces act [m].
        normals: (n, 3) unit normals of the ground, away from it.
        friction: (n,) Coulomb's coefficients.
    """

    places: FloatArray
    normals: FloatArray
    friction: FloatArray

    def __len__(self) -> int:
        return len(self.places)


@dataclass(frozen=True)
class Pyramid:
    """How the friction cone is made of planes.

    Attributes:
        sides: Number of planes, at least 3. The gap between the pyramid inside the cone and the
            cone is 1 - cos(π / sides) of the friction coefficient: 7.6 % with 8, 1.9 % with 16.
        heading: Direction in W of the first plane [rad].
        outside: Whether the pyramid goes round the cone instead of into it: what a region of it
            leaves out, no friction can give.
    """

    sides: int = 8
    heading: float = 0.0
    outside: bool = False


def make_contacts(
    places: ArrayLike, normals: ArrayLike | None = None, friction: ArrayLike = 0.8
) -> Contacts:
    """Contacts of (n, 3) places [m]; on level ground unless normals (n, 3) of any length are given.

    Args:
        places: (n, 3), or empty.
        normals: (n, 3).
        friction: One coefficient, or (n,).
    """
    p = np.array(places, dtype=np.float64).reshape(-1, 3)
    up = np.zeros_like(p)
    up[:, 2] = 1.0
    n = up if normals is None else np.array(normals, dtype=np.float64).reshape(-1, 3)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    mu = np.array(np.broadcast_to(np.asarray(friction, dtype=np.float64), len(p)))
    return Contacts(read_only(p), read_only(n / length), read_only(mu))


@lru_cache(maxsize=256)
def pyramid_rows(
    normal: tuple[float, float, float], friction: float, pyramid: Pyramid
) -> FloatArray:
    """Rows g (sides, 3) with g·f ≤ 0 for each force f within one contact's pyramid; read-only.

    Args:
        normal: Unit normal in W. Most are vertical, and need not be worked out again.
        friction: Coulomb's coefficient.
        pyramid: The pyramid; its edges lie on the cone, or its planes touch it if it is outside.
    """
    n = np.array(normal)
    along, left = tangents(n, pyramid.heading)
    slope = friction if pyramid.outside else friction * cos(pi / pyramid.sides)
    turn = 2.0 * pi / pyramid.sides * np.arange(pyramid.sides)
    return read_only(np.outer(np.cos(turn), along) + np.outer(np.sin(turn), left) - slope * n)


def tangents(normal: FloatArray, heading: float) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (3,) in the plane across a normal, the first one towards the heading."""
    n = normal.tolist()
    ahead = (cos(heading), sin(heading), 0.0)
    if abs(ahead[0] * n[0] + ahead[1] * n[1]) > PARALLEL:
        ahead = (0.0, 0.0, 1.0)
    share = sum(a * b for a, b in zip(ahead, n, strict=True))
    along = np.array([a - share * b for a, b in zip(ahead, n, strict=True)])
    along /= np.linalg.norm(along)
    return along, _cross(normal, along)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product; numpy's own takes ten times as long for three numbers."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


MOST_FORCE = 10.0  # of the weight, that a foot pushes with at most: no region is without end
LEAST_LIFT = 0.05  # of the weight; with less the robot is falling and has no region


@dataclass(frozen=True)
class WrenchDemand:
    """Force and moment that the feet have to give, in units of the weight, in W.

    Attributes:
        force: Sum of the forces; at rest (0, 0, 1), else (a + g) / |g| of the centre of mass.
        moment: Moment about the centre of mass [m]: the change of angular momentum there.
        height: Height of the centre of mass [m]; it matters where the force is not vertical.
    """

    force: tuple[float, float, float] = (0.0, 0.0, 1.0)
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height: float = 0.0


AT_REST = WrenchDemand()
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
        return stability_margin((x, y), self.corners)

    def reach(self, x: float, y: float) -> float:
        """How far it goes along the unit vector (x, y) from W's origin [m]; -inf of no region."""
        return float(np.max(self.corners @ [x, y], initial=-np.inf))


def find_region(
    contacts: Contacts,
    *,
    limits: ForceLimits | None = None,
    demand: WrenchDemand = AT_REST,
    pyramid: Pyramid | None = None,
) -> Region:
    """The region of balance over contacts.

    Args:
        contacts: The contacts that bear.
        limits: Limits of the legs' joints, in the contacts' order; None: any force will do.
        demand: Force and moment that the contacts have to give.
        pyramid: How friction is made of planes.
    """
    if not len(contacts) or demand.force[2] < LEAST_LIFT:
        return Region(read_only(np.zeros((0, 2))))
    corners = project_polygon(com_projection(contacts, limits, demand, pyramid))
    return Region(read_only(np.array(corners).reshape(-1, 2)))


def com_projection(
    contacts: Contacts,
    limits: ForceLimits | None = None,
    demand: WrenchDemand = AT_REST,
    pyramid: Pyramid | None = None,
) -> PolytopeProjection:
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
    return PolytopeProjection(A, lower, upper, C, d + middle[:2])


def force_rows(
    contacts: Contacts, limits: ForceLimits | None, pyramid: Pyramid, *, equations: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and bounds of what each contact can push with, with zero rows for equations after them.

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


def joint_limits(
    robot: RobotModel,
    R_WB: FloatArray,
    q: FloatArray,
    standing: ArrayLike,
    *,
    mass: float | None = None,
    effort: FloatArray | None = None,
) -> ForceLimits:
    """Limits that the joints' torques set to the forces on the standing feet.

    Static: torque = what holds the leg's links - Jᵀ f, with f the force on the foot.

    Args:
        robot: The robot.
        R_WB: (3, 3) orientation of B.
        q: (4, 3) joint angles [rad].
        standing: (4,) which feet stand.
        mass: Mass of the whole robot with its payload, if it is not the model's [kg].
        effort: Torque limits (12,), if they are not the model's [Nm].
    """
    who = np.asarray(standing, dtype=np.bool_)
    legs = leg_limits(robot, R_WB, q, mass=mass, effort=effort)
    return ForceLimits(legs.rows[who], legs.lower[who], legs.upper[who])


def leg_limits(
    robot: RobotModel,
    R_WB: FloatArray,
    q: FloatArray,
    *,
    mass: float | None = None,
    effort: FloatArray | None = None,
) -> ForceLimits:
    """`joint_limits` of all four legs, for any number of poses: R_WB (..., 3, 3), q (..., 4, 3).

    Its arrays are (..., 4, 3, 3) and (..., 4, 3).
    """
    weight = GRAVITY * (robot.mass if mass is None else mass)
    most = (robot.effort if effort is None else effort).reshape(4, 3)
    hold = calc_holding(robot, q, R_WB[..., 2, :])
    rows = np.swapaxes(R_WB[..., None, :, :] @ calc_jacobians(robot.geometry, q), -1, -2)
    return ForceLimits(rows, (hold - most) / weight, (hold + most) / weight)


LEVEL = 1e-9  # 1 - the normal's z, beyond which ground is not level
NEARLY = 1e-4  # the same of normals as measured, which count as level up to there: 0.8°
FLAT = 1e-9  # [m²] twice the area under three feet that make no plane


def is_hull(contacts: Contacts) -> bool:
    """Whether the static region is for certain the hull of three or four feet; if in doubt, no."""
    if len(contacts) < 3 or np.any(contacts.normals[:, 2] < 1.0 - LEVEL):
        return False
    steepest = 1.0 / max(contacts.friction.max(), 1e-9)
    for (ax, ay, az), (bx, by, bz), (cx, cy, cz) in combinations(contacts.places.tolist(), 3):
        bx, by, bz, cx, cy, cz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        area = bx * cy - by * cx
        rise = hypot(by * cz - bz * cy, bz * cx - bx * cz)
        if abs(area) < FLAT or rise > steepest * abs(area):
            return False
    return True


def are_hulls(
    places: FloatArray, normals: FloatArray, standing: BoolArray, friction: float
) -> BoolArray:
    """`is_hull` of many stances: places and normals (N, 4, 3), who stands (N, 4); (N,)."""
    level = np.all((normals[..., 2] >= 1.0 - LEVEL) | ~standing, axis=1)
    found = level & (standing.sum(axis=1) >= 3)
    for three in combinations(range(4), 3):
        a, b, c = (places[:, k] for k in three)
        normal = np.cross(b - a, c - a)
        area, rise = np.abs(normal[:, 2]), np.hypot(normal[:, 0], normal[:, 1])
        good = (area >= FLAT) & (max(friction, 1e-9) * rise <= area)
        found &= good | ~standing[:, three].all(axis=1)
    return found


def static_region(contacts: Contacts) -> Region:
    """The region of balance at rest, by the hull where that is it for certain."""
    if is_hull(contacts):
        return Region(support_polygon(contacts.places[:, :2]))
    return find_region(contacts)
