"""Robots that people know, from the packages that are installed: each loads, unchanged in mass."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from import_rig import compare, normal_by_name
from pydrake.geometry import QueryObject, Role
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.robot.importer.meshes import have_trimesh
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.importer.sources import PACKAGES, root_of
from drake_quad.robot.kinematics import calc_feet, solve_legs
from drake_quad.robot.loader import AddRobot, load_robot
from drake_quad.scenario.load import load_scenario

# The first of each kind are quick; the rest take a second each, mostly for their meshes.
QUICK = {
    "a1",
    "anymal_c",
    "b1",
    "go1",
    "hyq",
    "laikago",
    "littledog",
    "paper_quadruped",
    "pegasus",
    "spot",
}
INSTALLED = [
    pytest.param(f"{p.name}:{name}", marks=[] if name in QUICK else [pytest.mark.slow])
    for p in PACKAGES
    if root_of(p) is not None
    for name in p.robots
]


pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize("model", INSTALLED)
def test_known_robot_keeps_its_dynamics(model: str) -> None:
    """Mass, centre of mass and mass matrix are those that Drake reads from its own file."""
    own, made = compare(model, None, np.random.default_rng(7))
    assert made.mass == pytest.approx(own.mass, rel=1e-12)
    np.testing.assert_allclose(made.com, own.com, atol=1e-10)
    np.testing.assert_allclose(made.matrix, own.matrix, atol=1e-9)


@pytest.mark.parametrize("model", INSTALLED)
def test_known_robot_can_stand(model: str) -> None:
    """With its feet below its hips it is within its limits at some height, and touches nothing."""
    urdf, _ = normal_by_name(model)
    robot = load_robot(str(urdf))
    g = robot.geometry
    for share in np.linspace(0.6, 0.95, 8):
        below = g.p_HP - np.stack([0 * g.reach, 0 * g.reach, share * g.reach], axis=-1)
        q, excess = solve_legs(g, g.p_BH + below)
        within = (q.reshape(12) >= robot.q_lower) & (q.reshape(12) <= robot.q_upper)
        if excess.max() == 0.0 and within.all():
            break
    else:
        pytest.fail("no height at which it can stand")
    np.testing.assert_allclose(calc_feet(g, q), g.p_BH + below, atol=1e-9)
    plant, query, _kept = placed(urdf, robot.name, q)
    touching = {
        frozenset(query.inspector().GetFrameId(g) for g in (p.id_A, p.id_B))
        for p in query.ComputePointPairPenetration()
    }
    frames = [plant.GetBodyFrameIdOrThrow(i) for i in _bodies(plant, robot.name)]
    trunk, thighs = frames[0], frames[2::3]
    assert not [pair for pair in touching if trunk in pair and pair & set(thighs)]


@pytest.mark.parametrize("model", INSTALLED)
def test_contacts_of_thighs_with_the_trunk_are_seen_or_said_to_be_left_out(model: str) -> None:
    """Their pairs are filtered for just the legs that the mapping's note names."""
    urdf, mapping = normal_by_name(model)
    robot = load_robot(str(urdf))
    plant, query, _kept = placed(urdf, robot.name, np.zeros((4, 3)))
    inspector = query.inspector()
    frames = [plant.GetBodyFrameIdOrThrow(i) for i in _bodies(plant, robot.name)]
    shapes = [inspector.GetGeometries(f, Role.kProximity) for f in frames]
    said = " ".join(n["text"] for n in mapping["notes"] if "not seen" in n["text"])
    for row, leg in enumerate(("FL", "FR", "RL", "RR")):
        hip, thigh = shapes[1 + 3 * row], shapes[2 + 3 * row]
        pairs = [(a, b) for a in shapes[0] for b in thigh]
        assert {inspector.CollisionFiltered(a, b) for a, b in pairs} <= {leg in said}
        # Hips may turn the trunk's way or the leg's; hip and thigh never touch, by their filter.
        assert all(inspector.CollisionFiltered(a, b) for a in hip for b in thigh)


@pytest.mark.skipif(root_of(PACKAGES[2]) is None, reason="underactuated is not installed")
@pytest.mark.skipif(not have_trimesh(), reason="trimesh is not installed")
def test_littledog_looks_like_itself() -> None:
    """Its pictures are there as files that Drake shows, none of them too big for a report."""
    robot = load_robot("littledog")
    folder = Path(robot.url).parent
    meshes = sorted((folder / "meshes").glob("*.obj"))
    assert len(meshes) >= 9
    assert max(mesh.stat().st_size for mesh in meshes) < 1_000_000
    text = Path(robot.url).read_text()
    assert all(f"meshes/{mesh.name}" in text for mesh in meshes)
    mapping = yaml.safe_load((folder / MAPPING).read_text())
    assert not [n for n in mapping["notes"] if n["kind"] == "dropped"]


def placed(urdf: Path, name: str, q: FloatArray) -> tuple[MultibodyPlant, QueryObject, object]:
    """A robot's plant, its shapes at joint angles (4, 3) [rad], and what these live in."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    instance = AddRobot(plant, str(urdf))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    robot = load_robot(str(urdf))
    of_plant = plant.GetMyMutableContextFromRoot(context)
    for joint, angle in zip(robot.joint_names, q.reshape(12), strict=True):
        plant.GetJointByName(joint, instance).set_angle(of_plant, float(angle))
    port = scene_graph.get_query_output_port()
    return plant, port.Eval(scene_graph.GetMyContextFromRoot(context)), (diagram, context)


def _bodies(plant: MultibodyPlant, name: str) -> list[object]:
    return list(plant.GetBodyIndices(plant.GetModelInstanceByName(name)))


@pytest.mark.parametrize("name", ["paper_quadruped", "paper", "drake_quad:paper_quadruped"])
def test_the_shipped_robot_has_a_name(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is the file that scenarios use unless told, taken as it is from wherever one works."""
    monkeypatch.chdir("/")
    named = load_robot(name)
    shipped = load_robot(load_scenario("case_study").robot.model)
    assert named.name == shipped.name and Path(named.url).parent.name == "models"
    np.testing.assert_array_equal(named.link_com, shipped.link_com)
    np.testing.assert_array_equal(named.effort, shipped.effort)


def test_scenario_takes_a_robots_name() -> None:
    """A name is left to the loader, wherever the scenario's file is."""
    assert load_scenario("flat_walk", ["robot.model=anymal_c"]).robot.model == "anymal_c"
