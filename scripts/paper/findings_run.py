"""Findings on the paper's section III: the case study as planned, and its margin over time."""

import numpy as np

from drake_quad.robot.legs import Leg
from paper.finding import Finding, Verdict
from paper.gaits import WORKSPACE
from paper.study import (
    DOWN,
    TABLE_I,
    UP,
    CaseStudy,
    Samples,
    climbing_cycle,
    cycle_margins,
    find_zeros,
    wave_cycles,
)


def run_findings(study: CaseStudy, samples: Samples, out_of_phase: Samples) -> tuple[Finding, ...]:
    """Returns the findings on the case study.

    Args:
        study: Planned in phase.
        samples: Samples of the whole mission.
        out_of_phase: Samples of the same task on level ground of other lengths.
    """
    return (
        _stairs(study),
        _treads(study),
        _level(study),
        _descent(study, samples),
        _zeros(study, samples),
        _definition(study, samples),
        _one_stride(samples, out_of_phase),
        _massless(study, samples),
    )


def _stairs(study: CaseStudy) -> Finding:
    steps = {step.leg: step for step in wave_cycles(study.plans[UP])[climbing_cycle(study)]}
    stair = {
        (name, leg): round(float(place[2] - study.robot.foot_radius) / TABLE_I.H, 6)
        for leg in (Leg(3), Leg(4))
        for name, place in (("from", steps[leg].swing.p_start), ("to", steps[leg].swing.p_end))
    }
    return Finding(
        key="stairs_of_a_cycle",
        statement="Leg 4 is lifted from stair 1 and placed on stair 3, leg 3 lifted from stair 2 "
        "and placed on stair 4.",
        where="II-A, Fig. 4",
        template="So it is in the plan, in the cycle that begins with the body at "
        "x = {body:.2f} m: leg 4 from {from4:.0f} to {to4:.0f}, leg 3 from {from3:.0f} to "
        "{to3:.0f}.",
        numbers={
            **{f"{name}{int(leg)}": value for (name, leg), value in stair.items()},
            "body": study.plans[UP].body.sample(steps[Leg(1)].lift_off)[0, 0],
        },
        figures=(4,),
        verdict=Verdict.CONFIRMED,
    )


def _treads(study: CaseStudy) -> Finding:
    offsets = []
    for index, lane in zip((UP, DOWN), study.course.lanes, strict=True):
        ends = np.array([step.swing.p_end for step in study.plans[index].contacts.steps])
        s, _ = lane.coordinates(ends)
        k = lane.interval(s)
        on = [lane.kinds[i] == "tread" for i in k]
        offsets.append((s - 0.5 * (lane.breaks[k] + lane.breaks[k + 1]))[on])
    offset = np.abs(np.concatenate(offsets))
    return Finding(
        key="footprints",
        statement="Periodic gaits can be used on stairs, the stairs' dimensions being fixed.",
        where="II-A",
        template="With Table I all {count:.0f} footprints on treads are {low:.3f} to {high:.3f} m "
        "from the middle of a tread (P_x - 3W/2 = {gap:.2f} m, half of it to either side), if the "
        "level walk brings the feet to the stairs in that phase.",
        numbers={
            "count": len(offset),
            "low": offset.min(),
            "high": offset.max(),
            "gap": WORKSPACE.P_x - 1.5 * TABLE_I.W,
        },
        figures=(4, 11),
        verdict=Verdict.CONDITIONAL,
    )


def _level(study: CaseStudy) -> Finding:
    level, up, down = (
        cycle_margins(study, UP, 1),
        cycle_margins(study, UP, climbing_cycle(study)),
        cycle_margins(study, DOWN, climbing_cycle(study, DOWN)),
    )
    return Finding(
        key="level_body",
        statement="With a level body stability on stairs is the same as on level ground.",
        where="II-A",
        template="The margins of a cycle up and a cycle down the stairs differ from those of a "
        "cycle on the floor by at most {difference:.6f} m; in all three they lie between "
        "{low:.3f} and {high:.3f} m.",
        numbers={
            "difference": max(np.abs(up - level).max(), np.abs(down - level).max()),
            "low": min(level.min(), up.min(), down.min()),
            "high": max(level.max(), up.max(), down.max()),
        },
        figures=(12,),
        verdict=Verdict.CONFIRMED,
    )


def _descent(study: CaseStudy, samples: Samples) -> Finding:
    down = samples.times >= study.starts[DOWN]
    height = samples.body[:, 2]
    return Finding(
        key="descent",
        statement="For climbing down the same wave gait and procedure can be used; the robot turns "
        "by 90° between the two.",
        where="II-A, III",
        template="It goes up by {up:.2f} m, turns by {turn:.1f}°, and comes down by {down:.2f} m; "
        "the least margin on the way down is {margin:.3f} m.",
        numbers={
            "up": height.max() - height[0],
            "turn": np.degrees(samples.body[-1, 4] - samples.body[0, 4]),
            "down": height.max() - height[-1],
            "margin": samples.margin[down].min(),
        },
        figures=(11, 12),
        verdict=Verdict.CONFIRMED,
    )


def _zeros(study: CaseStudy, samples: Samples) -> Finding:
    zeros = find_zeros(study, samples)
    transitions = [zero for zero in zeros if zero.kind == "transition"]
    waves = [zero for zero in zeros if zero.kind == "wave"]
    return Finding(
        key="zeros",
        statement="The margin is zero on a few occasions, which are related to the transitions.",
        where="III, Fig. 12",
        template="Zero in {transitions:.0f} steps of transitions ({steps_time:.1f} s in all), and "
        "also twice in each of the {cycles:.0f} cycles of the wave, {waves:.0f} times: at the "
        "switches 1→4 and 2→3 the two support triangles share nothing but a diagonal, and at "
        "β = 0.75 there is no time on four feet to cross it. It takes β > 0.75, see the table "
        "below.",
        numbers={
            "transitions": len(transitions),
            "steps_time": sum(zero.end - zero.start for zero in transitions),
            "cycles": sum(len(wave_cycles(study.plans[k])) for k in (UP, DOWN)),
            "waves": len(waves),
        },
        figures=(12,),
        verdict=Verdict.CONTRADICTED,
    )


def _definition(study: CaseStudy, samples: Samples) -> Finding:
    zeros = find_zeros(study, samples)
    return Finding(
        key="definition",
        statement="If the margin, the least distance to the sides of the support polygon, is "
        "positive, the robot is stable, otherwise unstable.",
        where="I",
        template="A distance is never negative, so we sign it: negative outside. By this rule the "
        "border counts as unstable, and the case study is on it {zeros:.0f} times; sections II and "
        "III count it as stable.",
        numbers={"zeros": len(zeros)},
        figures=(12,),
        verdict=Verdict.CONTRADICTED,
    )


def _one_stride(samples: Samples, out_of_phase: Samples) -> Finding:
    return Finding(
        key="one_stride",
        statement="The robot stably walks on the level, climbs, turns and descends; its margin is "
        "never negative.",
        where="III, Fig. 12",
        template="Least margin {margin:.3f} m, legs massless, if the stride is the same all the "
        "way. Where it adapts to level ground of another length (a landing of 3 m in place of "
        "3.5 m) it has {other:.3f} m: while the stride changes the diagonals miss the body's "
        "centre.",
        numbers={"margin": samples.margin.min(), "other": out_of_phase.margin.min()},
        figures=(12,),
        verdict=Verdict.CONDITIONAL,
    )


def _massless(study: CaseStudy, samples: Samples) -> Finding:
    robot = study.robot
    return Finding(
        key="massless_legs",
        statement="Its stability is guaranteed, the mass of the legs being ignored.",
        where="I, III, VI",
        template="Legs have mass: a robot of {mass:.0f} kg, {legs:.0f} kg of them legs, that makes "
        "the same motion has a least margin of {margin:.2f} m.",
        numbers={
            "mass": robot.mass,
            "legs": float(robot.link_mass.sum()),
            "margin": samples.margin_robot.min(),
        },
        figures=(12,),
        verdict=Verdict.CONDITIONAL,
    )
