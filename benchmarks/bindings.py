"""What a LeafSystem written in Python costs at a step, by Drake's bindings alone.

    python -m benchmarks.bindings

Drake 1.51 has bindings by pybind11, 1.58 by nanobind. The same script in two environments shows
the difference. The fastest of several rounds counts: whatever else the machine does only adds.
"""

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem, State
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from benchmarks.common import markdown_table, provenance

ROUNDS, CALLS, STEPS, IDLE = 7, 300, 4000, 20


class Stepping(LeafSystem):
    """Makes an unrestricted update in every step, as a plant does."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractState(AbstractValue.Make(0))
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.001, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        pass


class Idle(LeafSystem):
    """Does nothing; Drake asks it for witness functions all the same."""


class Asking(LeafSystem):
    """Times the calls by which a system reads its inputs and writes its state."""

    def __init__(self) -> None:
        super().__init__()
        self._vector = self.DeclareVectorInputPort("vector", 25)
        self._value = self.DeclareAbstractInputPort("value", AbstractValue.Make(object()))
        self._state = int(self.DeclareDiscreteState(25))
        self.times: dict[str, float] = {}
        self.DeclarePeriodicDiscreteUpdateEvent(0.001, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        if context.get_time() > 0.01 and not self.times:
            self.times = {
                "InputPort.Eval of a vector (25,)": fastest(lambda: self._vector.Eval(context)),
                "InputPort.Eval of an object": fastest(lambda: self._value.Eval(context)),
                "DiscreteValues.get_mutable_value": fastest(
                    lambda: state.get_mutable_value(self._state)
                ),
            }


def fastest(call: Callable[[], object]) -> float:
    """The time of a call [us]."""
    times = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        for _ in range(CALLS):
            call()
        times.append((time.perf_counter() - begun) / CALLS)
    return 1e6 * min(times)


def time_of_a_step(idle: int) -> float:
    """The time of a step of a Diagram with so many idle systems [us]."""
    builder = DiagramBuilder()
    for system in [Stepping(), *(Idle() for _ in range(idle))]:
        builder.AddSystem(system)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    times = []
    for k in range(1, ROUNDS + 1):
        begun = time.perf_counter()
        simulator.AdvanceTo(0.001 * STEPS * k)
        times.append((time.perf_counter() - begun) / STEPS)
    return 1e6 * min(times)


def measure() -> dict[str, float]:
    """All times [us], by what they are of."""
    builder = DiagramBuilder()
    asking = builder.AddSystem(Asking())
    vector = builder.AddSystem(ConstantVectorSource(np.ones(25)))
    value = builder.AddSystem(ConstantValueSource(AbstractValue.Make(object())))
    builder.Connect(vector.get_output_port(), asking.GetInputPort("vector"))
    builder.Connect(value.get_output_port(), asking.GetInputPort("value"))
    Simulator(builder.Build()).AdvanceTo(0.05)
    each = (time_of_a_step(IDLE) - time_of_a_step(0)) / IDLE
    return {"an idle system, at every step": each, **asking.times}


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="What Drake's bindings cost a Python LeafSystem.")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    times = measure()
    if arguments.json:
        print(json.dumps({"microseconds": times, "with": provenance()}))
        return
    print(provenance() + "\n")
    print(markdown_table(["what", "time [µs]"], [[name, f"{t:.2f}"] for name, t in times.items()]))


if __name__ == "__main__":
    main()
