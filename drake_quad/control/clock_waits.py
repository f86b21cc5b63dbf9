"""What the gait clock waits for: feet that bear, a margin, a robot that is back from a push."""

from math import hypot

import numpy as np

from drake_quad.control.margin_guard import guarded_rate
from drake_quad.control.ports import Balance, GaitPhase
from drake_quad.control.push_reflex import balance_margin
from drake_quad.control.settings import ControlSettings
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.motion_plan import MotionPlan

# Of the base against what the controller wants, below which the clock goes on.
CALM_SPEED = 0.04  # [m/s]
CALM_PLACE = 0.03  # [m]
VX, VY = Balance.VELOCITY_ERROR, Balance.VELOCITY_ERROR + 1
X, Y = Balance.PLACE_ERROR, Balance.PLACE_ERROR + 1


def clock_rate(
    plan: MotionPlan, t: float, bearing: BoolArray, balance: FloatArray, control: ControlSettings
) -> tuple[float, str]:
    """How fast the clock may go on, 0 to 1; and if it may not, why.

    Args:
        plan: Of the task under way.
        t: The clock [s].
        bearing: (4,) which feet are sensed to bear.
        balance: See Balance.
        control: With the margins that are asked for.
    """
    reason = _at_switch(plan, t, bearing, balance, control)
    if reason:
        return 0.0, reason
    demanded = control.margin_demanded
    if demanded <= 0.0:
        return 1.0, ""
    rate = guarded_rate(plan, t, balance, plan.contacts.phase(t).standing, demanded)
    return rate, "" if rate > 0.0 else f"beyond here the margin falls below {demanded:.3f} m"


def is_shaken(balance: FloatArray, *, since: float, push_speed: float) -> bool:
    """Whether the robot is too far from what is wanted of it for its plan to go on, after a push.

    It comes back to a plan that stands still without swinging past it.

    Args:
        balance: See Balance.
        since: For how long it has been [s].
        push_speed: Error of the base's velocity from which on it may be a push [m/s].
    """
    speed = hypot(balance[VX], balance[VY])
    if since == 0.0:
        return speed > push_speed
    if speed > CALM_SPEED:
        return True
    return hypot(balance[X], balance[Y]) > CALM_PLACE


def set_clock(phase: list[float], plan: MotionPlan, t: float) -> None:
    """Sets the clock to a time [s] within a task, with all in GaitPhase that follows from it."""
    current = plan.contacts.phase(t)
    step = current.step
    phase[GaitPhase.TIME] = t
    phase[GaitPhase.SEGMENT] = plan.segment_index(t)
    phase[GaitPhase.SWING_LEG] = 0 if step is None else int(step.leg)
    phase[GaitPhase.SWING_PHASE] = (
        0.0 if step is None else (t - current.start) / (current.end - current.start)
    )


def begin_task(phase: list[float], task: int) -> None:
    """Sets the clock to the beginning of a task."""
    phase[GaitPhase.TASK] = task
    for name in ("REVISION", "TIME", "SEGMENT", "SWING_LEG", "SWING_PHASE"):
        phase[GaitPhase[name]] = 0.0


def _at_switch(
    plan: MotionPlan, t: float, bearing: BoolArray, balance: FloatArray, control: ControlSettings
) -> str:
    """Why the clock may not go on past the switch that the next tick would cross, if so."""
    now, after = plan.contacts.phase_index(t), plan.contacts.phase_index(t + control.period)
    if now == after:
        return ""
    ended, begun = plan.contacts.phases[now], plan.contacts.phases[after]
    if ended.step is not None and not bearing[ended.step.leg.row]:
        return f"leg {ended.step.leg.short} has not touched down"
    if begun.step is not None:
        leg = begun.step.leg
        others = np.arange(4) != leg.row
        if not np.all(bearing[others]):
            return f"leg {leg.short} is to lift off while another foot does not bear"
        margin = balance_margin(balance, others)
        if margin < max(control.lift_off_margin, control.margin_demanded):
            return f"without leg {leg.short} the margin is {margin:.3f} m"
    return ""
