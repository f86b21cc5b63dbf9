"""Shanks as chains of rounded parts that move with the legs."""

from dataclasses import dataclass

import numpy as np

from drake_quad.certificate.legs import Vector
from drake_quad.certificate.pieces import IntArray
from drake_quad.gait.legs import FloatArray
from drake_quad.robot.robot_model import RobotModel
from drake_quad.robot.shank_outline import SHANK_POINTS


@dataclass(frozen=True, eq=False)
class Shank:
    """How thick the shanks are.

    Attributes:
        along: Places along a shank, from the knee (0) on to the foot (1) (n,).
        ahead: How far ahead of the line from knee to foot a shank's middle is there, along the
            shank's own x (4, n) [m].
        radii: Its radius there (4, n) [m].
    """

    along: FloatArray
    ahead: FloatArray
    radii: FloatArray


def shank_of(robot: RobotModel) -> Shank:
    """How thick a robot's shanks are, by their collision geometry."""
    return Shank(np.asarray(SHANK_POINTS), robot.shank_offsets, robot.shank_radii)


@dataclass(frozen=True, eq=False)
class Points:
    """Enclosures of knee, foot and the shank's x axis in W, arrays (..., 3, 3), last x, y, z.

    Any point of a shank is a combination of the three that does not change with time.
    """

    centre: FloatArray
    error: FloatArray
    radius: FloatArray
    rate: FloatArray
    rate_radius: FloatArray

    def pick(self, cell: IntArray, leg: IntArray) -> "Points":
        """Those of some legs in some cells (K, 3, 3)."""
        return Points(**{name: values[cell, leg] for name, values in vars(self).items()})

    def moves(self, combination: FloatArray, normal: FloatArray, half: FloatArray) -> FloatArray:
        """How far combinations (K, 3) move along normals (K, 3) from where they are at first."""
        weight, size = np.abs(combination), np.abs(normal)

        def worst(values: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("ks,ksi,ki->k", weight, values, size))

        steady = np.abs(np.einsum("ks,ksi,ki->k", combination, self.rate, normal))
        by_rate = (steady + worst(self.rate_radius)) * half + worst(self.error)
        return np.asarray(np.fmin(by_rate, worst(self.radius)))


@dataclass(frozen=True, eq=False)
class Chain:
    """The shanks of a moving robot, (N, 4, 3, 3) each quantity of `points`."""

    shank: Shank
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


def make_chain(shank: Shank, knees: Vector, feet: Vector, ahead: Vector) -> Chain:
    """The shanks between knees and feet, whose own x axes are `ahead`; all in W, (N, 4) each."""

    def stacked(name: str) -> FloatArray:
        return np.stack(
            [np.stack([getattr(c, name) for c in v], axis=-1) for v in (knees, feet, ahead)],
            axis=-2,
        )

    names = ("centre", "error", "radius", "rate", "rate_radius")
    return Chain(shank, Points(*(stacked(name) for name in names)))
