"""A robot whose feet are points, as in the paper's kinematics: the ends of its legs."""

from dataclasses import replace

import numpy as np

from drake_quad.robot.link_outline import SHANK_POINTS
from drake_quad.robot.model import RobotModel


def with_point_feet(robot: RobotModel) -> RobotModel:
    """Returns the robot with each foot the lowest point of its ball, on the shank's own line.

    The legs stay as long as they are; the feet have no radius, so that they do not roll and swings
    clear edges by the paper's Δh alone. Masses, limits and shapes stay as they are.
    """
    geometry, radius = robot.geometry, robot.foot_radius
    # Along the longer line from knee to foot the shank's outline is nearer to the knee.
    longer = 1.0 + radius / geometry.shank
    along = SHANK_POINTS * longer[:, None]
    offsets, radii = (
        np.stack([np.interp(a, SHANK_POINTS, row) for a, row in zip(along, rows, strict=True)])
        for rows in (robot.shank_offsets, robot.shank_radii)
    )
    return replace(
        robot,
        geometry=replace(geometry, shank=geometry.shank + radius),
        foot_radius=0.0,
        foot_smaller=np.zeros(4),
        shank_offsets=offsets,
        shank_radii=radii,
    )
