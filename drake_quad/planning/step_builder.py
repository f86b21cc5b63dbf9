"""Puts steps one after another, with swing legs that clear the lane's ground."""

import cmath
from collections.abc import Sequence
from dataclasses import replace
from math import hypot

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.swing import Swing, plan_swing
from drake_quad.gait.swing_clearance import inflate_profile
from drake_quad.planning.contact_plan import ContactPlan, Step
from drake_quad.planning.problem import PlanSettings
from drake_quad.robot.legs import Leg
from drake_quad.terrain.lane import Lane

STILL = 1e-3  # [m]: a step shorter than this is not taken
ARC_SAMPLES = 41  # places under an arc whose ground is looked at
LEVEL = 1e-6  # [m] by which that may differ in height
ONE_LEVEL = 0.01  # [m] by which a swing's ends may: a standing foot is not quite where it is mapped


STEEPEST = 1.875  # of a quintic from 0 to 1 in a time of 1


def peak_speed(swing: Swing) -> float:
    """The most of a foot's speeds in a straight swing: along the ground, up, and down [m/s]."""
    way = swing.p_end - swing.p_start
    up = (swing.apex_z - float(swing.p_start[2])) / swing.apex_time
    down = (swing.apex_z - float(swing.p_end[2])) / (swing.duration - swing.apex_time)
    return STEEPEST * max(hypot(float(way[0]), float(way[1])) / swing.duration, up, down)


def goes(swing: Swing) -> int:
    """1 if a swing ends higher than it begins, -1 if lower, 0 if neither."""
    rise = float(swing.p_end[2] - swing.p_start[2])
    return 0 if abs(rise) <= ONE_LEVEL else 1 if rise > 0.0 else -1


class StepBuilder:
    """Collects steps from a stance on; `time` and `feet` say where it has got to.

    Args:
        lane: The ground.
        feet: Foot sphere centres at first, (4, 3) [m] in W.
        foot_radius: [m].
        clearance: Δh beyond the foot's radius [m].
        map_error_place: Position error of the map's risers, see `inflate_profile` [m].
        map_error_height: Height error of its treads [m].
        swing_speed: Speed of a foot that calm swings do not exceed [m/s]; 0: there is no such.
        swing_speeds: The same of swings up, and of swings down, leg by leg (2, 4) [m/s]; 0: as
            `swing_speed` has it.
    """

    def __init__(
        self,
        lane: Lane,
        feet: FloatArray,
        *,
        foot_radius: float,
        clearance: float,
        map_error_place: float = 0.0,
        map_error_height: float = 0.0,
        swing_speed: float = 0.0,
        swing_speeds: Sequence[Sequence[float]] = ((0.0,) * 4, (0.0,) * 4),
    ) -> None:
        self.lane = lane
        self.start = np.array(feet)
        self.feet = np.array(feet)
        self.time = 0.0
        self.steps: list[Step] = []
        self._radius = foot_radius
        self._clearance = clearance
        self._place_error, self._height_error = map_error_place, map_error_height
        self._swing_speed, self._swing_speeds = swing_speed, swing_speeds

    @classmethod
    def of_settings(
        cls, lane: Lane, feet: FloatArray, foot_radius: float, settings: PlanSettings
    ) -> "StepBuilder":
        """A builder whose swings clear the ground as the settings say."""
        return cls(
            lane,
            feet,
            foot_radius=foot_radius,
            clearance=settings.swing_clearance,
            map_error_place=settings.map_error_place,
            map_error_height=settings.map_error_height,
            swing_speed=settings.swing_speed,
            swing_speeds=settings.swing_speeds,
        )

    def wait(self, duration: float) -> None:
        """Stands on four feet for `duration` [s]."""
        self.time += duration

    def ground(self, p_W: FloatArray) -> float:
        """Height of a foot's centre that stands at `p_W` (2,) [m].

        Raises:
            PlanningError: If there is no ground.
        """
        s, lateral = self.lane.coordinates(p_W)
        height, here = float(self.lane.height(s)), int(self.lane.interval(s))
        half_width = float(self.lane.half_widths[here])
        if np.isnan(height) or abs(float(lateral)) > half_width - self._radius:
            raise PlanningError(
                f"a foot would have to stand at {float(s):.2f} m along the lane, "
                f"{float(lateral):.2f} m to its left, beyond the ground; make it longer or wider",
                place=np.asarray(p_W).tolist(),
            )
        # On a slope the sphere's centre is over the place, and it touches a little beside it.
        return height + self._radius * hypot(1.0, float(self.lane.gradients[here]))

    def step(
        self,
        leg: Leg,
        to: FloatArray,
        duration: float,
        *,
        lift_off: float,
        pivot: FloatArray | None = None,
    ) -> None:
        """Swings `leg` to the place `to` (2,) in W, from time `lift_off` [s] on.

        Straight there, or round `pivot` (2,) [m] by less than half a turn.
        """
        p_from = self.feet[leg.row]
        p_to = np.array([to[0], to[1], self.ground(to)])
        if float(np.hypot(*(p_to - p_from)[:2])) < STILL:
            return
        if pivot is None:
            swing = self._swing(p_from, p_to, duration)
        else:
            swing = self._arc(p_from, p_to, duration, pivot)
        self.steps.append(Step(leg, lift_off, lift_off + duration, swing))
        self.feet[leg.row] = p_to
        self.time = lift_off + duration

    def swing(self, p_from: FloatArray, to: FloatArray, duration: float) -> Swing:
        """The swing from `p_from` (3,) to the place `to` (2,) in W, which is not taken yet.

        Raises:
            PlanningError: If there is no ground at `to`, or no arc clears what is on the way.
        """
        return self._swing(p_from, np.array([to[0], to[1], self.ground(to)]), duration)

    def lasts(self, leg: Leg, to: FloatArray, duration: float) -> float:
        """How long a swing of `leg` to the place `to` (2,) lasts, at least `duration` [s].

        It lasts longer if the foot would be faster than it is to be, along the ground, up or down.

        Raises:
            PlanningError: As `swing`.
        """
        if self._swing_speed <= 0.0:
            return duration
        swing = self.swing(self.feet[leg.row], to, duration)
        going = goes(swing)
        own = 0.0 if going == 0 else self._swing_speeds[0 if going > 0 else 1][leg.row]
        return max(duration, duration * peak_speed(swing) / (own or self._swing_speed))

    def _swing(self, p_from: FloatArray, p_to: FloatArray, duration: float) -> Swing:
        """The swing to where the foot's centre will be, (3,)."""
        length = float(np.hypot(*(p_to - p_from)[:2]))
        s, _ = self.lane.coordinates(np.stack([p_from[:2], p_to[:2]]))
        d, z = self.lane.profile(float(s[0]), float(s[1]))
        # A foot that slipped off the lane's end stands on something that the map does not have.
        z = np.where(np.isnan(z), p_from[2] - self._radius, z)
        d, z = self._with_room(d, z)
        if d[-1] > 1e-9:
            d = d * (length / d[-1])  # the swing may go sideways as well
        else:
            d, z = np.array([0.0, length]), np.array([z[0], z[0]])
        return plan_swing(
            p_from,
            p_to,
            duration=duration,
            profile=(d, z),
            clearance=self._radius + self._clearance,
            foot_radius=self._radius,
            calm=self._swing_speed > 0.0,
        )

    def _arc(
        self, p_from: FloatArray, p_to: FloatArray, duration: float, pivot: FloatArray
    ) -> Swing:
        """The swing round `pivot` (2,) over level ground.

        Raises:
            PlanningError: If the ground on the way is not level.
        """
        before, after = (complex(*(p[:2] - pivot)) for p in (p_from, p_to))
        turn = cmath.phase(after / before)
        straight = plan_swing(
            p_from,
            p_to,
            duration=duration,
            profile=(
                np.array([0.0, float(np.hypot(*(p_to - p_from)[:2]))]),
                np.full(2, p_to[2] - self._radius),
            ),
            clearance=self._radius + self._clearance + self._height_error,
            foot_radius=self._radius,
        )
        swing = replace(straight, pivot=pivot, turn=turn)
        s, _ = self.lane.coordinates(
            swing.positions(np.linspace(0.0, duration, ARC_SAMPLES))[:, :2]
        )
        heights = self.lane.height(s)
        if np.nanmax(np.abs(heights - (p_to[2] - self._radius))) > LEVEL:
            raise PlanningError(
                "the ground under a spin's arcs is not level; spin farther from the stairs, or "
                "with spin.swing_path: chord"
            )
        return swing

    def _with_room(self, d: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The profile inflated by the map's errors: risers' and treads', not those of slopes."""
        if self._place_error <= 0.0 and self._height_error <= 0.0:
            return d, z
        rise = np.insert(np.cumsum(np.where(np.diff(d) > 0.0, np.diff(z), 0.0)), 0, 0.0)
        steps = z - rise if not np.any(rise) else np.round(z - rise, 9)
        at, height = inflate_profile(d, steps, place=self._place_error, height=self._height_error)
        if not np.any(rise):
            return at, height
        bends = np.setdiff1d(d, at)
        height = np.concatenate([height, np.interp(bends, at, height)])
        at = np.concatenate([at, bends])
        order = np.argsort(at, kind="stable")
        return at[order], height[order] + np.interp(at[order], d, rise)

    def finish(self) -> ContactPlan:
        """The steps as a ContactPlan that ends now."""
        return ContactPlan(self.start, tuple(self.steps), self.time)
