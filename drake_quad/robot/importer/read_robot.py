"""Reads the legs and the trunk of a parsed robot: masses, axes, limits, shapes, all in T."""

import numpy as np
from pydrake.geometry import HalfSpace, MeshcatCone, Role
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, RigidBody
from pydrake.systems.framework import Context

from drake_quad.errors import InputError
from drake_quad.robot.importer.find_legs import axis_of, find_legs
from drake_quad.robot.importer.parse import Parsed, Tree, grow_tree
from drake_quad.robot.importer.raw_robot import (
    ASSUMED,
    DROPPED,
    NO_MASS,
    REPAIRED,
    GeometryInstance,
    RawLeg,
    RawRobot,
    RevoluteJoint,
    RigidGroup,
    RigidMass,
)
from drake_quad.robot.importer.sanitize import Cleaned, Drive
from drake_quad.robot.importer.stated_friction import states_friction

NO_INERTIA = 1e-10  # [m²] per mass: rounding, when masses at points are added up


def read_robot(
    parsed: Parsed, *, source: str, name: str, legs: list[list[str]] | None = None
) -> RawRobot:
    """The quadruped in a parsed file.

    Args:
        parsed: The file; its notes are added to.
        source: Name of the file, for errors.
        name: The robot's name.
        legs: Names of the legs' joints from the robot's overrides, if any.

    Raises:
        InputError: If it is none.
    """
    plant, cleaned = parsed.plant, parsed.cleaned
    tree = grow_tree(plant)
    if tree.others:
        cleaned.note(DROPPED, f"not of the robot: {', '.join(tree.others)}")
    context = plant.CreateDefaultContext()
    for joint in tree.joint_to.values():
        if joint.num_positions() == 1:
            _set(tree, context, joint, 0.0)
    found = find_legs(tree, context, source=source, wanted=legs)
    movers = frozenset(body for leg in found for body in leg)
    locked = _lock(tree, context, movers, cleaned.reference)
    if locked:
        cleaned.note(REPAIRED, f"locked, for they are no leg's: {', '.join(locked)}")
    raw = RawRobot(
        name=name,
        trunk=_group(parsed, tree, context, tree.root, movers),
        trunk_name=tree.body(tree.root).name(),
        legs=tuple(
            RawLeg(
                hinges=tuple(_hinge(tree, context, i, cleaned) for i in leg),  # type: ignore[arg-type]
                groups=tuple(_group(parsed, tree, context, i, movers) for i in leg),  # type: ignore[arg-type]
            )
            for leg in found
        ),
        yaw=0.0,
        reference=dict(cleaned.reference),
    )
    for part in (raw.trunk, *(leg.groups[2] for leg in raw.legs)):
        if not part.rigid.mass > 0.0:
            raise InputError(
                source=source,
                field=f"{part.name}: mass",
                value=part.rigid.mass,
                remedy="has no mass; give its link, or one fixed to it, an inertial element",
            )
        if not np.trace(part.rigid.central_inertia()) > NO_INERTIA * part.rigid.mass:
            raise InputError(
                source=source,
                field=f"{part.name}: inertia",
                value=0.0,
                remedy="has mass and no inertia; give its link a rotational inertia",
            )
    return raw


def _lock(
    tree: Tree, context: Context, movers: frozenset[int], reference: dict[str, float]
) -> list[str]:
    """Puts joints that are no leg's where they stay: standing pose, or zero within limits."""
    names = []
    for body in tree.below(tree.root)[1:]:
        joint = tree.joint_to[body]
        if body in movers or joint.num_velocities() == 0:
            continue
        names.append(joint.name())
        if joint.num_positions() == 1:
            low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
            angle = reference.get(joint.name(), float(np.clip(0.0, low, high)))
            _set(tree, context, joint, angle)
    return names


def _set(tree: Tree, context: Context, joint: Joint, angle: float) -> None:
    """Sets one joint's position."""
    q = np.array(tree.plant.GetPositions(context))
    q[joint.position_start()] = angle
    tree.plant.SetPositions(context, q)


def _scoped(plant: MultibodyPlant, part: RigidBody | Joint) -> str:
    """The name of a body or joint after that of its model."""
    return f"{plant.GetModelInstanceName(part.model_instance())}::{part.name()}"


def _hinge(tree: Tree, context: Context, body: int, cleaned: Cleaned) -> RevoluteJoint:
    """The joint that carries `body`."""
    joint, line = tree.joint_to[body], axis_of(tree, context, body)
    drives = cleaned.drives
    drive = drives.get(_scoped(tree.plant, joint), drives.get(joint.name(), Drive()))
    return RevoluteJoint(
        name=joint.name(),
        axis=line.axis,
        point=line.point,
        lower=float(joint.position_lower_limit()),
        upper=float(joint.position_upper_limit()),
        effort=drive.effort,
        speed=float(joint.velocity_upper_limit()),
        damping=float(joint.default_damping()),
        friction=cleaned.joint_friction.get(joint.name(), 0.0),
        rotor_inertia=drive.rotor_inertia,
        gear_ratio=drive.gear_ratio,
    )


def _group(
    parsed: Parsed, tree: Tree, context: Context, first: int, movers: frozenset[int]
) -> RigidGroup:
    """All that is fixed to the body `first`, with joints that are no leg's locked."""
    bodies = tree.below(first, without=movers)
    to_T = tree.body(tree.root).EvalPoseInWorld(context).inverse()
    rigid, shapes = NO_MASS, {Role.kProximity: [], Role.kIllustration: []}  # type: ignore[var-annotated]
    leaves = {}
    for index in bodies:
        body = tree.body(index)
        X_TL = to_T @ body.EvalPoseInWorld(context)
        M = body.CalcSpatialInertiaInBodyFrame(context)
        mass = float(M.get_mass())
        if _scoped(tree.plant, body) in parsed.cleaned.massless:
            parsed.cleaned.note(ASSUMED, f"link {body.name()}: no inertial; it has no mass")
        elif mass > 0.0:
            inertia = np.array(M.CalcRotationalInertia().CopyToFullMatrix3())
            rigid = rigid + RigidMass(mass, np.array(M.CalcComMoment()), inertia).moved(X_TL)
        for role, pieces in shapes.items():
            pieces += _pieces(parsed, body, role, X_TL)
        if not tree.children[index]:
            leaves[body.name()] = np.array(X_TL.translation())
    return RigidGroup(
        name=tree.body(first).name(),
        links=tuple(tree.body(i).name() for i in bodies),
        rigid=rigid,
        collision=tuple(shapes[Role.kProximity]),
        visual=tuple(shapes[Role.kIllustration]),
        shapeless=any(tree.body(i).name() in parsed.cleaned.shapeless for i in bodies),
        leaves=leaves,
    )


def _pieces(
    parsed: Parsed, body: object, role: Role, X_TL: RigidTransform
) -> list[GeometryInstance]:
    """The shapes of one body in one role, in T."""
    inspector = parsed.scene_graph.model_inspector()
    frame = parsed.plant.GetBodyFrameIdOrThrow(body.index())  # type: ignore[attr-defined]
    found = []
    for g in inspector.GetGeometries(frame, role):
        colour, friction, name = None, None, inspector.GetName(g).rpartition("::")[2]
        if isinstance(inspector.GetShape(g), (HalfSpace, MeshcatCone)):
            text = f"link {body.name()}: {name} is a plane or cone"  # type: ignore[attr-defined]
            parsed.cleaned.note(DROPPED, text)
            continue
        if role == Role.kIllustration:
            properties = inspector.GetIllustrationProperties(g)
            if properties.HasProperty("phong", "diffuse"):
                rgba = properties.GetProperty("phong", "diffuse")
                colour = (rgba.r(), rgba.g(), rgba.b(), rgba.a())
        elif states_friction(parsed.cleaned.frictional, body.name(), name):  # type: ignore[attr-defined]
            properties = inspector.GetProximityProperties(g)
            stated = properties.GetProperty("material", "coulomb_friction")
            friction = (stated.static_friction(), stated.dynamic_friction())
        X = X_TL @ inspector.GetPoseInFrame(g)
        shape = inspector.GetShape(g)
        found.append(GeometryInstance(name, body.name(), shape, X, colour, friction))  # type: ignore[attr-defined]
    return found
