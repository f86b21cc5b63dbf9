"""The world that depth cameras see is the one that is simulated."""

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_noise import IDEAL_DEPTH
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.rendered_world import AddRenderedWorld
from drake_quad.systems.depth_camera import AddDepthCamera, DepthCamera

TEXT = """
course:
  - {kind: floor, length: 1.6}
  - {kind: stairs, going: up, rise: 0.13, run: 0.50, count: 3}
  - {kind: landing, length: 3.0}
start: {distance: 1.0}
controller: {kind: whole_body, period: 0.002}
world: {rise_error: 0.02}
disturbances: {payload: {mass: 8.0, x: 0.25, z: 0.15}}
"""
MODEL = D435.model.decimated(4)


def test_it_moves_as_the_plant_does_and_shows_what_the_plant_shows() -> None:
    """Two cameras on the trunk, one in each SceneGraph, see the same while the robot walks.

    That is so from behind and above the robot, with its legs, its payload and the true stairs in
    view.
    """
    p = prepare(parse_scenario(TEXT, source="test"), source="test")
    cameras: list[DepthCamera] = []
    X_BC = RigidTransform(RotationMatrix(level_rotation(pitch=np.radians(50.0))), [-0.9, 0.3, 0.9])

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        seen = AddRenderedWorld(
            builder, plant, robot=p.robot, world=p.world, disturbances=p.disturbances
        )
        own = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(p.robot.trunk).index())
        for name, graph, parent in (("a", scene_graph, own), ("b", seen.scene_graph, seen.trunk)):
            camera = AddDepthCamera(
                builder, graph, parent=parent, X_PC=X_BC, camera=D435, model=MODEL,
                noise=IDEAL_DEPTH, generator=np.random.default_rng(0), latency=0.0,
            )  # fmt: skip
            camera.set_name(f"camera_{name}")
            builder.GetSubsystemByName("depth_camera_truth").set_name(f"truth_{name}")
            builder.ExportInput(camera.GetInputPort("base_pose_estimated"), f"pose_{name}")
            cameras.append(camera)

    climb = stair_climb_of(p, visualize=add)
    simulator = Simulator(climb.diagram)
    context = simulator.get_mutable_context()
    for name in ("pose_a", "pose_b"):
        climb.diagram.GetInputPort(name).FixValue(context, np.eye(7)[0])
    images = []
    for time in (0.05, 3.05):
        simulator.AdvanceTo(time)
        own, shown = (
            camera.GetOutputPort("depth_measured").Eval(camera.GetMyContextFromRoot(context))
            for camera in cameras
        )
        assert own.stamp == shown.stamp and np.mean(own.depth > 0.0) > 0.4
        assert np.array_equal(own.depth, shown.depth)
        images.append(shown.depth)
    assert np.mean(np.abs(images[0] - images[1]) > 0.01) > 0.05
