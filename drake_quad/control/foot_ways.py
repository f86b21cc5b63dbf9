"""Where one foot is to be: caught in a push, swung, or held where it stands.

`catch_foot`, `swing_foot` and `stand_foot` fill row `k` of the results `place` [m], `velocity`
[m/s] and `acceleration` [m/s^2], each (4, 3) in W, and take a controller's memory (see `memory.py`)
a tick further. The plan's feet are (4, 3) in W, too, their derivatives by gait time; feet as
estimated are (4, 3) in W [m].
"""

from drake_quad.compiled import compiled, copy_vector
from drake_quad.control.base_task import smooth_step
from drake_quad.control.memory import (
    CAUGHT,
    DEPTH,
    HEIGHT,
    HOLD,
    LANDED,
    LIFTED,
    REGAINED,
)
from drake_quad.control.pace import Pace
from drake_quad.gait.legs import LEGS, BoolArray, FloatArray

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


@compiled
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
        catch: See `place_feet`.
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


@compiled
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
        planned: See `place_feet`, and the next two.
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


@compiled
def higher_beside(
    k: int, planned: FloatArray, standing: BoolArray, memory: FloatArray, height: float
) -> float:
    """How much more than all feet a foot's other foot of its pair stands over its plan [m].

    A swing ends on ground that is as much higher than the map's as where its neighbour stands: if
    rises are unlike the map's the error grows tread by tread, and the other pair's feet are treads
    behind or ahead.

    Args:
        k: The foot's row.
        planned: See `place_feet`.
        standing: The same.
        memory: Not changed.
        height: That all feet stand over their plan [m].
    """
    beside = MIRRORED[k]
    more = 0.0
    if standing[beside]:
        more = memory[HOLD + 3 * beside + 2] - planned[beside, 2] - height
    return min(max(more, -MOST_MORE), MOST_MORE)


@compiled
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
        planned: See `place_feet`.
        feet: As estimated (4, 3) [m].
        bearing: 1 where a foot is sensed to bear (4,).
        urgent: See `place_feet`.
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
