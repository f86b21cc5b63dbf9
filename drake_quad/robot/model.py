"""A quadruped as planner and controller see it.

A leg hangs from its hip H in B: a rotation about B's x (abduction), an offset `d` along y to the
leg's plane and, of robots whose two hip axes do not meet, a height `raised` along z; then two
rotations about y (hip pitch and knee) with the thigh and the shank along -z. Angles are in the
order (abduction, hip pitch, knee) and zero with the leg straight down.

`RobotModel` holds arrays alone; it is read from a file through Drake's parser by `load_robot`, and
`MakeModelPlant` gives the same robot as a MultibodyPlant without geometry for the controllers.
"""

from dataclasses import dataclass, field, fields, is_dataclass
from functools import lru_cache

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.util.display import one_line


@dataclass(frozen=True)
class LegGeometry:
    """Lengths of all four legs, one row a leg (FL, FR, RL, RR).

    Attributes:
        p_BH: Hip (abduction axis) in B, (4, 3) [m].
        offset: Signed distance from the hip to the leg's plane along y, (4,) [m].
        thigh: Hip pitch axis to knee, (4,) [m].
        shank: Knee to the foot sphere's centre, (4,) [m].
        knee_sign: -1 for a knee that points backward, +1 for one that points forward, (4,).
        raised: How far the hip pitch axis passes above the abduction axis, (4,) [m]; mostly 0.
    """

    p_BH: FloatArray
    offset: FloatArray
    thigh: FloatArray
    shank: FloatArray
    knee_sign: FloatArray
    raised: FloatArray = field(default_factory=lambda: np.zeros(4))

    @property
    def p_HP(self) -> FloatArray:
        """The hip pitch axis, in the leg's plane, from the hip as long as abduction is 0 (4, 3)."""
        return np.stack([np.zeros(len(self.offset)), self.offset, self.raised], axis=-1)

    @property
    def reach(self) -> FloatArray:
        """Length of each leg stretched out, (4,) [m]."""
        return self.thigh + self.shank


PATH = 26  # points of a way along a shape of a thigh


@dataclass(frozen=True, eq=False)
class ThighStops:
    """The shapes that thighs and trunk have for each other; none where they pass through.

    Attributes:
        boxes: Least and greatest x, y, z of the trunk's boxes in B (K, 2, 3) [m].
        rods: Ends of the axes of the trunk's cylinders in B (K, 2, 3) [m].
        rod_radii: Radii of these cylinders (K,) [m].
        paths: Points that lines along the thighs' shapes join, S shapes each, in the thighs'
            frames (4, S, PATH, 3) [m].
        radii: How thick the shapes are around these lines (4, S) [m]; -inf where a thigh has fewer
            shapes.
    """

    boxes: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 3)))
    rods: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 3)))
    rod_radii: FloatArray = field(default_factory=lambda: np.zeros(0))
    paths: FloatArray = field(default_factory=lambda: np.zeros((4, 0, PATH, 3)))
    radii: FloatArray = field(default_factory=lambda: np.zeros((4, 0)))

    @property
    def empty(self) -> bool:
        """Whether thighs and trunk pass through each other."""
        return self.paths.shape[1] == 0


@dataclass(frozen=True)
class CameraMount:
    """Where a camera is mounted on the trunk.

    Attributes:
        x: How far ahead of B's origin it is [m].
        y: How far to the left [m].
        z: How far up [m].
        pitch_deg: Angle of its optical axis below the horizon, B being level [deg].
    """

    x: float
    y: float
    z: float
    pitch_deg: float


@dataclass(frozen=True, eq=False)
class RobotModel:
    """What planning and control need to know of a robot.

    Attributes:
        name: The model's name in its file.
        url: File that it was read from, as Drake's parser takes it.
        trunk: Name of the floating body that carries the legs; its frame is B.
        geometry: The legs' lengths.
        joint_names: 12 names, leg by leg (FL, FR, RL, RR), abduction, hip pitch, knee.
        q_lower: Lower joint position limits, (12,) [rad].
        q_upper: Upper joint position limits, (12,) [rad].
        effort: Joint torque limits, (12,) [Nm].
        speed: Joint speed limits, (12,) [rad/s].
        mass: The whole robot's mass [kg].
        trunk_mass: The trunk's own mass [kg].
        trunk_com: The trunk's centre of mass in B, (3,) [m].
        link_mass: Mass of hip, thigh and shank of each leg, (4, 3) [kg].
        link_com: Centres of mass of these links in their own frames, (4, 3, 3) [m].
        foot_radius: Radius of the foot spheres, of the thickest if they are not alike [m].
        foot_geometry: Names of the four feet's collision geometries, as in the file.
        shank_offsets: How far ahead (the shank's own x) of each leg's line from knee to foot the
            middle of its shank is at SHANK_POINTS, (4, 8) [m].
        shank_radii: Half its thickness there, (4, 8) [m].
        shank_profile: The same more finely, for proofs; None where it is not known.
        thigh_points: Points that lines along the thighs' collision shapes join, K shapes each, in
            the thighs' frames (4, K, 10, 3) [m].
        thigh_radii: Radii of the thighs' shapes around these lines (4, K) [m].
        thigh_stops: What thighs and trunk come against each other with.
        trunk_box: Least and greatest x, y, z of the trunk's collision geometry in B (2, 3) [m]; of
            its hips where it has none.
        trunk_boxes: Least and greatest x, y, z of each of these geometries that no other holds
            (K, 2, 3) [m].
        foot_smaller: Difference of `foot_radius` and each foot's radius (4,) [m]; 0 but in
            files whose feet are not alike. A smaller foot's shank ends that much nearer the knee:
            in the middle of a ball of `foot_radius` that holds the foot and touches its end.
        foot_friction: Coulomb's coefficient (dynamic) that the robot's file states for each foot in
            Drake's own tags (4,); nan where it states none, as nearly all.
        joint_friction: Coulomb friction of the joints as the robot's file states it (12,) [Nm]; 0
            where it states none. Drake simulates none.
        source: Argument of `load_robot`: a name, a URL or a file. Empty for other robots.
        camera: Where its depth camera is, if its `.robot.yaml` says so.
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
    shank_profile: "ShankProfile | None" = None
    thigh_points: FloatArray = field(default_factory=lambda: np.zeros((4, 1, 10, 3)))
    thigh_radii: FloatArray = field(default_factory=lambda: np.zeros((4, 1)))
    thigh_stops: ThighStops = field(default_factory=ThighStops)
    trunk_box: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    trunk_boxes: FloatArray = field(default_factory=lambda: np.zeros((1, 2, 3)))
    foot_smaller: FloatArray = field(default_factory=lambda: np.zeros(4))
    foot_friction: FloatArray = field(default_factory=lambda: np.full(4, np.nan))
    joint_friction: FloatArray = field(default_factory=lambda: np.zeros(12))
    source: str = ""
    camera: CameraMount | None = None

    def __repr__(self) -> str:
        return one_line(
            self, self.name, f"{self.mass:.2f} kg", f"legs of {leg_length(self):.3f} m",
            f"from {self.source or self.url}",
        )  # fmt: skip


def differing_field(one: object, other: object) -> str | None:
    """The first field in which two robots, or two parts of robots, differ; None if none does.

    Args:
        one: A robot, or a part of one.
        other: Another of the same class.
    """
    for f in fields(one):  # type: ignore[arg-type]
        a, b = getattr(one, f.name), getattr(other, f.name)
        if is_dataclass(a) and type(a) is type(b):
            inner = differing_field(a, b)
            if inner is not None:
                return f"{f.name}.{inner}"
        elif isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
            numbers = np.asarray(a).dtype.kind == "f" and np.asarray(b).dtype.kind == "f"
            if not np.array_equal(a, b, equal_nan=numbers):
                return f.name
        elif a != b:
            return f.name
    return None


def contact_friction(robot: RobotModel, friction: float) -> FloatArray:
    """The coefficients between the four feet and the ground (4,), as Drake combines the two.

    Args:
        robot: The robot, whose feet may have a friction of their own.
        friction: Coulomb's coefficient of the ground, and of every foot without one of its own.
    """
    own = robot.foot_friction
    both = np.maximum(own + friction, 1e-12)  # two surfaces without any have none together
    return np.where(np.isnan(own), friction, 2.0 * own * friction / both)


def leg_lengths(robot: RobotModel) -> FloatArray:
    """Length of each leg, stretched as far as its knee allows (4,) [m]."""
    g = robot.geometry
    turn = 2.0 * np.pi
    low, high = robot.q_lower[2::3], robot.q_upper[2::3]
    # A knee is straight at zero, and at each whole turn.
    through = np.floor(high / turn) >= np.ceil(low / turn)
    straightest = np.where(through, 1.0, np.maximum(np.cos(low), np.cos(high)))
    square = g.thigh**2 + g.shank**2 + 2.0 * g.thigh * g.shank * straightest
    return np.asarray(np.sqrt(square))


@lru_cache(maxsize=8)  # a search asks four thousand times
def leg_length(robot: RobotModel) -> float:
    """Length of the shortest leg, stretched as far as its knee allows [m]."""
    return float(leg_lengths(robot).min())


# From the knee on, to the foot: 1. The last is where a thick shank ends above a thin foot: over a
# nosing, and leaning, it is what comes down on it first.
SHANK_POINTS = np.append(0.14 * np.arange(7), 0.93)
# Factors of the clearances at these points in comparisons with the clearance that is required: the
# end is always near to what its foot stands on, and a third of that clearance is enough.
CLEARANCE_WEIGHTS = np.append(np.ones(7), 3.0)


@dataclass(frozen=True, eq=False)
class ShankProfile:
    """How thick the shanks are, as chains of rounded rods that hold their collision shapes.

    Seen from the side, a shape is nowhere outside of the rod between two neighbouring places that
    is as thick as the thicker of its ends.

    Attributes:
        along: Places along a shank, from the knee (0) on to the foot (1) (n,).
        ahead: How far ahead of the line from knee to foot a shank's middle is there, along the
            shank's own x (4, n) [m].
        radii: Half its thickness there (4, n) [m].
    """

    along: FloatArray
    ahead: FloatArray
    radii: FloatArray


@dataclass(frozen=True, eq=False)
class LinkOutline:
    """A robot's outline.

    Attributes:
        trunk_lower: Least x, y, z of the trunk in B (3,) [m].
        trunk_upper: Greatest x, y, z of the trunk in B (3,) [m].
        trunk_parts: Least and greatest x, y, z of each of the trunk's parts (K, 2, 3) [m].
        shank_offsets: How far ahead (the shank's own x) of each leg's line from knee to foot the
            middle of its shank is at SHANK_POINTS, feet left out (4, 8) [m].
        shank_radii: Half the thickness of the shank there (4, 8) [m].
    """

    trunk_lower: FloatArray
    trunk_upper: FloatArray
    trunk_parts: FloatArray
    shank_offsets: FloatArray
    shank_radii: FloatArray


def link_outline_of(robot: RobotModel) -> LinkOutline:
    """The outline of a robot's collision geometry; of its hips where the trunk has none."""
    return LinkOutline(
        trunk_lower=robot.trunk_box[0],
        trunk_upper=robot.trunk_box[1],
        trunk_parts=robot.trunk_boxes,
        shank_offsets=robot.shank_offsets,
        shank_radii=robot.shank_radii,
    )
