"""The joint angles and speeds that put the feet where they are to be, and how stiffly."""

from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray, Matrix, Vector
from drake_quad.jit import jit
from drake_quad.math.rotations import solve_rates
from drake_quad.robot.kinematics import foot_and_jacobian, leg_row, solve_leg

LOOK_AHEAD = 0.05  # [s] within which a joint is to stop before its limit


@jit
def joint_targets(
    legs: FloatArray,
    places: FloatArray,
    velocities: FloatArray,
    load: FloatArray,
    p: FloatArray,
    R: FloatArray,
    p_desired: FloatArray,
    R_desired: FloatArray,
    v_desired: FloatArray,
    w_desired: FloatArray,
    q_lower: FloatArray,
    q_upper: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Joint angles (12,) [rad] and speeds (12,) [rad/s] that put the feet where they belong.

    A foot under load is placed in the body as desired, one without in the body as measured;
    between the two the target moves with the load, so that a foot about to lift off lets go.

    A leg that is too short goes as far as its knee's limits (`q_lower` and `q_upper`, (12,) [rad])
    let it, and no faster than it can stop there: a straight leg would be asked for speeds without
    end, with which its drives press the knee against its stop and push the body instead.
    """
    q, qd = np.empty(12), np.empty(12)
    for k in range(4):
        leg = leg_row(legs, k)
        d, m = places[k] - p_desired, places[k] - p
        b0, b1, b2 = 0.0, 0.0, 0.0
        share = load[k]
        for i in range(3):
            wanted0, measured0 = R_desired[i, 0] * d[i], R[i, 0] * m[i]
            wanted1, measured1 = R_desired[i, 1] * d[i], R[i, 1] * m[i]
            wanted2, measured2 = R_desired[i, 2] * d[i], R[i, 2] * m[i]
            b0 += measured0 + share * (wanted0 - measured0)
            b1 += measured1 + share * (wanted1 - measured1)
            b2 += measured2 + share * (wanted2 - measured2)
        least, most = q_lower[3 * k + 2], q_upper[3 * k + 2]
        angles = solve_leg(leg, b0, b1, b2)
        _, J = foot_and_jacobian(leg, angles[0], angles[1], angles[2])
        angles = keep_knee(J, angles, least, most)
        u0 = velocities[k, 0] - v_desired[0] - (w_desired[1] * d[2] - w_desired[2] * d[1])
        u1 = velocities[k, 1] - v_desired[1] - (w_desired[2] * d[0] - w_desired[0] * d[2])
        u2 = velocities[k, 2] - v_desired[2] - (w_desired[0] * d[1] - w_desired[1] * d[0])
        _, J = foot_and_jacobian(leg, angles[0], angles[1], angles[2])
        rates = solve_rates(
            J,
            (
                R_desired[0, 0] * u0 + R_desired[1, 0] * u1 + R_desired[2, 0] * u2,
                R_desired[0, 1] * u0 + R_desired[1, 1] * u1 + R_desired[2, 1] * u2,
                R_desired[0, 2] * u0 + R_desired[1, 2] * u1 + R_desired[2, 2] * u2,
            ),
        )
        knee = angles[2]
        rates = keep_knee(J, rates, (least - knee) / LOOK_AHEAD, (most - knee) / LOOK_AHEAD)
        for i in range(3):
            q[3 * k + i] = angles[i]
            qd[3 * k + i] = rates[i]
    return q, qd


@jit
def keep_knee(J: Matrix, joints: Vector, least: float, most: float) -> Vector:
    """A leg's angles, or speeds, with the knee's within bounds, and the hip's so as that takes.

    The hip pitch goes by so much more that the foot is as near as it can be to where the knee
    would have it, to first order.

    Args:
        J: The foot's Jacobian.
        joints: Abduction, hip pitch, knee [rad] or [rad/s].
        least: Of the knee, and
        most: the greatest, in the same unit.
    """
    abduction, hip, knee = joints
    kept = min(max(knee, least), most)
    if kept == knee:
        return joints
    own, shared = 1e-9, 0.0
    for row in J:
        own += row[1] * row[1]
        shared += row[1] * row[2]
    return abduction, hip - shared / own * (kept - knee), kept


class Softness(NamedTuple):
    """How much of the joints' stiffness a loaded leg keeps, and how far it may pull.

    Attributes:
        share: Of the stiffness and damping.
        most_away: Of a loaded leg's joints from their targets [rad].
        most_faster: The same of their speeds [rad/s].
    """

    share: float
    most_away: float
    most_faster: float


@jit
def soften(
    q: FloatArray,
    qd: FloatArray,
    q_measured: FloatArray,
    qd_measured: FloatArray,
    load: FloatArray,
    softness: Softness,
) -> tuple[FloatArray, FloatArray]:
    """Joint targets (12,), (12,) nearer to the joints as they are, the more load a foot carries.

    What is left of the stiffness may not override the program's forces when errors are large.
    """
    new_q, new_qd = np.empty(12), np.empty(12)
    for j in range(12):
        m = load[j // 3]
        share = 1.0 - (1.0 - softness.share) * m
        free = 1e3 * (1.0 - m)
        away, faster = softness.most_away + free, softness.most_faster + free
        new_q[j] = q_measured[j] + share * min(max(q[j] - q_measured[j], -away), away)
        new_qd[j] = qd_measured[j] + share * min(max(qd[j] - qd_measured[j], -faster), faster)
    return new_q, new_qd
