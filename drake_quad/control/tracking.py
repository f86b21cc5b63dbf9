"""Where the feet are to be now; `joint_targets.py` has the joints that put them there."""

from typing import NamedTuple

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.control.base_task import smooth_step
from drake_quad.gait.legs import LEGS, BoolArray, FloatArray

# Places in a controller's memory: each foot's hold in W (12) [m]; the foot less its planned place
# when it lifted off (12) [m]; how deep a foot has searched below the plan for ground [m]; whether
# the swing foot found ground before its time; the standing feet's mean height over the plan's [m];
# where a catching foot set out from (3) [m]; how fast the body follows its path, and how far it is
# ahead of the gait clock there [s]; how far a foot that had lost the ground has come back to its
# full load, 0 to 1, (4), or NEVER for one that has not borne yet, as a run begins.
HOLD, LIFTED, DEPTH, LANDED, HEIGHT, CAUGHT = 0, 12, 24, 25, 26, 27
BODY_RATE, LEAD, REGAINED = 30, 31, 32
MEMORY_SIZE = 36
NEVER = 2.0
MIRRORED = tuple(leg.mirrored.row for leg in LEGS)  # the row of each leg's other foot of its pair
URGENT_SEARCH = 0.3  # [m/s] downwards, of a foot that lost the ground in a push
DEEPEST = 0.01  # [m] by which a foot that lost the ground is aimed below where it is
TOUCHDOWN = 0.98  # of a swing, from which a clock that stands still waits for the ground
# By which a foot's ground is off the map more than the others' [m]: further off, it is no tread's
# error but another tread, and says little of the next.
MOST_MORE = 0.04
LOST_LOAD = 0.1  # how much of a full load is left to a foot that lost the ground
# From then on it comes back slowly: at once it would thrust itself off, and patter.
REGAIN_TIME = 0.2  # [s] in which a foot that found the ground again takes its load up


def new_memory(feet: FloatArray) -> FloatArray:
    """What a controller remembers (MEMORY_SIZE,) as it begins, on its feet in W (4, 3) [m]."""
    memory = np.zeros(MEMORY_SIZE)
    memory[HOLD : HOLD + 12] = feet.ravel()
    memory[BODY_RATE] = np.nan
    memory[REGAINED : REGAINED + 4] = NEVER
    return memory


class Pace(NamedTuple):
    """Times and speeds of `place_feet`; see ControlSettings.

    Attributes:
        period: Of the controller [s].
        foothold_time: [s].
        touchdown_press: [m].
        search_speed: [m/s].
        height_time: Over which the body follows the height of the ground as found [s].
    """

    period: float
    foothold_time: float
    touchdown_press: float
    search_speed: float
    height_time: float


@compiled
def place_feet(
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
        hold = new[HOLD + 3 * k : HOLD + 3 * k + 3]
        lifted = new[LIFTED + 3 * k : LIFTED + 3 * k + 3]
        if k == caught:
            swinging = True
            new[REGAINED + k] = 1.0
            if catch[5] <= pace.period:
                new[CAUGHT : CAUGHT + 3] = feet[k]
            s = min(catch[5] / catch[4], 1.0)
            along = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
            speed = 30.0 * (s * (1.0 - s)) ** 2 / catch[4]
            for i in range(3):
                way = catch[1 + i] - new[CAUGHT + i]
                place[k, i] = new[CAUGHT + i] + along * way
                velocity[k, i] = speed * way
            place[k, 2] += catch[6] * 16.0 * (s * (1.0 - s)) ** 2
            velocity[k, 2] += catch[6] * 32.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / catch[4]
            late = max(catch[5] - catch[4], 0.0)
            place[k, 2] -= pace.touchdown_press * smooth_step(5.0 * s - 4.0)
            place[k, 2] -= 4.0 * pace.search_speed * late
            hold[:] = feet[k]
            lifted[:] = 0.0
            continue
        if not standing[k] and not urgent and not np.isnan(swing_phase):
            swinging = True
            new[REGAINED + k] = 1.0
            s = swing_phase
            if s < 0.5:
                new[LANDED] = 0.0
            if new[LANDED] == 0.0 and s > 0.5 and bearing[k] > 0.5:
                new[LANDED] = 1.0
                hold[:] = feet[k]
                hold[2] -= pace.touchdown_press
            if new[LANDED] == 0.0:
                if rate == 0.0 and s > TOUCHDOWN:
                    new[DEPTH] = memory[DEPTH] + pace.search_speed * pace.period
                rest = 1.0 - smooth_step(1.5 * s)
                for i in range(3):
                    place[k, i] = planned[k, i] + rest * lifted[i]
                    velocity[k, i] = rate * planned_velocity[k, i]
                    acceleration[k, i] = rate * rate * planned_acceleration[k, i]
                # It ends on ground that is as much higher than the map's as where its neighbour
                # stands: if rises are unlike the map's the error grows tread by tread, and the
                # other pair's feet are treads behind or ahead.
                beside = MIRRORED[k]
                more = 0.0
                if standing[beside]:
                    more = memory[HOLD + 3 * beside + 2] - planned[beside, 2] - new[HEIGHT]
                more = min(max(more, -MOST_MORE), MOST_MORE)
                place[k, 2] += (1.0 - rest) * (new[HEIGHT] + more)
                place[k, 2] -= pace.touchdown_press * smooth_step(5.0 * s - 4.0) + new[DEPTH]
                hold[:] = place[k]
                continue
            # Found before its time: it presses there, and goes on down if the ground gives way.
            if bearing[k] < 0.5:
                hold[2] -= pace.search_speed * pace.period
            for i in range(3):
                lifted[i] = hold[i] - planned[k, i]
                place[k, i] = hold[i]
            continue
        if bearing[k] > 0.5:
            if new[REGAINED + k] == 0.0:
                hold[2] = feet[k, 2]  # it had been aimed below the ground
            new[REGAINED + k] = min(new[REGAINED + k] + pace.period / REGAIN_TIME, 1.0)
            for i in range(3):
                hold[i] += follow * (feet[k, i] - hold[i])
            error += hold[2] - planned[k, 2]
            count += 1
        else:
            if new[REGAINED + k] <= 1.0:
                new[REGAINED + k] = 0.0
            if feet[k, 2] - hold[2] < DEEPEST:  # where it stood there is no ground: down after it
                hold[2] -= (URGENT_SEARCH if urgent else pace.search_speed) * pace.period
        for i in range(3):
            lifted[i] = hold[i] - planned[k, i]
            place[k, i] = hold[i]
    if not swinging:
        new[LANDED] = 0.0
    if count > 0:
        blend = min(pace.period / max(pace.height_time, pace.period), 1.0)
        new[HEIGHT] += blend * (error / count - new[HEIGHT])
    return place, velocity, acceleration, new
