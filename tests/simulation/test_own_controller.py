"""A controller of one's own in the place of ours: by a factory, with the same ports."""

from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, LeafSystem
from test_diagram import make_climb, state_of_plant

from drake_quad.common import FloatArray
from drake_quad.control.ports import BALANCE_SIZE
from drake_quad.errors import InputError
from drake_quad.simulation.diagram import StairClimb
from drake_quad.systems.controller import INPUTS, OUTPUTS
from drake_quad.systems.tracking_controller import IkController

TIME = 0.06  # [s]


def after(made: StairClimb) -> FloatArray:
    """The robot's state after a moment."""
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(TIME)
    return state_of_plant(made, simulator.get_context())


def tracking_of(made: StairClimb) -> Any:
    controller = made.diagram.GetSubsystemByName("controller")
    assert isinstance(controller, Diagram)
    return controller.GetSubsystemByName("tracking_controller")


def test_a_factory_is_as_good_as_a_name() -> None:
    """The same controller by its name and by a function that makes it: the same to the bit."""
    given: list[dict[str, Any]] = []

    def make(**parts: Any) -> LeafSystem:
        given.append(parts)
        return IkController(**parts)  # as flat_walk's own

    ours, own = after(make_climb()), after(make_climb(tracking=make))
    assert np.array_equal(ours, own)
    assert [set(parts) for parts in given] == [{"robot", "layout", "model", "control", "course"}]
    assert not np.array_equal(ours, after(make_climb(tracking="whole_body")))


def test_another_controllers_commands_reach_the_drives() -> None:
    """One that adds a torque to a joint moves it; what it has no port for is not logged."""
    torque = np.zeros(12)
    torque[0] = 30.0

    class Pushing(LeafSystem):
        """Of all ports only what it needs: no plan is followed, one drive pushes."""

        def __init__(self, **parts: Any) -> None:
            super().__init__()
            inner = IkController(**parts)
            for name in INPUTS:
                port = inner.GetInputPort(name)
                if name == "motion_plan":
                    self.DeclareAbstractInputPort(name, port.Allocate())
                else:
                    self.DeclareVectorInputPort(name, port.size())
            stand = {"joint_torque_feedforward": torque}
            for name, size in OUTPUTS.items():
                value = stand.get(name, np.zeros(size))
                self.DeclareVectorOutputPort(
                    name, size, lambda _c, out, value=value: out.SetFromVector(value)
                )

    made = make_climb(tracking=Pushing)
    assert type(tracking_of(made)).__name__ == "Pushing" and "qp_state" not in made.loggers
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.01)
    controller = made.diagram.GetSubsystemByName("controller")
    context = controller.GetMyContextFromRoot(simulator.get_context())
    sent = controller.GetOutputPort("joint_torque_feedforward").Eval(context)
    assert np.array_equal(sent, torque)


def test_what_is_no_controller_is_refused_in_a_line() -> None:
    """Nor a name or function, no system, one that lacks a port or has one of another size."""
    with pytest.raises(InputError, match=r"tracking = 'mpc'.*ik or whole_body"):
        make_climb(tracking="mpc")
    with pytest.raises(InputError, match=r"tracking = 5: .*ik or whole_body"):
        make_climb(tracking=5)
    with pytest.raises(InputError, match=r"tracking = 'NoneType': .*must return a system of Drake"):
        make_climb(tracking=lambda **_: None)
    with pytest.raises(InputError, match=r"motion_plan.*needs an input port"):
        make_climb(tracking=lambda **_: LeafSystem())

    def deaf(**parts: Any) -> LeafSystem:
        class Deaf(IkController):
            """It has no input for what the feet feel."""

            def HasInputPort(self, name: str) -> bool:
                return name != "ground_normal_measured" and bool(super().HasInputPort(name))

        return Deaf(**parts)

    make_climb(tracking=deaf)
    with pytest.raises(InputError, match=r"ground_normal_measured = 'Deaf'.*leave that at `map`"):
        make_climb(tracking=deaf, feel_normals=True)

    with pytest.raises(InputError, match=r"tracking = .*keywords robot, .* and course.*'layout'"):
        make_climb(tracking=lambda robot: LeafSystem())
    with pytest.raises(InputError, match=r"tracking = .*cannot be: missing.*'gain'"):
        make_climb(tracking=lambda gain, **_: LeafSystem())

    def short(**parts: Any) -> LeafSystem:
        class Short(IkController):
            """Its last output is one value short."""

            def GetOutputPort(self, name: str) -> Any:
                own = "feet_desired" if name == "balance_estimated" else name
                return super().GetOutputPort(own)

        return Short(**parts)

    with pytest.raises(InputError, match=f"balance_estimated.*{BALANCE_SIZE} values.*12"):
        make_climb(tracking=short)
