"""Builds the simulation's Diagram: plant, controller, monitors, sensors, wires.

`MakeStairClimb` puts the controller beside a MultibodyPlant that holds the robot and the course,
the monitors, and the loggers.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import (
    Diagram,
    DiagramBuilder,
    InputPort,
    OutputPort,
    PortDataType,
)  # fmt: skip
from pydrake.systems.primitives import Gain

from drake_quad.common import FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.estimation.contact_from_torques import TouchSettings
from drake_quad.estimation.imu_units import IMUS, MTI_300, ImuNoise
from drake_quad.estimation.sensor_models import SensorErrors, TorqueErrors
from drake_quad.planning.known_mission import Growth
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.runs.schema import sources_of
from drake_quad.scenario.build import sensor_errors, torque_errors, touch_settings
from drake_quad.simulation.eyes import AddGrowingMap, AddLandmarks
from drake_quad.simulation.instruments import (
    AddGroundNormalSensor,
    AddLoggers,
    AddMonitors,
    AddPushes,
    AddSensors,
    AddTorqueSensor,
    PartLogger,
    find_signal,
    velocities_at_rest,
)
from drake_quad.simulation.plant import AddSimulatedPlant, feedforward_strength
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.stability.margin_kinds import HULL, stricter
from drake_quad.systems.controller import MakeController, MakeTracking
from drake_quad.systems.disturbances import Delay, Disturbances
from drake_quad.systems.joint_contact_estimator import standing_torque
from drake_quad.terrain.course import Course

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
        builder: Builder that holds the controller and the senses.
        controller: Controller, all of whose vector inputs are connected.
        senses: Ports by name; those that the controller has no input for are left alone.
        initial: Values until the first sample has come through; 0 for senses without any.
        delay: Delay, a whole number of the plant's steps [s].
        time_step: Time step of the plant [s].
    """
    ports = [controller.get_input_port(k) for k in range(controller.num_input_ports())]
    names = [p.get_name() for p in ports if p.get_data_type() == PortDataType.kVectorValued]
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
        builder: Builder that holds both.
        controller: Controller with the ports joint_state_desired and joint_torque_feedforward.
        desired: Input of the plant for the joints' desired state.
        feedforward: Input of the plant for the joints' torques.
        angles: (12,) joint angles that the drives hold until a command has come [rad], by actuator.
        strength: (12,) part of each feed-forward torque that is delivered.
        delay: Delay, a whole number of the plant's steps [s].
        time_step: Time step of the plant [s].
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
    sensing_period: float


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
    feel: TouchSettings | None = None,
    feel_normals: bool = False,
    torques: TorqueErrors | None = None,
    foot_give: float = 0.0,
    visualize: Visualize | None = None,
    tracking: str | MakeTracking | None = None,
    growth: Growth | None = None,
    landmarks: bool = False,
    imu: ImuNoise = MTI_300,
) -> StairClimb:
    """Wires plant, controller, monitors and loggers; the robot stands in `stance` at first.

    Args:
        robot: The robot as its controller knows it.
        course: The map that the controller plans on.
        settings: Settings of the planner.
        mission: The tasks.
        control: Settings of the controller; see sensing_period for its period.
        stance: Stance in which the robot stands at first.
        plant_config: Drake's settings of the plant.
        friction: Coulomb's coefficient between feet and ground.
        log_period: Time between samples of the log [s].
        margins: Kind of the margins that are measured, one of `margin_kinds.KINDS`.
        world: The course as it really is; the map if None.
        disturbances: What the controller is not told; none if not given.
        sensors: Sensors from which the controller estimates its state; it is told its state if
            None.
        feel: How the controller feels which feet bear; it is told by sensors in them if None.
        feel_normals: Whether sensors in the feet tell it how the ground is tilted; else the map.
        torques: Errors of the torques by which it feels that; wanted if `feel` is given.
        foot_give: How much foot and ground give under load, as the estimator knows it [m].
        visualize: Function that adds viewers to the Diagram.
        tracking: Controller of one's own, as for MakeController.
        growth: How to plan on where the map grows; `visualize` then has to add a MapKeeper.
        landmarks: Whether what is seen of the map's flights corrects the estimated state;
            `visualize` then has to add a LandmarkFinder.
        imu: The IMU that the estimator is told that it has.
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
    model = MakeModelPlant(robot.url)
    controller = builder.AddNamedSystem(
        "controller",
        MakeController(
            robot=robot,
            course=course,
            settings=settings,
            mission=mission,
            control=control,
            model=model,
            start=None if sensors is None else stance,
            tracking=tracking,
            feel=feel,
            feel_normals=feel_normals,
            foot_give=foot_give,
            growth=growth,
            landmarks=landmarks,
            imu=imu,
        ),
    )
    monitors = AddMonitors(
        builder,
        simulated,
        robot=robot,
        disturbances=disturbances,
        sensing_period=sensing_period(control.period),
        period=control.period,
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
    if feel is not None:
        assert torques is not None
        standing = standing_torque(robot, layout, model, start)
        initial["joint_torque_measured"] = standing
        senses["joint_torque_measured"] = AddTorqueSensor(
            builder, simulated, errors=torques, initial=standing, period=control.period
        )
    if feel_normals:
        initial["ground_normal_measured"] = np.zeros(12)
        senses["ground_normal_measured"] = AddGroundNormalSensor(
            builder, simulated, monitors.contact, robot=robot, period=control.period
        )
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
    logged = sources_of(
        estimated=sensors is not None,
        whole_body=controller.HasOutputPort("qp_state"),
        margins=margins != HULL,
        felt=feel is not None,
        landmarks=landmarks,
    )
    signals = {log.name: find_signal(systems[log.system], log.port) for log in logged}
    loggers = AddLoggers(builder, signals, log_period)
    if visualize is not None:
        visualize(builder, plant, scene_graph)
    diagram = builder.Build()
    diagram.set_name("stair_climb")
    period = sensing_period(control.period)
    return StairClimb(diagram, plant, scene_graph, layout, loggers, period)


def sensing_period(control_period: float) -> float:
    """Period of the feet's contact sensors [s]: a few controller updates.

    250 Hz are enough for what they tell, and leave the loop its time. Margins, and what touches,
    are measured at each controller update, of the contacts of that instant.
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
        preparation: What `prepare` returned.
        visualize: Function that adds viewers to the Diagram.
        tracking: Controller of one's own, as for MakeController.
    """
    scenario = preparation.scenario

    landmarks = scenario.estimator.landmarks == "stairs"

    def add_eyes(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        if preparation.growth is not None:
            AddGrowingMap(builder, preparation)
        if landmarks:
            AddLandmarks(builder, preparation)
        if visualize is not None:
            visualize(builder, plant, scene_graph)

    return MakeStairClimb(
        robot=preparation.robot,
        course=preparation.course,
        settings=preparation.settings,
        mission=preparation.tasks,
        control=scenario.controller,
        stance=preparation.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=scenario.simulation.log_period,
        margins=stricter(scenario.monitor.margins, scenario.gait.margin),
        world=preparation.world,
        disturbances=preparation.disturbances,
        sensors=sensor_errors(scenario),
        feel=touch_settings(scenario),
        feel_normals=scenario.sensors.ground_normal == "feet",
        torques=torque_errors(scenario, preparation.robot),
        foot_give=scenario.estimator.foot_give,
        visualize=add_eyes,
        tracking=tracking,
        growth=preparation.growth,
        landmarks=landmarks,
        imu=IMUS[scenario.sensors.imu],
    )
