"""The course as geometry of a plant: what the feet touch, and how it looks."""

import math
import re

from pydrake.geometry import Box as BoxShape
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant

from drake_quad.terrain.course import Course

Colour = tuple[float, float, float, float]  # red, green, blue, opacity in [0, 1]

# Neighbouring treads differ and every nosing is dark, so that one can count the steps.
TREADS: tuple[Colour, Colour] = ((0.80, 0.77, 0.72, 1.0), (0.68, 0.65, 0.60, 1.0))
LEVEL: Colour = (0.56, 0.56, 0.55, 1.0)
NOSING: Colour = (0.24, 0.22, 0.20, 1.0)
NOSING_SIZE = 0.012  # [m] of the strip's cross section


def AddCourse(plant: MultibodyPlant, course: Course, *, friction: float) -> None:
    """Registers the course on the world body: its boxes, as collision and as picture.

    The nosings are picture alone: a strip let into the upper edge of each riser.

    Args:
        plant: Not yet finalized, and a source of a SceneGraph.
        course: In W.
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
        # Its top and its face stand 1 mm proud: flush, they would flicker with the tread's.
        centre = 0.5 * (ends[0] + ends[1]) - [0.0, 0.0, 0.5 * NOSING_SIZE - 0.001]
        plant.RegisterVisualGeometry(
            world,
            RigidTransform(RollPitchYaw(0.0, 0.0, yaw), centre),
            BoxShape(NOSING_SIZE, length, NOSING_SIZE),
            f"nosing_{k}",
            list(NOSING),
        )


def _colour_of(name: str) -> Colour:
    """The colour of a box by its name, as `terrain` gives it."""
    tread = re.search(r"_(?:tread|nose)_([1-9]\d*)$", name)
    return TREADS[int(tread[1]) % 2] if tread else LEVEL
