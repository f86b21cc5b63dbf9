"""The gait clock: how fast gait time runs, when it waits, and the guard of the margin."""

from math import hypot

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.ports import Balance, GaitPhase, Mode, swing_legs
from drake_quad.control.push_recovery import CALM_SPEED, balance_margin
from drake_quad.control.settings import ControlSettings
from drake_quad.jit import jit
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.phase_table import END, START, SWING, phase_index

TASK, TIME, RATE, SEGMENT, SWING_LEG, SWING_PHASE, WAITED, DONE, MODE, REVISION = (
    int(p) for p in GaitPhase
)
RUN, ERROR = int(Mode.RUN), int(Balance.VELOCITY_ERROR)


@jit
def advance_if_uneventful(
    phase: FloatArray,
    phases: FloatArray,
    task: int,
    until: float,
    period: float,
    balance: FloatArray,
    push_speed: float,
) -> bool:
    """Lets the clock go on a tick, if the tick before did and there is nothing to decide.

    There is where a foot lifts off or touches down, a segment or the task ends, or the robot is
    moved otherwise than planned.

    Args:
        phase: The clock, see GaitPhase; goes on a tick, or stays.
        phases: The plan's phases, see `phase_table`.
        task: Index of the plan's task.
        until: When the segment under way ends [s].
        period: Control period [s].
        balance: The robot's balance, see Balance.
        push_speed: Error of the base's velocity from which on it may be a push [m/s].

    Returns:
        Whether it went on.
    """
    t = phase[TIME]
    later = t + period
    if (
        int(phase[MODE]) != RUN
        or int(phase[TASK]) != task
        or phase[RATE] != 1.0
        or t <= 0.0
        or later >= until - period
        or not hypot(balance[ERROR], balance[ERROR + 1]) < push_speed
    ):
        return False
    now = phase_index(phases, later)
    if now != phase_index(phases, t):
        return False
    phase[TIME] = later
    if phases[now, SWING] >= 0.0:
        start, end = phases[now, START], phases[now, END]
        phase[SWING_PHASE] = (later - start) / (end - start)
    return True


LOOK_AHEAD = 0.4  # [s]
BRAKING = 2.5  # times that, in which the margin may run out at most: the body comes to rest late
STOPPED = 0.02  # of the clock's full rate, below which it stands


def allowed_rate(now: float, ahead: float, demanded: float) -> float:
    """The rate in [0, 1] at which a margin does not fall below what is demanded.

    It runs freely where the margin grows, or falls so slowly that it would take BRAKING times the
    time looked ahead to get to what is demanded; else as much slower as leaves it that time. So as
    the margin nears what is demanded the clock comes to a stand.

    Args:
        now: The margin [m].
        ahead: The margin at the end of the time looked ahead [m].
        demanded: The margin demanded [m].
    """
    if ahead >= now:
        return 1.0
    return min(max((now - demanded) / (BRAKING * (now - ahead)), 0.0), 1.0)


def guarded_rate(
    plan: MotionPlan, t: float, balance: FloatArray, standing: BoolArray, demanded: float
) -> float:
    """The rate that the clock may have now; 0 if it is next to nothing.

    The margin is that of the capture point over the feet that stand, and a while ahead that of
    the same moved as the plan moves the body.

    Args:
        plan: The plan that is followed.
        t: Gait time [s].
        balance: The robot's balance, see Balance.
        standing: (4,) which feet are to stand.
        demanded: The margin demanded [m].
    """
    later = min(t + LOOK_AHEAD, plan.duration)
    moved = balance.copy()
    moved[Balance.COM : Balance.COM + 2] += (plan.body.sample(later) - plan.body.sample(t))[0, :2]
    who = np.asarray(standing, dtype=np.bool_)
    # A leg that lifts off soon gives its load away before: not if the others are not enough.
    then = np.asarray(plan.contacts.phase(later).standing, dtype=np.bool_)
    fewer = not np.array_equal(then, who) and bool(np.all(who | ~then))
    if fewer and balance_margin(moved, then) < demanded:
        return 0.0
    rate = allowed_rate(balance_margin(balance, who), balance_margin(moved, who), demanded)
    return rate if rate > STOPPED else 0.0


CALM_PLACE = 0.03  # [m] of the base's place, below which the clock goes on, as below CALM_SPEED
VX, VY = Balance.VELOCITY_ERROR, Balance.VELOCITY_ERROR + 1
X, Y = Balance.PLACE_ERROR, Balance.PLACE_ERROR + 1


def clock_rate(
    plan: MotionPlan, t: float, bearing: BoolArray, balance: FloatArray, control: ControlSettings
) -> tuple[float, str]:
    """How fast the clock may go on, 0 to 1; and if it may not, why.

    Args:
        plan: The plan of the task under way.
        t: Gait time [s].
        bearing: (4,) which feet are sensed to bear.
        balance: The robot's balance, see Balance.
        control: Settings with the margins demanded; without a `line_distance`, see `for_legs`, two
            legs lift off however far the robot is off the line.
    """
    reason = _at_switch(plan, t, bearing, balance, control)
    if reason:
        return 0.0, reason
    demanded = control.margin_demanded
    if demanded <= 0.0:
        return 1.0, ""
    rate = guarded_rate(plan, t, balance, plan.contacts.phase(t).standing, demanded)
    return rate, "" if rate > 0.0 else f"beyond here the margin falls below {demanded:.3f} m"


def is_off_plan(balance: FloatArray, *, since: float, push_speed: float) -> bool:
    """Whether the robot is too far from what is wanted of it for its plan to go on, after a push.

    It comes back to a plan that stands still without swinging past it.

    Args:
        balance: The robot's balance, see Balance.
        since: Time that it has been off its plan for [s].
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
    steps = current.steps
    phase[GaitPhase.TIME] = t
    phase[GaitPhase.SEGMENT] = plan.segment_index(t)
    phase[GaitPhase.SWING_LEG] = swing_legs([step.leg for step in steps])
    phase[GaitPhase.SWING_PHASE] = (
        (t - current.start) / (current.end - current.start) if steps else 0.0
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
    for step in ended.steps:
        if not bearing[step.leg.row]:
            return f"leg {step.leg.short} has not touched down"
    if begun.steps:
        legs = " and ".join(step.leg.short for step in begun.steps)
        others = np.asarray(begun.standing, dtype=np.bool_)
        if not np.all(bearing[others]):
            return f"leg {legs} is to lift off while another foot does not bear"
        margin = balance_margin(balance, others)
        if len(begun.steps) > 1:
            if control.line_distance is not None and -margin > control.line_distance:
                return f"the robot is {-margin:.3f} m off the line of the feet that stay"
            return ""
        if margin < max(control.lift_off_margin, control.margin_demanded):
            return f"without leg {legs} the margin is {margin:.3f} m"
    return ""
