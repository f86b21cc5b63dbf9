"""Room between a robot's shanks and the ground of a lane: of points, and of lines to nosings."""

from math import sqrt

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.box_distance import from_boxes
from drake_quad.planning.lane_distance import from_ground, from_nosings
from drake_quad.planning.motion_plan import rotations
from drake_quad.robot.leg_kinematics import calc_knees
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import ROOM_WORTH, SHANK_POINTS
from drake_quad.terrain import Lane

FAR = 0.1  # [m]: room beyond which nobody asks how much it is
# By which room at `shank_room`'s places is multiplied where it is weighed, see ROOM_WORTH.
WORTH = np.concatenate([ROOM_WORTH, ROOM_WORTH[1:]])


def shank_room(
    robot: RobotModel, lane: Lane, body: FloatArray, feet: FloatArray, q: FloatArray
) -> FloatArray:
    """Between knees and shanks and a lane's ground, negative inside (N, 4, 15) [m].

    At SHANK_POINTS, then between nosings and the seven lines that join these.

    Args:
        robot: The robot.
        lane: The lane.
        body: (N, 5) poses in W.
        feet: (N, 4, 3) in W [m].
        q: (N, 4, 3) the joints' angles there [rad].
    """
    R = rotations(body)
    knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
    across = np.einsum("nij,nlj->nli", R, knee_axes(q))
    middles = shank_middles(robot.shank_offsets, knees, feet, across)
    radii = robot.shank_radii
    lines = from_nosings(lane, middles) - np.minimum(radii[:, :-1], radii[:, 1:])
    return np.concatenate([from_ground(lane, middles) - radii, lines], axis=-1)


def trunk_room(
    robot: RobotModel, p_BF: FloatArray, q: FloatArray, *, enough: float = FAR
) -> FloatArray:
    """Between knees and shanks and the trunk's boxes, negative inside (N, 4, 15) [m].

    At SHANK_POINTS, then of the seven lines that join these.

    Args:
        robot: The robot.
        p_BF: (N, 4, 3) feet in B [m].
        q: (N, 4, 3) the joints' angles there [rad].
        enough: What is farther off [m] is told to be no nearer than that.
    """
    knees = calc_knees(robot.geometry, q)
    middles = shank_middles(robot.shank_offsets, knees, p_BF, knee_axes(q))
    rows = np.ascontiguousarray(middles.reshape(-1, *middles.shape[-2:]))
    radii = robot.shank_radii
    apart = from_boxes(rows, robot.trunk_boxes, enough + float(radii.max()))
    thick = np.concatenate([radii, np.minimum(radii[:, :-1], radii[:, 1:])], axis=1)
    return np.asarray(apart.reshape(*middles.shape[:-2], -1) - thick)


def shank_middles(
    offsets: FloatArray, knees: FloatArray, feet: FloatArray, across: FloatArray
) -> FloatArray:
    """The middles of all shanks' outlines at SHANK_POINTS (..., 4, 8, 3) [m].

    Args:
        offsets: How far ahead of the lines from knee to foot they are (4, 8) [m].
        knees: (..., 4, 3) [m].
        feet: (..., 4, 3) [m], in the same frame.
        across: Unit vectors of the knees' axes, to the left (..., 4, 3).
    """
    shape = knees.shape
    flat = [np.ascontiguousarray(p.reshape(-1, *shape[-2:])) for p in (knees, feet, across)]
    return _middles(offsets, *flat).reshape(*shape[:-1], len(SHANK_POINTS), 3)


@compiled
def _middles(
    offsets: FloatArray, knees: FloatArray, feet: FloatArray, across: FloatArray
) -> FloatArray:
    found = np.empty((*knees.shape[:2], len(SHANK_POINTS), 3))
    for n in range(found.shape[0]):
        for leg in range(found.shape[1]):
            p, y = knees[n, leg], across[n, leg]
            x0, x1, x2 = feet[n, leg, 0] - p[0], feet[n, leg, 1] - p[1], feet[n, leg, 2] - p[2]
            a0, a1, a2 = x1 * y[2] - x2 * y[1], x2 * y[0] - x0 * y[2], x0 * y[1] - x1 * y[0]
            length = sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            for k in range(len(SHANK_POINTS)):
                share, ahead = SHANK_POINTS[k], offsets[leg, k] / length
                found[n, leg, k, 0] = p[0] + share * x0 + ahead * a0
                found[n, leg, k, 1] = p[1] + share * x1 + ahead * a1
                found[n, leg, k, 2] = p[2] + share * x2 + ahead * a2
    return found


def knee_axes(q: FloatArray) -> FloatArray:
    """Unit vectors of the knees' axes in B (..., 4, 3), of the joints' angles (..., 4, 3) [rad]."""
    a = q[..., 0]
    return np.stack([np.zeros_like(a), np.cos(a), np.sin(a)], axis=-1)
