"""The body's poses along a walk, each by itself: what no path through them could better.

A plan's path is held by the legs' limits at every moment, and by what lies between moments. A pose
alone is held by the former only: where at some moment none keeps the margin within the legs'
limits, no path does. To know that takes a tenth of a plan's time.
"""

from dataclasses import dataclass

import daqp
import numpy as np

from drake_quad.common import FloatArray, IntArray
from drake_quad.planning.body_path import BodyPathOptimizer
from drake_quad.planning.body_problem import margin_rows
from drake_quad.planning.body_reference import body_pitch
from drake_quad.planning.leg_limits import (
    LIMITS,
    SAFE,
    SHANK_NEAR,
    SHANK_SAFE,
    STEP,
    LegLimits,
    Shanks,
    find_limits,
    limit_distances,
)
from drake_quad.planning.plan_body import PASSES, ROUGH

EVERY = 4  # so many of the sampled moments are looked at: a stance lasts for dozens
ROUNDS = 12  # of linearisation
TRUST = 0.06  # of a leg: by which a pose moves in a round, along any axis
CLOSER = 0.4  # ratio of that after a round that made a pose worse
# What a move costs, along x and y, and of lift and tilt; what it costs to be short of the legs'
# limits or of the margin, and of the shanks' clearance, by distance and squared.
MOVE, RISE, SHORT, SHANK_SHORT, SQUARED = 0.02, 1.0, 1000.0, 100.0, 1e4
LEGS_COUNT = 10.0  # times as much as shanks', as in `LegLimits.short`
NONE = 1e30  # DAQP's bound that is none


@dataclass(frozen=True)
class Shortage:
    """What is short at the worst moments, each with the best pose that was found [m].

    Attributes:
        legs: Of the legs' limits; 0 if every moment has a pose within them.
        shanks: Of the clearance that shanks are to have, weighted as there; or 0.
    """

    legs: float
    shanks: float


class PoseSearch(BodyPathOptimizer):
    """Seeks the best pose for each moment, from a path on that knows the legs as boxes alone."""

    def shortage(self, margin: float) -> Shortage:
        """What is short where the static margin has to be so much [m].

        Raises:
            PlanningError: If there is not even a path that knows legs as boxes.
        """
        for _ in range(PASSES):
            self.follow(self.solve(broken=ROUGH))
        robot, settings, times = self._robot, self._settings, self._times
        reach = robot.geometry.reach
        far = SHANK_NEAR * float(reach.max()) + STEP + float(robot.shank_radii.max())
        shanks = Shanks(self._route.lane, settings.shank_room) if settings.shank_room else None
        body, (feet, _) = self.spline.samples(times)[:, 0], self.contacts.feet_at(times)
        place = np.zeros((len(times), 4))
        place[:, :2] = body[:, :2]

        def short(rows: IntArray) -> FloatArray:
            """Of legs and of shanks, (R, 2) [m]."""
            left = limit_distances(robot, body[rows], feet[rows], shanks, far).min(axis=1)
            sides = (left[:, :LIMITS], left[:, LIMITS:])
            return np.stack([-np.min(side, axis=1, initial=0.0) for side in sides], axis=-1)

        every = np.arange(0, len(times), EVERY)
        held = every[short(every).max(axis=1) > 0.0]
        if not len(held):
            return Shortage(0.0, 0.0)
        least, best = np.full((len(times), 2), np.inf), place.copy()
        trust = np.full(len(times), TRUST * float(reach.mean()))
        margins = self._margins(margin)
        left = held
        for k in range(ROUNDS + 1):
            found = short(left)
            better = found @ (LEGS_COUNT, 1.0) < least[left] @ (LEGS_COUNT, 1.0)
            least[left[better]], best[left[better]] = found[better], place[left[better]]
            worse = left[~better]
            place[worse], trust[worse] = best[worse], CLOSER * trust[worse]
            left = left[least[left].max(axis=1) > 0.0]
            if k == ROUNDS or not len(left):
                break
            self._pose(left, place, body)
            _, slope = self._route.ground(body[left, :2])
            heading = np.stack([np.cos(body[left, 4]), np.sin(body[left, 4])], axis=-1)
            limits = find_limits(
                robot, body[left], feet[left], slope[:, None] * heading, place[left], shanks
            )
            if limits is None:  # they were short before they moved
                break
            self._move(left, place, trust, limits, margins)
            self._pose(left, place, body)
        legs, of_shanks = least[held].max(axis=0, initial=0.0)
        return Shortage(float(legs), float(of_shanks))

    def _margins(self, margin: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The margin's rows n · (x, y) >= lower, moment by moment, and where each one's begin."""
        assert self._frame is not None  # `solve` made it
        sides = self._frame.sides
        rows, count = margin_rows(self._problem(), sides), len(sides.sample)
        order = np.argsort(sides.sample, kind="stable")
        lower = (rows.lower[:count] + margin * sides.weight)[order]
        starts = np.searchsorted(sides.sample[order], np.arange(len(self._times) + 1))
        return rows.normal[:count][order], lower, starts

    def _pose(self, rows: IntArray, place: FloatArray, body: FloatArray) -> None:
        """Writes bodies (N, 5) of some places (N, 4): x, y, lift and tilt [m]."""
        height, slope = self._route.ground(place[rows, :2])
        body[rows, :2] = place[rows, :2]
        body[rows, 2] = height + self._settings.body_height + place[rows, 2]
        pitch = body_pitch(self._settings.pitch_along_slope, slope)
        body[rows, 3] = pitch + place[rows, 3] / self._arm

    def _move(
        self,
        rows: IntArray,
        place: FloatArray,
        trust: FloatArray,
        limits: LegLimits,
        margins: tuple[FloatArray, FloatArray, IntArray],
    ) -> None:
        """Moves places (N, 4) to where the limits around them leave the least short."""
        nominal, _ = self._route.at(self._times)
        most = self._settings.max_shift
        ranges = self._lift_range(self._times)
        lowest = np.column_stack([nominal - most, ranges[:, 0].T])
        highest = np.column_stack([nominal + most, ranges[:, 1].T])
        safe = np.where(limits.shank, SHANK_SAFE, SAFE) * float(self._robot.geometry.reach.mean())
        offset = limits.offset - safe
        weights = np.array([MOVE, MOVE, RISE, RISE, SQUARED, SQUARED])
        normals, lower, starts = margins
        for i, k in enumerate(rows):
            mine, side = limits.sample == i, slice(starts[k], starts[k + 1])
            count, more = int(mine.sum()), starts[k + 1] - starts[k]
            A = np.zeros((count + more, 6))
            A[:count, :4] = limits.normal[mine]
            A[:count, 4], A[:count, 5] = ~limits.shank[mine], limits.shank[mine]
            A[count:, :2], A[count:, 4] = normals[side], 1.0
            cost = np.append(-weights[:4] * place[k], [SHORT, SHANK_SHORT])
            least = np.maximum(lowest[k], np.minimum(place[k], highest[k]) - trust[k])
            greatest = np.minimum(highest[k], np.maximum(place[k], lowest[k]) + trust[k])
            x, _, status, _ = daqp.solve(
                np.diag(weights), cost, A,
                np.concatenate([greatest, np.full(2 + len(A), NONE)]),
                np.concatenate([least, [0.0, 0.0], offset[mine], lower[side]]),
                np.zeros(6 + len(A), dtype=np.int32),
            )  # fmt: skip
            if status > 0:
                place[k] = x[:4]
