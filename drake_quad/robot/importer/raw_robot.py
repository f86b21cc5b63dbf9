"""What passes between the stages of an import: rigid groups of links, hinges between them, notes.

T is the trunk's own frame, as the file has it; all coordinates are in it, with every leg's joint at
the file's zero angle.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_quad.common import FloatArray

REPAIRED, ASSUMED, DROPPED, APPROXIMATED = "repaired", "assumed", "dropped", "approximated"
DOUBTFUL = "doubtful"  # read as it stands, and hardly meant so


@dataclass(frozen=True)
class Note:
    """One thing that differs from the file, or that the file leaves open.

    Attributes:
        kind: `repaired`, `assumed`, `dropped`, `approximated` or `doubtful`.
        text: What, and by which rule.
    """

    kind: str
    text: str


@dataclass(frozen=True)
class RigidMass:
    """Mass properties about the origin of a frame.

    Attributes:
        mass: Mass [kg].
        moment: Mass times centre of mass, (3,) [kg m].
        inertia: Inertia about the frame's origin, (3, 3) [kg m²].
    """

    mass: float
    moment: FloatArray
    inertia: FloatArray

    def __add__(self, other: "RigidMass") -> "RigidMass":
        """Both together, given in the same frame."""
        return RigidMass(
            self.mass + other.mass, self.moment + other.moment, self.inertia + other.inertia
        )

    def moved(self, X: RigidTransform) -> "RigidMass":
        """The same mass in frame A, where `X` is X_AB of its present frame B.

        Moving a body by `X` within one frame is the same computation.
        """
        R, p = X.rotation().matrix(), X.translation()
        h = R @ self.moment
        inertia = R @ self.inertia @ R.T
        # I_A = R I_B R' - [p]([h]) - ([h] + m [p])[p], with [.] the cross product's matrix.
        inertia = inertia - cross(p) @ cross(h) - (cross(h) + self.mass * cross(p)) @ cross(p)
        return RigidMass(self.mass, h + self.mass * p, 0.5 * (inertia + inertia.T))

    def centre(self) -> FloatArray:
        """The centre of mass, (3,) [m]; the origin for what has no mass."""
        return self.moment / self.mass if self.mass > 0.0 else np.zeros(3)

    def central_inertia(self) -> FloatArray:
        """About the centre of mass, (3, 3) [kg m²]."""
        c = cross(self.centre())
        return np.asarray(self.inertia + self.mass * c @ c)


NO_MASS = RigidMass(0.0, np.zeros(3), np.zeros((3, 3)))


def cross(v: FloatArray) -> FloatArray:
    """The matrix (3, 3) that takes w to v x w."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@dataclass(frozen=True)
class GeometryInstance:
    """One geometry of a link.

    Attributes:
        name: Name in the file.
        link: The link that it is on.
        shape: A pydrake Shape.
        X: Pose in T, or in the frame that its holder names.
        colour: Red, green, blue and opacity, or None if the file gives none.
        friction: Static and dynamic coefficient that the file states in Drake's own tags, or None.
    """

    name: str
    link: str
    shape: Any
    X: RigidTransform
    colour: tuple[float, ...] | None = None
    friction: tuple[float, float] | None = None

    def moved(self, X: RigidTransform) -> "GeometryInstance":
        """The same in frame A, where `X` is X_AB."""
        return replace(self, X=X @ self.X)


@dataclass(frozen=True)
class RigidGroup:
    """Links that are fixed to one another.

    Attributes:
        name: The first link's name.
        links: Names of all links of the group.
        rigid: Mass properties of all of them together, in T.
        collision: Collision shapes, poses in T.
        visual: Visual shapes, poses in T.
        shapeless: Whether a collision mesh of it is missing.
        leaves: Origins of links on which nothing else hangs, by name, (3,) in T [m].
    """

    name: str
    links: tuple[str, ...]
    rigid: RigidMass
    collision: tuple[GeometryInstance, ...]
    visual: tuple[GeometryInstance, ...]
    shapeless: bool
    leaves: dict[str, FloatArray]


@dataclass(frozen=True)
class RevoluteJoint:
    """One revolute joint of a leg, in T, and its drive as the file has it.

    Attributes:
        name: Name in the file.
        axis: Unit vector, (3,).
        point: A point of the axis, (3,) [m].
        lower: Position limit [rad], as in the file; -inf if not given.
        upper: Position limit [rad]; inf if not given.
        effort: Torque limit [Nm]; inf if not given.
        speed: Speed limit [rad/s]; inf if not given.
        damping: Damping of the joint [Nm s/rad].
        friction: Coulomb friction of the joint [Nm]; 0 if not given.
        rotor_inertia: Inertia of the drive's rotor, before the gear [kg m²].
        gear_ratio: Gear ratio of the drive.
    """

    name: str
    axis: FloatArray
    point: FloatArray
    lower: float
    upper: float
    effort: float
    speed: float
    damping: float
    friction: float
    rotor_inertia: float
    gear_ratio: float


@dataclass(frozen=True)
class JointLimits:
    """The limits of a leg's three joints in normal form.

    Attributes:
        lower: Lower position limits, (3,) [rad].
        upper: Upper position limits, (3,) [rad].
        effort: Torque limits, (3,) [Nm].
        speed: Speed limits, (3,) [rad/s].
        turn: Offsets of the angles as in LegFrames, (3,) [rad], with whole turns added so that the
            limits are about zero.
        notes: What was repaired or assumed.
    """

    lower: FloatArray
    upper: FloatArray
    effort: FloatArray
    speed: FloatArray
    turn: FloatArray
    notes: tuple[Note, ...]


@dataclass(frozen=True)
class RawLeg:
    """A leg as the file has it: three hinges and the groups that they carry (hip, thigh, shank)."""

    hinges: tuple[RevoluteJoint, RevoluteJoint, RevoluteJoint]
    groups: tuple[RigidGroup, RigidGroup, RigidGroup]


@dataclass(frozen=True)
class RawRobot:
    """A quadruped as its file has it, joints that are no leg's locked.

    Attributes:
        name: The robot's name.
        trunk: All that is fixed to the trunk, arms included.
        trunk_name: The link whose frame is T.
        legs: The legs, in no order.
        yaw: Heading of the robot's forward direction in T [rad].
        reference: Angles of a standing pose by joint name [rad], where the file has one.
    """

    name: str
    trunk: RigidGroup
    trunk_name: str
    legs: tuple[RawLeg, ...]
    yaw: float
    reference: dict[str, float]
