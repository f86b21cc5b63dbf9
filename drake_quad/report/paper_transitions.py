"""The paper's transitions (Figs. 3 and 7), and the other ways to make them."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait.transition import (
    Transition,
    enumerate_transitions,
    follow_transition,
    plan_transition,
)
from drake_quad.gait.workspace import (
    initial_configuration,
    spin_cycles,
    spin_desired_configuration,
    spin_phi_max,
    wave_desired_configuration,
)
from drake_quad.report.paper_study import TABLE_I
from drake_quad.robot.legs import Leg

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
