"""What a controller remembers of its feet and its body from tick to tick, and where."""

import numpy as np

from drake_quad.gait.legs import FloatArray

# Places in a controller's memory: each foot's hold in W (12) [m]; the foot less its planned place
# when it lifted off (12) [m]; how deep a foot has searched below the plan for ground [m]; whether
# the swing foot found ground before its time; the standing feet's mean height over the plan's [m];
# where a catching foot set out from (3) [m]; how fast the body follows its path, and how far it is
# ahead of the gait clock there [s]; how far a foot that had lost the ground has come back to its
# full load, 0 to 1, (4), or NEVER for one that has not borne yet, as a run begins;
# how much lower the body is for its legs to reach the ground [m].
HOLD, LIFTED, DEPTH, LANDED, HEIGHT, CAUGHT = 0, 12, 24, 25, 26, 27
BODY_RATE, LEAD, REGAINED, LOWER = 30, 31, 32, 36
MEMORY_SIZE = 37
NEVER = 2.0


def new_memory(feet: FloatArray) -> FloatArray:
    """What a controller remembers (MEMORY_SIZE,) as it begins, on its feet in W (4, 3) [m]."""
    memory = np.zeros(MEMORY_SIZE)
    memory[HOLD : HOLD + 12] = feet.ravel()
    memory[BODY_RATE] = np.nan
    memory[REGAINED : REGAINED + 4] = NEVER
    return memory
