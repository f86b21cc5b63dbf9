"""Which way the ground under a foot is tilted, felt by a sensor in the foot's ball.

A ball touches what it stands on where the line from its centre along the ground's normal meets
its surface. A sensor that tells where on the ball the force acts, so tells the normal: a
force-torque sensor in the ankle does (A. Bicchi, J. K. Salisbury, D. L. Brock, "Contact sensing
from force measurements", International Journal of Robotics Research 12(3), 1993), and so does a
skin of pressure cells.
"""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.kinematics import LegConstants, normal_felt


def feel_normals(
    legs: tuple[LegConstants, ...],
    p_WB: FloatArray,
    R_WB: FloatArray,
    q: FloatArray,
    places: FloatArray,
    bearing: FloatArray,
) -> FloatArray:
    """Unit normals in B, leg by leg (12,), of what the feet stand on; zeros for one that does not.

    Args:
        legs: Leg lengths, see `robot.kinematics.leg_constants`.
        p_WB: Place of B in W (3,) [m].
        R_WB: Attitude of B in W (3, 3).
        q: Joint angles (12,), leg by leg [rad].
        places: Where the force on each foot acts, in W, leg by leg (12,) [m].
        bearing: 1 where a foot bears (4,).
    """
    normals = np.zeros((4, 3))
    R, base = R_WB.tolist(), p_WB.tolist()
    angles, pressed = q.reshape(4, 3).tolist(), places.reshape(4, 3).tolist()
    for k, leg in enumerate(legs):
        if bearing[k] > 0.5:
            normals[k] = normal_felt(leg, angles[k], R, base, pressed[k])
    return np.asarray(normals @ R_WB).ravel()
