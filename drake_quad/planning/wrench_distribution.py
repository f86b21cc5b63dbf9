"""How standing feet share a wrench, in plain floats: it runs in the control loop."""

from collections.abc import Sequence
from math import hypot

from drake_quad.common import Matrix, Vector
from drake_quad.math.rotations import solve_rates

UPRIGHT: tuple[Vector, ...] = ((0.0, 0.0, 1.0),) * 4
_OTHERS = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))


def distribute_wrench(
    force: Vector,
    moment: Vector,
    arms: Sequence[Vector],
    load: Sequence[float],
    *,
    least: float = 0.0,
    friction: float = 0.5,
    normals: Sequence[Vector] = UPRIGHT,
) -> list[Vector]:
    """Forces at the feet that make up a wrench without pulling.

    Horizontal forces are shared in proportion to the load; the vertical ones minimise the sum of
    f_i^2 / load_i. Four feet leave one degree of freedom: it is used to keep every foot pushing
    with `least` at least. Three feet leave none, and what they cannot give is left out.

    Args:
        force: On the robot, in W [N].
        moment: On the robot, about its centre of mass, in W [Nm].
        arms: The four feet less the centre of mass, in W [m].
        load: How much each foot may carry, 0 for a foot in the air, 1 for a full one; three at
            least are above 0.
        least: The least normal force of a full foot [N].
        friction: The friction cone's coefficient.
        normals: Ground normals under the four feet, the axes of their friction cones.

    Returns:
        The forces on the four feet, in W [N].
    """
    # Written out leg by leg: generators would take longer than the arithmetic.
    l0, l1, l2, l3 = load
    total = l0 + l1 + l2 + l3
    s0, s1, s2, s3 = l0 / total, l1 / total, l2 / total, l3 / total
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = arms
    cx = s0 * x0 + s1 * x1 + s2 * x2 + s3 * x3
    cy = s0 * y0 + s1 * y1 + s2 * y2 + s3 * y3
    inertia = (
        s0 * ((x0 - cx) ** 2 + (y0 - cy) ** 2)
        + s1 * ((x1 - cx) ** 2 + (y1 - cy) ** 2)
        + s2 * ((x2 - cx) ** 2 + (y2 - cy) ** 2)
        + s3 * ((x3 - cx) ** 2 + (y3 - cy) ** 2)
    )
    px, py, pz = force
    twist = (moment[2] - (cx * py - cy * px)) / inertia
    fx = (
        s0 * (px - twist * (y0 - cy)),
        s1 * (px - twist * (y1 - cy)),
        s2 * (px - twist * (y2 - cy)),
        s3 * (px - twist * (y3 - cy)),
    )
    fy = (
        s0 * (py + twist * (x0 - cx)),
        s1 * (py + twist * (x1 - cx)),
        s2 * (py + twist * (x2 - cx)),
        s3 * (py + twist * (x3 - cx)),
    )
    # Σ f_z, Σ y f_z and -Σ x f_z: the moments less what the horizontal forces make.
    wanted = (
        pz,
        moment[0] + z0 * fy[0] + z1 * fy[1] + z2 * fy[2] + z3 * fy[3],
        moment[1] - z0 * fx[0] - z1 * fx[1] - z2 * fx[2] - z3 * fx[3],
    )
    normal = _least_squares(wanted, arms, load)
    lower = [least * m for m in load]
    if min(load) > 0.0 and any([f < b for f, b in zip(normal, lower, strict=True)]):
        normal = _along_null(normal, lower, arms)
    forces = []
    for x, y, z, up in zip(fx, fy, normal, normals, strict=True):
        z = max(z, 0.0)
        if up[2] == 1.0:
            scale = min(1.0, friction * z / max(hypot(x, y), 1e-9))
            forces.append((x * scale, y * scale, z))
        else:
            forces.append(_into_cone((x, y, z), up, friction))
    return forces


def _into_cone(force: Vector, up: Vector, friction: float) -> Vector:
    """A force with no more along the ground than friction gives, its normal part unchanged."""
    push = max(sum(f * n for f, n in zip(force, up, strict=True)), 0.0)
    along = [f - push * n for f, n in zip(force, up, strict=True)]
    scale = min(1.0, friction * push / max(hypot(*along), 1e-9))
    x, y, z = (push * n + scale * t for n, t in zip(up, along, strict=True))
    return x, y, z


def _least_squares(wanted: Vector, arms: Sequence[Vector], load: Sequence[float]) -> list[float]:
    """Normal forces of least Σ f^2 / load with the wanted sum and moments."""
    m = mx = my = mxx = mxy = myy = 0.0
    for k, (x, y, _) in zip(load, arms, strict=True):
        kx, ky = k * x, k * y
        m += k
        mx += kx
        my += ky
        mxx += kx * x
        mxy += kx * y
        myy += ky * y
    gram: Matrix = ((m, my, -mx), (my, myy, -mxy), (-mx, -mxy, mxx))
    a, b, c = solve_rates(gram, wanted)
    return [k * (a + b * p[1] - c * p[0]) for k, p in zip(load, arms, strict=True)]


def _along_null(
    normal: Sequence[float], lower: Sequence[float], arms: Sequence[Vector]
) -> list[float]:
    """Shifts four normal forces along the one combination that makes no wrench, to lower bounds."""
    null = []
    for i, (a, b, c) in enumerate(_OTHERS):
        (xa, ya, _), (xb, yb, _), (xc, yc, _) = arms[a], arms[b], arms[c]
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
        null.append(area if i % 2 == 0 else -area)
    scale = max(max(abs(n) for n in null), 1e-12)
    low, high = float("-inf"), float("inf")
    for n, f, least in zip(null, normal, lower, strict=True):
        n /= scale
        if n > 1e-9:
            low = max(low, (least - f) / n)
        elif n < -1e-9:
            high = min(high, (least - f) / n)
    shift = min(max(0.0, low), high) if low <= high else 0.5 * (low + high)
    return [f + shift * n / scale for f, n in zip(normal, null, strict=True)]
