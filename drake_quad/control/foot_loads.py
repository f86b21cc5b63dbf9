"""How much of a full load each foot may carry: by the plan, by what landed or was lost, caught."""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.control.base_task import smooth_step
from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.plan_table import END, START, SWING, phase_index

LANDED_LOAD = 0.2  # how much of a full load a foot carries that has landed, as a swing ends
LOST_LOAD = 0.1  # how much of a full load is left to a foot that lost the ground


@compiled
def foot_load(phases: FloatArray, t: float, unload_time: float) -> FloatArray:
    """How much each of the four feet may carry at a time: none in the air, all in mid-stance.

    A foot takes its load up after touchdown, and gives it away before lift-off, over
    `unload_time` or the time there is on four feet, whichever is shorter. It begins with what it
    has carried since it landed: the clock passes a touchdown with the foot on the ground.

    Args:
        phases: See `phase_table`.
        t: Gait time [s].
        unload_time: [s].
    """
    load = np.ones(4)
    index = phase_index(phases, t)
    swing = int(phases[index, SWING])
    if swing >= 0:
        load[swing] = 0.0
        return load
    start, end = phases[index, START], phases[index, END]
    ramp = min(unload_time, end - start)
    before = int(phases[index - 1, SWING]) if index > 0 else -1
    after = int(phases[index + 1, SWING]) if index + 1 < len(phases) else -1
    if before >= 0:
        load[before] *= max(smooth_step((t - start) / ramp), LANDED_LOAD)
    if after >= 0:
        load[after] *= smooth_step((end - t) / ramp)
    return np.maximum(load, 1e-4)


@compiled
def correct_load(
    load: FloatArray, standing: BoolArray, bearing: FloatArray, landed: bool, regained: FloatArray
) -> None:
    """Changes the plan's loads (4,) for a swing foot that has landed, and for lost ground.

    Args:
        load: Changed in place.
        standing: Who is to stand (4,).
        bearing: 1 where a foot is sensed to bear (4,).
        landed: Whether the swing foot has landed before its time.
        regained: See REGAINED (4,).
    """
    held = 0
    for k in range(4):
        if landed and not standing[k]:
            load[k] = LANDED_LOAD
        if load[k] > 0.0 and not (standing[k] and bearing[k] < 0.5):
            held += 1
    if held > 1:
        for k in range(4):
            if standing[k]:
                back = regained[k] if bearing[k] > 0.5 else 0.0
                load[k] = min(load[k], LOST_LOAD + (1.0 - LOST_LOAD) * back)


@compiled
def caught_load(standing: BoolArray, bearing: FloatArray) -> FloatArray:
    """Loads (4,) while a push is caught: of the feet that are to stand, those that bear."""
    load, bears = np.zeros(4), False
    for k in range(4):
        if standing[k] and bearing[k] > 0.5:
            load[k], bears = 1.0, True
    if not bears:
        # Thrown off the ground there is nothing to share: be ready on all that are to stand.
        for k in range(4):
            load[k] = 1.0 if standing[k] else 0.0
    return load
