"""The whole-body controller's tick between the model's dynamics and the program's solver."""

from math import atan2

import numpy as np

from drake_quad.compiled import compiled, copy_matrix, copy_vector
from drake_quad.control.base_task import rotation_error, wanted_acceleration
from drake_quad.control.body_rate import height_over, pendulum_rate
from drake_quad.control.carried import at_rest, body_shift, com_shift, learn, wrench_of
from drake_quad.control.force_qp import Program, has_numbers, make_program, spread
from drake_quad.control.ground import contact_axes
from drake_quad.control.inverse_dynamics import reduce_dynamics, turn_forces
from drake_quad.control.joint_targets import LOOK_AHEAD
from drake_quad.control.light_feet import MOST_TIMES, along_prices, least_normals, rest_shares
from drake_quad.control.records import Records
from drake_quad.control.slip import answer_slip
from drake_quad.gait.legs import FloatArray

COM_PER_SHIFT = 0.8  # how much of a shift of the body the centre of mass makes, feet standing
# Of the least force, while a push is met: light feet would keep the centre of pressure from going
# as far aside as the feet under load allow.
LEAST_SHARE = 0.1


@compiled
def plan_forces(
    M: FloatArray,
    bias: FloatArray,
    gravity: float,
    running: bool,
    constants: Records,
    work: Records,
    carried: FloatArray,
    friction: FloatArray,
    com: FloatArray,
) -> tuple[Program, bool]:
    """The program of the feet's forces.

    Args:
        M: The model's mass matrix (18, 18).
        bias: Its Coriolis terms (18,).
        gravity: How fast things fall [m/s^2].
        running: Whether the clock follows the plan: then what is carried is learned.
        constants: See CONSTANTS.
        work: See WORK. The target's body stands aside for what is carried; the torques' map and
            the shift of the centre of mass are results.
        carried: See `learn`; goes on a tick.
        friction: See `answer_slip`; goes on a tick.
        com: Result: the model's centre of mass in W (3,) [m].

    Returns:
        The program, and whether there is one to be solved: of numbers, for the state as it is now.
    """
    c, found = constants[0], work[0]
    m, t = found.measured, found.target
    heading = atan2(m.R[1, 0], m.R[0, 0])
    # The base's turning moves the whole mass by its arm: what couples the two holds the arm.
    com[0], com[1], com[2] = M[2, 4] / M[3, 3], M[0, 5] / M[3, 3], M[1, 3] / M[3, 3]
    com += m.p
    shift = com_shift(carried, com - m.p, heading, c.learning.weight)
    aside = body_shift(shift, COM_PER_SHIFT)
    for i in range(2):
        found.com_shift[i] = shift[i]
        t.body[i] += aside[i]
    h = np.empty(18)
    for i in range(18):
        h[i] = bias[i] + gravity * M[i, 5]  # weight is what an acceleration upwards would take
    load = wrench_of(carried, heading)
    for i in range(6):
        h[i] += load[i]
    turn, speed, spin = rotation_error(t.R, m.R), t.v - m.v, t.w - m.w
    calm = running and at_rest(speed, turn, spin)
    if calm and m.known > 0.5 and c.load_time > 0.0:  # a push is no load
        copy_vector(carried, learn(carried, t.body[2] - m.p[2], turn, heading, c.learning))
    if calm:
        answer_slip(friction, m.feet.velocity, t.load, m.feet.normal, c.friction, c.pace.period)
    dynamics = reduce_dynamics(M, h, c.velocities, m.feet, t.feet_acceleration, m.p, c.radius)
    axes = contact_axes(m.feet.normal)
    turn_forces(dynamics, axes)
    copy_matrix(found.torque, dynamics.torque)
    copy_vector(found.torque_offset, dynamics.torque_offset)
    wanted = wanted_acceleration(t.acceleration, t.body[:3] - m.p, speed, turn, spin, c.gains)
    lower, upper = np.empty(12), np.empty(12)
    for j in range(12):
        stop = m.q[j] + m.qd[j] * LOOK_AHEAD
        lower[j] = 2.0 * (c.q_lower[j] - stop) / (LOOK_AHEAD * LOOK_AHEAD)
        upper[j] = max(2.0 * (c.q_upper[j] - stop) / (LOOK_AHEAD * LOOK_AHEAD), lower[j])
    # Where a pendulum comes to rest that moves as the body does beyond its plan.
    pendulum = pendulum_rate(height_over(m.p[2], m.feet.place))
    x, y = com[0] + shift[0] - speed[0] / pendulum, com[1] + shift[1] - speed[1] / pendulum
    shares = rest_shares(m.feet.place, t.load, x, y)
    least = least_normals(
        shares, t.load, gravity * M[3, 3],
        c.least_force * (1.0 if calm else LEAST_SHARE), MOST_TIMES * c.least_force,
    )  # fmt: skip
    for k in range(4):
        least[k] *= m.feet.normal[k, 2]  # of a weight, what goes along the normal
    # A push takes what there is, of every foot: then all forces cost the same.
    flat = np.full(4, c.weights.force / c.weights.along)
    program = make_program(
        dynamics, wanted, t.load, m.feet.place, c.effort, lower, upper, friction, least, c.weights,
        axes, along_prices(shares) if calm else flat,
    )  # fmt: skip
    return program, m.known > 0.5 and has_numbers(program)


@compiled
def torques_of(forces: FloatArray, work: Records, torque: FloatArray) -> None:
    """Writes the joints' torques (12,), leg by leg [Nm], of the solution of `plan_forces`."""
    found = work[0]
    all_forces = spread(forces, found.target.load)
    for i in range(12):
        total = found.torque_offset[i]
        for j in range(12):
            total += found.torque[i, j] * all_forces[j]
        torque[i] = total
