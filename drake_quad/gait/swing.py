"""The swing leg: rest-to-rest quintics (section II-A, equations (1) to (3)).

Horizontally a swing is one quintic over its whole duration; vertically two that meet, at rest, at
the apex time. Positions are in any frame that stands still during the swing, z up. A swing of a
spin may go round the body's pivot (section II-B) instead of straight: by that quintic in angle.
"""

import cmath
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.gait.swing_clearance import Profile, find_apex
from drake_quad.math.curves import quintic, quintic_acceleration, quintic_inverse, quintic_rate

Arc = tuple[float, float, float, float]  # pivot x and y [m], turn [rad], end over start distance
STRAIGHT: Arc = (0.0, 0.0, 0.0, 1.0)
ON_ARC = 1e-6  # [m]


@dataclass(frozen=True, eq=False)
class Swing:
    """One swing of a foot.

    Args:
        p_start: (3,) where it lifts off [m].
        p_end: (3,) where it touches down [m].
        duration: T_sw [s].
        apex_time: When the two vertical quintics meet [s], inside (0, duration): the paper's t_s.
        apex_z: Height at that time [m]: the paper's h_s + delta_h.
        pivot: (2,) what the foot goes round [m], its distance from there changing evenly with the
            angle; None: it goes straight.
        turn: Angle by which it goes round the pivot, left positive [rad].

    Raises:
        ValueError: The times are not 0 < apex_time < duration, a shape is wrong, or `turn` does not
            lead round `pivot` to `p_end`.
    """

    p_start: FloatArray
    p_end: FloatArray
    duration: float
    apex_time: float
    apex_z: float
    pivot: FloatArray | None = None
    turn: float = 0.0
    _ends: tuple[float, ...] = field(init=False, repr=False)
    _arc: Arc = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "p_start", read_only(self.p_start))
        object.__setattr__(self, "p_end", read_only(self.p_end))
        if self.p_start.shape != (3,) or self.p_end.shape != (3,):
            raise ValueError("a swing's p_start and p_end are points in space, shape (3,)")
        if not 0.0 < self.apex_time < self.duration:
            raise ValueError(
                f"apex_time = {self.apex_time}: must be inside the swing, (0, {self.duration})"
            )
        object.__setattr__(self, "_ends", (*self.p_start.tolist(), *self.p_end.tolist()))
        object.__setattr__(self, "_arc", self._round_pivot())

    @property
    def arc(self) -> Arc:
        """Pivot x and y [m], turn [rad], and how many times as far from there as it begins it ends.

        A turn of 0 is none.
        """
        return self._arc

    def _round_pivot(self) -> Arc:
        if self.pivot is None:
            return STRAIGHT
        object.__setattr__(self, "pivot", read_only(self.pivot))
        x, y = self.pivot.tolist()
        start, end = (complex(p[0] - x, p[1] - y) for p in (self.p_start, self.p_end))
        if self.turn == 0.0 or start == 0.0:
            raise ValueError("a swing about a pivot turns, and does not start in it")
        farther = abs(end) / abs(start)
        if abs(start * farther * cmath.rect(1.0, self.turn) - end) > ON_ARC:
            raise ValueError(
                f"turn = {self.turn}: does not lead round {self.pivot} to {self.p_end}"
            )
        return x, y, self.turn, farther

    def sample(self, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns position [m], velocity [m/s] and acceleration [m/s^2], (3,) each, at t [s].

        Before the start and after the end the foot rests where it then is.
        """
        x0, y0, z0, x1, y1, z1 = self._ends
        t = min(max(t, 0.0), self.duration)
        scale = 1.0 / self.duration
        q, dq, ddq = _quintics(t * scale)
        dq, ddq = dq * scale, ddq * scale * scale
        dx, dy = x1 - x0, y1 - y0
        if t <= self.apex_time:
            scale, rise, base, since = 1.0 / self.apex_time, self.apex_z - z0, z0, t
        else:
            scale, rise = 1.0 / (self.duration - self.apex_time), z1 - self.apex_z
            base, since = self.apex_z, t - self.apex_time
        r, dr, ddr = _quintics(since * scale)
        if self._arc[2] != 0.0:
            x, y, turn, farther = self._arc
            # p = pivot + (start - pivot) (1 + (farther - 1) q) exp(i turn q), and its derivatives
            grown, more = 1.0 + (farther - 1.0) * q, farther - 1.0
            way = complex(x0 - x, y0 - y) * cmath.rect(1.0, turn * q)
            place = way * grown
            rate = way * complex(more, turn * grown)
            bend = way * complex(-turn * turn * grown, 2.0 * turn * more)
            v, a = rate * dq, bend * dq * dq + rate * ddq
            return (
                np.array((x + place.real, y + place.imag, base + rise * r)),
                np.array((v.real, v.imag, rise * dr * scale)),
                np.array((a.real, a.imag, rise * ddr * scale * scale)),
            )
        return (
            np.array((x0 + dx * q, y0 + dy * q, base + rise * r)),
            np.array((dx * dq, dy * dq, rise * dr * scale)),
            np.array((dx * ddq, dy * ddq, rise * ddr * scale * scale)),
        )

    def positions(self, times: ArrayLike) -> FloatArray:
        """Returns (N, 3), the positions [m] at the (N,) times [s]."""
        times = np.asarray(times, dtype=np.float64)
        return swing_positions([self], np.zeros(len(times), dtype=np.intp), times)


def swing_positions(
    swings: Sequence[Swing], which: NDArray[np.intp], times: FloatArray
) -> FloatArray:
    """Returns (N, 3): of swing `which` (N,) of many, the position [m] at its time (N,) [s]."""
    ends = np.array([swing._ends for swing in swings])[which]
    timing = [(swing.duration, swing.apex_time, swing.apex_z) for swing in swings]
    duration, apex_time, apex_z = np.array(timing)[which].T
    t = np.minimum(np.maximum(times, 0.0), duration)
    along = quintic(t / duration)[:, None]
    p: FloatArray = (1.0 - along) * ends[:, :3] + along * ends[:, 3:]
    arcs = np.array([swing.arc for swing in swings])[which]
    round_pivot = arcs[:, 2] != 0.0
    if np.any(round_pivot):
        pivot, turn, farther = np.split(arcs[round_pivot], [2, 3], axis=1)
        q = along[round_pivot]
        x, y = ((ends[round_pivot, :2] - pivot) * (1.0 + (farther - 1.0) * q)).T
        c, s = np.cos(turn * q)[:, 0], np.sin(turn * q)[:, 0]
        p[round_pivot, :2] = pivot + np.stack([c * x - s * y, s * x + c * y], axis=-1)
    rising = quintic(np.minimum(t / apex_time, 1.0))
    falling = quintic(np.maximum((t - apex_time) / (duration - apex_time), 0.0))
    z_start, z_end = ends[:, 2], ends[:, 5]
    p[:, 2] = z_start + (apex_z - z_start) * rising + (z_end - apex_z) * falling
    return p


def _quintics(s: float) -> tuple[float, float, float]:
    """Returns the quintic and its first two derivatives at s."""
    return quintic(s), quintic_rate(s), quintic_acceleration(s)


def paper_swing(
    *, x_f: float, z_f: float, duration: float, d_s: float, h_s: float, delta_h: float
) -> Swing:
    """Returns equations (1) to (3): a point foot's swing in the plane y = 0, from the origin.

    Args:
        x_f: Final position along x [m].
        z_f: Final height [m].
        duration: T_sw [s].
        d_s: Where along x the chosen riser is [m], strictly between 0 and x_f.
        h_s: Height of the stair at that riser [m].
        delta_h: Height of the foot above that stair there [m].

    Raises:
        ValueError: `d_s` is not on the way.
    """
    return Swing(
        p_start=np.zeros(3),
        p_end=np.array([x_f, 0.0, z_f]),
        duration=duration,
        apex_time=duration * quintic_inverse(d_s / x_f),
        apex_z=h_s + delta_h,
    )


def plan_swing(
    p_start: ArrayLike,
    p_end: ArrayLike,
    *,
    duration: float,
    profile: Profile,
    clearance: float,
    foot_radius: float,
    lift: float | None = None,
    calm: bool = False,
) -> Swing:
    """Returns the lowest swing of a spherical foot that clears the terrain on its way.

    The apex is over the paper's riser (`riser_for_swing`) and as high as the paper has it; where
    that does not clear everything, the apex is raised by the least amount, and moved in time
    where this saves much height. On flat ground it is at mid-swing.

    Args:
        p_start: (3,) centre of the foot's sphere at lift-off [m].
        p_end: (3,) centre of the foot's sphere at touchdown [m].
        duration: T_sw [s].
        profile: Terrain along the straight line from start to end, see `swing_clearance`.
        clearance: Least distance of the centre from every nosing passed, and least height over
            every tread passed [m]: the foot's radius plus the paper's delta_h.
        foot_radius: Least height of the centre over the start's and the end's own ground [m].
        lift: Least height of the apex over the higher end [m]; `clearance - foot_radius` if None.
        calm: Whether it is the calmest instead: the foot goes up and down no faster than it has to.

    Raises:
        PlanningError: No arc clears the terrain, because a foothold is too close to a riser.
            Its data holds the best arc, `swing`, and by how much that one falls short.
        ValueError: The profile does not cover the swing.
    """
    start, end = np.asarray(p_start, dtype=np.float64), np.asarray(p_end, dtype=np.float64)
    apex = find_apex(
        length=float(np.hypot(*(end - start)[:2])),
        z_ends=(float(start[2]), float(end[2])),
        profile=profile,
        clearance=clearance,
        foot_radius=foot_radius,
        lift=clearance - foot_radius if lift is None else lift,
        calm=calm,
    )
    swing = Swing(start, end, duration, apex.phase * duration, apex.z)
    if apex.shortfall > 0.0:
        raise PlanningError(
            f"no swing from {start.round(3).tolist()} to {end.round(3).tolist()} clears the "
            f"terrain: the best is {1e3 * apex.shortfall:.1f} mm too close to it; "
            "a foothold is too close to a riser",
            swing=swing,
            shortfall=apex.shortfall,
        )
    return swing
