"""What a robot's file says of its surfaces' friction: Drake's own tags, and other simulators'.

Drake combines the coefficients of two bodies that touch to 2 μ₁ μ₂ / (μ₁ + μ₂); its own tags are
meant for that. MuJoCo takes the greater of two, ODE the smaller: their figures say something else.
"""

import xml.etree.ElementTree as ET

from drake_quad.robot.importer.raw_robot import DROPPED
from drake_quad.robot.importer.sanitize import Cleaned
from drake_quad.robot.importer.xml_io import COLON

DRAKE_TAGS = (f"drake{COLON}mu_static", f"drake{COLON}mu_dynamic")
OTHERS = ("mu", "mu1", "mu2")  # ODE's, in SDF and in a URDF's `gazebo`


def states_friction(link: ET.Element) -> bool:
    """Whether a collision shape of a link (URDF or SDF) has a friction of Drake's kind."""
    return any(
        element.tag in DRAKE_TAGS
        for collision in link.findall("collision")
        for element in collision.iter()
    )


def links_with_friction(root: ET.Element) -> set[str]:
    """The links of a URDF or SDF that state a friction of Drake's kind, by name."""
    return {link.get("name", "") for link in root.iter("link") if states_friction(link)}


def read_friction(c: Cleaned) -> None:
    """Remembers which links state their friction, and notes a friction that is not used."""
    c.frictional |= links_with_friction(c.root)
    mjcf = c.root.tag == "mujoco"
    if any(e.get("friction") for e in c.root.iter("geom")) if mjcf else _has_others(c.root):
        whose = "MuJoCo's" if mjcf else "ODE's"
        text = f"friction of {whose} kind is not used: that of contacts is simulation.friction"
        c.note(DROPPED, text)


def _has_others(root: ET.Element) -> bool:
    return any(element.tag in OTHERS for element in root.iter())
