"""The simulated stair climb.

`MakeStairClimb` puts the controller beside a MultibodyPlant that holds the robot and the course,
the monitors, and the loggers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_quad.control.settings import ControlSettings
from drake_quad.controller import MakeController, MakeTracking
from drake_quad.diagram_logs import AddLoggers, PartLogger, logs_of
from drake_quad.diagram_monitors import AddMonitors, AddPushes
from drake_quad.diagram_plant import AddSimulatedPlant, feedforward_strength
from drake_quad.diagram_sensors import AddSensors, at_rest
from drake_quad.diagram_wires import ConnectDrives, ConnectSenses
from drake_quad.estimation.sensor_errors import SensorErrors
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.settings import PlanSettings
from drake_quad.preparation import Preparation
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout
from drake_quad.scenario import control_settings, sensor_errors
from drake_quad.stability.kinds import HULL, stricter
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain import Course

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
        margins: Which are measured, one of `drake_quad.stability.kinds.KINDS`.
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
        initial |= at_rest(start[layout.q_joints])
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
    preparation: Preparation,
    *,
    visualize: Visualize | None = None,
    tracking: str | MakeTracking | None = None,
) -> StairClimb:
    """The simulation of a prepared scenario.

    Args:
        preparation: From `preparation.prepare`.
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
