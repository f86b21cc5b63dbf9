"""The vectors on the ports between gait clock and controllers."""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from drake_quad.common import BoolArray


class GaitPhase(IntEnum):
    """Places in the `gait_phase` vector.

    TASK: Index of the mission's task under way.
    TIME: Gait time in it [s].
    RATE: How fast the gait clock runs, from 0 to 1; 0 while it waits.
    SEGMENT: Index of the segment in the task's plan.
    SWING_LEG: 1 to 4, or 0 while all four stand; of two legs both digits, see `swing_legs`.
    SWING_PHASE: s in [0, 1] of the swing, 0 while all four stand.
    WAITED: How long the clock has waited in all [s].
    DONE: 1 once the mission is over.
    MODE: What the clock is doing, see Mode.
    REVISION: How often the task's plan was to be made anew from the feet as they stand.
    """

    TASK = 0
    TIME = 1
    RATE = 2
    SEGMENT = 3
    SWING_LEG = 4
    SWING_PHASE = 5
    WAITED = 6
    DONE = 7
    MODE = 8
    REVISION = 9


class Mode(IntEnum):
    """What the gait clock is doing.

    RUN: The plan is followed (the clock may wait, at a switch).
    CATCH: A push is caught: a foot is put down where it holds the robot.
    SETTLE: All four feet stand until the robot is calm.
    REPLAN: The plan from there on is being made.
    """

    RUN = 0
    CATCH = 1
    SETTLE = 2
    REPLAN = 3


class Catch(IntEnum):
    """Places in the `catch` vector: a foot on its way to where it catches a push.

    LEG: 1 to 4, 0 for none.
    X, Y, Z: Where its foot's centre is to stand in W [m].
    DURATION: How long it takes there [s].
    ELAPSED: How long it is under way [s].
    LIFT: How high it is lifted on the way [m].
    """

    LEG = 0
    X = 1
    Y = 2
    Z = 3
    DURATION = 4
    ELAPSED = 5
    LIFT = 6


class Balance(IntEnum):
    """Places in the `balance_estimated` vector: what the clock needs to know of the robot.

    COM: The whole robot's centre of mass in W, 3 entries [m].
    ACCELERATION: The base's acceleration as the controller wants it, x and y in W, 2 entries
        [m/s^2]: the plan's, and what brakes it where the clock waits.
    VELOCITY_ERROR: The base's velocity less what the controller wants, x and y in W, 2 entries
        [m/s].
    FEET: The feet's centres in W, 12 entries [m].
    BODY: p_WB and the heading, 4 entries [m], [rad].
    PLACE_ERROR: The base's place less what the controller wants, x and y in W, 2 entries [m].
    """

    COM = 0
    ACCELERATION = 3
    VELOCITY_ERROR = 5
    FEET = 7
    BODY = 19
    PLACE_ERROR = 23


def swing_legs(legs: Sequence[int]) -> int:
    """The number of the legs that swing: 0 for none, 1 to 4 for one, 14 for legs 1 and 4."""
    number = 0
    for leg in sorted(int(leg) for leg in legs):
        number = 10 * number + leg
    return number


def is_swinging(numbers: np.ndarray, leg: int) -> BoolArray:
    """Whether a leg is among those that swing, see `swing_legs`, in each row (N,)."""
    return np.asarray((numbers % 10 == leg) | (numbers // 10 == leg))


SIZE = len(GaitPhase)
CATCH_SIZE = len(Catch)
BALANCE_SIZE = 25
