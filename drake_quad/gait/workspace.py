"""The legs' workspaces, and where the feet are in them as a cycle of each gait begins.

The wave gait's part is section II-A and Fig. 2, the spinning gait's section II-B, equations (4)
to (9) and Figs. 6 and 8. All positions are horizontal, in the body frame B [m].
"""

from dataclasses import dataclass
from math import acos, asin, atan2, ceil, cos, hypot, pi, sin, sqrt, tau

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.gait.schedule import spin_schedule, wave_schedule
from drake_quad.robot.legs import SIGNS

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Workspace:
    """Boxes, one a leg, in which the feet may be; see the paper's Figs. 2 and 8.

    Args:
        R_x: Length of each box along x [m].
        R_y: Width of each box along y [m].
        P_x: Distance between the centres of the front and the rear boxes [m].
        P_y: Distance between the centres of the left and the right boxes [m].

    Raises:
        ValueError: A dimension is not positive.
    """

    R_x: float
    R_y: float
    P_x: float
    P_y: float

    def __post_init__(self) -> None:
        if not min(self.R_x, self.R_y, self.P_x, self.P_y) > 0.0:
            raise ValueError(f"{self}: every dimension must be positive")

    @property
    def centres(self) -> FloatArray:
        """(4, 2), the boxes' centres: the paper's initial configuration."""
        return read_only(SIGNS * (self.P_x / 2.0, self.P_y / 2.0))

    @property
    def half_size(self) -> FloatArray:
        """(2,), half of each box's length and width."""
        return read_only(np.array([self.R_x / 2.0, self.R_y / 2.0]))

    def contains(self, feet: FloatArray, tol: float = _ROUNDING) -> bool:
        """Returns whether all feet, (4, 2), are in their boxes, within tol [m]."""
        return bool(np.all(np.abs(np.asarray(feet) - self.centres) <= self.half_size + tol))


PAPER_WORKSPACE = Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54)
"""Table I."""


def initial_configuration(workspace: Workspace) -> FloatArray:
    """Returns (4, 2): each foot at the centre of its workspace."""
    return workspace.centres


def wave_desired_configuration(
    workspace: Workspace, *, stroke: float, duty_factor: float, heading: int = 1
) -> FloatArray:
    """Returns (4, 2), where the feet are as a cycle of the wave gait begins (Fig. 2).

    A standing foot moves against the heading, by `stroke` in beta of the cycle, and lifts at its
    kinematic limit: one that lifts at the fraction f is still f / beta of a stroke short of it.

    Args:
        workspace: The legs' boxes; strokes are centred in them.
        stroke: R [m], a foot's travel in B while it stands.
        duty_factor: beta.
        heading: +1 walks forward, -1 backward.
    """
    table = wave_schedule(duty_factor=duty_factor, cycle_time=1.0, heading=heading)
    feet = np.array(workspace.centres)
    feet[:, 0] += heading * stroke * (table.lift_off / duty_factor - 0.5)
    return read_only(feet)


def spin_arc(workspace: Workspace) -> tuple[float, float]:
    """Returns the polar angles (lo, hi) [rad] of the front left foot's longest arc.

    It is the part, inside that leg's box, of the circle about the body's centre through the box's
    centre, through whichever edges it leaves. Equations (4) to (6) are the case in which it
    leaves through both of the long edges (`paper_spin_angle`).
    """
    x, y = workspace.P_x / 2.0, workspace.P_y / 2.0
    radius, middle = hypot(x, y), atan2(y, x)
    crossings = []
    for side in (-0.5, 0.5):
        edge_x, edge_y = x + side * workspace.R_x, y + side * workspace.R_y
        if abs(edge_x) <= radius:
            crossings += [acos(edge_x / radius), -acos(edge_x / radius)]
        if abs(edge_y) <= radius:
            crossings += [asin(edge_y / radius), pi - asin(edge_y / radius)]
    reach_x, reach_y = workspace.R_x / 2.0 + _ROUNDING, workspace.R_y / 2.0 + _ROUNDING
    leaving = [
        angle
        for angle in crossings
        if abs(radius * cos(angle) - x) <= reach_x and abs(radius * sin(angle) - y) <= reach_y
    ]
    ahead = [(angle - middle) % tau for angle in leaving] or [pi]
    behind = [(middle - angle) % tau for angle in leaving] or [pi]
    return middle - min(behind), middle + min(ahead)


def spin_phi_max(workspace: Workspace) -> float:
    """Returns the longest arc [rad] that every foot can travel in its box while it stands."""
    lo, hi = spin_arc(workspace)
    return hi - lo


def paper_spin_angle(workspace: Workspace) -> float:
    """Returns phi [rad] by equations (4) to (6), literally.

    They hold where the circle leaves the box through both of its long edges.

    Raises:
        ValueError: The square root in (5) or (6) is of a negative number, as it is in (6) with
            Table I: the circle never reaches that edge.
    """
    R_y, P_x, P_y = workspace.R_y, workspace.P_x, workspace.P_y
    inner = P_x**2 + 2.0 * P_y * R_y - R_y**2
    outer = P_x**2 - 2.0 * P_y * R_y - R_y**2
    if inner < 0.0 or outer < 0.0:
        raise ValueError(
            "the foot's circle does not meet both long edges of the workspace: the squares in "
            f"equations (5) and (6) are {inner:.6g} and {outer:.6g} m^2"
        )
    delta = atan2(P_y - R_y, sqrt(inner))
    gamma = atan2(sqrt(outer), P_y + R_y)
    return pi / 2.0 - (delta + gamma)


def spin_stroke(workspace: Workspace, phi: float, delta: float) -> tuple[float, float]:
    """Returns (s_x, s_y) [m], equation (7): a swing over the arc phi from the angle delta [rad]."""
    radius = hypot(workspace.P_x, workspace.P_y) / 2.0
    return radius * (cos(delta + phi) - cos(delta)), radius * (sin(delta + phi) - sin(delta))


def body_turn(duty_factor: float, phi: float) -> tuple[float, float]:
    """Returns the body's turn [rad] in a swing, eq. (8), and in an all-feet interval, eq. (9)."""
    return (1.0 / duty_factor - 1.0) * phi, (2.0 - 1.5 / duty_factor) * phi


def spin_cycles(angle: float, duty_factor: float, phi_max: float) -> tuple[int, float]:
    """Returns the fewest whole cycles that turn the body by `angle`, and their phi [rad].

    A cycle turns the body by phi / beta.

    Args:
        angle: The body's turn [rad]; its sign does not matter.
        duty_factor: beta.
        phi_max: The longest arc of a foot [rad], see `spin_phi_max`.
    """
    arc = abs(angle) * duty_factor
    cycles = ceil(arc / phi_max - _ROUNDING)
    return cycles, arc / max(cycles, 1)


def spin_middles(workspace: Workspace) -> FloatArray:
    """Returns (4,), the polar angle in B of the middle of each foot's longest arc [rad]."""
    lo, hi = spin_arc(workspace)
    middle = (lo + hi) / 2.0
    return read_only(np.arctan2(SIGNS[:, 1] * sin(middle), SIGNS[:, 0] * cos(middle)))


def spin_desired_configuration(
    workspace: Workspace, *, phi: float, duty_factor: float, sense: int = 1
) -> FloatArray:
    """Returns (4, 2), where the feet are as a cycle of the spinning gait begins (Fig. 6).

    A standing foot turns against the body's sense, by phi in beta of the cycle, and lifts at the
    end of its arc: one that lifts at the fraction f is still phi f / beta short of that end. The
    arcs used are centred on the longest arcs that the workspaces allow, not on their centres,
    so that every phi up to `spin_phi_max` fits.

    Args:
        workspace: The legs' boxes.
        phi: Each foot's arc [rad].
        duty_factor: beta.
        sense: +1 turns the body counterclockwise, -1 clockwise.
    """
    table = spin_schedule(duty_factor=duty_factor, cycle_time=1.0, sense=sense)
    angles = spin_middles(workspace) + sense * phi * (table.lift_off / duty_factor - 0.5)
    radius = hypot(workspace.P_x, workspace.P_y) / 2.0
    return read_only(radius * np.column_stack([np.cos(angles), np.sin(angles)]))
