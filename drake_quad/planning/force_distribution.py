"""How the standing feet share the wrench that holds the robot up and moves it as planned."""

import numpy as np

from drake_quad.gait.legs import FloatArray


def distribute(
    wrench: FloatArray, arms: FloatArray, load: FloatArray, *, friction: float = 0.5
) -> FloatArray:
    """Forces at the feet of least weighted square that make up `wrench`.

    Minimises the sum of |f_i|^2 / load_i over forces with A f = wrench; then pulls are set to
    zero and tangential parts are kept in the friction cone.

    Args:
        wrench: (6,) force [N] and moment about the centre of mass [Nm], in W.
        arms: (4, 3) feet less the centre of mass, in W [m].
        load: (4,) how much each foot may carry, 0 for a foot in the air, 1 for a full one.
        friction: The cone's coefficient.

    Returns:
        (4, 3) forces on the feet in W [N].
    """
    A = np.zeros((6, 12))
    A[0, 0::3] = A[1, 1::3] = A[2, 2::3] = 1.0
    x, y, z = arms.T
    A[3, 1::3], A[3, 2::3] = -z, y
    A[4, 0::3], A[4, 2::3] = z, -x
    A[5, 0::3], A[5, 1::3] = -y, x
    weighted = A * np.repeat(load, 3)
    M = weighted @ A.T
    M.flat[::7] += 1e-9
    f = (np.linalg.solve(M, wrench) @ weighted).reshape(4, 3)
    normal = np.maximum(f[:, 2], 0.0)
    tangential = np.hypot(f[:, 0], f[:, 1])
    scale = np.minimum(1.0, friction * normal / np.maximum(tangential, 1e-9))
    return np.column_stack([f[:, :2] * scale[:, None], normal])
