"""A system that notes what a controller would read at every step, for tests of delays."""

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import FloatArray

STEPS = 200  # that it has room for


class TickReader(LeafSystem):
    """At step k it notes what is on its input, in a discrete update as controllers have it."""

    def __init__(self, *, size: int, period: float) -> None:
        super().__init__()
        self.DeclareVectorInputPort("in", size)
        self._notes = self.DeclareDiscreteState(STEPS * size)
        self._size, self._period = size, period
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        k = round(context.get_time() / self._period)
        notes = context.get_discrete_state(self._notes).value().copy()
        notes[k * self._size : (k + 1) * self._size] = self.get_input_port().Eval(context)
        state.set_value(self._notes, notes)

    def notes(self, root: Context) -> FloatArray:
        """What it read, (STEPS, size), of the Diagram's context."""
        found = self.GetMyContextFromRoot(root).get_discrete_state(self._notes).value()
        return np.array(found).reshape(STEPS, self._size)
