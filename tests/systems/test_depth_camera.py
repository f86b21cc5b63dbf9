"""The depth camera alone: rate, latency, errors; and what Drake renders against exact rays."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.geometry import Box, GeometryInstance, PerceptionProperties, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.errors import MachineError
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_noise import IDEAL_DEPTH, STEREO_NOISE, StereoNoise
from drake_quad.systems import depth_camera
from drake_quad.systems.depth_camera import AddDepthCamera, AddRenderer, DepthCamera

MODEL = D435.model.decimated(4)
POSE = np.array([1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3])


def alone(noise: StereoNoise, *, seed: int = 1) -> tuple[DepthCamera, Simulator]:
    camera = DepthCamera(
        camera=D435, model=MODEL, noise=noise, generator=np.random.default_rng(seed),
        period=0.1, latency=0.04,
    )  # fmt: skip
    simulator = Simulator(camera)
    image = ImageDepth32F(MODEL.width, MODEL.height)
    image.mutable_data[:] = 1.5
    context = simulator.get_mutable_context()
    camera.GetInputPort("depth_image").FixValue(context, AbstractValue.Make(image))
    camera.GetInputPort("base_pose_estimated").FixValue(context, POSE)
    return camera, simulator


def test_an_image_arrives_after_the_latency_with_its_own_stamp_and_pose() -> None:
    """Nothing before 40 ms; then the image of time 0, until that of 100 ms comes at 140 ms."""
    camera, simulator = alone(IDEAL_DEPTH)
    port, context = camera.GetOutputPort("depth_measured"), simulator.get_context()
    stamps = []
    for t in (0.03, 0.05, 0.13, 0.15):
        simulator.AdvanceTo(t)
        stamps.append(port.Eval(context).stamp)
    assert stamps == [-np.inf, 0.0, 0.0, pytest.approx(0.1)]
    assert np.array_equal(port.Eval(context).base_pose, POSE)
    assert np.allclose(port.Eval(context).depth, 1.5)


def test_an_image_keeps_how_well_the_pose_was_known_when_it_was_taken() -> None:
    """Turn and place of the nine deviations, those of the image's time; zeros if none are told."""
    camera, simulator = alone(IDEAL_DEPTH)
    port, context = camera.GetOutputPort("depth_measured"), simulator.get_mutable_context()
    simulator.AdvanceTo(0.05)
    assert np.array_equal(port.Eval(context).base_deviation, np.zeros(6))
    deviation = camera.GetInputPort("estimator_deviation")
    deviation.FixValue(context, np.arange(9.0))
    simulator.AdvanceTo(0.12)
    deviation.FixValue(context, np.zeros(9))
    simulator.AdvanceTo(0.15)
    assert port.Eval(context).stamp == pytest.approx(0.1)
    assert port.Eval(context).base_deviation.tolist() == [0.0, 1.0, 2.0, 6.0, 7.0, 8.0]


def test_no_image_is_taken_while_none_is_wanted() -> None:
    """Where the port says so; the next one comes at the next time that is a whole period."""
    camera, simulator = alone(IDEAL_DEPTH)
    port, context = camera.GetOutputPort("depth_measured"), simulator.get_mutable_context()
    wanted = camera.GetInputPort("looking")
    wanted.FixValue(context, np.zeros(1))
    simulator.AdvanceTo(0.35)
    assert port.Eval(context).stamp == -np.inf
    wanted.FixValue(context, np.ones(1))
    simulator.AdvanceTo(0.45)
    assert port.Eval(context).stamp == pytest.approx(0.4)


def test_noise_is_of_the_size_told_and_the_same_for_the_same_seed() -> None:
    """At 1.5 m 0.08 px are some 8 mm; two cameras of one seed agree to the bit."""
    images = []
    for _ in range(2):
        camera, simulator = alone(STEREO_NOISE)
        simulator.AdvanceTo(0.05)
        images.append(camera.GetOutputPort("depth_measured").Eval(simulator.get_context()).depth)
    assert np.array_equal(images[0], images[1])
    seen = images[0][images[0] > 0.0]
    assert 0.95 < seen.size / images[0].size < 0.99
    assert 0.005 < seen.std() < 0.016


def test_a_camera_held_upright_loses_what_lies_below_near_things_and_not_beside_them() -> None:
    """Its imagers stand one over the other: the shadow of a near square is under it alone."""
    upright = MODEL.turned()
    noise = dataclasses.replace(IDEAL_DEPTH, shadow=True)
    camera = DepthCamera(
        camera=D435, model=MODEL, noise=noise, generator=np.random.default_rng(1), portrait=True,
        period=0.1, latency=0.0,
    )  # fmt: skip
    image = ImageDepth32F(upright.width, upright.height)
    image.mutable_data[:] = 3.0
    image.mutable_data[60:120, 30:80] = 0.6
    simulator = Simulator(camera)
    context = simulator.get_mutable_context()
    camera.GetInputPort("depth_image").FixValue(context, AbstractValue.Make(image))
    camera.GetInputPort("base_pose_estimated").FixValue(context, POSE)
    simulator.AdvanceTo(0.01)
    depth = camera.GetOutputPort("depth_measured").Eval(context).depth
    assert depth.shape == (upright.height, upright.width)
    rows, columns = np.nonzero(depth == 0.0)
    assert len(rows) and set(columns) == set(range(30, 80))
    assert rows.min() == 120 and rows.max() < 130
    seen = depth > 0.0
    assert np.allclose(depth[seen], np.asarray(image.data[:, :, 0])[seen])


def test_a_latency_of_a_whole_period_is_refused() -> None:
    """An image would be taken over before it is handed on."""
    with pytest.raises(ValueError, match="latency"):
        DepthCamera(
            camera=D435, model=MODEL, noise=IDEAL_DEPTH, generator=np.random.default_rng(0),
            period=0.1, latency=0.1,
        )  # fmt: skip


def test_drake_renders_what_exact_rays_meet() -> None:
    """Stairs through RgbdSensor and VTK are those of the ray caster to 0.1 mm, but for edges."""
    places, heights = 0.8 + 0.3 * np.arange(4), 0.16 * np.arange(5)
    boxes = build_boxes(places, heights)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), boxes)
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    try:
        AddRenderer(graph)
    except MachineError as reason:
        pytest.skip(str(reason))
    source = graph.RegisterSource("world")
    for i, box in enumerate(boxes):
        shape = Box(*(box[3:] - box[:3]))
        instance = GeometryInstance(RigidTransform(0.5 * (box[3:] + box[:3])), shape, f"box{i}")
        instance.set_perception_properties(PerceptionProperties())
        graph.RegisterAnchoredGeometry(source, instance)
    R_LC = level_rotation(pitch=np.radians(35.0))
    camera = AddDepthCamera(
        builder, graph, parent=graph.world_frame_id(),
        X_PC=RigidTransform(RotationMatrix(R_LC), [0.0, 0.0, 0.95]), camera=D435, model=MODEL,
        noise=IDEAL_DEPTH, generator=np.random.default_rng(0), latency=0.0,
    )  # fmt: skip
    builder.ExportInput(camera.GetInputPort("base_pose_estimated"), "pose")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    diagram.GetInputPort("pose").FixValue(simulator.get_mutable_context(), POSE)
    simulator.AdvanceTo(0.01)
    context = camera.GetMyContextFromRoot(simulator.get_context())
    drawn = camera.GetOutputPort("depth_measured").Eval(context).depth
    exact = render(scene, MODEL, R_LC, 0.95)
    seen = (drawn > 0.0) & (exact < D435.farthest)
    error = np.abs(drawn - exact)[seen]
    assert seen.mean() > 0.9
    assert np.quantile(error, 0.99) < 1e-4 and np.mean(error < 1e-4) > 0.99


def test_a_machine_without_egl_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """What Drake raises becomes an error that names the packages to install."""

    def fail(_params: object) -> None:
        raise RuntimeError("no EGL display")

    monkeypatch.setattr(depth_camera, "MakeRenderEngineVtk", fail)
    with pytest.raises(MachineError, match="libegl1") as caught:
        AddRenderer(SceneGraph())
    assert "\n" not in str(caught.value)
