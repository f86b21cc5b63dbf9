"""ClockedSystem: no system of the package is asked in vain, at every step, for a method."""

import importlib
import pkgutil
from typing import Any

import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State

import drake_quad.systems
from drake_quad.systems.clocked_system import ClockedSystem


def count_asked(base: type[LeafSystem]) -> tuple[int, int]:
    """How often a system is asked for witness functions in 100 of its steps; and its steps."""
    asked, steps = [], []

    class Stepping(base):  # type: ignore[misc, valid-type]
        """Updates as a plant does."""

        def __init__(self) -> None:
            super().__init__()
            self.DeclareAbstractState(AbstractValue.Make(0))
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.01, 0.0, self._update)

        def _update(self, context: Context, state: State) -> None:
            steps.append(context.get_time())

        def __getattribute__(self, name: str) -> Any:
            if name == "DoGetWitnessFunctions":
                asked.append(name)
            return super().__getattribute__(name)

    builder = DiagramBuilder()
    builder.AddSystem(Stepping())
    Simulator(builder.Build()).AdvanceTo(0.995)
    return len(asked), len(steps)


def test_asked_once_for_its_class() -> None:
    """A hundred steps ask for witness functions at most once, and are taken all the same."""
    asked, steps = count_asked(ClockedSystem)
    assert steps == 100
    assert asked <= 1


def test_a_plain_leaf_system_is_asked_at_every_step() -> None:
    """Drake's own class is asked each time: once it is not, ClockedSystem has had its day."""
    asked, steps = count_asked(LeafSystem)
    assert asked >= steps == 100


MODULES = [m.name for m in pkgutil.iter_modules(drake_quad.systems.__path__)]


@pytest.mark.parametrize("name", MODULES)
def test_every_system_is_one(name: str) -> None:
    """Every LeafSystem of the package is a ClockedSystem, which is one itself."""
    module = importlib.import_module(f"drake_quad.systems.{name}")
    for value in vars(module).values():
        if isinstance(value, type) and value.__module__ == module.__name__:
            assert issubclass(value, ClockedSystem) or not issubclass(value, LeafSystem), value
