"""What our LeafSystems share: contexts to compute in, and outputs of the state.

State in a system's Context, never on `self`: two simulations of one Diagram must not share it.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DependencyTicket,
    LeafSystem,
    ValueProducer,
)

from drake_quad.common import FloatArray


def DeclareModelContext(
    system: LeafSystem, model: MultibodyPlant, more: Callable[[], Any] | None = None
) -> CacheEntry:
    """Declares the cache entry; read it with EvalModelContext.

    Args:
        system: The system that uses it.
        model: The model plant, a Context of which is kept.
        more: Makes what else is kept.
    """

    def allocate() -> AbstractValue:
        context = model.CreateDefaultContext()
        return AbstractValue.Make(context if more is None else (context, more()))

    return system.DeclareCacheEntry(
        description="scratch context of the model plant",
        value_producer=ValueProducer(allocate=allocate, calc=ValueProducer.NoopCalc),
        prerequisites_of_calc={system.nothing_ticket()},
    )


def EvalModelContext(entry: CacheEntry, context: Context) -> Any:
    """Returns the model plant's Context that belongs to `context`; its contents are undefined.

    With `more` it is a tuple of both.
    """
    return entry.EvalAbstract(context).get_value()


def DeclareStateOutput(system: LeafSystem, name: str, value: int | FloatArray) -> int:
    """Declares discrete state, and an output port `name` that shows it.

    Args:
        system: The system that has it.
        name: The port's name.
        value: The first value; or its length, if that is zero.

    Returns:
        Its index as a plain number: to turn Drake's own kind of index into one, at every access,
        takes longer than the access itself.
    """
    index = system.DeclareDiscreteState(value)
    system.DeclareStateOutputPort(name, index)
    return int(index)


Vectors = list[FloatArray]


def DeclareVectors(
    system: LeafSystem,
    sizes: Sequence[int],
    calc: Callable[[Context, Vectors], object],
    prerequisites: set[DependencyTicket],
) -> CacheEntry:
    """Declares a cache entry of vectors that are computed together; read it with EvalVectors.

    Args:
        system: The system that computes them.
        sizes: Their lengths.
        calc: Computes all of them into the vectors that it is given.
        prerequisites: What they depend on.
    """
    return system.DeclareCacheEntry(
        description="vectors of one instant",
        value_producer=ValueProducer(
            allocate=lambda: AbstractValue.Make([np.zeros(n) for n in sizes]),
            calc=lambda context, value: calc(context, value.get_mutable_value()),
        ),
        prerequisites_of_calc=prerequisites,
    )


def EvalVectors(entry: CacheEntry, context: Context) -> Vectors:
    """Returns the vectors of an entry; they are not to be changed."""
    vectors: Vectors = entry.EvalAbstract(context).get_value()
    return vectors


def DeclareVectorOfEntry(
    system: LeafSystem, name: str, entry: CacheEntry, row: int, size: int
) -> None:
    """Declares an output port that shows one of an entry's vectors.

    Args:
        system: The system of the entry.
        name: The port's name.
        entry: The entry, from DeclareVectors.
        row: Which of its vectors.
        size: Length of that vector.
    """

    def copy(context: Context, output: BasicVector) -> None:
        output.SetFromVector(EvalVectors(entry, context)[row])

    system.DeclareVectorOutputPort(name, size, copy, {entry.ticket()})
