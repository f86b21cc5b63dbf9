"""Plans made by a process of their own: the same plans, and nobody waits for them."""

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from bus_rig import short_walk

from drake_quad.bus.plan_process import PlanProcess
from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.plan_job import PlanJob, RestJob, TaskJob
from drake_quad.simulation.prepared import PreparedScenario


@pytest.fixture(scope="module")
def prepared() -> PreparedScenario:
    return short_walk()


@pytest.fixture(scope="module")
def process(prepared: PreparedScenario) -> Iterator[PlanProcess]:
    with closing(PlanProcess(task_job(prepared, 0, prepared.stance))) as process:
        yield process


def task_job(prepared: PreparedScenario, index: int, stance: Stance) -> TaskJob:
    task = prepared.tasks[index]
    return TaskJob(prepared.robot, prepared.course, prepared.settings, task, stance, index)


def made_by(process: PlanProcess, job: PlanJob) -> MotionPlan:
    """The plan, asked for until it is there."""
    assert process.ask(job) is None  # nobody is kept waiting for it
    while (plan := process.ask(job)) is None:
        pass
    return plan


def arrays_of(value: Any) -> Iterator[np.ndarray]:
    """All arrays that a plan is made of."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield from arrays_of(one)
    elif isinstance(value, dict):
        for one in value.values():
            yield from arrays_of(one)
    elif hasattr(value, "__dict__"):
        yield from arrays_of(vars(value))


def test_plans_are_those_made_here(prepared: PreparedScenario, process: PlanProcess) -> None:
    """To the bit, and of arrays of the same kinds: for others kernels would be compiled anew."""
    stance = prepared.plan.plans[0].end
    moved = Stance(stance.body, stance.feet + np.array([0.005, 0.0, 0.0]))
    job = task_job(prepared, 1, moved)
    rest = RestJob(
        prepared.robot, prepared.course, prepared.settings, prepared.plan.plans[1], 0.0, moved.feet
    )
    for one in (job, rest):
        there, here = made_by(process, one), one.make()
        here.sample(0.0)
        here.contacts.feet_at(np.array([here.duration]))
        pairs = list(zip(arrays_of(there), arrays_of(here), strict=True))
        assert len(pairs) > 10
        for a, b in pairs:
            np.testing.assert_array_equal(a, b)
            for flag in ("WRITEABLE", "ALIGNED", "C_CONTIGUOUS", "F_CONTIGUOUS"):
                assert a.flags[flag] == b.flags[flag]


def test_no_plan_is_told_with_its_reason(prepared: PreparedScenario, process: PlanProcess) -> None:
    """What planning raises there is raised here, and the next job is done all the same."""
    stance = prepared.plan.plans[0].end
    away = np.array([100.0, 0.0, 0.0, 0.0, 0.0])
    far = Stance(stance.body + away, stance.feet + away[:3])
    with pytest.raises(PlanningError) as here:
        task_job(prepared, 1, far).make()
    with pytest.raises(PlanningError) as there:
        made_by(process, task_job(prepared, 1, far))
    assert there.value.reason == here.value.reason
    assert made_by(process, task_job(prepared, 1, stance)).index == 1


def test_a_process_that_ended_is_told(prepared: PreparedScenario) -> None:
    """Killed, it answers no more, and whoever asks is told so and waits for nothing."""
    first = task_job(prepared, 0, prepared.stance)
    process = PlanProcess(first)
    process.process.kill()
    process.process.join()
    with pytest.raises(PlanningError, match="has ended"):
        for _ in range(1000):
            process.ask(first)
    process.close()
