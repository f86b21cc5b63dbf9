"""Robots that differ from a given one in one respect, for planning: the file stays as it is."""

from dataclasses import replace

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.robot.model import SHANK_POINTS, RobotModel

ALONG = np.array([1.0, 1.0, 0.0])  # what of a link's point stays, as the link gets longer
ALIKE = 1e-9  # ratios of legs' lengths that differ by no more are one
STRAIGHT, FOLDED = 0.05, 2.9  # [rad] a widened knee comes no nearer to straight, folds no farther


def with_longer_legs(robot: RobotModel, factor: float) -> RobotModel:
    """Returns the robot with thighs and shanks longer by a factor, as heavy and thick as before.

    Args:
        robot: The robot.
        factor: Ratio of the new lengths to the old ones.
    """
    geometry, along = robot.geometry, ALONG + factor * (1.0 - ALONG)
    link_com = robot.link_com.copy()
    link_com[:, 1:] *= along
    return replace(
        robot,
        geometry=replace(geometry, thigh=factor * geometry.thigh, shank=factor * geometry.shank),
        link_com=link_com,
        thigh_points=robot.thigh_points * along,
        thigh_stops=replace(robot.thigh_stops, paths=robot.thigh_stops.paths * along),
    )


def with_wider_knees(robot: RobotModel, angle: float) -> RobotModel:
    """Returns the robot with knees that fold and stretch farther, each by an angle.

    They neither stretch beyond STRAIGHT nor fold beyond FOLDED by it.

    Args:
        robot: The robot.
        angle: Angle by which both limits move [rad].
    """
    sign = robot.geometry.knee_sign
    ends = np.stack([sign * robot.q_lower[2::3], sign * robot.q_upper[2::3]])
    least, most = ends.min(axis=0), ends.max(axis=0)  # how far a knee is bent
    # What a file allows beyond these bounds is never taken away.
    least = np.minimum(least, np.maximum(least - angle, STRAIGHT))
    most = np.maximum(most, np.minimum(most + angle, FOLDED))
    ends = np.stack([sign * least, sign * most])
    lower, upper = robot.q_lower.copy(), robot.q_upper.copy()
    lower[2::3], upper[2::3] = ends.min(axis=0), ends.max(axis=0)
    return replace(robot, q_lower=lower, q_upper=upper)


def with_wider_hips(robot: RobotModel, angle: float) -> RobotModel:
    """Returns the robot with hips that pitch farther to both sides by an angle [rad]."""
    lower, upper = robot.q_lower.copy(), robot.q_upper.copy()
    lower[1::3] -= angle
    upper[1::3] += angle
    return replace(robot, q_lower=lower, q_upper=upper)


def with_torque(robot: RobotModel, factor: float) -> RobotModel:
    """Returns the robot with all torque limits multiplied by a factor."""
    return replace(robot, effort=factor * robot.effort)


def with_trunk_mass(robot: RobotModel, mass: float) -> RobotModel:
    """Returns the robot with a trunk of another mass [kg], its centre where it was."""
    return replace(robot, mass=robot.mass - robot.trunk_mass + mass, trunk_mass=mass)


def with_foot_radius(robot: RobotModel, radius: float) -> RobotModel:
    """Returns the robot with feet of another radius, the legs as long as they are.

    Each foot's lowest point stays where it is, on the shank's own line. Masses, limits and shapes
    stay, too; where legs are of unlike lengths the shanks' profile is left out.

    Args:
        robot: The robot.
        radius: The feet's radius [m]; 0 for feet that are points, which do not roll and whose
            swings clear edges by the paper's Δh alone.
    """
    geometry, less = robot.geometry, robot.foot_radius - radius
    # Along the longer line from knee to foot the shank's outline is nearer to the knee.
    longer = 1.0 + less / geometry.shank
    along = SHANK_POINTS * longer[:, None]

    def at_new_points(rows: FloatArray) -> FloatArray:
        return np.stack(
            [np.interp(a, SHANK_POINTS, row) for a, row in zip(along, rows, strict=True)]
        )

    profile = robot.shank_profile
    if profile is not None and np.ptp(longer) < ALIKE:
        profile = replace(profile, along=profile.along / longer[0])
    else:
        profile = None
    return replace(
        robot,
        geometry=replace(geometry, shank=geometry.shank + less),
        foot_radius=radius,
        foot_smaller=np.zeros(4),
        shank_offsets=at_new_points(robot.shank_offsets),
        shank_radii=at_new_points(robot.shank_radii),
        shank_profile=profile,
    )
