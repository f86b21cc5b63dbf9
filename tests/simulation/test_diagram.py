"""The Diagrams: what is in them, what is on their ports, and that nothing leaks between runs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.geometry import GeometryId, Role
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    State,
    System,
)
from rig import feet_of

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.planning.motion_plan import Stance
from drake_quad.robot.loader import AddRobot, MakeModelPlant
from drake_quad.robot.state import make_layout
from drake_quad.runs.schema import ESTIMATED, SOURCES, sources_of
from drake_quad.scenario.build import sensor_errors
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import MakeStairClimb, StairClimb, stair_climb_of
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.controller import MakeController
from drake_quad.systems.disturbances import Disturbances
from drake_quad.systems.stability_monitor import StabilityMonitor
from drake_quad.terrain.drake_geometry import AddCourse, SetContactFriction

TICK = 0.005  # [s]


@cache
def prepared() -> PreparedScenario:
    return prepare(load_scenario("flat_walk"))


def make_climb(**changes: object) -> StairClimb:
    p = prepared()
    arguments: dict[str, object] = {
        "robot": p.robot,
        "course": p.course,
        "settings": p.settings,
        "mission": p.tasks,
        "control": p.scenario.controller,
        "stance": p.stance,
        "plant_config": p.scenario.simulation.plant,
        "friction": p.scenario.simulation.friction,
        "log_period": p.scenario.simulation.log_period,
    }
    return MakeStairClimb(**(arguments | changes))  # type: ignore[arg-type]


@cache
def climb() -> StairClimb:
    return make_climb()


def controller_of(diagram: Diagram) -> Diagram:
    found = diagram.GetSubsystemByName("controller")
    assert isinstance(found, Diagram)
    return found


def all_systems(system: System) -> list[System]:
    inner = system.GetSystems() if isinstance(system, Diagram) else []
    return [system, *(s for i in inner for s in all_systems(i))]


def state_of_plant(made: StairClimb, context: Context) -> FloatArray:
    plant_context = made.plant.GetMyContextFromRoot(context)
    return np.array(made.plant.GetPositionsAndVelocities(plant_context))


def test_every_system_has_a_name_of_its_own() -> None:
    """No system is left with the name that Drake makes from its address."""
    names = [s.get_name() for s in all_systems(climb().diagram)]
    assert not [n for n in names if "@" in n or "/" in n or not n]
    top = {s.get_name() for s in climb().diagram.GetSystems()}
    assert {"plant", "scene_graph", "controller", "contact_monitor", "stability_monitor"} <= top
    assert "push_source" in top and not {"sensor_delay", "command_delay", "motor_strength"} & top
    assert {"logged", "log"} <= top
    plain = sources_of(estimated=False, whole_body=False, margins=False)
    assert list(climb().loggers) == [source.name for source in plain]


def test_controller_has_a_robots_ports() -> None:
    """In goes what is measured on a robot, out come joint commands, and what a log wants."""
    controller = controller_of(climb().diagram)
    ins = {controller.get_input_port(k).get_name() for k in range(controller.num_input_ports())}
    outs = {controller.get_output_port(k).get_name() for k in range(controller.num_output_ports())}
    assert ins == {"robot_state_estimated", "contact_state_measured"}
    assert {"joint_state_desired", "joint_torque_feedforward", "gait_phase"} <= outs
    assert "motion_plan" in outs
    inner = {s.get_name() for s in controller.GetSystems()}
    assert inner == {"gait_scheduler", "transition_planner", "tracking_controller"}


def test_a_controller_that_estimates_its_state_is_not_told_it() -> None:
    """In go a robot's sensors alone; what sees the truth stands outside of the controller."""
    made = make_climb(sensors=sensor_errors(load_scenario("flat_walk", ["estimator.kind=ekf"])))
    controller = controller_of(made.diagram)
    ins = {controller.get_input_port(k).get_name() for k in range(controller.num_input_ports())}
    assert ins == {"contact_state_measured", "imu_measured", "joint_state_measured"}
    assert "state_estimator" in {s.get_name() for s in controller.GetSystems()}
    assert {"imu", "joint_sensor"} <= {s.get_name() for s in made.diagram.GetSystems()}
    assert {s.name for s in SOURCES if s.where == ESTIMATED} <= set(made.loggers)


def test_a_scenarios_foot_give_reaches_the_estimator() -> None:
    """A robot that stands is estimated otherwise with `estimator.foot_give`, and not without."""

    def estimated(*fields: str) -> FloatArray:
        given = prepare(load_scenario("flat_walk", ["estimator.kind=ekf", *fields]))
        made = stair_climb_of(given)
        simulator = Simulator(made.diagram)
        simulator.AdvanceTo(0.1)
        controller = controller_of(made.diagram)
        context = controller.GetMyContextFromRoot(simulator.get_context())
        return np.array(controller.GetOutputPort("robot_state_estimated").Eval(context))

    known = estimated()
    assert np.array_equal(known, estimated("estimator.foot_give=0.0"))
    assert not np.array_equal(known, estimated("estimator.foot_give=0.01"))


@pytest.mark.parametrize("kind", ["ik", "whole_body"])
def test_nothing_passes_through_the_controller_but_by_a_tick(kind: str) -> None:
    """No output depends directly on any input: it can be wired in a loop with any plant."""
    control = load_scenario("flat_walk", [f"controller.kind={kind}"]).controller
    assert not controller_of(make_climb(control=control).diagram).HasAnyDirectFeedthrough()


def test_what_disturbs_the_robot_is_in_the_diagram_only_if_asked_for() -> None:
    """Delays and weak drives are systems of their own, by these names."""
    made = make_climb(
        disturbances=Disturbances(
            sensor_delay=0.002, command_delay=0.003, motor_strength={"FL_knee": 0.6}
        )
    )
    top = {s.get_name() for s in made.diagram.GetSystems()}
    assert {"sensor_delay", "command_delay", "motor_strength"} <= top


def test_controller_never_sees_the_simulated_plant() -> None:
    """None of its systems holds the plant, its scene graph, or anything but the model's own."""
    made = climb()
    for system in all_systems(controller_of(made.diagram)):
        if not isinstance(system, LeafSystem):
            continue
        held = list(vars(system).values())
        assert not any(value is made.plant or value is made.scene_graph for value in held)
        assert not any(isinstance(value, GeometryId) for value in held)


def test_every_joint_is_held_by_the_plants_own_controller() -> None:
    """Each actuator has the gains that were set, after Finalize, where they take."""
    control = prepared().scenario.controller
    for index in climb().plant.GetJointActuatorIndices():
        actuator = climb().plant.get_joint_actuator(index)
        assert actuator.has_controller()
        gains = actuator.get_controller_gains()
        assert (gains.p, gains.d) == (control.kp, control.kd)


def test_robot_stands_in_its_stance_at_first() -> None:
    """A default Context has the body in its pose and the feet in their places."""
    made, stance = climb(), prepared().stance
    state = state_of_plant(made, made.diagram.CreateDefaultContext())
    base = made.layout.read(state)
    np.testing.assert_allclose(base.p_WB, stance.body[:3], atol=1e-12)
    np.testing.assert_allclose(feet_of(state), stance.feet, atol=1e-9)
    assert np.all(state[made.layout.num_positions :] == 0.0)


def test_stance_that_the_legs_cannot_take_is_refused() -> None:
    """A body too high for its legs is an input error that names the field."""
    stance = prepared().stance
    high = Stance(stance.body + np.array([0.0, 0.0, 0.6, 0.0, 0.0]), stance.feet)
    with pytest.raises(InputError) as caught:
        make_climb(stance=high)
    assert caught.value.field == "gait.body_height" and "reach" in caught.value.remedy


def test_friction_is_the_one_given() -> None:
    """Each box of the course and each shape of the robot has it, static and dynamic."""
    made = make_climb(friction=0.37)
    inspector = made.scene_graph.model_inspector()
    world = made.plant.GetCollisionGeometriesForBody(made.plant.world_body())
    assert len(world) == len(prepared().course.boxes)
    touching = inspector.GetAllGeometryIds(Role.kProximity)
    assert (
        len(touching) == len(world) + 22
    )  # trunk, head; of each leg hip, thigh, knee, shank, foot
    for geometry in touching:
        friction = inspector.GetProximityProperties(geometry).GetProperty(
            "material", "coulomb_friction"
        )
        assert (friction.static_friction(), friction.dynamic_friction()) == (0.37, 0.37)


def test_two_runs_of_one_diagram_do_not_touch() -> None:
    """Advanced in turns, two contexts give what each gives alone, to the bit."""
    made = climb()
    alone = Simulator(made.diagram)
    alone.AdvanceTo(1.0)
    expected = state_of_plant(made, alone.get_context())
    a, b = Simulator(made.diagram), Simulator(made.diagram)
    for t in np.arange(0.2, 1.01, 0.2):
        a.AdvanceTo(t)
        b.AdvanceTo(0.5 * t)
    b.AdvanceTo(1.0)
    np.testing.assert_array_equal(state_of_plant(made, a.get_context()), expected)
    np.testing.assert_array_equal(state_of_plant(made, b.get_context()), expected)


def test_a_prepared_scenario_is_wired_as_by_hand() -> None:
    """`stair_climb_of` makes what MakeStairClimb makes of its values: the same, to the bit."""
    states = []
    for made in (climb(), stair_climb_of(prepared())):
        simulator = Simulator(made.diagram)
        simulator.AdvanceTo(1.3)
        states.append(state_of_plant(made, simulator.get_context()))
    np.testing.assert_array_equal(states[0], states[1])


def test_margins_are_measured_at_every_tick_of_the_controller(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where contacts are sensed at every second one, too: what is least is of all of them."""
    ticks, own = [], StabilityMonitor._update

    def counted(monitor: StabilityMonitor, context: Context, state: State) -> EventStatus:
        ticks.append(context.get_time())
        return own(monitor, context, state)

    monkeypatch.setattr(StabilityMonitor, "_update", counted)
    control = replace(prepared().scenario.controller, period=0.002)
    made = make_climb(control=control, log_period=0.1)
    assert made.sensing_period == pytest.approx(0.004)
    Simulator(made.diagram).AdvanceTo(0.05)
    np.testing.assert_allclose(ticks, 0.002 * np.arange(len(ticks)), atol=1e-12)
    assert len(ticks) >= 25


def test_monitors_measure_once_for_the_log_and_for_their_own_update(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sampled as often as they measure, each measures once a sample: both see the same instant."""
    counts = {ContactMonitor: 0, StabilityMonitor: 0}

    def count(system: type[LeafSystem], name: str) -> None:
        own = getattr(system, name)

        def counted(*arguments: object) -> None:
            counts[system] += 1
            own(*arguments)

        monkeypatch.setattr(system, name, counted)

    count(ContactMonitor, "_measure")
    count(StabilityMonitor, "_calc_now")
    made = make_climb(log_period=TICK)
    assert made.sensing_period == TICK
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(40 * TICK)
    samples = made.loggers["margin"].FindLog(simulator.get_context()).num_samples()
    assert samples == 41
    assert all(samples <= found <= samples + 3 for found in counts.values()), counts


def test_logs_have_one_sample_each_log_period() -> None:
    """All loggers sample together, from time 0 on."""
    made = make_climb(log_period=0.02)
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.5)
    for name, sink in made.loggers.items():
        log = sink.FindLog(simulator.get_context())
        np.testing.assert_allclose(log.sample_times(), 0.02 * np.arange(26), atol=1e-12)
        assert log.num_samples() == log.data().shape[1] == 26
        found = next(source for source in SOURCES if source.name == name)
        source = made.diagram.GetSubsystemByName(found.system).GetOutputPort(found.port)
        context = source.get_system().GetMyContextFromRoot(simulator.get_context())
        assert len(log.data()) == source.size() == len(source.Eval(context))


class Elsewhere:
    """The controller and the robot each in a simulator of its own, joined by hand at every tick.

    So a robot would be driven, or the model in another simulator: vectors in, vectors out.
    """

    def __init__(self) -> None:
        p = prepared()
        control = p.scenario.controller
        model = MakeModelPlant(p.robot.url)
        self.controller = MakeController(
            robot=p.robot,
            course=p.course,
            settings=p.settings,
            mission=p.tasks,
            control=control,
            model=model,
        )
        self.brain = Simulator(self.controller)
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlant(p.scenario.simulation.plant, builder)
        instance = AddRobot(plant, p.robot.url)
        AddCourse(plant, p.course, friction=0.8)
        SetContactFriction(plant, scene_graph, instance, p.robot, 0.8)
        plant.Finalize()
        for index in plant.GetJointActuatorIndices(instance):
            gains = PdControllerGains(p=control.kp, d=control.kd)
            plant.get_joint_actuator(index).set_controller_gains(gains)
        inspector = scene_graph.model_inspector()
        names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
        feet = find_feet(plant, p.robot, names)
        contact = builder.AddSystem(
            ContactMonitor(plant=plant, foot_geometries=feet, robot=p.robot, period=TICK)
        )
        builder.Connect(plant.get_contact_results_output_port(), contact.get_input_port())
        builder.ExportInput(plant.get_desired_state_input_port(instance), "joint_state_desired")
        builder.ExportInput(plant.get_actuation_input_port(instance), "joint_torque_feedforward")
        builder.ExportOutput(plant.get_state_output_port(), "robot_state_estimated")
        bearing = contact.GetOutputPort("contact_state_measured")
        builder.ExportOutput(bearing, "contact_state_measured")
        self.robot = builder.Build()
        self.body = Simulator(self.robot)
        start = state_of_plant(climb(), climb().diagram.CreateDefaultContext())
        plant.SetPositionsAndVelocities(
            plant.GetMyMutableContextFromRoot(self.body.get_mutable_context()), start
        )
        self.layout = make_layout(plant, p.robot)

    def pass_on(self, giver: Simulator, taker: Simulator, *names: str) -> None:
        """Copies output ports of one to the input ports of the other, by name."""
        for name in names:
            value = giver.get_system().GetOutputPort(name).Eval(giver.get_context())
            port = taker.get_system().GetInputPort(name)
            port.FixValue(taker.get_mutable_context(), np.array(value))

    def run_to(self, t: float) -> None:
        """Sense, think, act, tick by tick."""
        done = round(self.body.get_context().get_time() / TICK)
        for k in range(done + 1, round(t / TICK) + 1):
            self.pass_on(self.body, self.brain, "robot_state_estimated", "contact_state_measured")
            self.brain.AdvanceTo(k * TICK)
            self.pass_on(self.brain, self.body, "joint_state_desired", "joint_torque_feedforward")
            self.body.AdvanceTo(k * TICK)

    def read(self, simulator: Simulator, name: str) -> FloatArray:
        """An output of either."""
        return np.array(simulator.get_system().GetOutputPort(name).Eval(simulator.get_context()))


def test_controller_drives_a_robot_in_another_simulator() -> None:
    """Joined by its ports alone, it lifts a foot of a robot elsewhere, sets it down, and on."""
    both = Elsewhere()
    steps = [s for p in prepared().plan.plans[1:2] for s in p.contacts.steps]
    first, begin = steps[0], prepared().plan.starts[1]
    for t, in_air in (
        (begin + first.lift_off - 0.1, False),
        (begin + 0.5 * (first.lift_off + first.touchdown), True),
        (begin + first.touchdown + 0.2, False),
    ):
        both.run_to(t)
        state = both.layout.read(both.read(both.body, "robot_state_estimated"))
        wanted = both.read(both.brain, "body_desired")
        np.testing.assert_allclose(state.p_WB, wanted[:3], atol=0.01)
        bearing = both.read(both.body, "contact_state_measured") > 0.5
        assert bearing[first.leg.row] != in_air
        assert bearing.sum() == (3 if in_air else 4)


def test_what_feet_feel_of_the_ground_reaches_the_controller() -> None:
    """On level ground its input holds upright normals, soon; it has none of them unless asked."""
    made = make_climb(feel_normals=True, tracking="whole_body")
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.06)
    controller = controller_of(made.diagram)
    follower = controller.GetSubsystemByName("tracking_controller")
    port = follower.GetInputPort("ground_normal_measured")
    context = follower.GetMyContextFromRoot(simulator.get_context())
    normals = port.Eval(context).reshape(4, 3)
    np.testing.assert_allclose(normals, np.tile([0.0, 0.0, 1.0], (4, 1)), atol=0.02)
    assert not controller_of(make_climb(tracking="whole_body").diagram).HasInputPort(
        "ground_normal_measured"
    )
    asked = prepare(load_scenario("flat_walk", ["sensors.ground_normal=feet"]))
    names = {system.get_name() for system in stair_climb_of(asked).diagram.GetSystems()}
    assert "ground_normal_sensor" in names
