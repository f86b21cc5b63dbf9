"""Reads a RobotModel from a plant that holds a robot in normal form, and says what does not fit."""

from collections.abc import Set

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator, ModelInstanceIndex, RevoluteJoint

from drake_quad.errors import InputError
from drake_quad.gait.legs import SHORT_NAMES, FloatArray, read_only
from drake_quad.robot.leg_kinematics import LegGeometry
from drake_quad.robot.model_legs import LegRead, Refuse, Tolerance, find_legs, read_leg
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import bounding_box, outer_boxes
from drake_quad.robot.thigh_outline import read_thighs

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
    frictional: Set[str] = frozenset(),
) -> RobotModel:
    """Reads the robot of a finalized plant; see `model_legs.py` for normal form.

    Args:
        plant: Holds the robot.
        scene_graph: Holds its geometry.
        instance: The robot in the plant.
        url: Where it was read from.
        tolerance: How far from normal form it may be.
        frictional: Links whose collision shapes state a friction in the file: of the others the
            plant has Drake's default.

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
    chains = find_legs(plant, context, trunk, tolerance, refuse)
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
    thigh_points, thigh_radii = read_thighs(
        plant, inspector, [chain[1].child_body() for chain in chains]
    )
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
                    leg.friction if chain[2].child_body().name() in frictional else np.nan
                    for chain, leg in zip(chains, legs, strict=True)
                ]
            )
        ),
        foot_geometry=tuple(leg.foot for leg in legs),
        shank_offsets=read_only(0.5 * (back + ahead)),
        shank_radii=read_only(0.5 * (ahead - back)),
        thigh_points=read_only(thigh_points),
        thigh_radii=read_only(thigh_radii),
        trunk_box=read_only(box),
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
        legs: In the order of LEGS.
        smaller: By how much each foot's radius is less than the largest (4,) [m].
        knees: The middles of what the knees may bend (4,) [rad].
    """
    p_HP = np.array([leg.p_HP for leg in legs])
    return LegGeometry(
        p_BH=read_only(np.array([leg.p_BH for leg in legs])),
        offset=read_only(p_HP[:, 1].copy()),
        thigh=read_only(np.array([leg.thigh for leg in legs])),
        # To the middle of a ball that holds this foot, touches its end and is as thick as the
        # thickest: whatever asks where feet meet the ground then needs one radius.
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
