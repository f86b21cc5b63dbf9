"""The robot stands at its start and looks: the simulated world with a depth camera in it."""

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_quad.perception.level_beyond import level_beyond
from drake_quad.perception.sight import Sight
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.eyes import AddEyes, look_period, model_of, mount_of
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.depth_camera import DepthImage
from drake_quad.systems.stair_estimator import StairEstimator, StairReport, pose_at_capture

TICK = 1e-3  # [s] after the look's end, so that what falls due then is done


def look_around(prepared: PreparedScenario) -> Sight:
    """Simulates the robot as it stands and looks, for the scenario's `perception.look_time`.

    Args:
        prepared: The robot at its start, with a map of the floor that it stands on and no other,
            in the world as it really is.

    Raises:
        MachineError: This machine cannot render.
    """
    found: list[StairEstimator] = []

    def visualize(builder: DiagramBuilder, _: MultibodyPlant, __: SceneGraph) -> None:
        found.append(AddEyes(builder, prepared))

    climb = stair_climb_of(prepared, visualize=visualize)
    simulator = Simulator(climb.diagram)
    ApplySimulatorConfig(prepared.scenario.simulation.simulator, simulator)
    simulator.set_target_realtime_rate(0.0)
    perception = prepared.scenario.perception
    simulator.AdvanceTo(perception.look_time + TICK)
    estimator = found[0]
    context = estimator.GetMyContextFromRoot(simulator.get_context())
    report: StairReport = estimator.GetOutputPort("stairs").Eval(context)
    image: DepthImage = estimator.GetInputPort("depth_measured").Eval(context)
    belief, level = report.belief, None
    if belief is not None and belief.going_up:
        X_BC = mount_of(perception, prepared.robot)
        pose = pose_at_capture(image, X_BC.rotation().matrix(), X_BC.translation())
        level = level_beyond(
            image.depth, model_of(prepared.scenario), pose, belief, landing=perception.landing
        )
    return Sight(
        belief=belief,
        stamp=report.stamp,
        images=round(perception.look_time / look_period(perception)),
        depth=image.depth,
        level=level,
    )
