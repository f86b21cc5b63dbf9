"""Numbers of a URDF are whole: what Drake's parser would read half of is refused."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from rig import URL

from drake_quad.errors import InputError
from drake_quad.robot.importer.urdf_numbers import check_urdf
from drake_quad.robot.importer.xml_io import COLON
from drake_quad.robot.loader import load_robot
from drake_quad.util.files import read_given_text

MODEL = Path(__file__).parents[2] / "models" / URL.rpartition("/")[2]
SPOILT = {
    "a decimal comma": ('lower="-2.75"', 'lower="-2,75"', "FL_knee: limit.lower", "no commas"),
    "a unit": ('mass value="38.0"', 'mass value="38 kg"', "trunk: mass.value", "no units"),
    "another base": ('mass value="38.0"', 'mass value="0x26"', "mass.value = '0x26'", "one number"),
    "four of three": ('xyz="0 0 -0.52"', 'xyz="0 0 -0,52"', "origin.xyz", "three numbers"),
    "a negative speed": ('velocity="', 'velocity="-', "limit.velocity", "must not be negative"),
    "no radius": ('sphere radius="0.02"', 'sphere radius="0"', "sphere.radius", "more than 0"),
    "a thin foot": ('sphere radius="0.02"', 'sphere radius="0.0005"', "its foot", "from 0.001 m"),
    "a thick foot": ('sphere radius="0.02"', 'sphere radius="5"', "its foot", "half of the shank"),
    "a macro": ('mass value="38.0"', 'mass value="${m}"', "mass", "xacro robot.xacro"),
    "a gear that turns back": (
        '<drake:gear_ratio value="', '<drake:gear_ratio value="-', "gear_ratio", "more than 0"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SPOILT)
def test_what_would_be_read_half_is_refused(case: str, tmp_path: Path) -> None:
    """In one line that names link or joint, attribute and text, and what would be right."""
    before, after, field, remedy = SPOILT[case]
    text = read_given_text(MODEL, most=1 << 20)
    assert before in text
    path = tmp_path / "spoilt.urdf"
    path.write_text(text.replace(before, after), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_robot(path)
    line = str(refused.value)
    assert line.startswith(f"{path}: ") and field in line and remedy in line and "\n" not in line


def test_what_physics_does_not_read_may_be_anything() -> None:
    """Visual shapes, extensions of Gazebo, a fixed joint's axis and empty texts are passed over."""
    root = ET.fromstring(
        '<robot><link name="a"><visual><geometry><box size="0 0 0"/></geometry></visual>'
        '<collision><origin xyz="0, 0, 1" rpy=""/></collision></link>'
        '<gazebo reference="${prefix}a"><mass value="a lot"/></gazebo>'
        '<joint name="j" type="fixed"><axis xyz="0"/><dynamics damping="-1"/></joint></robot>'
    )
    check_urdf(root, "file")


def test_an_element_of_xacro_is_told_as_one() -> None:
    """By its prefix, with the command that expands it."""
    root = ET.Element("robot")
    ET.SubElement(root, f"xacro{COLON}property", name="m", value="3")
    with pytest.raises(InputError, match=r"xacro:property = 'm': is xacro; expand it first"):
        check_urdf(root, "file")
