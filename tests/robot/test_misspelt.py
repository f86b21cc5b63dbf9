"""Names in a robot's file that are nearly the format's are refused, and no others."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from command import drake_quad, refused
from import_rig import write
from rig import URL
from robot_formats import mjcf, sdf, urdf
from test_import_impossible import changed, file_of

from drake_quad.errors import InputError
from drake_quad.robot.importer.sources import PACKAGES, find_robot, root_of
from drake_quad.robot.importer.spelling import check_spelling
from drake_quad.robot.importer.xml_io import read_xml
from drake_quad.robot.loader import load_robot

S, M, U = sdf(), mjcf(), urdf()
JOINT = '<joint name="FL_hip_joint"'


pytestmark = pytest.mark.usefixtures("own_cache")


# Sample, what in it becomes what, and the line that refuses it, after the file's name. Drake's
# parser takes most of them without a word.
WRONG = {
    "MJCF range of a class": (
        M, "<joint range=", "<joint rnage=",
        "hip: joint.rnage = '-40 30': <joint> has no such attribute; did you mean range?",
    ),
    "MJCF shape": (
        M, 'type="sphere"', 'tpye="sphere"',
        "FL_shank: geom.tpye = 'sphere': <geom> has no such attribute; did you mean type?",
    ),
    "MJCF mass": (
        M, 'mass="9.0"', 'mas="9.0"',
        "body: inertial.mas = '9.0': <inertial> has no such attribute; did you mean mass?",
    ),
    "MJCF motor": (
        M, '<motor class="hip" joint="FL_hip_joint"', '<motor gaer="2" joint="FL_hip_joint"',
        "FL_hip_joint: motor.gaer = '2': <motor> has no such attribute; did you mean gear?",
    ),
    "MJCF body": (
        M, '</body></worldbody>', '<boddy name="load"><geom size="1"/></boddy></body></worldbody>',
        "body: <boddy> = 'load': <body> holds no such element; did you mean <body>?",
    ),
    "MJCF inertial": (
        M, "<inertial", "<inertail",
        "body: <inertail> = 'pos=0.02 0 0 mass=9.0 diaginertia=0.004 0.005 0.003': "
        "<body> holds no such element; did you mean <inertial>?",
    ),
    "MJCF section": (
        M, "<worldbody>", '<complier angle="radian"/><worldbody>',
        "<complier> = 'angle=radian': <mujoco> holds no such element; did you mean <compiler>?",
    ),
    "MJCF capitals": (
        M, JOINT, f'{JOINT} Range="-1 1"',
        "FL_hip_joint: joint.Range = '-1 1': <joint> has no such attribute; did you mean range?",
    ),
    "MJCF two letters": (
        M, JOINT, f'{JOINT} actuator_frc_range="-1 1"',
        "FL_hip_joint: joint.actuator_frc_range = '-1 1': <joint> has no such attribute; did you "
        "mean actuatorfrcrange?",
    ),
    "URDF effort": (
        U, "effort=", "efort=",
        "FL_hip_joint: limit.efort = '50': <limit> has no such attribute; did you mean effort?",
    ),
    "URDF axis": (
        U, "<axis xyz=", "<axis xzy=",
        "FL_hip_joint: axis.xzy = '1 0 0': <axis> has no such attribute; did you mean xyz?",
    ),
    "URDF limits": (
        U, "<limit ", "<limits ",
        "FL_hip_joint: <limits> = 'lower=-0.6981317007977318 upper=0.5235987755982988 effort=50 "
        "velocity=9': <joint> holds no such element; did you mean <limit>?",
    ),
    "URDF joint": (
        U, JOINT, JOINT.replace("<joint", "<jiont") + "/>" + JOINT,
        "r: <jiont> = 'FL_hip_joint': <robot> holds no such element; did you mean <joint>?",
    ),
    "URDF one of two products": (
        U, 'ixz="0"', 'izx="0"',
        "body: inertia.izx = '0': <inertia> has no such attribute; did you mean ixz?",
    ),
    "URDF rotor": (
        U, "</robot>", '<transmission><joint name="FL_hip_joint"/><actuator name="a">'
        '<drake:rotor_inertai value="1e-4"/></actuator></transmission></robot>',
        "a: <drake:rotor_inertai> = 'value=1e-4': <actuator> holds no such element; did you mean "
        "<drake:rotor_inertia>?",
    ),
    "SDF limit": (
        S, "<lower>-0.6981317007977318</lower>", "<lowr>-0.6981317007977318</lowr>",
        "FL_hip_joint: <lowr> = '-0.6981317007977318': <limit> holds no such element; did you mean "
        "<lower>?",
    ),
    "SDF pose's frame": (
        S, "relative_to=", "relativeto=",
        "FL_hip: pose.relativeto = 'body': <pose> has no such attribute; did you mean relative_to?",
    ),
    "SDF gear": (
        S, "<limit>", "<drake:gear_ration>6</drake:gear_ration><limit>",
        "FL_hip_joint: <drake:gear_ration> = '6': <axis> holds no such element; did you mean "
        "<drake:gear_ratio>?",
    ),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_misspelt_name_is_refused(wrong: str, tmp_path: Path) -> None:
    """The line names file, element, name and value, and the name that was meant."""
    sample, old, new, line = WRONG[wrong]
    path = file_of(tmp_path, changed(sample, old, new))
    with pytest.raises(InputError) as caught:
        load_robot(path)
    assert str(caught.value) == f"{path}: {line}"


def test_command_ends_with_the_line_alone(tmp_path: Path) -> None:
    """Status 2, and no traceback."""
    write(tmp_path, changed(U, "effort=", "efort="))
    line = refused(drake_quad("inspect", "robot.urdf", cwd=tmp_path))
    assert line.endswith(WRONG["URDF effort"][3])


@pytest.mark.parametrize(("old", "new"), [('rpy="1.5708', 'ryp="1.5708'), ("damping=", "daming=")])
def test_file_in_normal_form_is_read_by_the_same_rule(old: str, new: str, tmp_path: Path) -> None:
    """Such a file is used as it is, and Drake reads the misspelt one as well."""
    text = find_robot(URL).path.read_text()
    assert load_robot(write(tmp_path, text)).url == str(tmp_path / "robot.urdf")
    with pytest.raises(InputError, match=r"did you mean (rpy|damping)"):
        load_robot(write(tmp_path, changed(text, old, new)))


def test_included_file_is_named(tmp_path: Path) -> None:
    """Wherever it is included; its elements are those of the element that includes it."""
    legs = M[M.index("<inertial") : M.index("</body></worldbody>")]
    write(tmp_path, f"<mujocoinclude>{legs}</mujocoinclude>".replace(" pos=", " ps="), "legs.xml")
    path = write(tmp_path, M.replace(legs, '<include file="legs.xml"/>'), "r.xml")
    with pytest.raises(InputError) as caught:
        load_robot(path)
    assert caught.value.source == str(tmp_path / "legs.xml")
    assert caught.value.field == "inertial.ps"
    write(tmp_path, S.replace("<mass>", "<mas>").replace("</mass>", "</mas>"), "load.sdf")
    inner = "<include><uri>load.sdf</uri><name>load</name></include></model>"
    with pytest.raises(InputError) as caught:
        load_robot(write(tmp_path, S.replace("</model>", inner), "r.sdf"))
    assert (caught.value.source, caught.value.field) == (str(tmp_path / "load.sdf"), "body: <mas>")


OTHERS = {  # what people have in their files, and no format's description
    "robot": (
        '<robot name="r" xmlns__colon__xacro="x"><ros_control/><sensors/><link name="l" '
        'drake_ignore="1"><origin/><surface/><collision_shape/></link><joint name="j" '
        'gearbox="1"><parent link="l" offset="1"/><axis2/><axis xyz="1 0 0"/><limit lower="0" '
        'lower2="1" soft_lower="1" max_effort="1" gear_velocity="1"/><dynamics D="1" K="1" '
        'mu_viscous="1"/></joint><transmission><joint><saturationLower/></joint></transmission>'
        '<gazebo><linkk nmae="x"/></gazebo></robot>'
    ),
    "sdf": (
        '<sdf version="1.9"><model name="m" vendor="x"><plugin><lnik/></plugin><vendor/><link '
        'name="l"><sensor><psoe/></sensor><inertial><mass>1</mass><mass_factor>2</mass_factor>'
        '</inertial></link><joint name="j"><axis><limit><lower>1</lower><lower_soft>1</lower_soft>'
        "</limit></axis></joint></model></sdf>"
    ),
    "mujoco": (
        '<mujoco><vendor/><worldbody><body name="b" dclass="c"><joint name="j" range="0 1" '
        'range2="0 1" kd="1"/></body></worldbody><sensor><jiont/></sensor></mujoco>'
    ),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_other_names_are_let_pass(kind: str) -> None:
    """Names like no other, those that stand beside the one they are like, and all in extensions."""
    check_spelling(ET.fromstring(OTHERS[kind]), "r")


def test_endless_name_takes_no_time() -> None:
    """A name of a million letters is like no other, and is not compared letter by letter."""
    check_spelling(ET.Element("robot", {"name" * 250_000: "1"}), "r")


def test_element_that_repeats_is_no_excuse() -> None:
    """A second body may be misspelt; a second inertial that is none is somebody's own."""
    twice = "<mujoco><worldbody><body><inertial/><{}/></body><body/></worldbody></mujoco>"
    check_spelling(ET.fromstring(twice.format("inertial2")), "r")
    with pytest.raises(InputError, match="did you mean <body>"):
        check_spelling(ET.fromstring(twice.format("bod")), "r")


@pytest.mark.parametrize(
    "model", [f"{p.name}:{name}" for p in PACKAGES if root_of(p) for name in p.robots]
)
def test_no_robot_that_has_a_name_is_refused(model: str) -> None:
    """Every file of the packages that are installed is let pass."""
    path = find_robot(model).path
    check_spelling(read_xml(path, model), model)
