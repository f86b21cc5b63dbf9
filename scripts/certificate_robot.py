"""Compares a certificate's robot with a URDF as Drake's parser reads it; nothing of drake_quad.

The file has to be in the normal form: abduction about x, hip pitch and knee about y, angle zero
straight down, feet that are spheres. For `check_certificate.py --robot`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from certificate_reading import require
from numpy.typing import NDArray
from pydrake.geometry import Box, Capsule, Cylinder, SceneGraph, SceneGraphInspector, Sphere
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

Floats = NDArray[np.float64]
Record = dict[str, Any]

SAME = 1e-9  # relative, or of 1: rounding on the way
# Of an axis of unit length: 5 degrees, by which that of an imported robot may be out of square.
SKEW = 0.09


def compare_robot(record: Record, path: str | Path) -> None:
    """Refuses a record whose robot is not the one in the file."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    try:
        Parser(plant).AddModels(str(path))
    except RuntimeError as error:
        require(False, f"{path}: {str(error).splitlines()[0]}")
    plant.Finalize()
    robot = record["robot"]
    found = read_urdf(plant, scene_graph.model_inspector(), robot)
    for name, value in found.items():
        here, there = np.array(robot[name], dtype=float), np.array(value, dtype=float)
        known = np.all(np.isfinite(here)) and np.all(np.isfinite(there))
        require(known, f"{name} without an end are none that a record can have: {path}")
        near = np.abs(here - there) <= SAME * np.maximum(1.0, np.abs(there))
        same = here.shape == there.shape and np.all(near)
        require(same, f"the robot's {name} are not those of {path}")


def read_urdf(plant: MultibodyPlant, inspector: SceneGraphInspector, robot: Record) -> Record:
    """The numbers of a parsed robot that a certificate has too, by its names of them."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, default_positions(plant))
    trunk = plant.GetBodyByName(robot["trunk"])
    joints = [plant.GetJointByName(name) for name in robot["joints"]]
    require_chains(plant, trunk, joints)
    plane = [j.frame_on_parent().GetFixedPoseInBodyFrame().translation() for j in joints]
    hips, axles, knees = (np.array(plane[k::3]) for k in range(3))
    require(np.allclose(axles[:, 0], 0.0) and np.allclose(knees[:, :2], 0.0), "the normal form")
    links = [rigid(plant, context, joint.child_body()) for joint in joints]
    feet = [foot_of(plant, inspector, joint.child_body()) for joint in joints[2::3]]
    thickest = max(radius for _, radius in feet)
    efforts = {
        plant.get_joint_actuator(i).joint().name(): plant.get_joint_actuator(i).effort_limit()
        for i in plant.GetJointActuatorIndices()
    }
    require(set(robot["joints"]) <= set(efforts), "joints without actuators have no torque limit")
    mass, com = rigid(plant, context, trunk)
    whole = mass + sum(m for m, _ in links)
    require(
        abs(whole - plant.CalcTotalMass(context)) <= SAME * whole,
        "masses that neither the trunk nor the legs have",
    )
    more = {"trunk_box": box_of(plant, inspector, trunk)} if "trunk_box" in robot else {}
    return more | {
        "hips": hips,
        "offsets": axles[:, 1],
        "raised": axles[:, 2],
        "thighs": -knees[:, 2],
        # A thinner foot counts as a ball as thick as the thickest that holds it and touches its
        # end.
        "shanks": [-p[2] - (thickest - radius) for p, radius in feet],
        "foot_radius": thickest,
        "q_lower": [j.position_lower_limits()[0] for j in joints],
        "q_upper": [j.position_upper_limits()[0] for j in joints],
        "efforts": [efforts[name] for name in robot["joints"]],
        "trunk_mass": mass,
        "trunk_com": com,
        "link_masses": np.reshape([m for m, _ in links], (4, 3)),
        "link_coms": np.reshape([c for _, c in links], (4, 3, 3)),
    }


def require_chains(plant: MultibodyPlant, trunk: RigidBody, joints: list[Joint]) -> None:
    """Refuses a record that names another trunk than the one that floats, or other legs than four.

    Each leg is a chain from the trunk: abduction, hip pitch, knee. At angle zero all of its frames
    are turned as the trunk's.
    """
    require(plant.GetFloatingBaseBodies() == {trunk.index()}, "the trunk is what floats")
    require(len(joints) == 12 and len({j.index() for j in joints}) == 12, "twelve joints")
    for k, joint in enumerate(joints):
        parent = trunk if k % 3 == 0 else joints[k - 1].child_body()
        require(joint.parent_body().index() == parent.index(), "legs are chains from the trunk")
        require(isinstance(joint, RevoluteJoint), "joints that turn")
        axis = np.array([1.0, 0.0, 0.0] if k % 3 == 0 else [0.0, 1.0, 0.0])
        off = float(np.linalg.norm(joint.revolute_axis() - axis))
        require(off <= SKEW, "axes: abduction about x, hip pitch and knee about y")
        for frame in (joint.frame_on_parent(), joint.frame_on_child()):
            turned = frame.GetFixedPoseInBodyFrame().rotation().matrix() - np.eye(3)
            require(np.abs(turned).max() <= SAME, "frames turned as the trunk's at angle zero")
        at = joint.frame_on_child().GetFixedPoseInBodyFrame().translation()
        require(np.abs(at).max() <= SAME, "links whose frames are at their joints")


def box_of(plant: MultibodyPlant, inspector: SceneGraphInspector, trunk: RigidBody) -> Floats:
    """Least and greatest coordinates of the boxes around a body's collision geometries (2, 3)."""
    corners = []
    for g in plant.GetCollisionGeometriesForBody(trunk):
        shape = inspector.GetShape(g)
        require(isinstance(shape, Box | Sphere | Cylinder | Capsule), "a trunk of simple shapes")
        if isinstance(shape, Box):
            half = 0.5 * np.array(shape.size())
        else:
            radius = shape.radius()
            ends = radius if isinstance(shape, Capsule | Sphere) else 0.0
            length = 0.0 if isinstance(shape, Sphere) else shape.length()
            half = np.array([radius, radius, 0.5 * length + ends])
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        corners += [inspector.GetPoseInFrame(g).multiply(s * half) for s in signs]
    require(corners, "a trunk without collision geometry has no box of its own")
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])


def default_positions(plant: MultibodyPlant) -> Floats:
    """All joints at zero, the base upright at W's origin."""
    q = np.zeros(plant.num_positions())
    for index in plant.GetFloatingBaseBodies():
        q[plant.get_body(index).floating_positions_start()] = 1.0
    return q


def rigid(plant: MultibodyPlant, context: Context, body: RigidBody) -> tuple[float, Floats]:
    """Mass of a body and all that is welded to it [kg], and its centre in the body's frame [m]."""
    parts = plant.GetBodiesWeldedTo(body)
    mass = sum(b.default_mass() for b in parts)
    moment = np.zeros(3)
    for b in parts:
        X = plant.CalcRelativeTransform(context, body.body_frame(), b.body_frame())
        moment += b.default_mass() * X.multiply(b.default_com())
    return mass, moment / mass if mass > 0.0 else moment


def foot_of(
    plant: MultibodyPlant, inspector: SceneGraphInspector, shank: RigidBody
) -> tuple[Floats, float]:
    """Centre in the shank's frame and radius of the lowest sphere of a shank and what is on it."""
    context = plant.CreateDefaultContext()
    found = []
    for b in plant.GetBodiesWeldedTo(shank):
        X = plant.CalcRelativeTransform(context, shank.body_frame(), b.body_frame())
        for g in plant.GetCollisionGeometriesForBody(b):
            shape = inspector.GetShape(g)
            if isinstance(shape, Sphere):
                found.append(
                    (X.multiply(inspector.GetPoseInFrame(g).translation()), shape.radius())
                )
    require(found, "a foot is a sphere")
    return min(found, key=lambda f: f[0][2])
