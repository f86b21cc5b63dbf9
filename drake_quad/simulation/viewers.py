"""Live viewers for a simulation: Meshcat in a browser, or Meldis over LCM."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import DrakeVisualizer, Meshcat, MeshcatVisualizer, SceneGraph
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import ConnectContactResultsToDrakeVisualizer, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem

from drake_quad.simulation.diagram import Visualize

CAMERA_PERIOD = 0.1  # [s]
CAMERA_OFFSET = np.array([-0.8, -2.6, 1.1])  # [m] from the robot: beside it, and a little behind
FARTHEST = 2.0  # [m] that the robot walks before the camera is moved after it
NEWTONS_PER_METER = 800.0  # an arrow of half the robot's weight is about 0.4 m long


class _LcmOwner(LeafSystem):
    """Holds an LCM bus in the Diagram: what publishes on it does not keep it alive."""

    def __init__(self, lcm_url: str) -> None:
        super().__init__()
        self.lcm = DrakeLcm(lcm_url)


class CameraFollower(LeafSystem):
    """Keeps Meshcat's camera on the robot, and people's way of looking at it.

    Meshcat turns its view about the camera's target. So the target goes with the robot, and the
    camera itself, which people may have turned, is moved only where the robot has walked FARTHEST.

    Input ports:
        body_poses: Poses of the plant's bodies (abstract).
    """

    def __init__(self, meshcat: Meshcat, base: int) -> None:
        """Declares the port, and when to look.

        Args:
            meshcat: Meshcat whose camera follows.
            base: Index of the robot's trunk among the poses.
        """
        super().__init__()
        self._meshcat, self._base = meshcat, base
        self._poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self._from = int(self.DeclareDiscreteState(np.full(3, np.inf)))  # where it was last moved
        self.DeclarePeriodicDiscreteUpdateEvent(CAMERA_PERIOD, 0.0, self._follow)

    def _follow(self, context: Context, state: DiscreteValues) -> None:
        p_WB = np.array(self._poses.Eval(context)[self._base].translation())
        moved = np.linalg.norm(p_WB - context.get_discrete_state(self._from).value())
        if moved > FARTHEST:
            self._meshcat.SetCameraPose(p_WB + CAMERA_OFFSET, p_WB)
            state.get_mutable_vector(self._from).SetFromVector(p_WB)
        else:
            self._meshcat.SetCameraTarget(p_WB)


def MakeMeshcatViewer(meshcat: Meshcat, *, follow: bool = True) -> Visualize:
    """Returns what adds `meshcat`, with contact forces, to a builder.

    Args:
        meshcat: Meshcat that shows it.
        follow: Whether its camera goes with the robot.
    """

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
        ContactVisualizer.AddToBuilder(
            builder, plant, meshcat, ContactVisualizerParams(newtons_per_meter=NEWTONS_PER_METER)
        )
        if follow:
            base = min(int(index) for index in plant.GetFloatingBaseBodies())
            camera = builder.AddNamedSystem("camera", CameraFollower(meshcat, base))
            builder.Connect(plant.get_body_poses_output_port(), camera.get_input_port())

    return add


def MakeMeldisViewer(lcm_url: str = "") -> Visualize:
    """Returns what publishes scene and contacts for Meldis, on the LCM bus at `lcm_url`."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        lcm = builder.AddNamedSystem("lcm", _LcmOwner(lcm_url)).lcm
        DrakeVisualizer.AddToBuilder(builder, scene_graph, lcm)
        ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, lcm)

    return add


def Together(*viewers: Visualize) -> Visualize:
    """Returns what adds all of `viewers`."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        for viewer in viewers:
            viewer(builder, plant, scene_graph)

    return add
