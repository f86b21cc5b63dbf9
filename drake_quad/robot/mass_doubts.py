"""Doubts about a robot's masses: links that lost theirs, and places and inertias that no link has.

Bounds are generous beside the robots that are known by name; what those have is told with each.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.tree import RigidBody

from drake_quad.common import FloatArray
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel

LINKS = ("hip", "thigh", "shank")
SIDES = ((0, 1), (2, 3))  # rows of legs that are each other's mirror
ALIKE = "left and right are alike in most robots"

LIGHTEST = 1e-3  # share of the robot's mass: a lighter thigh or shank has lost its mass
LIGHTEST_HIP = 0.03  # share of its thigh and shank: a lighter hip has (0.31 and more)
LIGHTEST_TRUNK = 0.2  # share of all legs: a lighter trunk has (0.69 and more)
UNLIKE = 1.1  # ratio of masses from which on left and right link are unlike (up to 1.001)
# Bounds of a link's principal moments of inertia together, in its mass times its scale squared
# (0.004 to 0.5).
LEAST_INERTIA, MOST_INERTIA = 3e-4, 2.0
POINT = 1e-10  # [m²] of inertia per mass: none at all, of which the importer tells
# How far the centre of mass may be from the box that a link's joints span, in its scale: of trunk
# and hips (up to 0.25), and of thighs and shanks (up to 0.14).
FAR, FAR_IN_LEG = 0.5, 0.3
MIRRORED = 0.08  # of the leg: between a centre of mass and its mirror's (up to 0.04)


@dataclass(frozen=True, eq=False)
class LinkMass:
    """A link with its mass, and what that is to be compared with.

    Attributes:
        name: Its name in the robot's file.
        mass: Its mass [kg].
        com: Its centre of mass in its own frame, in normal form (3,) [m].
        moments: Its principal moments of inertia (3,) [kg m²]; 0 without mass.
        box: Least and greatest x, y, z of its joints there, and of its foot (2, 3) [m].
        scale: Length of its leg; of the trunk, from hip to hip across [m].
        far: How far from `box` its centre of mass may be, in `scale`.
    """

    name: str
    mass: float
    com: FloatArray
    moments: FloatArray
    box: FloatArray
    scale: float
    far: float


def doubts_about_masses(robot: RobotModel) -> list[str]:
    """Lines that say which mass, centre of mass or inertia is hardly meant so."""
    trunk, *links = read_link_masses(robot)
    legs = np.array(links, dtype=object).reshape(4, 3)
    # One line for one fault: of a link that has lost its mass the other figures mean nothing.
    found = {**_lost_masses(robot, legs), **_light_trunk(robot, trunk)}
    sound = [link for link in (trunk, *legs.flat) if link.name not in found]
    unlike = _unlike_masses(legs, found)
    outside = {link.name: line for link in sound for line in _far_centre(link)}
    centres = _unmirrored_centres(legs, {**found, **unlike, **outside})
    inertias = [line for link in sound if link.name not in outside for line in _odd_inertia(link)]
    lines = [*found.values(), *unlike.values(), *outside.values(), *centres, *inertias]
    return list(dict.fromkeys(lines))


def read_link_masses(robot: RobotModel) -> list[LinkMass]:
    """The trunk, and hip, thigh and shank of each leg: names and inertias from the robot's file."""
    plant, g = MakeModelPlant(robot.url), robot.geometry
    hips = np.array([g.p_BH.min(axis=0), g.p_BH.max(axis=0)])
    trunk = plant.GetBodyByName(robot.trunk)
    across = float(np.linalg.norm(hips[1] - hips[0]))
    links = [
        LinkMass(
            trunk.name(), robot.trunk_mass, robot.trunk_com, _moments(trunk), hips, across, FAR
        )
    ]
    for row in range(4):
        ends = (g.p_HP[row], [0.0, 0.0, -g.thigh[row]], [0.0, 0.0, -g.shank[row]])
        for link, end in enumerate(ends):
            body = plant.GetJointByName(robot.joint_names[3 * row + link]).child_body()
            links.append(
                LinkMass(
                    name=body.name(),
                    mass=float(robot.link_mass[row, link]),
                    com=robot.link_com[row, link],
                    moments=_moments(body),
                    box=np.array([np.minimum(end, 0.0), np.maximum(end, 0.0)]),
                    scale=float(g.reach[row]),
                    far=FAR if link == 0 else FAR_IN_LEG,
                )
            )
    return links


def _moments(body: RigidBody) -> FloatArray:
    """Principal moments of inertia about the centre of mass (3,) [kg m²]."""
    if not body.default_mass() > 0.0:
        return np.zeros(3)
    about = body.default_spatial_inertia().Shift(body.default_com()).CalcRotationalInertia()
    return np.asarray(about.CalcPrincipalMomentsOfInertia())


def _lost_masses(robot: RobotModel, legs: FloatArray) -> dict[str, str]:
    """A line for links of the legs that have hardly any mass, by their names."""
    mass = robot.link_mass
    lost = mass < LIGHTEST * robot.mass
    lost[:, 0] |= mass[:, 0] < LIGHTEST_HIP * mass[:, 1:].sum(axis=1)
    rows = np.argwhere(lost).tolist()
    names = ", ".join(
        f"{SHORT_NAMES[row]}'s {LINKS[link]} ({legs[row, link].name}, {mass[row, link]:.3g} kg)"
        for row, link in rows
    )
    have = "has" if len(rows) == 1 else "have"
    line = f"{names}: {have} hardly any mass beside the other links; is there an <inertial>?"
    return {legs[row, link].name: line for row, link in rows}


def _light_trunk(robot: RobotModel, trunk: LinkMass) -> dict[str, str]:
    """A line for a trunk that is far lighter than its legs, by its name."""
    legs = float(robot.link_mass.sum())
    if trunk.mass >= LIGHTEST_TRUNK * legs:
        return {}
    return {
        trunk.name: f"{trunk.name}: the trunk has {trunk.mass:.3g} kg, and its legs have "
        f"{legs:.3g} kg; most trunks are about as heavy as their legs, or heavier: does an "
        "<inertial> lack, or is a mass not in kg?"
    }


def _unlike_masses(legs: FloatArray, known: dict[str, str]) -> dict[str, str]:
    """A line for each link that is not as heavy as its mirror, by the names of both."""
    lines: dict[str, str] = {}
    for a, b, words in _mirrored(legs):
        heavier, lighter = max(a.mass, b.mass), min(a.mass, b.mass)
        if heavier > UNLIKE * lighter and not {a.name, b.name} & set(known):
            line = f"{words[0]} has {a.mass:.3g} kg, {words[1]} {b.mass:.3g} kg: {ALIKE}"
            lines |= {a.name: line, b.name: line}
    return lines


def _mirrored(legs: FloatArray) -> Iterator[tuple[LinkMass, LinkMass, tuple[str, str]]]:
    """Links that are each other's mirror, and words for the two."""
    for left, right in SIDES:
        for link, name in enumerate(LINKS):
            a, b = legs[left, link], legs[right, link]
            words = (
                f"{SHORT_NAMES[left]}'s {name} ({a.name})",
                f"{SHORT_NAMES[right]}'s ({b.name})",
            )
            yield a, b, words


def _far_centre(link: LinkMass) -> list[str]:
    """A line if a link's centre of mass is far outside of the link."""
    off = float(np.linalg.norm(link.com - np.clip(link.com, *link.box)))
    if off <= link.far * link.scale:
        return []
    return [
        f"{link.name}: its centre of mass, at {_told(link.com)} m, is {off:.3g} m outside of what "
        "its joints span; it should be within the link, or near to it: is its <origin> in metres, "
        "and in the link's own frame?"
    ]


def _unmirrored_centres(legs: FloatArray, known: dict[str, str]) -> list[str]:
    """A line for each centre of mass that is far from its mirror's."""
    lines = []
    for a, b, words in _mirrored(legs):
        off = float(np.linalg.norm(a.com - b.com * [1.0, -1.0, 1.0]))
        if off > MIRRORED * a.scale and not {a.name, b.name} & set(known):
            lines.append(
                f"{words[0]} has its centre of mass at {_told(a.com)} m from its joint, "
                f"{words[1]} at {_told(b.com)} m, which is not its mirror: {ALIKE}; is a sign "
                "wrong?"
            )
    return lines


def _odd_inertia(link: LinkMass) -> list[str]:
    """A line if a link's inertia is not that of a body of about its size."""
    unit, total = link.mass * link.scale**2, float(link.moments.sum())
    if total <= POINT * link.mass or LEAST_INERTIA * unit <= total <= MOST_INERTIA * unit:
        return []
    return [
        f"{link.name}: its moments of inertia are {_told(link.moments)} kg m², and it has "
        f"{link.mass:.3g} kg; in a robot of this size {0.002 * unit:.2g} to {0.2 * unit:.2g} kg m² "
        "would be usual: are they in kg m², and the mass in kg?"
    ]


def _told(values: FloatArray) -> str:
    """Three numbers in words."""
    return ", ".join(f"{x + 0.0:.4g}" for x in values)
