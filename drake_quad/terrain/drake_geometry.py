"""The course as geometry of a plant, and the contact between it and the feet.

Drake combines the coefficients of two bodies that touch to 2 μ₁ μ₂ / (μ₁ + μ₂), which is μ where
both have μ. So robot and ground both get the scenario's coefficient; a foot whose file states one
of its own keeps that (`robot.model.contact_friction` gives the combined coefficient).
"""

import math
import re

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddRigidHydroelasticProperties,
    Box as BoxShape,
    GeometryInstance,
    MakePhongIllustrationProperties,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course

Colour = tuple[float, float, float, float]  # red, green, blue, opacity in [0, 1]

# Neighbouring treads differ and every nosing is dark, so that one can count the steps.
TREADS: tuple[Colour, Colour] = ((0.80, 0.77, 0.72, 1.0), (0.68, 0.65, 0.60, 1.0))
LEVEL: Colour = (0.56, 0.56, 0.55, 1.0)
NOSING: Colour = (0.24, 0.22, 0.20, 1.0)
NOSING_SIZE = 0.012  # [m] of the strip's cross section


def AddCourse(plant: MultibodyPlant, course: Course, *, friction: float) -> None:
    """Registers the course on the world body: its boxes, as collision and as picture.

    The nosings are picture alone: a strip at the upper edge of each riser, for people to count
    steps by. Viewers show it; cameras in the simulation do not see it, for it stands out of the
    riser, and they would find each nosing nearer by that.

    Args:
        plant: Not yet finalized, and a source of a SceneGraph.
        course: The course, in W.
        friction: Coulomb's coefficient, static and dynamic.
    """
    material = CoulombFriction(friction, friction)
    world = plant.world_body()
    for box in course.boxes:
        X_WBox = RigidTransform(RollPitchYaw(0.0, box.pitch, box.yaw), box.centre)
        shape = BoxShape(*box.size)
        plant.RegisterCollisionGeometry(world, X_WBox, shape, box.name, material)
        plant.RegisterVisualGeometry(world, X_WBox, shape, box.name, list(_colour_of(box.name)))
    for k, ends in enumerate(course.nosings()):
        across = ends[1] - ends[0]
        length, yaw = math.hypot(*across), math.atan2(-across[0], across[1])
        # Its top stands 1 mm proud, its face 6 mm: flush, they would flicker with the tread's.
        centre = 0.5 * (ends[0] + ends[1]) - [0.0, 0.0, 0.5 * NOSING_SIZE - 0.001]
        strip = GeometryInstance(
            RigidTransform(RollPitchYaw(0.0, 0.0, yaw), centre),
            BoxShape(NOSING_SIZE, length, NOSING_SIZE),
            f"nosing_{k}",
        )
        strip.set_illustration_properties(MakePhongIllustrationProperties(list(NOSING)))
        plant.RegisterVisualGeometry(world, strip)


def _colour_of(name: str) -> Colour:
    """The colour of a box by its name, as `terrain` gives it."""
    tread = re.search(r"_(?:tread|nose)_([1-9]\d*)$", name)
    return TREADS[int(tread[1]) % 2] if tread else LEVEL


MATERIAL, FRICTION = "material", "coulomb_friction"  # Drake's names of the property
FOOT_MODULUS = 1e8  # [Pa] of compliant feet: hard rubber
FINENESS = 0.5  # length of an edge of a foot's mesh, of its radius


def SetContactFriction(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    instance: ModelInstanceIndex,
    robot: RobotModel,
    friction: float,
) -> None:
    """Gives the robot's collision geometries the ground's friction, but feet with one of their own.

    Args:
        plant: Holds the robot; finalized or not.
        scene_graph: Scene graph of the plant.
        instance: The robot in the plant.
        robot: The robot.
        friction: Coulomb's coefficient, static and dynamic.
    """
    inspector, source = scene_graph.model_inspector(), plant.get_source_id()
    own = {
        (plant.GetJointByName(joint, instance).child_body().index(), foot)
        for joint, foot, stated in zip(
            robot.joint_names[2::3], robot.foot_geometry, robot.foot_friction, strict=True
        )
        if not np.isnan(stated)
    }
    for body in plant.GetBodyIndices(instance):
        for geometry in plant.GetCollisionGeometriesForBody(plant.get_body(body)):
            if (body, inspector.GetName(geometry)) in own:
                continue
            properties = ProximityProperties(inspector.GetProximityProperties(geometry))
            properties.UpdateProperty(MATERIAL, FRICTION, CoulombFriction(friction, friction))
            scene_graph.AssignRole(source, geometry, properties, RoleAssign.kReplace)


def SetHydroelastic(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    instance: ModelInstanceIndex,
    robot: RobotModel,
) -> None:
    """Makes the feet compliant and the ground rigid, for hydroelastic contact between the two.

    All else keeps to point contact, which `hydroelastic_with_fallback` uses where a shape has no
    hydroelastic surface.

    Args:
        plant: Holds the robot and the course; finalized or not.
        scene_graph: Scene graph of the plant.
        instance: The robot in the plant.
        robot: The robot.
    """
    inspector, source = scene_graph.model_inspector(), plant.get_source_id()
    touching = dict.fromkeys(plant.GetCollisionGeometriesForBody(plant.world_body()), False)
    for joint, foot in zip(robot.joint_names[2::3], robot.foot_geometry, strict=True):
        shank = plant.GetJointByName(joint, instance).child_body()
        touching |= {
            geometry: True
            for geometry in plant.GetCollisionGeometriesForBody(shank)
            if inspector.GetName(geometry) == foot
        }
    for geometry, compliant in touching.items():
        properties = ProximityProperties(inspector.GetProximityProperties(geometry))
        if compliant:
            AddCompliantHydroelasticProperties(
                FINENESS * robot.foot_radius, FOOT_MODULUS, properties
            )
        else:
            AddRigidHydroelasticProperties(1.0, properties)  # boxes are not tessellated
        scene_graph.AssignRole(source, geometry, properties, RoleAssign.kReplace)
