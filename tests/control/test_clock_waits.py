"""What the gait clock waits for, function by function; the whole clock: test_gait_scheduler.py."""

from dataclasses import replace

import numpy as np
import pytest
from rig import flat_walk

from drake_quad.common import FloatArray
from drake_quad.control.gait_clock import (
    CALM_PLACE,
    begin_task,
    clock_rate,
    is_off_plan,
    set_clock,
)
from drake_quad.control.ports import (
    BALANCE_SIZE,
    SIZE,
    Balance,
    GaitPhase,
    Mode,
    is_swinging,
    swing_legs,
)
from drake_quad.control.push_recovery import CALM_SPEED
from drake_quad.control.settings import ControlSettings, for_legs
from drake_quad.gait.swing import Swing
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.legs import Leg

CONTROL = ControlSettings(period=0.005, lift_off_margin=0.02)
ALL = np.ones(4, dtype=bool)
STEPS = flat_walk().contacts.steps


def balance_at(t: float, *, speed: float = 0.0, off: float = 0.0, com: float = 0.0) -> FloatArray:
    """The robot on its plan, but so much faster than it, off it, its centre of mass behind [m]."""
    sample = flat_walk().sample(t)
    balance = np.zeros(BALANCE_SIZE)
    x, y, z, _, yaw = sample.body[0]
    balance[Balance.COM : Balance.COM + 3] = [x - com, y, z]
    balance[Balance.VELOCITY_ERROR] = speed
    balance[Balance.FEET : Balance.FEET + 12] = sample.feet.ravel()
    balance[Balance.BODY : Balance.BODY + 4] = [x, y + off, z, yaw]
    balance[Balance.PLACE_ERROR + 1] = off
    return balance


@pytest.mark.parametrize("step", STEPS[:6], ids=lambda s: f"{s.leg.short} at {s.lift_off:.1f} s")
def test_a_foot_lifts_off_when_the_other_three_bear_and_hold(step: Step) -> None:
    """A tick before, the clock asks both; whether the foot itself bears does not matter."""
    t = step.lift_off - 0.5 * CONTROL.period
    others = np.arange(4) != step.leg.row
    assert clock_rate(flat_walk(), t, ALL, balance_at(t), CONTROL) == (1.0, "")
    assert clock_rate(flat_walk(), t, others, balance_at(t), CONTROL) == (1.0, "")
    for row in np.flatnonzero(others):
        rate, why = clock_rate(flat_walk(), t, np.arange(4) != row, balance_at(t), CONTROL)
        assert rate == 0.0 and f"leg {step.leg.short} is to lift off" in why
    rate, why = clock_rate(flat_walk(), t, ALL, balance_at(t, com=2.0), CONTROL)
    assert rate == 0.0 and f"without leg {step.leg.short} the margin is -" in why


@pytest.mark.parametrize("step", STEPS[:6], ids=lambda s: f"{s.leg.short} at {s.lift_off:.1f} s")
def test_a_swing_ends_when_its_foot_bears(step: Step) -> None:
    """And while it is under way nothing is asked at all."""
    t = step.lift_off + step.swing.duration - 0.5 * CONTROL.period
    rate, why = clock_rate(flat_walk(), t, np.arange(4) != step.leg.row, balance_at(t), CONTROL)
    assert rate == 0.0 and why == f"leg {step.leg.short} has not touched down"
    middle = step.lift_off + 0.5 * step.swing.duration
    none = np.zeros(4, dtype=bool)
    assert clock_rate(flat_walk(), middle, none, balance_at(middle), CONTROL) == (1.0, "")


def test_a_push_is_over_when_the_robot_is_slow_and_in_its_place() -> None:
    """It begins with a speed that may be a push's, and takes both to end."""

    def shaken(since: float, speed: float, off: float = 0.0) -> bool:
        balance = balance_at(1.0, speed=speed, off=off)
        return is_off_plan(balance, since=since, push_speed=0.12)

    assert not shaken(0.0, 0.11, off=1.0) and shaken(0.0, 0.13)
    assert shaken(0.1, 1.1 * CALM_SPEED) and shaken(0.1, 0.0, off=1.1 * CALM_PLACE)
    assert not shaken(0.1, 0.9 * CALM_SPEED, off=0.9 * CALM_PLACE)


def test_the_clock_is_set_with_all_that_follows_from_its_time() -> None:
    """Of a swing its leg and phase; of a task's beginning nothing is left of the one before."""
    phase = [0.0] * SIZE
    phase[GaitPhase.MODE], phase[GaitPhase.REVISION] = float(Mode.RUN), 3.0
    step = STEPS[2]
    set_clock(phase, flat_walk(), step.lift_off + 0.25 * step.swing.duration)
    assert phase[GaitPhase.SWING_LEG] == int(step.leg)
    assert phase[GaitPhase.SWING_PHASE] == pytest.approx(0.25)
    assert phase[GaitPhase.REVISION] == 3.0
    begin_task(phase, 2)
    wanted = [0.0] * SIZE
    wanted[GaitPhase.TASK], wanted[GaitPhase.MODE] = 2.0, float(Mode.RUN)
    assert phase == wanted


def pair_plan() -> MotionPlan:
    """Two diagonal legs swing from 1 s to 2 s, the body over the middle of the other two."""
    feet = flat_walk().contacts.feet
    pair = tuple(
        Step(leg, 1.0, 2.0, Swing(feet[leg.row], feet[leg.row] + [0.1, 0.0, 0.0], 1.0, 0.5, 0.2))
        for leg in (Leg.FRONT_LEFT, Leg.REAR_RIGHT)
    )
    return replace(flat_walk(), contacts=ContactPlan(feet, pair, 3.0))


@pytest.mark.parametrize("beside", [0.0, 0.02, 0.04])
def test_two_legs_lift_off_when_the_robot_is_near_the_line_of_the_feet_that_stay(
    beside: float,
) -> None:
    """Both of these have to bear, and the capture point be within `line_distance` of their line."""
    plan, t = pair_plan(), 1.0 - 0.5 * CONTROL.period
    a, b = plan.contacts.feet[1, :2], plan.contacts.feet[2, :2]
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    balance = balance_at(t)
    balance[Balance.COM : Balance.COM + 2] = 0.5 * (a + b) + beside * normal
    control = for_legs(CONTROL, 1.0, 0.01)
    assert control.line_distance == pytest.approx(0.03)
    assert clock_rate(plan, t, ALL, balance, CONTROL) == (1.0, "")  # of no robot: no bound
    rate, why = clock_rate(plan, t, ALL, balance, control)
    if beside < 0.03:
        assert (rate, why) == (1.0, "")
    else:
        assert rate == 0.0 and f"{beside:.3f} m off the line of the feet that stay" in why
    for row in (1, 2):
        rate, why = clock_rate(plan, t, np.arange(4) != row, balance, control)
        assert rate == 0.0 and "leg FL and RR is to lift off while another" in why


def test_how_far_off_the_line_grows_with_the_legs() -> None:
    """Unless it is given; nothing else of the settings changes, and what is given stays."""
    assert for_legs(CONTROL, 0.4, 0.02).line_distance == pytest.approx(0.02)
    assert replace(for_legs(CONTROL, 0.4, 0.02), line_distance=None) == CONTROL
    given = replace(CONTROL, line_distance=0.02)
    assert for_legs(given, 0.4, 0.02) == given


@pytest.mark.parametrize("late", [Leg.FRONT_LEFT, Leg.REAR_RIGHT])
def test_a_swing_of_two_ends_when_both_feet_bear(late: Leg) -> None:
    """Whichever of them is late is waited for; the clock names both legs while they swing."""
    plan, t = pair_plan(), 2.0 - 0.5 * CONTROL.period
    rate, why = clock_rate(plan, t, np.arange(4) != late.row, balance_at(1.0), CONTROL)
    assert rate == 0.0 and why == f"leg {late.short} has not touched down"
    assert clock_rate(plan, t, ALL, balance_at(1.0), CONTROL) == (1.0, "")
    phase = [0.0] * SIZE
    set_clock(phase, plan, 1.25)
    assert phase[GaitPhase.SWING_LEG] == 14 and phase[GaitPhase.SWING_PHASE] == pytest.approx(0.25)


def test_a_number_of_two_digits_names_two_legs() -> None:
    """Each leg of a pair is found in it, in any order, and no other; 0 is none."""
    for legs in ((), (1,), (4,), (1, 4), (3, 2)):
        number = np.array([float(swing_legs(legs))])
        assert [leg for leg in (1, 2, 3, 4) if is_swinging(number, leg)[0]] == sorted(legs)
