"""Finds the four legs and their feet, straightens them and checks them.

In normal form a leg hangs straight down: its hip joint turns about x, hip pitch and knee about y,
and hip, knee and foot are in one plane across y. The axes stay where they are on the robot; the
points on them that are called hip, thigh and knee are chosen so that offsets along an axis vanish
or add up: the hip at the x of the hip pitch axis, thigh and knee in the foot's plane.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import RevoluteJoint
from pydrake.systems.framework import Context

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.importer.meshes import read_points
from drake_quad.robot.importer.parse import Tree
from drake_quad.robot.importer.raw_robot import (
    APPROXIMATED,
    ASSUMED,
    REPAIRED,
    GeometryInstance,
    Note,
    RawLeg,
    RawRobot,
    RigidGroup,
)

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


SMALLEST, LARGEST = 0.015, 0.030  # [m] radius of a foot without a shape in the file
SHARE = 0.07  # of the shank's length, between these


@dataclass(frozen=True)
class Foot:
    """A foot.

    Attributes:
        centre: (3,) in T [m].
        radius: Radius of the foot [m].
        piece: The shape that it replaces, or None.
        note: How it was found, if not by its own sphere.
    """

    centre: FloatArray
    radius: float
    piece: GeometryInstance | None
    note: Note | None


def find_foot(shank: RigidGroup, knee: FloatArray, *, radius: float | None = None) -> Foot:
    """The foot of a leg.

    It is the collision sphere farthest from the knee. Without any it is put at the end: into the
    tip of the farthest collision shape, or on the farthest link that is fixed to the shank.

    Args:
        shank: The last moving link and all that is fixed to it.
        knee: A point of the knee's axis, (3,) in T [m].
        radius: Radius of the foot from the robot's overrides, if any [m].
    """
    tips = [(_tip(piece, knee), piece) for piece in shank.collision]
    spheres = [
        (float(np.linalg.norm(p.X.translation() - knee)), p)
        for p in shank.collision
        if isinstance(p.shape, Sphere)
    ]
    if spheres:
        _, piece = max(spheres, key=lambda s: s[0])
        own = float(piece.shape.radius())
        return Foot(np.array(piece.X.translation()), radius or own, piece, None)
    leaves = [(float(np.linalg.norm(p - knee)), name) for name, p in shank.leaves.items()]
    leaf = max(leaves, default=(0.0, ""))
    tip, piece = max(tips, key=lambda t: float(np.linalg.norm(t[0] - knee)), default=(knee, None))  # type: ignore[assignment]
    far = float(np.linalg.norm(tip - knee))
    length = max(far, leaf[0])
    size = radius or float(np.clip(SHARE * length, SMALLEST, LARGEST))
    if piece is not None and far >= 0.9 * leaf[0]:
        centre = tip + (knee - tip) * size / far
        text = f"foot of {shank.name}: a sphere of {1e3 * size:.0f} mm in the tip of {piece.name}"
        return Foot(centre, size, piece, Note(REPAIRED, text))
    text = f"foot of {shank.name}: a sphere of {1e3 * size:.0f} mm at {leaf[1] or 'its end'}"
    return Foot(shank.leaves.get(leaf[1], tip), size, None, Note(ASSUMED, text))


def points_of(piece: GeometryInstance) -> FloatArray:
    """Points whose hull is a shape or holds it, (n, 3) in the frame of its pose [m]."""
    s = piece.shape
    if isinstance(s, (Mesh, Convex)):
        points = read_points(s.source().path())
        local = np.zeros((1, 3)) if points is None else points * np.array(s.scale3())
    else:
        half = _half_size(s)
        corners = np.array(np.meshgrid(*3 * [[-1.0, 1.0]])).reshape(3, -1).T
        local = corners * half
    return np.asarray((piece.X @ local.T).T)


def _half_size(shape: object) -> FloatArray:
    """Half the size of a primitive's box, (3,) [m]."""
    if isinstance(shape, Box):
        return np.asarray(0.5 * np.array(shape.size()))
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius())
    if isinstance(shape, Cylinder):
        return np.array([shape.radius(), shape.radius(), 0.5 * shape.length()])
    if isinstance(shape, Capsule):
        r = shape.radius()
        return np.array([r, r, 0.5 * shape.length() + r])
    if isinstance(shape, Ellipsoid):
        return np.array([shape.a(), shape.b(), shape.c()])
    return np.zeros(3)


def _tip(piece: GeometryInstance, knee: FloatArray) -> FloatArray:
    """The middle of that end of a shape that is farthest from the knee, (3,)."""
    points = points_of(piece)
    far = np.linalg.norm(points - knee, axis=1)
    end = points[far >= far.max() - 0.1 * (far.max() - far.min()) - 1e-9]
    middle = 0.5 * (end.min(axis=0) + end.max(axis=0))
    direction = middle - knee
    return np.asarray(knee + direction / max(np.linalg.norm(direction), 1e-9) * far.max())


@dataclass(frozen=True)
class LegFrames:
    """One leg in normal form; its coordinates are in B (whose axes are forward, left, up).

    Attributes:
        sign: +1 or -1 of each joint: angle in the file = sign * (angle here + turn), (3,).
        turn: Offsets of the angles, (3,) [rad], see `sign`.
        axis: Axis of each joint as it turns here, (3, 3), a row a joint; x, y, y or very nearly.
        origin: Hip, thigh and knee, (3, 3) [m].
        foot: The foot's centre, (3,) [m].
        X: What moves each of the three links from the file's zero to this one, in B.
    """

    sign: FloatArray
    turn: FloatArray
    axis: FloatArray
    origin: FloatArray
    foot: FloatArray
    X: tuple[RigidTransform, RigidTransform, RigidTransform]

    @property
    def raised(self) -> float:
        """How far the hip pitch axis passes above the hip's [m]."""
        return float(self.origin[1, 2] - self.origin[0, 2])


def straighten(axes: FloatArray, points: FloatArray, foot: FloatArray) -> LegFrames:
    """Turns a leg's joints until it hangs straight down.

    Args:
        axes: Unit vectors of abduction, hip pitch and knee at the file's zero, (3, 3) in B.
        points: A point of each axis, (3, 3) in B [m].
        foot: The foot's centre, (3,) in B [m].
    """
    sign = np.ones(3)
    sign[0] = 1.0 if axes[0, 0] > 0.0 else -1.0
    a = axes * sign[:, None]
    turn = np.zeros(3)
    # The hip pitch axis into the horizontal, by the shorter way.
    turn[0] = -np.arctan2(a[1, 2], a[1, 1])
    turn[0] = (turn[0] + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    hip_X = about(a[0], points[0], turn[0])
    a[1:] = (hip_X.rotation().matrix() @ a[1:].T).T
    p = np.array([points[0], hip_X @ points[1], hip_X @ points[2]])
    foot = hip_X @ foot
    for k in (1, 2):
        sign[k] = 1.0 if a[k, 1] > 0.0 else -1.0
        a[k] *= sign[k]
    thigh = along(a[1], p[1], 1, foot[1])
    # The knee below the thigh, then the foot below the knee.
    turn[1] = hang(along(a[2], p[2], 1, foot[1]) - thigh)
    thigh_X = about(a[1], thigh, turn[1])
    a[2] = thigh_X.rotation() @ a[2]
    foot = thigh_X @ foot
    knee = along(a[2], thigh_X @ p[2], 1, foot[1])
    turn[2] = hang(foot - knee)
    knee_X = about(a[2], knee, turn[2])
    return LegFrames(
        sign=sign,
        turn=turn,
        axis=a,
        origin=np.array([along(a[0], p[0], 0, thigh[0]), thigh, knee]),
        foot=knee_X @ foot,
        X=(hip_X, thigh_X @ hip_X, knee_X @ thigh_X @ hip_X),
    )


def hang(v: FloatArray) -> float:
    """The turn about +y that brings `v` (3,) to -z [rad], in (-π, π]."""
    # A turn by b takes (x, z) to (x cos b + z sin b, z cos b - x sin b).
    return float(np.arctan2(v[0], -v[2]))


def along(axis: FloatArray, point: FloatArray, coordinate: int, value: float) -> FloatArray:
    """The point of a line at which one coordinate has a value, (3,)."""
    return np.asarray(point + (value - point[coordinate]) / axis[coordinate] * axis)


def about(axis: FloatArray, point: FloatArray, angle: float) -> RigidTransform:
    """The turn by `angle` about the line through `point`."""
    from scipy.spatial.transform import Rotation  # a third of a second: see mesh_files

    R = RotationMatrix(Rotation.from_rotvec(angle * axis).as_matrix())
    return RigidTransform(R, point - R @ point)


APART = 0.5  # of thigh and shank: heights of the hip pitch axis over the abduction axis, at most
THINNEST = 1e-3  # [m] radius of a foot
SQUARE = 1e-3  # [rad] out of square, from which a note is made


def heading(lines: list[FloatArray]) -> tuple[float, str]:
    """Forward direction in T from the axes of the first joints (n, 3): its yaw [rad], and a note.

    A robot goes along its abduction axes. Along x it is +x; along y, +y is taken for it.
    """
    if all(between(axis, np.array([1.0, 0.0, 0.0])) <= AXIS_TOLERANCE for axis in lines):
        return 0.0, ""
    return 0.5 * np.pi, "its legs abduct about y, so its front is taken to be along +y"


def corners(hips: FloatArray, raw: RawRobot, source: str) -> list[int]:
    """Which of the legs is FL, FR, RL and RR, by their hips (4, 3) about their centre."""
    found = [(bool(x <= 0.0), bool(y <= 0.0)) for x, y, _ in hips]
    wanted = [(False, False), (False, True), (True, False), (True, True)]
    if sorted(found) != wanted:
        where = {
            leg.hinges[0].name: p.round(3).tolist() for leg, p in zip(raw.legs, hips, strict=True)
        }
        raise InputError(
            source=source,
            field="hips",
            value=where,
            remedy="the hips must be at four corners: front and rear, left and right",
        )
    return [found.index(corner) for corner in wanted]


def check_directions(leg: RawLeg, axes: FloatArray, source: str) -> None:
    """Refuses a leg whose joints do not turn about x and twice across it, as seen from B."""
    x = np.array([1.0, 0.0, 0.0])
    faults = (
        (0, between(axes[0], x), "turns about the robot's forward axis"),
        (1, 0.5 * np.pi - between(axes[0], axes[1]), "turns across the first"),
        (2, between(axes[1], axes[2]), "turns as the second does"),
    )
    for k, angle, rule in faults:
        if angle > AXIS_TOLERANCE:
            raise InputError(
                source=source,
                field=leg.hinges[k].name,
                value=np.round(axes[k], 3).tolist(),
                remedy=f"axis, {np.rad2deg(angle):.0f}° off: joint {k + 1} of a leg {rule}",
            )


def check_names(raw: RawRobot, source: str) -> None:
    """Refuses links and joints whose names no URDF can hold: twice, `world`, or with `::`."""
    links = [raw.trunk.name, *(group.name for leg in raw.legs for group in leg.groups)]
    joints = [hinge.name for leg in raw.legs for hinge in leg.hinges]
    for kind, names in (("link", links), ("joint", joints)):
        for name in names:
            fault = "is the name of more than one" if names.count(name) > 1 else ""
            if (kind, name) == ("link", "world"):
                fault = "is the name of what the robot stands in"
            if "::" in name:
                fault = "holds ::, which stands between names of models"
            if fault:
                remedy = f"{fault}; give each {kind} of the robot a name of its own"
                raise InputError(source=source, field=f"{kind}.name", value=name, remedy=remedy)


def check_foot(leg: RawLeg, foot: Foot, shank: float, source: str, *, overridden: bool) -> None:
    """Refuses a foot that is no ball at the end of a shank of this length [m].

    Args:
        leg: The leg.
        foot: The leg's foot.
        shank: The shank's length [m].
        source: What the person gave.
        overridden: Whether the radius is from the robot's overrides.

    Raises:
        InputError: If it is none.
    """
    if not THINNEST <= foot.radius <= 0.5 * shank:
        raise InputError(
            source=source,
            field="foot_radius" if overridden else f"{leg.groups[2].name}: radius of its foot",
            value=foot.radius,
            remedy=f"must be from {THINNEST:g} m to half of the shank, {0.5 * shank:.3g} m here",
        )


def check_lengths(leg: RawLeg, frames: LegFrames, notes: list[Note], source: str) -> None:
    """Refuses a leg that the normal form does not have; notes one that it has nearly."""
    first, second, third = (h.name for h in leg.hinges)
    lengths = frames.origin[1, 2] - frames.origin[2, 2], frames.origin[2, 2] - frames.foot[2]
    if min(lengths) < 1e-3:
        raise InputError(
            source=source,
            field=f"{second}, {third}: thigh and shank",
            value=[round(float(x), 4) for x in lengths],
            remedy="both must have a length",
        )
    most = APART * sum(lengths)
    if abs(frames.raised) > most:
        raise InputError(
            source=source,
            field=f"{first}, {second}: height between their axes",
            value=f"{1e3 * frames.raised:.0f} mm",
            remedy=f"at most half of thigh and shank, {1e3 * most:.0f} mm here",
        )
    tilt = np.arccos(np.clip(np.diag(frames.axis[:, [0, 1, 1]]), -1.0, 1.0))
    if tilt.max() > SQUARE:
        name = leg.hinges[int(tilt.argmax())].name
        text = f"{name}: its axis is {np.rad2deg(tilt.max()):.2f}° out of square"
        notes.append(Note(APPROXIMATED, f"{text}; gaits are planned as if it were not"))
