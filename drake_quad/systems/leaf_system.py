"""What our LeafSystems share: contexts to compute in, and outputs of the state.

State in a system's Context, never on `self`: two simulations of one Diagram must not share it.
"""

from collections.abc import Callable, Mapping
from functools import partial
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
    OutputPort,
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


class Instant:
    """Vectors that a system computes together, of the instant at which they are asked for.

    Each has an output port of its name. One more port shows them all, one after the other: a log
    reads that one, for every port that Python computes costs a log as much as a margin does.
    """

    def __init__(
        self,
        system: LeafSystem,
        name: str,
        sizes: Mapping[str, int],
        calc: Callable[[Context, Vectors], object],
        prerequisites: set[DependencyTicket],
    ) -> None:
        """Declares the cache entry and the ports.

        Args:
            system: The system that computes them.
            name: Name of the port of all of them.
            sizes: Their lengths by the names of their ports.
            calc: Computes all of them into the vectors that it is given.
            prerequisites: What they depend on.
        """
        self.sizes = list(sizes.values())
        ends = [sum(self.sizes[: k + 1]) for k in range(len(self.sizes))]
        self.rows = {
            part: slice(end - size, end)
            for (part, size), end in zip(sizes.items(), ends, strict=True)
        }

        # No views of one array: Drake copies the value, and each of its arrays by itself.
        self._entry = system.DeclareCacheEntry(
            description="vectors of one instant",
            value_producer=ValueProducer(
                allocate=lambda: AbstractValue.Make([np.zeros(n) for n in self.sizes]),
                calc=lambda context, value: calc(context, value.get_mutable_value()),
            ),
            prerequisites_of_calc=prerequisites,
        )
        self.port: OutputPort = system.DeclareVectorOutputPort(
            name, ends[-1], self._copy_all, {self._entry.ticket()}
        )
        for index, (part, size) in enumerate(sizes.items()):
            system.DeclareVectorOutputPort(
                part, size, partial(self._copy_part, index), {self._entry.ticket()}
            )

    def _copy_all(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.concatenate(self.Eval(context)))

    def _copy_part(self, index: int, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.Eval(context)[index])

    def Eval(self, context: Context) -> Vectors:
        """Returns the vectors, in the order of `sizes`; they are not to be changed."""
        parts: Vectors = self._entry.EvalAbstract(context).get_value()
        return parts
