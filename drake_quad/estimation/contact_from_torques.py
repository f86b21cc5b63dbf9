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

from dataclasses import dataclass, field

import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.jit import jit

WELL_CONDITIONED = 0.05  # of its greatest singular value that a leg's Jacobian's least must be


@dataclass(frozen=True, kw_only=True)
class TouchSettings:
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
    touch: float = 0.02
    leave: float = 0.005
    confirm: float = 0.02
    confirm_leave: float = 0.012
    hold: float = 0.12


@dataclass(frozen=True, eq=False, kw_only=True)
class JointDynamics:
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
    uncertainty: FloatArray = field(default_factory=lambda: np.zeros(12))


def torque_ripple(
    speed: FloatArray, speed_before: FloatArray, *, kp: float, kd: float, period: float
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


class TouchMemory:
    """Places in the observer's memory, one flat vector: what a LeafSystem keeps as its state."""

    MOMENTUM, RESIDUAL, FORCE = slice(0, 12), slice(12, 24), slice(24, 36)
    BEARING, PRESSED, EASED, HELD = slice(36, 40), slice(40, 44), slice(44, 48), slice(48, 52)
    BEGUN = 52
    SIZE = 53


def observe(memory: FloatArray, now: JointDynamics, mass: float, period: float,
            settings: TouchSettings) -> None:  # fmt: skip
    """One period of the observer, in place.

    Args:
        memory: Memory in the slots of TouchMemory (SIZE,); zeros at first, when all four feet are
            taken to bear.
        now: The dynamics at the end of the period.
        mass: The robot's [kg].
        period: Since the last call [s].
        settings: How it listens.
    """
    m = TouchMemory
    if memory[m.BEGUN] == 0.0:
        memory[m.BEGUN], memory[m.MOMENTUM], memory[m.BEARING] = 1.0, now.momentum, 1.0
        memory[m.FORCE] = np.tile([0.0, 0.0, 0.25 * mass * GRAVITY], 4)
        # The residual begins where it settles, so that feet that stand are not felt landing.
        force = memory[m.FORCE].reshape(4, 3)
        memory[m.RESIDUAL] = np.einsum("kji,kj->ki", now.jacobian, force).ravel()
        return
    # Backward Euler in r: stable for any period, and the residual's own time constant kept.
    gained = now.momentum - memory[m.MOMENTUM]
    expected = period * (now.torque + now.velocity_terms)
    residual = (memory[m.RESIDUAL] + (gained - expected) / settings.time) / (
        1.0 + period / settings.time
    )
    memory[m.MOMENTUM], memory[m.RESIDUAL] = now.momentum, residual
    force = memory[m.FORCE].reshape(4, 3)
    force[:], uncertain = foot_forces(residual, now.jacobian, force, now.uncertainty)
    share = force[:, 2] / (mass * GRAVITY)
    # A leg that comes down is held up by its joints' friction, as if the ground pressed on it; to
    # one that lifts friction is a pull, and it leaves as if there were none.
    surely = share - uncertain / (mass * GRAVITY)
    bearing, pressed, eased = memory[m.BEARING], memory[m.PRESSED], memory[m.EASED]
    held = memory[m.HELD]
    for k in range(4):
        times = surely[k] / settings.touch
        pressed[k] = pressed[k] + period * times if times > 1.0 else 0.0
        eased[k] = eased[k] + period if share[k] < settings.leave else 0.0
        held[k] = held[k] + period if bearing[k] == 1.0 else 0.0
        if bearing[k] == 0.0 and pressed[k] >= settings.confirm - 1e-9:
            bearing[k] = 1.0
        elif bearing[k] == 1.0 and held[k] >= settings.hold - 1e-9:
            bearing[k] = 0.0 if eased[k] >= settings.confirm_leave - 1e-9 else 1.0


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
        _, sizes, _ = np.linalg.svd(jacobian[k])
        if sizes[2] <= WELL_CONDITIONED * sizes[0]:
            continue
        inverse = np.linalg.inv(jacobian[k])
        for i in range(3):
            force[k, i] = 0.0
            for j in range(3):
                force[k, i] += inverse[j, i] * residual[3 * k + j]
            uncertain[k] += abs(inverse[i, 2]) * uncertainty[3 * k + i]
    return force, uncertain


# ------------------------------------------------------------------------------------------------
# How good it is: touchdowns felt, beside those that were.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TouchFigures:
    """Touchdowns felt beside those that were, of all four feet.

    Attributes:
        touchdowns: How many there were.
        missed: How many of them were not felt within the window.
        false: How many were felt that were none.
        delays: How much later the others were felt [s]; negative if earlier.
    """

    touchdowns: int
    missed: int
    false: int
    delays: tuple[float, ...]


def compare_touchdowns(
    times: FloatArray, real: BoolArray, felt: BoolArray, *, swing: float = 0.15,
    still: float = 0.05, brush: float = 0.02, window: float = 0.15,
) -> TouchFigures:  # fmt: skip
    """Compares touchdowns felt with those that were.

    A touchdown is where a foot begins to bear, for `brush` at least, that has not borne for
    `swing`: one that bounces has landed once, one that brushes a riser has not. Felt too early by
    more than `window`, a touchdown is both missed and false.

    Args:
        times: Times of the samples (N,) [s].
        real: Which feet bear (N, 4).
        felt: Which are felt to bear (N, 4).
        swing: How long a foot must have been off the ground before [s].
        still: How long a foot must not have been felt before, for it to be felt landing; as long
            a bounce must last for its end to excuse that [s].
        brush: How long a foot must bear for it to be more than a brush against a riser [s].
        window: How far apart the two may be to be the same [s].
    """
    count = missed = false = 0
    delays: list[float] = []
    for foot in range(real.shape[1]):
        landed = _landings(times, _lasting(times, real[:, foot], brush), swing)
        bounced = [t for t in _landings(times, real[:, foot], still) if t not in landed]
        noticed = _landings(times, felt[:, foot], still)
        late, rest = _pair(landed, noticed, window)
        count += len(landed)
        missed += len(landed) - len(late)
        delays += late
        false += len(_pair(bounced, rest, window)[1])
    return TouchFigures(count, missed, false, tuple(delays))


def _pair(
    places: list[float], noticed: list[float], window: float
) -> tuple[list[float], list[float]]:
    """How much later each place was noticed, of those that were; and what was noticed besides."""
    late, rest = [], list(noticed)
    for t in places:
        nearest = min(rest, key=lambda n: abs(n - t), default=np.inf)
        if abs(nearest - t) <= window:
            late.append(nearest - t)
            rest.remove(nearest)
    return late, rest


def _lasting(times: FloatArray, bears: BoolArray, least: float) -> BoolArray:
    """The same without what lasts less than `least`, but for what goes on at the end."""
    starts = np.flatnonzero(np.diff(bears.astype(np.int8), prepend=0) > 0)
    ends = np.flatnonzero(np.diff(bears.astype(np.int8)) < 0) + 1
    kept = bears.copy()
    for start, end in zip(starts, ends, strict=False):
        if times[end] - times[start] < least - 1e-9:
            kept[start:end] = False
    return kept


def _landings(times: FloatArray, bears: BoolArray, still: float) -> list[float]:
    """When a foot begins to bear that has not for `still`."""
    changes = np.flatnonzero(np.diff(bears.astype(np.int8)))
    found, left = [], None
    for k in changes:
        if not bears[k]:
            if left is not None and times[k + 1] - left >= still:
                found.append(float(times[k + 1]))
        else:
            left = times[k + 1]
    return found
