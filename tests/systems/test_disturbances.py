"""Disturbances: they are in the simulated world, by just as much as was said, and nowhere else."""

from functools import cache

import numpy as np
import pytest
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from rig import GRAVITY, model_plant, paper_robot
from tick_reader import TickReader

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.scenario.build import disturbances_of, generator_of
from drake_quad.scenario.load import load_scenario, parse_scenario, scenario_text
from drake_quad.simulation.diagram import StairClimb, stair_climb_of
from drake_quad.simulation.plant import MakeTrueModel
from drake_quad.simulation.prepare import prepare
from drake_quad.systems.disturbances import Disturbances

STEP = 0.001  # [s]


@cache
def climb_with(*overrides: str) -> StairClimb:
    return stair_climb_of(prepare(load_scenario("flat_walk", overrides)))


def plant_context(made: StairClimb) -> Context:
    return made.plant.GetMyMutableContextFromRoot(made.diagram.CreateDefaultContext())


def names_in(made: StairClimb) -> set[str]:
    return {system.get_name() for system in made.diagram.GetSystems()}


def test_a_payload_is_the_plants_and_not_the_controllers() -> None:
    """The plant weighs so much more, its centre moves as it must; the robot's model is as it was.

    And the monitors, which measure the truth, have it too.
    """
    made = climb_with("disturbances.payload={mass: 6, x: 0.1, y: -0.05, z: 0.2}")
    context, robot = plant_context(made), paper_robot()
    plain = climb_with()
    plain_context = plant_context(plain)
    mass = made.plant.CalcTotalMass(context)
    assert mass == pytest.approx(robot.mass + 6.0)
    assert plain.plant.CalcTotalMass(plain_context) == pytest.approx(robot.mass)
    p_WB = made.plant.GetBodyByName(robot.trunk).EvalPoseInWorld(context).translation()
    expected = (
        robot.mass * plain.plant.CalcCenterOfMassPositionInWorld(plain_context)
        + 6.0 * (p_WB + np.array([0.1, -0.05, 0.2]))
    ) / mass
    found = made.plant.CalcCenterOfMassPositionInWorld(context)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert prepare(load_scenario("flat_walk")).robot.mass == robot.mass
    monitor = made.diagram.GetSubsystemByName("stability_monitor")
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.02)
    com = monitor.GetOutputPort("com_position").Eval(
        monitor.GetMyContextFromRoot(simulator.get_context())
    )
    np.testing.assert_allclose(com, expected, atol=2e-3)


def test_a_shifted_centre_of_mass_is_as_if_the_robots_file_had_it() -> None:
    """The mass matrix is that of a trunk with its inertia moved, at postures of all kinds."""
    robot, offset = paper_robot(), np.array([0.05, -0.02, 0.03])
    shifted = MakeTrueModel(robot, Disturbances(com_offset=tuple(offset)))  # type: ignore[arg-type]
    plain = model_plant()
    trunk = plain.GetBodyByName(robot.trunk)
    context, wanted = shifted.CreateDefaultContext(), plain.CreateDefaultContext()
    own = trunk.default_spatial_inertia()
    central = own.Shift(own.get_com()).CalcRotationalInertia()
    trunk.SetSpatialInertiaInBodyFrame(
        wanted,
        SpatialInertia.MakeFromCentralInertia(own.get_mass(), own.get_com() + offset, central),
    )
    rng = np.random.default_rng(4)
    for _ in range(5):
        q = rng.uniform(-1.0, 1.0, size=plain.num_positions())
        q[:4] /= np.linalg.norm(q[:4])
        for plant, at in ((shifted, context), (plain, wanted)):
            plant.SetPositions(at, q)
            plant.SetVelocities(at, 0.1 * np.arange(18.0))
        for terms in ("CalcMassMatrix", "CalcBiasTerm", "CalcGravityGeneralizedForces"):
            np.testing.assert_allclose(
                getattr(shifted, terms)(context), getattr(plain, terms)(wanted), atol=1e-9
            )
    assert shifted.CalcTotalMass(context) == pytest.approx(robot.mass)


def test_a_weak_drive_has_less_of_everything() -> None:
    """Its gains, its limit and its feed-forward are the factor's part; no other drive's are."""
    made = climb_with("disturbances.motor_strength=[{joint: RL_knee, factor: 0.6}]")
    control, robot = load_scenario("flat_walk").controller, paper_robot()
    for k, name in enumerate(robot.joint_names):
        actuator = made.plant.get_joint_actuator(
            next(
                i
                for i in made.plant.GetJointActuatorIndices()
                if made.plant.get_joint_actuator(i).joint().name() == name
            )
        )
        part = 0.6 if name == "RL_knee" else 1.0
        gains = actuator.get_controller_gains()
        assert (gains.p, gains.d) == pytest.approx((part * control.kp, part * control.kd))
        assert actuator.effort_limit() == pytest.approx(part * robot.effort[k])
        weak = made.diagram.GetSubsystemByName("motor_strength")
        context = weak.CreateDefaultContext()
        weak.get_input_port().FixValue(context, np.ones(12))
        index = made.layout.actuators[k]
        assert weak.get_output_port().Eval(context)[index] == part


def test_a_dead_drive_is_simulated_too() -> None:
    """A factor of 0 is no error: the joint gives nothing, the run goes on or ends with a reason."""
    made = climb_with("disturbances.motor_strength=[{joint: FR_abduction, factor: 0}]")
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.2)
    torque = made.loggers["torque"].FindLog(simulator.get_context()).data()
    index = made.layout.actuators[paper_robot().joint_names.index("FR_abduction")]
    assert np.abs(torque[index]).max() < 1e-3 < np.abs(torque).max()


def read_at_ticks(override: str, ports: dict[str, str]) -> dict[str, FloatArray]:
    """What ticks of 1 ms read of each system's port, (steps, size), by `system.port`."""
    readers: dict[str, TickReader] = {}

    def add(builder: DiagramBuilder, plant: object, scene: object) -> None:
        for port, system in ports.items():
            output = builder.GetSubsystemByName(system).GetOutputPort(port)
            reader = TickReader(size=output.size(), period=STEP)
            readers[port] = builder.AddNamedSystem(f"read_{port}", reader)
            builder.Connect(output, reader.get_input_port())

    made = stair_climb_of(prepare(load_scenario("flat_walk", [override])), visualize=add)
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.0499)
    return {port: reader.notes(simulator.get_context())[:50] for port, reader in readers.items()}


def test_senses_are_late_by_the_delay() -> None:
    """A tick reads what it would have read 4 steps before; until then the first state."""
    read = read_at_ticks(
        "disturbances.sensor_delay=0.004",
        {
            "state": "plant",
            "contact_state_measured": "contact_monitor",
            "robot_state_estimated_delayed": "sensor_delay",
            "contact_state_measured_delayed": "sensor_delay",
        },
    )
    late, now = read["robot_state_estimated_delayed"], read["state"]
    np.testing.assert_array_equal(late[4:], now[:-4])
    made = climb_with()
    first = made.plant.GetPositions(plant_context(made))
    np.testing.assert_array_equal(late[:4], np.tile([*first, *np.zeros(18)], (4, 1)))
    assert np.abs(np.diff(now, axis=0)).max() > 1e-6
    late, now = read["contact_state_measured_delayed"], read["contact_state_measured"]
    np.testing.assert_array_equal(late[4:], now[:-4])
    assert np.all(late[:4] == 0.0) and np.any(now == 1.0)


def test_commands_are_late_by_the_delay_and_hold_the_stance_before() -> None:
    """The drives get what they would have got 3 steps before; at first, to stand as they stand."""
    names = ("joint_state_desired", "joint_torque_feedforward")
    read = read_at_ticks(
        "disturbances.command_delay=0.003",
        {n: "controller" for n in names} | {f"{n}_delayed": "command_delay" for n in names},
    )
    for name in names:
        np.testing.assert_array_equal(read[f"{name}_delayed"][3:], read[name][:-3])
    made = climb_with()
    q = made.plant.GetPositions(plant_context(made))
    first = read["joint_state_desired_delayed"][0]
    np.testing.assert_allclose(first[made.layout.actuators], q[made.layout.q_joints])
    assert np.all(first[12:] == 0.0)


def test_without_disturbances_nothing_is_added() -> None:
    """No delay and no gain stands in any wire, and the plant has the robot's bodies alone."""
    made = climb_with()
    assert not {"sensor_delay", "command_delay", "motor_strength"} & names_in(made)
    assert made.plant.num_bodies() == model_plant().num_bodies()
    assert prepare(load_scenario("flat_walk")).disturbances == Disturbances()


def test_a_pushs_force_is_mass_times_speed_over_time() -> None:
    """Speed and direction become a force in the robot's frame; a force is what it is."""
    scenario = load_scenario(
        "flat_walk",
        [
            "disturbances.pushes=[{time: 1, speed: 0.5, direction_deg: 90, duration: 0.2}, "
            "{time: 2, force: [30, 0, 40], duration: 0.05, body: FL_hip, point: [0, 0, 1]}, "
            "{time: 3, speed: 1.0, duration: 0.0001}]"
        ],
    )
    robot = paper_robot()
    first, second, third = disturbances_of(scenario, robot).pushes
    np.testing.assert_allclose(first.force_H, [0.0, robot.mass * 0.5 / 0.2, 0.0], atol=1e-9)
    assert (first.body, first.speed) == (robot.trunk, 0.5)
    assert second.force_H == (30.0, 0.0, 40.0) and second.body == "FL_hip"
    assert second.p_BP == (0.0, 0.0, 1.0)
    assert second.speed == pytest.approx(50.0 * 0.05 / robot.mass)
    assert third.duration == STEP  # one step at least, the impulse kept
    assert third.force_H[0] * third.duration == pytest.approx(robot.mass)


@pytest.mark.parametrize(
    ("override", "field", "remedy"),
    [
        (
            "disturbances.motor_strength=[{joint: FL_kne, factor: 0.5}]",
            "disturbances.motor_strength[0].joint",
            "did you mean FL_knee?",
        ),
        (
            "disturbances.pushes=[{time: 1, speed: 1}, {time: 1, speed: 1, body: FL_shin}]",
            "disturbances.pushes[1].body",
            "did you mean FL_shank?",
        ),
        ("world.rise_error=-0.1", "world.rise_error", "rise"),
    ],
)
def test_what_this_robot_or_course_has_not_is_refused(
    override: str, field: str, remedy: str
) -> None:
    """The field, the file, and the nearest name."""
    course = "course=[{kind: floor, length: 3}, {kind: stairs, going: up, rise: 0.1, run: 0.5, "
    course += "count: 2}, {kind: floor, length: 3}]"
    with pytest.raises(InputError) as caught:
        prepare(load_scenario("flat_walk", [course, override]), source="mine.yaml")
    assert (caught.value.source, caught.value.field) == ("mine.yaml", field)
    assert remedy in caught.value.remedy


def test_streams_of_random_numbers_are_apart() -> None:
    """Each has its own numbers, by the seed alone; an unknown one is an error."""
    scenario = load_scenario("flat_walk")
    draws = {s: generator_of(scenario, s).random(4).tolist() for s in ("world", "imu")}
    assert draws["world"] != draws["imu"]
    assert draws["world"] == generator_of(scenario, "world").random(4).tolist()
    other = load_scenario("flat_walk", ["simulation.seed=1"])
    assert draws["world"] != generator_of(other, "world").random(4).tolist()
    with pytest.raises(ValueError):
        generator_of(scenario, "weather")


def test_disturbances_survive_saving() -> None:
    """Lists, vectors and what was left out come back equal."""
    scenario = load_scenario(
        "flat_walk",
        [
            "disturbances.pushes=[{time: 1, speed: 0.5}, {time: 2, force: [1, 2, 3]}]",
            "disturbances.motor_strength=[{joint: FL_knee, factor: 0.5}]",
            "world={rise_error: 0.01, random: true}",
        ],
    )
    assert parse_scenario(scenario_text(scenario), source="text") == scenario


def test_a_standing_robot_with_a_payload_loads_its_feet_with_it() -> None:
    """The ground bears the weight of both."""
    made = climb_with("disturbances.payload={mass: 6, z: 0.1}")
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.6)
    force = made.loggers["force"].FindLog(simulator.get_context()).data()[2::3, -40:]
    weight = (paper_robot().mass + 6.0) * GRAVITY
    assert force.sum(axis=0).mean() == pytest.approx(weight, rel=0.01)
