"""Encloses joint angles, knees, shanks and moments of the legs over a cell.

The leg is that of `robot.kinematics`: abduction about x, hip pitch and knee about y.
"""

from dataclasses import dataclass, fields

import numpy as np

from drake_quad.certificate.cells import Cells, Pieces
from drake_quad.certificate.enclosure import Enclosure, angle_of, constant, vary
from drake_quad.certificate.tolerances import NONE, Tolerances
from drake_quad.common import FloatArray, IntArray
from drake_quad.robot.model import SHANK_POINTS, RobotModel, ShankProfile

TURN = 2.0 * np.pi
# What tolerances make unknown: the body's place, pitch, yaw and roll, and three of each foot's own.
ROLL, OWN, UNKNOWNS = 5, 3, 9
Vector = tuple[Enclosure, Enclosure, Enclosure]


@dataclass(frozen=True, eq=False)
class Frame:
    """The body: its origin in W and the sines and cosines of its angles, (N, 1) each.

    Bodies do not roll in plans: `roll` has sine and cosine of what tolerances allow, or is None.
    """

    origin: Vector
    sin_pitch: Enclosure
    cos_pitch: Enclosure
    sin_yaw: Enclosure
    cos_yaw: Enclosure
    roll: tuple[Enclosure, Enclosure] | None = None

    def turn(self, v: Vector) -> Vector:
        """A vector in B, as in W."""
        x, y, z = v
        if self.roll is not None:
            s, c = self.roll
            y, z = c * y - s * z, s * y + c * z
        ahead = self.cos_pitch * x + self.sin_pitch * z
        up = self.cos_pitch * z - self.sin_pitch * x
        return (
            self.cos_yaw * ahead - self.sin_yaw * y,
            self.sin_yaw * ahead + self.cos_yaw * y,
            up,
        )

    def turn_back(self, v: Vector) -> Vector:
        """A vector in W, as in B."""
        x, y, z = v
        ahead = self.cos_yaw * x + self.sin_yaw * y
        x, y, z = (
            self.cos_pitch * ahead - self.sin_pitch * z,
            self.cos_yaw * y - self.sin_yaw * x,
            self.sin_pitch * ahead + self.cos_pitch * z,
        )
        if self.roll is not None:
            s, c = self.roll
            y, z = c * y + s * z, c * z - s * y
        return x, y, z


@dataclass(frozen=True, eq=False)
class Legs:
    """All four legs, (N, 4) each.

    Attributes:
        angles: Abduction, hip pitch, knee [rad].
        cos_knee: Cosine of the knee's angle.
        foot: The foot from the hip pitch axis, in the leg's plane: x and z [m].
        extension: The foot's distance from the hip pitch axis [m].
        across: The foot's y from the hip in B [m].
        height: The foot's z from the hip in B [m].
        sin_abduction: Sine of the abduction angle.
        cos_abduction: Cosine of it.
        sin_thigh: Sine of the thigh's angle in the leg's plane, from straight down.
        cos_thigh: Cosine of it.
        sin_shank: Sine of the shank's angle.
        cos_shank: Cosine of it.
    """

    angles: Vector
    cos_knee: Enclosure
    foot: tuple[Enclosure, Enclosure]
    extension: Enclosure
    across: Enclosure
    height: Enclosure
    sin_abduction: Enclosure
    cos_abduction: Enclosure
    sin_thigh: Enclosure
    cos_thigh: Enclosure
    sin_shank: Enclosure
    cos_shank: Enclosure


def enclose_frame(cells: Cells, within: Tolerances = NONE) -> Frame:
    """The body over each cell, with what tolerances allow."""
    count = _unknowns(within)
    offs = (within.body, within.body, within.body, within.tilt, within.turn)
    x, y, z, pitch, yaw = (
        vary(cells.body_enclosure(k), off, k, count) for k, off in enumerate(offs)
    )
    roll = None
    if within.tilt > 0.0:
        angle = vary(constant(0.0, cells.body_enclosure(3)), within.tilt, ROLL, count)
        roll = angle.sin(), angle.cos()
    return Frame((x, y, z), pitch.sin(), pitch.cos(), yaw.sin(), yaw.cos(), roll)


def _unknowns(within: Tolerances) -> int:
    return 0 if within == NONE else UNKNOWNS


def enclose_feet(pieces: Pieces, cells: Cells, within: Tolerances = NONE) -> Vector:
    """The feet in W over each cell, with what tolerances allow, (N, 4) each [m]."""
    stands, foot = pieces.standing[cells.piece], within.foot + within.rise
    aside = np.where(stands, within.foot, max(within.swing, within.foot))
    upward = np.where(stands, foot, max(within.swing, foot))
    first, count = UNKNOWNS - OWN, _unknowns(within)
    x, y, z = (
        vary(cells.feet_enclosure(pieces, k), off, first + k, count)
        for k, off in enumerate((aside, aside, upward))
    )
    return x, y, z


def enclose_legs(robot: RobotModel, frame: Frame, feet: Vector) -> Legs:
    """Inverse kinematics over each cell; nothing is known of a leg that may be out of reach."""
    g = robot.geometry
    x, y, z = frame.turn_back(
        (feet[0] - frame.origin[0], feet[1] - frame.origin[1], feet[2] - frame.origin[2])
    )
    x, y, z = x - g.p_BH[:, 0], y - g.p_BH[:, 1], z - g.p_BH[:, 2]
    height = z
    down = -((y * y + z * z - g.offset**2).sqrt())
    abduction = _nearest(angle_of(z, y) - angle_of(down, constant(g.offset, down)))
    down = down - g.raised
    extension = x * x + down * down
    bend = extension - (g.thigh**2 + g.shank**2)
    cos_knee = bend * (0.5 / (g.thigh * g.shank))
    sin_knee = (1.0 - cos_knee * cos_knee).sqrt() * g.knee_sign
    knee = cos_knee.arccos() * g.knee_sign
    hip = _nearest(angle_of(-x, -down) - angle_of(sin_knee * g.shank, cos_knee * g.shank + g.thigh))
    shank = hip + knee
    return Legs(
        angles=(abduction, hip, knee),
        cos_knee=cos_knee,
        foot=(x, down),
        extension=extension.sqrt(),
        across=y,
        height=height,
        sin_abduction=abduction.sin(),
        cos_abduction=abduction.cos(),
        sin_thigh=hip.sin(),
        cos_thigh=hip.cos(),
        sin_shank=shank.sin(),
        cos_shank=shank.cos(),
    )


def _nearest(angle: Enclosure) -> Enclosure:
    """The angle, less whole turns, so that its centre is in [-pi, pi]."""
    return angle + (-TURN * np.round(np.nan_to_num(angle.centre) / TURN))


def enclose_knees(robot: RobotModel, frame: Frame, legs: Legs) -> Vector:
    """The knees in W, (N, 4) each [m]."""
    g = robot.geometry
    x, down = legs.sin_thigh * -g.thigh, legs.cos_thigh * -g.thigh + g.raised
    y = legs.cos_abduction * g.offset - legs.sin_abduction * down
    z = legs.sin_abduction * g.offset + legs.cos_abduction * down
    v = frame.turn((x + g.p_BH[:, 0], y + g.p_BH[:, 1], z + g.p_BH[:, 2]))
    return frame.origin[0] + v[0], frame.origin[1] + v[1], frame.origin[2] + v[2]


def enclose_shank_axes(frame: Frame, legs: Legs) -> Vector:
    """Unit vectors along the shanks' own x axes in W, (N, 4) each."""
    down = -legs.sin_shank
    return frame.turn((legs.cos_shank, -(legs.sin_abduction * down), legs.cos_abduction * down))


@dataclass(frozen=True, eq=False)
class Moments:
    """First moments of mass, (N, 4) each but for `com` [kg m].

    Attributes:
        leg_across: Moment of hip, thigh and shank about the hip, along B's y.
        leg_height: The same along B's z.
        thigh: Moment of thigh and shank about the hip pitch axis, in the leg's plane: x and z.
        shank: Moment of the shank about the knee, in the leg's plane: x and z.
        com: x and y of the whole robot's centre of mass in W, (N, 1) each [m].
    """

    leg_across: Enclosure
    leg_height: Enclosure
    thigh: tuple[Enclosure, Enclosure]
    shank: tuple[Enclosure, Enclosure]
    com: tuple[Enclosure, Enclosure]


def enclose_moments(robot: RobotModel, frame: Frame, legs: Legs) -> Moments:
    """Where the mass is."""
    g, m, c = robot.geometry, robot.link_mass, robot.link_com

    def pitched(sine: Enclosure, cosine: Enclosure, k: int) -> tuple[Enclosure, Enclosure]:
        x, z = m[:, k] * c[:, k, 0], m[:, k] * c[:, k, 2]
        return cosine * x + sine * z, cosine * z - sine * x

    shank = pitched(legs.sin_shank, legs.cos_shank, 2)
    own = pitched(legs.sin_thigh, legs.cos_thigh, 1)
    carried = -m[:, 2] * g.thigh
    thigh = (
        own[0] + shank[0] + legs.sin_thigh * carried,
        own[1] + shank[1] + legs.cos_thigh * carried,
    )
    sideways = m[:, 0] * c[:, 0, 1] + (m[:, 1] + m[:, 2]) * g.offset
    sideways = sideways + m[:, 1] * c[:, 1, 1] + m[:, 2] * c[:, 2, 1]
    at_hip = m[:, 0] * c[:, 0, 2] + (m[:, 1] + m[:, 2]) * g.raised
    along, down = thigh[0] + m[:, 0] * c[:, 0, 0], thigh[1] + at_hip
    across = legs.cos_abduction * sideways - legs.sin_abduction * down
    upward = legs.sin_abduction * sideways + legs.cos_abduction * down
    still = robot.trunk_mass * robot.trunk_com + m.sum(axis=1) @ g.p_BH
    share = 1.0 / robot.mass
    offset = frame.turn(
        (
            (along.sum(axis=1, own=OWN) + still[0]) * share,
            (across.sum(axis=1, own=OWN) + still[1]) * share,
            (upward.sum(axis=1, own=OWN) + still[2]) * share,
        )
    )
    com = frame.origin[0] + offset[0], frame.origin[1] + offset[1]
    return Moments(across, upward, thigh, shank, com)


def shank_of(robot: RobotModel) -> ShankProfile:
    """How thick a robot's shanks are, by their collision geometry."""
    if robot.shank_profile is not None:
        return robot.shank_profile
    return ShankProfile(np.asarray(SHANK_POINTS), robot.shank_offsets, robot.shank_radii)


@dataclass(frozen=True, eq=False)
class Points(Enclosure):
    """Knee, foot and the shank's x axis in W, arrays (..., 3, 3), last x, y, z.

    Any point of a shank is a combination of the three that does not change with time.
    """

    def pick(self, cell: IntArray, leg: IntArray) -> "Points":
        """Those of some legs in some cells (K, 3, 3)."""
        return Points(**{f.name: getattr(self, f.name)[cell, leg] for f in fields(self)})

    def unsure(self, combination: FloatArray, normal: FloatArray) -> FloatArray:
        """How far combinations (K, 3) may be off along normals (K, 3) in the middle [m]."""
        spread = np.einsum("ks,ksip,ki->kp", combination, self.spread, normal)
        return np.abs(spread).sum(axis=-1) + self._worst(self.error, combination, normal)

    def moves(self, combination: FloatArray, normal: FloatArray) -> FloatArray:
        """How far combinations (K, 3) are off along normals (K, 3) over the stretch [m]."""
        steady = np.abs(np.einsum("ks,ksi,ki->k", combination, self.time, normal))
        spread = np.einsum("ks,ksip,ki->kp", combination, self.spread, normal)
        rest = self._worst(self.rest, combination, normal)
        return np.asarray(steady + np.abs(spread).sum(axis=-1) + rest)

    @staticmethod
    def _worst(bounds: FloatArray, combination: FloatArray, normal: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("ks,ksi,ki->k", np.abs(combination), bounds, np.abs(normal)))


@dataclass(frozen=True, eq=False)
class Chain:
    """The shanks of a moving robot, (N, 4, 3, 3) each quantity of `points`."""

    shank: ShankProfile
    points: Points

    def parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The parts' two ends as combinations (4, n - 1, 3) each, and radii (4, n - 1) [m]."""
        along = np.broadcast_to(self.shank.along, self.shank.ahead.shape)
        ends = np.stack([1.0 - along, along, self.shank.ahead], axis=-1)
        radii = self.shank.radii
        return ends[:, :-1], ends[:, 1:], np.maximum(radii[:, :-1], radii[:, 1:])

    def moves(self) -> FloatArray:
        """How far any point of a shank moves over its cell, at most (N, 4) [m]."""
        far = np.linalg.norm(self.points.radius, axis=-1)
        lean = np.abs(self.shank.ahead).max(axis=1)
        return np.asarray(np.maximum(far[..., 0], far[..., 1]) + lean * far[..., 2])

    def thickest(self) -> FloatArray:
        """How far a shank reaches from its line, at most (4,) [m]."""
        return np.asarray((np.abs(self.shank.ahead) + self.shank.radii).max(axis=1))


def make_chain(shank: ShankProfile, knees: Vector, feet: Vector, ahead: Vector) -> Chain:
    """The shanks between knees and feet, whose own x axes are `ahead`; all in W, (N, 4) each."""

    def stacked(name: str, axis: int = -1) -> FloatArray:
        return np.stack(
            [np.stack([getattr(c, name) for c in v], axis=axis) for v in (knees, feet, ahead)],
            axis=axis - 1,
        )

    names = ("centre", "time", "error", "rest")
    parts = {name: stacked(name) for name in names}
    return Chain(shank, Points(**parts, spread=stacked("spread", axis=-2)))
