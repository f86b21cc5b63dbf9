"""A simulated robot's side of a bus: physics, sensors, and drives that watch their commander.

What a robot's drives do of themselves is here as well: they hold when the commander is silent for
20 ms, damp within 100 ms or at any fault, and stay damped until they are told to be.
"""

from typing import Protocol

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_quad.bus.drive_limits import DAMP_AFTER, HOLD_AFTER
from drake_quad.bus.messages import (
    DRIVES_DAMP,
    DRIVES_FOLLOW,
    DRIVES_HOLD,
    CommandMessage,
    StateMessage,
)
from drake_quad.bus.postures import lowest_stance
from drake_quad.bus.real_time import NS, Clock, LoopTimes
from drake_quad.bus.robot_bus import RobotBus, new_session
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.trace import BEARS
from drake_quad.bus.watch import CommandWatch
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.imu_units import IDEAL_IMU
from drake_quad.estimation.sensor_models import IDEAL_JOINTS, SensorErrors
from drake_quad.robot.kinematics import calc_feet
from drake_quad.scenario.build import generator_of, sensor_errors
from drake_quad.simulation.instruments import AddPushes, AddSensors
from drake_quad.simulation.plant import AddSimulatedPlant
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet

SENSE_FEET = 2  # periods between readings of the feet's sensors


class DriveGuard:
    """What a robot's drives make of what comes over the bus.

    Attributes:
        drives: DRIVES_DAMP, DRIVES_FOLLOW or DRIVES_HOLD.
        reason: Why they damp, or empty.
        damped_ns: When they began to damp for that reason [ns].
    """

    def __init__(self) -> None:
        self._watch = CommandWatch()
        self._latched = False
        self.drives, self.reason, self.damped_ns = DRIVES_DAMP, "", 0

    @property
    def command(self) -> CommandMessage | None:
        """The newest sound command."""
        return self._watch.newest

    def judge(self, bus: RobotBus, now_ns: int) -> int:
        """Takes in what came, and says what the drives do now."""
        before = self.drives
        fault = self._watch.take(bus.receive_commands())
        command = self._watch.newest
        age = (now_ns - self._watch.received_ns) / NS
        if command is not None and not fault and age > DAMP_AFTER:
            fault = "the commander is silent"
        if fault:
            if before != DRIVES_DAMP:
                self.reason, self.damped_ns, self._latched = fault, now_ns, True
            self.drives = DRIVES_DAMP
        elif command is None or command.mode == SafetyMode.DAMPING:
            self._latched, self.drives = False, DRIVES_DAMP
        elif self._latched:
            self.drives = DRIVES_DAMP
        else:
            self.drives = DRIVES_HOLD if age > HOLD_AFTER else DRIVES_FOLLOW
        return self.drives


class RobotSide(Protocol):
    """A robot as far as its drives and its sensors: Drake's, or another engine's."""

    period: float  # [s] from one `advance` to the next

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def base(self) -> FloatArray:
        """Where the trunk is, (3,) in W [m], the truth."""

    def truth(self) -> dict[str, FloatArray]:
        """Where it is, as `trace.ROBOT` has its parts `pose`, `feet` and `bearing`."""

    def advance(self, drives: int, command: CommandMessage | None) -> None:
        """Goes on by a period, the drives doing as they are told: DRIVES_DAMP and so on."""

    def sense(self, session: int, sequence: int, time_ns: int, drives: int) -> StateMessage:
        """What it senses now."""


class SimulatedRobot:
    """A robot in Drake's physics, as far as its drives and its sensors.

    It begins on folded legs, damped, where the scenario has it begin.

    Args:
        prepared: The scenario.
    """

    def __init__(self, prepared: PreparedScenario) -> None:
        scenario, robot = prepared.scenario, prepared.robot
        control = scenario.controller
        self._control, self.period = control, control.period
        builder = DiagramBuilder()
        simulated = AddSimulatedPlant(
            builder,
            robot=robot,
            world=prepared.world,
            control=control,
            stance=lowest_stance(robot, prepared.stance),
            config=scenario.simulation.plant,
            friction=scenario.simulation.friction,
            disturbances=prepared.disturbances,
        )
        plant, scene_graph, instance, layout = simulated
        inspector = scene_graph.model_inspector()
        names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
        contact = builder.AddNamedSystem(
            "contact_monitor",
            ContactMonitor(
                plant=plant, foot_geometries=find_feet(plant, robot, names), robot=robot,
                period=SENSE_FEET * control.period,
            ),
        )  # fmt: skip
        builder.Connect(
            plant.get_contact_results_output_port(), contact.GetInputPort("contact_results")
        )
        if contact.HasInputPort("plant_state"):
            builder.Connect(plant.get_state_output_port(), contact.GetInputPort("plant_state"))
        AddPushes(builder, simulated, prepared.disturbances)
        errors = sensor_errors(scenario) or SensorErrors(
            imu=IDEAL_IMU, joints=IDEAL_JOINTS,
            imu_generator=generator_of(scenario, "imu"),
            joint_generator=generator_of(scenario, "joint_sensor"),
        )  # fmt: skip
        senses = AddSensors(
            builder, plant.get_state_output_port(), layout=layout, errors=errors,
            period=control.period,
        )  # fmt: skip
        for name, port in senses.items():
            builder.ExportOutput(port, name)
        builder.ExportOutput(contact.GetOutputPort("foot_force_measured"), "foot_force")
        builder.ExportOutput(plant.get_net_actuation_output_port(instance), "effort")
        builder.ExportInput(plant.get_desired_state_input_port(instance), "desired")
        builder.ExportInput(plant.get_actuation_input_port(instance), "feedforward")
        self._diagram = builder.Build()
        self._plant, self._layout, self._geometry = plant, layout, robot.geometry
        self._simulator = Simulator(self._diagram)
        context = self._simulator.get_mutable_context()
        self._context = context
        self._plant_context = plant.GetMyContextFromRoot(context)
        self._desired = self._diagram.GetInputPort("desired").FixValue(context, np.zeros(24))
        self._feedforward = self._diagram.GetInputPort("feedforward").FixValue(
            context, np.zeros(12)
        )
        self._outputs = {
            name: self._diagram.GetOutputPort(name)
            for name in ("imu_measured", "joint_state_measured", "foot_force", "effort")
        }
        self._by_actuator = np.argsort(layout.actuators)
        self._step = plant.time_step()
        self._steps_each = round(control.period / self._step)
        self._steps, self._foot_force = 0, np.zeros(4)
        self._least = BEARS * robot.mass * GRAVITY
        self._drive(DRIVES_DAMP, None)
        self._simulator.Initialize()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self._step

    @property
    def state(self) -> FloatArray:
        """[q; v], the truth."""
        return np.array(self._plant.GetPositionsAndVelocities(self._plant_context))

    @property
    def base(self) -> FloatArray:
        """Where the trunk is, (3,) in W [m], the truth."""
        return np.asarray(self._layout.read(self.state).p_WB)

    @property
    def feet(self) -> FloatArray:
        """Where the feet's centres are, (4, 3) in W [m], the truth."""
        read = self._layout.read(self.state)
        return np.asarray(read.p_WB + calc_feet(self._geometry, read.q) @ read.R_WB.T)

    def truth(self) -> dict[str, FloatArray]:
        """Where it is, as `trace.ROBOT` has its parts `pose`, `feet` and `bearing`."""
        base = int(self._layout.q_base)
        force = self._outputs["foot_force"].Eval(self._context).reshape(4, 3)
        return {
            "pose": np.concatenate([self.base, self.state[base : base + 4]]),
            "feet": self.feet,
            "bearing": (force[:, 2] > self._least).astype(float),
        }

    def advance(self, drives: int, command: CommandMessage | None) -> None:
        """Goes on by a period with the drives doing as they are told, step by step."""
        for _ in range(self._steps_each):
            self._drive(drives, command)
            self._steps += 1
            # A little on: rounding cannot decide whether a step at this time is taken.
            self._simulator.AdvanceTo((self._steps + 0.25) * self._step)

    def _drive(self, drives: int, command: CommandMessage | None) -> None:
        """Puts τ + k (q_d - q) + d (v_d - v) on the plant's own drives of gains kp and kd.

        Those act within a step, implicitly. Other gains are had by wanting another angle and
        speed than the command does, by the share that k has of kp, and d of kd; with k of 0 the
        angle wanted is the one that the joint is about to have.
        """
        control, layout = self._control, self._layout
        x = self._plant.GetPositionsAndVelocities(self._plant_context)
        q, v = x[layout.q_joints], x[layout.v_joints]
        ahead = q + self._step * v
        if drives == DRIVES_DAMP or command is None:
            wanted, speed, torque = ahead, np.zeros(12), np.zeros(12)
        else:
            k, d = command.stiffness / control.kp, command.damping / control.kd
            told = command.velocity if drives == DRIVES_FOLLOW else np.zeros(12)
            wanted = np.where(k == 1.0, command.position, ahead + k * (command.position - ahead))
            speed = np.where(d == 1.0, told, v + d * (told - v))
            torque = command.effort
        order = self._by_actuator
        self._desired.GetMutableData().get_mutable_value().SetFromVector(
            np.concatenate([wanted[order], speed[order]])
        )
        self._feedforward.GetMutableData().get_mutable_value().SetFromVector(torque[order])

    def sense(self, session: int, sequence: int, time_ns: int, drives: int) -> StateMessage:
        """What it senses now."""
        outputs, context = self._outputs, self._context
        imu = outputs["imu_measured"].Eval(context)
        joints = outputs["joint_state_measured"].Eval(context)
        if sequence % SENSE_FEET == 0:
            force = outputs["foot_force"].Eval(context).reshape(4, 3)
            self._foot_force = np.maximum(force[:, 2], 0.0)
        effort = outputs["effort"].Eval(context)[self._layout.actuators]
        return StateMessage(
            session, sequence, time_ns, drives, joints[:12], joints[12:], effort, imu[:3], imu[3:],
            self._foot_force,
        )  # fmt: skip


class RobotLoop:
    """A tick of the robot's side: take commands in, judge them, move, and say what is sensed.

    Args:
        robot: The robot.
        bus: The robot's end of the bus.
        clock: The loop's clock; the robot's own, in the messages, is its simulated time.
    """

    def __init__(self, robot: RobotSide, bus: RobotBus, clock: Clock) -> None:
        self.robot, self.guard = robot, DriveGuard()
        self._bus, self._clock = bus, clock
        self._session, self._sequence = new_session(), 0
        self.times = LoopTimes(robot.period)

    def tick(self) -> None:
        """One tick."""
        begun = self._clock.now_ns()
        drives = self.guard.judge(self._bus, begun)
        self.robot.advance(drives, self.guard.command)
        self._sequence += 1
        time_ns = round(self.robot.time * NS)
        state = self.robot.sense(self._session, self._sequence, time_ns, drives)
        self._bus.publish_state(state)
        self.times.note(begun, self._clock.now_ns(), -1)
