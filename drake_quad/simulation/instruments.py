"""The instruments of a simulated world: monitors, pushes, the robot's sensors, and the one log.

Monitors measure the truth, and nobody is told by them. Signals are logged together: every logger of
its own would be asked for its time at every step.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import (
    LogVectorOutput,
    Multiplexer,
    VectorLog,
    VectorLogSink,
)

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.sensor_models import SensorErrors, TorqueErrors
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.simulation.plant import MakeTrueModel, SimulatedPlant
from drake_quad.stability.margins import MarginEstimator
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.disturbances import Disturbances, PushSource
from drake_quad.systems.leaf_system import Parts
from drake_quad.systems.sensors import GroundNormalSensor, Imu, JointSensor, TorqueSensor
from drake_quad.systems.stability_monitor import FIRST, NO_SUPPORT, StabilityMonitor

GAUGE_PERIOD = 0.1  # [s] between measurements of the margins that take longer


class Monitors(NamedTuple):
    """What AddMonitors added."""

    contact: ContactMonitor
    stability: StabilityMonitor


def AddMonitors(
    builder: DiagramBuilder,
    simulated: SimulatedPlant,
    *,
    robot: RobotModel,
    disturbances: Disturbances,
    sensing_period: float,
    period: float,
    log_period: float,
    height_limit: float,
    margins: str,
    friction: float,
) -> Monitors:
    """Adds them, connected with the plant.

    Args:
        builder: Builder that holds the plant.
        simulated: The plant.
        robot: The robot as its controller knows it.
        disturbances: What makes it another robot than that.
        sensing_period: Time between samples of the feet's contact sensors [s].
        period: Time between measurements of the margins, and of what touches [s].
        log_period: Time between samples of the log, which is to miss no smallest margin [s].
        height_limit: Height of the trunk over its feet below which the robot fell [m].
        margins: Kind of the margins that are measured, one of `margin_kinds.KINDS`.
        friction: Coulomb's coefficient between feet and ground.
    """
    plant = simulated.plant
    inspector = simulated.scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    contact = builder.AddNamedSystem(
        "contact_monitor",
        ContactMonitor(
            plant=plant,
            foot_geometries=find_feet(plant, robot, names),
            robot=robot,
            period=sensing_period,
        ),
    )
    model = MakeTrueModel(robot, disturbances)
    strength = [disturbances.motor_strength.get(name, 1.0) for name in robot.joint_names]
    gauge = MarginEstimator(
        robot=robot,
        kind=margins,
        friction=friction,
        mass=model.CalcTotalMass(model.CreateDefaultContext()),
        effort=robot.effort * strength,
        none=NO_SUPPORT,
    )
    stability = builder.AddNamedSystem(
        "stability_monitor",
        StabilityMonitor(
            model=model,
            layout=simulated.layout,
            period=period,
            height_limit=height_limit,
            gauge=gauge,
            window=ceil(log_period / period - 1e-9) + 1,
            gauge_period=sensing_period * max(1, round(GAUGE_PERIOD / sensing_period)),
            since=FIRST * sensing_period,
        ),
    )
    builder.Connect(
        plant.get_contact_results_output_port(), contact.GetInputPort("contact_results")
    )
    if contact.HasInputPort("plant_state"):
        builder.Connect(plant.get_state_output_port(), contact.GetInputPort("plant_state"))
    builder.Connect(plant.get_state_output_port(), stability.GetInputPort("robot_state"))
    # A margin is of the contacts of its own instant, and not of those last sensed.
    builder.Connect(contact.parts.port, stability.GetInputPort("contacts"))
    return Monitors(contact, stability)


def AddPushes(
    builder: DiagramBuilder, simulated: SimulatedPlant, disturbances: Disturbances
) -> PushSource:
    """Adds the source of the pushes, connected with the plant."""
    plant, pushes = simulated.plant, disturbances.pushes
    source: PushSource = builder.AddNamedSystem(
        "push_source",
        PushSource(
            pushes=pushes,
            bodies=[plant.GetBodyByName(push.body, simulated.instance).index() for push in pushes],
            layout=simulated.layout,
            time_step=plant.time_step(),
        ),
    )
    builder.Connect(plant.get_state_output_port(), source.GetInputPort("robot_state"))
    builder.Connect(
        source.GetOutputPort("applied_spatial_force"),
        plant.get_applied_spatial_force_input_port(),
    )
    return source


def AddSensors(
    builder: DiagramBuilder,
    state: OutputPort,
    *,
    layout: StateLayout,
    errors: SensorErrors,
    period: float,
) -> dict[str, OutputPort]:
    """Adds an IMU and the joints' encoders, which alone see the simulated state.

    Returns:
        Their outputs by the controller's names for them.
    """
    imu = builder.AddNamedSystem(
        "imu",
        Imu(layout=layout, generator=errors.imu_generator, noise=errors.imu, period=period),
    )
    joints = builder.AddNamedSystem(
        "joint_sensor",
        JointSensor(
            layout=layout, generator=errors.joint_generator, noise=errors.joints, period=period
        ),
    )
    for sensor in (imu, joints):
        builder.Connect(state, sensor.GetInputPort("robot_state"))
    return {
        "imu_measured": imu.GetOutputPort("imu_measured"),
        "joint_state_measured": joints.GetOutputPort("joint_state_measured"),
    }


def AddTorqueSensor(
    builder: DiagramBuilder,
    simulated: SimulatedPlant,
    *,
    errors: TorqueErrors,
    initial: FloatArray,
    period: float,
) -> OutputPort:
    """Adds the sensors of the drives' torques.

    Args:
        builder: Builder that holds the plant.
        simulated: The plant.
        errors: The sensors' errors.
        initial: (12,) what they show until their first sample, leg by leg [Nm].
        period: Period of the samples [s].

    Returns:
        Their output.
    """
    sensor = builder.AddNamedSystem(
        "torque_sensor",
        TorqueSensor(layout=simulated.layout, errors=errors, initial=initial, period=period),
    )
    builder.Connect(
        simulated.plant.get_net_actuation_output_port(simulated.instance),
        sensor.GetInputPort("net_actuation"),
    )
    port: OutputPort = sensor.GetOutputPort("joint_torque_measured")
    return port


def AddGroundNormalSensor(
    builder: DiagramBuilder,
    simulated: SimulatedPlant,
    contact: ContactMonitor,
    *,
    robot: RobotModel,
    period: float,
) -> OutputPort:
    """Adds the sensors in the feet that tell which way the ground is tilted.

    Args:
        builder: Builder that holds the plant.
        simulated: The plant.
        contact: The monitor of its contacts.
        robot: The robot.
        period: Period of the samples [s].

    Returns:
        Their output.
    """
    sensor = builder.AddNamedSystem(
        "ground_normal_sensor",
        GroundNormalSensor(robot=robot, layout=simulated.layout, period=period),
    )
    builder.Connect(simulated.plant.get_state_output_port(), sensor.GetInputPort("robot_state"))
    for name in ("contact_state", "foot_contact_position"):
        builder.Connect(contact.GetOutputPort(name), sensor.GetInputPort(name))
    port: OutputPort = sensor.GetOutputPort("ground_normal_measured")
    return port


def velocities_at_rest(q: FloatArray) -> dict[str, FloatArray]:
    """What they say of a robot at rest on level ground with joint angles `q` (12,) [rad]."""
    return {
        "imu_measured": np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY]),
        "joint_state_measured": np.concatenate([q, np.zeros(12)]),
    }


@dataclass(frozen=True, eq=False)
class PartLog:
    """The samples of one signal, by the names that Drake's VectorLog has."""

    log: VectorLog
    rows: slice

    def num_samples(self) -> int:
        """Number of samples."""
        return int(self.log.num_samples())

    def sample_times(self) -> FloatArray:
        """Times of the samples (n,) [s]."""
        return self.log.sample_times()

    def data(self) -> FloatArray:
        """The samples as columns (size, n)."""
        return self.log.data()[self.rows]


@dataclass(frozen=True, eq=False)
class PartLogger:
    """What logs one signal; a VectorLogSink of which other signals are other rows."""

    sink: VectorLogSink
    rows: slice

    def FindLog(self, context: Context) -> PartLog:
        """The samples so far, in a root context."""
        return PartLog(self.sink.FindLog(context), self.rows)


class PortRows(NamedTuple):
    """Rows of an output port."""

    port: OutputPort
    rows: slice


def find_signal(system: System, name: str) -> PortRows:
    """The output port `name` of a system; where that is one of Parts, the port of all of them.

    A Diagram that hands on the parts of a system in it hands on the port of all by its name.
    """
    inside = system.GetSystems() if isinstance(system, Diagram) else [system]
    for one in inside:
        parts: Parts | None = getattr(one, "parts", None)
        if parts is not None and name in parts.rows:
            return PortRows(system.GetOutputPort(parts.name), parts.rows[name])
    port = system.GetOutputPort(name)
    return PortRows(port, slice(0, port.size()))


def AddLoggers(
    builder: DiagramBuilder, signals: Mapping[str, PortRows], period: float
) -> dict[str, PartLogger]:
    """Logs vector signals together.

    Args:
        builder: Builder that holds the signals' systems.
        signals: What is logged, by the names of the logs.
        period: Time between samples, the first at time 0 [s].
    """
    ports: list[OutputPort] = []
    for signal in signals.values():
        if signal.port not in ports:
            ports.append(signal.port)
    sizes = [port.size() for port in ports]
    together = builder.AddNamedSystem("logged", Multiplexer(sizes))
    for k, port in enumerate(ports):
        builder.Connect(port, together.get_input_port(k))
    sink = LogVectorOutput(together.get_output_port(), builder, period)
    sink.set_name("log")
    loggers = {}
    for name, (port, rows) in signals.items():
        begin = sum(sizes[: ports.index(port)])
        loggers[name] = PartLogger(sink, slice(begin + rows.start, begin + rows.stop))
    return loggers
