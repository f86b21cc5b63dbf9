"""Draws a robot from its right on a lane at one moment of a plan: trunk, legs, shanks, ground."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from drake_quad.design.shape import SHANK_POINTS, Shape
from drake_quad.gait.legs import LEGS, FloatArray
from drake_quad.planning.motion_plan import PlanSamples, rotations
from drake_quad.robot.leg_kinematics import calc_knees
from drake_quad.robot.robot_model import RobotModel
from drake_quad.terrain import Lane

FRONT, REAR = "#c8641b", "#2b63a8"  # as the legs of the paper's robot
INK, TRUNK, GROUND, EDGE = "#333333", "#dcdcdc", "#d8d0c4", "#8f8474"
FAR_FIRST = (0, 2, 1, 3)  # from its right the left legs are behind


def draw_moment(
    ax: Axes, robot: RobotModel, shape: Shape, lane: Lane, samples: PlanSamples, k: int
) -> None:
    """Draws the robot at sample `k`, in the lane's (s, z) [m]."""
    body, feet, q = samples.body[k, 0], samples.feet[k], samples.q[k]
    R = rotations(body)

    def flat(p_B: FloatArray) -> FloatArray:
        """Points (..., 3) in B as (..., 2) in the picture."""
        return _flat(lane, body[:3] + np.asarray(p_B) @ R.T)

    knees_B = calc_knees(robot.geometry, q)
    side = robot.geometry.p_HP
    hips, knees, soles = flat(robot.geometry.p_BH + side), flat(knees_B), _flat(lane, feet)
    size = float(np.max(robot.geometry.reach))
    middle = _flat(lane, body[None, :3])[0]
    half = 0.5 * float(shape.trunk_upper[0] - shape.trunk_lower[0]) + 0.55 * size
    _ground(ax, lane, middle[0] - half, middle[0] + half)
    low, high = shape.trunk_lower, shape.trunk_upper
    corners = np.array(
        [[low[0], 0, low[2]], [high[0], 0, low[2]], [high[0], 0, high[2]], [low[0], 0, high[2]]]
    )
    ax.add_patch(Polygon(flat(corners), fc=TRUNK, ec=INK, lw=1.0, alpha=0.85, zorder=4))
    for row in FAR_FIRST:
        near = row in FAR_FIRST[-2:]
        colour = FRONT if LEGS[row].short.startswith("F") else REAR
        look = {"alpha": 1.0 if near else 0.45, "zorder": 5 if near else 3}
        ax.plot(*np.array([hips[row], knees[row]]).T, "-", color=colour, lw=2.6,
                solid_capstyle="round", **look)  # fmt: skip
        outline = _shank(knees[row], soles[row], shape.shank_offsets[row], shape.shank_radii[row])
        ax.add_patch(Polygon(outline, fc=colour, ec=colour, lw=0.8, **look))
        swings = not samples.standing[k, row]
        ax.add_patch(Circle(soles[row], robot.foot_radius, fc=colour, ec=colour, lw=0.8, **look))
        if swings:
            ax.plot(*soles[row], "o", color="white", mec=colour, mew=1.6, ms=6.5, **look)
        ax.plot(*hips[row], "o", color="white", mec=colour, ms=3.5, **look)
        ax.plot(*knees[row], "o", color="white", mec=colour, ms=3.5, **look)
    com = _flat(lane, samples.com[k][None])[0]
    ax.plot(
        [com[0], com[0]], [com[1], float(lane.height(com[0]))], ":", color=INK, lw=1.0, zorder=6
    )
    ax.plot(*com, "o", color="white", mec=INK, ms=5, zorder=7)
    # The same room about the body at every moment, so that the moments are drawn to one scale.
    below = float(np.max(samples.body[:, 0, 2] - samples.feet[..., 2].min(axis=1))) + 0.15 * size
    above = float(high[2]) + half * abs(float(np.sin(samples.body[:, 0, 3]).min())) + 0.05 * size
    ax.set_aspect("equal")
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ax.set_ylim(middle[1] - below, middle[1] + above)
    ax.tick_params(labelsize=7)


def _flat(lane: Lane, p_W: FloatArray) -> FloatArray:
    """Points (..., 3) in W as (..., 2): along the lane, and up."""
    s, _ = lane.coordinates(p_W[..., :2])
    return np.stack([s, p_W[..., 2]], axis=-1)


def _ground(ax: Axes, lane: Lane, start: float, end: float) -> None:
    """The course's profile, filled downwards; treads' overhangs are not drawn."""
    start, end = max(start, -lane.run_in), min(end, lane.length + lane.run_out)
    d, z = lane.profile(start, end)
    ax.fill_between(start + d, z, np.min(z) - 5.0, color=GROUND, lw=0, zorder=1)
    ax.plot(start + d, z, "-", color=EDGE, lw=1.2, zorder=2)


def _shank(
    knee: FloatArray, foot: FloatArray, offsets: FloatArray, radii: FloatArray
) -> FloatArray:
    """A shank's outline (n, 2), as thick as the robot's collision geometry has it."""
    along = (foot - knee) / max(float(np.linalg.norm(foot - knee)), 1e-9)
    ahead = np.array([-along[1], along[0]])
    share = np.append(SHANK_POINTS, 1.0)[:, None]
    middle, wide = (np.append(v, v[-1])[:, None] for v in (offsets, radii))
    line = knee + share * (foot - knee) + middle * ahead
    return np.concatenate([line + wide * ahead, (line - wide * ahead)[::-1]])
