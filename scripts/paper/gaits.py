"""The paper's cycles, swings and transitions, and the other ways to make them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import BoolArray, FloatArray
from drake_quad.gait.schedule import GaitSchedule, spin_schedule, wave_schedule
from drake_quad.gait.swing import Swing, paper_swing
from drake_quad.gait.transition import (
    Transition,
    enumerate_transitions,
    follow_transition,
    plan_transition,
)
from drake_quad.gait.workspace import (
    Workspace,
    initial_configuration,
    spin_cycles,
    spin_desired_configuration,
    spin_middles,
    spin_phi_max,
    wave_desired_configuration,
)
from drake_quad.math.curves import quintic, quintic_inverse
from drake_quad.robot.legs import Leg
from drake_quad.stability.support_polygon import stability_margins
from paper.study import TABLE_I

# ------------------------------------------------------------------------------------------------
# A cycle of each of the paper's gaits, seen in the body frame B, the body at constant speed.
# ------------------------------------------------------------------------------------------------


_EITHER_SIDE = 1e-9  # of a cycle: switches are looked at just before and just after


def wave_feet(
    workspace: Workspace, *, stride: float, duty_factor: float, phases: ArrayLike
) -> FloatArray:
    """Returns (N, 4, 2), the feet in B in a cycle of the wave gait [m].

    A standing foot travels backward at the body's speed. A swing is equation (1) over the
    ground, from rest to rest, so that in B the foot at first still goes backward.

    Args:
        workspace: The legs' boxes, in which strokes are centred.
        stride: λ [m].
        duty_factor: β.
        phases: (N,) times as fractions of the cycle.
    """
    table = wave_schedule(duty_factor=duty_factor, cycle_time=1.0)
    since, swings = _since_lift_off(table, phases)
    air = 1.0 - duty_factor
    swing_x = stride * (quintic(np.minimum(since / air, 1.0)) - since)
    x = -stride * duty_factor / 2.0 + np.where(swings, swing_x, stride * (1.0 - since))
    feet = np.tile(workspace.centres, (len(since), 1, 1))
    feet[..., 0] += x
    return feet


def spin_angles(*, phi: float, duty_factor: float, phases: ArrayLike, sense: int = 1) -> FloatArray:
    """Returns (N, 4), the feet's angles from their arcs' middles in a cycle of a spin [rad].

    A swing is from rest to rest over the ground, as equation (1) is in the wave gait; section II-B
    does not say over what. Relative to the body the foot at first still goes back.

    Args:
        phi: Each foot's arc [rad].
        duty_factor: β.
        phases: (N,) times as fractions of the cycle.
        sense: +1 turns the body counterclockwise, -1 clockwise.
    """
    table = spin_schedule(duty_factor=duty_factor, cycle_time=1.0, sense=sense)
    since, swings = _since_lift_off(table, phases)
    air = 1.0 - duty_factor
    forward = phi / duty_factor * (quintic(np.minimum(since / air, 1.0)) - since)
    back = phi / duty_factor * (1.0 - since)
    return np.asarray(sense * (np.where(swings, forward, back) - phi / 2.0))


def spin_feet(
    workspace: Workspace, *, phi: float, duty_factor: float, phases: ArrayLike, sense: int = 1
) -> FloatArray:
    """Returns (N, 4, 2), the feet in B in a cycle of the spinning gait [m]; see `spin_angles`."""
    angles = spin_middles(workspace) + spin_angles(
        phi=phi, duty_factor=duty_factor, phases=phases, sense=sense
    )
    radius = np.hypot(workspace.P_x, workspace.P_y) / 2.0
    return np.asarray(radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1))


def wave_margin(workspace: Workspace, *, stride: float, duty_factor: float) -> float:
    """Returns the least static margin of a cycle of the wave gait [m], legs massless, no sway."""
    phases, standing = _switches(wave_schedule(duty_factor=duty_factor, cycle_time=1.0))
    feet = wave_feet(workspace, stride=stride, duty_factor=duty_factor, phases=phases)
    return _least_margin(feet, standing)


def spin_margin(workspace: Workspace, *, phi: float, duty_factor: float) -> float:
    """Returns the least static margin of a cycle of the spinning gait [m], legs massless."""
    phases, standing = _switches(spin_schedule(duty_factor=duty_factor, cycle_time=1.0))
    feet = spin_feet(workspace, phi=phi, duty_factor=duty_factor, phases=phases)
    return _least_margin(feet, standing)


def _since_lift_off(table: GaitSchedule, phases: ArrayLike) -> tuple[FloatArray, BoolArray]:
    """Returns (N, 4) each: time since each leg's last lift-off, and whether it still swings."""
    since = (np.asarray(phases, dtype=float).reshape(-1, 1) - table.lift_off) % 1.0
    since = np.where(since > 1.0 - _EITHER_SIDE / 2.0, 0.0, since)
    return since, since < 1.0 - table.duty_factor


def _switches(table: GaitSchedule) -> tuple[FloatArray, BoolArray]:
    """Returns phases (N,) through a cycle, dense at the switches, and who stands then (N, 4)."""
    switches = np.ravel([[start, end] for _, start, end in table.swing_intervals()])
    phases = np.concatenate(
        [np.linspace(0.0, 1.0, 401), switches + _EITHER_SIDE, switches - _EITHER_SIDE]
    )
    return phases, table.standings(phases)


def _least_margin(feet: FloatArray, standing: BoolArray) -> float:
    """Returns the least margin of the body's centre over the standing feet (N, 4, 2) in B [m]."""
    return float(stability_margins(np.zeros((len(feet), 2)), feet, standing).min())


# ------------------------------------------------------------------------------------------------
# The paper's swing leg on stairs (Fig. 5): two risers under one swing.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class StairSwing:
    """A swing over two risers, from and to the middle of a tread.

    Attributes:
        swing: Equations (1) to (3), of a point foot.
        nosings: (2, 2) rows (x, z) of the two nosings passed, in order [m].
        chosen: Which of the two is d_s, h_s of the equations.
    """

    swing: Swing
    nosings: FloatArray
    chosen: int

    @property
    def heights(self) -> FloatArray:
        """(2,) height of the foot over each nosing as it passes [m]; negative is through it."""
        x_f = self.swing.p_end[0]
        times = [self.swing.duration * quintic_inverse(x / x_f) for x in self.nosings[:, 0]]
        return np.asarray(self.swing.positions(times)[:, 2] - self.nosings[:, 1])

    @property
    def nearest(self) -> float:
        """Least distance of the foot's path from a nosing [m]."""
        path = self.swing.positions(np.linspace(0.0, self.swing.duration, 4001))[:, [0, 2]]
        apart = np.linalg.norm(path[:, None] - self.nosings, axis=-1)
        return float(apart.min())


def stair_swing(*, going: int, chosen: int) -> StairSwing:
    """Returns the swing with Table I's values.

    Args:
        going: +1 up, -1 down.
        chosen: The riser that d_s and h_s belong to: 0 the first, 1 the last.
    """
    W, H = TABLE_I.W, TABLE_I.H
    z = np.array([1.0, 2.0]) if going > 0 else np.array([0.0, -1.0])
    nosings = np.column_stack([[0.5 * W, 1.5 * W], H * z])
    swing = paper_swing(
        x_f=2.0 * W,
        z_f=2.0 * H * going,
        duration=TABLE_I.swing_time,
        d_s=float(nosings[chosen, 0]),
        h_s=float(nosings[chosen, 1]),
        delta_h=TABLE_I.delta_h,
    )
    return StairSwing(swing, nosings, chosen)


# ------------------------------------------------------------------------------------------------
# The paper's transitions (Figs. 3 and 7), and the other ways to make them.
# ------------------------------------------------------------------------------------------------


WORKSPACE = TABLE_I.workspace
QUARTER_TURN = np.pi / 2.0
MAX_SHIFT = 0.1  # [m] of the body, along x and along y, where it may move


def quarter_turn_arc() -> tuple[int, float]:
    """Returns the fewest cycles that turn the body by 90° with Table I, and their φ [rad]."""
    return spin_cycles(QUARTER_TURN, TABLE_I.beta, spin_phi_max(WORKSPACE))


def wave_goal() -> FloatArray:
    """Returns (4, 2), the wave gait's desired configuration with Table I [m] (Fig. 2)."""
    return wave_desired_configuration(WORKSPACE, stroke=TABLE_I.stroke, duty_factor=TABLE_I.beta)


def spin_goal() -> FloatArray:
    """Returns (4, 2), the desired configuration for a quarter turn with Table I [m] (Fig. 6)."""
    _, phi = quarter_turn_arc()
    return spin_desired_configuration(WORKSPACE, phi=phi, duty_factor=TABLE_I.beta)


def paper_wave_transition(detour: float | None = None) -> Transition:
    """Returns the paper's own five steps, legs 2-3-4-1-3.

    Args:
        detour: Where leg 3's first step ends, from its workspace's centre along x [m]; the text
            does not say. -R/6 if None: the only place on that line that is stable.
    """
    goal = wave_goal()
    between = np.array(WORKSPACE.centres[Leg(3).row])
    between[0] += -TABLE_I.stroke / 6.0 if detour is None else detour
    moves = [(leg, goal[leg.row]) for leg in (Leg(2), Leg(4), Leg(1), Leg(3))]
    return follow_transition(
        initial_configuration(WORKSPACE), [moves[0], (Leg(3), between), *moves[1:]]
    )


@dataclass(frozen=True, eq=False)
class Alternatives:
    """Ways from the initial configuration to a desired one.

    Attributes:
        still: The best of the fewest steps with the body still.
        shifting: The best of the fewest steps with a body that shifts by at most MAX_SHIFT.
        orders_of_four: Every order of four steps with the body still, the best first.
    """

    still: Transition
    shifting: Transition
    orders_of_four: tuple[Transition, ...]


def find_alternatives(goal: FloatArray) -> Alternatives:
    """Returns the ways from the initial configuration to `goal` (4, 2) [m]."""
    start = initial_configuration(WORKSPACE)
    return Alternatives(
        still=plan_transition(start, goal, workspace=WORKSPACE),
        shifting=plan_transition(
            start, goal, mode="shift", max_shift=MAX_SHIFT, workspace=WORKSPACE
        ),
        orders_of_four=enumerate_transitions(start, goal, steps=4),
    )


def direct_to_spin() -> Transition:
    """Returns the fewest steps from the wave's configuration to the spin's, the body still."""
    return plan_transition(wave_goal(), spin_goal(), workspace=WORKSPACE)
