"""Room between a robot's thighs and the ground of a lane."""

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.lane_distance import from_ground, from_nosings
from drake_quad.planning.motion_plan import rotations
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Lane


def thigh_room(robot: RobotModel, lane: Lane, body: FloatArray, q: FloatArray) -> FloatArray:
    """Between thighs and a lane's ground, negative inside (N, 4) [m].

    Args:
        robot: The robot.
        lane: The lane.
        body: (N, 5) poses in W.
        q: (N, 4, 3) the joints' angles there [rad].
    """
    g, points, radii = robot.geometry, robot.thigh_points, robot.thigh_radii
    a, h = q[..., 0, None, None], q[..., 1, None, None]
    x, y, z = (points[None, ..., k] for k in range(3))
    turned_x = np.cos(h) * x + np.sin(h) * z
    down = np.cos(h) * z - np.sin(h) * x + g.raised[:, None, None]
    across = g.offset[:, None, None] + y
    p_B = (
        np.stack(
            [
                turned_x,
                np.cos(a) * across - np.sin(a) * down,
                np.sin(a) * across + np.cos(a) * down,
            ],
            axis=-1,
        )
        + g.p_BH[:, None, None]
    )
    p_W = body[:, None, None, None, :3] + np.einsum("nij,nlkmj->nlkmi", rotations(body), p_B)
    nearest = np.minimum(from_ground(lane, p_W).min(axis=-1), from_nosings(lane, p_W).min(axis=-1))
    return np.asarray((nearest - radii).min(axis=-1))
