"""What the tests of the controllers share: a controller alone, its inputs, and what it asks for."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context
from rig import (
    feet_of,
    fix_inputs,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    read,
    rotations,
    state_of,
)

from drake_quad.common import FloatArray
from drake_quad.control.ports import CATCH_SIZE, SIZE, Catch, GaitPhase, Mode
from drake_quad.control.settings import ControlSettings
from drake_quad.control.tracking import DELIVERY
from drake_quad.planning.motion_plan import MotionPlan, PlanSample
from drake_quad.robot.kinematics import calc_feet, calc_jacobians
from drake_quad.robot.state import StateLayout
from drake_quad.systems.tracking_controller import TrackingController
from drake_quad.terrain.course import Course

TICK = ControlSettings().period


def phase_at(
    t: float, *, rate: float = 1.0, task: int = 0, mode: Mode = Mode.RUN, swing: int = 0
) -> FloatArray:
    """A `gait_phase` vector."""
    phase = np.zeros(SIZE)
    phase[GaitPhase.TIME], phase[GaitPhase.RATE], phase[GaitPhase.TASK] = t, rate, task
    phase[GaitPhase.MODE], phase[GaitPhase.SWING_LEG] = float(mode), swing
    return phase


def catch_with(
    leg: int, place: FloatArray, *, duration: float, elapsed: float, lift: float = 0.05
) -> FloatArray:
    """A `catch` vector."""
    catch = np.zeros(CATCH_SIZE)
    catch[Catch.LEG], catch[Catch.X : Catch.DURATION] = leg, place
    catch[Catch.DURATION], catch[Catch.ELAPSED], catch[Catch.LIFT] = duration, elapsed, lift
    return catch


def state_on(plan: MotionPlan, t: float) -> FloatArray:
    """The robot where the plan has it at `t`, at rest."""
    sample = plan.sample(t)
    return state_of(sample.body[0], sample.feet)


def middle_of(leg_in_air: bool, number: int = 2) -> float:
    """A gait time in the middle of a swing, or between two, of the level walk."""
    phases = [p for p in flat_walk().contacts.phases if (p.step is not None) == leg_in_air]
    return 0.5 * (phases[number].start + phases[number].end)


class Controller:
    """A controller in a simulator of its own; targets in the order of legs."""

    def __init__(
        self,
        kind: type[TrackingController],
        plan: MotionPlan,
        state: FloatArray,
        *,
        control: ControlSettings,
        t: float = 0.0,
        rate: float = 1.0,
        layout: StateLayout | None = None,
        course: Course | None = None,
    ) -> None:
        self.layout = layout or model_layout()
        self.system = kind(
            robot=paper_robot(), layout=self.layout, model=model_plant(), control=control,
            course=course,
        )  # fmt: skip
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self._period = control.period
        self._ticks = 0
        self.give(plan, state, phase_at(t, rate=rate))
        self.also(catch=np.zeros(CATCH_SIZE))

    def give(self, plan: MotionPlan, state: FloatArray, phase: FloatArray) -> None:
        """Sets the inputs from now on; the feet bear that the plan has standing."""
        standing = plan.sample(min(float(phase[GaitPhase.TIME]), plan.duration)).standing
        self.also(motion_plan=plan, gait_phase=phase, robot_state_estimated=state)
        self.also(contact_state_measured=standing.astype(float))

    def also(self, **inputs: object) -> None:
        """Sets some inputs from now on, by name."""
        fix_inputs(self.system, self.context, **inputs)

    def tick(self, count: int = 1) -> "Controller":
        """Runs for so many control periods: just so many updates."""
        if self._ticks == 0:
            self.simulator.Initialize()
        # Halfway between two ticks, so that no rounding decides how many there are.
        self._ticks += count
        self.simulator.AdvanceTo((self._ticks - 0.5) * self._period)
        return self

    def out(self, name: str) -> FloatArray:
        """An output port's vector now."""
        return read(self.system, self.context, name)

    @property
    def target(self) -> tuple[FloatArray, FloatArray]:
        """Joint angles (4, 3) and speeds (4, 3) desired."""
        both = self.out("joint_state_desired")
        rank = np.argsort(np.argsort(self.layout.actuators))
        return both[:12][rank].reshape(4, 3), both[12:][rank].reshape(4, 3)

    @property
    def torque(self) -> FloatArray:
        """Feed-forward torques (4, 3)."""
        rank = np.argsort(np.argsort(self.layout.actuators))
        return self.out("joint_torque_feedforward")[rank].reshape(4, 3)

    @property
    def feet(self) -> FloatArray:
        """Feet desired in W (4, 3)."""
        return self.out("feet_desired").reshape(4, 3)


def forces_of(torque: FloatArray, state: FloatArray) -> FloatArray:
    """The forces on the feet (4, 3) in W that these torques balance, the robot being at rest."""
    plant, layout = model_plant(), model_layout()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    gravity = plant.CalcGravityGeneralizedForces(context)[layout.v_joints - layout.num_positions]
    measured = layout.read(state)
    J = calc_jacobians(paper_robot().geometry, measured.q)
    held = -(torque + gravity.reshape(4, 3))
    f_B = np.stack([np.linalg.solve(J[k].T, held[k]) for k in range(4)])
    return np.asarray(f_B @ measured.R_WB.T)


def com_of(state: FloatArray) -> FloatArray:
    """The whole robot's centre of mass in W [m]."""
    plant = model_plant()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    return np.array(plant.CalcCenterOfMassPositionInWorld(context))


def feet_ahead(sample: PlanSample) -> FloatArray:
    """Where in W a plan has the feet (4, 3) half a tick after a command has reached the drives."""
    return np.asarray(sample.feet + (DELIVERY + 0.5 * TICK) * sample.feet_velocity)


def foot_target(controller: Controller, plan: MotionPlan, t: float, row: int) -> FloatArray:
    """Where in W the targets put a foot of a robot whose base is on its plan."""
    body = plan.sample(t).body[0]
    p_BF = calc_feet(paper_robot().geometry, controller.target[0])[row]
    return np.asarray(body[:3] + rotations(body) @ p_BF)


__all__ = [
    "TICK",
    "Controller",
    "catch_with",
    "com_of",
    "feet_ahead",
    "feet_of",
    "foot_target",
    "forces_of",
    "middle_of",
    "phase_at",
    "state_on",
]
