"""Makes contacts in a plant what a scenario says they are: their friction, and their model.

Drake combines the coefficients of two bodies that touch to 2 μ₁ μ₂ / (μ₁ + μ₂), which is μ where
both have μ. So robot and ground both get the scenario's coefficient; a foot whose file states one
of its own keeps that (`robot.model.contact_friction` is what comes of the two).
"""

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddRigidHydroelasticProperties,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
)
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_quad.robot.model import RobotModel

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
        scene_graph: The plant's.
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
        scene_graph: The plant's.
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
