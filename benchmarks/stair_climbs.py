"""The whole simulation, and the bare plant that follows the very same commands."""

import time
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import DiagramBuilder, InputPort
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from drake_quad.common import FloatArray
from drake_quad.robot.loader import AddRobot
from drake_quad.simulation.diagram import StairClimb, Visualize, stair_climb_of
from drake_quad.simulation.prepare import PreparedScenario
from drake_quad.terrain.drake_geometry import AddCourse, SetContactFriction

COMMANDS = ("joint_state_desired", "joint_torque_feedforward")


@dataclass(frozen=True, eq=False)
class Commands:
    """What the controller commanded in a run.

    Attributes:
        start: The plant's state at time 0.
        period: Period of the controller [s].
        held: Values of the controller's output port, (n + 1, size): row 0 after its
            initialization, row k + 1 at time k * period.
    """

    start: FloatArray
    period: float
    held: dict[str, FloatArray]

    @property
    def duration(self) -> float:
        """How long they last [s]."""
        return float(self.period * (len(self.held[COMMANDS[0]]) - 1))


@dataclass(frozen=True, eq=False)
class Pair:
    """Simulators of the whole and of the bare plant, and the plants in them."""

    whole: Simulator
    bare: Simulator
    whole_plant: MultibodyPlant
    bare_plant: MultibodyPlant

    def state_difference(self) -> float:
        """The largest difference between any entry of the two plants' states."""
        a, b = (
            plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context()))
            for plant, simulator in (
                (self.whole_plant, self.whole),
                (self.bare_plant, self.bare),
            )
        )
        return float(np.max(np.abs(a - b)))


def make_whole(
    p: PreparedScenario, *, visualize: Visualize | None = None
) -> tuple[StairClimb, Simulator]:
    """The simulation as `drake-quad run` has it."""
    scenario = p.scenario
    climb = stair_climb_of(p, visualize=visualize)
    simulator = Simulator(climb.diagram)
    ApplySimulatorConfig(scenario.simulation.simulator, simulator)
    return climb, simulator


def record(p: PreparedScenario, *, duration: float) -> tuple[Commands, float]:
    """Runs the whole for `duration` [s] or to its end: its commands, and its wall time [s]."""
    sinks = {}
    period = p.scenario.controller.period

    def add_logs(builder: DiagramBuilder, _plant: object, _scene: object) -> None:
        controller = builder.GetSubsystemByName("controller")
        for name in COMMANDS:
            port = controller.GetOutputPort(name)
            sinks[name] = LogVectorOutput(port, builder, period)

    climb, simulator = make_whole(p, visualize=add_logs)
    context = simulator.get_context()
    start = climb.plant.GetPositionsAndVelocities(climb.plant.GetMyContextFromRoot(context))
    begun = time.perf_counter()
    simulator.AdvanceTo(duration)
    wall = time.perf_counter() - begun
    # A log's sample at a tick is the value before that tick's update.
    held = {name: np.array(sink.FindLog(context).data().T) for name, sink in sinks.items()}
    return Commands(np.array(start), period, held), wall


def make_bare(p: PreparedScenario, commands: Commands) -> tuple[MultibodyPlant, Simulator]:
    """The same robot, course and gains, following `commands`; nothing in it is Python."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(p.scenario.simulation.plant, builder)
    instance = AddRobot(plant, p.robot.url)
    friction = p.scenario.simulation.friction
    AddCourse(plant, p.course, friction=friction)
    SetContactFriction(plant, scene_graph, instance, p.robot, friction)
    plant.Finalize()
    control = p.scenario.controller
    for index in plant.GetJointActuatorIndices(instance):
        plant.get_joint_actuator(index).set_controller_gains(
            PdControllerGains(p=control.kp, d=control.kd)
        )
    inputs: dict[str, InputPort] = {
        "joint_state_desired": plant.get_desired_state_input_port(instance),
        "joint_torque_feedforward": plant.get_actuation_input_port(instance),
    }
    holds = {}
    for name, port in inputs.items():
        values = commands.held[name]
        # Breaks lie between the ticks, so that rounding cannot pick the neighbour of a value.
        breaks = commands.period * (np.arange(len(values)) - 0.5)
        following = np.vstack([values[1:], values[-1:]])
        source = builder.AddSystem(
            TrajectorySource(PiecewisePolynomial.ZeroOrderHold(breaks, following.T))
        )
        # The hold takes a value at a tick as the controller does: the plant's step at that very
        # time still has the one before.
        holds[name] = builder.AddSystem(ZeroOrderHold(commands.period, values.shape[1]))
        builder.Connect(source.get_output_port(), holds[name].get_input_port())
        builder.Connect(holds[name].get_output_port(), port)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    ApplySimulatorConfig(p.scenario.simulation.simulator, simulator)
    context = simulator.get_mutable_context()
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), commands.start)
    for name, hold in holds.items():
        hold.SetVectorState(hold.GetMyMutableContextFromRoot(context), commands.held[name][0])
    return plant, simulator


def make_pair(p: PreparedScenario, commands: Commands) -> Pair:
    """Both, at time 0."""
    climb, whole = make_whole(p)
    plant, bare = make_bare(p, commands)
    return Pair(whole, bare, climb.plant, plant)
