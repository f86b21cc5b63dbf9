"""The planner alone: it plans from the feet as they stand, once a task, and keeps its plan."""

import numpy as np
import pytest
from growing_rig import phase_of
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context
from rig import (
    LatePlans,
    feet_of,
    fix_inputs,
    flat_course,
    model_layout,
    paper_robot,
    stance_at,
    state_of,
)

from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase
from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.planning.plan_job import PlanMaker
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.systems.transition_planner import AS_PLANNED, TransitionPlanner

SETTINGS = PlanSettings()
WALK = Task(kind="walk", name="walk", lane=0, goal=3.25)
STAND = Task(kind="stand", name="stand", lane=0, duration=1.0)
TURN = Task(kind="spin", name="turn", lane=0, angle=np.pi / 4)


def state_with(seed: int | None = None, scale: float = 0.02) -> FloatArray:
    """The robot at the start, its feet moved about at random along the ground."""
    stance = stance_at(flat_course(), SETTINGS)
    feet, body = np.array(stance.feet), np.array(stance.body)
    if seed is not None:
        rng = np.random.default_rng(seed)
        feet[:, :2] += rng.uniform(-scale, scale, (4, 2))
        body += rng.uniform(-0.01, 0.01, 5)
    return state_of(body, feet)


class Planner:
    """A planner in a simulator of its own."""

    def __init__(
        self, *mission: Task, state: FloatArray | None = None, maker: PlanMaker | None = None
    ) -> None:
        self.system = TransitionPlanner(
            robot=paper_robot(),
            layout=model_layout(),
            course=flat_course(),
            settings=SETTINGS,
            mission=mission,
            maker=maker,
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.give(0, state_with() if state is None else state)

    def give(self, task: int, state: FloatArray) -> None:
        """Sets the task under way and the robot's state from now on."""
        phase = phase_of(task)
        fix_inputs(self.system, self.context, gait_phase=phase, robot_state_estimated=state)

    def run(self, seconds: float) -> MotionPlan:
        """Lets simulated time pass and returns the plan then."""
        self.simulator.AdvanceTo(self.context.get_time() + seconds)
        return self.plan

    @property
    def plan(self) -> MotionPlan:
        """What the output port holds."""
        found = self.system.GetOutputPort("motion_plan").Eval(self.context)
        assert isinstance(found, MotionPlan)
        return found


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_plan_begins_with_the_feet_as_they_stand(seed: int) -> None:
    """Not where they were to be: each foot's first place is Drake's own for the state measured."""
    state = state_with(seed)
    planner = Planner(WALK, state=state)
    planner.simulator.Initialize()
    np.testing.assert_allclose(planner.plan.contacts.feet, feet_of(state), atol=1e-9)
    assert planner.plan.index == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_feet_off_their_places_are_brought_to_them_with_margin(seed: int) -> None:
    """From a perturbed stance too the plan keeps a margin and ends at the goal."""
    planner = Planner(WALK, state=state_with(seed, scale=0.05))
    planner.simulator.Initialize()
    plan = planner.plan
    s = evaluate(paper_robot(), plan, np.linspace(0.0, plan.duration, 1000))
    assert s.margin.min() > 0.03 and s.reach_excess.max() == 0.0
    assert plan.end.body[0] == pytest.approx(WALK.goal, abs=2e-3)


def test_while_a_plan_is_made_the_old_one_stands() -> None:
    """Whoever is asked for plans may say that they are not there yet; then it is asked again.

    What comes in the end is what would have been made at once.
    """
    late = LatePlans()
    planner, prompt = Planner(STAND, WALK, maker=late), Planner(STAND, WALK)
    moved = state_with(5)
    for one in (planner, prompt):
        one.simulator.Initialize()
        one.give(1, moved)
    assert prompt.run(0.06).index == 1 and planner.run(0.06).index == 0
    seen = [planner.run(0.05).index for _ in range(4)]
    assert seen == sorted(seen) and seen[-1] == 1 and late.asked == 3
    np.testing.assert_array_equal(planner.plan.body.control, prompt.plan.body.control)


def test_first_plan_begins_with_the_body_as_it_is() -> None:
    """Place, pitch and yaw of the trunk as measured."""
    state = state_with(4)
    planner = Planner(STAND, state=state)
    planner.simulator.Initialize()
    begin = planner.plan.sample(0.0).body[0]
    measured = model_layout().read(state)
    np.testing.assert_allclose(begin[:3], measured.p_WB, atol=1e-12)
    forward = measured.R_WB[:, 0]
    assert begin[3] == pytest.approx(-np.arcsin(forward[2]), abs=1e-9)
    assert begin[4] == pytest.approx(np.arctan2(forward[1], forward[0]), abs=1e-9)


def test_plan_is_held_while_the_task_lasts() -> None:
    """However the robot moves meanwhile, it is the very same plan."""
    planner = Planner(WALK)
    before = planner.run(0.2)
    planner.give(0, state_with(5))
    assert planner.run(1.0) is before


def test_next_task_is_planned_from_the_feet_as_they_then_stand() -> None:
    """Feet are the measured ones, the body goes on from where it was last told to be."""
    planner = Planner(TURN, STAND)
    first = planner.run(0.2)
    state = state_with(6)
    planner.give(1, state)
    second = planner.run(0.1)
    assert second.index == 1 and second is not first
    np.testing.assert_allclose(second.contacts.feet, feet_of(state), atol=1e-9)
    np.testing.assert_allclose(second.sample(0.0).body[0], first.end.body, atol=1e-9)
    assert first.end.body[4] == pytest.approx(TURN.angle, abs=1e-3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_feet_that_stand_nearly_as_planned_begin_the_plan_on_paper(seed: int) -> None:
    """To the bit the task's plan after the one before; feet farther off begin one of their own."""
    planner = Planner(STAND, WALK)
    first = planner.run(0.2)
    state = state_with(seed, scale=2e-3)
    off = np.linalg.norm(feet_of(state) - first.end.feet, axis=1).max()
    assert 1e-4 < off < AS_PLANNED * float(paper_robot().geometry.reach.min())
    planner.give(1, state)
    second = planner.run(0.1)
    assert second.index == 1
    np.testing.assert_array_equal(second.contacts.feet, first.end.feet)
    again = Planner(STAND, WALK)
    again.run(0.2)
    again.give(1, state_with())
    np.testing.assert_array_equal(again.run(0.1).body.control, second.body.control)


@pytest.mark.parametrize("higher", [-0.11, 0.06])
def test_ground_that_is_not_as_high_as_mapped_changes_no_plan(higher: float) -> None:
    """All four feet alike lower, and the body: the next task is planned on the map's ground."""
    stance = stance_at(flat_course(), SETTINGS)
    feet, body = np.array(stance.feet), np.array(stance.body)
    planner = Planner(STAND, WALK)
    planner.run(0.1)
    planner.give(1, state_of(body, feet))
    usual = planner.run(0.1)
    feet[:, 2] += higher
    body[2] += higher
    other = Planner(STAND, WALK)
    other.run(0.1)
    other.give(1, state_of(body, feet))
    found = other.run(0.1)
    for a, b in zip(usual.contacts.steps, found.contacts.steps, strict=True):
        np.testing.assert_allclose(a.swing.p_end, b.swing.p_end, atol=1e-6)
    np.testing.assert_allclose(usual.end.body, found.end.body, atol=1e-6)
    assert found.end.body[2] == pytest.approx(body[2] - higher, abs=1e-6)


@pytest.mark.parametrize("seed", [8, 9])
def test_revision_asked_for_is_planned_from_the_feet_as_they_stand(seed: int) -> None:
    """The rest of the same task, once; feet as measured, body from where it was told to be."""
    planner = Planner(WALK)
    first = planner.run(0.2)
    t = 0.5 * (first.contacts.steps[1].touchdown + first.contacts.steps[2].lift_off)
    rng = np.random.default_rng(seed)
    sample = first.sample(t)
    feet = np.array(sample.feet)
    feet[:, :2] += rng.uniform(-0.02, 0.02, (4, 2))
    state, phase = state_of(sample.body[0], feet), phase_of(0)
    phase[GaitPhase.TIME], phase[GaitPhase.REVISION] = t, 1.0
    fix_inputs(planner.system, planner.context, gait_phase=phase, robot_state_estimated=state)
    second = planner.run(0.1)
    assert second is not first and (second.index, second.revision) == (0, 1)
    np.testing.assert_allclose(second.contacts.feet, feet_of(state), atol=1e-9)
    np.testing.assert_allclose(second.sample(0.0).body[0], sample.body[0], atol=1e-9)
    assert second.end.body[0] == pytest.approx(WALK.goal, abs=2e-3)
    phase[GaitPhase.TIME] = 0.0
    fix_inputs(planner.system, planner.context, gait_phase=phase)
    assert planner.run(0.5) is second
    assert planner.system.plans(planner.context) == (first, second)


def test_plans_so_far_are_kept_for_the_log() -> None:
    """`plans` holds one for each task begun, in order."""
    planner = Planner(STAND, TURN, STAND)
    planner.run(0.2)
    for task in (1, 2):
        planner.give(task, state_with(task))
        planner.run(0.2)
    plans = planner.system.plans(planner.context)
    assert [p.index for p in plans] == [0, 1, 2]
    assert plans[-1] is planner.plan
    assert [p.segments[-1].kind for p in plans] == ["stand"] * 3


def test_two_contexts_of_one_planner_are_two_planners() -> None:
    """What one run has planned another does not see."""
    a = Planner(STAND, WALK)
    a.run(0.2)
    other = Simulator(a.system)
    context = other.get_mutable_context()
    fix_inputs(a.system, context, gait_phase=phase_of(0), robot_state_estimated=state_with(7))
    other.Initialize()
    a.give(1, state_with())
    a.run(0.2)
    assert [p.index for p in a.system.plans(a.context)] == [0, 1]
    assert [p.index for p in a.system.plans(context)] == [0]
    assert not np.array_equal(a.system.plans(context)[0].contacts.feet,
                              a.system.plans(a.context)[0].contacts.feet)  # fmt: skip


def test_copied_context_goes_on_by_itself() -> None:
    """A clone of a Context holds the plan as it was, whatever the original does next."""
    a = Planner(STAND, WALK)
    first = a.run(0.2)
    copy = a.context.Clone()
    a.give(1, state_with())
    a.run(0.2)
    assert a.system.GetOutputPort("motion_plan").Eval(copy) is first


def test_task_without_a_plan_is_an_error_with_its_reason() -> None:
    """A walk off the ground ends the simulation with the planner's own error."""
    planner = Planner(STAND, Task(kind="walk", name="too far", lane=0, goal=5.9))
    planner.run(0.2)
    planner.give(1, state_with())
    with pytest.raises(PlanningError, match="beyond the ground"):
        planner.run(0.2)


def test_output_is_held_state() -> None:
    """No input reaches the plan but by a tick."""
    assert not Planner(STAND).system.HasAnyDirectFeedthrough()
