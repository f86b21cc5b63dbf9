"""Start and end of a controller's update: targets of body and feet, and the joints' commands."""

from math import atan2
from typing import NamedTuple

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
from drake_quad.control.contact_load import (
    GIVEN_AWAY,
    caught_load,
    correct_load,
    foot_load,
    leaving_feet,
)
from drake_quad.control.foot_targets import FootInputs, compute_foot_targets
from drake_quad.control.kernel_state import (
    BODY_RATE,
    DEPTH,
    HEIGHT,
    LANDED,
    LEAD,
    LOWER,
    REGAINED,
    Record,
    Records,
    Softness,
)
from drake_quad.control.measurement import measure_into
from drake_quad.control.ports import Balance, Catch, GaitPhase, Mode
from drake_quad.jit import copy_matrix, copy_vector, jit
from drake_quad.math.curves import sample_body
from drake_quad.math.rotations import solve_rates
from drake_quad.planning.motion_plan import PlanTables
from drake_quad.planning.phase_table import sample_feet
from drake_quad.robot.kinematics import foot_and_jacobian, leg_row, solve_leg

DELIVERY = 0.001  # [s] that a command takes to the drives: a tick of theirs


@jit
def joint_targets(
    robot: Record, place: FloatArray, velocity: FloatArray, measured: Record, target: Record
) -> tuple[FloatArray, FloatArray]:
    """Joint angles (12,) [rad] and speeds (12,) [rad/s] that put the feet where they belong.

    A foot under load is placed in the body as desired, one without in the body as measured;
    between the two the target moves with the load, so that a foot about to lift off lets go.

    A leg that is too short goes as far as its knee's limits let it, and no faster than it can stop
    there: a straight leg would need speeds without bound, with which its drives press the
    knee against its stop and push the body instead.

    Args:
        robot: The legs' lengths `legs`, the joints' limits `q_lower`, `q_upper` (12,) [rad], and
            in which times they stop before these, `look_ahead` (4,) [s], as CONSTANTS has them.
        place: Where the feet are to be in W (4, 3) [m].
        velocity: Their velocities (4, 3) [m/s].
        measured: The body as measured: `p` and `R` of MEASURED.
        target: The body as desired and the feet's loads, see TARGET.
    """
    legs, q_lower, q_upper, load = robot.legs, robot.q_lower, robot.q_upper, target.load
    p, R, p_desired, R_desired = measured.p, measured.R, target.body, target.R
    v_desired, w_desired = target.v, target.w
    q, qd = np.empty(12), np.empty(12)
    for k in range(4):
        leg = leg_row(legs, k)
        d, m = place[k] - p_desired[:3], place[k] - p
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
        u0 = velocity[k, 0] - v_desired[0] - (w_desired[1] * d[2] - w_desired[2] * d[1])
        u1 = velocity[k, 1] - v_desired[1] - (w_desired[2] * d[0] - w_desired[0] * d[2])
        u2 = velocity[k, 2] - v_desired[2] - (w_desired[0] * d[1] - w_desired[1] * d[0])
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
        within = robot.look_ahead[k]
        rates = keep_knee(J, rates, (least - knee) / within, (most - knee) / within)
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
        least: Lower bound of the knee, in the same unit.
        most: Upper bound of the knee, in the same unit.
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


class Inputs(NamedTuple):
    """What reaches a controller beside the plan.

    Attributes:
        phase: The gait clock, see GaitPhase.
        catch: A foot that catches a push, see Catch.
        bearing: 1 where a foot is sensed to bear (4,).
        estimated: The robot's state [q; v].
        normals: Normals of the ground that the feet feel, in B, leg by leg (12,); zeros where
            nothing is felt.
    """

    phase: FloatArray
    catch: FloatArray
    bearing: FloatArray
    estimated: FloatArray
    normals: FloatArray


@jit
def compute_targets(
    plan: PlanTables,
    inputs: Inputs,
    constants: Records,
    memory: FloatArray,
    last: FloatArray,
    work: Records,
    ground: FloatArray,
) -> None:
    """What base and feet are to do now.

    A clock that is at another task has the plan at its end; one that waits for a plan made anew has
    that at its beginning.

    Args:
        plan: The plan.
        inputs: Clock, contacts and state.
        constants: The robot and the settings, see CONSTANTS.
        memory: The controller's memory, see MEMORY_SIZE; goes on a tick.
        last: The last finite state, see `measure_into`; goes on a tick.
        work: Intermediate results, see WORK; measurement, target, place and velocity are written.
        ground: The map's ground, see `ground_table`.
    """
    c, found = constants[0], work[0]
    phase, catch, bearing = inputs.phase, inputs.catch, inputs.bearing
    measure_into(
        found.measured, inputs.estimated, last, c.places, c.legs, c.radius, ground, inputs.normals
    )
    t = phase[TIME] if int(phase[TASK]) == plan.task else plan.duration
    rate, running = phase[RATE], int(phase[MODE]) == RUN
    if int(phase[MODE]) == REPLAN and int(phase[REVISION]) == plan.revision:
        t = 0.0
    planned = sample_feet(plan.phases, t)
    standing = planned.standing
    if not running:
        for k in range(4):
            standing[k] = k + 1 != int(catch[LEG])
    feet = found.measured.feet.place
    load, leaving = foot_load(plan.phases, t, c.unload_time), leaving_feet(plan.phases, t)
    # A foot that waits to lift off is to bear.
    unloaded = leaving & (load <= GIVEN_AWAY) & (running and rate > 0.0)
    now = FootInputs(planned, rate, feet, bearing, catch, not running, unloaded)
    foot, new = compute_foot_targets(now, memory, c.pace)
    copy_vector(memory, new)
    if running:
        landed = new[LANDED : LANDED + 4]
        correct_load(load, standing, bearing, landed, new[REGAINED : REGAINED + 4])
    else:
        load = caught_load(standing, bearing)
    if t <= 1.5 * c.pace.period:  # plans begin at rest
        memory[LEAD], memory[BODY_RATE] = 0.0, rate
    pendulum = pendulum_rate(height_over(found.measured.p[2], feet))
    memory[BODY_RATE], memory[LEAD], change = next_body_rate(
        memory[BODY_RATE], memory[LEAD], rate, pendulum, c.pace.period
    )
    target, body = found.target, sample_body(plan.control, plan.knot, t + memory[LEAD])
    base_target(body, memory[BODY_RATE], change, new[HEIGHT], target)
    reaching = np.empty(4, dtype=np.bool_)
    for k in range(4):
        reaching[k] = running and (bearing[k] > 0.5 if standing[k] else new[DEPTH + k] > 0.0)
    short = shortage(c.legs, c.longest, foot.place, reaching, target.body[:3], target.R)
    memory[LOWER] = next_lower(memory[LOWER], short, c.pace)
    target.body[2] -= memory[LOWER]
    copy_vector(target.load, load)
    copy_matrix(target.feet_acceleration, foot.acceleration)
    copy_matrix(found.place, foot.place)
    copy_matrix(found.velocity, foot.velocity)
    copy_vector(found.soft, load)
    waits = running and rate == 0.0
    for k in range(4):
        found.leaving[k] = 1.0 if waits and leaving[k] and bearing[k] > 0.5 else 0.0
    # A foot that lost the ground is to touch it again, not to thrust itself off.
    for k in range(4):
        if standing[k] and (not running or bearing[k] < 0.5):
            found.soft[k] = 1.0


class Commands(NamedTuple):
    """A controller's outputs, which `compute_commands` writes; arrays in the actuators' order.

    Attributes:
        joints: Joint angles [rad], then speeds [rad/s] (24,).
        torques: Joint torques to feed forward (12,) [Nm].
        body: The body as desired: x, y, z, pitch, yaw (5,).
        feet: The feet's centres as desired in W (12,) [m].
        balance: What the gait clock needs to know, see Balance.
    """

    joints: FloatArray
    torques: FloatArray
    body: FloatArray
    feet: FloatArray
    balance: FloatArray


@jit
def compute_commands(
    torque: FloatArray, com: FloatArray, constants: Records, work: Records, commands: Commands
) -> None:
    """The commands to the drives, within their limits, and what the gait clock needs to know.

    Args:
        torque: Joint torques to feed forward (12,), leg by leg [Nm].
        com: The model's centre of mass in W (3,) [m].
        constants: The robot and the settings, see CONSTANTS.
        work: Intermediate results, see WORK.
        commands: Result.
    """
    c, found = constants[0], work[0]
    m, t = found.measured, found.target
    joints, torques, balance = commands.joints, commands.torques, commands.balance
    # Drives hold a target for a period: in its middle the feet are to be where they belong.
    ahead = found.place + (DELIVERY + 0.5 * c.pace.period) * found.velocity
    q, qd = joint_targets(c, ahead, found.velocity, m, t)
    if c.softness.share < 1.0:
        q, qd = soften(q, qd, m.q, m.qd, found.soft, c.softness)
    for i in range(12):
        j = c.order[i]
        joints[i] = min(max(q[j], c.q_lower[j]), c.q_upper[j])
        joints[12 + i] = min(max(qd[j], -c.speed[j]), c.speed[j])
        torques[i] = min(max(torque[j], -c.effort[j]), c.effort[j])
    copy_vector(commands.body, t.body)
    for k in range(4):
        for i in range(3):
            commands.feet[3 * k + i] = found.place[k, i]
            balance[FEET + 3 * k + i] = m.feet.place[k, i]
    for i in range(3):
        balance[COM + i], balance[BODY + i] = com[i], m.p[i]
    for i in range(2):
        balance[COM + i] += found.com_shift[i]
        balance[ACCELERATION + i] = t.acceleration[3 + i]
        balance[VELOCITY_ERROR + i] = m.v[i] - t.v[i]
        balance[PLACE_ERROR + i] = m.p[i] - t.body[i]
    balance[BODY + 3] = atan2(m.R[1, 0], m.R[0, 0])
