"""Reads a RobotModel from a plant in normal form: legs, limits, masses, outlines.

In normal form a leg has three revolute joints about x, y and y, hangs straight down at angle zero
with its links' frames parallel to the trunk's, and ends in a sphere.
"""

from collections.abc import Callable, Set
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import GeometryId, SceneGraph, SceneGraphInspector, Sphere
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator, ModelInstanceIndex, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import InputError
from drake_quad.robot.importer.stated_friction import states_friction
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import LegGeometry, RobotModel
from drake_quad.robot.read_outline import bounding_box, outer_boxes, read_shank, read_thighs
from drake_quad.robot.read_stops import read_stops
from drake_quad.robot.shank_profile import PLACES, join_places

Refuse = Callable[[str, object, str], InputError]  # of field, value and what would be right
Chain = list[RevoluteJoint]  # a leg's joints, from the trunk on

CORNERS = [(False, False), (False, True), (True, False), (True, True)]  # (rear, right), as LEGS


@dataclass(frozen=True)
class Tolerance:
    """How far from normal form a file may be and be read as if it were in it.

    Attributes:
        axis: Deviation of a joint's axis, as a difference of unit vectors.
        offset: Distance of a point from where it should be [m].
    """

    axis: float
    offset: float


@dataclass(frozen=True, eq=False)
class LegRead:
    """One leg of the plant.

    Attributes:
        p_BH: The leg's hip in the trunk (3,) [m].
        p_HP: The leg's hip pitch axis from there (3,) [m].
        thigh: Length of the thigh [m].
        shank: Length of the shank, to the foot's centre [m].
        radius: Radius of the foot [m].
        foot: The foot's geometry, by name.
        friction: The foot's (dynamic) coefficient as the plant has it.
        sides: The shank's sides, see `read_shank` [m].
        profile: The same more finely, see `read_shank` [m].
    """

    p_BH: FloatArray
    p_HP: FloatArray
    thigh: float
    shank: float
    radius: float
    foot: str
    friction: float
    sides: FloatArray
    profile: FloatArray


def find_leg_links(
    plant: MultibodyPlant, context: Context, trunk: RigidBody, tolerance: Tolerance, refuse: Refuse
) -> list[Chain]:
    """The legs' joints, leg by leg in the order of LEGS; which is which follows from the hips.

    Raises:
        InputError: If they are not four legs in normal form.
    """
    chains = _leg_chains(plant, trunk)
    if len(chains) != 4 or any(len(chain) != 3 for chain in chains):
        raise refuse(
            "robot.model",
            [len(chain) for chain in chains],
            "joints in each leg; a robot with four legs of three revolute joints is needed",
        )
    hips = [chain[0].frame_on_parent().CalcPose(context, trunk.body_frame()) for chain in chains]
    quadrants = [(hip.translation()[0] <= 0, hip.translation()[1] <= 0) for hip in hips]
    if sorted(quadrants) != sorted(CORNERS):
        raise refuse("robot.model", quadrants, "(rear, right) of the hips; one leg each is needed")
    chains = [chains[quadrants.index(corner)] for corner in CORNERS]
    for chain, leg in zip(chains, SHORT_NAMES, strict=True):
        _check_leg(chain, leg, tolerance, refuse)
    return chains


def read_leg(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    chain: Chain,
    leg: str,
    tolerance: Tolerance,
    refuse: Refuse,
) -> LegRead:
    """Reads a leg, by its short name, of which the lowest sphere is the foot.

    Raises:
        InputError: If it has no foot, or its links are not where they are in normal form.
    """
    shank = chain[2].child_body()
    feet = [
        (inspector.GetPoseInFrame(g).translation(), inspector.GetShape(g).radius(), g)
        for g in plant.GetCollisionGeometriesForBody(shank)
        if isinstance(inspector.GetShape(g), Sphere)
    ]
    if not feet:
        raise refuse(f"{leg} link {shank.name()}", "no sphere", "its foot must be a sphere")
    place, radius, geometry = max(feet, key=lambda f: float(np.linalg.norm(f[0])))
    to_hip, to_knee = (_fixed_place(joint) for joint in chain[1:])
    aside = max(abs(to_hip[0]), *abs(to_knee[:2]), *abs(place[:2]))
    if aside > tolerance.offset or to_knee[2] >= 0.0 or place[2] >= 0.0:
        raise refuse(
            f"{leg} leg",
            [to_hip.tolist(), to_knee.tolist(), place.tolist()],
            "offsets; from hip to hip pitch none along x, and links along -z, are needed",
        )
    name, lengths = str(inspector.GetName(geometry)), (float(-to_knee[2]), float(-place[2]))
    links = (chain[1].child_body(), shank)
    sides, profile = read_shank(plant, inspector, links, name, lengths)
    return LegRead(
        p_BH=_fixed_place(chain[0]),
        p_HP=to_hip,
        thigh=lengths[0],
        shank=lengths[1],
        radius=radius,
        foot=name,
        friction=_friction_of(inspector, geometry),
        sides=sides,
        profile=profile,
    )


def _check_leg(chain: Chain, leg: str, tolerance: Tolerance, refuse: Refuse) -> None:
    """Refuses a leg whose joints are not in normal form, or whose knee folds to both sides."""
    for joint, axis in zip(chain, "xyy", strict=True):
        unit = np.eye(3)["xyz".index(axis)]
        if not np.allclose(joint.revolute_axis(), unit, atol=tolerance.axis):
            raise refuse(
                f"{leg} joint {joint.name()}",
                joint.revolute_axis().tolist(),
                f"axis; abduction-hip-knee legs turn about x, y, y (here {axis})",
            )
        if not _is_straight(joint):
            raise refuse(
                f"{leg} joint {joint.name()}",
                "turned or shifted frame",
                "at angle zero its links' frames must be parallel and meet at the joint",
            )
    bend = [chain[2].position_lower_limit(), chain[2].position_upper_limit()]
    if not np.all(np.isfinite(bend)) or sum(bend) == 0.0:
        raise refuse(
            f"{leg} joint {chain[2].name()}",
            bend,
            "limits; a knee must bend more to one side, which shows the leg's way to fold",
        )


def _friction_of(inspector: SceneGraphInspector, geometry: GeometryId) -> float:
    """The dynamic coefficient of a collision geometry."""
    properties = inspector.GetProximityProperties(geometry)
    return float(properties.GetProperty("material", "coulomb_friction").dynamic_friction())


def _fixed_place(joint: RevoluteJoint) -> FloatArray:
    """Where a joint is fixed to its parent's body (3,) [m]."""
    place: FloatArray = joint.frame_on_parent().GetFixedPoseInBodyFrame().translation()
    return place


def _is_straight(joint: RevoluteJoint) -> bool:
    """Whether at angle zero the joint's child frame is its parent's, moved without a turn."""
    parent = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    child = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return bool(parent.rotation().IsNearlyIdentity(1e-6) and child.IsNearlyIdentity(1e-6))


def _leg_chains(plant: MultibodyPlant, trunk: RigidBody) -> list[Chain]:
    """The chains of moving joints that start at the trunk, in the file's order."""
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    moving = [j for j in joints if isinstance(j, RevoluteJoint)]
    chains = []
    for first in (j for j in moving if j.parent_body().index() == trunk.index()):
        chain = [first]
        while following := [
            j for j in moving if j.parent_body().index() == chain[-1].child_body().index()
        ]:
            chain.append(following[0])
        chains.append(chain)
    return chains


LARGEST = 10.0  # [m] of any length of a leg
EXACT = Tolerance(axis=1e-9, offset=1e-6)
# Of a file that the importer wrote: it keeps the robot's own axes to the last bit, and has noted
# what the model leaves out.
IMPORTED = Tolerance(axis=0.1, offset=0.0051)


def read_model(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    instance: ModelInstanceIndex,
    *,
    url: str,
    tolerance: Tolerance = EXACT,
    frictional: Set[tuple[str, str]] = frozenset(),
) -> RobotModel:
    """Reads the robot of a finalized plant, whose file is in the normal form of this module.

    Args:
        plant: Holds the robot.
        scene_graph: Holds its geometry.
        instance: The robot in the plant.
        url: File that it was read from.
        tolerance: How far from normal form it may be.
        frictional: Collision shapes that state a friction in the file, see `shapes_with_friction`:
            of the others the plant has Drake's default.

    Raises:
        InputError: If it is not a quadruped in normal form.
    """

    def refuse(field: str, value: object, remedy: str) -> InputError:
        return InputError(source=url, field=field, value=value, remedy=remedy)

    bases = sorted(plant.GetFloatingBaseBodies())
    if len(bases) != 1:
        raise refuse(
            "robot.model", len(bases), "has this many floating bodies; one trunk is needed"
        )
    trunk, context = plant.get_body(bases[0]), plant.CreateDefaultContext()
    chains = find_leg_links(plant, context, trunk, tolerance, refuse)
    inspector = scene_graph.model_inspector()
    legs = [
        read_leg(plant, inspector, chain, leg, tolerance, refuse)
        for chain, leg in zip(chains, SHORT_NAMES, strict=True)
    ]
    joints = [joint for chain in chains for joint in chain]
    lower = np.array([j.position_lower_limit() for j in joints])
    upper = np.array([j.position_upper_limit() for j in joints])
    actuators = _actuators(plant, instance, joints, refuse)
    bodies = [joint.child_body() for joint in joints]
    radii = np.array([leg.radius for leg in legs])
    back, ahead = np.stack([leg.sides for leg in legs], axis=1)
    profile = join_places(PLACES, *np.stack([leg.profile for leg in legs], axis=1))
    thighs = [chain[1].child_body() for chain in chains]
    thigh_points, thigh_radii = read_thighs(plant, inspector, thighs)
    smaller = radii.max() - radii
    geometry = _geometry(legs, smaller, knees=0.5 * (lower + upper)[2::3])
    collisions = plant.GetCollisionGeometriesForBody(trunk)
    hips = geometry.p_BH
    _check_size(geometry, refuse)
    box: FloatArray = np.stack([hips.min(axis=0), hips.max(axis=0)])
    if collisions:
        box = bounding_box(inspector, collisions)
    boxes = outer_boxes(inspector, collisions) if collisions else box[None]
    return RobotModel(
        name=plant.GetModelInstanceName(instance),
        url=url,
        trunk=trunk.name(),
        geometry=geometry,
        joint_names=tuple(j.name() for j in joints),
        q_lower=read_only(lower),
        q_upper=read_only(upper),
        effort=read_only(np.array([a.effort_limit() for a in actuators])),
        speed=read_only(np.array([j.velocity_upper_limit() for j in joints])),
        mass=float(plant.CalcTotalMass(context)),
        trunk_mass=float(trunk.default_mass()),
        trunk_com=read_only(trunk.default_com()),
        link_mass=read_only(np.array([b.default_mass() for b in bodies]).reshape(4, 3)),
        link_com=read_only(np.array([b.default_com() for b in bodies]).reshape(4, 3, 3)),
        foot_radius=float(radii.max()),
        foot_smaller=read_only(smaller),
        foot_friction=read_only(
            np.array(
                [
                    leg.friction
                    if states_friction(frictional, chain[2].child_body().name(), leg.foot)
                    else np.nan
                    for chain, leg in zip(chains, legs, strict=True)
                ]
            )
        ),
        foot_geometry=tuple(leg.foot for leg in legs),
        shank_offsets=read_only(0.5 * (back + ahead)),
        shank_radii=read_only(0.5 * (ahead - back)),
        shank_profile=profile,
        thigh_points=read_only(thigh_points),
        thigh_radii=read_only(thigh_radii),
        trunk_box=read_only(box),
        thigh_stops=read_stops(plant, inspector, trunk, thighs),
        trunk_boxes=read_only(boxes),
    )


def _check_size(geometry: LegGeometry, refuse: Refuse) -> None:
    """Refuses lengths that no walking robot has: they are in another unit than metres."""
    for name, lengths in (
        ("thighs and shanks", np.stack([geometry.thigh, geometry.shank])),
        ("places of the hips", geometry.p_BH),
        ("offsets of the hips", geometry.offset),
    ):
        most = float(np.max(np.abs(lengths)))
        if most > LARGEST:
            remedy = f"lengths must be in metres, at most {LARGEST:g} each: are these in mm?"
            raise refuse(name, f"up to {most:.4g} m", remedy)


def _geometry(legs: list[LegRead], smaller: FloatArray, knees: FloatArray) -> LegGeometry:
    """The legs' kinematics.

    Args:
        legs: The legs in the order of LEGS.
        smaller: Difference of the largest foot's radius and each foot's (4,) [m].
        knees: Middles of the knees' ranges (4,) [rad].
    """
    p_HP = np.array([leg.p_HP for leg in legs])
    return LegGeometry(
        p_BH=read_only(np.array([leg.p_BH for leg in legs])),
        offset=read_only(p_HP[:, 1].copy()),
        thigh=read_only(np.array([leg.thigh for leg in legs])),
        # To the middle of a ball that holds this foot, touches its end and is as thick as the
        # thickest: where feet meet the ground then follows from one radius.
        shank=read_only(np.array([leg.shank for leg in legs]) - smaller),
        knee_sign=read_only(np.sign(knees)),
        raised=read_only(p_HP[:, 2].copy()),
    )


def _actuators(
    plant: MultibodyPlant,
    instance: ModelInstanceIndex,
    joints: list[RevoluteJoint],
    refuse: Refuse,
) -> list[JointActuator]:
    """Each joint's actuator; refuses joints without one."""
    actuators = {
        plant.get_joint_actuator(i).joint().name(): plant.get_joint_actuator(i)
        for i in plant.GetJointActuatorIndices(instance)
    }
    missing = [j.name() for j in joints if j.name() not in actuators]
    if missing:
        raise refuse("transmission", missing, "these joints have no actuator")
    return [actuators[j.name()] for j in joints]


def joint_damping(plant: MultibodyPlant, robot: RobotModel) -> FloatArray:
    """Damping of the legs' joints (12,), leg by leg [Nm s/rad]: no part of a plant's bias term."""
    return np.array([plant.GetJointByName(name).default_damping() for name in robot.joint_names])
