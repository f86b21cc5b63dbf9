"""Whether CENIC takes a joint's desired velocity with the right sign, and a way round it if not.

Drake 1.51.1's CENIC integrator takes `PdControllerGains` as -p (q - q_d) - d (v + v_d): a joint
that is to move lags by 2 d v_d / p. With a time step, or under `implicit_euler` and `runge_kutta3`,
it is -p (q - q_d) - d (v - v_d), as documented. The plant's `net_actuation` port has that too,
whatever CENIC applied.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from unittest.mock import patch

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains, RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues
from pydrake.systems.primitives import ConstantVectorSource

from drake_quad.systems import controller
from drake_quad.systems.tracking_controller import TrackingController

P, D = 100.0, 10.0  # gains of the joint that is tried [Nm/rad], [Nm s/rad]


def resting_place(scheme: str, *, time_step: float = 0.0) -> float:
    """Where a single joint comes to rest that is told q_d = 0 and v_d = 1 rad/s [rad].

    Balance of p (q_d - q) + d (v_d - v) = 0 at v = 0 puts it at d v_d / p = +0.1.
    """
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=time_step), builder)
    body = plant.AddRigidBody("link", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    joint = plant.AddJoint(
        RevoluteJoint("joint", plant.world_frame(), body.body_frame(), [0.0, 0.0, 1.0])
    )
    actuator = plant.AddJointActuator("motor", joint, 1000.0)
    plant.Finalize()
    actuator.set_controller_gains(PdControllerGains(p=P, d=D))
    desired = builder.AddSystem(ConstantVectorSource([0.0, 1.0]))
    builder.Connect(
        desired.get_output_port(), plant.get_desired_state_input_port(actuator.model_instance())
    )
    simulator = Simulator(builder.Build())
    config = SimulatorConfig(integration_scheme=scheme, max_step_size=0.01)
    ApplySimulatorConfig(config, simulator)
    simulator.AdvanceTo(3.0)
    return float(plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context()))[0])


@cache
def velocity_sign() -> float:
    """+1 if this Drake's CENIC takes v_d as documented, -1 if with the wrong sign."""
    return float(np.sign(resting_place("cenic")))


@contextmanager
def corrected() -> Iterator[None]:
    """Has every controller give v_d as CENIC needs it, in the Diagrams that are built meanwhile."""
    kinds = {name: _signed(kind) for name, kind in controller.KINDS.items()}
    with patch.dict(controller.KINDS, kinds):
        yield


def _signed(kind: type[TrackingController]) -> type[TrackingController]:
    """The controller, its joints' desired speeds with CENIC's sign."""

    class Signed(kind):  # type: ignore[valid-type,misc]
        def _update(self, context: Context, state: DiscreteValues) -> None:
            super()._update(context, state)
            target = np.array(state.value(self._target))
            target[len(target) // 2 :] *= velocity_sign()
            state.set_value(self._target, target)

    return Signed
