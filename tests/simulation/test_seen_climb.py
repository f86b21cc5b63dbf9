"""A robot that is told no stairs: it looks, and plans on what it saw, or stays where it is.

The gait is given, and the looks are short: what is tested here is where the map comes from.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import CameraMount
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario, parse_scenario, scenario_text
from drake_quad.scenario.perception_config import PerceptionConfig
from drake_quad.simulation import prepare_seen
from drake_quad.simulation.diagram import StairClimb, stair_climb_of
from drake_quad.simulation.eyes import AddEyes, camera_mount, camera_of, check_mount, mount_of
from drake_quad.simulation.look import look_around
from drake_quad.simulation.prepare import judge_plan, prepare
from drake_quad.simulation.prepare_seen import LINGER, blind_scenario, plan_on_sight
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.simulation.run import replay_plan, simulate
from drake_quad.terrain.elements import Element

LOOK = 0.4  # [s]
TEXT = f"""
course:
  - {{kind: floor, length: 2.2}}
  - {{kind: stairs, going: up, rise: 0.13, run: 0.50, count: 3}}
  - {{kind: landing, length: 3.0}}
start: {{distance: 1.0}}
gait: {{swing_clearance: 0.04}}
controller: {{kind: whole_body, period: 0.002}}
perception: {{map: seen, look_time: {LOOK}}}
"""
BACK = (
    "course=[{kind: floor, length: 2.2}, {kind: stairs, going: up, rise: 0.13, run: 0.50, "
    "count: 3}, {kind: landing, length: 3.0}, {kind: return}]"
)
FLOOR = ["course=[{kind: floor, length: 8.0, width: 4.0}]"]


def scenario(*overrides: str) -> Scenario:
    return parse_scenario(TEXT, source="test", overrides=overrides)


@cache
def prepared(*overrides: str) -> PreparedScenario:
    return prepare(scenario(*overrides), source="test")


@cache
def blind() -> PreparedScenario:
    """The robot before it has looked, in the world as it is."""
    found = prepare(blind_scenario(scenario()), source="test")
    return PreparedScenario(**{**vars(found), "world": prepared().world})


def numbers(plan: MotionPlan) -> list[FloatArray]:
    """What a plan sends body and feet to do."""
    steps = [s.swing.p_end for s in plan.contacts.steps]
    return [plan.contacts.feet, *steps, plan.body.samples(np.linspace(0.0, plan.duration, 50))]


def test_the_robot_plans_on_the_flight_that_it_saw() -> None:
    """Three steps up, each nosing within 60 mm of its place and 15 mm of its height."""
    p = prepared()
    assert p.sight is not None and p.sight.map is not None and not p.sight.refused
    assert p.course is not p.world
    believed, true = p.course.nosings().mean(axis=1), p.world.nosings().mean(axis=1)
    assert believed.shape == true.shape == (3, 3)
    assert 0.0 < np.abs(believed[:, 0] - true[:, 0]).max() < 0.06
    assert 0.0 < np.abs(believed[:, 2] - true[:, 2]).max() < 0.015
    assert [task.kind for task in p.tasks] == ["stand", "walk", "stand"]
    assert p.tasks[0].duration == LOOK
    judge_plan(p)


def test_the_plan_allows_for_what_was_not_seen_well() -> None:
    """Swings keep the widest 95 % intervals from risers and treads; the file's fields stay."""
    p = prepared()
    assert p.sight is not None and p.sight.map is not None
    assert p.settings.map_error_place >= p.sight.map.error_place > 0.005
    assert p.settings.map_error_height >= p.sight.map.error_height > 0.001
    assert p.scenario.gait.map_error_place == 0.0


def test_map_and_plan_do_not_depend_on_the_told_course() -> None:
    """From the same images, with a floor for a course, both are the same to the bit."""
    p, elsewhere = prepared(), scenario(*FLOOR)
    elsewhere.course = [Element(kind="floor", length=1.5)]
    assert p.sight is not None
    again = plan_on_sight(elsewhere, blind(), p.sight, source="test")
    assert np.array_equal(again.course.nosings(), p.course.nosings())
    for a, b in zip(again.plan.plans, p.plan.plans, strict=True):
        for mine, other in zip(numbers(a), numbers(b), strict=True):
            assert np.array_equal(mine, other)


def test_the_same_seed_sees_the_same_and_another_seed_something_else() -> None:
    """Beliefs and images are equal to the bit, and are not with another camera's errors."""
    first = prepared().sight
    assert first is not None and first.belief is not None
    second = look_around(blind())
    assert second.belief is not None and np.array_equal(first.depth, second.depth)
    assert np.array_equal(first.belief.places, second.belief.places)
    assert np.array_equal(first.belief.covariance, second.belief.covariance)
    other = prepared("simulation.seed=1").sight
    assert other is not None and not np.array_equal(first.depth, other.depth)


def states(climb: StairClimb, times: FloatArray) -> list[FloatArray]:
    simulator = Simulator(climb.diagram)
    found = []
    for time in times:
        simulator.AdvanceTo(float(time))
        context = climb.plant.GetMyContextFromRoot(simulator.get_context())
        found.append(np.array(climb.plant.get_state_output_port().Eval(context)))
    return found


def test_the_run_stands_as_it_stood_when_it_looked() -> None:
    """With the plan of the climb, and no camera, the stand is the same motion to the bit."""

    def eyes(builder: DiagramBuilder, _: MultibodyPlant, __: SceneGraph) -> None:
        AddEyes(builder, blind())

    times = np.array([0.05, 0.2, LOOK - 0.01])
    looking = states(stair_climb_of(blind(), visualize=eyes), times)
    for a, b in zip(looking, states(stair_climb_of(prepared()), times), strict=True):
        assert np.array_equal(a, b)


def test_a_robot_that_estimates_its_state_looks_from_where_it_believes_to_stand() -> None:
    """An image keeps the estimated pose, not the true one, with the deviations of the estimate.

    And with the plan of the climb, whose map is another one, the stand is the same to the bit.
    """
    p = prepared("estimator.kind=ekf")
    alone = prepare(blind_scenario(scenario("estimator.kind=ekf")), source="test")
    before = PreparedScenario(**{**vars(alone), "world": p.world})

    def eyes(builder: DiagramBuilder, _: MultibodyPlant, __: SceneGraph) -> None:
        AddEyes(builder, before)

    climb = stair_climb_of(before, visualize=eyes)
    simulator = Simulator(climb.diagram)
    simulator.AdvanceTo(0.3)
    at_capture = climb.plant.GetMyContextFromRoot(simulator.get_context())
    true = climb.plant.GetPositions(at_capture)[:7]
    controller = climb.diagram.GetSubsystemByName("controller")
    estimate = controller.GetMyContextFromRoot(simulator.get_context())
    believed = controller.GetOutputPort("robot_state_estimated").Eval(estimate)[:7]
    deviation = controller.GetOutputPort("estimator_deviation").Eval(estimate)
    simulator.AdvanceTo(0.38)  # the image of 0.3 s has arrived
    camera = climb.diagram.GetSubsystemByName("depth_camera")
    seen = camera.GetMyContextFromRoot(simulator.get_context())
    image = camera.GetOutputPort("depth_measured").Eval(seen)
    assert image.stamp == pytest.approx(0.3)
    assert np.abs(image.base_pose - believed).max() < 1e-4 < np.abs(image.base_pose - true).max()
    assert image.base_deviation == pytest.approx([*deviation[:3], *deviation[6:]], rel=0.01)
    assert image.base_deviation[:2].min() > np.radians(0.05)

    times = np.array([0.05, 0.2, LOOK - 0.01])
    looking = states(stair_climb_of(before, visualize=eyes), times)
    for a, b in zip(looking, states(stair_climb_of(p), times), strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize("felt", [False, True])
def test_the_eyes_take_the_contacts_that_the_controller_takes(felt: bool) -> None:
    """Where feet have no sensors, what looks at stairs has what the joints feel, and no more."""
    overrides = ["sensors.contacts=joints"] if felt else []
    before = prepare(blind_scenario(scenario(*overrides)), source="test")

    def eyes(builder: DiagramBuilder, _: MultibodyPlant, __: SceneGraph) -> None:
        AddEyes(builder, before)

    diagram = stair_climb_of(before, visualize=eyes).diagram
    port = diagram.GetSubsystemByName("stair_estimator").GetInputPort("contacts")
    source, _ = diagram.connection_map()[port.get_system(), port.get_index()]
    assert source.get_name() == ("controller" if felt else "contact_monitor")


def test_stairs_right_ahead_are_seen_by_a_camera_held_upright() -> None:
    """0.9 m ahead of the body the first riser is below the view of one held level: it is refused.

    Held upright it has it in view, and all three nosings lie where they are told to 40 mm.
    """
    near = "course[0].length=1.9"
    level = prepared(near)
    assert level.sight is not None and "too near to be seen" in level.sight.refused
    p = prepared(near, "perception.camera_hold=portrait", "perception.camera_pitch_deg=35")
    assert p.sight is not None and not p.sight.refused
    believed, true = p.course.nosings().mean(axis=1), p.world.nosings().mean(axis=1)
    assert believed.shape == true.shape and np.abs(believed[:, 0] - true[:, 0]).max() < 0.04


def test_images_are_as_small_as_the_scenario_asks() -> None:
    """Of half the size they show the same three nosings, to 60 mm."""
    p = prepared("perception.decimation=2")
    assert p.sight is not None and not p.sight.refused
    full = camera_of(p.scenario).model
    assert p.sight.depth.shape == (full.height // 2, full.width // 2)
    believed, true = p.course.nosings().mean(axis=1), p.world.nosings().mean(axis=1)
    assert believed.shape == true.shape and np.abs(believed[:, 0] - true[:, 0]).max() < 0.06


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (FLOOR, "no stairs"),
        (["course[1].going=down"], "stands still"),
        (["course[1].rise=0.45", "course[1].count=2"], "stands still"),
    ],
)
def test_what_cannot_be_climbed_is_not(overrides: list[str], words: str) -> None:
    """A floor, a flight down and one too steep: it stands on four feet, and says what it saw."""
    result = simulate(prepared(*overrides))
    assert result.outcome == "stopped"
    assert result.reason.startswith("stands still; what is seen is: ") and words in result.reason
    assert result.summary["samples_under_three_feet"] == 0
    assert result.summary["margin"]["minimum"] > 0.06
    assert result.summary["seen"]["climbed"] is False
    assert result.summary["simulated_time"] == pytest.approx(LOOK + LINGER, abs=0.1)


def test_a_robot_that_stays_has_no_plan_to_show() -> None:
    """`drake-quad plan` finds it infeasible, for the reason that a run ends with."""
    p = prepared(*FLOOR)
    assert p.sight is not None
    with pytest.raises(PlanningError) as refused:
        judge_plan(p)
    assert refused.value.reason == p.sight.refused


def test_a_turned_flight_is_walked_along_its_own_heading() -> None:
    """Turned by 5 degrees, the map's lane is turned so to 1 degree, and the plan ends along it."""
    p = prepared("world.yaw_error_deg=5.0", "course[0].length=2.5")
    assert p.sight is not None and not p.sight.refused
    assert np.degrees(p.course.lanes[0].yaw) == pytest.approx(5.0, abs=1.0)
    assert p.plan.plans[-1].end.body[4] == pytest.approx(p.course.lanes[0].yaw)


def test_an_estimated_state_is_looked_from_as_well() -> None:
    """With the filter's state in place of the true one the map is made all the same."""
    p = prepared("estimator.kind=ekf")
    assert p.sight is not None and not p.sight.refused
    assert p.course.nosings().shape == p.world.nosings().shape


def test_a_camera_inside_the_trunk_is_refused() -> None:
    """In one line, with where it would be outside."""
    with pytest.raises(InputError) as refused:
        prepare(scenario("perception.camera_x=0.5"), source="file.yaml")
    assert refused.value.source == "file.yaml" and refused.value.field == "perception.camera_x"
    assert "inside the trunk: put it at 0.6" in refused.value.remedy


def test_a_camera_in_the_air_is_refused() -> None:
    """The trunk ends 0.61 m ahead of its middle: the line says where a camera would be on it."""
    with pytest.raises(InputError) as refused:
        prepare(scenario("perception.camera_x=0.9"), source="file.yaml")
    line = str(refused.value)
    assert "camera_x = 0.9: the camera would be 0.29 m from the trunk, and 0.15 m is" in line
    assert "on the trunk's front it is at 0.64, 0, 0.12 m" in line


def test_a_robots_own_camera_in_the_air_is_its_files_fault() -> None:
    """The line names the robot's file and field, and not one that the scenario has not set."""
    robot = replace(paper_robot(), camera=CameraMount(1.0, 0.0, 0.1, 30.0), source="my.robot.yaml")
    with pytest.raises(InputError, match=r"my\.robot\.yaml: camera\.x = 1\.0: the camera would be"):
        check_mount(PerceptionConfig(), robot, source="file.yaml")


def test_the_usual_camera_is_no_arms() -> None:
    """What is on the trunk, higher than its hips, is passed over: the camera is on its front."""
    robot = paper_robot()
    arm = np.array([[0.2, -0.1, 0.4], [1.2, 0.1, 0.8]])
    boxes = np.concatenate([robot.trunk_boxes, arm[None]])
    armed = replace(robot, trunk_boxes=boxes, trunk_box=np.array([[-0.43, -0.13, -0.06], arm[1]]))
    assert camera_mount(PerceptionConfig(), armed) == camera_mount(PerceptionConfig(), robot)
    check_mount(PerceptionConfig(), armed, source="file.yaml")


def test_the_camera_is_where_scenario_robot_or_trunk_say() -> None:
    """The scenario's coordinates count first, then the robot's own, then the front of its trunk."""
    robot = paper_robot()
    assert camera_mount(PerceptionConfig(), robot) == CameraMount(0.64, 0.0, 0.12, 30.0)
    own = replace(robot, camera=CameraMount(0.45, 0.02, 0.2, 40.0))
    assert camera_mount(PerceptionConfig(), own) == own.camera
    told = PerceptionConfig(camera_z=0.25, camera_pitch_deg=20.0)
    assert camera_mount(told, own) == CameraMount(0.45, 0.02, 0.25, 20.0)
    X_BC = mount_of(told, own)
    assert X_BC.translation().tolist() == [0.45, 0.02, 0.25]
    ahead = X_BC.rotation().matrix()[:, 2]  # the optical axis
    assert ahead == pytest.approx([np.cos(np.radians(20.0)), 0.0, -np.sin(np.radians(20.0))])


def test_a_saved_run_looks_and_plans_anew_to_the_same_end() -> None:
    """Its scenario, written and read again, gives the same map to the bit."""
    p = prepared()
    again = prepare(parse_scenario(scenario_text(p.scenario), source="saved"), source="saved")
    assert np.array_equal(again.course.nosings(), p.course.nosings())


def test_a_replay_of_the_plan_is_of_what_was_seen() -> None:
    """A kinematic run looks in physics, and moves along the plan on that map."""
    result = replay_plan(prepared("simulation.mode=kinematic"))
    assert result.outcome == "goal_reached" and result.summary["seen"]["climbed"] is True
    stays = replay_plan(prepared(*FLOOR, "simulation.mode=kinematic"))
    assert stays.outcome == "stopped" and "no stairs" in stays.reason


def test_the_shipped_scenario_asks_for_a_map_that_is_seen() -> None:
    """`unmapped` looks with a D435 and designs its gait for what it sees."""
    shipped = load_scenario("unmapped")
    assert shipped.perception.map == "seen" and shipped.design == "auto"
    assert camera_of(shipped).name == "D435" and not shipped.mission


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "state"), [(0, "truth"), (1, "truth"), (0, "ekf")])
def test_the_shipped_scenario_climbs_what_it_sees(seed: int, state: str) -> None:
    """Up, half a turn and down, safely, on stairs that nobody has told; on estimated state too."""
    overrides = [f"simulation.seed={seed}", f"estimator.kind={state}"]
    result = simulate(load_scenario("unmapped", overrides))
    assert result.outcome == "goal_reached", result.reason
    assert result.summary["safety"]["safe"] is True
    assert result.summary["seen"]["count_least"] == result.summary["seen"]["count_true"]


def test_a_robot_that_is_told_to_comes_back_down_the_stairs_that_it_saw() -> None:
    """Half a turn on the landing that it was told of; then down the steps of its own map."""
    p = prepared(BACK, "perception.landing=2.5")
    assert p.sight is not None and not p.sight.refused
    assert [task.kind for task in p.tasks] == ["stand", "walk", "spin", "walk", "stand"]
    there, again = p.course.lanes
    np.testing.assert_array_equal(p.course.nosings(), prepared().course.nosings())
    assert len(again.flights) == 1 and again.flights[0].going == "down"
    end = p.plan.plans[-1].end
    assert end.feet[:, 2].max() < p.course.boxes[0].top + 0.05
    assert abs(np.remainder(end.body[4] - there.yaw, 2.0 * np.pi) - np.pi) < 1e-6
    judge_plan(p)


def test_a_landing_too_small_to_turn_on_is_not_climbed_to() -> None:
    """It stays on its feet, and says which figure of its map is in the way and what it needs."""
    p = prepared(BACK, "perception.landing=1.2")
    assert p.sight is not None
    assert "course[2].length of the map is 0." in p.sight.refused
    assert "too small to turn back on: must be at least 1.24 m" in p.sight.refused


def test_a_robot_that_stands_turned_sees_the_flight_where_it_is() -> None:
    """It stands 9 degrees to the left of the flight's way up, sees that to 1 degree, and turns."""
    p = prepared("start.heading_deg=9.0")
    assert p.stance.body[4] == pytest.approx(np.radians(9.0))
    assert p.stance.body[:2] == pytest.approx([1.0, 0.0])
    assert p.sight is not None and p.sight.belief is not None and not p.sight.refused
    assert abs(np.degrees(p.sight.belief.yaw)) < 1.0
    walk = p.plan.plans[1]
    assert abs(np.degrees(walk.body.samples(np.array([walk.duration]))[-1, 0, 4])) < 1.0


def test_a_whole_flight_on_which_a_foot_may_miss_its_step_is_not_walked_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is climbed in stretches, or refused with that for the reason."""
    monkeypatch.setattr(prepare_seen, "doubtful_foothold", lambda *_: "a nosing is not known well")
    p = prepare(scenario(), source="test")
    assert p.sight is not None
    assert p.growth is not None or "a nosing is not known well" in p.sight.refused


@pytest.mark.long
@pytest.mark.parametrize("state", ["truth", "ekf"])
def test_feet_make_the_map_better_before_the_way_back(state: str) -> None:
    """All treads of the flight; heights then err less, and the way down is planned on these."""
    p = prepared(BACK, "perception.landing=2.5", f"estimator.kind={state}")
    assert p.growth is not None and p.growth.revise_before == 2
    result = simulate(p)
    assert result.outcome == "goal_reached", result.reason
    seen = result.summary["seen"]
    assert seen["looks"] == 1 and seen["map_treads_touched"] == seen["map_steps"] == 3
    assert seen["map_height_error_max"] < min(0.003, seen["height_error_max"])
    assert seen["map_heights_inside"] == seen["map_places_inside"] == 1.0
    assert result.seen is not None
    up, down = result.seen.told["proofs"]
    assert (up["tasks"], down["tasks"]) == (2, 3) and down["height"] < 0.5 * up["height"]
