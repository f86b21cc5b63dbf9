"""A depth camera: Drake renders what it sees, and this adds its errors and its delay."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State
from pydrake.systems.sensors import CameraInfo, ImageDepth32F, RgbdSensor

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import MachineError
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.camera_model import CameraModel, StereoCamera
from drake_quad.perception.depth_noise import (
    CameraErrors,
    StereoNoise,
    add_noise,
    draw_camera_errors,
)

RENDERER = "depth_camera"
NEAREST_RENDERED = 0.02  # [m]
POSE_TOLD = read_only(np.zeros(6))  # deviations of a pose without error


@dataclass(frozen=True)
class DepthImage:
    """An image as it comes out of the camera's driver; arrays cannot be written to.

    Attributes:
        stamp: Time at which it was taken [s].
        depth: Distances along the optical axis [m], (height, width); 0 where there is none.
        base_pose: The robot's base in W as it was estimated then: quaternion (w, x, y, z) and
            place [m], (7,).
        base_deviation: Standard deviations of that pose: of the base's turn about W's axes [rad],
            then of its place [m], (6,); zeros of a pose that is told.
    """

    stamp: float
    depth: FloatArray
    base_pose: FloatArray
    base_deviation: FloatArray = field(default_factory=lambda: POSE_TOLD)

    def __deepcopy__(self, _: dict[int, object]) -> "DepthImage":
        """Itself: Drake copies all abstract states at each event, and this cannot change."""
        return self


NO_IMAGE = DepthImage(-np.inf, read_only(np.zeros((1, 1))), read_only(np.eye(7)[0]))


class DepthCamera(LeafSystem):
    """Takes images at a fixed rate, with a stereo camera's errors, and hands them on later.

    Input ports:
        depth_image: ImageDepth32F, the truth, from an RgbdSensor.
        base_pose_estimated: (7,) quaternion (w, x, y, z) and place of the base in W [m], as the
            state estimator has it; it is kept with the image that is taken at the time.
        estimator_deviation: (9,) standard deviations of that state, as StateEstimator tells them:
            of the orientation [rad], the velocity [m/s] and the place [m]. Unconnected if the pose
            is told without error.
    Output ports:
        depth_measured: DepthImage, the newest that has arrived; one of stamp -inf before the first.

    Args:
        camera: The camera.
        model: Its intrinsics as it is held level.
        noise: Its errors.
        generator: The source of what is random.
        portrait: Whether it is held upright, its left imager, whose images these are, below the
            other, which sees over edges what the left one sees: images in and out are then those
            of `model.turned()`.
        period: Time between images [s].
        latency: Time from an image to its arrival [s], less than the period.

    Raises:
        ValueError: The latency is not from 0 to the period.
    """

    def __init__(
        self,
        *,
        camera: StereoCamera,
        model: CameraModel,
        noise: StereoNoise,
        generator: np.random.Generator,
        portrait: bool = False,
        period: float = 0.1,
        latency: float = 0.05,
    ) -> None:
        super().__init__()
        if not 0.0 <= latency < period:
            raise ValueError(f"latency = {latency!r}: must be from 0 to below the period, {period}")
        self.set_name("depth_camera")
        self._camera, self._model, self._noise, self._period = camera, model, noise, period
        self._portrait = portrait
        self._errors = draw_camera_errors(noise, camera, model, generator)
        # Images have generators of their own, so that two contexts do not share one.
        self._seed = int(generator.integers(2**63))
        self._image = self.DeclareAbstractInputPort(
            "depth_image", AbstractValue.Make(ImageDepth32F())
        )
        self._pose = self.DeclareVectorInputPort("base_pose_estimated", 7)
        self._deviation = self.DeclareVectorInputPort("estimator_deviation", 9)
        self._looking = self.DeclareVectorInputPort("looking", 1)
        self._taken = self.DeclareAbstractState(AbstractValue.Make(NO_IMAGE))
        self._arrived = self.DeclareAbstractState(AbstractValue.Make(NO_IMAGE))
        self.DeclareStateOutputPort("depth_measured", self._arrived)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._take)
        if latency > 0.0:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, latency, self._hand_on)
        self._at_once = latency == 0.0

    @property
    def errors(self) -> CameraErrors:
        """What is wrong with this camera: for whoever mounts it, monitors and tests alone."""
        return self._errors

    def _take(self, context: Context, state: State) -> None:
        if self._looking.HasValue(context) and self._looking.Eval(context)[0] < 0.5:
            return
        shown: ImageDepth32F = self._image.Eval(context)
        number = round(context.get_time() / self._period)
        true = np.asarray(shown.data[:, :, 0], dtype=float)
        depth = add_noise(
            np.rot90(true, -1) if self._portrait else true,
            noise=self._noise,
            errors=self._errors,
            camera=self._camera,
            model=self._model,
            generator=np.random.default_rng([self._seed, number]),
        )
        if self._portrait:
            depth = np.ascontiguousarray(np.rot90(depth))
        told = POSE_TOLD
        if self._deviation.HasValue(context):
            deviation = self._deviation.Eval(context)
            told = read_only(np.concatenate([deviation[:3], deviation[6:]]))
        taken = DepthImage(
            context.get_time(), read_only(depth), read_only(self._pose.Eval(context)), told
        )
        state.get_mutable_abstract_state(self._taken).set_value(taken)
        if self._at_once:
            state.get_mutable_abstract_state(self._arrived).set_value(taken)

    def _hand_on(self, context: Context, state: State) -> None:
        taken = context.get_abstract_state(self._taken).get_value()
        state.get_mutable_abstract_state(self._arrived).set_value(taken)


def AddRenderer(scene_graph: SceneGraph) -> None:
    """Adds the renderer that depth cameras use, if it is not there yet.

    Raises:
        MachineError: This machine cannot render.
    """
    if scene_graph.HasRenderer(RENDERER):
        return
    try:
        engine = MakeRenderEngineVtk(RenderEngineVtkParams())
    except RuntimeError as problem:
        raise MachineError(
            source="depth camera",
            field="renderer",
            value="VTK",
            remedy=f"needs EGL: install libegl1 and libgl1-mesa-dri ({problem})",
        ) from None
    scene_graph.AddRenderer(RENDERER, engine)


def AddDepthCamera(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    *,
    parent: FrameId,
    X_PC: RigidTransform,
    camera: StereoCamera,
    model: CameraModel,
    noise: StereoNoise,
    generator: np.random.Generator,
    portrait: bool = False,
    period: float = 0.1,
    latency: float = 0.05,
) -> DepthCamera:
    """Adds a renderer, an RgbdSensor and a DepthCamera behind it.

    Args:
        builder: Receives them.
        scene_graph: What is seen; it belongs to the builder.
        parent: The frame that the camera is mounted on.
        X_PC: Where the camera is meant to be mounted, C as in `camera_model`; the drawn tilt is
            added.
        camera: The camera.
        model: Its intrinsics as it is held level.
        noise: Its errors.
        generator: The source of what is random.
        portrait: Whether it is held upright, see DepthCamera.
        period: Time between images [s].
        latency: Time from an image to its arrival [s].

    Returns:
        The camera, whose ports `base_pose_estimated` and `estimator_deviation` are left to connect.

    Raises:
        MachineError: This machine cannot render.
    """
    AddRenderer(scene_graph)
    shown = model.turned() if portrait else model
    cx, cy = shown.drake_principal_point
    info = CameraInfo(shown.width, shown.height, shown.fx, shown.fy, cx, cy)
    far = camera.farthest + 4.0
    core = RenderCameraCore(RENDERER, info, ClippingRange(NEAREST_RENDERED, far), RigidTransform())
    depth_camera = builder.AddSystem(
        DepthCamera(
            camera=camera, model=model, noise=noise, generator=generator, portrait=portrait,
            period=period, latency=latency,
        )
    )  # fmt: skip
    tilt = RotationMatrix(rotation_exp(*depth_camera.errors.tilt))
    sensor = builder.AddSystem(
        RgbdSensor(
            parent,
            RigidTransform(X_PC.rotation() @ tilt, X_PC.translation()),
            DepthRenderCamera(core, DepthRange(2.0 * NEAREST_RENDERED, camera.farthest)),
        )
    )
    sensor.set_name("depth_camera_truth")
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    builder.Connect(sensor.depth_image_32F_output_port(), depth_camera.GetInputPort("depth_image"))
    return depth_camera
