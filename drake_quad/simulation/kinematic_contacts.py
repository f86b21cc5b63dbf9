"""What a robot touches along a motion, by its geometry alone: for a kinematic replay."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import make_layout
from drake_quad.systems.contact_monitor import find_feet
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse

TOUCH = 1e-6  # [m]: shapes that meet with less than this are side by side


@dataclass(frozen=True, eq=False)
class Touches:
    """Overlaps of a robot's collision geometry with a course and with itself.

    Attributes:
        count: (N,) how many overlaps that are not a foot on the course each sample has.
        depth: (N,) the depth of the deepest of them [m], 0 where there is none.
        foot_depth: (N, 4) how deep each foot is in the course [m].
        deepest: The deepest overlap of each pair of shapes, the deepest first: `part` of the
            robot, what it is `inside` of, `depth` [m] and `time` [s].
    """

    count: FloatArray
    depth: FloatArray
    foot_depth: FloatArray
    deepest: tuple[dict[str, Any], ...]


def find_touches(
    robot: RobotModel, course: Course, times: FloatArray, positions: FloatArray
) -> Touches:
    """Asks Drake's geometry for every overlap along a motion, forces aside.

    Overlaps that the robot's own file filters out, and those of adjacent links, do not count.

    Args:
        robot: The robot.
        course: What it moves on.
        times: (N,) [s].
        positions: (N, nq) of a plant that holds the robot alone.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.001), builder)
    AddRobot(plant, robot.url)
    AddCourse(plant, course, friction=1.0)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    query = scene_graph.get_query_output_port()
    scene_context = scene_graph.GetMyContextFromRoot(context)
    inspector = scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    feet = find_feet(plant, robot, names)
    ground = set(plant.GetCollisionGeometriesForBody(plant.world_body()))
    n = make_layout(plant, robot).num_positions

    count, depth = np.zeros(len(times)), np.zeros(len(times))
    foot_depth = np.zeros((len(times), 4))
    worst: dict[tuple[str, str], tuple[float, float]] = {}
    for k, (t, q) in enumerate(zip(times.tolist(), positions[:, :n], strict=True)):
        plant.SetPositions(plant_context, q)
        for pair in query.Eval(scene_context).ComputePointPairPenetration():
            a, b = pair.id_A, pair.id_B
            if a in ground:
                a, b = b, a
            if a in feet and b in ground:
                foot_depth[k, feet[a]] = max(foot_depth[k, feet[a]], pair.depth)
            elif pair.depth > TOUCH:
                count[k] += 1.0
                depth[k] = max(depth[k], pair.depth)
                key = names[a], names[b]
                worst[key] = max(worst.get(key, (0.0, 0.0)), (pair.depth, t))
    found = sorted(worst.items(), key=lambda item: -item[1][0])
    deepest = tuple(
        {"part": _short(part), "inside": _short(of), "depth": d, "time": t}
        for (part, of), (d, t) in found
    )
    return Touches(count, depth, foot_depth, deepest)


def _short(name: str) -> str:
    """A geometry's name without its model's."""
    return name.rpartition("::")[2]
