"""What is to be done, as a list of tasks that follow one another from rest to rest."""

from dataclasses import dataclass

from drake_quad.planning.settings import PlanSettings
from drake_quad.terrain import Course

END_CLEARANCE = 0.25  # [m] between the foremost foot and the end of the course


@dataclass(frozen=True, kw_only=True)
class Task:
    """One thing to do.

    Attributes:
        kind: `stand`, `walk` or `spin`.
        name: For people.
        lane: Index of the course's lane that it happens on.
        goal: For a walk: where along the lane the body is to end [m].
        angle: For a spin: by how much, counterclockwise positive [rad].
        duration: For a stand [s].
    """

    kind: str
    name: str
    lane: int
    goal: float = 0.0
    angle: float = 0.0
    duration: float = 0.0


def derive_mission(course: Course, settings: PlanSettings) -> tuple[Task, ...]:
    """Walks every lane of the course to its end, and turns where the course turns."""
    tasks = [Task(kind="stand", name="stand at the start", lane=0, duration=1.0)]
    for index, lane in enumerate(course.lanes):
        last = index == len(course.lanes) - 1
        ahead = 0.5 * settings.workspace.P_x + 0.25 * settings.stride + END_CLEARANCE
        goal = lane.length - ahead if last else lane.length
        tasks.append(Task(kind="walk", name=f"walk {index + 1}", lane=index, goal=goal))
        if not last:
            turn = course.turns[index]
            tasks.append(Task(kind="spin", name=f"spin {index + 1}", lane=index, angle=turn))
    tasks.append(
        Task(kind="stand", name="stand at the goal", lane=len(course.lanes) - 1, duration=1.0)
    )
    return tuple(tasks)
