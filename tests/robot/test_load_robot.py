"""What is read from a robot's file, whatever its names and order, and what is refused."""

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from rig import URL, paper_robot

from drake_quad.errors import InputError
from drake_quad.robot.kinematics import calc_com
from drake_quad.robot.loader import AddRobot, MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel

MODEL = Path(__file__).resolve().parents[2] / "models" / "paper_quadruped.urdf"
TEXT = MODEL.read_text()


pytestmark = pytest.mark.usefixtures("own_cache")


def load_text(text: str, directory: Path, name: str = "robot.urdf") -> RobotModel:
    path = directory / name
    path.write_text(text)
    return load_robot(str(path))


def swapped(text: str, pairs: dict[str, str]) -> str:
    """`text` with every key replaced by its value, all at once."""
    pattern = re.compile("|".join(re.escape(key) for key in pairs))
    return pattern.sub(lambda found: pairs[found.group()], text)


def without_leg(text: str, leg: str) -> str:
    """The file without anything of one leg."""
    for tag in ("link", "joint", "transmission"):
        text = re.sub(rf'  <{tag} name="{leg}_.*?</{tag}>\n', "", text, flags=re.DOTALL)
    assert f'"{leg}_' not in text
    return text


def parts_of(text: str) -> tuple[str, list[str], str]:
    """The file as its head, its links, joints and transmissions, and its end."""
    body, end = text.index("  <link"), text.index("</robot>")
    parts = re.split(r"(?<=^  </link>\n)|(?<=^  </joint>\n)|(?<=^  </transmission>\n)",
                     text[body:end], flags=re.MULTILINE)  # fmt: skip
    return text[:body], [part for part in parts if part], text[end:]


NESTED = ("geometry", "thigh_stops", "shank_profile")


def same_robot(a: RobotModel, b: RobotModel, *, but: tuple[str, ...] = ()) -> None:
    """All fields of both are equal, but for those named."""
    for field in dataclasses.fields(RobotModel):
        if field.name in but:
            continue
        x, y = getattr(a, field.name), getattr(b, field.name)
        if field.name in NESTED:
            for inner in dataclasses.fields(x):
                np.testing.assert_array_equal(getattr(x, inner.name), getattr(y, inner.name))
        elif isinstance(x, np.ndarray):
            np.testing.assert_array_equal(x, y)
        elif isinstance(x, float):  # a sum, by whichever order
            assert x == pytest.approx(y, rel=1e-12), field.name
        else:
            assert x == y, field.name


def test_package_url_and_path_give_the_same_robot() -> None:
    """The shipped robot is the same however it is named."""
    same_robot(load_robot(URL), load_robot(str(MODEL)), but=("url", "source"))


def test_which_leg_is_which_follows_from_the_hips_and_not_from_names(tmp_path: Path) -> None:
    """With all names of the legs exchanged the geometry stays, only the names go round."""
    names = dict(zip(("FL_", "FR_", "RL_", "RR_"), ("RR_", "RL_", "FR_", "FL_"), strict=True))
    other = load_text(swapped(TEXT, names), tmp_path)
    robot = paper_robot()
    same_robot(other, robot, but=("url", "source", "joint_names", "foot_geometry"))
    assert other.joint_names == tuple(swapped(name, names) for name in robot.joint_names)
    assert other.foot_geometry == tuple(swapped(name, names) for name in robot.foot_geometry)


def test_order_of_the_file_does_not_matter(tmp_path: Path) -> None:
    """The same elements in reverse order are the same robot."""
    head, parts, end = parts_of(TEXT)
    assert len(parts) == 13 + 12 + 12
    other = load_text(head + "".join(reversed(parts)) + end, tmp_path)
    same_robot(other, paper_robot(), but=("url", "source"))


def test_knees_forward_are_read_as_such(tmp_path: Path) -> None:
    """A knee whose limits are on the positive side points forward, leg by leg."""
    limits = 'lower="-2.75" upper="-0.15"'
    assert TEXT.count(limits) == 4
    first, _, others = TEXT.partition(limits)
    robot = load_text(first + 'lower="0.15" upper="2.75"' + others, tmp_path)
    assert robot.geometry.knee_sign.tolist() == [1.0, -1.0, -1.0, -1.0]


def test_arrays_cannot_be_written_to() -> None:
    """What planners share, none of them can change."""
    robot = paper_robot()
    arrays = [getattr(robot, f.name) for f in dataclasses.fields(robot)]
    for name in NESTED:
        part = getattr(robot, name)
        arrays += [getattr(part, f.name) for f in dataclasses.fields(part)]
    found = [a for a in arrays if isinstance(a, np.ndarray)]
    assert len(found) == 30
    assert not any(a.flags.writeable for a in found)


def replace_once(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return change


def replace_all(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return change


def fixed_base(text: str) -> str:
    """The trunk bolted to the world."""
    joint = (
        '  <joint name="bolt" type="fixed"><parent link="world"/><child link="trunk"/></joint>\n'
    )
    return text.replace("</robot>", joint + "</robot>")


def two_trunks(text: str) -> str:
    """Another body that floats."""
    return text.replace("</robot>", '  <link name="balloon"/>\n</robot>')


# What is wrong with a file: what makes it so, and a word that the error has to have.
WRONG: dict[str, tuple[Callable[[str], str], str]] = {
    "nothing in it": (lambda _: "", "cannot be read"),
    "not XML": (lambda _: "a robot, honestly\n", "cannot be read"),
    "cut off": (lambda text: text[: len(text) // 2], "cannot be read"),
    "another document": (lambda _: "<html><body/></html>", "cannot be read"),
    "a box": (lambda _: '<robot name="box"><link name="box"/></robot>', "four legs"),
    "three legs": (lambda text: without_leg(text, "RL"), "four legs"),
    "no legs": (
        lambda text: without_leg(
            without_leg(without_leg(without_leg(text, "RL"), "RR"), "FL"), "FR"
        ),
        "four legs",
    ),
    "a knee that is stiff": (
        lambda text: re.sub(
            r'(<joint name="FR_knee" type=)"revolute"', r'\1"fixed"', without_drive(text, "FR_knee")
        ),
        "four legs",
    ),
    "a knee about z": (
        lambda text: re.sub(
            r'(<joint name="RL_knee".*?<axis xyz=)"0 1 0"', r'\1"0 0 1"', text, flags=re.DOTALL
        ),
        "RL_knee",
    ),
}

# What is not in normal form, and becomes so.
DIFFERENT: dict[str, Callable[[str], str]] = {
    "a fixed base": fixed_base,
    "two bodies that float": two_trunks,
    "a joint without actuator": lambda text: without_drive(text, "RR_hip_pitch"),
    "no actuators": lambda text: re.sub(
        r"  <transmission.*?</transmission>\n", "", text, flags=re.DOTALL
    ),
    "both front hips on the left": replace_once(
        '<origin xyz="0.4 -0.18 0"/>', '<origin xyz="0.4 0.01 0"/>'
    ),
    "a hip turned round": lambda text: re.sub(
        r'(<joint name="FL_abduction".*?<axis xyz=)"1 0 0"',
        r'\1"-1 0 0"',
        text,
        flags=re.DOTALL,
    ),
    "no foot": lambda text: re.sub(r'    <collision name="FR_foot">.*?</collision>\n', "", text),
    "a knee beside the thigh": lambda text: re.sub(
        r'(<joint name="RR_knee".*?<origin xyz=)"0 0 ', r'\1"0.05 0 ', text, flags=re.DOTALL
    ),
    "a knee without limits": lambda text: re.sub(
        r'(<joint name="FL_knee" type=)"revolute"(.*?)lower="-2.75" upper="-0.15" ',
        r'\1"continuous"\2',
        text,
        flags=re.DOTALL,
    ),
    "a knee that bends both ways": replace_all(
        'lower="-2.75" upper="-0.15"', 'lower="-2.5" upper="2.5"'
    ),
    "a knee turned in its socket": lambda text: re.sub(
        r'(<joint name="FR_knee".*?<origin)', r'\1 rpy="0 0.3 0"', text, flags=re.DOTALL
    ),
    "a thigh that points up": replace_once(
        'xyz="0 0 -0.52"/>\n    <parent', 'xyz="0 0 0.52"/>\n    <parent'
    ),
    "a joint without strength": replace_once('effort="300.0"', 'effort="0"'),
}


def without_drive(text: str, joint: str) -> str:
    """The file without the transmission of one joint."""
    found = re.sub(
        rf'  <transmission name="{joint}_drive">.*?</transmission>\n', "", text, flags=re.DOTALL
    )
    assert found != text
    return found


@pytest.mark.parametrize("difference", DIFFERENT)
def test_file_that_is_not_in_normal_form_is_imported(
    difference: str, tmp_path: Path, own_cache: Path
) -> None:
    """It is the same robot by its masses and hips, read from a file that was written for it."""
    text = DIFFERENT[difference](TEXT)
    assert text != TEXT
    robot, plain = load_text(text, tmp_path), paper_robot()
    assert Path(robot.url).is_relative_to(own_cache)
    assert robot.mass == pytest.approx(plain.mass, rel=1e-9)
    np.testing.assert_allclose(robot.link_mass, plain.link_mass, rtol=1e-9)
    if "hips" not in difference:
        np.testing.assert_allclose(robot.geometry.p_BH, plain.geometry.p_BH, atol=1e-9)


def test_file_in_normal_form_is_taken_as_it_is(tmp_path: Path, own_cache: Path) -> None:
    """Nothing is written for it, and its URL stays."""
    assert load_robot(URL).url == URL
    assert load_text(TEXT, tmp_path).url == str(tmp_path / "robot.urdf")
    assert not (own_cache / "robots").exists()


PACK = (
    '<link name="pack"><inertial><mass value="20"/>'
    '<inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="mount" type="{}"><parent link="trunk"/><child link="pack"/>'
    '<origin xyz="0.4 0.05 0.1"/><axis xyz="1 0 0"/>'
    '<limit lower="-0.1" upper="0.1" effort="10" velocity="1"/></joint></robot>'
)


@pytest.mark.parametrize("mount", ["fixed", "prismatic", "revolute"])
def test_planning_misses_no_mass_of_a_link_beside_the_legs(mount: str, tmp_path: Path) -> None:
    """However a pack is mounted on a robot in normal form, the planner's centre of mass is Drake's.

    Nothing else of the robot is changed by it.
    """
    robot = load_text(TEXT.replace("</robot>", PACK.format(mount)), tmp_path)
    plain = paper_robot()
    assert robot.mass == pytest.approx(plain.mass + 20.0)
    assert robot.trunk_mass + robot.link_mass.sum() == pytest.approx(robot.mass)
    np.testing.assert_allclose(robot.geometry.p_BH, plain.geometry.p_BH, atol=1e-12)
    plant = MakeModelPlant(robot.url)
    context = plant.CreateDefaultContext()
    trunk = plant.GetBodyByName(robot.trunk)
    plant.SetFloatingBaseBodyPoseInWorldFrame(context, trunk, RigidTransform())
    q = np.tile([0.1, 0.6, -1.2], 4)
    for name, angle in zip(robot.joint_names, q, strict=True):
        plant.GetJointByName(name).set_angle(context, float(angle))
    (com,) = calc_com(robot, q.reshape(1, 4, 3))
    np.testing.assert_allclose(com, plant.CalcCenterOfMassPositionInWorld(context), atol=1e-9)


def test_a_joint_that_mimics_another_is_free(tmp_path: Path) -> None:
    """In a file in normal form as in any other: physics couples no joints that planning moves."""
    mimic = '<mimic joint="FL_knee"/></joint>'
    text = re.sub(
        r'(<joint name="FR_knee".*?)</joint>', rf"\1{mimic}", TEXT, count=1, flags=re.DOTALL
    )
    robot = load_text(text, tmp_path)
    plant = MultibodyPlant(0.001)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    AddRobot(plant, robot.url)
    plant.Finalize()
    assert mimic in text and plant.num_constraints() == 0
    np.testing.assert_allclose(robot.link_mass, paper_robot().link_mass, rtol=1e-9)


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_file_is_refused_in_one_line(wrong: str, tmp_path: Path) -> None:
    """The error names the file and what is wrong with it, and is one line."""
    change, word = WRONG[wrong]
    text = change(TEXT)
    assert text != TEXT
    with pytest.raises(InputError) as caught:
        load_text(text, tmp_path)
    line = str(caught.value)
    assert "\n" not in line and "robot.urdf" in line
    assert word in line, line
    assert caught.value.remedy


@pytest.mark.parametrize(
    "url",
    [
        "nowhere/robot.urdf",
        "package://drake_quad_models/no_such_robot.urdf",
        "package://no_such_package/robot.urdf",
        "http://127.0.0.1/robot.urdf",
        "",
    ],
)
def test_missing_file_is_refused(url: str) -> None:
    """A path or URL that leads nowhere is an input error that names it."""
    with pytest.raises(InputError) as caught:
        load_robot(url)
    assert caught.value.field == "robot.model" and caught.value.value == url


def test_directory_and_unknown_format_are_refused(tmp_path: Path) -> None:
    """A directory, and a file of another kind, are input errors."""
    with pytest.raises(InputError):
        load_robot(str(tmp_path))
    with pytest.raises(InputError):
        load_text("solid robot", tmp_path, "robot.stl")


def test_file_of_two_robots_is_refused(tmp_path: Path) -> None:
    """One file, one robot."""
    model = '<model name="{}"><link name="a"/></model>'
    world = f'<sdf version="1.9">{model.format("one")}{model.format("two")}</sdf>'
    with pytest.raises(InputError):
        load_text(world, tmp_path, "two.sdf")
