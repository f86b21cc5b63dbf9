"""How the standing feet share the wrench that holds the robot up and moves it as planned."""

import numpy as np

from drake_quad.gait.legs import FloatArray


def distribute(
    wrench: FloatArray,
    arms: FloatArray,
    load: FloatArray,
    *,
    least: float = 0.0,
    friction: float = 0.5,
) -> FloatArray:
    """Forces at the feet that make up `wrench` without pulling.

    Horizontal forces are shared in proportion to the load; the vertical ones minimise the sum of
    f_i^2 / load_i. Four feet leave one degree of freedom: it is used to keep every foot pushing
    with `least` at least. Three feet leave none, and what they cannot give is left out.

    Args:
        wrench: (6,) force [N] and moment about the centre of mass [Nm], in W.
        arms: (4, 3) feet less the centre of mass, in W [m].
        load: (4,) how much each foot may carry, 0 for a foot in the air, 1 for a full one; three
            at least are above 0.
        least: The least normal force of a full foot [N].
        friction: The friction cone's coefficient.

    Returns:
        (4, 3) forces on the feet in W [N].
    """
    share = load / load.sum()
    f = np.zeros((4, 3))
    centre = share @ arms[:, :2]
    spread = arms[:, :2] - centre
    inertia = share @ np.einsum("ij,ij->i", spread, spread)
    twist = (wrench[5] - (centre[0] * wrench[1] - centre[1] * wrench[0])) / inertia
    f[:, 0] = share * (wrench[0] - twist * spread[:, 1])
    f[:, 1] = share * (wrench[1] + twist * spread[:, 0])
    # Σ f_z, Σ y f_z and -Σ x f_z, the moments less what the horizontal forces make.
    A = np.stack([np.ones(4), arms[:, 1], -arms[:, 0]])
    b = np.array(
        [
            wrench[2],
            wrench[3] + arms[:, 2] @ f[:, 1],
            wrench[4] - arms[:, 2] @ f[:, 0],
        ]
    )
    weighted = A * load
    normal = np.linalg.solve(weighted @ A.T, b) @ weighted
    floor = least * load
    if np.all(load > 0.0) and np.any(normal < floor):
        normal = _along_null(normal, floor, arms)
    f[:, 2] = np.maximum(normal, 0.0)
    tangential = np.hypot(f[:, 0], f[:, 1])
    f[:, :2] *= np.minimum(1.0, friction * f[:, 2] / np.maximum(tangential, 1e-9))[:, None]
    return f


def _along_null(normal: FloatArray, floor: FloatArray, arms: FloatArray) -> FloatArray:
    """Shifts four normal forces along the one combination that makes no wrench, to the floor."""
    x, y = arms[:, 0], arms[:, 1]
    null = np.empty(4)
    for i, (a, b, c) in enumerate(((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))):
        area = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a])
        null[i] = area if i % 2 == 0 else -area
    null /= np.max(np.abs(null)) + 1e-12
    low, high = -np.inf, np.inf
    for n, f, least in zip(null, normal, floor, strict=True):
        if n > 1e-9:
            low = max(low, (least - f) / n)
        elif n < -1e-9:
            high = min(high, (least - f) / n)
    shift = min(max(0.0, low), high) if low <= high else 0.5 * (low + high)
    return np.asarray(normal + shift * null)
