"""The monitors beside the simulated plant: they measure the truth, and nobody is told by them."""

from math import ceil
from typing import NamedTuple

from pydrake.systems.framework import DiagramBuilder

from drake_quad.diagram_plant import MakeTrueModel, SimulatedPlant
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.measured import Gauge
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.disturbances import Disturbances
from drake_quad.systems.push_source import PushSource
from drake_quad.systems.stability_monitor import NO_SUPPORT, StabilityMonitor

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
        margins: Which are measured, one of `drake_quad.stability.kinds.KINDS`.
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
    gauge = Gauge(
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
    for port in ("contact_state_measured", "foot_contact_position", "foot_force_measured"):
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
