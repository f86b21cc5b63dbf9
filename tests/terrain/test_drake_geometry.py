"""The course's picture: what viewers show and cameras in the simulation do not see."""

from pydrake.geometry import Role
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_quad.terrain.course import build_course
from drake_quad.terrain.drake_geometry import AddCourse
from drake_quad.terrain.elements import Element


def test_cameras_see_the_steps_and_not_the_strips_at_their_nosings() -> None:
    """Strips stand out of their risers, so that a camera would find each nosing too near.

    Viewers still show them, and every other surface stays as it is.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    stairs = Element(kind="stairs", going="up", rise=0.12, run=0.3, count=3)
    level = [Element(kind=kind, length=1.0) for kind in ("floor", "landing")]
    AddCourse(plant, build_course([level[0], stairs, level[1]]), friction=0.8)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    shapes = plant.GetVisualGeometriesForBody(plant.world_body())
    strips = [g for g in shapes if "nosing" in inspector.GetName(g)]
    solids = [g for g in shapes if g not in strips]
    assert len(strips) == 3 and len(solids) >= 4
    assert not any(inspector.GetPerceptionProperties(g) for g in strips)
    assert all(inspector.GetPerceptionProperties(g) for g in solids)
    assert all(inspector.GetIllustrationProperties(g) for g in shapes)
    assert inspector.NumGeometriesWithRole(Role.kPerception) == len(solids)
