"""Where each foot is to be: in swing, in stance, or put down to catch a push.

`catch_foot`, `swing_foot` and `stand_foot` fill one row of the targets, and take a controller's
memory (see `kernel_state.py`) a tick further.
"""

from typing import NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.base_tracking import smooth_step
from drake_quad.control.kernel_state import (
    CAUGHT,
    DEPTH,
    HEIGHT,
    HOLD,
    LANDED,
    LIFTED,
    REGAINED,
    Pace,
)
from drake_quad.jit import copy_vector, jit
from drake_quad.math.curves import (
    quintic_acceleration_kernel,
    quintic_kernel,
    quintic_rate_kernel,
)
from drake_quad.planning.contact_plan import LET_GO
from drake_quad.planning.phase_table import PlannedFeet
from drake_quad.robot.legs import LEGS

MIRRORED = tuple(leg.mirrored.row for leg in LEGS)  # the row of each leg's other foot of its pair
URGENT_SEARCH = 0.3  # [m/s] downwards, of a foot that lost the ground in a push
DEEPEST = 0.01  # [m] by which a foot that lost the ground is aimed below where it is
TOUCHDOWN = 0.98  # of a swing, from which a clock that stands still waits for the ground
# Of a swing, from which on a foot is pressed down, to touch the ground at its end: earlier, a foot
# with a long way touches it some millimetres before its place.
PRESS = 0.95
# A swing foot is at its planned height over the ground as found at 1 / LEVEL_OUT of its swing.
LEVEL_OUT = 1.5
# By which a foot's ground is off the map more than the others' [m]: further off, it is no tread's
# error but another tread, and says little of the next.
MOST_MORE = 0.04
# Load comes back slowly to a foot that found the ground again: at once it would thrust itself off,
# and patter.
REGAIN_TIME = 0.2  # [s]


class FootInputs(NamedTuple):
    """What the feet's targets depend on.

    Attributes:
        planned: The plan's feet now.
        rate: How fast the gait clock runs.
        feet: The feet's centres as estimated (4, 3) in W [m].
        bearing: 1 where a foot is sensed to bear (4,).
        catch: A foot that catches a push, see `ports.Catch`.
        urgent: Whether a push is being caught: then lost ground is searched for in haste.
        unloaded: Which standing feet are about to lift off and have given their load away (4,).
    """

    planned: PlannedFeet
    rate: float
    feet: FloatArray
    bearing: FloatArray
    catch: FloatArray
    urgent: bool
    unloaded: BoolArray


class FootTargets(NamedTuple):
    """Where the feet are to be, in W.

    Attributes:
        place: Places (4, 3) [m].
        velocity: Velocities (4, 3) [m/s].
        acceleration: Accelerations (4, 3) [m/s^2].
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@jit
def catch_foot(
    k: int, now: FootInputs, memory: FloatArray, target: FootTargets, pace: Pace
) -> None:
    """A foot goes where a catch says, from where it was; late, it searches downwards.

    Args:
        k: Row of the foot.
        now: The inputs.
        memory: The controller's memory; goes on a tick.
        target: Result, in row `k`.
        pace: Times and speeds.
    """
    catch, place, velocity = now.catch, target.place, target.velocity
    memory[REGAINED + k] = 1.0
    if catch[5] <= pace.period:
        copy_vector(memory[CAUGHT : CAUGHT + 3], now.feet[k])
    s = min(catch[5] / catch[4], 1.0)
    along, speed = quintic_kernel(s), quintic_rate_kernel(s) / catch[4]
    for i in range(3):
        way = catch[1 + i] - memory[CAUGHT + i]
        place[k, i] = memory[CAUGHT + i] + along * way
        velocity[k, i] = speed * way
    place[k, 2] += catch[6] * 16.0 * (s * (1.0 - s)) ** 2
    velocity[k, 2] += catch[6] * 32.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / catch[4]
    late = max(catch[5] - catch[4], 0.0)
    place[k, 2] -= pace.touchdown_press * smooth_step(5.0 * s - 4.0)
    place[k, 2] -= 4.0 * pace.search_speed * late
    copy_vector(memory[HOLD + 3 * k : HOLD + 3 * k + 3], now.feet[k])
    memory[LIFTED + 3 * k : LIFTED + 3 * k + 3] = 0.0


@jit
def fade_out(s: float, rate: float) -> tuple[float, float, float]:
    """A share that goes from 1 at s = 0 to 0 at s = 1 as a quintic, and its two time derivatives.

    Args:
        s: How far it has gone; beyond 1 it stays.
        rate: How fast s grows [1/s].
    """
    s = min(max(s, 0.0), 1.0)
    return (
        1.0 - quintic_kernel(s),
        -rate * quintic_rate_kernel(s),
        -rate * rate * quintic_acceleration_kernel(s),
    )


@jit
def swing_foot(
    k: int,
    now: FootInputs,
    searched: float,
    more: float,
    memory: FloatArray,
    target: FootTargets,
    pace: Pace,
) -> None:
    """A swing starts where the foot really stood, and ends on the plan's place or on ground.

    It is on the plan's way soon, for that way clears the nosings, and more slowly at its height.
    Where there is no ground, and the clock waits, it searches downwards. Ground that it finds
    before its time it presses on, and goes on down if that gives way.

    Args:
        k: Row of the foot.
        now: The inputs.
        searched: Depth that the foot has searched before [m].
        more: Height error of the neighbour's ground, see `higher_beside` [m].
        memory: The controller's memory; goes on a tick.
        target: Result, in row `k`.
        pace: Times and speeds.
    """
    planned, s, rate, place = now.planned, now.planned.swing_phase, now.rate, target.place
    hold = memory[HOLD + 3 * k : HOLD + 3 * k + 3]
    lifted = memory[LIFTED + 3 * k : LIFTED + 3 * k + 3]
    memory[REGAINED + k] = 1.0
    if s < 0.5:
        memory[LANDED + k] = 0.0
    if memory[LANDED + k] == 0.0 and s > 0.5 and now.bearing[k] > 0.5:
        memory[LANDED + k] = 1.0
        copy_vector(hold, now.feet[k])
        hold[2] -= pace.touchdown_press
    if memory[LANDED + k] == 0.0:
        if rate == 0.0 and s > TOUCHDOWN:
            memory[DEPTH + k] = searched + pace.landing_speed * pace.period
        clock = rate * planned.phase_rate
        aside = fade_out(LET_GO * s, LET_GO * clock)
        above = fade_out(LEVEL_OUT * s, LEVEL_OUT * clock)
        ground = memory[HEIGHT] + more
        for i in range(3):
            fade, off = (aside, lifted[i]) if i < 2 else (above, lifted[2] - ground)
            place[k, i] = planned.place[k, i] + fade[0] * off
            target.velocity[k, i] = rate * planned.velocity[k, i] + fade[1] * off
            target.acceleration[k, i] = rate * rate * planned.acceleration[k, i] + fade[2] * off
        place[k, 2] += ground
        place[k, 2] -= pace.touchdown_press * smooth_step((s - PRESS) / (1.0 - PRESS))
        place[k, 2] -= memory[DEPTH + k]
        if memory[DEPTH + k] > searched:  # or the joints' damping would hold it back
            target.velocity[k, 2] -= pace.landing_speed
        copy_vector(hold, place[k])
        return
    if now.bearing[k] < 0.5:
        hold[2] -= pace.search_speed * pace.period
    for i in range(3):
        lifted[i] = hold[i] - planned.place[k, i]
        place[k, i] = hold[i]


@jit
def higher_beside(k: int, planned: PlannedFeet, memory: FloatArray, height: float) -> float:
    """How much more than all feet a foot's other foot of its pair stands over its plan [m].

    A swing ends on ground that is as much higher than the map's as where its neighbour stands: if
    rises are unlike the map's the error grows tread by tread, and the other pair's feet are treads
    behind or ahead.

    Args:
        k: Row of the foot.
        planned: The plan's feet.
        memory: The controller's memory; it does not change.
        height: Mean height of the standing feet over their plan [m].
    """
    beside = MIRRORED[k]
    more = 0.0
    if planned.standing[beside]:
        more = memory[HOLD + 3 * beside + 2] - planned.place[beside, 2] - height
    return min(max(more, -MOST_MORE), MOST_MORE)


@jit
def stand_foot(
    k: int, now: FootInputs, follow: float, memory: FloatArray, target: FootTargets, pace: Pace
) -> None:
    """A standing foot is held where it really stands; one that lost the ground goes down after it.

    Not one that is about to lift off: without load it is not sensed to bear, on ground that is
    there. Its swing would begin below the ground, and drag it along.

    Args:
        k: Row of the foot.
        now: The inputs.
        follow: Share of the way to where it stands that its hold goes a tick.
        memory: The controller's memory; goes on a tick.
        target: Result, in row `k`.
        pace: Times and speeds.
    """
    feet = now.feet
    hold = memory[HOLD + 3 * k : HOLD + 3 * k + 3]
    lifted = memory[LIFTED + 3 * k : LIFTED + 3 * k + 3]
    if now.bearing[k] > 0.5:
        if memory[REGAINED + k] == 0.0:
            hold[2] = feet[k, 2]  # it had been aimed below the ground
        memory[REGAINED + k] = min(memory[REGAINED + k] + pace.period / REGAIN_TIME, 1.0)
        for i in range(3):
            hold[i] += follow * (feet[k, i] - hold[i])
    elif not now.unloaded[k]:
        if memory[REGAINED + k] <= 1.0:
            memory[REGAINED + k] = 0.0
        if feet[k, 2] - hold[2] < DEEPEST:  # where it stood there is no ground: down after it
            hold[2] -= (URGENT_SEARCH if now.urgent else pace.search_speed) * pace.period
    for i in range(3):
        lifted[i] = hold[i] - now.planned.place[k, i]
        target.place[k, i] = hold[i]


@jit
def compute_foot_targets(
    now: FootInputs, memory: FloatArray, pace: Pace
) -> tuple[FootTargets, FloatArray]:
    """Where the feet are to be.

    A standing foot is held where it really stands. A swing starts where the foot really stood and
    ends where it was planned to, or where it meets ground before; where there is no ground it
    searches downwards while the clock waits. A catching foot goes where the catch says.

    Args:
        now: The inputs.
        memory: The controller's memory, see MEMORY_SIZE; it does not change.
        pace: Times and speeds.

    Returns:
        The targets, and the new memory.
    """
    new, planned = memory.copy(), now.planned
    target = FootTargets(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3)))
    follow = min(pace.period / max(pace.foothold_time, pace.period), 1.0)
    caught = int(now.catch[0]) - 1
    error, count = 0.0, 0
    for k in range(4):
        new[DEPTH + k] = 0.0
        if k == caught:
            catch_foot(k, now, new, target, pace)
        elif not planned.standing[k] and not now.urgent and not np.isnan(planned.swing_phase):
            more = higher_beside(k, planned, memory, new[HEIGHT])
            swing_foot(k, now, memory[DEPTH + k], more, new, target, pace)
        else:
            new[LANDED + k] = 0.0
            stand_foot(k, now, follow, new, target, pace)
            # Where the plan has stopped for a push a foot may stand elsewhere than its place in it,
            # which of a foot in the air is no foothold at all: that says nothing of the ground.
            if now.bearing[k] > 0.5 and not now.urgent:
                error += new[HOLD + 3 * k + 2] - planned.place[k, 2]
                count += 1
    if count > 0:
        blend = min(pace.period / max(pace.height_time, pace.period), 1.0)
        new[HEIGHT] += blend * (error / count - new[HEIGHT])
    return target, new
