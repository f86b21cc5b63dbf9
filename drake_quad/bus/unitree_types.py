"""Unitree's types as cyclonedds declares them, made of the layouts in `unitree_messages`.

It imports cyclonedds, so nobody imports it at the top.
"""

from typing import Any

import numpy as np
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import autoid, final

from drake_quad.bus.unitree_messages import (
    BMS_CMD,
    BMS_STATE,
    IMU_STATE,
    LOW_CMD,
    LOW_STATE,
    MOTOR_CMD,
    MOTOR_STATE,
)

PACKAGE = "unitree_go.msg.dds_"
NUMBERS = {"u1": types.uint8, "u2": types.uint16, "u4": types.uint32, "i2": types.int16,
           "i4": types.int32, "f4": types.float32}  # fmt: skip


def _declare(name: str, layout: np.dtype, parts: dict[np.dtype, Any]) -> Any:
    """The maker's type of that name, its fields those of the layout.

    Args:
        name: The type's, without its package.
        layout: Layout of its values.
        parts: The types of which it has fields, by their layouts.
    """

    def kind(field: np.dtype) -> Any:
        if field.subdtype is not None:
            return types.array[kind(field.subdtype[0]), int(np.prod(field.subdtype[1]))]
        return parts[field] if field.fields is not None else NUMBERS[field.str[1:]]

    fields = {field: kind(layout[field]) for field in layout.names or ()}
    return final(autoid("sequential")(make_idl_struct(name, f"{PACKAGE}.{name}", fields)))


_PARTS = {
    layout: _declare(name, layout, {})
    for name, layout in (
        ("MotorCmd_", MOTOR_CMD), ("BmsCmd_", BMS_CMD), ("MotorState_", MOTOR_STATE),
        ("IMUState_", IMU_STATE), ("BmsState_", BMS_STATE),
    )
}  # fmt: skip
LowCmd_: Any = _declare("LowCmd_", LOW_CMD, _PARTS)
LowState_: Any = _declare("LowState_", LOW_STATE, _PARTS)


def message_of(kind: Any, data: bytes) -> Any:
    """A message of this type that is these bytes: cyclonedds takes half a tick for its fields."""
    one = kind.__new__(kind)
    one.data = data
    return one


for _kind in (LowCmd_, LowState_):
    # What a reader makes of what came, and a writer sends.
    _kind.deserialize = classmethod(lambda cls, data, *_, **__: message_of(cls, data))
    _kind.serialize = lambda self, *_, **__: self.data
