"""Builds the simulation's Diagram: plant, controller, monitors, sensors, wires.

`MakeStairClimb` puts the controller beside a MultibodyPlant that holds the robot and the course,
the monitors, and the loggers.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import Gain

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.estimation.sensor_models import SensorErrors
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.scenario.build import control_settings, sensor_errors
from drake_quad.simulation.plant import (
    AddSimulatedPlant,
    MakeTrueModel,
    SimulatedPlant,
    feedforward_strength,
)
from drake_quad.simulation.prepare import PreparedScenario
from drake_quad.simulation.signal_log import AddLoggers, PartLogger, logs_of
from drake_quad.stability.equilibrium_region import HULL, stricter
from drake_quad.stability.margins import MarginEstimator
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.controller import MakeController, MakeTracking
from drake_quad.systems.disturbances import Delay, Disturbances, PushSource
from drake_quad.systems.sensors import Imu, JointSensor
from drake_quad.systems.stability_monitor import NO_SUPPORT, StabilityMonitor
from drake_quad.terrain.course import Course

# ------------------------------------------------------------------------------------------------
# The monitors beside the simulated plant: they measure the truth, and nobody is told by them.
# ------------------------------------------------------------------------------------------------


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
    period: float,
    log_period: float,
    height_limit: float,
    margins: str,
    friction: float,
) -> Monitors:
    """Adds them, connected with the plant.

    Args:
        builder: That holds the plant.
        simulated: The plant.
        robot: As its controller knows it.
        disturbances: What makes it another robot than that.
        period: Between measurements [s].
        log_period: Between samples of the log, which is to miss no smallest margin [s].
        height_limit: Of the trunk over its feet [m], below which the robot fell.
        margins: Which are measured, one of `drake_quad.stability.equilibrium_region.KINDS`.
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
            period=period,
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
            gauge_period=period * max(1, round(GAUGE_PERIOD / period)),
        ),
    )
    builder.Connect(
        plant.get_contact_results_output_port(), contact.GetInputPort("contact_results")
    )
    if contact.HasInputPort("plant_state"):
        builder.Connect(plant.get_state_output_port(), contact.GetInputPort("plant_state"))
    builder.Connect(plant.get_state_output_port(), stability.GetInputPort("robot_state"))
    # A margin is of the contacts of its own instant, and not of those last sensed.
    builder.Connect(
        contact.GetOutputPort("contact_state"), stability.GetInputPort("contact_state_measured")
    )
    for port in ("foot_contact_position", "foot_force_measured"):
        builder.Connect(contact.GetOutputPort(port), stability.GetInputPort(port))
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


# ------------------------------------------------------------------------------------------------
# The robot's own sensors beside the simulated plant, for a controller that estimates its state.
# ------------------------------------------------------------------------------------------------


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


def velocities_at_rest(q: FloatArray) -> dict[str, FloatArray]:
    """What they say of a robot at rest on level ground with joint angles `q` (12,) [rad]."""
    return {
        "imu_measured": np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY]),
        "joint_state_measured": np.concatenate([q, np.zeros(12)]),
    }


# ------------------------------------------------------------------------------------------------
# The wires between the controller and the robot: what it senses, and what its drives are told.
# ------------------------------------------------------------------------------------------------


COMMANDS = ("joint_state_desired", "joint_torque_feedforward")


def ConnectSenses(
    builder: DiagramBuilder,
    controller: Diagram,
    senses: Mapping[str, OutputPort],
    *,
    initial: Mapping[str, FloatArray],
    delay: float,
    time_step: float,
) -> None:
    """Connects each of the controller's inputs to the sense of its name, all of them late.

    Args:
        builder: That holds the controller and the senses.
        controller: Of which every input is connected.
        senses: By name; those that the controller has no port for are left alone.
        initial: What comes before anything has come through, for senses whose is not 0.
        delay: A whole number of the plant's steps [s].
        time_step: The plant's [s].
    """
    names = [controller.get_input_port(k).get_name() for k in range(controller.num_input_ports())]
    zero = {name: np.zeros(senses[name].size()) for name in names}
    late = _late(
        builder,
        "sensor_delay",
        {name: senses[name] for name in names},
        initial=zero | {name: initial[name] for name in names if name in initial},
        delay=delay,
        time_step=time_step,
    )
    for name in names:
        builder.Connect(late[name], controller.GetInputPort(name))


def ConnectDrives(
    builder: DiagramBuilder,
    controller: Diagram,
    *,
    desired: InputPort,
    feedforward: InputPort,
    angles: FloatArray,
    strength: FloatArray,
    delay: float,
    time_step: float,
) -> None:
    """Connects the controller's commands to the plant's drives.

    Args:
        builder: That holds both.
        controller: With the ports joint_state_desired and joint_torque_feedforward.
        desired: Of the plant.
        feedforward: Of the plant.
        angles: (12,) that the drives hold until a command has come [rad], by actuator.
        strength: (12,) the part of each feed-forward torque that is delivered.
        delay: A whole number of the plant's steps [s].
        time_step: The plant's [s].
    """
    n = len(angles)
    late = _late(
        builder,
        "command_delay",
        {name: controller.GetOutputPort(name) for name in COMMANDS},
        initial={COMMANDS[0]: np.concatenate([angles, np.zeros(n)]), COMMANDS[1]: np.zeros(n)},
        delay=delay,
        time_step=time_step,
    )
    torque = late[COMMANDS[1]]
    if np.any(strength != 1.0):
        weak = builder.AddNamedSystem("motor_strength", Gain(strength))
        builder.Connect(torque, weak.get_input_port())
        torque = weak.get_output_port()
    builder.Connect(late[COMMANDS[0]], desired)
    builder.Connect(torque, feedforward)


def _late(
    builder: DiagramBuilder,
    name: str,
    signals: Mapping[str, OutputPort],
    *,
    initial: Mapping[str, FloatArray],
    delay: float,
    time_step: float,
) -> dict[str, OutputPort]:
    """The signals by name, behind a Delay called `name` if there is any delay."""
    if delay == 0.0:
        return dict(signals)
    system = builder.AddNamedSystem(
        name, Delay(initial=initial, period=time_step, steps=round(delay / time_step))
    )
    for key, port in signals.items():
        builder.Connect(port, system.GetInputPort(key))
    return {key: system.GetOutputPort(f"{key}_delayed") for key in signals}


# ------------------------------------------------------------------------------------------------
# The simulated stair climb.
# ------------------------------------------------------------------------------------------------


SENSING_PERIOD = 0.004  # [s]

# Adds viewers to a builder that holds a finalized plant and its scene graph.
Visualize = Callable[[DiagramBuilder, MultibodyPlant, SceneGraph], None]


@dataclass(frozen=True)
class StairClimb:
    """The simulated stair climb and what its user needs to reach in it."""

    diagram: Diagram
    plant: MultibodyPlant
    scene_graph: SceneGraph
    layout: StateLayout
    loggers: dict[str, PartLogger]
    monitor_period: float


def MakeStairClimb(
    *,
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    control: ControlSettings,
    stance: Stance,
    plant_config: MultibodyPlantConfig,
    friction: float,
    log_period: float,
    margins: str = HULL,
    world: Course | None = None,
    disturbances: Disturbances | None = None,
    sensors: SensorErrors | None = None,
    visualize: Visualize | None = None,
    tracking: str | MakeTracking | None = None,
) -> StairClimb:
    """Wires plant, controller, monitors and loggers; the robot stands in `stance` at first.

    Args:
        robot: As its controller knows it.
        course: The map that the controller plans on.
        settings: The planner's.
        mission: What it does.
        control: The controller's settings; see monitor_period.
        stance: In which the robot stands at first.
        plant_config: Drake's.
        friction: Coulomb's coefficient between feet and ground.
        log_period: Between samples of the log [s].
        margins: Which are measured, one of `drake_quad.stability.equilibrium_region.KINDS`.
        world: The course as it is; as the map has it if none is given.
        disturbances: What the controller is not told; none if not given.
        sensors: Those that the controller estimates its state from; none: it is told its state.
        visualize: Adds viewers to the Diagram.
        tracking: As of MakeController.
    """
    world = course if world is None else world
    disturbances = disturbances or Disturbances()
    builder = DiagramBuilder()
    simulated = AddSimulatedPlant(
        builder,
        robot=robot,
        world=world,
        control=control,
        stance=stance,
        config=plant_config,
        friction=friction,
        disturbances=disturbances,
    )
    plant, scene_graph, instance, layout = simulated
    controller = builder.AddNamedSystem(
        "controller",
        MakeController(
            robot=robot,
            course=course,
            settings=settings,
            mission=mission,
            control=control,
            model=MakeModelPlant(robot.url),
            start=None if sensors is None else stance,
            tracking=tracking,
        ),
    )
    monitors = AddMonitors(
        builder,
        simulated,
        robot=robot,
        disturbances=disturbances,
        period=monitor_period(control.period),
        log_period=log_period,
        height_limit=0.5 * settings.body_height,
        margins=margins,
        friction=friction,
    )
    push_source = AddPushes(builder, simulated, disturbances)

    senses = {
        "robot_state_estimated": plant.get_state_output_port(),
        "contact_state_measured": monitors.contact.GetOutputPort("contact_state_measured"),
    }
    start = np.concatenate([plant.GetDefaultPositions(), np.zeros(plant.num_velocities())])
    initial = {"robot_state_estimated": start}
    if sensors is not None:
        senses |= AddSensors(
            builder,
            plant.get_state_output_port(),
            layout=layout,
            errors=sensors,
            period=control.period,
        )
        initial |= velocities_at_rest(start[layout.q_joints])
    ConnectSenses(
        builder,
        controller,
        senses,
        initial=initial,
        delay=disturbances.sensor_delay,
        time_step=plant.time_step(),
    )
    ConnectDrives(
        builder,
        controller,
        desired=plant.get_desired_state_input_port(instance),
        feedforward=plant.get_actuation_input_port(instance),
        angles=start[layout.q_joints][np.argsort(layout.actuators)],
        strength=feedforward_strength(plant, robot, layout, disturbances),
        delay=disturbances.command_delay,
        time_step=plant.time_step(),
    )
    systems = {
        "plant": plant,
        "controller": controller,
        "contact_monitor": monitors.contact,
        "stability_monitor": monitors.stability,
        "push_source": push_source,
    }
    kind = "whole_body" if controller.HasOutputPort("qp_state") else "ik"
    logs = logs_of(kind, estimated=sensors is not None, margins=margins)
    ports = {name: systems[system].GetOutputPort(port) for name, system, port in logs}
    loggers = AddLoggers(builder, ports, log_period)
    if visualize is not None:
        visualize(builder, plant, scene_graph)
    diagram = builder.Build()
    diagram.set_name("stair_climb")
    period = monitor_period(control.period)
    return StairClimb(diagram, plant, scene_graph, layout, loggers, period)


def monitor_period(control_period: float) -> float:
    """Of the monitors and of the feet's contact sensors [s]: a few of the controller's ticks.

    250 Hz are enough for what they tell, and leave the loop its time.
    """
    return control_period * max(1, round(SENSING_PERIOD / control_period))


def stair_climb_of(
    preparation: PreparedScenario,
    *,
    visualize: Visualize | None = None,
    tracking: str | MakeTracking | None = None,
) -> StairClimb:
    """The simulation of a prepared scenario.

    Args:
        preparation: From `prepare`.
        visualize: Adds viewers to the Diagram.
        tracking: As of MakeController.
    """
    scenario = preparation.scenario
    return MakeStairClimb(
        robot=preparation.robot,
        course=preparation.course,
        settings=preparation.settings,
        mission=preparation.tasks,
        control=control_settings(scenario),
        stance=preparation.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=scenario.simulation.log_period,
        margins=stricter(scenario.monitor.margins, scenario.gait.margin),
        world=preparation.world,
        disturbances=preparation.disturbances,
        sensors=sensor_errors(scenario),
        visualize=visualize,
        tracking=tracking,
    )


__all__ = ["MakeController", "MakeStairClimb", "StairClimb", "stair_climb_of"]
