"""Live viewers for a simulation: Meshcat in a browser, or Meldis over LCM."""

from pydrake.geometry import DrakeVisualizer, Meshcat, MeshcatVisualizer, SceneGraph
from pydrake.lcm import DrakeLcm
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import ConnectContactResultsToDrakeVisualizer, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_quad.diagram import Visualize

NEWTONS_PER_METER = 800.0  # an arrow of half the robot's weight is about 0.4 m long


class _LcmOwner(LeafSystem):
    """Holds an LCM bus in the Diagram: what publishes on it does not keep it alive."""

    def __init__(self, lcm_url: str) -> None:
        super().__init__()
        self.lcm = DrakeLcm(lcm_url)


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
