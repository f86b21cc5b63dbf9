"""The wave's static margin beyond β = 3/4: by the paper's equations, and as planned."""

from dataclasses import dataclass

from drake_quad.report.paper_cycles import wave_margin
from drake_quad.report.paper_samples import sample_plan
from drake_quad.report.paper_study import DOWN, TABLE_I, UP, plan_case_study
from drake_quad.report.paper_transitions import WORKSPACE

BETAS = (0.75, 0.80, 0.85, 0.90)


@dataclass(frozen=True)
class BetaRow:
    """The margins of one duty factor, legs massless, without sway.

    Attributes:
        beta: β.
        equations: Least margin of a cycle by the wave gait's own equations [m].
        up: Least margin of the case study's cycles up the stairs, as planned [m].
        down: The same of those down the stairs [m].
    """

    beta: float
    equations: float
    up: float
    down: float


def beta_rows() -> tuple[BetaRow, ...]:
    """Returns the margins of every β of BETAS, the case study planned with each."""
    return tuple(_row(beta) for beta in BETAS)


def _row(beta: float) -> BetaRow:
    study = plan_case_study([f"gait.duty_factor={beta}"])
    least = []
    for index in (UP, DOWN):
        plan = study.plans[index]
        wave = next(s for s in plan.segments if s.kind == "wave")
        begin = next(s.lift_off for s in plan.contacts.steps if s.lift_off > wave.start)
        least.append(float(sample_plan(study, index, start=begin, end=wave.end).margin.min()))
    equations = wave_margin(WORKSPACE, stride=TABLE_I.stride, duty_factor=beta)
    return BetaRow(beta, equations, *least)
