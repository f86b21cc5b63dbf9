"""Discrete state that is an output port."""

from pydrake.systems.framework import LeafSystem

from drake_quad.gait.legs import FloatArray


def DeclareStateOutput(system: LeafSystem, name: str, value: int | FloatArray) -> int:
    """Declares discrete state, and an output port `name` that shows it.

    Args:
        system: That has it.
        name: Of the port.
        value: At first; or how long it is, if it is zero.

    Returns:
        Its index as a plain number: to turn Drake's own kind of index into one, at every access,
        takes longer than the access itself.
    """
    index = system.DeclareDiscreteState(value)
    system.DeclareStateOutputPort(name, index)
    return int(index)
