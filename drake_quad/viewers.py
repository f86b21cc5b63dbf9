"""Live viewers for a simulation: Meshcat in a browser, or Meldis over LCM."""

from pydrake.geometry import DrakeVisualizer, Meshcat, MeshcatVisualizer, SceneGraph
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import ConnectContactResultsToDrakeVisualizer, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem

from drake_quad.diagram import Visualize

NEWTONS_PER_METER = 800.0  # an arrow of half the robot's weight is about 0.4 m long


def MakeMeshcatViewer(meshcat: Meshcat) -> Visualize:
    """Returns what adds `meshcat`, with contact forces, to a builder."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
        ContactVisualizer.AddToBuilder(
            builder, plant, meshcat, ContactVisualizerParams(newtons_per_meter=NEWTONS_PER_METER)
        )

    return add


def MakeMeldisViewer(lcm_url: str = "") -> Visualize:
    """Returns what publishes scene and contacts for Meldis, on the LCM bus at `lcm_url`."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        # A system of the Diagram, so that the bus lives as long as what publishes on it.
        lcm = builder.AddNamedSystem("lcm", LcmInterfaceSystem(lcm_url=lcm_url))
        DrakeVisualizer.AddToBuilder(builder, scene_graph, lcm)
        ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, lcm)

    return add


def Together(*viewers: Visualize) -> Visualize:
    """Returns what adds all of `viewers`."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        for viewer in viewers:
            viewer(builder, plant, scene_graph)

    return add
