"""The gait clock slows down and stands before a margin is lost that is demanded."""

import numpy as np
from hypothesis import given, strategies as st
from pydrake.systems.analysis import Simulator, SimulatorStatus
from rig import fix_inputs, flat_walk, paper_robot, read

from drake_quad.common import FloatArray
from drake_quad.control.gait_clock import allowed_rate
from drake_quad.control.ports import BALANCE_SIZE, Balance, GaitPhase
from drake_quad.control.settings import ControlSettings
from drake_quad.planning.motion_plan import evaluate
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.systems.gait_scheduler import GaitScheduler

MARGIN = st.floats(-0.3, 0.3)
PERIOD = 0.005


@given(MARGIN, MARGIN, st.floats(0.0, 0.2))
def test_a_rate_keeps_what_is_demanded(now: float, ahead: float, demanded: float) -> None:
    """Full speed to more margin; never faster than leaves the demanded one; none beyond it."""
    rate = allowed_rate(now, ahead, demanded)
    assert 0.0 <= rate <= 1.0
    if ahead >= now:
        assert rate == 1.0
    elif now <= demanded:
        assert rate == 0.0
    else:
        assert now + rate * (ahead - now) >= demanded - 1e-9
        assert rate > 0.0


class Walk:
    """A scheduler whose robot is on its plan, but aside of it by `off` [m]."""

    def __init__(self, demanded: float, *, off: float = 0.0) -> None:
        control = ControlSettings(period=PERIOD, margin_demanded=demanded, lift_off_margin=0.0)
        self.system = GaitScheduler(num_tasks=1, control=control)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.off, self.margins, self.rates = off, list[float](), list[float]()
        fix_inputs(
            self.system, self.context, motion_plan=flat_walk(), contact_state_measured=np.ones(4)
        )

    @property
    def phase(self) -> FloatArray:
        """The `gait_phase` vector now."""
        return read(self.system, self.context, "gait_phase")

    def run(self, until: float) -> SimulatorStatus:
        """Lets time pass in a robot that is where the clock wants it, at once and at rest."""
        while True:
            s = evaluate(paper_robot(), flat_walk(), np.array([self.phase[GaitPhase.TIME]]))
            balance = np.zeros(BALANCE_SIZE)
            com = s.com[0] + [0.0, self.off, 0.0]
            balance[Balance.COM : Balance.COM + 3] = com
            balance[Balance.FEET : Balance.BODY] = s.feet[0].ravel()
            self.margins.append(stability_margin(com[:2], s.feet[0, s.standing[0], :2]))
            fix_inputs(self.system, self.context, balance_estimated=balance)
            status = self.simulator.AdvanceTo(self.context.get_time() + 4 * PERIOD)
            self.rates.append(float(self.phase[GaitPhase.RATE]))
            ended = status.reason() != SimulatorStatus.ReturnReason.kReachedBoundaryTime
            if ended or self.context.get_time() >= until:
                return status


def test_a_robot_with_room_walks_as_ever() -> None:
    """With a demand that the plan has room for, the clock never slows."""
    walk = Walk(0.03)
    walk.run(6.0)
    assert min(walk.margins) > 0.05 and min(walk.rates[1:]) == 1.0
    assert abs(walk.phase[GaitPhase.TIME] - 6.0) < 0.03


def test_the_clock_slows_and_stands_before_the_margin_is_lost() -> None:
    """A robot aside of its plan stops with the demanded margin left, and says what for."""
    demanded = 0.03
    free, held = Walk(0.0, off=0.09), Walk(demanded, off=0.09)
    free.run(6.0)
    assert min(free.margins) < demanded - 0.01
    status = held.run(30.0)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert "margin" in status.FormatMessage()
    assert min(held.margins) > demanded - 1e-3
    assert any(0.0 < rate < 1.0 for rate in held.rates)
