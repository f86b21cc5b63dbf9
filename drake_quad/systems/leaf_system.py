"""What our LeafSystems share: contexts to compute in, and outputs of the state.

State in a system's Context, never on `self`: two simulations of one Diagram must not share it.
"""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DependencyTicket,
    DiscreteStateIndex,
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


class Parts:
    """Vectors that a system has together, one after the other, with an output port of each name.

    One more port shows them all: a log reads that one, for every port that Python computes costs a
    log as much as a margin does.

    Attributes:
        name: Name of the port of all of them.
        port: Port of all of them.
        rows: Rows of each in it, by the names of their ports.
    """

    name: str
    port: OutputPort
    rows: dict[str, slice]

    def _declare_parts(
        self, system: LeafSystem, read: Callable[[Context], FloatArray], ticket: DependencyTicket
    ) -> None:
        """Declares the port of each part, which shows its rows of what `read` returns."""

        def copy(rows: slice, context: Context, output: BasicVector) -> None:
            output.SetFromVector(read(context)[rows])

        for part, rows in self.rows.items():
            size = rows.stop - rows.start
            system.DeclareVectorOutputPort(part, size, partial(copy, rows), {ticket})


def _rows_of(sizes: Mapping[str, int]) -> dict[str, slice]:
    """The rows of vectors of these sizes that follow one another."""
    ends = accumulate(sizes.values())
    return {
        part: slice(end - size, end) for (part, size), end in zip(sizes.items(), ends, strict=True)
    }


class Instant(Parts):
    """Vectors that a system computes together, of the instant at which they are asked for."""

    def __init__(
        self,
        system: LeafSystem,
        name: str,
        sizes: Mapping[str, int],
        calc: Callable[[Context, FloatArray], object],
        prerequisites: set[DependencyTicket],
    ) -> None:
        """Declares the cache entry and the ports.

        Args:
            system: The system that computes them.
            name: Name of the port of all of them.
            sizes: Their lengths by the names of their ports.
            calc: Computes all of them into the vector that it is given.
            prerequisites: What they depend on.
        """
        self.name, self.rows = name, _rows_of(sizes)
        size = sum(sizes.values())
        self._entry = system.DeclareCacheEntry(
            description="vectors of one instant",
            value_producer=ValueProducer(
                allocate=lambda: AbstractValue.Make(np.zeros(size)),
                calc=lambda context, value: calc(context, value.get_mutable_value()),
            ),
            prerequisites_of_calc=prerequisites,
        )
        ticket = self._entry.ticket()
        self.port = system.DeclareVectorOutputPort(name, size, self._copy_all, {ticket})
        self._declare_parts(system, self.Eval, ticket)

    def _copy_all(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.Eval(context))

    def Eval(self, context: Context) -> FloatArray:
        """Returns the vectors one after the other; they are not to be changed."""
        vectors: FloatArray = self._entry.EvalAbstract(context).get_value()
        return vectors


class StateParts(Parts):
    """Vectors that are one discrete state together.

    Each group of a state takes time of its own, whenever Drake hands it over or notes its change.

    Attributes:
        index: Index of the state as a plain number, see DeclareStateOutput.
    """

    def __init__(self, system: LeafSystem, name: str, first: Mapping[str, FloatArray]) -> None:
        """Declares the state and the ports.

        Args:
            system: The system that has them.
            name: Name of the port of all of them.
            first: Their first values, by the names of their ports.
        """
        self.name = name
        self.rows = _rows_of({part: len(value) for part, value in first.items()})
        self.index = DeclareStateOutput(system, name, np.concatenate(list(first.values())))
        self.port = system.GetOutputPort(name)
        self._declare_parts(
            system,
            lambda context: context.get_discrete_state(self.index).value(),
            system.discrete_state_ticket(DiscreteStateIndex(self.index)),
        )
