"""The robot on its course as a Drake scene that is moved by hand, for any of Drake's viewers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import to_rgb
from pydrake.geometry import SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_quad.gait.legs import FloatArray
from drake_quad.report.run_files import Run
from drake_quad.report.style import COM_COLOUR
from drake_quad.robot.course_geometry import AddCourse
from drake_quad.robot.load_robot import AddRobot

COM_RADIUS = 0.035  # [m]

AddViewer = Callable[[DiagramBuilder, SceneGraph], object]


@dataclass(frozen=True, eq=False)
class ReplayScene:
    """A scene at one sample of a run at a time; `show` moves it there.

    Attributes:
        run: The run.
        diagram: Plant, scene and viewer, without physics.
        context: The diagram's own.
        plant: The robot, the course, and a ball for the robot's centre of mass.
        robot: The robot in it.
        com: The ball.
    """

    run: Run
    diagram: Diagram
    context: Context
    plant: MultibodyPlant
    robot: ModelInstanceIndex
    com: RigidBody

    def show(self, sample: int, *, time: float) -> None:
        """Moves the robot to a sample of the log, and publishes it as of `time` [s]."""
        context = self.plant.GetMyMutableContextFromRoot(self.context)
        p_WScm = self.run.log.vector("com")[sample]
        if np.all(np.isfinite(p_WScm)):
            self.plant.SetFloatingBaseBodyPoseInWorldFrame(
                context, self.com, RigidTransform(p_WScm)
            )
        self.plant.SetPositions(context, self.robot, self.run.positions[sample])
        self.context.SetTime(time)
        self.diagram.ForcedPublish(self.context)


def MakeReplayScene(run: Run, add_viewer: AddViewer) -> ReplayScene:
    """Builds the scene of a run with the viewer that `add_viewer` puts beside it."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    robot = AddRobot(plant, run.robot.url)
    AddCourse(plant, run.world, friction=1.0)
    com = plant.AddRigidBody("com", plant.AddModelInstance("centre_of_mass"))
    colour = np.array([*to_rgb(COM_COLOUR), 1.0])
    plant.RegisterVisualGeometry(com, RigidTransform(), Sphere(COM_RADIUS), "com", colour)
    plant.Finalize()
    add_viewer(builder, scene_graph)
    diagram = builder.Build()
    diagram.set_name("replay")
    return ReplayScene(run, diagram, diagram.CreateDefaultContext(), plant, robot, com)


def frame_samples(t: FloatArray, fps: float) -> list[int]:
    """The sample nearest before each frame's time, and the last: `fps` a second from the first.

    Samples whose state is not known are the caller's to leave out.
    """
    if not len(t):
        return []
    times = np.arange(t[0], t[-1], 1.0 / fps)
    found = np.searchsorted(t, times + 1e-9, side="right") - 1
    return [int(k) for k in np.unique(np.append(found, len(t) - 1))]


def shown_samples(run: Run, fps: float) -> list[int]:
    """The samples of a run to show at `fps`: those whose positions are all known."""
    known = np.all(np.isfinite(run.positions), axis=1).tolist()
    return [k for k in frame_samples(run.log.t, fps) if known[k]]
