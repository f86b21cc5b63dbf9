"""What a course asks of a gait: its flights as endless staircases."""

import numpy as np

from drake_quad.design.staircase import Staircase
from drake_quad.terrain import Course

SAME = 1e-4  # [m]
MOST = 6  # kinds of steps that are looked at one by one


def flights_of(course: Course, deep: float = np.inf) -> list[Staircase]:
    """Every kind of step on the course, once; of many kinds those with extreme rises and runs.

    Args:
        course: The ground.
        deep: Depth of treads from which a flight is none, but floors with curbs between [m].
    """
    found: list[Staircase] = []
    for lane in course.lanes:
        for flight in lane.close_flights(deep):
            for i in range(flight.first, flight.last + 1):
                rise = float(lane.heights[i] - lane.heights[i - 1])
                run = float(lane.breaks[i + 1] - lane.breaks[i])
                if not any(abs(s.rise - rise) < SAME and abs(s.run - run) < SAME for s in found):
                    found.append(Staircase(rise, run))
    if len(found) <= MOST:
        return found
    keys = np.array([[s.rise, s.run, s.slope] for s in found])
    picked = {int(k) for k in (*keys.argmin(axis=0), *keys.argmax(axis=0))}
    return [found[k] for k in sorted(picked)]
