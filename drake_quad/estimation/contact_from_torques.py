"""Which feet bear, by the joints' torques alone: a generalised-momentum observer and a threshold.

The momentum p = M v of the whole robot changes by what the drives give, by velocity and gravity
terms that the model has, and by what pushes from outside. The observer's residual follows the last
of these, low-passed, without any acceleration being measured:

    r_k = K (p_k - p_0 - Σ (S^T τ + Ṁ v - h + r) T)

with h all of Coriolis and gravity terms (so that C^T v - g = Ṁ v - h). Of a leg's three joints it
is J^T f, from which follows the force f on its foot.

Sources: A. De Luca, A. Albu-Schäffer, S. Haddadin, G. Hirzinger, "Collision detection and safe
reaction with the DLR-III lightweight manipulator arm", IROS 2006; for feet
of quadrupeds G. Bledt, P. M. Wensing, S. Ingersoll, S. Kim, "Contact model fusion for event-based
locomotion in unstructured terrains", ICRA 2018. Of the latter's fusion nothing is here.
"""

from typing import NamedTuple

import numpy as np

from drake_quad.common import GRAVITY, FloatArray, IntArray
from drake_quad.jit import copy_matrix, copy_vector, jit
from drake_quad.robot.kinematics import jacobians_in_world

WELL_CONDITIONED = 0.05  # of its greatest singular value that a leg's Jacobian's least must be


class TouchSettings(NamedTuple):
    """How the observer listens, and when it believes.

    Attributes:
        time: Time constant of the residual, 1 / K [s].
        touch: Share of the robot's weight on a foot at which it begins to bear, beyond what the
            torques' uncertainty comes to at the foot.
        leave: Share at which it bears no more.
        confirm: How long a foot must press with `touch` before it is believed [s]; with a multiple
            of it, by so much shorter: what tells is the impulse.
        confirm_leave: How long it must press less than `leave` before that is believed [s].
        hold: How long a foot that was felt to land bears at the least [s]: the controller begins to
            load it then, and presses less for a moment than the leg did that came down.
    """

    time: float = 0.008
    touch: float = 0.01
    leave: float = 0.0025
    confirm: float = 0.02
    confirm_leave: float = 0.012
    hold: float = 0.12


class ObserverModel(NamedTuple):
    """What the observer knows of a robot: where its joints are in the state, and their drives.

    Attributes:
        legs: The legs' lengths, see `leg_array`.
        q_base: Place of the base's quaternion in [q; v].
        q_joints: Places of the joints' angles in it (12,), leg by leg.
        v_joints: Places of their speeds in it (12,).
        num_positions: Where the velocities begin in it.
        damping: Damping of the joints (12,) [Nm s/rad].
        friction: Coulomb friction of the joints (12,) [Nm].
        mass: The robot's [kg].
        kp: Proportional gain of the drives [Nm/rad].
        kd: Their derivative gain [Nm s/rad].
        hold: How long a command to the drives holds [s].
    """

    legs: FloatArray
    q_base: int
    q_joints: IntArray
    v_joints: IntArray
    num_positions: int
    damping: FloatArray
    friction: FloatArray
    mass: float
    kp: float
    kd: float
    hold: float


class JointDynamics(NamedTuple):
    """A robot's dynamics at one time, in the rows of its twelve joints, leg by leg.

    Attributes:
        momentum: The joints' rows of M v (12,) [Nm s].
        velocity_terms: Joint torques of Ṁ v - h (12,) [Nm].
        torque: Torque of each drive (12,) [Nm].
        jacobian: Jacobian of each foot in W against its own leg's joints (4, 3, 3) [m].
        uncertainty: By how much what moves the joints may be off these torques, either way (12,)
            [Nm]: friction, and what is not known of the torques' ripple.
    """

    momentum: FloatArray
    velocity_terms: FloatArray
    torque: FloatArray
    jacobian: FloatArray
    uncertainty: FloatArray


@jit
def torque_ripple(
    speed: FloatArray, speed_before: FloatArray, kp: float, kd: float, period: float
) -> FloatArray:
    """A quarter of what the drives' torques fall by while a command holds (12,) [Nm].

    A drive gives τ_fed + kp (q_d - q) + kd (v_d - v). Its joint moves on between two commands, and
    q_d does not: the torque runs like a sawtooth, and what is measured just before the next
    command is its lowest point. The mean is above that by half of the fall if the drive computes
    its torque continuously, by a quarter if twice for each command, by nothing if once: with a
    quarter the mean is off by another quarter at the most. Of a B2's knee, which lifts with
    3.7 rad/s at 1560 Nm/rad, a quarter is 3 Nm: 1 % of the robot's weight at its foot.

    Args:
        speed: The joints' speeds at the end of the period (12,) [rad/s].
        speed_before: Their speeds at its beginning (12,) [rad/s].
        kp: Proportional gain of the drives [Nm/rad].
        kd: Their derivative gain [Nm s/rad].
        period: How long a command holds [s].
    """
    moved = 0.5 * (speed + speed_before) * period
    return 0.25 * (kp * moved + kd * (speed - speed_before))


@jit
def joint_dynamics(
    M: FloatArray,
    bias: FloatArray,
    state: FloatArray,
    torque: FloatArray,
    before: FloatArray,
    period: float,
    robot: ObserverModel,
) -> JointDynamics:
    """The terms that the observer needs of a robot's dynamics.

    Args:
        M: The model's mass matrix (n, n), of which the base's velocities are the first six, the
            third of its translation upwards.
        bias: Its Coriolis terms (n,).
        state: [q; v].
        torque: Torque of each drive at the end of the period, leg by leg (12,) [Nm].
        before: The mass matrix's joint rows a period ago, and the joints' speeds (12, n + 1); zeros
            if there is no period before. It becomes what is now.
        period: Since then [s].
        robot: What is known of the robot.
    """
    n, first = len(bias), robot.num_positions
    speed, speed_before = np.empty(12), before[:, n].copy()
    momentum, terms = np.zeros(12), np.zeros(12)
    begun = before[0, robot.v_joints[0] - first] > 0.0  # the mass that a joint moves
    for k in range(12):
        place = robot.v_joints[k]
        row = place - first
        speed[k] = state[place]
        change = 0.0
        for j in range(n):
            v = state[first + j]
            momentum[k] += M[row, j] * v
            change += (M[row, j] - before[k, j]) * v
            before[k, j] = M[row, j]
        before[k, n] = speed[k]
        # Weight is what an acceleration upwards would take.
        terms[k] = -(bias[row] + GRAVITY * M[row, 5] + robot.damping[k] * speed[k])
        if begun:
            terms[k] += change / period
    ripple = np.zeros(12)
    if begun:
        ripple = torque_ripple(speed, speed_before, robot.kp, robot.kd, robot.hold)
    q = np.empty(12)
    for k in range(12):
        q[k] = state[robot.q_joints[k]]
    jacobian = jacobians_in_world(robot.legs, state[robot.q_base : robot.q_base + 4], q)
    return JointDynamics(
        momentum, terms, torque + ripple, jacobian, robot.friction + np.abs(ripple)
    )


_MOMENTUM, _RESIDUAL, _FORCE, _BEARING, _PRESSED, _EASED, _HELD, _BEGUN = np.cumsum(
    [0, 12, 12, 12, 4, 4, 4, 4]
).tolist()


class TouchMemory:
    """Places in the observer's memory, one flat vector: what a LeafSystem keeps as its state."""

    FORCE, BEARING = slice(_FORCE, _BEARING), slice(_BEARING, _PRESSED)
    HELD = slice(_HELD, _BEGUN)
    SIZE = _BEGUN + 1


@jit
def observe(
    memory: FloatArray, now: JointDynamics, mass: float, period: float, settings: TouchSettings
) -> None:
    """One period of the observer, in place.

    Args:
        memory: Memory in the slots of TouchMemory (SIZE,); zeros at first, when all four feet are
            taken to bear.
        now: The dynamics at the end of the period.
        mass: The robot's [kg].
        period: Since the last call [s].
        settings: How it listens.
    """
    momentum, residual = memory[_MOMENTUM:_RESIDUAL], memory[_RESIDUAL:_FORCE]
    force = memory[_FORCE:_BEARING].reshape(4, 3)
    bearing, pressed = memory[_BEARING:_PRESSED], memory[_PRESSED:_EASED]
    eased, held = memory[_EASED:_HELD], memory[_HELD:_BEGUN]
    weight = mass * GRAVITY
    if memory[_BEGUN] == 0.0:
        memory[_BEGUN] = 1.0
        bearing[:] = 1.0
        copy_vector(momentum, now.momentum)
        # The residual begins where it settles, so that feet that stand are not felt landing.
        for k in range(4):
            force[k, 2] = 0.25 * weight
            for i in range(3):
                residual[3 * k + i] = now.jacobian[k, 2, i] * force[k, 2]
        return
    # Backward Euler in r: stable for any period, and the residual's own time constant kept.
    for i in range(12):
        gained = now.momentum[i] - momentum[i]
        expected = period * (now.torque[i] + now.velocity_terms[i])
        residual[i] += (gained - expected) / settings.time
        residual[i] /= 1.0 + period / settings.time
        momentum[i] = now.momentum[i]
    found, uncertain = foot_forces(residual, now.jacobian, force, now.uncertainty)
    copy_matrix(force, found)
    for k in range(4):
        share = force[k, 2] / weight
        # A leg that comes down is held up by its joints' friction, as if the ground pressed on it;
        # to one that lifts friction is a pull, and it leaves as if there were none.
        times = (share - uncertain[k] / weight) / settings.touch
        pressed[k] = pressed[k] + period * times if times > 1.0 else 0.0
        eased[k] = eased[k] + period if share < settings.leave else 0.0
        held[k] = held[k] + period if bearing[k] == 1.0 else 0.0
        if bearing[k] == 0.0 and pressed[k] >= settings.confirm - 1e-9:
            bearing[k] = 1.0
        elif bearing[k] == 1.0 and held[k] >= settings.hold - 1e-9:
            bearing[k] = 0.0 if eased[k] >= settings.confirm_leave - 1e-9 else 1.0


@jit
def update_observer(
    memory: FloatArray,
    before: FloatArray,
    M: FloatArray,
    bias: FloatArray,
    state: FloatArray,
    torque: FloatArray,
    period: float,
    robot: ObserverModel,
    settings: TouchSettings,
) -> None:
    """One period of the observer, from a robot's state and the torques of its drives.

    Args:
        memory: Goes on by a period, see `observe`.
        before: Goes on by a period, see `joint_dynamics`.
        M: The model's mass matrix (n, n).
        bias: Its Coriolis terms (n,).
        state: [q; v].
        torque: Torque of each drive, leg by leg (12,) [Nm].
        period: Since the last call [s].
        robot: What is known of the robot.
        settings: How it listens.
    """
    now = joint_dynamics(M, bias, state, torque, before, period, robot)
    observe(memory, now, robot.mass, period, settings)


@jit
def foot_forces(
    residual: FloatArray, jacobian: FloatArray, before: FloatArray, uncertainty: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The forces on the feet that the legs' residuals are of, and how uncertain the vertical is.

    A leg stretched out cannot tell what pushes along it: there its force stays as it was.

    Args:
        residual: J^T f of the joints, leg by leg (12,) [Nm].
        jacobian: Jacobian of each foot in W (4, 3, 3) [m].
        before: The forces a period ago (4, 3) [N].
        uncertainty: By how much each residual may be off, either way (12,) [Nm].

    Returns:
        The forces in W (4, 3) [N], and by how much their vertical parts may be off (4,) [N]: by
        nothing that is known where the force stays as it was.
    """
    force, uncertain = before.copy(), np.zeros(4)
    for k in range(4):
        U, sizes, V = np.linalg.svd(jacobian[k])
        if sizes[2] <= WELL_CONDITIONED * sizes[0]:
            continue
        for i in range(3):
            force[k, i] = 0.0
        for j in range(3):
            for i in range(3):  # in the place (j, i) of the Jacobian's inverse
                inverse = 0.0
                for n in range(3):
                    inverse += V[n, j] * U[i, n] / sizes[n]
                force[k, i] += inverse * residual[3 * k + j]
                if i == 2:
                    uncertain[k] += abs(inverse) * uncertainty[3 * k + j]
    return force, uncertain
