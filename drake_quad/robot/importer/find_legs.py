"""Finds a robot's four legs: chains of three revolute joints, or those that a person named."""

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.tree import RevoluteJoint
from pydrake.systems.framework import Context

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.importer.parse import Tree

AXIS_TOLERANCE = np.deg2rad(5.0)  # [rad] from the axis that a leg of the normal form has


@dataclass(frozen=True)
class Line:
    """A joint's axis in T: unit vector (3,) and a point (3,) [m]."""

    axis: FloatArray
    point: FloatArray


def axis_of(tree: Tree, context: Context, body: int) -> Line:
    """The axis of the revolute joint that carries `body`, in T, the root's frame."""
    joint = tree.joint_to[body]
    X_TJ = joint.frame_on_parent().CalcPose(context, tree.body(tree.root).body_frame())
    axis = X_TJ.rotation().matrix() @ np.array(joint.revolute_axis())
    return Line(axis / np.linalg.norm(axis), np.array(X_TJ.translation()))


def chain_from(tree: Tree, first: int) -> tuple[list[int], str]:
    """The moving bodies of a chain from `first` outwards, and what makes it no leg's, if anything.

    The chain ends where nothing moves any more, or where it branches.
    """
    chain = [first]
    while following := tree.moving(chain[-1]):
        if len(following) > 1:
            return chain, f"branches after {tree.joint_to[chain[-1]].name()}"
        chain.append(following[0])
    bad = [i for i in chain if not isinstance(tree.joint_to[i], RevoluteJoint)]
    if bad:
        joint = tree.joint_to[bad[0]]
        return chain, f"{joint.name()} is {joint.type_name()}, not revolute"
    if len(chain) != 3:
        return chain, f"has {len(chain)} joints, not 3"
    return chain, ""


def between(a: FloatArray, b: FloatArray) -> float:
    """The angle between two lines [rad], in [0, π/2]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(np.dot(a, b))))


def axes_fault(tree: Tree, lines: list[Line], chain: list[int]) -> str:
    """What is wrong with the directions of a chain's three axes; empty if nothing is."""
    names = [tree.joint_to[i].name() for i in chain]
    haa, hfe, kfe = (line.axis for line in lines)
    axes = [np.round(line.axis, 3).tolist() for line in lines]
    flat = min(between(haa, np.eye(3)[k]) for k in (0, 1))
    if flat > AXIS_TOLERANCE:
        return f"{names[0]} turns about {axes[0]}; the first joint of a leg turns about ±x"
    if np.pi / 2 - between(haa, hfe) > AXIS_TOLERANCE:
        return f"{names[1]} turns about {axes[1]}; the second turns across the first"
    if between(hfe, kfe) > AXIS_TOLERANCE:
        return f"{names[2]} turns about {axes[2]}; the third turns as the second"
    return ""


def find_legs(
    tree: Tree, context: Context, *, source: str, wanted: list[list[str]] | None = None
) -> list[list[int]]:
    """The bodies that the joints of four legs carry: hip, thigh and shank of each.

    A leg is a chain of just three revolute joints on the trunk, about ±x and twice across it. Any
    other chain (an arm, a head) is no leg.

    Args:
        tree: The robot.
        context: Context of the plant with every joint at zero.
        source: Name of the file, for errors.
        wanted: The names of the legs' joints from the robot's overrides, if any.

    Raises:
        InputError: If there are not four, with what is wrong with each chain.
    """
    if wanted is not None:
        return [_by_names(tree, names, source) for names in wanted]
    legs, faults = [], []
    for first in tree.moving(tree.root):
        chain, fault = chain_from(tree, first)
        if not fault:
            fault = axes_fault(tree, [axis_of(tree, context, i) for i in chain], chain)
        if fault:
            faults.append(f"{tree.joint_to[first].name()}...: {fault}")
        else:
            legs.append(chain)
    if len(legs) != 4:
        found = f"{len(legs)} of its chains of joints are legs"
        raise InputError(
            source=source,
            field="robot.model",
            value=[tree.joint_to[leg[0]].name() for leg in legs],
            remedy="four legs of three revolute joints (abduction, hip, knee) are needed; "
            + "; ".join([found, *faults])
            + ("; a .robot.yaml can say which are the legs" if len(legs) > 4 or faults else ""),
        )
    return legs


def _by_names(tree: Tree, names: list[str], source: str) -> list[int]:
    """The bodies that the joints of one leg carry, as a person named them."""

    def refuse(remedy: str) -> InputError:
        return InputError(source=source, field="legs", value=names, remedy=remedy)

    bodies = {joint.name(): body for body, joint in tree.joint_to.items()}
    unknown = [name for name in names if name not in bodies]
    if unknown or len(names) != 3:
        raise refuse(f"three joints of the robot are needed; it has {', '.join(sorted(bodies))}")
    chain = [bodies[name] for name in names]
    if any(not isinstance(tree.joint_to[i], RevoluteJoint) for i in chain):
        raise refuse("the joints of a leg are revolute")
    if chain[1] not in tree.below(chain[0]) or chain[2] not in tree.below(chain[1]):
        raise refuse("each joint must carry the next")
    return chain
