"""When, whence and how hard to push."""

from collections.abc import Sequence
from typing import Any

from drake_quad.planning.mission import MissionPlan

FIRST, LAST = 1.0, 2.0  # [s] after the start, and before the plan's end, in which nobody pushes
KICK = 0.1  # [s]
GOLDEN = 0.6180339887498949  # its multiples fill [0, 1) evenly and are in step with nothing


def moments(plan: MissionPlan, count: int, *, time_step: float) -> list[float]:
    """Times spread evenly over the run, one in each segment at least [s].

    A segment has as many cells of equal length as it has moments. The moment in a cell is at
    another place in each, so that the moments are not in step with the gait.

    Args:
        plan: Plan of the whole mission.
        count: How many; more if there are more segments.
        time_step: Time step of the plant [s]; moments are whole steps.
    """
    stretches = _stretches(plan)
    cells = _shares([end - start for start, end in stretches], count)
    times: list[float] = []
    for (start, end), n in zip(stretches, cells, strict=True):
        for i in range(n):
            place = (GOLDEN * (len(times) + 1)) % 1.0
            time = start + (end - start) * (i + place) / n
            times.append(round(round(time / time_step) * time_step, 9))
    return times


def make_pushes(
    times: Sequence[float], *, speeds: Sequence[float], directions: int, to_goal: int
) -> list[dict[str, Any]]:
    """Every push, by its moment, then speed, then direction.

    Args:
        times: The moments [s].
        speeds: What the pushes are worth [m/s].
        directions: How many, evenly all round from straight ahead.
        to_goal: One trial in so many goes on to the goal.
    """
    pushes = [
        (t, v, 360.0 * d / directions) for t in times for v in speeds for d in range(directions)
    ]
    return [
        {
            "time": t,
            "duration": KICK,
            "speed": speed,
            "direction_deg": direction,
            # Not every n-th: that would always be the same direction.
            "to_goal": (GOLDEN * number) % 1.0 < 1.0 / to_goal,
        }
        for number, (t, speed, direction) in enumerate(pushes)
    ]


def _stretches(plan: MissionPlan) -> list[tuple[float, float]]:
    """Start and end of every segment in the run [s], without its first and last seconds."""
    begun, found = 0.0, []
    for task in plan.plans:
        for segment in task.segments:
            start = max(begun + segment.start, FIRST)
            end = min(begun + segment.end, plan.duration - LAST)
            if end > start:
                found.append((start, end))
        begun += task.duration
    return found


def _shares(lengths: Sequence[float], count: int) -> list[int]:
    """Whole numbers of `count` in all, as the lengths are, none of them 0."""
    shares = [1] * len(lengths)
    while sum(shares) < count:
        # To the one whose cells are the longest.
        longest = max(range(len(lengths)), key=lambda k: lengths[k] / shares[k])
        shares[longest] += 1
    return shares
