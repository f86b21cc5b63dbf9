"""The planner on a map that grows, or that feet make better: alone, through its ports."""

from dataclasses import replace

import numpy as np
import pytest
from growing_rig import DEEP, NOT_SEEN, eyes, first_map, flight, gait, phase_of, standing
from pydrake.systems.analysis import Simulator, SimulatorStatus
from rig import (
    fix_inputs,
    model_layout,
    paper_robot,
    state_of,
)

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.perception.growing_map import grow_map
from drake_quad.perception.sight import MapRevision
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.touchdown_heights import heights_as_seen, map_with_touchdowns
from drake_quad.planning import known_mission
from drake_quad.planning.known_mission import Growth, KnownMission, on_other_map
from drake_quad.planning.motion_plan import MotionPlan, Stance
from drake_quad.planning.onward import Onward, round_up
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.systems.transition_planner import TransitionPlanner
from drake_quad.terrain.elements import Element

STAND = Task(kind="stand", name="stand", lane=0, duration=1.0)
TURN = Task(kind="spin", name="turn", lane=0, angle=np.pi / 4)


def growing(
    revision: MapRevision, start: float = 1.0, *, back_down: bool = False
) -> tuple[TransitionPlanner, Simulator]:
    """A planner whose robot stands before the first steps of a flight; and its simulator."""
    known = FIRST_LOOK.map
    system = TransitionPlanner(
        robot=paper_robot(),
        layout=model_layout(),
        course=known.course(foot_radius=paper_robot().foot_radius),
        settings=gait(),
        mission=(STAND,),
        growth=Growth(gait(), eyes(), 0.02, back_down=back_down),
    )
    simulator, stance = Simulator(system), standing(known, start)
    fix_inputs(
        system, simulator.get_mutable_context(), gait_phase=phase_of(0), map_known=revision,
        robot_state_estimated=state_of(stance.body, stance.feet),
    )  # fmt: skip
    simulator.AdvanceTo(0.1)
    return system, simulator


FIRST_LOOK = MapRevision(0, 0.9, flight(0, 5), NOT_SEEN, first_map())


def test_where_the_map_grows_the_mission_does() -> None:
    """At its end the planner waits for a look, and plans on, until a map is complete."""
    system, simulator = growing(FIRST_LOOK)
    context = simulator.get_mutable_context()
    port = system.GetOutputPort("motion_plan")
    assert port.Eval(context).goes_on
    fix_inputs(system, context, gait_phase=phase_of(1))
    simulator.AdvanceTo(0.3)
    assert port.Eval(context).index == 0
    for revision, map_known, more in ((1, first_map(8), True), (2, seen_whole(), False)):
        look = replace(FIRST_LOOK, number=revision, map=map_known)
        task = 3 if revision == 2 else 1
        fix_inputs(system, context, map_known=look, gait_phase=phase_of(task))
        simulator.AdvanceTo(context.get_time() + 0.2)
        plan = port.Eval(context)
        assert plan.index == task and plan.segments[0].kind in ("wave", "transition")
        assert plan.goes_on and len(plan.course.lanes[0].nosings()) == len(map_known.places)
        there = state_of(plan.end.body, plan.end.feet)
        fix_inputs(system, context, gait_phase=phase_of(task + 1), robot_state_estimated=there)
        simulator.AdvanceTo(context.get_time() + 0.2)
        assert port.Eval(context).index == task + 1 and port.Eval(context).goes_on is more


def seen_whole() -> StairMap:
    """The map once the end of its flight was seen from afar."""
    return grow_map(
        first_map(), flight(3, 4, most=4), DEEP, feet=np.zeros((0, 3)), landing=3.0, reach=0.4,
        look=2,
    )  # fmt: skip


@pytest.mark.parametrize("reason", ["what is seen contradicts the map", ""])
def test_without_a_way_on_the_run_ends_on_four_feet_and_says_why(reason: str) -> None:
    """For what the map's keeper says, or for what the planner finds."""
    look = replace(FIRST_LOOK, number=1, reason=reason, map=replace(first_map(3), trusted=1))
    system, simulator = growing(look, 1.4)  # too near to go nearer
    context = simulator.get_mutable_context()
    fix_inputs(system, context, gait_phase=phase_of(1))
    status = simulator.AdvanceTo(0.3)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    message = status.FormatMessage()
    assert "stopped: stands on four feet before the flight; what is seen is: 5 or more" in message
    assert (reason or "how many steps there are is not known") in message
    assert system.GetOutputPort("motion_plan").Eval(context).index == 0


def test_where_it_is_told_to_it_goes_back_before_the_run_ends() -> None:
    """From the tread that it walked to, to where it started; then the run ends, with the reason."""
    system, simulator = growing(FIRST_LOOK, back_down=True)
    context = simulator.get_mutable_context()
    port = system.GetOutputPort("motion_plan")
    ahead = replace(FIRST_LOOK, number=1, map=first_map(8))
    fix_inputs(system, context, map_known=ahead, gait_phase=phase_of(1))
    simulator.AdvanceTo(0.3)
    walk = port.Eval(context)
    there = state_of(walk.end.body, walk.end.feet)
    fix_inputs(system, context, gait_phase=phase_of(2), robot_state_estimated=there)
    simulator.AdvanceTo(0.5)
    lost = replace(ahead, number=2, reason="what is seen contradicts the map")
    fix_inputs(system, context, map_known=lost, gait_phase=phase_of(3))
    simulator.AdvanceTo(0.8)
    back = port.Eval(context)
    assert back.index == 3 and back.segments[0].name.startswith("back down") and back.goes_on
    assert np.allclose(back.end.body, walk.body.samples(np.zeros(1))[0, 0], atol=1e-9)
    here = state_of(back.end.body, back.end.feet)
    fix_inputs(system, context, gait_phase=phase_of(4), robot_state_estimated=here)
    message = simulator.AdvanceTo(1.0).FormatMessage()
    assert "stopped: stands where it started, on four feet before the flight" in message
    assert "what is seen contradicts the map" in message


def test_where_there_is_no_way_back_either_it_says_both() -> None:
    """A robot that has not walked stays where it is."""
    lost = replace(FIRST_LOOK, number=1, reason="what is seen contradicts the map")
    system, simulator = growing(lost, back_down=True)
    fix_inputs(system, simulator.get_mutable_context(), gait_phase=phase_of(1))
    message = simulator.AdvanceTo(0.3).FormatMessage()
    assert "contradicts the map; no way back: the robot has not gone anywhere" in message


ON_THE_MAP = Task(kind="walk", name="walk 1", lane=0, goal=2.6)


def revised(
    revision: MapRevision,
    settings: PlanSettings | None = None,
    mission: tuple[Task, ...] = (STAND, ON_THE_MAP, STAND),
) -> tuple[TransitionPlanner, Simulator, MotionPlan]:
    """A planner whose map is revised before its second task; and its plan for the first one."""
    known = seen_whole()
    course = known.course(foot_radius=paper_robot().foot_radius)
    system = TransitionPlanner(
        robot=paper_robot(), layout=model_layout(), course=course, settings=settings or gait(),
        mission=mission, growth=Growth(gait(), eyes(), 0.02, revise_before=1),
    )  # fmt: skip
    simulator, stance = Simulator(system), standing(known)
    fix_inputs(
        system, simulator.get_mutable_context(), gait_phase=phase_of(0), map_known=revision,
        robot_state_estimated=state_of(stance.body, stance.feet),
    )  # fmt: skip
    simulator.AdvanceTo(0.1)
    stand = system.GetOutputPort("motion_plan").Eval(simulator.get_context())
    assert stand.revises_map and stand.goes_on
    fix_inputs(system, simulator.get_mutable_context(), gait_phase=phase_of(1))
    simulator.AdvanceTo(0.3)
    return system, simulator, stand


def touched_map(rises: FloatArray) -> StairMap:
    """The whole map, with treads so much higher than they were seen [m]."""
    known = seen_whole()
    told = heights_as_seen(known, tilt_sigma=0.0)
    state = told.state.copy()
    state[: len(rises)] += rises
    touchdowns = np.ones(len(rises), dtype=np.intp)
    return map_with_touchdowns(known, replace(told, state=state, touchdowns=touchdowns))


def test_the_rest_is_planned_on_the_map_that_feet_have_made_better() -> None:
    """It waits for the map; then feet are planned on the new treads, task by task, to the end."""
    first = replace(FIRST_LOOK, map=seen_whole())
    system, simulator, stand = revised(first)
    context, port = simulator.get_mutable_context(), system.GetOutputPort("motion_plan")
    assert port.Eval(context) is stand and system.map_number(context) == 0
    higher = touched_map(np.linspace(0.002, 0.01, 7))
    better = replace(first, number=1, map=higher, looked=False)
    fix_inputs(system, context, map_known=better)
    simulator.AdvanceTo(0.5)
    walk = port.Eval(context)
    assert walk.index == 1 and not walk.revises_map and walk.goes_on
    assert system.map_number(context) == 1 and not system.refused(context)
    known: KnownMission = context.get_abstract_state(2).get_value()
    assert known.settings.map_error_height == round_up(higher.error_height) > 0.0
    assert [task.name for task in known.mission] == ["stand", "walk 1", "stand"]
    np.testing.assert_allclose(walk.course.nosings()[:, 0, 2], higher.heights, atol=1e-12)
    ends = np.array([step.swing.p_end for step in walk.contacts.steps])
    on = np.searchsorted(higher.places, ends[:, 0] - higher.origin[0])
    levels = np.append(0.0, higher.heights)[on] + paper_robot().foot_radius
    np.testing.assert_allclose(ends[:, 2], levels, atol=1e-9)
    there = state_of(walk.end.body, walk.end.feet)
    fix_inputs(system, context, gait_phase=phase_of(2), robot_state_estimated=there)
    simulator.AdvanceTo(0.7)
    assert port.Eval(context).index == 2 and port.Eval(context).course is walk.course


def test_without_a_plan_on_it_the_map_of_before_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """If that is not disproved: the treads are as high as its plans allow for."""

    def no_plan(*_: object, **__: object) -> Onward:
        raise PlanningError("a knee is short of 0.01 rad")

    monkeypatch.setattr(known_mission, "plan_way_back", no_plan)
    first, near = replace(FIRST_LOOK, map=seen_whole()), touched_map(np.full(7, 0.002))
    allowed = replace(gait(), map_error_height=0.003)
    system, simulator, stand = revised(replace(first, number=1, map=near, looked=False), allowed)
    walk = system.GetOutputPort("motion_plan").Eval(simulator.get_context())
    assert walk.index == 1 and walk.course is stand.course
    assert system.map_number(simulator.get_context()) == 0
    assert system.refused(simulator.get_context()) == "a knee is short of 0.01 rad"


def test_a_robot_does_not_go_on_with_a_map_that_its_feet_have_disproved() -> None:
    """A first step of 1.16 m cannot be climbed by this gait, and there is none of 0.16 m."""
    first, steep = replace(FIRST_LOOK, map=seen_whole()), touched_map(np.full(7, 1.0))
    system, simulator, stand = revised(replace(first, number=1, map=steep, looked=False))
    assert system.GetOutputPort("motion_plan").Eval(simulator.get_context()) is stand
    message = simulator.AdvanceTo(0.4).FormatMessage()
    assert "stopped: stands on four feet" in message


def test_a_robot_whose_feet_contradict_its_map_stays_where_it_is() -> None:
    """It stops on four feet and says why; the plan is still that of the stand."""
    reason = "the feet contradict the map: a tread is 0.06 m higher, or lower, than it has"
    known = replace(FIRST_LOOK, number=1, map=seen_whole(), reason=reason, looked=False)
    system = TransitionPlanner(
        robot=paper_robot(), layout=model_layout(), settings=gait(), mission=(STAND, ON_THE_MAP),
        course=known.map.course(foot_radius=paper_robot().foot_radius),
        growth=Growth(gait(), eyes(), 0.02, revise_before=1),
    )  # fmt: skip
    simulator, stance = Simulator(system), standing(known.map)
    fix_inputs(
        system, simulator.get_mutable_context(), gait_phase=phase_of(0), map_known=known,
        robot_state_estimated=state_of(stance.body, stance.feet),
    )  # fmt: skip
    simulator.AdvanceTo(0.1)
    fix_inputs(system, simulator.get_mutable_context(), gait_phase=phase_of(1))
    message = simulator.AdvanceTo(0.3).FormatMessage()
    assert "stopped: stands on four feet before the flight" in message and reason in message


@pytest.mark.parametrize("higher", [0.0, 0.004])
def test_a_stance_on_another_map_is_as_high_over_its_ground(higher: float) -> None:
    """Each foot by what its own tread is higher; the body stays where it was."""
    before, after = (
        m.course(foot_radius=0.02) for m in (seen_whole(), touched_map(np.linspace(0.0, 0.006, 7)))
    )
    feet = np.array([[2.45, 0.3, 0.2], [2.45, -0.3, 0.2], [1.8, 0.3, 0.02], [3.05, -0.3, np.nan]])
    x, y = feet[:, 0], feet[:, 1]
    feet[:, 2] = before.height(x, y) + 0.02 + higher
    stance = Stance(np.zeros(5), feet)
    moved = on_other_map(stance, before, after)
    np.testing.assert_allclose(moved.feet[:, 2] - after.height(x, y), 0.02 + higher, atol=1e-12)
    np.testing.assert_array_equal(moved.body, stance.body)
    assert on_other_map(stance, before, before) is stance


def test_where_it_is_told_to_it_gives_up_the_rest_and_goes_back() -> None:
    """Its feet contradict a map that was seen whole: it does not turn, but goes the way it came."""
    known = replace(FIRST_LOOK, number=1, map=seen_whole(), reason="the feet contradict the map")
    system = TransitionPlanner(
        robot=paper_robot(), layout=model_layout(), settings=gait(),
        mission=(ON_THE_MAP, TURN, STAND),
        course=known.map.course(foot_radius=paper_robot().foot_radius),
        growth=Growth(gait(), eyes(), 0.02, back_down=True, revise_before=1),
    )  # fmt: skip
    simulator, stance = Simulator(system), standing(known.map)
    context, port = simulator.get_mutable_context(), system.GetOutputPort("motion_plan")
    fix_inputs(
        system, context, gait_phase=phase_of(0), map_known=known,
        robot_state_estimated=state_of(stance.body, stance.feet),
    )  # fmt: skip
    simulator.AdvanceTo(0.1)
    walk = port.Eval(context)
    assert walk.revises_map
    there = state_of(walk.end.body, walk.end.feet)
    fix_inputs(system, context, gait_phase=phase_of(1), robot_state_estimated=there)
    simulator.AdvanceTo(0.3)
    back = port.Eval(context)
    assert back.index == 1 and back.segments[0].name.startswith("back down") and back.goes_on
    here = state_of(back.end.body, back.end.feet)
    fix_inputs(system, context, gait_phase=phase_of(2), robot_state_estimated=here)
    message = simulator.AdvanceTo(0.5).FormatMessage()
    assert "stands where it started" in message and "the feet contradict the map" in message


def test_feet_stand_on_the_better_map_where_its_next_plan_begins() -> None:
    """On the landing it is 6 mm higher: so are the feet as that plan begins, each on its ground."""
    known, better = seen_whole(), touched_map(np.linspace(0.0, 0.006, 7))
    top = Task(kind="walk", name="walk 1", lane=0, goal=6.0)
    system = TransitionPlanner(
        robot=paper_robot(), layout=model_layout(), settings=gait(), mission=(top, STAND),
        course=known.course(foot_radius=paper_robot().foot_radius),
        growth=Growth(gait(), eyes(), 0.02, revise_before=1),
    )  # fmt: skip
    simulator, stance = Simulator(system), standing(known)
    context, port = simulator.get_mutable_context(), system.GetOutputPort("motion_plan")
    revision = replace(FIRST_LOOK, number=1, map=better, looked=False)
    fix_inputs(
        system, context, gait_phase=phase_of(0), map_known=revision,
        robot_state_estimated=state_of(stance.body, stance.feet),
    )  # fmt: skip
    simulator.AdvanceTo(0.1)
    end = port.Eval(context).end
    assert end.feet[:, 0].min() > known.origin[0] + known.places[-1]
    fix_inputs(
        system, context, gait_phase=phase_of(1), robot_state_estimated=state_of(end.body, end.feet)
    )
    simulator.AdvanceTo(0.3)
    begun = port.Eval(context)
    assert begun.index == 1 and system.map_number(context) == 1
    ground = begun.course.height(begun.contacts.feet[:, 0], begun.contacts.feet[:, 1])
    radius = paper_robot().foot_radius
    np.testing.assert_allclose(begun.contacts.feet[:, 2], ground + radius, atol=1e-9)
    np.testing.assert_allclose(begun.contacts.feet[:, 2], end.feet[:, 2] + 0.006, atol=1e-9)


def test_a_map_that_grew_to_its_end_is_revised_before_the_way_back() -> None:
    """The task before which it is counts from the mission's beginning; that plan alone says so."""
    whole = grow_map(
        first_map(), flight(3, 4, most=4), DEEP, feet=np.zeros((0, 3)), landing=3.0, reach=0.4,
        look=2, back=(Element("return"),),
    )  # fmt: skip
    system, simulator = growing(replace(FIRST_LOOK, number=1, map=whole))
    context, port = simulator.get_mutable_context(), system.GetOutputPort("motion_plan")
    assert not port.Eval(context).revises_map
    fix_inputs(system, context, gait_phase=phase_of(1))
    simulator.AdvanceTo(0.3)
    known: KnownMission = context.get_abstract_state(2).get_value()
    assert [task.kind for task in known.mission] == ["stand", "walk", "spin", "walk", "stand"]
    assert known.revise_before == 2 and not known.goes_on
    assert port.Eval(context).index == 1 and port.Eval(context).revises_map


def test_no_foot_is_planned_where_it_may_miss_its_step() -> None:
    """On the better map as on any: nosings known to 0.3 m leave no foothold that is sure."""
    first, vague = replace(FIRST_LOOK, map=seen_whole()), touched_map(np.full(7, 0.002))
    vague = replace(vague, place_errors=np.full(7, 0.3))
    allowed = replace(gait(), map_error_height=0.003)
    system, simulator, _ = revised(replace(first, number=1, map=vague, looked=False), allowed)
    refused = system.refused(simulator.get_context())
    assert (
        refused.startswith("the nosing of step") and system.map_number(simulator.get_context()) == 0
    )


def test_all_that_is_left_has_to_have_a_plan_on_the_better_map() -> None:
    """Not only the next task: the last one here leads beyond the ground."""
    far = replace(ON_THE_MAP, goal=60.0)
    first, near = replace(FIRST_LOOK, map=seen_whole()), touched_map(np.full(7, 0.002))
    allowed = replace(gait(), map_error_height=0.003)
    better = replace(first, number=1, map=near, looked=False)
    system, simulator, _ = revised(better, allowed, mission=(STAND, STAND, far))
    assert "beyond the ground" in system.refused(simulator.get_context())
