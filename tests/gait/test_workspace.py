"""Laws of the workspaces and of the desired configurations; the paper's numbers."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import GaitSchedule, spin_schedule, wave_schedule
from drake_quad.gait.workspace import (
    PAPER_WORKSPACE,
    Workspace,
    body_turn,
    initial_configuration,
    paper_spin_angle,
    spin_arc,
    spin_cycles,
    spin_desired_configuration,
    spin_phi_max,
    spin_stroke,
    wave_desired_configuration,
)
from drake_quad.robot.legs import LEGS
from drake_quad.stability.support_polygon import stability_margin

betas = st.floats(0.75, 0.95)
# Boxes that do not reach across the body's middle planes.
workspaces = st.builds(
    lambda P_x, P_y, x, y: Workspace(R_x=x * P_x, R_y=y * P_y, P_x=P_x, P_y=P_y),
    st.floats(0.3, 1.2),
    st.floats(0.2, 1.0),
    st.floats(0.1, 0.95),
    st.floats(0.1, 0.95),
)


def spin_feet(
    workspace: Workspace, table: GaitSchedule, phi: float, sense: int, t: float
) -> FloatArray:
    """The feet in B at the fraction t of a cycle: each leg stands, then swings back by phi."""
    feet = spin_desired_configuration(
        workspace, phi=phi, duty_factor=table.duty_factor, sense=sense
    ).copy()
    for leg in LEGS:
        since_lift = t - table.lift_off[leg.row]
        turn = -sense * phi / table.duty_factor * t
        if since_lift > 0.0:  # the swing makes up for a whole cycle's turn, here at a steady rate
            share = min(since_lift / (1.0 - table.duty_factor), 1.0)
            turn += sense * phi / table.duty_factor * share
        c, s = np.cos(turn), np.sin(turn)
        feet[leg.row] = np.array([[c, -s], [s, c]]) @ feet[leg.row]
    return feet


@given(workspaces)
def test_initial_configuration_is_symmetric_and_central(workspace: Workspace) -> None:
    """Each foot is in the middle of its box, mirrored left to right and front to rear."""
    feet = initial_configuration(workspace)
    assert workspace.contains(feet)
    for leg in LEGS:
        assert feet[leg.mirrored.row].tolist() == (feet[leg.row] * (1, -1)).tolist()
        assert feet[leg.reversed.row].tolist() == (feet[leg.row] * (-1, 1)).tolist()
    assert not workspace.contains(feet + np.array([0.5001 * workspace.R_x, 0.0]))
    assert not workspace.contains(feet + np.array([0.0, 0.5001 * workspace.R_y]))


@given(workspaces, betas, st.sampled_from([1, -1]))
def test_wave_uses_exactly_its_stroke(workspace: Workspace, beta: float, heading: int) -> None:
    """Walking at R/beta a cycle, each foot reaches its limit of -R/2 just as it lifts."""
    stroke = 0.9 * workspace.R_x
    feet = wave_desired_configuration(workspace, stroke=stroke, duty_factor=beta, heading=heading)
    table = wave_schedule(duty_factor=beta, cycle_time=1.0, heading=heading)
    at_lift = (feet - workspace.centres)[:, 0] - heading * stroke / beta * table.lift_off
    assert at_lift == pytest.approx(-heading * stroke / 2.0)
    assert workspace.contains(feet)
    assert (feet[:, 1] == workspace.centres[:, 1]).all()


@given(workspaces, betas)
def test_walking_backward_begins_from_the_mirror_image(workspace: Workspace, beta: float) -> None:
    """The desired configuration for walking backward is that for forward, front for rear."""
    stroke = 0.5 * workspace.R_x
    forward = wave_desired_configuration(workspace, stroke=stroke, duty_factor=beta)
    backward = wave_desired_configuration(workspace, stroke=stroke, duty_factor=beta, heading=-1)
    for leg in LEGS:
        assert backward[leg.reversed.row] == pytest.approx(forward[leg.row] * (-1.0, 1.0))


def test_wave_offsets_of_table_one() -> None:
    """At beta = 3/4 legs 1, 4, 2, 3 begin at -R/2, -R/6, R/6, R/2 from their centres."""
    feet = wave_desired_configuration(PAPER_WORKSPACE, stroke=0.75, duty_factor=0.75)
    offsets = (feet - PAPER_WORKSPACE.centres)[[0, 3, 1, 2], 0]
    assert offsets == pytest.approx([-0.375, -0.125, 0.125, 0.375])
    assert feet[:, 0] == pytest.approx([0.025, 0.525, -0.025, -0.525])
    # Level walking in phase with the stairs: all footprints within 25 mm of a tread's centre.
    modulo = (feet[:, 0] + 0.25) % 0.5 - 0.25
    assert np.abs(modulo).max() == pytest.approx(0.025)


@given(workspaces)
@settings(max_examples=50)
def test_spin_arc_is_the_longest_inside_the_box(workspace: Workspace) -> None:
    """The arc stays in the box and leaves it at both ends."""
    lo, hi = spin_arc(workspace)
    radius = np.hypot(workspace.P_x, workspace.P_y) / 2.0
    angles = np.array([*np.linspace(lo, hi, 50), lo - 1e-4, hi + 1e-4])
    arc = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    beyond = np.abs(arc - workspace.centres[0]) - workspace.half_size
    assert (beyond[:50] <= 1e-8).all()
    assert (beyond[50:] > 0.0).any(axis=1).all()


def test_spin_arc_of_table_one() -> None:
    """With Table I the arc runs from 2.375 to 87.625 degrees, and equation (6) does not hold."""
    assert np.degrees(spin_arc(PAPER_WORKSPACE)) == pytest.approx([2.375, 87.625], abs=5e-4)
    assert np.degrees(spin_phi_max(PAPER_WORKSPACE)) == pytest.approx(85.25, abs=5e-4)
    with pytest.raises(ValueError, match=r"-0\.15"):
        paper_spin_angle(PAPER_WORKSPACE)


def test_papers_angle_where_its_assumption_holds() -> None:
    """With R_y = 0.3 the circle meets both long edges: equations (4) to (6) are the arc."""
    workspace = Workspace(R_x=0.76, R_y=0.3, P_x=0.8, P_y=0.54)
    assert paper_spin_angle(workspace) == pytest.approx(spin_phi_max(workspace), abs=1e-12)


@given(workspaces)
def test_papers_angle_is_the_general_one_wherever_the_circle_leaves_through_long_edges(
    workspace: Workspace,
) -> None:
    """Equations (4) to (6) are the special case of an arc between the two long edges."""
    lo, hi = spin_arc(workspace)
    radius = np.hypot(workspace.P_x, workspace.P_y) / 2.0
    edges = (workspace.P_y + np.array([-1.0, 1.0]) * workspace.R_y) / 2.0
    assume(np.allclose(radius * np.sin([lo, hi]), edges, atol=1e-12))
    assert paper_spin_angle(workspace) == pytest.approx(hi - lo, abs=1e-6)


@given(workspaces, betas, st.floats(0.1, 1.0), st.sampled_from([1, -1]), st.floats(0.0, 1.0))
def test_feet_stay_in_their_boxes_through_a_spin_and_end_where_they_began(
    workspace: Workspace, beta: float, share: float, sense: int, t: float
) -> None:
    """Any phi up to the largest keeps every foot in its box; a cycle closes."""
    phi = share * spin_phi_max(workspace)
    table = spin_schedule(duty_factor=beta, cycle_time=1.0, sense=sense)
    assert workspace.contains(spin_feet(workspace, table, phi, sense, t), tol=1e-8)
    desired = spin_desired_configuration(workspace, phi=phi, duty_factor=beta, sense=sense)
    assert spin_feet(workspace, table, phi, sense, 1.0) == pytest.approx(desired)


@given(workspaces, st.floats(0.1, 1.0), st.floats(0.0, 0.999))
def test_left_right_mirror_turns_counterclockwise_into_clockwise(
    workspace: Workspace, share: float, t: float
) -> None:
    """At beta = 3/4 the clockwise spin is the mirror image, a quarter of a cycle later.

    Later, because the paper begins both with leg 1, and the mirror image begins with leg 2.
    """
    phi = share * spin_phi_max(workspace)
    left = spin_schedule(duty_factor=0.75, cycle_time=1.0, sense=1)
    right = spin_schedule(duty_factor=0.75, cycle_time=1.0, sense=-1)
    rows = [leg.mirrored.row for leg in LEGS]
    mirrored = spin_feet(workspace, left, phi, 1, t)[rows] * np.array([1.0, -1.0])
    clockwise = spin_feet(workspace, right, phi, -1, (t + 0.25) % 1.0)
    assert clockwise == pytest.approx(mirrored, abs=1e-9)


@given(workspaces, betas, st.floats(0.1, 1.0))
@settings(max_examples=50)
def test_both_senses_are_equally_stable(workspace: Workspace, beta: float, share: float) -> None:
    """Above beta = 3/4 the intervals on four feet fall between other legs; the margins do not care.

    In a spin the stance turns about the centre of mass: within a swing its margin is constant.
    """
    phi = share * spin_phi_max(workspace)
    margins = []
    for sense in (1, -1):
        table = spin_schedule(duty_factor=beta, cycle_time=1.0, sense=sense)
        middles = [(lift + touchdown) / 2.0 for _, lift, touchdown in table.swing_intervals()]
        margins.append(
            [
                stability_margin(
                    (0.0, 0.0), spin_feet(workspace, table, phi, sense, t)[table.standing(t)]
                )
                for t in middles
            ]
        )
    assert min(margins[0]) == pytest.approx(min(margins[1]), abs=1e-9)


@given(betas, st.floats(0.1, 1.5))
def test_body_turns_of_a_cycle_add_up(beta: float, phi: float) -> None:
    """Four swings and two intervals on four feet, (8) and (9), turn the body by phi/beta."""
    swing, stand = body_turn(beta, phi)
    assert 4.0 * swing + 2.0 * stand == pytest.approx(phi / beta)
    rate = phi / beta  # per cycle: the same in all of the intervals
    assert swing / (1.0 - beta) == pytest.approx(rate)
    assert stand == pytest.approx(rate * (2.0 * beta - 1.5), abs=1e-12)


@given(workspaces, st.floats(0.05, 1.0), st.floats(-1.0, 1.0))
def test_spin_stroke_is_a_chord_of_the_feets_circle(
    workspace: Workspace, phi: float, delta: float
) -> None:
    """Equation (7) is the chord of the arc phi, turned by delta."""
    s_x, s_y = spin_stroke(workspace, phi, delta)
    chord = np.hypot(workspace.P_x, workspace.P_y) * np.sin(phi / 2.0)
    assert np.hypot(s_x, s_y) == pytest.approx(chord)
    assert np.arctan2(s_y, s_x) == pytest.approx(delta + phi / 2.0 + np.pi / 2.0)


@given(st.floats(-6.3, 6.3), betas, st.floats(0.2, 1.5))
def test_spins_take_the_fewest_cycles_that_turn_far_enough(
    angle: float, beta: float, phi_max: float
) -> None:
    """Whole cycles of phi <= phi_max make the angle, and one fewer could not."""
    cycles, phi = spin_cycles(angle, beta, phi_max)
    assert cycles * phi / beta == pytest.approx(abs(angle), abs=1e-8)
    assert phi <= phi_max + 1e-7
    assert (cycles - 1) * phi_max / beta < abs(angle) + 1e-7


def test_ninety_degrees_with_table_one() -> None:
    """90 degrees at beta = 3/4 is one cycle of phi = 67.5, with margins down to 0.185 m."""
    cycles, phi = spin_cycles(np.pi / 2.0, 0.75, spin_phi_max(PAPER_WORKSPACE))
    assert (cycles, np.degrees(phi)) == (1, pytest.approx(67.5))
    table = spin_schedule(duty_factor=0.75, cycle_time=1.0)
    margins = [
        stability_margin(
            (0.0, 0.0), spin_feet(PAPER_WORKSPACE, table, phi, 1, t)[table.standing(t)]
        )
        for t in np.linspace(0.0, 1.0, 400, endpoint=False)
    ]
    assert min(margins) == pytest.approx(0.1847, abs=1e-4)


def test_boxes_need_a_size() -> None:
    """A dimension that is not positive is refused."""
    with pytest.raises(ValueError, match="positive"):
        Workspace(R_x=0.0, R_y=0.5, P_x=0.8, P_y=0.54)
