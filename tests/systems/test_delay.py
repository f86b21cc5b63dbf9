"""Delay: what comes out is what went in, so many steps before."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from tick_reader import TickReader

from drake_quad.systems.disturbances import Delay

STEP = 0.001  # [s]


class Counter(LeafSystem):
    """Counts its own steps: at step k it has k on its output."""

    def __init__(self) -> None:
        super().__init__()
        self._count = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("count", self._count)
        self.DeclarePeriodicDiscreteUpdateEvent(STEP, 0.0, self._update)

    def _update(self, context, state) -> None:  # type: ignore[no-untyped-def]
        state.set_value(self._count, context.get_discrete_state(self._count).value() + 1.0)


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 7, 40])
def test_what_is_read_is_what_was_there_n_steps_before(steps: int) -> None:
    """At step k the reader finds step k - n of the signal; before that what was told to be."""
    builder = DiagramBuilder()
    counter = builder.AddSystem(Counter())
    delay = builder.AddSystem(Delay(initial={"count": np.array([-5.0])}, period=STEP, steps=steps))
    reader = builder.AddSystem(TickReader(size=1, period=STEP))
    builder.Connect(counter.get_output_port(), delay.GetInputPort("count"))
    builder.Connect(delay.GetOutputPort("count_delayed"), reader.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.15)
    found = reader.notes(simulator.get_context())[:150, 0]
    k = np.arange(150.0)
    np.testing.assert_array_equal(found, np.where(k < steps, -5.0, k - steps))


def test_all_signals_are_late_alike_and_keep_apart() -> None:
    """Several vectors go through one Delay, each out of its own port."""
    delay = Delay(initial={"a": np.array([1.0, 2.0]), "b": np.array([3.0])}, period=STEP, steps=3)
    simulator = Simulator(delay)
    context = simulator.get_mutable_context()

    def read() -> list[list[float]]:
        return [delay.GetOutputPort(f"{n}_delayed").Eval(context).tolist() for n in "ab"]

    assert read() == [[1.0, 2.0], [3.0]]
    delay.GetInputPort("a").FixValue(context, [10.0, 20.0])
    delay.GetInputPort("b").FixValue(context, [30.0])
    simulator.AdvanceTo(1.5 * STEP)
    assert read() == [[1.0, 2.0], [3.0]]
    simulator.AdvanceTo(3.5 * STEP)
    assert read() == [[10.0, 20.0], [30.0]]


def test_two_contexts_do_not_share_what_is_under_way() -> None:
    """What goes through one simulation does not come out of another."""
    delay = Delay(initial={"a": np.zeros(1)}, period=STEP, steps=2)
    a, b = Simulator(delay), Simulator(delay)
    for simulator, value in ((a, 1.0), (b, 2.0)):
        delay.GetInputPort("a").FixValue(simulator.get_mutable_context(), [value])
        simulator.AdvanceTo(0.01)
    for simulator, value in ((a, 1.0), (b, 2.0)):
        assert delay.GetOutputPort("a_delayed").Eval(simulator.get_context())[0] == value


def test_nothing_passes_straight_through() -> None:
    """So it may stand in any loop."""
    assert not Delay(initial={"a": np.zeros(1)}, period=STEP, steps=1).HasAnyDirectFeedthrough()
