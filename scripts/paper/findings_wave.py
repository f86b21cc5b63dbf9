"""Findings on the paper's section II-A: the wave gait, its transition, the swing leg."""

import numpy as np

from paper.finding import Finding, Verdict, margins_of, order_of
from paper.gaits import (
    MAX_SHIFT,
    WORKSPACE,
    find_alternatives,
    paper_wave_transition,
    stair_swing,
    wave_feet,
    wave_goal,
)
from paper.margins import ONE, ONE_SPREAD, TWO
from paper.study import TABLE_I

FOOT_RADIUS = 0.035  # [m] of a real foot, for what a point foot's clearance is worth


def wave_findings() -> tuple[Finding, ...]:
    """Returns the findings on section II-A."""
    return (
        _one_tread(),
        _stroke(),
        _workspace_use(),
        _transition(),
        _fewest_steps(),
        _rest_to_rest(),
        _two_risers(),
        _foot_radius(),
    )


def _one_tread() -> Finding:
    highest = 0.95
    return Finding(
        key="one_tread",
        statement="If each leg advances one stair in a cycle the support patterns are skew "
        "symmetrical, which reduces stability and speed; with two stairs they are symmetrical.",
        where="I, after Song and Waldron",
        template="Tried. With left and right feet in the same place of their treads one stair a "
        "cycle has a least margin of {one:.3f} m, and {one_high:.3f} m still at β = {high:.2f}: "
        "without sway it is not stable at all. Two have {two:.3f} m and {two_high:.3f} m, at twice "
        "the speed, {speed:.3f} m/s for {half_speed:.4f} m/s. Spread up to {aside:.4f} m from the "
        "middles of treads as deep as these, the footprints of one stair a cycle are symmetrical, "
        "too: then it has {spread:.3f} m and {spread_high:.3f} m, less than half of what two have.",
        numbers={
            "one": ONE.least_margin(TABLE_I.beta),
            "one_high": ONE.least_margin(highest),
            "two": TWO.least_margin(TABLE_I.beta),
            "two_high": TWO.least_margin(highest),
            "spread": ONE_SPREAD.least_margin(TABLE_I.beta),
            "spread_high": ONE_SPREAD.least_margin(highest),
            "high": highest,
            "aside": ONE_SPREAD.from_middles(),
            "speed": TWO.stride / TABLE_I.T,
            "half_speed": ONE.stride / TABLE_I.T,
        },
        figures=(13,),
        verdict=Verdict.CONFIRMED,
    )


def _stroke() -> Finding:
    return Finding(
        key="stroke",
        statement="Each leg advances two stairs a cycle: λ = R/β, so R is 2Wβ horizontally and "
        "2Hβ vertically; the body advances (1/β - 1)R during each swing.",
        where="II-A",
        template="R = {stroke:.2f} m ≤ R_x = {R_x:.2f} m, vertically {rise:.3f} m; λ = "
        "{stride:.2f} m is two treads; the body advances {advance:.2f} m a swing.",
        numbers={
            "stroke": TABLE_I.stroke,
            "R_x": WORKSPACE.R_x,
            "rise": 2.0 * TABLE_I.H * TABLE_I.beta,
            "stride": TABLE_I.stroke / TABLE_I.beta,
            "advance": (1.0 / TABLE_I.beta - 1.0) * TABLE_I.stroke,
        },
        figures=(2, 4),
        verdict=Verdict.CONFIRMED,
    )


def _workspace_use() -> Finding:
    phases = np.linspace(0.0, 1.0, 4001)
    feet = wave_feet(WORKSPACE, stride=TABLE_I.stride, duty_factor=TABLE_I.beta, phases=phases)
    reach = float(np.abs(feet - WORKSPACE.centres)[..., 0].max())
    return Finding(
        key="workspace_use",
        statement="The desired configuration lets each leg use its workspace for the maximum "
        "stroke.",
        where="II-A, Fig. 2",
        template="A standing foot stays {spare:.3f} m inside its box. A swinging foot does not: "
        "equation (1) starts and ends at rest on the ground while the body moves on, so in the "
        "body frame the foot trails {trail:.4f} m beyond its stroke, {excess:.4f} m out of the "
        "box. Boxes of R_x ≥ {needed:.3f} m would hold it.",
        numbers={
            "spare": (WORKSPACE.R_x - TABLE_I.stroke) / 2.0,
            "trail": reach - TABLE_I.stroke / 2.0,
            "excess": reach - WORKSPACE.R_x / 2.0,
            "needed": 2.0 * reach,
        },
        figures=(2,),
        verdict=Verdict.CONDITIONAL,
    )


def _transition() -> Finding:
    transition = paper_wave_transition()
    aside = max(paper_wave_transition(-TABLE_I.stroke / 6.0 + d).margin_min for d in (-0.01, 0.01))
    best = find_alternatives(wave_goal()).still
    return Finding(
        key="transition_wave",
        statement="Legs 2-3-4-1-3, one after the other with the body still, lead from the initial "
        "to the desired configuration, the centre of mass inside or on the border of the support "
        "polygon.",
        where="II-A, Fig. 3",
        template="Margins {m1:.3f}, {m2:.3f}, {m3:.3f}, {m4:.3f}, {m5:.3f} m, if leg 3's first "
        "step ends R/6 = {detour:.3f} m behind its centre, which the text does not say: 0.01 m "
        "beside it the margin is {aside:.4f} m at best. From the centres a first lift has margin "
        f"0 whichever leg it is. The order {order_of(best)} does better: {{b1:.3f}}, {{b2:.3f}}, "
        "{b3:.3f}, {b4:.3f}, {b5:.3f} m.",
        numbers={
            **margins_of(transition),
            **{f"b{k}": step.margin for k, step in enumerate(best.steps, start=1)},
            "detour": TABLE_I.stroke / 6.0,
            "aside": aside,
        },
        figures=(3,),
        verdict=Verdict.CONDITIONAL,
    )


def _fewest_steps() -> Finding:
    ways = find_alternatives(wave_goal())
    return Finding(
        key="fewest_wave",
        statement="The transition takes the minimum number of steps, five.",
        where="I, II-A, Fig. 3",
        template="With the body still none of the {orders:.0f} orders of four steps is stable (the "
        "best has {four:.4f} m) and {five:.0f} are enough. With a body that shifts by at most "
        "{shift:.1f} m before each lift {fewest:.0f} are, in the order "
        f"{order_of(ways.shifting)}, with a margin of {{shifted:.3f}} m throughout.",
        numbers={
            "orders": len(ways.orders_of_four),
            "four": ways.orders_of_four[0].margin_min,
            "five": len(ways.still.steps),
            "shift": MAX_SHIFT,
            "fewest": len(ways.shifting.steps),
            "shifted": ways.shifting.margin_min,
        },
        figures=(3,),
        verdict=Verdict.CONDITIONAL,
    )


def _rest_to_rest() -> Finding:
    swing = stair_swing(going=1, chosen=1).swing
    ends = [swing.sample(t) for t in (0.0, swing.duration)]
    step = 1e-9 * swing.duration
    before, after = (swing.sample(swing.apex_time + d)[2] for d in (-step, step))
    return Finding(
        key="rest_to_rest",
        statement="The swing leg's velocity and acceleration are zero at takeoff and touchdown, "
        "and its trajectory is smooth.",
        where="II-A, (1)-(3)",
        template="Largest speed {speed:.1f} m/s and acceleration {acceleration:.1f} m/s² at the "
        "ends; at t_s = {t_s:.3f} s, where the two polynomials in z meet, the acceleration jumps "
        "by {jump:.1f} m/s².",
        numbers={
            "speed": max(float(np.abs(v).max()) for _, v, _ in ends),
            "acceleration": max(float(np.abs(a).max()) for _, _, a in ends),
            "t_s": swing.apex_time,
            "jump": round(float(np.abs(after - before).max()), 6),
        },
        figures=(5,),
        verdict=Verdict.CONFIRMED,
    )


def _two_risers() -> Finding:
    up, down = stair_swing(going=1, chosen=1), stair_swing(going=-1, chosen=0)
    up_wrong, down_wrong = stair_swing(going=1, chosen=0), stair_swing(going=-1, chosen=1)
    return Finding(
        key="two_risers",
        statement="With z(t_s) = h_s + Δh above the stair at d_s the swing leg doesn't collide.",
        where="II-A, (2), (3), Fig. 5",
        template="A swing of two treads passes two risers; d_s and h_s have to belong to the last "
        "one going up and to the first one going down. Then the other is cleared by {up:.3f} m "
        "(up) and {down:.3f} m (down). With the wrong one of the two the foot passes "
        "{up_wrong:.3f} m (up) and {down_wrong:.3f} m (down) below the other nosing.",
        numbers={
            "up": up.heights[0],
            "down": down.heights[1],
            "up_wrong": -up_wrong.heights[1],
            "down_wrong": -down_wrong.heights[0],
        },
        figures=(5,),
        verdict=Verdict.CONDITIONAL,
    )


def _foot_radius() -> Finding:
    nearest = min(stair_swing(going=g, chosen=c).nearest for g, c in ((1, 1), (-1, 0)))
    return Finding(
        key="foot_radius",
        statement="Δh = 0.02 m over the stair avoids the collision.",
        where="II-A, Table I",
        template="True of a point. Its path comes within {nearest:.4f} m of a nosing: a spherical "
        "foot of radius {radius:.3f} m would cut {overlap:.4f} m into it. We clear the nosings by "
        "the radius and Δh.",
        numbers={"nearest": nearest, "radius": FOOT_RADIUS, "overlap": FOOT_RADIUS - nearest},
        figures=(5,),
        verdict=Verdict.CONDITIONAL,
    )
