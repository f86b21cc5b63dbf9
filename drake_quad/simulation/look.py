"""The robot stands at its start and looks: the simulated world with a depth camera in it."""

import math

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_quad.errors import InputError
from drake_quad.perception.camera_model import D435, D455, CameraModel, StereoCamera, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import STEREO_NOISE
from drake_quad.perception.level_beyond import level_beyond
from drake_quad.perception.sight import Sight
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.scenario.build import generator_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.perception_config import PerceptionConfig
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.base_pose import BasePose
from drake_quad.systems.depth_camera import AddDepthCamera, DepthImage
from drake_quad.systems.stair_estimator import StairEstimator, StairReport, pose_at_capture

CAMERAS = {"d435": D435, "d455": D455}
PERIOD = 0.1  # [s] between images
LOOK_PERIOD = 0.5  # [s] between images that are looked at, at most
TICK = 1e-3  # [s] after the look's end, so that what falls due then is done
MOUNT_ROOM = 0.01  # [m] between the camera and the trunk's shapes


def camera_of(scenario: Scenario) -> StereoCamera:
    """The scenario's depth camera."""
    return CAMERAS[scenario.perception.camera]


def model_of(scenario: Scenario) -> CameraModel:
    """Intrinsics of the images of the scenario's depth camera, as it is held."""
    model = camera_of(scenario).model
    return model.turned() if scenario.perception.camera_hold == "portrait" else model


def mount_of(perception: PerceptionConfig) -> RigidTransform:
    """Where the camera is meant to be mounted on the trunk: X_BC."""
    R_BC = level_rotation(pitch=math.radians(perception.camera_pitch_deg))
    place = [perception.camera_x, perception.camera_y, perception.camera_z]
    return RigidTransform(RotationMatrix(R_BC), place)


def check_mount(perception: PerceptionConfig, robot: RobotModel, *, source: str) -> None:
    """Sees that the camera is outside of the trunk, which it would see from within.

    Args:
        perception: Where the camera is.
        robot: The robot, for its trunk's shapes.
        source: Name of the file, for the error.

    Raises:
        InputError: It is inside, or nearer than MOUNT_ROOM.
    """
    place = np.array([perception.camera_x, perception.camera_y, perception.camera_z])
    for low, high in robot.trunk_boxes:
        if np.all(place > low - MOUNT_ROOM) and np.all(place < high + MOUNT_ROOM):
            ahead, above = (float(high[k]) + MOUNT_ROOM for k in (0, 2))
            raise InputError(
                source=source,
                field="perception.camera_x",
                value=perception.camera_x,
                remedy=f"the camera would be inside the trunk: put it at {ahead:.3f} m or farther "
                f"ahead, or at a camera_z of {above:.3f} m or more",
            )


def AddEyes(
    builder: DiagramBuilder, scene_graph: SceneGraph, prepared: PreparedScenario
) -> StairEstimator:
    """Adds the depth camera on the trunk, and the estimator that looks at its images.

    They take the state that the controller takes, the true one or what it estimates, and the
    contacts that it takes, those of sensors in the feet or what it feels by the joints.

    Args:
        builder: Builder that holds plant, controller and contact monitor by these names.
        scene_graph: What is seen.
        prepared: The robot and its scenario.

    Raises:
        MachineError: This machine cannot render.
    """
    scenario, robot = prepared.scenario, prepared.robot
    plant = builder.GetSubsystemByName("plant")
    controller = builder.GetSubsystemByName("controller")
    monitor = builder.GetSubsystemByName("contact_monitor")
    camera, X_BC = camera_of(scenario), mount_of(scenario.perception)
    trunk = plant.GetBodyByName(robot.trunk)
    eyes = AddDepthCamera(
        builder,
        scene_graph,
        parent=plant.GetBodyFrameIdOrThrow(trunk.index()),
        X_PC=X_BC,
        camera=camera,
        model=camera.model,
        noise=STEREO_NOISE,
        generator=generator_of(scenario, "depth_camera"),
        portrait=scenario.perception.camera_hold == "portrait",
        period=PERIOD,
    )
    pose = builder.AddSystem(BasePose(robot=robot, layout=make_layout(plant, robot)))
    estimator: StairEstimator = builder.AddSystem(
        StairEstimator(
            model=model_of(scenario),
            R_BC=X_BC.rotation().matrix(),
            p_BC=X_BC.translation(),
            accuracy=stereo_accuracy(camera.disparity_scale()),
            period=_look_period(scenario.perception),
            tracking=False,
        )
    )
    told = controller if controller.HasOutputPort("robot_state_estimated") else None
    state = (
        plant.get_state_output_port()
        if told is None
        else told.GetOutputPort("robot_state_estimated")
    )
    builder.Connect(state, pose.GetInputPort("robot_state_estimated"))
    if told is not None:
        builder.Connect(
            told.GetOutputPort("estimator_deviation"), eyes.GetInputPort("estimator_deviation")
        )
    felt = controller.HasOutputPort("contact_state_felt")
    contacts = (
        controller.GetOutputPort("contact_state_felt")
        if felt
        else monitor.GetOutputPort("contact_state_measured")
    )
    builder.Connect(contacts, estimator.GetInputPort("contacts"))
    for source, output, sink, port in (
        (pose, "base_pose_estimated", eyes, "base_pose_estimated"),
        (eyes, "depth_measured", estimator, "depth_measured"),
        (pose, "feet_estimated", estimator, "feet"),
    ):
        builder.Connect(source.GetOutputPort(output), sink.GetInputPort(port))
    return estimator


def _look_period(perception: PerceptionConfig) -> float:
    """Time between images that are looked at [s]: the last one at the look's end."""
    return perception.look_time / max(1, round(perception.look_time / LOOK_PERIOD))


def look_around(prepared: PreparedScenario) -> Sight:
    """Simulates the robot as it stands and looks, for the scenario's `perception.look_time`.

    Args:
        prepared: The robot at its start, with a map of the floor that it stands on and no other,
            in the world as it really is.

    Raises:
        MachineError: This machine cannot render.
    """
    found: list[StairEstimator] = []

    def visualize(builder: DiagramBuilder, _: MultibodyPlant, scene_graph: SceneGraph) -> None:
        found.append(AddEyes(builder, scene_graph, prepared))

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
        X_BC = mount_of(perception)
        pose = pose_at_capture(image, X_BC.rotation().matrix(), X_BC.translation())
        level = level_beyond(
            image.depth, model_of(prepared.scenario), pose, belief, landing=perception.landing
        )
    return Sight(
        belief=belief,
        stamp=report.stamp,
        images=round(perception.look_time / _look_period(perception)),
        depth=image.depth,
        level=level,
    )
