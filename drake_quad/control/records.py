"""What a tick works on, as records: a compiled kernel takes one in one piece, whatever it holds.

A kernel's call costs by the number of its arguments, and a NamedTuple counts field by field. A
record is an array of one element, whose fields have the names that the NamedTuples have: kernels
that take those take a part of a record as well.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
# state (see `places_of`). All records that hold these have them so: of others a kernel is compiled
# anew.
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
