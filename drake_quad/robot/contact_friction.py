"""Makes the friction of contacts in a plant what a scenario says it is.

Drake combines the coefficients of two bodies that touch to 2 μ₁ μ₂ / (μ₁ + μ₂), which is μ where
both have μ. So robot and ground both get the scenario's coefficient; a foot whose file states one
of its own keeps that (`robot_model.contact_friction` is what comes of the two).
"""

import numpy as np
from pydrake.geometry import ProximityProperties, RoleAssign, SceneGraph
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_quad.robot.robot_model import RobotModel

MATERIAL, FRICTION = "material", "coulomb_friction"  # Drake's names of the property


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
