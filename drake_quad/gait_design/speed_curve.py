"""How fast for how much margin: one robot's gait on one course, with other and other times.

Each point is a whole plan of the course by the real planner, that keeps what is safe: its scenario
can be saved and run. Points differ by how long swings last, and the time on four feet at the
switches. If there is a gait that goes farther in a cycle than the one that was found for margin, it
is that gait's times that are varied.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.pace import PlanPace, measure_pace
from drake_quad.gait_design.preference import GaitPreference, RequiredMargins
from drake_quad.gait_design.quicken import Proven
from drake_quad.gait_design.tempo_planner import GaitChoice
from drake_quad.gait_design.tempo_search import TempoSearch
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import course_of, mission_of

# Ratios of the shortest swing, and of the usual time at switches, that are planned.
TIMES = ((1.55, 1.8), (1.4, 1.3), (1.25, 1.0), (1.12, 0.8), (1.0, 0.6), (1.0, 0.5))


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """A gait on the curve.

    Attributes:
        designed: The gait with its plan; its scenario can be run.
        speed: Speed of the body on the slowest flight [m/s].
        time: Time for that flight [s].
        margin: Least static margin of the plan [m].
        zmp_margin: Least margin of its zero-moment point [m].
        joint_share: The most that is asked of a joint's speed, over its limit.
    """

    designed: Designed
    speed: float
    time: float
    margin: float
    zmp_margin: float
    joint_share: float


@dataclass(frozen=True, eq=False)
class SpeedCurve:
    """Speed against margin, for one robot on one course.

    Attributes:
        robot: The robot's name.
        points: The gaits of which no other is both quicker and has more margin, from slow to quick.
    """

    robot: str
    points: tuple[CurvePoint, ...]

    def as_dict(self) -> dict[str, Any]:
        """The points as plain values in SI units."""
        names = ("speed", "time", "margin", "zmp_margin", "joint_share")
        return {
            "robot": self.robot,
            "points": [{name: getattr(p, name) for name in names} for p in self.points],
        }


def trace_curve(
    designed: Designed,
    robot: RobotModel,
    *,
    others: Iterable[GaitChoice] = (),
    source: str = "scenario",
    note: Callable[[str], object] = lambda _: None,
) -> SpeedCurve:
    """Plans a gait with other times, and keeps what is not beaten in both speed and margin.

    A plan of which less is proven than of the gait that was found for margin is no point.

    Args:
        designed: A gait that was found for margin, with its plan.
        robot: The scenario's.
        others: Gaits that go farther in a cycle; the times of the first of these are varied that
            has a plan, or those of `designed` if none has.
        source: What an error names.
        note: Receives a line before each plan.
    """
    course = course_of(designed.scenario, source=source, foot_radius=robot.foot_radius)
    tasks = mission_of(designed.scenario, course, source=source)
    points = _point(designed, measure_pace(robot, course, tasks, designed.plan))
    if flights_of(course, designed.scenario.gait.deep_tread):
        least = GaitPreference("speed").least_margin(robot, designed.margin)
        safe, proven = RequiredMargins(least, least), Proven(designed, robot, course)
        note("looking for a gait that goes farther in a cycle")
        own = GaitChoice(designed.scenario, designed.design, planned=True)
        for gait in chain(others, [own]):
            search = TempoSearch(gait, designed, robot, safe, source)
            found = [t for t in search.spread(TIMES, note) if proven.as_good(t.designed)]
            points += [p for trial in found for p in _point(trial.designed, trial.pace)]
            if found:
                break
    return SpeedCurve(robot.name, tuple(_unbeaten(points)))


def _point(designed: Designed, pace: PlanPace) -> list[CurvePoint]:
    """A plan as a point, if it goes along a flight at all."""
    if pace.slowest is None:
        return []
    share = 0.0 if pace.peak is None else pace.peak.share
    speed, time = pace.slowest.speed, pace.slowest.time
    return [CurvePoint(designed, speed, time, designed.margin, pace.zmp_margin, share)]


def _unbeaten(points: list[CurvePoint]) -> list[CurvePoint]:
    """Those that none is both quicker and safer than, from slow to quick."""
    best: list[CurvePoint] = []
    most = -np.inf
    for point in sorted(points, key=lambda p: (-p.speed, -p.margin)):
        if point.margin > most:
            best.append(point)
            most = point.margin
    return best[::-1]
