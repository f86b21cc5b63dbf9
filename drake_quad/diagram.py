"""The Diagrams: a controller that could be put on a robot, and the simulated stair climb.

`MakeController` holds the scheduler, the planner and the IK controller around a model of the robot;
its ports are what a robot has. `MakeStairClimb` puts it beside a MultibodyPlant that holds the
robot and the course, the monitors, and the loggers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_quad.errors import InputError
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.mission import Task
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.course_geometry import AddCourse
from drake_quad.robot.load_robot import AddRobot, MakeModelPlant
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.robot_state import StateLayout, make_layout
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.control_settings import ControlSettings
from drake_quad.systems.gait_scheduler import GaitScheduler
from drake_quad.systems.ik_controller import IkController
from drake_quad.systems.stability_monitor import StabilityMonitor
from drake_quad.systems.transition_planner import TransitionPlanner
from drake_quad.terrain import Course


def MakeController(
    *,
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    control: ControlSettings,
    model: MultibodyPlant,
) -> Diagram:
    """Returns the controller as a Diagram of its own.

    Input ports:
        robot_state_estimated: [q; v] in the order of `model`.
        contact_state_measured: (4,) 1 where a foot bears.
        lift_off_margin: (4,) static margin without each leg [m].
    Output ports:
        joint_state_desired, joint_torque_feedforward: Commands, in `model`'s actuator order.
        gait_phase, contact_state_desired, body_desired, feet_desired: For logs.
        motion_plan: The plan of the task under way (abstract).
    """
    layout = make_layout(model, robot)
    builder = DiagramBuilder()
    scheduler = builder.AddNamedSystem(
        "gait_scheduler",
        GaitScheduler(
            num_tasks=len(mission),
            period=control.period,
            lift_off_margin=control.lift_off_margin,
            patience=control.patience,
        ),
    )
    planner = builder.AddNamedSystem(
        "transition_planner",
        TransitionPlanner(
            robot=robot, layout=layout, course=course, settings=settings, mission=mission
        ),
    )
    ik = builder.AddNamedSystem(
        "ik_controller",
        IkController(robot=robot, layout=layout, model=model, control=control),
    )
    plan, phase = planner.GetOutputPort("motion_plan"), scheduler.GetOutputPort("gait_phase")
    builder.Connect(plan, scheduler.GetInputPort("motion_plan"))
    builder.Connect(plan, ik.GetInputPort("motion_plan"))
    builder.Connect(phase, planner.GetInputPort("gait_phase"))
    builder.Connect(phase, ik.GetInputPort("gait_phase"))
    for name in ("contact_state_measured", "lift_off_margin"):
        builder.ExportInput(scheduler.GetInputPort(name), name)
    state = builder.ExportInput(
        planner.GetInputPort("robot_state_estimated"), "robot_state_estimated"
    )
    builder.ConnectInput(state, ik.GetInputPort("robot_state_estimated"))
    for system, names in (
        (ik, ("joint_state_desired", "joint_torque_feedforward", "body_desired", "feet_desired")),
        (scheduler, ("gait_phase", "contact_state_desired")),
        (planner, ("motion_plan",)),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    diagram = builder.Build()
    diagram.set_name("controller")
    return diagram


# Adds viewers to a builder that holds a finalized plant and its scene graph.
Visualize = Callable[[DiagramBuilder, MultibodyPlant, SceneGraph], None]


@dataclass(frozen=True)
class StairClimb:
    """The simulated stair climb and what its user needs to reach in it."""

    diagram: Diagram
    plant: MultibodyPlant
    scene_graph: SceneGraph
    layout: StateLayout
    loggers: dict[str, VectorLogSink]
    monitor_period: float


# What is logged: name of the log, system, port. The loggers run at the log period.
LOGS = (
    ("state", "plant", "state"),
    ("torque", "plant", "net_actuation"),
    ("gait_phase", "controller", "gait_phase"),
    ("standing", "controller", "contact_state_desired"),
    ("body_desired", "controller", "body_desired"),
    ("feet_desired", "controller", "feet_desired"),
    ("bearing", "contact_monitor", "contact_state_measured"),
    ("force", "contact_monitor", "foot_force_measured"),
    ("contact_position", "contact_monitor", "foot_contact_position"),
    ("slip_speed", "contact_monitor", "foot_slip_speed"),
    ("nonfoot", "contact_monitor", "nonfoot_contact"),
    ("margin", "stability_monitor", "stability_margin"),
    ("zmp_margin", "stability_monitor", "zmp_margin"),
    ("com", "stability_monitor", "com_position"),
)


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
    visualize: Visualize | None = None,
) -> StairClimb:
    """Wires plant, controller, monitors and loggers; the robot stands in `stance` at first."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config, builder)
    instance = AddRobot(plant, robot.url)
    AddCourse(plant, course, friction=friction)
    plant.Finalize()
    layout = make_layout(plant, robot)
    # After Finalize: before it a model instance has no actuator indices, and the loop sets none.
    for index in plant.GetJointActuatorIndices(instance):
        plant.get_joint_actuator(index).set_controller_gains(
            PdControllerGains(p=control.kp, d=control.kd)
        )
    _SetDefaultStance(plant, robot, layout, stance)

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
        ),
    )
    inspector = scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    contact_monitor = builder.AddNamedSystem(
        "contact_monitor",
        ContactMonitor(
            plant=plant,
            foot_geometries=find_feet(plant, robot, names),
            robot=robot,
            period=control.period,
        ),
    )
    stability_monitor = builder.AddNamedSystem(
        "stability_monitor",
        StabilityMonitor(
            model=model,
            layout=layout,
            period=control.period,
            height_limit=0.5 * settings.body_height,
        ),
    )

    def connect(a: object, out: str, b: object, into: str) -> None:
        builder.Connect(a.GetOutputPort(out), b.GetInputPort(into))  # type: ignore[attr-defined]

    connect(plant, "state", controller, "robot_state_estimated")
    connect(plant, "state", stability_monitor, "robot_state")
    connect(plant, "contact_results", contact_monitor, "contact_results")
    for port in ("contact_state_measured", "foot_contact_position", "foot_force_measured"):
        connect(contact_monitor, port, stability_monitor, port)
    connect(contact_monitor, "contact_state_measured", controller, "contact_state_measured")
    connect(stability_monitor, "lift_off_margin", controller, "lift_off_margin")
    builder.Connect(
        controller.GetOutputPort("joint_state_desired"),
        plant.get_desired_state_input_port(instance),
    )
    builder.Connect(
        controller.GetOutputPort("joint_torque_feedforward"),
        plant.get_actuation_input_port(instance),
    )
    systems = {
        "plant": plant,
        "controller": controller,
        "contact_monitor": contact_monitor,
        "stability_monitor": stability_monitor,
    }
    loggers = {
        name: LogVectorOutput(systems[system].GetOutputPort(port), builder, log_period)
        for name, system, port in LOGS
    }
    for name, logger in loggers.items():
        logger.set_name(f"log_{name}")
    if visualize is not None:
        visualize(builder, plant, scene_graph)
    diagram = builder.Build()
    diagram.set_name("stair_climb")
    return StairClimb(diagram, plant, scene_graph, layout, loggers, control.period)


def _SetDefaultStance(
    plant: MultibodyPlant, robot: RobotModel, layout: StateLayout, stance: Stance
) -> None:
    """Makes `stance` the plant's default positions.

    Raises:
        InputError: If the robot cannot stand so.
    """
    q, excess, _ = pose_robot(robot, stance.body[None], stance.feet[None])
    angles = q.reshape(12)
    outside = (angles < robot.q_lower) | (angles > robot.q_upper)
    if excess.max() > 1e-6 or np.any(outside):
        raise InputError(
            source=robot.name,
            field="gait.body_height",
            value=float(stance.body[2]),
            remedy=f"the legs cannot stand so: {excess.max():.3f} m out of reach",
        )
    positions = np.array(plant.GetDefaultPositions())
    _, pitch, yaw = 0.0, stance.body[3], stance.body[4]
    quaternion = RollPitchYaw(0.0, pitch, yaw).ToQuaternion()
    positions[layout.q_base : layout.q_base + 4] = quaternion.wxyz()
    positions[layout.q_base + 4 : layout.q_base + 7] = stance.body[:3]
    positions[layout.q_joints] = angles
    plant.SetDefaultPositions(positions)


__all__ = [
    "LOGS",
    "AddCourse",
    "ControlSettings",
    "FloatArray",
    "MakeController",
    "MakeStairClimb",
    "StairClimb",
]
