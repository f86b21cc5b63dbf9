"""The course laid out straight: how far along it a point is, over the lanes one after another."""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.report.motion import base_motion, calc_foot_centres
from drake_quad.report.run_files import Run
from drake_quad.terrain import Course, Lane

HEADING_WEIGHT = 0.5  # [m/rad] on a landing, both lanes are near: the heading tells them apart


@dataclass(frozen=True, eq=False)
class SideView:
    """A run seen from the side, along the lanes one after another.

    Attributes:
        com: (N, 2) along the course and height [m]; nan between two lanes.
        feet: (N, 4, 2) the lowest points of the feet, likewise.
        lane: (N,) index of the lane that the body is on; -1 where its place is not known.
    """

    com: FloatArray
    feet: FloatArray
    lane: np.ndarray[tuple[int, ...], np.dtype[np.intp]]


def lane_starts(course: Course) -> FloatArray:
    """How far along the course each lane begins, (n,) [m]."""
    lengths = [lane.length for lane in course.lanes]
    return np.concatenate([[0.0], np.cumsum(lengths)[:-1]])


def unroll(run: Run) -> SideView:
    """The centre of mass and the feet of a run, seen from the side."""
    base, com, feet = base_motion(run), run.log.vector("com"), calc_foot_centres(run)
    cost = np.stack(
        [
            distance_to(lane, base.p_WB) + HEADING_WEIGHT * np.abs(_turn(base.rpy[:, 2], lane.yaw))
            for lane in run.world.lanes
        ]
    )
    known = np.isfinite(cost).all(axis=0)
    lane_of = np.where(known, np.argmin(np.where(known, cost, 0.0), axis=0), -1)
    com_out = np.full((len(com), 2), np.nan)
    feet_out = np.full((len(com), 4, 2), np.nan)
    for k, (lane, start) in enumerate(zip(run.world.lanes, lane_starts(run.world), strict=True)):
        mine = lane_of == k
        s, _ = lane.coordinates(com[mine])
        com_out[mine] = np.column_stack([start + s, com[mine, 2]])
        s, _ = lane.coordinates(feet[mine])
        feet_out[mine] = np.stack([start + s, feet[mine, :, 2] - run.robot.foot_radius], axis=-1)
    return SideView(com_out, feet_out, lane_of)


def distance_to(lane: Lane, p_W: FloatArray) -> FloatArray:
    """Horizontal distance of places (N, 2 or 3) in W from the lane's middle line, (N,) [m]."""
    s, lateral = lane.coordinates(p_W)
    beyond = np.maximum(np.maximum(-s, s - lane.length), 0.0)
    return np.asarray(np.hypot(beyond, lateral))


def _turn(a: FloatArray, b: float) -> FloatArray:
    """The angle a - b [rad], in [-π, π)."""
    return np.asarray(np.remainder(a - b + np.pi, 2.0 * np.pi) - np.pi)
