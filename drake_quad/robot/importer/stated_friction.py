"""What a robot's file states of friction: of its collision shapes, and of its joints."""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Set
from typing import Any

from drake_quad.errors import InputError
from drake_quad.robot.importer.xml_io import COLON, floats

Shapes = set[tuple[str, str]]  # names of a link and of one of its collision shapes
DRAKE_TAGS = (f"drake{COLON}mu_static", f"drake{COLON}mu_dynamic")
OTHERS = ("mu", "mu1", "mu2")  # ODE's, in SDF and in a URDF's `gazebo`


def shapes_with_friction(root: ET.Element) -> Shapes:
    """The collision shapes of a URDF or SDF that state a friction of Drake's kind.

    Returns:
        Names of link and shape; the shape's is empty where the file gives it none.
    """
    return {
        (link.get("name", ""), collision.get("name", ""))
        for link in root.iter("link")
        for collision in link.findall("collision")
        if any(element.tag in DRAKE_TAGS for element in collision.iter())
    }


def states_friction(frictional: Set[tuple[str, str]], link: str, shape: str) -> bool:
    """Whether a shape is one of those of `shapes_with_friction`.

    Args:
        frictional: Those.
        link: Name of the link.
        shape: Name of the collision geometry as Drake has it, which may begin with the model's.
    """
    # Drake makes up a name for a shape without one: which of them it is cannot be told.
    return bool({(link, shape.rpartition("::")[2]), (link, "")} & frictional)


MOST_JOINT_FRICTION = 1000.0  # [Nm]


def joint_friction(
    root: ET.Element, refuse: Callable[[str, Any, str], InputError]
) -> dict[str, float]:
    """Coulomb friction [Nm] of the joints of a URDF, SDF or MJCF that have any, by name.

    Args:
        root: The file, an MJCF's defaults written out.
        refuse: Makes the error from field, value and what would be right.

    Raises:
        InputError: If a friction is no number, or one that no joint has.
    """
    found = {}
    for joint in root.iter("joint"):
        dynamics, name = joint.find("dynamics"), joint.get("name", "")
        if dynamics is not None:
            text = dynamics.get("friction")
        else:
            text = joint.get("frictionloss", joint.findtext("axis/dynamics/friction"))
        if not (text or "").strip():
            continue
        values = floats(text)
        if not values or not 0.0 <= values[0] <= MOST_JOINT_FRICTION:
            remedy = f"must be a number from 0 to {MOST_JOINT_FRICTION:g} [Nm]"
            raise refuse(f"{name}: friction", text, remedy)
        if values[0] > 0.0:
            found[name] = values[0]
    return found


def has_friction_of_others(root: ET.Element) -> bool:
    """Whether a URDF or SDF states a friction for ODE."""
    return any(element.tag in OTHERS for element in root.iter())
