"""Feet on the ground, and what each of them can push with: Coulomb's cone as a pyramid."""

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.gait.legs import FloatArray, read_only

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
        sides: How many, at least 3. The gap between the pyramid inside the cone and the cone is
            1 - cos(π / sides) of the friction coefficient: 7.6 % with 8 sides, 1.9 % with 16.
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
        pyramid: See there. Its edges lie on the cone, or its planes touch it if it is outside.
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
