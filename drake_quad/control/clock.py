"""The gait clock's common tick: nothing happens but that time goes on."""

from math import hypot

from drake_quad.compiled import compiled
from drake_quad.control.ports import Balance, GaitPhase, Mode
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.plan_table import END, START, SWING, phase_index

TASK, TIME, RATE, SEGMENT, SWING_LEG, SWING_PHASE, WAITED, DONE, MODE, REVISION = (
    int(p) for p in GaitPhase
)
RUN, ERROR = int(Mode.RUN), int(Balance.VELOCITY_ERROR)


@compiled
def run_on(
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
        phase: See GaitPhase; goes on a tick, or stays.
        phases: The plan's, see `phase_table`.
        task: That the plan is for.
        until: When the segment under way ends [s].
        period: A tick [s].
        balance: See Balance.
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
