"""The robot on its course for the replay, moved by hand, and where it is seen from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import to_rgb
from pydrake.geometry import Meshcat, SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.report.style import COM_COLOUR
from drake_quad.robot.loader import AddRobot
from drake_quad.runs.reader import RecordedRun
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse

COM_RADIUS = 0.035  # [m]

AddViewer = Callable[[DiagramBuilder, SceneGraph], object]

SIDE = (-0.35, -1.0)  # of a straight course along x: from its right, a little from behind
ELEVATION = 0.5  # [rad] over the horizon
FIELD_OF_VIEW = np.radians(75.0)  # Meshcat's own, upright
ASPECT = 1.6  # of the window, width to height
BORDER = 1.04  # a little air around the course
TALL, SHOWN = 1.1, 0.2  # [m] of robot over each tread, and of the box under it

SUN, SKY = 2.0, 1.1  # intensities of the two lights


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
        p_WScm: Where the whole robot's centre of mass is, a row a sample (N, 3) [m].
    """

    run: RecordedRun
    diagram: Diagram
    context: Context
    plant: MultibodyPlant
    robot: ModelInstanceIndex
    com: RigidBody
    p_WScm: FloatArray

    def show(self, sample: int, *, time: float) -> None:
        """Moves the robot to a sample of the log, and publishes it as of `time` [s]."""
        context = self.plant.GetMyMutableContextFromRoot(self.context)
        p_WScm = self.p_WScm[sample]
        if np.all(np.isfinite(p_WScm)):
            self.plant.SetFloatingBaseBodyPoseInWorldFrame(
                context, self.com, RigidTransform(p_WScm)
            )
        self.plant.SetPositions(context, self.robot, self.run.positions[sample])
        self.context.SetTime(time)
        self.diagram.ForcedPublish(self.context)


def MakeReplayScene(run: RecordedRun, add_viewer: AddViewer) -> ReplayScene:
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
    context, p_WScm = diagram.CreateDefaultContext(), run.log.vector("com")
    return ReplayScene(run, diagram, context, plant, robot, com, p_WScm)


def frame_samples(t: FloatArray, fps: float) -> list[int]:
    """The sample nearest before each frame's time, and the last: `fps` a second from the first.

    Samples whose state is not known are the caller's to leave out.
    """
    if not len(t):
        return []
    times = np.arange(t[0], t[-1], 1.0 / fps)
    found = np.searchsorted(t, times + 1e-9, side="right") - 1
    return [int(k) for k in np.unique(np.append(found, len(t) - 1))]


def shown_samples(run: RecordedRun, fps: float) -> list[int]:
    """The samples of a run to show at `fps`: those whose positions are all known."""
    known = np.all(np.isfinite(run.positions), axis=1).tolist()
    return [k for k in frame_samples(run.log.t, fps) if known[k]]


def set_camera_and_lights(meshcat: Meshcat, course: Course) -> None:
    """A plain background, even light, and the camera where the whole course shows."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", [0.93, 0.95, 0.97])
    meshcat.SetProperty("/Background/<object>", "bottom_color", [0.78, 0.81, 0.84])
    camera, target = camera_pose(course)
    meshcat.SetCameraPose(camera, target)
    # Meshcat's own lamps stand around the origin and fade within metres: a sun lights all of the
    # course alike, from the camera's left, so that tops, fronts and sides of the treads differ.
    for lamp in ("PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    away = camera - target
    sun = np.array([away[0] + 0.8 * away[1], away[1] - 0.8 * away[0], 1.6 * np.linalg.norm(away)])
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", list(target + sun))
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", SUN)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", SKY)


def camera_pose(course: Course) -> tuple[FloatArray, FloatArray]:
    """Where to stand (3,) and what to look at (3,), in W [m].

    A straight course is seen from its side. One with a turn is seen from the corner that it goes
    around: from there no flight hides another, and every flight shows its profile.
    """
    corners = _corners(course)
    low, high = corners.min(axis=0), corners.max(axis=0)
    target = 0.5 * (low + high)
    areas = np.array([box.size[0] * box.size[1] for box in course.boxes])
    centres = np.stack([box.centre[:2] for box in course.boxes])
    inner = target[:2] - areas @ centres / areas.sum()
    turned = np.linalg.norm(inner) > 0.1 * np.linalg.norm(high[:2] - low[:2])
    way = inner if turned else np.array(SIDE)
    way = way / np.linalg.norm(way)
    look = np.array([*(np.cos(ELEVATION) * way), np.sin(ELEVATION)])
    return _stand_off(corners, target, look)


def _corners(course: Course) -> FloatArray:
    """All that has to be in the picture (n, 3) [m]: the boxes, and a robot on top of each."""
    found = []
    for box in course.boxes:
        for z in (box.top - SHOWN, box.top + TALL):
            found.append(np.column_stack([box.corners(), np.full(4, z)]))
    return np.concatenate(found)


def _stand_off(
    corners: FloatArray, target: FloatArray, look: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Camera and target, so far off along `look` (3,) that the corners fill the window.

    The target is moved sideways first: what is in the middle of the world is not what is in the
    middle of the picture.
    """
    right = np.cross([0.0, 0.0, 1.0], look)
    right /= np.linalg.norm(right)
    up = np.cross(look, right)
    half_up = np.tan(0.5 * FIELD_OF_VIEW)
    half = np.array([half_up * ASPECT, half_up])
    distance = 1.0
    for _ in range(20):  # the two depend on one another; this settles within a millimetre
        p = (corners - target) @ np.column_stack([right, up, look])
        seen = p[:, :2] / (distance - np.minimum(p[:, 2:], distance - 0.1))
        middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
        target = target + distance * (middle[0] * right + middle[1] * up)
        p = (corners - target) @ np.column_stack([right, up, look])
        distance = float(np.max(np.abs(p[:, :2]) / half + p[:, 2:]))
    return target + BORDER * distance * look, target
