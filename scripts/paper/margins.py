"""The wave's margin beyond its duty factor of 3/4, and with one tread a cycle.

As everywhere on the page legs are massless, and the body is level, at constant speed and without
sway. It is where the legs' strokes are centred: there the least margin is the largest.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import GaitSchedule, wave_schedule
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.robot.legs import LEGS, SIGNS
from drake_quad.stability.support_polygon import stability_margins
from paper.gaits import WORKSPACE, wave_margin
from paper.study import DOWN, TABLE_I, UP, plan_case_study, sample_plan

# ------------------------------------------------------------------------------------------------
# The wave's static margin beyond β = 3/4: by the paper's equations, and as planned.
# ------------------------------------------------------------------------------------------------


BETAS = (0.75, 0.80, 0.85, 0.90)


@dataclass(frozen=True)
class BetaRow:
    """The margins of one duty factor, legs massless, without sway.

    Attributes:
        beta: β.
        equations: Least margin of a cycle by the wave gait's own equations [m].
        up: Least margin of the case study's cycles up the stairs, as planned [m].
        down: Least margin of its cycles down the stairs, as planned [m].
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


# ------------------------------------------------------------------------------------------------
# One tread a cycle against two (section I): the wave gait's margin on Table I's stairs.
# ------------------------------------------------------------------------------------------------


_EITHER_SIDE = 1e-9  # of a cycle: switches are looked at just before and just after
_W, _P_X = TABLE_I.W, WORKSPACE.P_x


@dataclass(frozen=True)
class TreadGait:
    """A wave gait on stairs.

    Attributes:
        name: Name that people read.
        treads: How many treads each leg advances in a cycle.
        spread: Whether footprints are where the level wave gait of that stride has them, wherever
            on its tread each is; else left and right feet have the same place on their treads.
    """

    name: str
    treads: int
    spread: bool = False

    @property
    def stride(self) -> float:
        """λ [m]."""
        return self.treads * _W

    def start(self, beta: float) -> FloatArray:
        """Where the feet stand as a cycle begins, from the body's centre (4, 2) [m]."""
        feet = np.array(WORKSPACE.centres)
        if self.spread:
            feet[:, 0] += self.stride * (_table(beta).lift_off - 0.5 * beta)
        else:
            pattern = FootholdPattern(treads=self.treads)
            places = np.array([pattern.first(leg) for leg in LEGS]) - pattern.ahead(beta)
            feet[:, 0] = places * _W + 0.5 * (_P_X - pattern.stance * _W) * SIGNS[:, 0]
        return feet

    def feet(self, beta: float, phases: ArrayLike) -> FloatArray:
        """Where the feet stand, or are to be put down, from the body's centre (N, 4, 2) [m].

        Args:
            beta: β.
            phases: Parts of the cycle in [0, 1] (N,).
        """
        at = np.asarray(phases, dtype=float)[:, None]
        feet = np.tile(self.start(beta), (len(at), 1, 1))
        feet[..., 0] += self.stride * ((at >= _table(beta).lift_off) - at)
        return feet

    def margins(self, beta: float, phases: ArrayLike) -> FloatArray:
        """The static margin at parts of a cycle (N,) [m]."""
        at = np.asarray(phases, dtype=float)
        standing = _table(beta).standings(at)
        return stability_margins(np.zeros((len(at), 2)), self.feet(beta, at), standing)

    def least_margin(self, beta: float) -> float:
        """The least margin of a cycle [m]."""
        return float(self.margins(beta, dense_phases(beta)).min())

    def from_middles(self) -> float:
        """How far the farthest footprint is from its tread's middle, where they are best [m]."""
        x = self.start(TABLE_I.beta)[:, 0]
        at = np.sort(x % _W)
        widest = float(np.max(np.diff(np.append(at, at[0] + _W))))
        return 0.5 * (_W - widest)


TWO = TreadGait("two treads a cycle (the paper's)", 2)
ONE = TreadGait("one tread, left and right feet in the same place of their treads", 1)
ONE_SPREAD = TreadGait("one tread, footprints spread over the treads", 1, spread=True)


def dense_phases(beta: float) -> FloatArray:
    """Parts of a cycle, evenly and on either side of every lift-off and touchdown (N,)."""
    switches = np.ravel([[start, end] for _, start, end in _table(beta).swing_intervals()])
    near = np.concatenate([switches - _EITHER_SIDE, switches + _EITHER_SIDE])
    phases = np.concatenate([np.linspace(0.0, 1.0 - _EITHER_SIDE, 801), near])
    return np.unique(phases[(phases >= 0.0) & (phases < 1.0)])


def _table(beta: float) -> GaitSchedule:
    return wave_schedule(duty_factor=beta, cycle_time=1.0)
