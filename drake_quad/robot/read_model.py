"""Reads a RobotModel from a plant that holds a robot in normal form, and says what does not fit.

In normal form a leg has three revolute joints about x, y and y, hangs straight down at angle zero
with its links' frames parallel to the trunk's, and ends in a sphere.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RevoluteJoint, RigidBody

from drake_quad.errors import InputError
from drake_quad.gait.legs import SHORT_NAMES, FloatArray, read_only
from drake_quad.robot.leg_kinematics import LegGeometry
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import bounding_box, outer_boxes, read_sides
from drake_quad.robot.thigh_outline import read_thighs


@dataclass(frozen=True)
class Tolerance:
    """How far from normal form a file may be and be read as if it were in it.

    Attributes:
        axis: Of a joint's axis, as a difference of unit vectors.
        offset: Of a point from where it should be [m].
    """

    axis: float
    offset: float


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
) -> RobotModel:
    """Reads the robot of a finalized plant.

    Which leg is which follows from where the hips are, not from names.

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
    trunk = plant.get_body(bases[0])
    chains = _leg_chains(plant, trunk)
    if len(chains) != 4 or any(len(chain) != 3 for chain in chains):
        raise refuse(
            "robot.model",
            [len(chain) for chain in chains],
            "joints in each leg; a robot with four legs of three revolute joints is needed",
        )
    context = plant.CreateDefaultContext()
    hips = [chain[0].frame_on_parent().CalcPose(context, trunk.body_frame()) for chain in chains]
    quadrants = [(hip.translation()[0] <= 0, hip.translation()[1] <= 0) for hip in hips]
    wanted = [(False, False), (False, True), (True, False), (True, True)]
    if sorted(quadrants) != sorted(wanted):
        raise refuse("robot.model", quadrants, "(rear, right) of the hips; one leg each is needed")
    chains = [chains[quadrants.index(corner)] for corner in wanted]
    for chain, leg in zip(chains, SHORT_NAMES, strict=True):
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
                "limits; a knee must bend more to one side, which tells the leg's way to fold",
            )

    inspector = scene_graph.model_inspector()
    rows: dict[str, list[object]] = {k: [] for k in ("hip", "pitch", "l1", "l2", "foot", "name")}
    radii, sides = [], []
    for chain, leg in zip(chains, SHORT_NAMES, strict=True):
        shank = chain[2].child_body()
        feet = [
            (inspector.GetPoseInFrame(g).translation(), inspector.GetShape(g).radius(), g)
            for g in plant.GetCollisionGeometriesForBody(shank)
            if isinstance(inspector.GetShape(g), Sphere)
        ]
        if not feet:
            raise refuse(f"{leg} link {shank.name()}", "no sphere", "its foot must be a sphere")
        foot = max(feet, key=lambda f: float(np.linalg.norm(f[0])))
        to_hip = chain[1].frame_on_parent().GetFixedPoseInBodyFrame().translation()
        to_knee = chain[2].frame_on_parent().GetFixedPoseInBodyFrame().translation()
        aside = max(abs(to_hip[0]), *abs(to_knee[:2]), *abs(foot[0][:2]))
        if aside > tolerance.offset or to_knee[2] >= 0.0 or foot[0][2] >= 0.0:
            raise refuse(
                f"{leg} leg",
                [to_hip.tolist(), to_knee.tolist(), foot[0].tolist()],
                "offsets; from hip to hip pitch none along x, and links along -z, are needed",
            )
        rows["hip"].append(chain[0].frame_on_parent().GetFixedPoseInBodyFrame().translation())
        rows["pitch"].append(to_hip)
        rows["l1"].append(-to_knee[2])
        rows["l2"].append(-foot[0][2])
        rows["name"].append(inspector.GetName(foot[2]))
        radii.append(foot[1])
        name = str(rows["name"][-1])
        links = (chain[1].child_body(), shank)
        lengths = (float(-to_knee[2]), float(-foot[0][2]))
        sides.append(read_sides(plant, inspector, links, name, lengths))
    thighs = [chain[1].child_body() for chain in chains]
    thigh_points, thigh_radii = read_thighs(plant, inspector, thighs)
    joints = [joint for chain in chains for joint in chain]
    lower = np.array([j.position_lower_limit() for j in joints])
    upper = np.array([j.position_upper_limit() for j in joints])
    knees = 0.5 * (lower + upper)[2::3]
    actuators = {
        plant.get_joint_actuator(i).joint().name(): plant.get_joint_actuator(i)
        for i in plant.GetJointActuatorIndices(instance)
    }
    missing = [j.name() for j in joints if j.name() not in actuators]
    if missing:
        raise refuse("transmission", missing, "these joints have no actuator")
    bodies = [joint.child_body() for joint in joints]
    back, ahead = np.stack(sides, axis=1)
    smaller = max(radii) - np.array(radii)
    p_BH: FloatArray = np.array(rows["hip"], dtype=float)
    p_HP: FloatArray = np.array(rows["pitch"], dtype=float)
    collisions = plant.GetCollisionGeometriesForBody(trunk)
    box: FloatArray = np.stack([p_BH.min(axis=0), p_BH.max(axis=0)])
    if collisions:
        box = bounding_box(inspector, collisions)
    boxes = outer_boxes(inspector, collisions) if collisions else box[None]
    return RobotModel(
        name=plant.GetModelInstanceName(instance),
        url=url,
        trunk=trunk.name(),
        geometry=LegGeometry(
            p_BH=read_only(np.array(rows["hip"], dtype=float)),
            offset=read_only(p_HP[:, 1].copy()),
            thigh=read_only(np.array(rows["l1"], dtype=float)),
            # To the middle of a ball that holds this foot, touches its end and is as thick as the
            # thickest: whatever asks where feet meet the ground then needs one radius.
            shank=read_only(np.array(rows["l2"], dtype=float) - smaller),
            knee_sign=read_only(np.sign(knees)),
            raised=read_only(p_HP[:, 2].copy()),
        ),
        joint_names=tuple(j.name() for j in joints),
        q_lower=read_only(lower),
        q_upper=read_only(upper),
        effort=read_only(np.array([actuators[j.name()].effort_limit() for j in joints])),
        speed=read_only(np.array([j.velocity_upper_limit() for j in joints])),
        mass=float(plant.CalcTotalMass(context)),
        trunk_mass=float(trunk.default_mass()),
        trunk_com=read_only(trunk.default_com()),
        link_mass=read_only(np.array([b.default_mass() for b in bodies]).reshape(4, 3)),
        link_com=read_only(np.array([b.default_com() for b in bodies]).reshape(4, 3, 3)),
        foot_radius=float(max(radii)),
        foot_smaller=read_only(smaller),
        foot_geometry=tuple(str(n) for n in rows["name"]),
        shank_offsets=read_only(0.5 * (back + ahead)),
        shank_radii=read_only(0.5 * (ahead - back)),
        thigh_points=read_only(thigh_points),
        thigh_radii=read_only(thigh_radii),
        trunk_box=read_only(box),
        trunk_boxes=read_only(boxes),
    )


def _is_straight(joint: RevoluteJoint) -> bool:
    """Whether at angle zero the joint's child frame is its parent's, moved without a turn."""
    parent = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    child = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return bool(parent.rotation().IsNearlyIdentity(1e-6) and child.IsNearlyIdentity(1e-6))


def _leg_chains(plant: MultibodyPlant, trunk: RigidBody) -> list[list[RevoluteJoint]]:
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
