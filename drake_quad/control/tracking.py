"""Where the feet are to be now; `joint_targets.py` has the joints that put them there."""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.control.foot_ways import catch_foot, higher_beside, stand_foot, swing_foot
from drake_quad.control.memory import DEPTH, HEIGHT, HOLD, LANDED
from drake_quad.control.pace import Pace
from drake_quad.gait.legs import BoolArray, FloatArray


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
