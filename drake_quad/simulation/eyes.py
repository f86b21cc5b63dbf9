"""The depth camera on the robot, wired into a Diagram: from images to stairs and a map of them."""

import math

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_quad.errors import InputError
from drake_quad.perception.camera_model import D435, D455, CameraModel, StereoCamera, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import STEREO_NOISE
from drake_quad.perception.sight import MapRevision
from drake_quad.planning.body_reference import robot_stance
from drake_quad.planning.onward import Eyes
from drake_quad.planning.problem import PlanSettings
from drake_quad.robot.model import CameraMount, RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.scenario.build import generator_of
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.perception_config import PerceptionConfig
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.simulation.rendered_world import AddRenderedWorld
from drake_quad.systems.base_pose import BasePose
from drake_quad.systems.depth_camera import AddDepthCamera, DepthCamera
from drake_quad.systems.landmark_finder import LandmarkFinder
from drake_quad.systems.map_keeper import MapKeeper, MapSettings
from drake_quad.systems.stair_estimator import StairEstimator
from drake_quad.terrain.elements import Element

CAMERAS = {"d435": D435, "d455": D455}
PERIOD = 0.1  # [s] between images
ALIKE_PERIOD = 0.5  # [s] between images for which the filter knows how many of them err alike
LOOK_PERIOD = 0.5  # [s] between images that are looked at, at most
MOUNT_ROOM = 0.01  # [m] between the camera and the trunk's shapes, at least
MOUNT_AWAY = 0.15  # [m] at most: on a bracket
AHEAD, BELOW_TOP, USUAL_PITCH = 0.03, 0.05, 30.0  # [m] of the trunk, [deg]
HIP_HIGH = 0.1  # [m] above and below the hips, within which a shape is about as high


def camera_of(scenario: Scenario) -> StereoCamera:
    """The scenario's depth camera."""
    return CAMERAS[scenario.perception.camera]


def level_model_of(scenario: Scenario) -> CameraModel:
    """Intrinsics of the images of the scenario's depth camera, were it held level."""
    return camera_of(scenario).model.decimated(scenario.perception.decimation)


def model_of(scenario: Scenario) -> CameraModel:
    """Intrinsics of the images of the scenario's depth camera, as it is held."""
    model = level_model_of(scenario)
    return model.turned() if scenario.perception.camera_hold == "portrait" else model


def usual_mount(robot: RobotModel) -> CameraMount:
    """Where the camera is on a robot of which nobody says so: on the front of its trunk.

    That is the shape that reaches farthest ahead of those about as high as the hips: an arm on the
    trunk is no place for it.
    """
    shapes = [b for b in robot.trunk_boxes if b[0, 2] <= HIP_HIGH and b[1, 2] >= -HIP_HIGH]
    foremost = max(shapes, key=lambda b: float(b[1, 0]), default=robot.trunk_box)
    front = max(float(foremost[1, 0]), float(robot.geometry.p_BH[:, 0].max()))
    height = max(float(foremost[1, 2]) - BELOW_TOP, 0.0)
    return CameraMount(round(front + AHEAD, 3), 0.0, round(height, 3), USUAL_PITCH)


def camera_mount(perception: PerceptionConfig, robot: RobotModel) -> CameraMount:
    """Where the camera is mounted: as the scenario says, else the robot, else as usual."""
    own = robot.camera or usual_mount(robot)
    said = (
        perception.camera_x, perception.camera_y, perception.camera_z, perception.camera_pitch_deg,
    )  # fmt: skip
    usual = (own.x, own.y, own.z, own.pitch_deg)
    return CameraMount(*(b if a is None else a for a, b in zip(said, usual, strict=True)))


def mount_of(perception: PerceptionConfig, robot: RobotModel) -> RigidTransform:
    """Where the camera is meant to be mounted on the robot's trunk: X_BC."""
    mount = camera_mount(perception, robot)
    R_BC = level_rotation(pitch=math.radians(mount.pitch_deg))
    return RigidTransform(RotationMatrix(R_BC), [mount.x, mount.y, mount.z])


def check_mount(perception: PerceptionConfig, robot: RobotModel, *, source: str) -> None:
    """Sees that the camera is on the trunk, and not inside it, from where it would see the trunk.

    Args:
        perception: Where the camera is.
        robot: The robot, for its trunk's shapes.
        source: Name of the file, for the error.

    Raises:
        InputError: It is inside, or nearer than MOUNT_ROOM; or farther away than MOUNT_AWAY.
    """
    mount, usual = camera_mount(perception, robot), usual_mount(robot)
    told = (perception.camera_x, perception.camera_y, perception.camera_z)
    own = robot.camera is not None and told == (None, None, None)
    place = np.array([mount.x, mount.y, mount.z])

    def refuse(remedy: str) -> InputError:
        if own:
            return InputError(source=robot.source, field="camera.x", value=mount.x, remedy=remedy)
        return InputError(source=source, field="perception.camera_x", value=mount.x, remedy=remedy)

    for low, high in robot.trunk_boxes:
        if np.all(place > low - MOUNT_ROOM) and np.all(place < high + MOUNT_ROOM):
            ahead, above = (float(high[k]) + MOUNT_ROOM for k in (0, 2))
            raise refuse(
                f"the camera would be inside the trunk: put it at {ahead:.3f} m or farther "
                f"ahead, or {above:.3f} m or more above the hips"
            )
    shapes = [*robot.trunk_boxes, *(np.stack([hip, hip]) for hip in robot.geometry.p_BH)]
    away = min(float(np.linalg.norm(place - np.clip(place, *shape))) for shape in shapes)
    if away > MOUNT_AWAY:
        raise refuse(
            f"the camera would be {away:.2f} m from the trunk, and {MOUNT_AWAY:g} m is the most: "
            f"put it nearer; on the trunk's front it is at {usual.x:g}, {usual.y:g}, {usual.z:g} m"
        )


def AddEyes(
    builder: DiagramBuilder,
    prepared: PreparedScenario,
    *,
    landing: float | None = None,
) -> StairEstimator:
    """Adds the depth camera on the trunk, and the estimator that looks at its images.

    They take the state that the controller takes, the true one or what it estimates, and the
    contacts that it takes, those of sensors in the feet or what it feels by the joints.

    Args:
        builder: Builder that holds plant, controller and contact monitor by these names.
        prepared: The robot and its scenario.
        landing: What StairEstimator takes.

    Raises:
        MachineError: This machine cannot render.
    """
    scenario = prepared.scenario
    camera, X_BC = camera_of(scenario), mount_of(scenario.perception, prepared.robot)
    eyes, pose = _AddCamera(builder, prepared, period=PERIOD)
    estimator: StairEstimator = builder.AddSystem(
        StairEstimator(
            model=model_of(scenario),
            R_BC=X_BC.rotation().matrix(),
            p_BC=X_BC.translation(),
            accuracy=stereo_accuracy(camera.disparity_scale()),
            period=look_period(scenario.perception),
            tracking=False,
            landing=landing,
        )
    )
    builder.Connect(_contacts(builder), estimator.GetInputPort("contacts"))
    for source, output, port in (
        (eyes, "depth_measured", "depth_measured"), (pose, "feet_estimated", "feet")
    ):  # fmt: skip
        builder.Connect(source.GetOutputPort(output), estimator.GetInputPort(port))
    return estimator


def _AddCamera(
    builder: DiagramBuilder,
    prepared: PreparedScenario,
    *,
    period: float,
) -> tuple[DepthCamera, BasePose]:
    """Adds the depth camera on the trunk, which is told the pose that the controller has.

    Args:
        builder: Builder that holds plant and controller by these names.
        prepared: The robot and its scenario.
        period: Time between images [s].

    Raises:
        MachineError: This machine cannot render.
    """
    scenario, robot = prepared.scenario, prepared.robot
    plant = builder.GetSubsystemByName("plant")
    controller = builder.GetSubsystemByName("controller")
    camera, X_BC = camera_of(scenario), mount_of(scenario.perception, robot)
    seen = AddRenderedWorld(
        builder, plant, robot=robot, world=prepared.world, disturbances=prepared.disturbances
    )
    eyes = AddDepthCamera(
        builder,
        seen.scene_graph,
        parent=seen.trunk,
        X_PC=X_BC,
        camera=camera,
        model=level_model_of(scenario),
        noise=STEREO_NOISE,
        generator=generator_of(scenario, "depth_camera"),
        portrait=scenario.perception.camera_hold == "portrait",
        period=period,
    )
    pose = _AddPose(builder, prepared)
    if controller.HasOutputPort("estimator_deviation"):
        builder.Connect(
            controller.GetOutputPort("estimator_deviation"),
            eyes.GetInputPort("estimator_deviation"),
        )
    builder.Connect(
        pose.GetOutputPort("base_pose_estimated"), eyes.GetInputPort("base_pose_estimated")
    )
    return eyes, pose


def _AddPose(builder: DiagramBuilder, prepared: PreparedScenario) -> BasePose:
    """Adds what tells base and feet, of the state that the controller has.

    Args:
        builder: Builder that holds plant and controller by these names.
        prepared: The robot and its scenario.
    """
    plant = builder.GetSubsystemByName("plant")
    controller = builder.GetSubsystemByName("controller")
    pose: BasePose = builder.AddSystem(
        BasePose(robot=prepared.robot, layout=make_layout(plant, prepared.robot))
    )
    state = plant.get_state_output_port()
    if controller.HasOutputPort("robot_state_estimated"):
        state = controller.GetOutputPort("robot_state_estimated")
    builder.Connect(state, pose.GetInputPort("robot_state_estimated"))
    return pose


def AddLandmarks(builder: DiagramBuilder, prepared: PreparedScenario) -> LandmarkFinder:
    """Adds the depth camera, and the finder through which flights of the map correct the estimate.

    Args:
        builder: Builder that holds plant and controller by these names.
        prepared: The robot and its scenario, whose map is told.

    Raises:
        MachineError: This machine cannot render.
    """
    scenario = prepared.scenario
    camera, X_BC = camera_of(scenario), mount_of(scenario.perception, prepared.robot)
    period = scenario.perception.image_period
    eyes, _ = _AddCamera(builder, prepared, period=period)
    finder: LandmarkFinder = builder.AddSystem(
        LandmarkFinder(
            model=model_of(scenario),
            R_BC=X_BC.rotation().matrix(),
            p_BC=X_BC.translation(),
            accuracy=stereo_accuracy(camera.disparity_scale()),
            course=prepared.course,
            period=min(PERIOD, period),
            alike=max(1.0, ALIKE_PERIOD / period),
        )
    )
    builder.Connect(eyes.GetOutputPort("depth_measured"), finder.GetInputPort("depth_measured"))
    controller = builder.GetSubsystemByName("controller")
    builder.Connect(
        finder.GetOutputPort("landmark_sighted"), controller.GetInputPort("landmark_sighted")
    )
    return finder


def look_period(perception: PerceptionConfig) -> float:
    """Time between images that are looked at [s]: the last one at the look's end."""
    return perception.look_time / max(1, round(perception.look_time / LOOK_PERIOD))


def AddGrowingMap(builder: DiagramBuilder, prepared: PreparedScenario) -> MapKeeper:
    """Adds the MapKeeper of a map that was seen, and the eyes if the robot looks again on its way.

    Args:
        builder: Builder that holds plant, controller and contact monitor by these names.
        prepared: The robot and its scenario, with the map of its first look.

    Raises:
        MachineError: This machine cannot render.
    """
    perception, sight = prepared.scenario.perception, prepared.sight
    assert sight is not None and sight.map is not None
    controller = builder.GetSubsystemByName("controller")
    looks = not sight.map.complete
    if looks:
        estimator = AddEyes(builder, prepared, landing=perception.landing)
        pose = builder.GetSubsystemByName("base_pose")
    else:
        pose = _AddPose(builder, prepared)
    first = MapRevision(0, sight.stamp, sight.belief, sight.level, sight.map, depth=sight.depth)
    settings = MapSettings(
        landing=perception.landing,
        reach=reach_of(prepared.settings),
        foot_radius=prepared.robot.foot_radius,
        back=way_back(prepared.scenario),
    )
    keeper: MapKeeper = builder.AddSystem(MapKeeper(first=first, settings=settings))
    wires = [
        (keeper, "map_known", controller, "map_known"),
        (controller, "gait_phase", keeper, "gait_phase"),
        (controller, "motion_plan", keeper, "motion_plan"),
        (pose, "feet_estimated", keeper, "feet"),
    ]
    if looks:
        camera = builder.GetSubsystemByName("depth_camera")
        wires += [
            (keeper, "looking", camera, "looking"),
            (keeper, "map_known", estimator, "map_known"),
            (estimator, "stairs", keeper, "stairs"),
            (camera, "depth_measured", keeper, "depth_measured"),
        ]
    if controller.HasOutputPort("estimator_deviation"):
        wires.append((controller, "estimator_deviation", keeper, "estimator_deviation"))
    for system, output, sink, port in wires:
        builder.Connect(system.GetOutputPort(output), sink.GetInputPort(port))
    builder.Connect(_contacts(builder), keeper.GetInputPort("contacts"))
    return keeper


def _contacts(builder: DiagramBuilder) -> OutputPort:
    """The contacts that the controller takes: of sensors in the feet, or felt by the joints."""
    controller = builder.GetSubsystemByName("controller")
    if controller.HasOutputPort("contact_state_felt"):
        return controller.GetOutputPort("contact_state_felt")
    monitor = builder.GetSubsystemByName("contact_monitor")
    return monitor.GetOutputPort("contact_state_measured")


def eyes_of(scenario: Scenario, robot: RobotModel) -> Eyes:
    """The scenario's camera on the robot, as the planner knows it."""
    X_BC = mount_of(scenario.perception, robot)
    return Eyes(
        model_of(scenario), X_BC.rotation().matrix(), X_BC.translation(),
        scenario.perception.look_time,
    )  # fmt: skip


def reach_of(settings: PlanSettings) -> float:
    """How far from the middle line feet are put down [m]."""
    return float(np.abs(robot_stance(settings)[:, 1]).max())


def way_back(scenario: Scenario) -> tuple[Element, ...]:
    """What the course ends with if the robot is to come back: all that it is told of the course."""
    return tuple(element for element in scenario.course if element.kind == "return")
