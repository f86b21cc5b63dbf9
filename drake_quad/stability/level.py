"""Where the region of balance is the hull of the feet, with a proof that needs no program.

On level treads (normals vertical, heights any) each foot can carry its part of the weight straight
up, so that the hull is always in balance. Nothing beyond a side of it is, if the plane through that
side and each other foot is no steeper than 1 / μ. For take a side along t, with the outward normal
u and the slope ν along t, and add to u·c = Σ (u·x_i fz_i - z_i u·fxy_i) the multiples of the
equations Σ fxy = 0 and Σ (x × f)_z = 0 that make the horizontal forces of the side's own feet drop
out. What is left of a foot that is d_i inside of the side and h_i off its height is at most

    fz_i (-d_i + μ √(h_i² + (ν d_i)²)),

and the root over d_i is the gradient of the plane through the side and the foot. The sum is at most
0, so u·c is at most the side's: q.e.d. Stairs of 0.18 x 0.28 m are 0.64 steep: friction counts from
1.6 on. Where feet stand on tilted ground, on slopes or on nosings, there is no such law.
"""

from itertools import combinations
from math import hypot

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.gait.support import support_polygon
from drake_quad.stability.contacts import Contacts
from drake_quad.stability.region import Region, find_region

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
