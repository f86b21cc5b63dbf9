"""Robots that people know, from the packages that are installed: each loads, unchanged in mass."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from import_rig import compare, write_normal
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.plant import MultibodyPlant

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


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRAKE_QUAD_CACHE", str(tmp_path / "cache"))


@pytest.mark.parametrize("model", INSTALLED)
def test_known_robot_keeps_its_dynamics(model: str, tmp_path: Path) -> None:
    """Mass, centre of mass and mass matrix are those that Drake reads from its own file."""
    own, made = compare(model, tmp_path, np.random.default_rng(7))
    assert made.mass == pytest.approx(own.mass, rel=1e-12)
    np.testing.assert_allclose(made.com, own.com, atol=1e-10)
    np.testing.assert_allclose(made.matrix, own.matrix, atol=1e-9)


@pytest.mark.parametrize("model", INSTALLED)
def test_known_robot_can_stand(model: str, tmp_path: Path) -> None:
    """With its feet below its hips it is within its limits at some height, and touches nothing."""
    urdf, _ = write_normal(model, tmp_path)
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
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, str(urdf))
    plant.Finalize()
    # Hips may turn the trunk's way or the leg's; the two of one leg never touch, by their filter.
    inspector = scene_graph.model_inspector()
    frames = [plant.GetBodyFrameIdOrThrow(i) for i in _bodies(plant, robot.name)]
    shapes = [inspector.GetGeometries(f, Role.kProximity) for f in frames]
    trunk, hip, thigh = shapes[0], shapes[1], shapes[2]
    pairs = [(a, b) for one, other in ((trunk, thigh), (hip, thigh)) for a in one for b in other]
    assert all(inspector.CollisionFiltered(a, b) for a, b in pairs)


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
