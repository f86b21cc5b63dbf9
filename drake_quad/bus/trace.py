"""What a controller on a bus knew and wanted, and where a simulated robot was, row by row.

Both tables have the robot's own time, so that one can be laid beside the other. A controller's is
made by `bus-replay` from what was recorded: a loop that has to keep its time writes none.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.util.files import write_whole

AXES = ("x", "y", "z")
BEARS = 0.01  # of the robot's weight: a foot that bears as much has contact
ROBOT_PERIOD = 0.01  # [s] from one row of a robot's table to the next


def foot_columns(end: str) -> tuple[str, ...]:
    """Names of twelve columns, leg by leg (FL, FR, RL, RR), x, y, z: `FL_position_x`."""
    return tuple(f"{leg}_{end}_{axis}" for leg in SHORT_NAMES for axis in AXES)


# Each part of a row, with its columns' names.
POSE = tuple(f"base_{axis}" for axis in (*AXES, "qw", "qx", "qy", "qz"))
ROBOT: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "drives": ("drives",),
    "pose": POSE,
    "feet": foot_columns("position"),
    "bearing": tuple(f"{leg}_bearing" for leg in SHORT_NAMES),
}
CONTROLLER: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "mode": ("mode",),
    "clock": tuple(f"gait_{part.name.lower()}" for part in GaitPhase),
    "pose": POSE,
    "feet": foot_columns("position"),
    "bearing": tuple(f"{leg}_bearing" for leg in SHORT_NAMES),
    "body_desired": tuple(f"base_desired_{name}" for name in (*AXES, "pitch", "yaw")),
    "feet_desired": foot_columns("desired"),
}


class Trace:
    """Rows of one table as they come.

    Args:
        parts: The parts of a row, with their columns' names: ROBOT or CONTROLLER.
    """

    def __init__(self, parts: Mapping[str, tuple[str, ...]]) -> None:
        self._parts = parts
        self._rows: list[FloatArray] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, **values: FloatArray | float) -> None:
        """Adds a row: every part by its name, of as many values as it has columns."""
        row = [np.ravel(np.asarray(values[name], np.float64)) for name in self._parts]
        for name, part in zip(self._parts, row, strict=True):
            assert len(part) == len(self._parts[name]), name
        self._rows.append(np.concatenate(row))

    def table(self) -> pa.Table:
        """All rows as a table, its columns in the parts' order."""
        names = [column for columns in self._parts.values() for column in columns]
        rows = np.array(self._rows).reshape(-1, len(names))
        return pa.table({name: rows[:, k] for k, name in enumerate(names)})

    def write(self, path: Path) -> None:
        """Writes the table as Parquet, whole or not at all."""
        write_whole(path, partial(pq.write_table, self.table(), compression="zstd"))
