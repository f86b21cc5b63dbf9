"""A kinematic replay: plans as if they were a run, without physics; geometry says what touches."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder

from drake_quad.common import FloatArray
from drake_quad.control.ports import CATCH_SIZE, GaitPhase, swing_legs
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.runs.planned_columns import plan_margin
from drake_quad.systems.contact_monitor import find_feet
from drake_quad.terrain.course import Course
from drake_quad.terrain.drake_geometry import AddCourse

TOUCH = 1e-6  # [m]: shapes that meet with less than this are side by side


def kinematic_logs(
    robot: RobotModel,
    layout: StateLayout,
    plans: Sequence[MotionPlan],
    period: float,
    *,
    massless_legs: bool,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """The logs of a kinematic replay: the plans as they are, no forces, contacts as planned.

    Args:
        robot: The robot.
        layout: Places of its joints in the state.
        plans: Plans to replay.
        period: Time between samples [s].
        massless_legs: Whether margins are the body's centre's (the paper's), or the whole
            robot's centre of mass's.

    Returns:
        times (N,) and the logs, as a simulation's loggers have them.
    """
    times, rows, samples = [], [], []
    start = 0.0
    for index, plan in enumerate(plans):
        count = round(plan.duration / period)
        t = period * np.arange(count + (index == len(plans) - 1), dtype=np.float64)
        samples.append(evaluate(robot, plan, t))
        phase = np.zeros((len(t), len(GaitPhase)))
        phase[:, GaitPhase.TASK], phase[:, GaitPhase.TIME] = index, t
        phase[:, GaitPhase.RATE] = 1.0
        phase[:, GaitPhase.SEGMENT] = [plan.segment_index(x) for x in t]
        for part in plan.contacts.phases:
            if part.steps:
                mine = (t >= part.start) & (t < part.end)
                phase[mine, GaitPhase.SWING_LEG] = swing_legs([step.leg for step in part.steps])
                phase[mine, GaitPhase.SWING_PHASE] = (t[mine] - part.start) / (
                    part.end - part.start
                )
        times.append(start + t)
        rows.append(phase)
        start += count * period
    t, phase = np.concatenate(times), np.concatenate(rows)
    n = len(t)
    body, rate = (np.concatenate([s.body[:, k] for s in samples]) for k in range(2))
    feet = np.concatenate([s.feet for s in samples])
    standing = np.concatenate([s.standing for s in samples])
    com = np.concatenate([s.com for s in samples])
    margin = np.concatenate([plan_margin(s, massless_legs=massless_legs) for s in samples])
    state = np.zeros((n, layout.size))
    half_yaw, half_pitch = 0.5 * body[:, 4], 0.5 * body[:, 3]
    cy, sy, cp, sp = np.cos(half_yaw), np.sin(half_yaw), np.cos(half_pitch), np.sin(half_pitch)
    state[:, layout.q_base : layout.q_base + 4] = np.stack(
        [cy * cp, -sy * sp, cy * sp, sy * cp], axis=-1
    )
    state[:, layout.q_base + 4 : layout.q_base + 7] = body[:, :3]
    # Yaw turns about W's z, pitch about the y that yaw has turned.
    sin_yaw, cos_yaw = np.sin(body[:, 4]), np.cos(body[:, 4])
    state[:, layout.v_base : layout.v_base + 3] = np.stack(
        [-sin_yaw * rate[:, 3], cos_yaw * rate[:, 3], rate[:, 4]], axis=-1
    )
    state[:, layout.v_base + 3 : layout.v_base + 6] = rate[:, :3]
    q = np.concatenate([s.q for s in samples]).reshape(n, 12)
    state[:, layout.q_joints] = q
    if n > 1:  # a single sample has no speed
        state[:, layout.v_joints] = np.gradient(q, period, axis=0)
    nan = np.full((n, 1), np.nan)
    contact = feet.copy()
    contact[..., 2] -= robot.foot_radius
    return t, {
        "state": state,
        "torque": np.tile(nan, 12),
        "gait_phase": phase,
        "standing": standing.astype(float),
        "body_desired": body,
        "feet_desired": feet.reshape(n, 12),
        "bearing": standing.astype(float),
        "force": np.tile(nan, 12),
        "contact_position": contact.reshape(n, 12),
        "slip_speed": np.zeros((n, 4)),
        "nonfoot": np.tile([0.0, np.nan], (n, 1)),  # how many, the replay asks of geometry
        "margin": margin[:, None],
        "zmp_margin": nan,
        "com": com,
        "push_force": np.zeros((n, 3)),
        "catch": np.zeros((n, CATCH_SIZE)),
    }


@dataclass(frozen=True, eq=False)
class Touches:
    """Overlaps of a robot's collision geometry with a course and with itself.

    Attributes:
        count: (N,) number of overlaps in each sample that are not a foot on the course.
        depth: (N,) depth of the deepest of these [m], 0 where there is none.
        foot_depth: (N, 4) depth of each foot in the course [m].
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
        course: Course that it moves on.
        times: (N,) times [s].
        positions: (N, nq) positions of a plant that holds the robot alone.
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
