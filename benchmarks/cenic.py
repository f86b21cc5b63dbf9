"""Whether CENIC takes a joint's desired velocity with the right sign, and a way round it if not.

Drake 1.51.1's CENIC integrator takes `PdControllerGains` as -p (q - q_d) - d (v + v_d): a joint
that is to move lags by 2 d v_d / p. With a time step, or under `implicit_euler` and `runge_kutta3`,
it is -p (q - q_d) - d (v - v_d), as documented. The plant's `net_actuation` port has that too,
whatever CENIC applied.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains, RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_quad.systems.ik_controller import IkController

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
    """Has IkController give v_d as CENIC needs it, for the simulations that are built meanwhile."""
    original = IkController._joint_targets

    def signed(self: IkController, *arguments: Any, **named: Any) -> Any:
        target = original(self, *arguments, **named)
        half = len(target) // 2
        return np.concatenate([target[:half], velocity_sign() * target[half:]])

    with patch.object(IkController, "_joint_targets", signed):
        yield
