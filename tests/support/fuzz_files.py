"""Robots' files that nobody should give: SDF, MJCF and `.robot.yaml`, spoilt by a seed."""

import re
from functools import cache
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import yaml
from robot_formats import mjcf, sdf

NUMBERS = (
    "0", "-1", "1", "0.5", "1e9", "-1e-9", "1e308", "-1e308", "nan", "inf", "-inf", "1e400", "0x10",
    "1_0", "1,5", "\u0661", "", " ", "x", "1 2", "0 0 0", "1 0 0 0", "1e-30", "5e-324", "9" * 400,
)  # fmt: skip
WORDS = (
    "", "x", "world", "__model__", "body", "FL_hip", "FL_hip_joint", "FL_shank", "a::b", "[/x]",
    "ball", "free", "fixed", "mesh", "plane", "universal", "prismatic", "true", "-1", "../r",
    "\xe4", "gone.obj", "robot.sdf", "robot.xml", "package://gone/x.obj", "a" * 5000,
)  # fmt: skip
NAMES = (
    "name", "type", "class", "childclass", "mass", "pos", "quat", "euler", "size", "range", "axis",
    "file", "mesh", "joint", "fromto", "density", "relative_to", "diaginertia", "fullinertia",
    "ctrlrange", "gear", "armature", "ref", "mocap", "version", "canonical_link", "damping",
)  # fmt: skip
# Elements that either format, or the other, has; put anywhere.
PIECES = (
    "<include file='robot.xml'/>", "<include file='gone.xml'/>", "<freejoint/>", "<joint/>",
    "<joint type='ball' name='b'/>", "<joint type='slide' name='s'/>", "<body/>", "<geom/>",
    "<compiler angle='radian'/>", "<compiler eulerseq='abc'/>", "<geom type='mesh' mesh='gone'/>",
    "<compiler inertiafromgeom='true'/>", "<default><default/></default>", "<inertial/>",
    "<replicate count='3' offset='1 0 0'><body/></replicate>", "<body><body><joint/></body></body>",
    "<compiler coordinate='global'/>", "<frame pos='0 0 1'><body name='f'/></frame>", "<mesh/>",
    "<geom type='sphere' size='1e9'/>", "<worldbody/>", "<keyframe><key qpos='1'/></keyframe>",
    "<include><uri>robot.sdf</uri></include>", "<include><uri>model://gone</uri></include>",
    "<static>true</static>", "<pose relative_to='gone'>0 0 0 0 0 0</pose>", "<pose>1 2</pose>",
    "<frame name='f' attached_to='f'/>", "<link name='l'/>", "<model name='m'/>", "<world/>",
    "<joint name='j' type='revolute'><parent>body</parent><child>FL_shank</child></joint>",
    "<joint name='k' type='fixed'><parent>world</parent><child>body</child></joint>",
    "<collision name='c'><geometry><box><size>0 0 0</size></box></geometry></collision>",
    "<visual name='v'><geometry><mesh><uri>gone.obj</uri></mesh></geometry></visual>",
    "<collision name='d'><geometry/></collision>", "<mimic joint='FL_hip_joint'/>", "<axis/>",
)  # fmt: skip
SAID = """model: robot.urdf
name: rex
legs:
  FL: [FL_haa, FL_hfe, FL_kfe]
  FR: [FR_haa, FR_hfe, FR_kfe]
  RL: [RL_haa, RL_hfe, RL_kfe]
  RR: [RR_haa, RR_hfe, RR_kfe]
forward_deg: 0
knees: {FL: backward, FR: backward, RL: forward, RR: forward}
foot_radius: 0.02
effort: [40, 40, 60]
speed: [12, 12, 15]
abduction: [-0.5, 0.7]
hip: [-1.5, 2.0]
knee: [0.3, 2.5]
"""


@cache
def sample(form: str) -> str:
    """A whole file: `sdf` or `mjcf`."""
    return {"sdf": sdf, "mjcf": mjcf}[form]()


def pick(rng: np.random.Generator, items: Any) -> Any:
    """One of them, each as likely."""
    return items[int(rng.integers(len(items)))]


def spoil_xml(text: str, rng: np.random.Generator) -> str:
    """The file with elements, attributes or numbers changed; it stays XML."""
    root = ET.fromstring(text)
    for _ in range(1 if rng.random() < 0.6 else 3):
        parents = {child: parent for parent in root.iter() for child in parent}
        if not parents:
            break
        element = pick(rng, list(parents))
        parent, what = parents[element], rng.random()
        if what < 0.35:
            _spoil_number(pick(rng, list(root.iter())) if rng.random() < 0.3 else element, rng)
        elif what < 0.5 and element.attrib:
            name = pick(rng, list(element.attrib))
            words = [e.attrib[name] for e in root.iter() if name in e.attrib]
            element.set(name, pick(rng, words if rng.random() < 0.5 else WORDS))
        elif what < 0.55 and element.attrib:
            del element.attrib[pick(rng, list(element.attrib))]
        elif what < 0.62:
            element.set(pick(rng, NAMES), pick(rng, NUMBERS if rng.random() < 0.5 else WORDS))
        elif what < 0.72:
            parent.remove(element)
        elif what < 0.78:
            parent.append(element)
        elif what < 0.84:
            parent.remove(element)
            pick(rng, [e for e in root.iter() if e not in list(element.iter())]).append(element)
        elif what < 0.87:
            element.tag = pick(rng, [e.tag for e in root.iter()])
        elif what < 0.9:
            texts = [e.text for e in root.iter() if e.text] or ["x"]
            element.text = pick(rng, texts if rng.random() < 0.5 else WORDS)
        else:
            element.insert(0, ET.fromstring(pick(rng, PIECES)))
    return ET.tostring(root, encoding="unicode")


def _spoil_number(element: ET.Element, rng: np.random.Generator) -> None:
    """Changes one of the numbers in an element's attributes or text, or scales it."""
    places = [name for name, value in element.attrib.items() if re.search(r"\d", value)]
    own = element.text is not None and re.search(r"\d", element.text)
    if not (places or own):
        return
    name = pick(rng, places) if places else None
    words = (element.attrib[name] if name else element.text or "").split()
    k = int(rng.integers(len(words)))
    try:
        scaled = f"{float(words[k]) * float(rng.choice([-1, 0, 1e-3, 0.3, 3, 1e3])):g}"
    except ValueError:
        scaled = "0"
    words[k] = scaled if rng.random() < 0.5 else pick(rng, NUMBERS)
    if name:
        element.set(name, " ".join(words))
    else:
        element.text = " ".join(words)


def spoil_bytes(text: str, rng: np.random.Generator) -> str:
    """The text with some of its bytes others; what is no UTF-8 then is as surrogates."""
    data = bytearray(text.encode())
    for _ in range(int(rng.integers(1, 5))):
        ascii_alone = rng.random() < 0.6
        value = rng.integers(32, 127) if ascii_alone else rng.integers(256)
        data[int(rng.integers(len(data)))] = int(value)
    return data.decode("utf-8", errors="surrogateescape")


def fields_said() -> dict[str, Any]:
    """The fields of the whole `.robot.yaml`."""
    return dict(yaml.safe_load(SAID))


def say_less(rng: np.random.Generator) -> str:
    """A `.robot.yaml` of some of the fields, one of its numbers now and then another size."""
    data = {k: v for k, v in fields_said().items() if k == "model" or rng.random() < 0.5}
    numbers = [k for k in data if k not in ("model", "name", "knees", "legs")]
    if numbers and rng.random() < 0.7:
        name, factor = pick(rng, numbers), float(pick(rng, (-1, 0, 0.1, 0.7, 1.5, 10, 1e6)))
        old = data[name]
        data[name] = [factor * x for x in old] if isinstance(old, list) else factor * old
    return str(yaml.safe_dump(data))
