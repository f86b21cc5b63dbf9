"""The case study at many times: its margins, and when they are zero."""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.planning.contact_plan import Phase
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.report.paper_study import TABLE_I, CaseStudy, wave_cycles
from drake_quad.robot.legs import Leg
from drake_quad.stability.support_polygon import stability_margins

SAMPLE_PERIOD = 0.05  # [s]
ZERO = 1e-6  # [m]: a margin this small is on the support polygon's border


@dataclass(frozen=True, eq=False)
class Samples:
    """A plan at many times, phase by phase, both ends of each phase included.

    At a switch the same time is there twice: with the feet that stood, and with those that then
    stand.

    Attributes:
        times: (N,) since the start of the mission [s].
        body: (N, 5) x, y, z, pitch, yaw of the body.
        feet: (N, 4, 3) foot sphere centres [m].
        standing: (N, 4) who stands.
        margin: (N,) static margin of the body's centre: massless legs, as in the paper [m].
        margin_robot: (N,) static margin of the whole robot's centre of mass [m].
        reach_excess: (N,) by how much the worst foot is out of its leg's reach [m].
    """

    times: FloatArray
    body: FloatArray
    feet: FloatArray
    standing: BoolArray
    margin: FloatArray
    margin_robot: FloatArray
    reach_excess: FloatArray


def sample_plan(
    study: CaseStudy, index: int, *, start: float = 0.0, end: float = np.inf
) -> Samples:
    """Samples plan `index` from `start` to `end`, in the plan's own time [s]."""
    plan, offset = study.plans[index], study.starts[index]
    rows = [
        _sample_phase(plan, phase, max(phase.start, start), min(phase.end, end))
        for phase in plan.contacts.phases
        if phase.start < end - ZERO and phase.end > start + ZERO
    ]
    times, body, feet, standing = (np.concatenate(column) for column in zip(*rows, strict=True))
    _, excess, com = pose_robot(study.robot, body, feet)
    return Samples(
        times=offset + times,
        body=body,
        feet=feet,
        standing=standing,
        margin=stability_margins(body[:, :2], feet[..., :2], standing),
        margin_robot=stability_margins(com[:, :2], feet[..., :2], standing),
        reach_excess=excess.max(axis=1),
    )


def sample_study(study: CaseStudy) -> Samples:
    """Samples the whole mission."""
    parts = [vars(sample_plan(study, index)) for index in range(len(study.plans))]
    return Samples(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def _sample_phase(
    plan: MotionPlan, phase: Phase, start: float, end: float
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Returns times, body, feet and standing feet of a phase, its own feet at both of its ends."""
    count = max(int(np.ceil((end - start) / SAMPLE_PERIOD - ZERO)), 1) + 1
    times = np.linspace(start, end, count)
    feet = np.tile(phase.feet, (count, 1, 1))
    if phase.step is not None:
        feet[:, phase.step.leg.row] = phase.step.swing.positions(times - phase.start)
    return times, plan.body.samples(times)[:, 0], feet, np.tile(phase.standing, (count, 1))


@dataclass(frozen=True)
class Zero:
    """A time at which the margin is zero.

    Attributes:
        kind: `transition` or `wave` (or whatever the segment is).
        start: When it begins [s].
        end: When it ends [s]; the same at a switch.
        legs: Who is in the air: one leg in a transition's step, two at a switch between legs.
    """

    kind: str
    start: float
    end: float
    legs: tuple[Leg, ...]


def find_zeros(study: CaseStudy, samples: Samples) -> tuple[Zero, ...]:
    """Returns when the massless-leg robot's margin is zero, in time order.

    Neighbouring samples on the border are one zero: a step of a transition, or a switch.
    """
    zeros: list[Zero] = []
    rows = np.flatnonzero(samples.margin < ZERO)
    for group in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        if not len(group):
            continue
        start, end = float(samples.times[group[0]]), float(samples.times[group[-1]])
        middle = (start + end) / 2.0
        kind = next(s.kind for s in study.segments if s.start - ZERO <= middle <= s.end + ZERO)
        legs: dict[Leg, None] = {}
        for row in group:
            legs.update(dict.fromkeys(leg for leg in Leg if not samples.standing[row, leg.row]))
        zeros.append(Zero(kind, start, end, tuple(legs)))
    return tuple(zeros)


def cycle_margins(study: CaseStudy, index: int, cycle: int) -> FloatArray:
    """Returns the margins through one cycle of plan `index` [m], legs massless."""
    start = wave_cycles(study.plans[index])[cycle][0].lift_off
    return sample_plan(study, index, start=start, end=start + TABLE_I.T).margin
