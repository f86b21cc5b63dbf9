"""Values that no robot has, one of them in a file that is good but for it: one clear line each."""

from pathlib import Path

import pytest
from import_rig import write
from robot_formats import mjcf, sdf, urdf

from drake_quad.errors import InputError
from drake_quad.robot.loader import load_robot

S, M, U = sdf(), mjcf(), urdf()
GEOM = '<body name="body" pos="0 0 1">'  # after which one may be added
JOINT, MOTOR = '<joint name="FL_hip_joint"', '<motor class="hip" joint="FL_hip_joint"'
EFFORT = "<effort>50<"
GEAR = "<drake:gear_ratio>{}</drake:gear_ratio><limit>"
ROTOR = "<drake:rotor_inertia>{}</drake:rotor_inertia><limit>"
RADIUS = "<radius>0.02</radius>"


pytestmark = pytest.mark.usefixtures("own_cache")


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


def file_of(folder: Path, text: str) -> str:
    """Writes a robot under the name of its format."""
    return write(folder, text, {"<r": "r.urdf", "<s": "r.sdf", "<m": "r.xml"}[text[:2]])


WRONG = {  # sample, what in it becomes what, and words of the line that refuses it
    "SDF mass 0": (S, "<mass>9.0<", "<mass>0<", "body: mass = '0'"),
    "SDF mass below 0": (S, "<mass>9.0<", "<mass>-9<", "body: mass = '-9'"),
    "SDF mass inf": (S, "<mass>9.0<", "<mass>inf<", "body: mass = 'inf': must be a number"),
    "SDF mass empty": (S, "<mass>9.0<", "<mass><", "body: mass = '': must be a number above"),
    "SDF mass in words": (S, "<mass>9.0<", "<mass>heavy<", "body: mass = 'heavy': must be"),
    "SDF without a mass": (S, "<mass>9.0</mass>", "", "body: mass = None"),
    "SDF without ixx": (S, "<ixx>0.004</ixx>", "", "body: inertia"),
    "SDF ixx inf": (S, "<ixx>0.004", "<ixx>inf", "body: ixx = 'inf'"),
    "SDF mass by itself": (S, "<inertial>", '<inertial auto="true">', "body: inertial.auto"),
    "SDF trunk without inertial": (S, S[S.index("<inertial>") : S.index("</link>")], "", "no mass"),
    "SDF foot of 0": (S, RADIUS, "<radius>0</radius>", "FL_shank: collision sphere.radius"),
    "SDF foot below 0": (S, RADIUS, "<radius>-0.02</radius>", "= '-0.02': must be a number above"),
    "SDF foot without size": (S, RADIUS, "", "FL_shank: collision sphere.radius = None"),
    "SDF foot as big as a leg": (S, RADIUS, "<radius>0.2</radius>", "FL_shank: radius of its foot"),
    "SDF foot too small": (S, RADIUS, "<radius>0.0001</radius>", "from 0.001 m to half"),
    "SDF box below 0": (
        S,
        "<sphere><radius>0.02</radius></sphere>",
        "<box><size>-1 1 1</size></box>",
        "collision box.size = '-1 1 1': must be 3 numbers above zero",
    ),
    "SDF gear 0": (S, "<limit>", GEAR.format("0"), "FL_hip_joint: gear_ratio = '0'"),
    "SDF gear below 0": (S, "<limit>", GEAR.format("-6"), "must be a number from 0.0001"),
    "SDF gear beyond all": (S, "<limit>", GEAR.format("1e308"), "none beyond"),
    "SDF rotor below 0": (S, "<limit>", ROTOR.format("-1"), "FL_hip_joint: rotor_inertia = '-1'"),
    "SDF effort with a bar": (S, EFFORT, "<effort>5_0<", "FL_hip_joint: effort = '5_0'"),
    "SDF pose of 5": (S, "0.02 0 0 0 0 0", "0.02 0 0 0 0", "must have 6 values, but 5"),
    "SDF pose in words": (S, "0.02 0 0 0 0 0", "a b c d e f", "a b c d e f"),
    "SDF pose beyond all": (S, "0.02 0 0 0 0 0", "1e300 0 0 0 0 0", "none beyond"),
    "SDF of no version": (S, ' version="1.9"', "", "sdf.version = ''"),
    "SDF of a new version": (S, 'version="1.9"', 'version="new"', "sdf.version = 'new'"),
    "MJCF foot of 0": (M, 'size="0.02"', 'size="0"', "FL_shank: sphere.size = '0'"),
    "MJCF foot in words": (M, 'size="0.02"', 'size="big"', "FL_shank: sphere.size = 'big'"),
    "MJCF foot without size": (M, ' size="0.02"', "", "FL_shank: sphere.size = None"),
    "MJCF mass 0": (M, 'mass="9.0"', 'mass="0"', "body: mass = '0'"),
    "MJCF no body's inertia": (M, '"0.004 0.005', '"0.004 -0.005', "body: inertial.diaginertia"),
    "MJCF two inertials": (M, GEOM, f"{GEOM}<inertial mass='1'/>", "body: inertial = 2"),
    "MJCF angle": (M, "<worldbody>", '<compiler angle="degrees"/><worldbody>', "compiler.angle"),
    "MJCF armature below 0": (M, JOINT, f'{JOINT} armature="-1"', "FL_hip_joint: armature = '-1'"),
    "MJCF armature in words": (M, JOINT, f'{JOINT} armature="much"', "armature = 'much'"),
    "MJCF torque in words": (M, JOINT, f'{JOINT} actuatorfrcrange="a b"', "actuatorfrcrange"),
    "MJCF gear nan": (M, MOTOR, f'{MOTOR} gear="nan"', "FL_hip_joint: motor.gear = 'nan': must be"),
    "MJCF range with a bar": (M, JOINT, f'{JOINT} range="-4_0 30"', "-4_0 30"),
    "MJCF range in Arabic": (M, JOINT, f'{JOINT} range="-٤٠ 30"', "-٤٠ 30"),
    "MJCF joint of no class": (M, 'class="hip"/>', 'class="hop"/>', "FL_hip_joint: class = 'hop'"),
    "MJCF body of no class": (M, GEOM, f'{GEOM[:-1]} childclass="x">', "body: childclass = 'x'"),
    "MJCF motor of no joint": (M, 'joint="FL_hip_joint"', 'joint="x"', "motor.joint = 'x'"),
    "MJCF geom of no mesh": (M, GEOM, f'{GEOM}<geom type="mesh" mesh="x"/>', "geom.mesh = 'x'"),
    "MJCF frame": (M, GEOM, f'{GEOM}<frame pos="0 0 1"/>', "<frame>"),
    "MJCF replicate": (M, GEOM, f'{GEOM}<replicate count="2"/>', "<replicate>"),
    "MJCF attach": (M, GEOM, f'{GEOM}<attach prefix="x"/>', "<attach>"),
    "MJCF total mass": (
        M,
        "<worldbody>",
        '<compiler settotalmass="50"/><worldbody>',
        "compiler.settotalmass = '50'",
    ),
    "MJCF pose nan": (
        M,
        "<worldbody>",
        f'<keyframe><key qpos="nan{" 0" * 18}"/></keyframe><worldbody>',
        "r.xml: key.qpos",
    ),
    "URDF mass below 0": (U, 'mass value="9.0"', 'mass value="-9.0"', "body: mass.value = '-9.0'"),
    "URDF mass 0 with inertia": (U, 'mass value="9.0"', 'mass value="0"', "body: mass = 0.0"),
    "MJCF called world": (M, 'name="FL_hip"', 'name="world"', "link.name = 'world'"),
    "MJCF name of models": (M, 'name="FL_hip"', 'name="FL::hip"', "link.name = 'FL::hip'"),
    "URDF foot of 0": (U, 'radius="0.02"', 'radius="0"', "FL_shank: sphere.radius = '0'"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_impossible_value_is_refused(
    wrong: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The line names file, field and value, and is the only one."""
    sample, old, new, words = WRONG[wrong]
    with pytest.raises(InputError) as caught:
        load_robot(file_of(tmp_path, changed(sample, old, new)))
    line = str(caught.value)
    assert line.startswith(str(tmp_path / "r.")) and words in line, line
    assert "bazel" not in line and "drake_quad_" not in line and "\n" not in line
    assert capfd.readouterr().err == ""
