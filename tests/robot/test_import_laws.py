"""The normal form is the same robot: its masses, motion and feet; and it is its own import."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from import_rig import compare, write
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from synthetic_robot import Quadruped

from drake_quad.robot.importer.parse import parse
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.importer.robot_source import find_source
from drake_quad.robot.kinematics import calc_com, calc_feet, solve_legs
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel

BEASTS = {
    "straight legs": Quadruped(),
    "axes the other way": Quadruped(signs=(-1, -1, 1)),
    "hip pitch ahead of the hip, knee and foot aside, bent at zero": Quadruped(
        out=(0.06, 0.08, 0.0), aside=(0.1, 0.013), shank=(0.088, -0.31), rear=-1
    ),
    "hip pitch below the hip": Quadruped(out=(0.02, 0.08, -0.06), signs=(-1, 1, 1), roll=0.3),
    "hip pitch above the hip": Quadruped(out=(0.0, 0.05, 0.04), tilt=(0.2, 0.1, 0.0)),
    "a knee ahead of the thigh": Quadruped(thigh=(0.025, -0.32), signs=(1, -1, -1)),
    "link frames turned": Quadruped(tilt=(0.3, -0.5, 0.8), thigh=(0.05, -0.3)),
    "hips below the trunk's frame": Quadruped(hip=(0.3, 0.1, -0.07)),
    "legs splayed at zero": Quadruped(roll=0.5, signs=(-1, 1, 1), tilt=(0.1, 0.0, -0.2)),
    "an arm, and tied to the world": Quadruped(arm=True, base="fixed"),
    "a floating joint": Quadruped(base="floating", foot="cylinder"),
    "no limits": Quadruped(limits=(None, None, None), effort="0", speed="0"),
}


pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize("beast", BEASTS)
def test_mass_and_motion_are_those_of_the_file(beast: str, tmp_path: Path) -> None:
    """Mass, centre of mass and mass matrix agree in random states, to rounding."""
    path = write(tmp_path, BEASTS[beast].text())
    folder = tmp_path / "normal"
    folder.mkdir()
    rng = np.random.default_rng(3)
    for _ in range(3):
        own, made = compare(path, folder, rng)
        assert made.mass == pytest.approx(own.mass, rel=1e-12)
        np.testing.assert_allclose(made.com, own.com, atol=1e-10)
        np.testing.assert_allclose(made.matrix, own.matrix, atol=1e-9)


@pytest.mark.parametrize("beast", BEASTS)
def test_model_and_plant_have_the_feet_at_the_same_places(beast: str, tmp_path: Path) -> None:
    """The legs' kinematics in closed form are those of the normal form in Drake."""
    path = write(tmp_path, BEASTS[beast].text())
    robot, plant = load_robot(path), MakeModelPlant(path)
    context, q = _pose(plant, robot, np.random.default_rng(4))
    B = plant.GetBodyByName(robot.trunk).body_frame()
    for k, p_BF in enumerate(calc_feet(robot.geometry, q)):
        shank = plant.GetJointByName(robot.joint_names[3 * k + 2]).child_body()
        p_SF = [0.0, 0.0, -robot.geometry.shank[k]]
        found = plant.CalcPointsPositions(context, shank.body_frame(), p_SF, B)
        np.testing.assert_allclose(p_BF, found[:, 0], atol=1e-9)
    p_BC = plant.CalcCenterOfMassPositionInWorld(context)
    np.testing.assert_allclose(calc_com(robot, q), p_BC, atol=1e-9)


@pytest.mark.parametrize("beast", BEASTS)
def test_foot_is_where_the_file_has_it(beast: str, tmp_path: Path) -> None:
    """Told in the file's own angles, the foot's link is where the model has the foot."""
    path = write(tmp_path, BEASTS[beast].text())
    robot = load_robot(path)
    mapping = yaml.safe_load((Path(robot.url).parent / MAPPING).read_text())
    q = np.random.default_rng(5).uniform(-0.8, 0.8, (4, 3))
    with parse(find_source(path).found) as parsed:
        plant = parsed.plant
        context = plant.CreateDefaultContext()
        for name, angle in zip(robot.joint_names, q.reshape(12), strict=True):
            told = mapping["joints"][name]
            plant.GetJointByName(name).set_angle(context, told["sign"] * (angle + told["turn"]))
        body = plant.GetBodyByName("body").body_frame()
        p_TB = np.array(mapping["trunk"]["p_TB"])
        for k, leg in enumerate(("FL", "FR", "RL", "RR")):
            X_TF = plant.GetBodyByName(f"{leg}_foot").body_frame().CalcPose(context, body)
            off = X_TF.translation() - p_TB - calc_feet(robot.geometry, q)[k]
            assert np.linalg.norm(off) < (0.03 if BEASTS[beast].foot == "cylinder" else 1e-9)


@pytest.mark.parametrize("beast", BEASTS)
def test_inverse_kinematics_undo_forward_kinematics(beast: str, tmp_path: Path) -> None:
    """Within the limits, angles to feet to angles is the identity."""
    robot = load_robot(write(tmp_path, BEASTS[beast].text()))
    rng = np.random.default_rng(6)
    low, high = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    low, high = np.maximum(low, [-0.6, -0.9, -2.3]), np.minimum(high, [0.6, 0.9, 2.3])
    q = rng.uniform(low, high, (50, 4, 3))
    feet = calc_feet(robot.geometry, q)
    below = np.all(feet[..., 2] < robot.geometry.p_BH[:, 2] - 0.15, axis=1)
    assert below.sum() > 5
    found, excess = solve_legs(robot.geometry, feet[below])
    assert excess.max() == 0.0
    np.testing.assert_allclose(found, q[below], atol=1e-7)


@pytest.mark.parametrize("beast", [b for b in BEASTS if "arm" not in b])
def test_mirrored_legs_make_a_mirrored_model(beast: str, tmp_path: Path) -> None:
    """What the file has mirrored left and right is so in the model: lengths, limits, masses."""
    robot = load_robot(write(tmp_path, BEASTS[beast].text()))
    g = robot.geometry
    left, right = [0, 2], [1, 3]
    np.testing.assert_allclose(g.p_BH[left] * [1, -1, 1], g.p_BH[right], atol=1e-9)
    np.testing.assert_allclose(g.offset[left], -g.offset[right], atol=1e-9)
    for lengths in (g.thigh, g.shank, g.knee_sign):
        np.testing.assert_allclose(lengths[left], lengths[right], atol=1e-9)
    np.testing.assert_allclose(robot.link_mass[left], robot.link_mass[right], atol=1e-12)
    low, high = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    np.testing.assert_allclose(low[left][:, 0], -high[right][:, 0], atol=1e-9)
    np.testing.assert_allclose(low[left][:, 1:], low[right][:, 1:], atol=1e-9)
    np.testing.assert_allclose(high[left][:, 1:], high[right][:, 1:], atol=1e-9)


@pytest.mark.parametrize("beast", BEASTS)
def test_hips_have_their_middle_in_the_origin(beast: str, tmp_path: Path) -> None:
    """B's origin is the centroid of the four hips."""
    robot = load_robot(write(tmp_path, BEASTS[beast].text()))
    np.testing.assert_allclose(robot.geometry.p_BH.mean(axis=0), 0.0, atol=1e-9)


@pytest.mark.parametrize("beast", BEASTS)
def test_normal_form_is_its_own_import(beast: str, tmp_path: Path) -> None:
    """The URDF that was written, given as a robot elsewhere, is taken as it is."""
    robot = load_robot(write(tmp_path, BEASTS[beast].text()))
    again = load_robot(write(tmp_path, Path(robot.url).read_text(), "again.urdf"))
    assert again.url == str(tmp_path / "again.urdf")
    for name in ("q_lower", "q_upper", "effort", "speed", "link_mass", "link_com", "trunk_com"):
        np.testing.assert_array_equal(getattr(again, name), getattr(robot, name))
    for name in ("p_BH", "offset", "thigh", "shank", "knee_sign"):
        np.testing.assert_array_equal(getattr(again.geometry, name), getattr(robot.geometry, name))


def test_robot_lying_along_y_is_turned(tmp_path: Path) -> None:
    """A robot whose legs abduct about y is the same robot, its front along +y of its file."""
    robot = load_robot(write(tmp_path, Quadruped().text()))
    turn = '<link name="base"/><joint name="turn" type="fixed"><parent link="base"/>'
    turn += '<child link="body"/><origin xyz="0 0 0" rpy="0 0 1.5707963267948966"/></joint>'
    turned = load_robot(write(tmp_path, Quadruped(extra=turn).text(), "turned.urdf"))
    np.testing.assert_allclose(turned.geometry.p_BH, robot.geometry.p_BH, atol=1e-9)
    np.testing.assert_allclose(turned.link_com, robot.link_com, atol=1e-9)
    assert turned.joint_names == robot.joint_names
    notes = yaml.safe_load((Path(turned.url).parent / MAPPING).read_text())["notes"]
    assert any("+y" in note["text"] for note in notes)


def _pose(plant: MultibodyPlant, robot: RobotModel, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    context = plant.CreateDefaultContext()
    plant.SetFloatingBaseBodyPoseInWorldFrame(
        context, plant.GetBodyByName(robot.trunk), RigidTransform()
    )
    q = rng.uniform(-1.0, 1.0, (4, 3))
    for name, angle in zip(robot.joint_names, q.reshape(12), strict=True):
        plant.GetJointByName(name).set_angle(context, angle)
    return context, q
