"""Delay: the same signals, a few steps later."""

from collections.abc import Mapping
from itertools import accumulate

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import FloatArray


class Delay(LeafSystem):
    """Passes vectors on a whole number of steps late.

    What is read from it at step k is what was on its input at step k - n; before there is such a
    step, what the constructor was given.

    Input ports:
        <name>: Any vector, for each name.
    Output ports:
        <name>_delayed: The same vector of n steps before.
    """

    def __init__(self, *, initial: Mapping[str, FloatArray], period: float, steps: int) -> None:
        """Declares the ports.

        Args:
            initial: By the signal's name, what comes out before anything has come through.
            period: Of the steps [s].
            steps: n, at least 1.
        """
        super().__init__()
        assert steps >= 1
        self._period, self._kept = period, steps - 1
        values = {name: np.asarray(value, dtype=float) for name, value in initial.items()}
        start = np.concatenate(list(values.values()))
        # Where each signal begins in what is kept of a step, and how long that is.
        self._starts = [0, *accumulate(len(value) for value in values.values())]
        self._size = len(start)
        self._inputs = [self.DeclareVectorInputPort(n, len(v)) for n, v in values.items()]
        # Everything but the newest goes round a ring; what comes out next lies outside of it.
        self._ring = self.DeclareDiscreteState(np.tile(start, self._kept))
        self._outputs = [self.DeclareDiscreteState(value) for value in values.values()]
        for name, index in zip(values, self._outputs, strict=True):
            self.DeclareStateOutputPort(f"{name}_delayed", index)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        parts = [port.Eval(context) for port in self._inputs]
        if self._kept:
            ring = state.get_mutable_value(self._ring)  # begins as the context has it
            at = self._size * (round(context.get_time() / self._period) % self._kept)
            for k, (index, part) in enumerate(zip(self._outputs, parts, strict=True)):
                begin, end = at + self._starts[k], at + self._starts[k + 1]
                state.set_value(index, ring[begin:end])
                ring[begin:end] = part
        else:
            for index, part in zip(self._outputs, parts, strict=True):
                state.set_value(index, part)
