"""The controller Diagram fed with a robot's messages, tick by tick, and feet felt from them.

The controller is the project's own Diagram, which estimates its state from the messages alone. It
is built, planned and compiled before anything may move, and it stands at its first instant until
the robot stands. In walking it takes one of its own ticks for each of the controller's periods, by
the robot's time stamps: what a lost message held it takes to have been as in the next.
"""

import re
from typing import Protocol

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator, SimulatorStatus

from drake_quad.bus.drive_limits import Drives
from drake_quad.bus.messages import DRIVES_FOLLOW, StateMessage
from drake_quad.bus.real_time import NS
from drake_quad.bus.trace import BEARS
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.control.settings import ControlSettings
from drake_quad.errors import DrakeQuadError
from drake_quad.estimation.contact_from_torques import TouchMemory, TouchSettings
from drake_quad.estimation.imu_units import IMUS
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.planning.plan_job import PlanMaker
from drake_quad.robot.kinematics import calc_feet
from drake_quad.robot.loader import MakeModelPlant
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.scenario.build import touch_settings
from drake_quad.simulation.instruments import velocities_at_rest
from drake_quad.simulation.precompile import kernels_for, load_kernels
from drake_quad.simulation.prepared import PreparedScenario
from drake_quad.systems.controller import MakeController
from drake_quad.systems.joint_contact_estimator import MomentumObserver

SUNK = 0.6  # of its planned height over the feet: a trunk that is lower is not borne any more
SUNK_EVERY = 10  # ticks from one look at that to the next
MOST_TICKS = 25  # of the controller for one of the loop: what messages lost in 50 ms come to
STILL = 100  # ticks of a rehearsal that the robot stands, and as many that it is pushed
SHOVE = np.array([0.0, 30.0, 0.0])  # [m/s²] that the IMU feels then
PORTS = ("imu_measured", "joint_state_measured", "contact_state_measured")


class Walker(Protocol):
    """What wants something of the drives in walking.

    Attributes:
        ended: Why it does no more, or empty.
        fault: Why the drives are to damp, or empty.
        bearing: Torques (12,) that bear the robot as it stands before it walks [Nm].
    """

    ended: str
    fault: str
    bearing: FloatArray

    def take(self, state: StateMessage) -> None: ...  # noqa: D102
    def wanted(self) -> Drives: ...  # noqa: D102


class BusController:
    """The controller Diagram by itself, fed with messages.

    Args:
        prepared: The scenario, planned.
        control: Its settings.
        maker: Who makes plans while the robot stands; without one they are made within a tick.

    Attributes:
        bearing: Torques (12,) that bear the robot as it stands before it walks [Nm].
        ended: Why it does no more, or empty.
        fault: Why the drives are to damp, or empty.
        ticks: How many of its own ticks it has taken.
    """

    def __init__(
        self, prepared: PreparedScenario, control: ControlSettings, maker: PlanMaker | None = None
    ) -> None:
        robot = prepared.robot
        model = MakeModelPlant(robot.url)
        layout = make_layout(model, robot)
        self._layout, self._geometry = layout, robot.geometry
        self._leg_order = layout.actuators  # of the ports' rows, leg by leg
        self._control, self._mass, self._least = control, robot.mass, BEARS * robot.mass * GRAVITY
        self._period_ns = round(control.period * NS)
        feel = touch_settings(prepared.scenario)
        self._touch = None if feel is None else TouchByTorque(robot, layout, model, control, feel)
        self._diagram = MakeController(
            robot=robot,
            course=prepared.course,
            settings=prepared.settings,
            mission=prepared.tasks,
            control=control,
            model=model,
            start=prepared.stance,
            planned=prepared.plan.plans,
            maker=maker,
            foot_give=prepared.scenario.estimator.foot_give,
            imu=IMUS[prepared.scenario.sensors.imu],
        )
        q, _, _ = pose_robot(robot, prepared.stance.body[None], prepared.stance.feet[None])
        self._rest = velocities_at_rest(q.reshape(12)) | {"contact_state_measured": np.ones(4)}
        for plan in prepared.plan.plans:  # what a plan works out when it is first asked for
            plan.sample(0.0)
            plan.contacts.feet_at(np.array([plan.duration]))
        load_kernels(kernels_for(control.kind, "ekf", prepared.scenario.sensors.contacts))
        self._begin()
        self._stand_still()
        self._begin()
        self._rehearse()
        self._begin()

    def _begin(self) -> None:
        """Puts it at its first instant."""
        self._simulator = Simulator(self._diagram)
        self._context = self._simulator.get_mutable_context()
        self._values = {
            name: self._diagram.GetInputPort(name).FixValue(self._context, self._rest[name])
            for name in PORTS
        }
        self._ports = [
            self._diagram.GetOutputPort(name)
            for name in ("joint_state_desired", "joint_torque_feedforward")
        ]
        self._simulator.Initialize()
        self._estimate = self._diagram.GetOutputPort("robot_state_estimated")
        self._desired = [self._diagram.GetOutputPort(n) for n in ("body_desired", "feet_desired")]
        self._bears = np.ones(4)
        self.ticks, self._due_ns, self.ended, self.fault = 0, 0, "", ""
        if self._touch is not None:
            self._touch.reset()

    def _stand_still(self) -> None:
        """Some ticks on the spot: what it feeds its joints there bears the robot as it stands."""
        for k in range(1, STILL + 1):
            self._simulator.AdvanceTo((k + 0.5) * self._control.period)
            self.bearing = self.wanted().torque

    def _rehearse(self) -> None:
        """Takes messages of a robot that stands and is then pushed over, as it takes a robot's.

        What is called for the first time is loaded and bound then, which takes tens of milliseconds
        for a single function: in a robot's first tick its drives would have damped meanwhile.
        """
        joints = self._rest["joint_state_measured"]
        force = np.full(4, 0.25 * self._mass * GRAVITY)
        for k in range(1, 2 * STILL + 1):
            rate, specific_force = np.split(self._rest["imu_measured"], 2)
            if k > STILL:
                specific_force = specific_force + SHOVE
            self.take(
                StateMessage(
                    1, k, k * self._period_ns, DRIVES_FOLLOW, joints[:12], joints[12:],
                    self.bearing, rate, specific_force, force,
                )
            )  # fmt: skip
            self.wanted()

    def take(self, state: StateMessage) -> None:
        """Goes on to the time of a state, which is newer than all before."""
        if self.ended:
            return
        gap = 1
        if self._due_ns:
            gap = round((state.time_ns - self._due_ns) / self._period_ns)
            if gap < 1:
                return  # a bus quicker than the controller: its next tick has not come
        # Not the state's own time, or what rounding leaves would add up: 4 ms for each 5.
        self._due_ns = (self._due_ns or state.time_ns - self._period_ns) + gap * self._period_ns
        self._bears = self._bearing(state, gap)
        for name, value in (
            ("imu_measured", np.concatenate([state.angular_rate, state.specific_force])),
            ("joint_state_measured", np.concatenate([state.position, state.velocity])),
            ("contact_state_measured", self._bears),
        ):
            self._values[name].GetMutableData().get_mutable_value().SetFromVector(value)
        before, self.ticks = self.ticks, self.ticks + min(gap, MOST_TICKS)
        try:
            status = self._simulator.AdvanceTo((self.ticks + 0.5) * self._control.period)
        except (DrakeQuadError, RuntimeError) as problem:
            self.ended = f"stopped: {str(problem).splitlines()[0]}"
            return
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            found = re.search(r'message: "(.*)"', status.FormatMessage(), re.DOTALL)
            self.ended = found.group(1) if found else status.FormatMessage()
        if before // SUNK_EVERY != self.ticks // SUNK_EVERY:  # a tenth of a tick's work
            self.fault = self._sunk()

    def known(self) -> dict[str, FloatArray]:
        """What it knows and wants now, as `trace.CONTROLLER` has its parts; leg by leg."""
        x, base = self._estimate.Eval(self._context), int(self._layout.q_base)
        p_WB, feet = self._stance()
        body, places = (port.Eval(self._context) for port in self._desired)
        return {
            "clock": self._diagram.GetOutputPort("gait_phase").Eval(self._context),
            "pose": np.concatenate([p_WB, x[base : base + 4]]),
            "feet": feet,
            "bearing": np.array(self._bears),
            "body_desired": np.array(body),
            "feet_desired": np.array(places),
        }

    def _stance(self) -> tuple[FloatArray, FloatArray]:
        """Where it takes B (3,) and the feet's centres (4, 3) to be in W [m]."""
        read = self._layout.read(self._estimate.Eval(self._context))
        return read.p_WB, read.p_WB + calc_feet(self._geometry, read.q) @ read.R_WB.T

    def _sunk(self) -> str:
        """Says that the trunk is far below its plan; empty if it is not.

        Drives that do not give what they are told let the robot sink, and its feet stay where
        they are to be: the gait's clock would wait for them.
        """
        p_WB, feet = self._stance()
        body, places = (port.Eval(self._context) for port in self._desired)
        planned = float(body[2] - places[2::3].mean())
        height = float(p_WB[2] - feet[:, 2].mean())
        if height >= SUNK * planned:
            return ""
        return f"the trunk is {height:.2f} m above its feet, planned is {planned:.2f} m"

    def wanted(self) -> Drives:
        """What it wants of the drives now, leg by leg."""
        desired, torque = (port.Eval(self._context) for port in self._ports)
        legs, c = self._leg_order, self._control
        return Drives(desired[:12][legs], desired[12:][legs], torque[legs], c.kp, c.kd)

    def _bearing(self, state: StateMessage, gap: int) -> FloatArray:
        """Which feet bear (4,)."""
        if self._touch is None:
            return (state.foot_force > self._least).astype(float)
        return self._touch.feel(self._estimate.Eval(self._context), state, gap)


class TouchByTorque:
    """Which feet bear, felt by the joints: of messages, what JointContactEstimator is of ports.

    The trunk's velocity is the estimate of the tick before, for the estimate now needs contacts.

    Args:
        robot: The robot.
        layout: Layout of its state.
        model: The robot without ground.
        control: Controller whose period is read.
        settings: How the observer listens.
    """

    def __init__(
        self, robot: RobotModel, layout: StateLayout, model: MultibodyPlant,
        control: ControlSettings, settings: TouchSettings,
    ) -> None:  # fmt: skip
        self._layout, self._period = layout, control.period
        self._observer = MomentumObserver(
            robot, layout, model, control=control, settings=settings, friction=robot.joint_friction
        )
        self._scratch = model.CreateDefaultContext()
        self.reset()

    def reset(self) -> None:
        """Forgets all that it has felt."""
        self._memory = np.zeros(TouchMemory.SIZE)
        self._before = np.zeros(self._observer.before_shape)

    def feel(self, estimate: FloatArray, state: StateMessage, periods: int) -> FloatArray:
        """Which feet bear (4,), so many periods after the last call."""
        x = np.array(estimate)
        x[self._layout.q_joints], x[self._layout.v_joints] = state.position, state.velocity
        self._observer.update(
            self._scratch, self._memory, self._before, x, state.effort, periods * self._period
        )
        return self._memory[TouchMemory.BEARING].copy()
