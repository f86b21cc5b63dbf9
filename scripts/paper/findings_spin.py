"""Findings on the paper's section II-B: the spinning gait and its transition."""

from dataclasses import replace

import numpy as np

from drake_quad.gait.schedule import spin_schedule
from drake_quad.gait.workspace import (
    Workspace,
    body_turn,
    paper_spin_angle,
    spin_arc,
    spin_phi_max,
    spin_stroke,
)
from drake_quad.robot.legs import Leg
from paper.finding import Finding, Verdict, margins_of, order_of
from paper.gaits import (
    MAX_SHIFT,
    WORKSPACE,
    direct_to_spin,
    find_alternatives,
    quarter_turn_arc,
    spin_feet,
    spin_goal,
    spin_margin,
)
from paper.study import TABLE_I

NARROW_BOXES = replace(WORKSPACE, R_y=0.3)
"""Table I but for narrower boxes, which the circle leaves through both of their long edges."""


def equation_6_radicand(workspace: Workspace) -> float:
    """Returns P_x² - 2 P_y R_y - R_y² [m²], of which equation (6) takes the root."""
    w = workspace
    return w.P_x**2 - 2.0 * w.P_y * w.R_y - w.R_y**2


def spin_findings() -> tuple[Finding, ...]:
    """Returns the findings on section II-B."""
    return (_table(), _equations(), _chord(), _intervals(), _transition(), _centres(), _stable())


def _table() -> Finding:
    lo, hi = np.degrees(spin_arc(WORKSPACE))
    return Finding(
        key="table_against_6",
        statement="The circle through the workspaces' centres leaves them through their lengths; "
        "φ follows from equations (4)-(6) with Table I.",
        where="II-B, (4)-(6), Table I",
        template="With Table I equation (6) takes the root of P_x² - 2P_yR_y - R_y² = "
        "{radicand:.2f} m². The circle (r = {radius:.4f} m) never reaches the outer long edge "
        "(y = {outer:.2f} m): it leaves through the inner long edge at {lo:.3f}° and through the "
        "inner short edge at {hi:.3f}°, so φ_max = {phi_max:.2f}°.",
        numbers={
            "radicand": equation_6_radicand(WORKSPACE),
            "radius": np.hypot(WORKSPACE.P_x, WORKSPACE.P_y) / 2.0,
            "outer": (WORKSPACE.P_y + WORKSPACE.R_y) / 2.0,
            "lo": lo,
            "hi": hi,
            "phi_max": hi - lo,
        },
        figures=(8,),
        verdict=Verdict.CONTRADICTED,
    )


def _equations() -> Finding:
    return Finding(
        key="equations_4_to_6",
        statement="φ = π/2 - (δ + γ), where the circle meets the lengths.",
        where="II-B, (4)-(6)",
        template="Where it does they hold: with R_y = {R_y:.1f} m, all else as in Table I, they "
        "give φ = {phi:.4f}°, and the arc of the circle inside the box has {arc:.4f}°.",
        numbers={
            "R_y": NARROW_BOXES.R_y,
            "phi": np.degrees(paper_spin_angle(NARROW_BOXES)),
            "arc": np.degrees(spin_phi_max(NARROW_BOXES)),
        },
        figures=(8,),
        verdict=Verdict.CONFIRMED,
    )


def _chord() -> Finding:
    _, phi = quarter_turn_arc()
    s_x, s_y = spin_stroke(WORKSPACE, phi, sum(spin_arc(WORKSPACE)) / 2.0 - phi / 2.0)
    table = spin_schedule(duty_factor=TABLE_I.beta, cycle_time=1.0)
    moved = {
        leg: np.diff(
            spin_feet(WORKSPACE, phi=phi, duty_factor=TABLE_I.beta, phases=[start, end])[
                :, leg.row
            ],
            axis=0,
        )[0]
        for leg, start, end in table.swing_intervals()
    }
    signs = ", ".join(
        "({})".format(", ".join("+" if d > 0 else "-" for d in moved[leg] / (s_x, s_y)))
        for leg in table.order
    )
    return Finding(
        key="equation_7",
        statement="Each leg is moved by s_x and s_y relative to the body.",
        where="II-B, (7)",
        template="For 90° s_x = {s_x:.3f} m and s_y = {s_y:.3f} m, and in a cycle leg 1 is moved "
        f"by {{x:.3f}} m and {{y:.3f}} m. Legs 1, 3, 4, 2 take them with the signs {signs}.",
        numbers={"s_x": s_x, "s_y": s_y, "x": moved[Leg(1)][0], "y": moved[Leg(1)][1]},
        figures=(9,),
        verdict=Verdict.CONFIRMED,
    )


def _intervals() -> Finding:
    _, phi = quarter_turn_arc()
    swing, stand = np.degrees(body_turn(TABLE_I.beta, phi))
    return Finding(
        key="equations_8_9",
        statement="The body turns by ΔΩ in each of the four swings and by ΔΩ′ in each of the two "
        "intervals on four feet.",
        where="II-B, (8), (9)",
        template="They agree: 4ΔΩ + 2ΔΩ′ = {total:.1f}° = φ/β = {cycle:.1f}°, at one rate. At "
        "β = {beta:.2f} ΔΩ = {swing:.1f}° and ΔΩ′ = {stand:.1f}°: the intervals on four feet have "
        "no length.",
        numbers={
            "total": 4.0 * swing + 2.0 * stand,
            "cycle": np.degrees(phi / TABLE_I.beta),
            "beta": TABLE_I.beta,
            "swing": swing,
            "stand": stand,
        },
        figures=(9,),
        verdict=Verdict.CONFIRMED,
    )


def _transition() -> Finding:
    ways = find_alternatives(spin_goal())
    return Finding(
        key="transition_spin",
        statement="The transition to the spinning gait takes five steps, the centre of mass inside "
        "or on the border of the support polygon.",
        where="II-B, Fig. 7",
        template=f"With the body still, five: {order_of(ways.still)} (our order: the paper's is in "
        "its figure alone) has {m1:.3f}, {m2:.3f}, {m3:.3f}, {m4:.3f}, {m5:.3f} m; no order of "
        "four is stable (the best has {four:.4f} m). With shifts of at most {shift:.1f} m four "
        f"are enough: {order_of(ways.shifting)}, with {{shifted:.3f}} m.",
        numbers={
            **margins_of(ways.still),
            "four": ways.orders_of_four[0].margin_min,
            "shift": MAX_SHIFT,
            "shifted": ways.shifting.margin_min,
        },
        figures=(7,),
        verdict=Verdict.CONDITIONAL,
    )


def _centres() -> Finding:
    direct, ways = direct_to_spin(), find_alternatives(spin_goal())
    return Finding(
        key="via_centres",
        statement="A simple stable way from one gait to the other is by way of the workspaces' "
        "centres.",
        where="II-B",
        template="It is stable, in {via:.0f} steps with a margin of {via_margin:.3f} m. Straight "
        "from the wave's to the spin's configuration, the body still, {direct:.0f} steps are "
        f"enough, {order_of(direct)}, and their margin is {{direct_margin:.3f}} m.",
        numbers={
            "via": 2 * len(ways.still.steps),
            "via_margin": ways.still.margin_min,
            "direct": len(direct.steps),
            "direct_margin": direct.margin_min,
        },
        figures=(12,),
        verdict=Verdict.CONFIRMED,
    )


def _stable() -> Finding:
    cycles, phi = quarter_turn_arc()
    return Finding(
        key="spin_stable",
        statement="The robot turns by 90° with the spinning gait, and stays stable.",
        where="II-B, III",
        template="{cycles:.0f} cycle with φ = {phi:.1f}° ≤ φ_max = {phi_max:.2f}°; the margin is "
        "at least {margin:.3f} m.",
        numbers={
            "cycles": cycles,
            "phi": np.degrees(phi),
            "phi_max": np.degrees(spin_phi_max(WORKSPACE)),
            "margin": spin_margin(WORKSPACE, phi=phi, duty_factor=TABLE_I.beta),
        },
        figures=(6, 9, 12),
        verdict=Verdict.CONFIRMED,
    )
