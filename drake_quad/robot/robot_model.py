"""A quadruped as the planners see it: four legs with geometry, limits and masses.

`RobotModel` holds arrays alone; it is read from a file through Drake's parser by `load_robot`, and
`MakeModelPlant` gives the same robot as a MultibodyPlant without geometry for the controllers.
"""

from dataclasses import dataclass, field

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.robot.leg_kinematics import LegGeometry


@dataclass(frozen=True, eq=False)
class RobotModel:
    """What planning and control need to know of a robot.

    Attributes:
        name: The model's name in its file.
        url: Where it was read from, as Drake's parser takes it.
        trunk: Name of the floating body that carries the legs; its frame is B.
        geometry: The legs' lengths.
        joint_names: 12 names, leg by leg (FL, FR, RL, RR), abduction, hip pitch, knee.
        q_lower: Joint position limits, (12,) [rad].
        q_upper: Joint position limits, (12,) [rad].
        effort: Joint torque limits, (12,) [Nm].
        speed: Joint speed limits, (12,) [rad/s].
        mass: The whole robot's mass [kg].
        trunk_mass: The trunk's own mass [kg].
        trunk_com: The trunk's centre of mass in B, (3,) [m].
        link_mass: Mass of hip, thigh and shank of each leg, (4, 3) [kg].
        link_com: Their centres of mass in their own frames, (4, 3, 3) [m].
        foot_radius: Radius of the foot spheres, of the thickest if they are not alike [m].
        foot_geometry: Names of the four feet's collision geometries, as in the file.
        shank_offsets: How far ahead (the shank's own x) of each leg's line from knee to foot the
            middle of its shank is at SHANK_POINTS, (4, 8) [m].
        shank_radii: How far it reaches from there to either side, (4, 8) [m].
        thigh_points: Points that lines along the thighs' collision shapes join, K shapes each, in
            the thighs' frames (4, K, 10, 3) [m].
        thigh_radii: How thick what is around them is (4, K) [m].
        trunk_box: Least and greatest x, y, z of the trunk's collision geometry in B (2, 3) [m]; of
            its hips where it has none.
        trunk_boxes: The same of each of these geometries that no other holds (K, 2, 3) [m].
        foot_smaller: By how much each foot's radius is less than `foot_radius` (4,) [m]; 0 but in
            files whose feet are not alike. A smaller foot's shank ends that much nearer the knee:
            in the middle of a ball of `foot_radius` that holds the foot and touches its end.
        foot_friction: Coulomb's coefficient (dynamic) that the robot's file states for each foot in
            Drake's own tags (4,); nan where it states none, as nearly all.
    """

    name: str
    url: str
    trunk: str
    geometry: LegGeometry
    joint_names: tuple[str, ...]
    q_lower: FloatArray
    q_upper: FloatArray
    effort: FloatArray
    speed: FloatArray
    mass: float
    trunk_mass: float
    trunk_com: FloatArray
    link_mass: FloatArray
    link_com: FloatArray
    foot_radius: float
    foot_geometry: tuple[str, ...]
    shank_offsets: FloatArray = field(default_factory=lambda: np.zeros((4, 8)))
    shank_radii: FloatArray = field(default_factory=lambda: np.zeros((4, 8)))
    thigh_points: FloatArray = field(default_factory=lambda: np.zeros((4, 1, 10, 3)))
    thigh_radii: FloatArray = field(default_factory=lambda: np.zeros((4, 1)))
    trunk_box: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    trunk_boxes: FloatArray = field(default_factory=lambda: np.zeros((1, 2, 3)))
    foot_smaller: FloatArray = field(default_factory=lambda: np.zeros(4))
    foot_friction: FloatArray = field(default_factory=lambda: np.full(4, np.nan))


def contact_friction(robot: RobotModel, friction: float) -> FloatArray:
    """The coefficients between the four feet and the ground (4,), as Drake combines the two.

    Args:
        robot: Of which feet may have a friction of their own.
        friction: Coulomb's coefficient of the ground, and of every foot without one of its own.
    """
    own = robot.foot_friction
    both = np.maximum(own + friction, 1e-12)  # two surfaces without any have none together
    return np.where(np.isnan(own), friction, 2.0 * own * friction / both)


def calc_com(robot: RobotModel, q: FloatArray) -> FloatArray:
    """Returns the whole robot's centre of mass in B, (..., 3) [m], for joint angles (..., 4, 3)."""
    a, hip, knee = q[..., 0], q[..., 1], q[..., 1] + q[..., 2]
    g, c = robot.geometry, robot.link_com

    def pitched(angle: FloatArray, p: FloatArray) -> FloatArray:
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        ca, sa = np.cos(angle), np.sin(angle)
        y = np.broadcast_to(y, angle.shape)
        return np.stack([ca * x + sa * z, y, -sa * x + ca * z], axis=-1)

    zero, plane = np.zeros(4), g.p_HP
    knee_at = plane + pitched(hip, np.stack([zero, zero, -g.thigh], axis=-1))
    m = robot.link_mass
    moment = (
        m[:, 0, None] * c[:, 0]
        + m[:, 1, None] * (plane + pitched(hip, c[:, 1]))
        + m[:, 2, None] * (knee_at + pitched(knee, c[:, 2]))
    )
    ca, sa = np.cos(a), np.sin(a)
    x, y, z = moment[..., 0], moment[..., 1], moment[..., 2]
    turned = np.stack([x, ca * y - sa * z, sa * y + ca * z], axis=-1)
    total = robot.trunk_mass * robot.trunk_com + np.sum(
        turned + m.sum(axis=1)[:, None] * g.p_BH, axis=-2
    )
    return np.asarray(total / robot.mass)


def leg_length(robot: RobotModel) -> float:
    """Of the shortest leg, as far as its knee lets it stretch [m]."""
    g = robot.geometry
    knees = np.stack([robot.q_lower[2::3], robot.q_upper[2::3]])
    straightest = np.where(np.prod(knees, axis=0) <= 0.0, 0.0, np.min(np.abs(knees), axis=0))
    square = g.thigh**2 + g.shank**2 + 2.0 * g.thigh * g.shank * np.cos(straightest)
    return float(np.sqrt(np.min(square)))
