"""Structured array types of the control loop, which its compiled kernels read and write.

A kernel's call costs by the number of its arguments, and a NamedTuple counts field by field. A
record is an array of one element, whose fields have the names that the NamedTuples have: kernels
that take those take a part of a record as well.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray

# ------------------------------------------------------------------------------------------------
# What a tick works on, as records: a compiled kernel takes one in one piece, whatever it holds.
# ------------------------------------------------------------------------------------------------


# One element of such an array, its fields read as attributes: by numba, and by numpy's recarray.
Record = Any
Records = NDArray[np.void]
Dtype = np.dtype[np.void]
Shape = tuple[int, ...]


def record_type(fields: Mapping[str, Shape | Dtype]) -> Dtype:
    """The type of a record of float arrays by their shapes, () for a number, and of records."""
    columns: list[Any] = [
        (name, np.float64, what) if isinstance(what, tuple) else (name, what)
        for name, what in fields.items()
    ]
    return np.dtype(columns, align=True)


# The fields of Feet, Measured and Target, see there.
FEET = record_type(
    {
        "place": (4, 3),
        "velocity": (4, 3),
        "drift": (4, 3),
        "jacobian": (4, 3, 3),
        "contact_jacobian": (4, 3, 3),
        "normal": (4, 3),
    }
)
MEASURED = record_type(
    {
        "p": (3,),
        "R": (3, 3),
        "w": (3,),
        "v": (3,),
        "q": (12,),
        "qd": (12,),
        "feet": FEET,
        "known": (),
    }
)
TARGET = record_type(
    {
        "body": (5,),
        "R": (3, 3),
        "v": (3,),
        "w": (3,),
        "acceleration": (6,),
        "feet_acceleration": (4, 3),
        "load": (4,),
    }
)

# Of the robot, what its feet are measured by: its legs (see `leg_array`), and where what is in a
# state (see `state_indices`). All records that hold these have them so: of others a kernel is
# compiled anew.
ROBOT = [("legs", np.float64, (4, 8)), ("places", np.int64, (26,))]

# What a tick finds on its way. Beyond what is measured and wanted: where the feet are to be in W
# (4, 3) [m] and how fast [m/s]; how soft the legs are to be, 0 to 1, (4,); how far the centre of
# mass is from the model's in W (2,) [m]; the joints' torques by the feet's forces, (12, 12) and
# (12,) [Nm].
WORK = record_type(
    {
        "measured": MEASURED,
        "target": TARGET,
        "place": (4, 3),
        "velocity": (4, 3),
        "soft": (4,),
        "com_shift": (2,),
        "torque": (12, 12),
        "torque_offset": (12,),
    }
)


def new_record(kind: Dtype) -> Records:
    """One record, all zero."""
    return np.zeros(1, dtype=kind)


def fields_of(record: Records) -> Record:
    """The one element, its fields to be read and written as attributes."""
    return record.view(np.recarray)[0]


# ------------------------------------------------------------------------------------------------
# What a controller remembers of its feet and its body from tick to tick, and where.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# How fast feet are moved, searched for and followed.
# ------------------------------------------------------------------------------------------------


class Pace(NamedTuple):
    """Times and speeds of `compute_foot_targets`; see ControlSettings.

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
