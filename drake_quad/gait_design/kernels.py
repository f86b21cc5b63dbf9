"""The compiled objective of candidate gaits, moment by moment."""

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.gait_design.candidates import Cycle, Staircase
from drake_quad.gait_design.clearance_kernels import (
    SHANK,
    THIGH,
    clearance_between_legs,
    clearance_under_line,
    place_points,
    pose_leg_clearance,
    pose_trunk_clearance,
)
from drake_quad.gait_design.pose_kernels import (
    RobotTables,
    best_sway,
    centre_of_mass,
    joint_angles,
    pose_of,
    shank_tilt,
    static_foot_loads,
    to_body,
    torque_used,
)
from drake_quad.jit import copy_vector, jit, jit_released
from drake_quad.robot.kinematics import leg_row

UNDER = 7  # points under the trunk that are looked at
STRIDE = 7  # between moments looked at in turn: unlike ones sooner show what is in the way
# Weight of the smallest slack in `objective_of_slacks`; the rest is that of their mean.
LEAST_SHARE = 0.7
# Columns of the result.
REACH, JOINTS, TORQUE, MARGIN, LEGS, APART, TRUNK = range(7)
COLUMNS = 7


@jit
def objective_of_slacks(row: FloatArray, wanted: FloatArray) -> float:
    """Objective of slacks (COLUMNS,): less is better, and it only grows as slacks get smaller.

    It is mostly the least ratio of a slack to its target, and a little their mean.
    """
    least, mean = np.inf, 0.0
    for i in range(COLUMNS):
        share = min(row[i] / wanted[i], 1.0)
        least = min(least, share)
        mean += share / COLUMNS
    return -(LEAST_SHARE * least + (1.0 - LEAST_SHARE) * mean)


@jit
def objectives_of_slacks(rows: FloatArray, wanted: FloatArray) -> FloatArray:
    """See `objective_of_slacks`, for slacks in rows (C, COLUMNS): (C,)."""
    lacks = np.empty(len(rows))
    for c in range(len(rows)):
        lacks[c] = objective_of_slacks(rows[c], wanted)
    return lacks


@jit_released
def slacks(
    cycle: Cycle,
    stairs: Staircase,
    robot: RobotTables,
    wanted: FloatArray,
    found: FloatArray,
    enough: FloatArray,
) -> None:
    """The least slacks of each candidate over its moments, (C, COLUMNS), into `found`.

    Args:
        cycle: Bodies and feet of the candidates.
        stairs: The staircase.
        robot: The robot.
        wanted: Slacks that are enough (COLUMNS,); no sway is added for more margin.
        found: Result; what it holds already (of other stairs) counts.
        enough: What a candidate may lack to be of interest (C,), see `objective_of_slacks`. Where
            one lacks more, no further moments are looked at.
    """
    body, feet, landed, radii = cycle.body, cycle.feet, cycle.landed, robot.shanks[1]
    q, points = np.empty((4, 3)), np.empty((4, SHANK + THIGH, 3))
    in_body, under = np.empty((SHANK, 3)), np.zeros((UNDER, 3))
    f, tilts = np.empty((4, 3)), np.empty((body.shape[1], 4))
    forces, com = np.zeros(4), np.empty(3)
    weight, whole, limits = robot.masses.sum() * GRAVITY, robot.trunk[0], robot.limits
    for c in range(body.shape[0]):
        row = found[c]
        for n in range(body.shape[1]):
            for k in range(4):
                if landed[n, k] == n:
                    still = pose_of(body[c, n], 0.0)
                    joint_angles(leg_row(robot.legs, k), still, feet[c, n, k], q[k])
                    tilts[n, k] = shank_tilt(still, q[k])
        for moment in range(body.shape[1]):
            n = moment * STRIDE % body.shape[1]
            still, air = pose_of(body[c, n], 0.0), int(cycle.swing[n])
            for k in range(4):
                # A foot is a ball, which its shank rolls on.
                joint_angles(leg_row(robot.legs, k), still, feet[c, n, k], q[k])
                copy_vector(f[k], feet[c, n, k])
                if k != air:
                    f[k, 0] += robot.foot_radius * (
                        shank_tilt(still, q[k]) - tilts[landed[n, k], k]
                    )
            centre_of_mass(still, q, robot, com)
            sway, margin = best_sway(com, f, air, robot.widest, wanted[MARGIN])
            row[MARGIN] = min(row[MARGIN], margin)
            static_foot_loads(com[0], com[1] + sway, f, air, weight, forces)
            pose = pose_of(body[c, n], sway)
            for k in range(4):
                leg = leg_row(robot.legs, k)
                row[REACH] = min(row[REACH], joint_angles(leg, pose, f[k], q[k]))
                for j in range(3):
                    i = 3 * k + j
                    slack = min(q[k, j] - limits[0, i], limits[1, i] - q[k, j])
                    row[JOINTS] = min(row[JOINTS], slack)
                used = torque_used(leg, q[k], forces[k], pose, limits[2, 3 * k : 3 * k + 3])
                row[TORQUE] = min(row[TORQUE], 1.0 - used)
            if objective_of_slacks(row, wanted) > enough[c]:
                break  # before what takes longest
            for k in range(4):
                place_points(
                    leg_row(robot.legs, k), q[k], pose, f[k], robot.shanks[0, k], points[k]
                )
                row[LEGS] = pose_leg_clearance(
                    points[k], radii[k], stairs.rise, stairs.run, row[LEGS]
                )
                to_body(points[k], pose, in_body)
                row[APART] = pose_trunk_clearance(in_body, radii[k], robot.trunk, row[APART])
            for k in range(2):
                row[APART] = clearance_between_legs(
                    points[k], points[2 + k], radii[k], radii[2 + k], row[APART]
                )
            for i in range(UNDER):
                x, low = whole[0, 0] + i / (UNDER - 1.0) * (whole[1, 0] - whole[0, 0]), whole[0, 2]
                under[i, 0] = pose.x + pose.cosine * x + pose.sine * low
                under[i, 2] = pose.z - pose.sine * x + pose.cosine * low
            row[TRUNK] = clearance_under_line(under, stairs.rise, stairs.run, row[TRUNK])
            if objective_of_slacks(row, wanted) > enough[c]:
                break
