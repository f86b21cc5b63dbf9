"""The `gait_phase` port: a vector with these entries."""

from enum import IntEnum


class GaitPhase(IntEnum):
    """Places in the `gait_phase` vector.

    TASK: Index of the mission's task under way.
    TIME: Gait time in it [s].
    RATE: How fast the gait clock runs: 1, or 0 while it waits.
    SEGMENT: Index of the segment in the task's plan.
    SWING_LEG: 1 to 4, or 0 while all four stand.
    SWING_PHASE: s in [0, 1] of the swing, 0 while all four stand.
    WAITED: How long the clock has waited in all [s].
    DONE: 1 once the mission is over.
    """

    TASK = 0
    TIME = 1
    RATE = 2
    SEGMENT = 3
    SWING_LEG = 4
    SWING_PHASE = 5
    WAITED = 6
    DONE = 7


SIZE = len(GaitPhase)
