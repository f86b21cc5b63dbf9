"""Where each foot is to be: in swing, in stance, or put down to catch a push.

`catch_foot`, `swing_foot` and `stand_foot` fill row `k` of the results `place` [m], `velocity`
[m/s] and `acceleration` [m/s^2], each (4, 3) in W, and take a controller's memory (see
`kernel_state.py`) a tick further. The plan's feet are (4, 3) in W, too, their derivatives by gait
time; feet as estimated are (4, 3) in W [m].
"""

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
from drake_quad.robot.legs import LEGS

MIRRORED = tuple(leg.mirrored.row for leg in LEGS)  # the row of each leg's other foot of its pair
URGENT_SEARCH = 0.3  # [m/s] downwards, of a foot that lost the ground in a push
DEEPEST = 0.01  # [m] by which a foot that lost the ground is aimed below where it is
TOUCHDOWN = 0.98  # of a swing, from which a clock that stands still waits for the ground
# By which a foot's ground is off the map more than the others' [m]: further off, it is no tread's
# error but another tread, and says little of the next.
MOST_MORE = 0.04
# Load comes back slowly to a foot that found the ground again: at once it would thrust itself off,
# and patter.
REGAIN_TIME = 0.2  # [s]


@jit
def catch_foot(
    k: int,
    catch: FloatArray,
    feet: FloatArray,
    memory: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    pace: Pace,
) -> None:
    """A foot goes where a catch says, from where it was; late, it searches downwards.

    Args:
        k: Its row.
        catch: See `compute_foot_targets`.
        feet: As estimated (4, 3) [m].
        memory: Goes on a tick.
        place: Result.
        velocity: Result.
        pace: Times and speeds.
    """
    memory[REGAINED + k] = 1.0
    if catch[5] <= pace.period:
        copy_vector(memory[CAUGHT : CAUGHT + 3], feet[k])
    s = min(catch[5] / catch[4], 1.0)
    along = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    speed = 30.0 * (s * (1.0 - s)) ** 2 / catch[4]
    for i in range(3):
        way = catch[1 + i] - memory[CAUGHT + i]
        place[k, i] = memory[CAUGHT + i] + along * way
        velocity[k, i] = speed * way
    place[k, 2] += catch[6] * 16.0 * (s * (1.0 - s)) ** 2
    velocity[k, 2] += catch[6] * 32.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / catch[4]
    late = max(catch[5] - catch[4], 0.0)
    place[k, 2] -= pace.touchdown_press * smooth_step(5.0 * s - 4.0)
    place[k, 2] -= 4.0 * pace.search_speed * late
    copy_vector(memory[HOLD + 3 * k : HOLD + 3 * k + 3], feet[k])
    memory[LIFTED + 3 * k : LIFTED + 3 * k + 3] = 0.0


@jit
def swing_foot(
    k: int,
    planned: FloatArray,
    planned_velocity: FloatArray,
    planned_acceleration: FloatArray,
    s: float,
    rate: float,
    feet: FloatArray,
    bearing: FloatArray,
    searched: float,
    more: float,
    memory: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    pace: Pace,
) -> None:
    """A swing starts where the foot really stood, and ends on the plan's place or on ground.

    Where there is none, and the clock waits, it searches downwards. Ground that it finds before
    its time it presses on, and goes on down if that gives way.

    Args:
        k: The foot's row.
        planned: See `compute_foot_targets`, and the next two.
        planned_velocity: The same.
        planned_acceleration: The same.
        s: Of the swing, 0 to 1.
        rate: Of the gait clock.
        feet: As estimated (4, 3) [m].
        bearing: 1 where a foot is sensed to bear (4,).
        searched: How deep it has searched before [m].
        more: See `higher_beside` [m].
        memory: Goes on a tick.
        place: Result.
        velocity: Result.
        acceleration: Result.
        pace: Times and speeds.
    """
    hold = memory[HOLD + 3 * k : HOLD + 3 * k + 3]
    lifted = memory[LIFTED + 3 * k : LIFTED + 3 * k + 3]
    memory[REGAINED + k] = 1.0
    if s < 0.5:
        memory[LANDED] = 0.0
    if memory[LANDED] == 0.0 and s > 0.5 and bearing[k] > 0.5:
        memory[LANDED] = 1.0
        copy_vector(hold, feet[k])
        hold[2] -= pace.touchdown_press
    if memory[LANDED] == 0.0:
        if rate == 0.0 and s > TOUCHDOWN:
            memory[DEPTH] = searched + pace.search_speed * pace.period
        rest = 1.0 - smooth_step(1.5 * s)
        for i in range(3):
            place[k, i] = planned[k, i] + rest * lifted[i]
            velocity[k, i] = rate * planned_velocity[k, i]
            acceleration[k, i] = rate * rate * planned_acceleration[k, i]
        place[k, 2] += (1.0 - rest) * (memory[HEIGHT] + more)
        place[k, 2] -= pace.touchdown_press * smooth_step(5.0 * s - 4.0) + memory[DEPTH]
        copy_vector(hold, place[k])
        return
    if bearing[k] < 0.5:
        hold[2] -= pace.search_speed * pace.period
    for i in range(3):
        lifted[i] = hold[i] - planned[k, i]
        place[k, i] = hold[i]


@jit
def higher_beside(
    k: int, planned: FloatArray, standing: BoolArray, memory: FloatArray, height: float
) -> float:
    """How much more than all feet a foot's other foot of its pair stands over its plan [m].

    A swing ends on ground that is as much higher than the map's as where its neighbour stands: if
    rises are unlike the map's the error grows tread by tread, and the other pair's feet are treads
    behind or ahead.

    Args:
        k: The foot's row.
        planned: See `compute_foot_targets`.
        standing: The same.
        memory: Not changed.
        height: That all feet stand over their plan [m].
    """
    beside = MIRRORED[k]
    more = 0.0
    if standing[beside]:
        more = memory[HOLD + 3 * beside + 2] - planned[beside, 2] - height
    return min(max(more, -MOST_MORE), MOST_MORE)


@jit
def stand_foot(
    k: int,
    planned: FloatArray,
    feet: FloatArray,
    bearing: FloatArray,
    urgent: bool,
    follow: float,
    memory: FloatArray,
    place: FloatArray,
    pace: Pace,
) -> None:
    """A standing foot is held where it really stands; one that lost the ground goes down after it.

    Args:
        k: Its row.
        planned: See `compute_foot_targets`.
        feet: As estimated (4, 3) [m].
        bearing: 1 where a foot is sensed to bear (4,).
        urgent: See `compute_foot_targets`.
        follow: Share of the way to where it stands that its hold goes a tick.
        memory: Goes on a tick.
        place: Result.
        pace: Times and speeds.
    """
    hold = memory[HOLD + 3 * k : HOLD + 3 * k + 3]
    lifted = memory[LIFTED + 3 * k : LIFTED + 3 * k + 3]
    if bearing[k] > 0.5:
        if memory[REGAINED + k] == 0.0:
            hold[2] = feet[k, 2]  # it had been aimed below the ground
        memory[REGAINED + k] = min(memory[REGAINED + k] + pace.period / REGAIN_TIME, 1.0)
        for i in range(3):
            hold[i] += follow * (feet[k, i] - hold[i])
    else:
        if memory[REGAINED + k] <= 1.0:
            memory[REGAINED + k] = 0.0
        if feet[k, 2] - hold[2] < DEEPEST:  # where it stood there is no ground: down after it
            hold[2] -= (URGENT_SEARCH if urgent else pace.search_speed) * pace.period
    for i in range(3):
        lifted[i] = hold[i] - planned[k, i]
        place[k, i] = hold[i]


@jit
def compute_foot_targets(
    planned: FloatArray,
    planned_velocity: FloatArray,
    planned_acceleration: FloatArray,
    standing: BoolArray,
    swing_phase: float,
    rate: float,
    feet: FloatArray,
    bearing: FloatArray,
    catch: FloatArray,
    urgent: bool,
    memory: FloatArray,
    pace: Pace,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Where the feet are to be.

    A standing foot is held where it really stands. A swing starts where the foot really stood and
    ends where it was planned to, or where it meets ground before; where there is no ground it
    searches downwards while the clock waits. A catching foot goes where the catch says.

    Args:
        planned: The plan's feet in W (4, 3) [m].
        planned_velocity: By gait time (4, 3).
        planned_acceleration: By gait time (4, 3).
        standing: Who is to stand (4,).
        swing_phase: s in [0, 1] of the swing, nan if nobody swings.
        rate: How fast the gait clock runs.
        feet: The feet in W as estimated (4, 3) [m].
        bearing: 1 where a foot is sensed to bear (4,).
        catch: Leg (1 to 4, 0 for none), place (3) [m], duration, elapsed time [s], lift [m].
        urgent: Whether a push is being caught: then lost ground is searched for in haste.
        memory: See MEMORY_SIZE; not changed.
        pace: Times and speeds.

    Returns:
        Places, velocities and accelerations of the feet in W (4, 3), and the new memory.
    """
    new = memory.copy()
    place, velocity, acceleration = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))
    follow = min(pace.period / max(pace.foothold_time, pace.period), 1.0)
    new[DEPTH] = 0.0
    caught = int(catch[0]) - 1
    error, count, swinging = 0.0, 0, False
    for k in range(4):
        if k == caught:
            swinging = True
            catch_foot(k, catch, feet, new, place, velocity, pace)
        elif not standing[k] and not urgent and not np.isnan(swing_phase):
            swinging = True
            more = higher_beside(k, planned, standing, memory, new[HEIGHT])
            swing_foot(
                k, planned, planned_velocity, planned_acceleration, swing_phase, rate, feet,
                bearing, memory[DEPTH], more, new, place, velocity, acceleration, pace,
            )  # fmt: skip
        else:
            stand_foot(k, planned, feet, bearing, urgent, follow, new, place, pace)
            if bearing[k] > 0.5:
                error += new[HOLD + 3 * k + 2] - planned[k, 2]
                count += 1
    if not swinging:
        new[LANDED] = 0.0
    if count > 0:
        blend = min(pace.period / max(pace.height_time, pace.period), 1.0)
        new[HEIGHT] += blend * (error / count - new[HEIGHT])
    return place, velocity, acceleration, new
