"""Start and end of a controller's update: targets of body and feet, and the joints' commands."""

from math import atan2

import numpy as np

from drake_quad.common import FloatArray, Matrix, Vector
from drake_quad.control.base_tracking import (
    base_target,
    height_over,
    next_body_rate,
    next_lower,
    pendulum_rate,
    shortage,
)
from drake_quad.control.contact_load import caught_load, correct_load, foot_load
from drake_quad.control.foot_targets import compute_foot_targets
from drake_quad.control.kernel_state import (
    BODY_RATE,
    DEPTH,
    HEIGHT,
    LANDED,
    LEAD,
    LOWER,
    REGAINED,
    Records,
    Softness,
)
from drake_quad.control.measurement import measure_into
from drake_quad.control.ports import Balance, Catch, GaitPhase, Mode
from drake_quad.jit import copy_matrix, copy_vector, jit
from drake_quad.math.curves import sample_body
from drake_quad.math.rotations import solve_rates
from drake_quad.planning.motion_plan import sample_feet
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


# Numba has these as plain numbers.
TASK, TIME, RATE, MODE, REVISION = (
    int(p)
    for p in (
        GaitPhase.TASK,
        GaitPhase.TIME,
        GaitPhase.RATE,
        GaitPhase.MODE,
        GaitPhase.REVISION,
    )
)
LEG, RUN, REPLAN = int(Catch.LEG), int(Mode.RUN), int(Mode.REPLAN)
COM, ACCELERATION, VELOCITY_ERROR, FEET, BODY, PLACE_ERROR = (int(b) for b in Balance)


@jit
def compute_targets(
    control_points: FloatArray,
    knot: float,
    phases: FloatArray,
    duration: float,
    task: int,
    revision: int,
    phase: FloatArray,
    catch: FloatArray,
    bearing: FloatArray,
    estimated: FloatArray,
    constants: Records,
    memory: FloatArray,
    last: FloatArray,
    work: Records,
    ground: FloatArray,
) -> None:
    """What base and feet are to do now.

    Args:
        control_points: Of the plan's body (n, 5), and
        knot: their spacing [s].
        phases: Of the plan, see `phase_table`.
        duration: Of the plan [s].
        task: That the plan is for.
        revision: Of the plan.
        phase: See GaitPhase. A clock that is at another task has the plan at its end; one that
            waits for a plan made anew has that at its beginning.
        catch: See Catch.
        bearing: 1 where a foot is sensed to bear (4,).
        estimated: [q; v].
        constants: See CONSTANTS.
        memory: See MEMORY_SIZE; goes on a tick.
        last: See `measure_into`; goes on a tick.
        work: See WORK; its measured, its target, place and velocity are the result.
        ground: See `ground_table`.
    """
    c, found = constants[0], work[0]
    measure_into(found.measured, estimated, last, c.places, c.legs, c.radius, ground)
    t = phase[TIME] if int(phase[TASK]) == task else duration
    rate, running = phase[RATE], int(phase[MODE]) == RUN
    if int(phase[MODE]) == REPLAN and int(phase[REVISION]) == revision:
        t = 0.0
    feet, velocity, acceleration, standing, swing_phase = sample_feet(phases, t)
    if not running:
        for k in range(4):
            standing[k] = k + 1 != int(catch[LEG])
    place, velocity, acceleration, new = compute_foot_targets(
        feet, velocity, acceleration, standing, swing_phase, rate, found.measured.feet.place,
        bearing, catch, not running, memory, c.pace,
    )  # fmt: skip
    copy_vector(memory, new)
    if running:
        load = foot_load(phases, t, c.unload_time)
        correct_load(load, standing, bearing, new[LANDED] > 0.5, new[REGAINED : REGAINED + 4])
    else:
        load = caught_load(standing, bearing)
    if t <= 1.5 * c.pace.period:  # plans begin at rest
        memory[LEAD], memory[BODY_RATE] = 0.0, rate
    pendulum = pendulum_rate(height_over(found.measured.p[2], found.measured.feet.place))
    memory[BODY_RATE], memory[LEAD], change = next_body_rate(
        memory[BODY_RATE], memory[LEAD], rate, pendulum, c.pace.period
    )
    target = base_target(
        sample_body(control_points, knot, t + memory[LEAD]),
        memory[BODY_RATE],
        change,
        new[HEIGHT],
        acceleration,
        load,
    )
    reaching = np.empty(4, dtype=np.bool_)
    for k in range(4):
        reaching[k] = running and (bearing[k] > 0.5 if standing[k] else new[DEPTH] > 0.0)
    short = shortage(c.legs, c.longest, place, reaching, target.body[:3], target.R)
    memory[LOWER] = next_lower(memory[LOWER], short, c.pace)
    target.body[2] -= memory[LOWER]
    into = found.target
    copy_vector(into.body, target.body)
    copy_matrix(into.R, target.R)
    copy_vector(into.v, target.v)
    copy_vector(into.w, target.w)
    copy_vector(into.acceleration, target.acceleration)
    copy_vector(into.load, load)
    copy_matrix(into.feet_acceleration, acceleration)
    copy_matrix(found.place, place)
    copy_matrix(found.velocity, velocity)
    copy_vector(found.soft, load)
    # A foot that lost the ground is to touch it again, not to thrust itself off.
    for k in range(4):
        if standing[k] and (not running or bearing[k] < 0.5):
            found.soft[k] = 1.0


@jit
def compute_commands(
    torque: FloatArray,
    com: FloatArray,
    constants: Records,
    work: Records,
    joints: FloatArray,
    torques: FloatArray,
    body: FloatArray,
    feet: FloatArray,
    balance: FloatArray,
) -> None:
    """The commands to the drives, within their limits, and what the gait clock needs to know.

    Args:
        torque: To feed forward (12,), leg by leg [Nm].
        com: The model's centre of mass in W (3,) [m].
        constants: See CONSTANTS.
        work: See WORK.
        joints: Result: angles [rad], then speeds [rad/s] (24,), in the actuators' order.
        torques: Result (12,) in the actuators' order [Nm].
        body: Result: x, y, z, pitch, yaw desired (5,).
        feet: Result: their centres desired in W (12,) [m].
        balance: Result: see Balance.
    """
    c, found = constants[0], work[0]
    m, t = found.measured, found.target
    q, qd = joint_targets(
        c.legs, found.place, found.velocity, t.load, m.p, m.R, t.body[:3], t.R, t.v, t.w,
        c.q_lower, c.q_upper,
    )  # fmt: skip
    if c.softness.share < 1.0:
        q, qd = soften(q, qd, m.q, m.qd, found.soft, c.softness)
    for i in range(12):
        j = c.order[i]
        joints[i] = min(max(q[j], c.q_lower[j]), c.q_upper[j])
        joints[12 + i] = min(max(qd[j], -c.speed[j]), c.speed[j])
        torques[i] = min(max(torque[j], -c.effort[j]), c.effort[j])
    copy_vector(body, t.body)
    for k in range(4):
        for i in range(3):
            feet[3 * k + i] = found.place[k, i]
            balance[FEET + 3 * k + i] = m.feet.place[k, i]
    for i in range(3):
        balance[COM + i], balance[BODY + i] = com[i], m.p[i]
    for i in range(2):
        balance[COM + i] += found.com_shift[i]
        balance[ACCELERATION + i] = t.acceleration[3 + i]
        balance[VELOCITY_ERROR + i] = m.v[i] - t.v[i]
        balance[PLACE_ERROR + i] = m.p[i] - t.body[i]
    balance[BODY + 3] = atan2(m.R[1, 0], m.R[0, 0])
