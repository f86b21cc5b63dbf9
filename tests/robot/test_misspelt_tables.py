"""The tables of names, and each of their names with a letter wrong."""

import re
from itertools import chain
from xml.etree import ElementTree as ET

import pytest
from hypothesis import assume, given, strategies as st

from drake_quad.errors import InputError
from drake_quad.robot.importer.format_names import Names
from drake_quad.robot.importer.spelling import SHORTEST, TABLES, check_spelling
from drake_quad.robot.importer.xml_io import COLON

FORMATS = {"robot": "URDF", "sdf": "SDF", "mujoco": "MJCF"}


def look(kind: str, key: str, element: ET.Element) -> None:
    """Looks at an element alone, where one of the table's key is in a file of that kind."""
    if key == kind:
        return check_spelling(element, "r")
    tag = key.rpartition("/")[2]
    inside = next(k for k, n in TABLES[kind].items() if tag in n.once | n.many and k != key)
    inside = key.rpartition("/")[0] or inside
    root = ET.Element(kind)
    root.append(element)
    return check_spelling(root, "r", inside=inside)


def element_of(key: str, attributes: frozenset[str], children: frozenset[str]) -> ET.Element:
    """An element as it was read from a file, with these attributes and elements in it."""
    attrib = {name.replace(":", COLON): "1" for name in attributes}
    element = ET.Element(key.rpartition("/")[2].replace(":", COLON), attrib)
    for child in sorted(children):
        ET.SubElement(element, child.replace(":", COLON))
    return element


def entries() -> list[tuple[str, str, Names]]:
    return [(kind, key, found) for kind in FORMATS for key, found in TABLES[kind].items()]


@pytest.mark.parametrize(("kind", "key", "known"), entries())
def test_no_name_of_the_tables_is_refused(kind: str, key: str, known: Names) -> None:
    """Neither all of an element's names together, nor each alone, where nearly the same is not."""
    nothing: frozenset[str] = frozenset()
    children = known.once | known.many | known.idle
    look(kind, key, element_of(key, known.attributes | known.idle, children))
    for name in known.attributes | children:
        look(kind, key, element_of(key, frozenset({name}) - known.once - known.many, nothing))
        look(kind, key, element_of(key, nothing, frozenset({name}) - known.attributes))


# Format, key of the table, and names in it that a robot is made of: attributes, and elements.
IMPORTANT = {
    ("mujoco", "mujoco"): ("", "compiler default asset worldbody actuator keyframe include"),
    ("mujoco", "compiler"): ("angle autolimits eulerseq meshdir inertiafromgeom", ""),
    ("mujoco", "default"): ("class", "default joint geom motor position"),
    ("mujoco", "body"): ("name pos quat euler childclass", "body joint freejoint geom inertial"),
    ("mujoco", "joint"): ("name class type axis range limited actuatorfrcrange armature pos", ""),
    ("mujoco", "geom"): ("type size fromto mesh mass density pos quat class contype", ""),
    ("mujoco", "inertial"): ("mass pos quat diaginertia fullinertia", ""),
    ("mujoco", "mesh"): ("name file scale", ""),
    ("mujoco", "actuator"): ("", "motor position velocity general"),
    ("mujoco", "motor"): ("joint gear ctrlrange forcerange class", ""),
    ("mujoco", "key"): ("qpos", ""),
    ("robot", "robot"): ("name", "link joint transmission"),
    ("robot", "link"): ("name", "inertial visual collision"),
    ("robot", "inertial"): ("", "origin mass inertia"),
    ("robot", "mass"): ("value", ""),
    ("robot", "inertia"): ("ixx ixy ixz iyy iyz izz", ""),
    ("robot", "origin"): ("xyz rpy", ""),
    ("robot", "collision"): ("", "origin geometry"),
    ("robot", "geometry"): ("", "box cylinder sphere capsule mesh"),
    ("robot", "box"): ("size", ""),
    ("robot", "cylinder"): ("radius length", ""),
    ("robot", "mesh"): ("filename scale", ""),
    ("robot", "joint"): ("name type", "origin parent child axis limit dynamics"),
    ("robot", "parent"): ("link", ""),
    ("robot", "child"): ("link", ""),
    ("robot", "axis"): ("xyz", ""),
    ("robot", "limit"): ("lower upper effort velocity", ""),
    ("robot", "dynamics"): ("damping", ""),
    ("robot", "transmission"): ("", "joint actuator"),
    ("robot", "actuator"): ("name", "drake:gear_ratio drake:rotor_inertia"),
    ("sdf", "sdf"): ("version", "model world"),
    ("sdf", "model"): ("name", "link joint model frame include pose"),
    ("sdf", "include"): ("", "uri name pose"),
    ("sdf", "pose"): ("relative_to", ""),
    ("sdf", "link"): ("name", "pose inertial visual collision"),
    ("sdf", "inertial"): ("", "pose mass inertia"),
    ("sdf", "inertia"): ("", "ixx ixy ixz iyy iyz izz"),
    ("sdf", "collision"): ("", "pose geometry"),
    ("sdf", "geometry"): ("", "box cylinder sphere capsule ellipsoid mesh"),
    ("sdf", "cylinder"): ("", "radius length"),
    ("sdf", "mesh"): ("", "uri scale"),
    ("sdf", "joint"): ("name type", "parent child axis pose"),
    ("sdf", "axis"): ("", "xyz limit dynamics drake:gear_ratio drake:rotor_inertia"),
    ("sdf", "limit"): ("", "lower upper effort velocity"),
}


def misspellings(name: str) -> list[str]:
    """The name with a letter missing, twice, another, or swapped with the next."""
    ends = [(name[:k], name[k:]) for k in range(len(name))]
    ways = (
        [a + b[1:], a + b[:1] + b, a + "q" + b[1:], a + b[1:2] + b[:1] + b[2:]] for a, b in ends
    )
    return sorted({way for way in chain(*ways)} - {name})


def complain(kind: str, key: str, name: str, *, attribute: bool) -> str:
    """What is said of an element with a misspelt name alone; nothing for nothing."""
    one, nothing = frozenset({name}), frozenset[str]()
    element = element_of(key, one, nothing) if attribute else element_of(key, nothing, one)
    try:
        look(kind, key, element)
    except InputError as error:
        assert name in error.field
        return error.remedy
    return ""


@pytest.mark.parametrize(
    ("kind", "key", "name", "attribute"),
    [
        pytest.param(kind, key, name, attribute, id=f"{FORMATS[kind]} {key} {name}")
        for (kind, key), pair in IMPORTANT.items()
        for attribute, words in zip((True, False), pair, strict=True)
        for name in words.split()
    ],
)
def test_a_wrong_letter_is_refused(kind: str, key: str, name: str, attribute: bool) -> None:
    """At any place of a name that matters: none is missing, twice, another, or at the wrong end."""
    known = TABLES[kind][key]
    all_known = known.attributes if attribute else known.once | known.many
    for wrong in misspellings(name):
        if wrong not in all_known | known.idle:
            remedy = complain(kind, key, wrong, attribute=attribute)
            assert re.search(rf"\b{name}\b", remedy), (wrong, remedy)


@given(data=st.data())
def test_any_letter_may_be_wrong(data: st.DataObject) -> None:
    """Of any name of the tables; one that is nearer to a name that is idle is nobody's fault."""
    kind, key, known = data.draw(st.sampled_from(entries()))
    attribute = data.draw(st.booleans())
    choices = known.attributes if attribute else known.once | known.many
    names = sorted(name for name in choices if len(name) >= SHORTEST)
    assume(names)
    name = data.draw(st.sampled_from(names))
    place = data.draw(st.integers(0, len(name)))
    letters = data.draw(st.text("abcdefghijklmnopqrstuvwxyz_2", max_size=1))
    wrong = name[:place] + letters + name[place + data.draw(st.integers(0, 1)) :]
    assume(wrong and wrong not in choices | known.idle)
    assert re.search(rf"\b{name}\b", complain(kind, key, wrong, attribute=attribute)), wrong


def test_all_of_mujocos_names_are_known() -> None:
    """The table of MJCF has all that the installed MuJoCo takes in the elements it looks at."""
    mujoco = pytest.importorskip("mujoco")
    text, table = mujoco.mj_printSchema(False, False), TABLES["mujoco"]
    path: list[str] = []
    seen = set()
    for line in re.sub(r"\n {30}", " ", text).splitlines():
        found = re.match(r"((?:   )*)(\S+) \(.\) *(.*)", line)
        assert found, line
        tag = "worldbody" if found[2] == "(world)body" else found[2]
        path[len(found[1]) // 3 :] = [tag]
        holder = path[-2] if len(path) > 1 else ""
        if any(above not in table for above in path[:-1]):
            continue  # nobody looks there
        if holder:
            assert tag in table[holder].many | table[holder].once, path
        if tag in table:
            assert set(found[3].split()) <= table[tag].attributes, path
            seen.add(tag)
    assert {"joint", "geom", "worldbody", "inertial", "mesh", "motor", "compiler"} <= seen
