"""A robot's nominal stance, its collision shapes in it, and what its feet can reach."""

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Role, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_kinematics import LegGeometry, calc_feet, calc_knees, solve_legs
from drake_quad.robot.load_robot import AddRobot
from drake_quad.robot.robot_model import RobotModel, calc_com

BENT = 0.75  # height of the hips in the stance, of the legs' length, if limits let them
ROUND = 24  # points on a circle


class InspectStance(NamedTuple):
    """A robot standing with its feet below its hips, told in B.

    Attributes:
        q: Joint angles, (4, 3) [rad].
        height: Of B above the ground [m].
        hips: (4, 3) [m].
        thighs: Where the hip pitch axes meet the legs' planes, (4, 3) [m].
        knees: (4, 3) [m].
        feet: Centres of the spheres, (4, 3) [m].
        com: The robot's centre of mass, (3,) [m].
    """

    q: FloatArray
    height: float
    hips: FloatArray
    thighs: FloatArray
    knees: FloatArray
    feet: FloatArray
    com: FloatArray


def stand(robot: RobotModel) -> InspectStance:
    """The stance with the feet below the hips at three quarters of the legs' length.

    Where a joint's limits do not allow that, it is the nearest height that they do; if none, as is.
    """
    g = robot.geometry
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    shares = np.linspace(0.3, 0.99, 70)
    shares = shares[np.argsort(np.abs(shares - BENT), kind="stable")]
    chosen = None
    for share in shares:
        feet = g.p_BH + g.p_HP - [0.0, 0.0, share * g.reach.min()]
        q, excess = solve_legs(g, feet)
        if chosen is None:
            chosen = q
        if excess.max() < 1e-9 and np.all((q >= lower) & (q <= upper)):
            chosen = q
            break
    assert chosen is not None
    feet = calc_feet(g, chosen)
    a = chosen[:, 0]
    across = np.stack(
        [
            0 * a,
            np.cos(a) * g.offset - np.sin(a) * g.raised,
            np.sin(a) * g.offset + np.cos(a) * g.raised,
        ],
        axis=-1,
    )
    return InspectStance(
        q=chosen,
        height=float(robot.foot_radius - feet[:, 2].min()),
        hips=g.p_BH,
        thighs=g.p_BH + across,
        knees=calc_knees(g, chosen),
        feet=feet,
        com=calc_com(robot, chosen),
    )


def collision_points(robot: RobotModel, q: FloatArray) -> list[tuple[str, FloatArray]]:
    """Of every collision shape its link's name and points whose hull it is, (n, 3) in B [m].

    Args:
        robot: As loaded.
        q: Joint angles, (4, 3) [rad].
    """
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, robot.url)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for name, angle in zip(robot.joint_names, q.reshape(12), strict=True):
        plant.GetJointByName(name).set_angle(context, angle)
    B = plant.GetBodyByName(robot.trunk).body_frame()
    inspector = scene_graph.model_inspector()
    found = []
    for index in plant.GetBodyIndices(plant.GetBodyByName(robot.trunk).model_instance()):
        body = plant.get_body(index)
        X_BL = body.body_frame().CalcPose(context, B)
        frame = plant.GetBodyFrameIdOrThrow(index)
        for geometry in inspector.GetGeometries(frame, Role.kProximity):
            points = _surface_points(inspector.GetShape(geometry))
            X = X_BL @ inspector.GetPoseInFrame(geometry)
            found.append((str(body.name()), np.asarray((X @ points.T).T)))
    return found


def reachable(
    geometry: LegGeometry, leg: int, lower: FloatArray, upper: FloatArray, points: FloatArray
) -> FloatArray:
    """Whether one leg's foot can be at each point within its limits, (n,) of 0 and 1.

    Args:
        geometry: The legs'.
        leg: Which, 0 to 3.
        lower: Limits, (3,) [rad].
        upper: Limits, (3,) [rad].
        points: (n, 3) in B [m].
    """
    feet = np.repeat(points[:, None, :], 4, axis=1)
    q, excess = solve_legs(geometry, feet)
    mine = q[:, leg]
    whole = 2.0 * np.pi
    within = [(np.mod(mine[:, k] - lower[k], whole) <= upper[k] - lower[k]) for k in range(3)]
    return np.asarray((excess[:, leg] < 1e-9) & within[0] & within[1] & within[2], dtype=float)


def _surface_points(shape: object) -> FloatArray:
    """Points whose hull is the shape, or very nearly, (n, 3) in its own frame [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    ball = np.concatenate(
        [np.cos(t) * circle + [0.0, 0.0, np.sin(t)] for t in np.linspace(-1.5, 1.5, 13)]
    )
    up = np.array([0.0, 0.0, 1.0])
    if isinstance(shape, Sphere):
        return shape.radius() * ball
    if isinstance(shape, Ellipsoid):
        return ball * [shape.a(), shape.b(), shape.c()]
    if isinstance(shape, (Capsule, Cylinder)):
        end = shape.radius() * (ball if isinstance(shape, Capsule) else circle)
        half = 0.5 * shape.length() * up
        return np.concatenate([end + half, end - half])
    if isinstance(shape, Box):
        corners = np.array(np.meshgrid(*3 * [[-0.5, 0.5]])).reshape(3, -1).T
        return np.asarray(corners * np.array(shape.size()))
    hull = shape.GetConvexHull()  # type: ignore[attr-defined]
    return np.array([hull.vertex(i) for i in range(hull.num_vertices())])
