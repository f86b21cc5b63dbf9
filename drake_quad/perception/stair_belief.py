"""What is believed of a flight of stairs: estimates with their covariance, and bounds of the count.

The flight is told in the world: a point below the camera at the time of capture, the yaw of the
climb through it, nosings' places along that line, heights of the floor and the treads.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray, read_only

NORMAL_95 = 1.959964  # of a normal distribution 95 % lie within so many deviations


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A figure and its deviation.

    Attributes:
        value: The figure.
        sigma: Its standard deviation.
    """

    value: float
    sigma: float

    @property
    def half_width(self) -> float:
        """Half of the interval that holds the truth with a probability of 95 %."""
        return NORMAL_95 * self.sigma


@dataclass(frozen=True, kw_only=True)
class StairBelief:
    """A flight of stairs as it is believed to be; arrays cannot be written to.

    Attributes:
        stamp: Time at which the image was taken [s].
        origin: Point of the ground plane below the camera then, in W, (2,) [m].
        passed: How many steps of the flight lie before those told here: the camera has passed them.
        places: Nosings' places from `origin` along the climb, (n,) [m].
        heights: Heights of the floor before these and of the treads, in W, (n + 1,) [m].
        yaw: Yaw of the climb in W [rad].
        overhang: Distance that treads reach over the risers below [m].
        rise: Mean rise of the steps told here, negative going down [m].
        run: Their mean run [m]; where one step is told alone, that of stairs like it.
        covariance: Covariance of places, heights, yaw, overhang, rise, run, in this order.
        count_least: How many steps were seen; there are as many at least.
        count_most: How many there are at most; None if that was not seen.
        is_open: Whether there is nothing between the treads.
        right: Where steps were seen, across the climb: the right end, left positive [m].
        left: The left end [m].
    """

    stamp: float
    origin: FloatArray
    passed: int
    places: FloatArray
    heights: FloatArray
    yaw: float
    overhang: float
    rise: float
    run: float
    covariance: FloatArray
    count_least: int
    count_most: int | None
    is_open: bool
    right: float
    left: float

    def __post_init__(self) -> None:
        for name in ("origin", "places", "heights", "covariance"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def going_up(self) -> bool:
        """Whether the flight goes up."""
        return self.rise > 0.0

    @property
    def direction(self) -> FloatArray:
        """Unit vector of the climb in W, (2,)."""
        return np.array([np.cos(self.yaw), np.sin(self.yaw)])

    def nosing_height(self, i: int) -> float:
        """Height of nosing `i` in W [m]: of the tread behind it going up, before it going down."""
        return float(self.heights[i + 1 if self.going_up else i])

    def sigma(self, which: str) -> float:
        """Deviation of `yaw`, `overhang`, `rise` or `run`."""
        at = 2 * len(self.places) + 1 + ("yaw", "overhang", "rise", "run").index(which)
        return float(np.sqrt(self.covariance[at, at]))

    @property
    def place_sigmas(self) -> FloatArray:
        """Deviations of the places, (n,) [m]."""
        n = len(self.places)
        return np.asarray(np.sqrt(np.diag(self.covariance)[:n]))

    @property
    def height_sigmas(self) -> FloatArray:
        """Deviations of the heights, (n + 1,) [m]."""
        n = len(self.places)
        return np.asarray(np.sqrt(np.diag(self.covariance)[n : 2 * n + 1]))

    @property
    def height_correlation(self) -> FloatArray:
        """How the errors of the treads' heights go together, without the floor's, (n, n)."""
        n = len(self.places)
        C = self.covariance[n + 1 : 2 * n + 1, n + 1 : 2 * n + 1]
        sigmas = np.sqrt(np.diag(C))
        return np.asarray(C / np.outer(sigmas, sigmas))

    def estimate(self, which: str) -> Estimate:
        """`yaw`, `overhang`, `rise` or `run` with its deviation."""
        return Estimate(value=float(getattr(self, which)), sigma=self.sigma(which))
