"""What the body's program is given, and what it answers."""

from dataclasses import dataclass

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.leg_limits import LegLimits


@dataclass(frozen=True, kw_only=True)
class BodyProblem:
    """What the quadratic program is given. Arrays over `times` have one row a time.

    Where legs are at their limits, the body may also lift and tilt: rise above its route, and pitch
    more than that asks for, the angle times a leg's length [m]. Both are 0 at both ends.

    Attributes:
        contacts: Who stands where, when.
        times: Sampled times (N,) [s].
        nominal: Nominal places of the body's centre, (N, 2) [m].
        heading: Unit vector of the body's x in W, (N, 2).
        com_gain: How much of a shift of the body, the feet standing, the whole robot's centre of
            mass makes, along x and y of W (2,).
        com_offset: The centre of mass less `com_gain` times the body's centre, (N, 2) [m].
        com_offset_acceleration: Its second time derivative, (N, 2) [m/s^2].
        com_height: Above the feet, (N,) [m].
        reach_centres: Workspace centres of the feet in B, (4, 2) [m].
        reach: Half-sizes of the legs' boxes along and across the heading, (2,) [m].
        max_shift: How far the body may be from its nominal place: across its heading always,
            along it where the nominal place stands still [m].
        max_ahead: The same along its heading where the nominal place moves [m].
        margin_desired: No more static margin than this is asked for [m].
        zmp_margin_desired: The same for the zero-moment point [m].
        static: Whether the static margin is asked for at all.
        guard: For how long before lift-off and after touchdown three feet have to do already [s].
        knot: Knot spacing [s].
        limits: Of the legs, where they are in the way.
        lift_range: Least and most lift, and least and most tilt [m].
    """

    contacts: ContactPlan
    times: FloatArray
    nominal: FloatArray
    heading: FloatArray
    com_gain: FloatArray
    com_offset: FloatArray
    com_offset_acceleration: FloatArray
    com_height: FloatArray
    reach_centres: FloatArray
    reach: FloatArray
    max_shift: float
    max_ahead: float
    margin_desired: float
    zmp_margin_desired: float
    static: bool = True
    guard: float = 0.15
    knot: float = 0.2
    limits: LegLimits | None = None
    lift_range: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))

    @property
    def axes(self) -> int:
        """Of the path: x and y, or these and lift and tilt."""
        return 2 if self.limits is None else 4


@dataclass(frozen=True, eq=False)
class BodySolution:
    """What the program found.

    Attributes:
        control: The control points (n, axes) [m].
        margin: The static margin that the program believes in [m].
        zmp_margin: The same for the zero-moment point [m].
        path: Value, velocity, acceleration at the sampled times, (N, 3, axes).
        scalars: The program's scalars, see `body_rows` (5,) [m].
    """

    control: FloatArray
    margin: float
    zmp_margin: float
    path: FloatArray
    scalars: FloatArray
