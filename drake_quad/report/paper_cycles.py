"""A cycle of each of the paper's gaits, seen in the body frame B, the body at constant speed."""

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import BoolArray, FloatArray
from drake_quad.gait.schedule import ContactTable, spin_table, wave_table
from drake_quad.gait.workspace import Workspace, spin_middles
from drake_quad.math.quintic import quintic
from drake_quad.stability.support_polygon import stability_margins

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
    table = wave_table(duty_factor=duty_factor, cycle_time=1.0)
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
    table = spin_table(duty_factor=duty_factor, cycle_time=1.0, sense=sense)
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
    phases, standing = _switches(wave_table(duty_factor=duty_factor, cycle_time=1.0))
    feet = wave_feet(workspace, stride=stride, duty_factor=duty_factor, phases=phases)
    return _least_margin(feet, standing)


def spin_margin(workspace: Workspace, *, phi: float, duty_factor: float) -> float:
    """Returns the least static margin of a cycle of the spinning gait [m], legs massless."""
    phases, standing = _switches(spin_table(duty_factor=duty_factor, cycle_time=1.0))
    feet = spin_feet(workspace, phi=phi, duty_factor=duty_factor, phases=phases)
    return _least_margin(feet, standing)


def _since_lift_off(table: ContactTable, phases: ArrayLike) -> tuple[FloatArray, BoolArray]:
    """Returns (N, 4) each: time since each leg's last lift-off, and whether it still swings."""
    since = (np.asarray(phases, dtype=float).reshape(-1, 1) - table.lift_off) % 1.0
    since = np.where(since > 1.0 - _EITHER_SIDE / 2.0, 0.0, since)
    return since, since < 1.0 - table.duty_factor


def _switches(table: ContactTable) -> tuple[FloatArray, BoolArray]:
    """Returns phases (N,) through a cycle, dense at the switches, and who stands then (N, 4)."""
    switches = np.ravel([[start, end] for _, start, end in table.swing_intervals()])
    phases = np.concatenate(
        [np.linspace(0.0, 1.0, 401), switches + _EITHER_SIDE, switches - _EITHER_SIDE]
    )
    return phases, table.standings(phases)


def _least_margin(feet: FloatArray, standing: BoolArray) -> float:
    """Returns the least margin of the body's centre over the standing feet (N, 4, 2) in B [m]."""
    return float(stability_margins(np.zeros((len(feet), 2)), feet, standing).min())
