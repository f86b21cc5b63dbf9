"""The world that depth cameras see: robot and course once more, in a SceneGraph of their own.

A renderer that is part of the simulated SceneGraph is told every pose at every step of the physics,
which costs a fifth of a run. This one is told when an image is taken.
"""

from typing import NamedTuple

from pydrake.geometry import FrameId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from drake_quad.robot.loader import AddRobot
from drake_quad.robot.model import RobotModel
from drake_quad.simulation.plant import AddPayload
from drake_quad.systems.disturbances import Disturbances
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse


class RenderedWorld(NamedTuple):
    """What AddRenderedWorld added: what is seen, and the trunk's frame in it."""

    scene_graph: SceneGraph
    trunk: FrameId


def AddRenderedWorld(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    *,
    robot: RobotModel,
    world: Course,
    disturbances: Disturbances,
) -> RenderedWorld:
    """Adds what cameras see, which moves as the simulated plant does.

    Args:
        builder: Builder that holds the plant.
        plant: The simulated plant, finalized.
        robot: The robot as its controller knows it.
        world: The course as it really is.
        disturbances: Disturbances, for the payload, which is seen, too.
    """
    scene_graph: SceneGraph = builder.AddSystem(SceneGraph())
    scene_graph.set_name("rendered_world")
    shown = MultibodyPlant(0.0)
    source = shown.RegisterAsSourceForSceneGraph(scene_graph)
    instance = AddRobot(shown, robot.url)
    trunk = shown.GetBodyByName(robot.trunk, instance)
    AddPayload(shown, trunk, disturbances)
    AddCourse(shown, world, friction=1.0)
    shown.Finalize()
    assert shown.GetPositionNames(instance) == plant.GetPositionNames(
        plant.GetModelInstanceByName(shown.GetModelInstanceName(instance))
    )
    poses = builder.AddSystem(MultibodyPositionToGeometryPose(shown, input_multibody_state=True))
    poses.set_name("rendered_poses")
    builder.Connect(plant.get_state_output_port(), poses.get_input_port())
    builder.Connect(poses.get_output_port(), scene_graph.get_source_pose_port(source))
    return RenderedWorld(scene_graph, shown.GetBodyFrameIdOrThrow(trunk.index()))
