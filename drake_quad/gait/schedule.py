"""Who stands when: the wave and spinning gaits, and the trot, as tables of lift-off times.

Fractions are of the cycle time T. A leg is in the air on the half-open interval
[lift-off, touchdown), which lasts (1 - beta) T for the duty factor beta, so at the instant at
which one leg touches down and the next lifts only the latter counts as in the air.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.robot.legs import (
    DIAGONALS,
    LEGS,
    SPIN_ORDER_CLOCKWISE,
    SPIN_ORDER_COUNTERCLOCKWISE,
    WAVE_ORDER,
    Leg,
)

_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class GaitSchedule:
    """A periodic gait's contact schedule with at most one leg in the air.

    Args:
        cycle_time: T [s].
        duty_factor: beta, the part of a cycle for which each leg stands.
        lift_off: (4,) one row a leg: when it lifts, as a fraction of the cycle in [0, 1).
        order: The legs in the order in which they lift.

    Raises:
        ValueError: Two legs would be in the air at once, a swing would run past the cycle's end,
            or `order` is not the order of `lift_off`.
    """

    cycle_time: float
    duty_factor: float
    lift_off: FloatArray
    order: tuple[Leg, ...]

    def __post_init__(self) -> None:
        _check(self.cycle_time, self.duty_factor)
        object.__setattr__(self, "lift_off", read_only(self.lift_off))
        if self.lift_off.shape != (4,) or sorted(self.order) != list(LEGS):
            raise ValueError("a contact table needs one lift-off and one place in the order a leg")
        lifts = [float(self.lift_off[leg.row]) for leg in self.order]
        gaps = [end - start for start, end in pairwise([*lifts, 1.0])]
        if lifts[0] < 0.0 or min(gaps) < 1.0 - self.duty_factor - _ROUNDING:
            raise ValueError(
                f"lift-offs {lifts} in the order {[int(leg) for leg in self.order]} do not leave "
                f"each swing its {1.0 - self.duty_factor:.4g} of the cycle"
            )

    @property
    def swing_time(self) -> float:
        """T_sw = (1 - beta) T [s]."""
        return (1.0 - self.duty_factor) * self.cycle_time

    def swing_intervals(self) -> tuple[tuple[Leg, float, float], ...]:
        """Returns (leg, lift-off, touchdown) [s] of one cycle, in time order, never overlapping."""
        lifts = [float(self.lift_off[leg.row]) * self.cycle_time for leg in self.order]
        ends = [*lifts[1:], self.cycle_time]
        return tuple(
            (leg, lift, min(lift + self.swing_time, end))
            for leg, lift, end in zip(self.order, lifts, ends, strict=True)
        )

    def swing_leg(self, t: float) -> Leg | None:
        """Returns the leg in the air at the gait time t [s] (any sign), None if all stand."""
        swing = self._swing(t)
        return None if swing is None else swing[0]

    def swing_phase(self, t: float) -> float | None:
        """Returns how far the swing is at the gait time t [s], in [0, 1); None if all stand."""
        swing = self._swing(t)
        return None if swing is None else swing[1]

    def standing(self, t: float) -> BoolArray:
        """Returns (4,), one row a leg: whether it stands at the gait time t [s]."""
        stands = np.ones(4, dtype=np.bool_)
        leg = self.swing_leg(t)
        if leg is not None:
            stands[leg.row] = False
        return stands

    def standings(self, times: ArrayLike) -> BoolArray:
        """Returns (N, 4): `standing` at each of the (N,) gait times [s]."""
        return np.array([self.standing(float(t)) for t in np.ravel(times)]).reshape(-1, 4)

    def _swing(self, t: float) -> tuple[Leg, float] | None:
        """Returns the leg in the air at t [s] and its swing phase, None if all stand."""
        # Through swing_intervals' own numbers, so that all of the answers agree at a switch. The
        # modulo of a tiny negative time rounds up to the cycle time itself: that is its start.
        into_cycle = t % self.cycle_time
        if into_cycle >= self.cycle_time:
            into_cycle = 0.0
        for leg, lift, touchdown in self.swing_intervals():
            if lift <= into_cycle < touchdown:
                return leg, min((into_cycle - lift) / (touchdown - lift), np.nextafter(1.0, 0.0))
        return None


def wave_schedule(*, duty_factor: float, cycle_time: float, heading: int = 1) -> GaitSchedule:
    """Returns the continuous wave gait: 1-4-2-3, equally spaced (section II-A).

    Args:
        duty_factor: beta in [3/4, 1).
        cycle_time: T [s].
        heading: +1 walks forward, -1 backward: the same gait with front and rear exchanged.

    Raises:
        ValueError: A parameter is out of its range.
    """
    _check_sign("heading", heading)
    order = WAVE_ORDER if heading > 0 else tuple(leg.reversed for leg in WAVE_ORDER)
    return _table(order, (0.0, 0.25, 0.5, 0.75), duty_factor, cycle_time)


def spin_schedule(*, duty_factor: float, cycle_time: float, sense: int = 1) -> GaitSchedule:
    """Returns the spinning gait: lifts at the paper's t0, t2, t3, t5 (section II-B).

    The two intervals on four feet, [t1, t2] and [t4, t5], last (2 beta - 3/2) T each.

    Args:
        duty_factor: beta in [3/4, 1).
        cycle_time: T [s].
        sense: +1 turns the body counterclockwise (1-3-4-2), -1 clockwise (1-2-4-3).

    Raises:
        ValueError: A parameter is out of its range.
    """
    _check_sign("sense", sense)
    order = SPIN_ORDER_COUNTERCLOCKWISE if sense > 0 else SPIN_ORDER_CLOCKWISE
    return _table(order, (0.0, duty_factor - 0.5, 0.5, duty_factor), duty_factor, cycle_time)


def trot_intervals(
    *, duty_factor: float, cycle_time: float
) -> tuple[tuple[tuple[Leg, ...], float, float], ...]:
    """Returns (legs, lift-off, touchdown) [s] of one cycle of a walking trot, in time order.

    The diagonal pairs swing in turn, half a cycle apart, with (beta - 1/2) T on four feet between.

    Args:
        duty_factor: beta in (1/2, 1).
        cycle_time: T [s].

    Raises:
        ValueError: A parameter is out of its range.
    """
    if not 0.5 < duty_factor < 1.0:
        raise ValueError(
            f"duty_factor = {duty_factor}: must be in (0.5, 1), so that a walking trot has time on "
            "four feet between its swings"
        )
    if not (np.isfinite(cycle_time) and cycle_time > 0.0):
        raise ValueError(f"cycle_time = {cycle_time}: must be a positive time in seconds")
    lasts = (1.0 - duty_factor) * cycle_time
    half = 0.5 * cycle_time
    return tuple((pair, k * half, k * half + lasts) for k, pair in enumerate(DIAGONALS))


def _table(
    order: tuple[Leg, ...], lifts: tuple[float, ...], duty_factor: float, cycle_time: float
) -> GaitSchedule:
    """Returns the table in which the legs of `order` lift at `lifts`."""
    _check(cycle_time, duty_factor)
    lift_off = np.zeros(4)
    for leg, lift in zip(order, lifts, strict=True):
        lift_off[leg.row] = lift
    return GaitSchedule(cycle_time, duty_factor, lift_off, order)


def _check(cycle_time: float, duty_factor: float) -> None:
    """Raises ValueError unless one leg at a time can swing within the cycle."""
    if not 0.75 <= duty_factor < 1.0:
        raise ValueError(
            f"duty_factor = {duty_factor}: must be in [0.75, 1), so that at most one leg swings"
        )
    if not (np.isfinite(cycle_time) and cycle_time > 0.0):
        raise ValueError(f"cycle_time = {cycle_time}: must be a positive time in seconds")


def _check_sign(name: str, value: int) -> None:
    """Raises ValueError unless value is +1 or -1."""
    if value not in (1, -1):
        raise ValueError(f"{name} = {value}: must be +1 or -1")
