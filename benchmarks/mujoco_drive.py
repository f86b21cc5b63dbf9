"""The controller's Diagram driven in MuJoCo, in lock step.

Nothing of the controller is here: its Diagram is given, and its ports are asked for by name.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, FixedInputPortValue

from benchmarks.mujoco_model import STEP
from benchmarks.mujoco_robot import MujocoRobot
from drake_quad.common import FloatArray
from drake_quad.control.ports import GaitPhase
from drake_quad.errors import DrakeQuadError
from drake_quad.planning.motion_plan import MotionPlan

TILT_LIMIT = np.radians(40.0)  # beyond it the robot fell
HEIGHT_LIMIT = 0.25  # [m] the trunk is at its feet: both are the StabilityMonitor's


@dataclass(frozen=True, eq=False)
class Drive:
    """A run in MuJoCo, a row each controller period.

    Attributes:
        outcome: `goal_reached`, or why not.
        times: (N,) [s].
        place: (N, 3) the trunk in W [m].
        yaw: (N,) its heading [rad].
        base_error: (N,) its distance from where the plan has it [m].
        margin: (N,) static margin over the feet that bear [m].
        force: (N, 4) normal force on each foot [N].
        torque_ratio: (N,) the drives' largest torque to its limit.
        touched: The course's boxes that feet pressed on.
        others: Contacts of anything but a foot with the course, at any of MuJoCo's steps.
        waited: How long the gait clock waited in all [s].
        plan: The last task's.
    """

    outcome: str
    times: FloatArray
    place: FloatArray
    yaw: FloatArray
    base_error: FloatArray
    margin: FloatArray
    force: FloatArray
    torque_ratio: FloatArray
    touched: frozenset[str]
    others: frozenset[tuple[str, str]]
    waited: float
    plan: MotionPlan


def drive(
    controller: Diagram,
    body: MujocoRobot,
    *,
    limit: float,
    exchange: float | None = None,
    deaf: frozenset[str] = frozenset(),
) -> Drive:
    """Runs `controller`, a Diagram by itself with its own Context, on the robot in MuJoCo.

    In lock step: the controller's input ports are given what the robot senses, the controller
    does what its clocks have it do then, and the drives are told what it puts out.

    Args:
        controller: Any Diagram whose input ports are named as methods of MujocoRobot are.
        body: Simulated robot at its start.
        limit: When to give up [s].
        exchange: Time between exchanges [s], of which every clock in the controller is a multiple;
            the controllers' period unless told.
        deaf: Input ports that keep what they were given at the start.
    """
    simulator = Simulator(controller)
    context = simulator.get_mutable_context()
    senses: list[tuple[Callable[[], FloatArray], FixedInputPortValue]] = []
    for k in range(controller.num_input_ports()):
        port = controller.get_input_port(k)
        sense = getattr(body, port.get_name())
        value = port.FixValue(context, sense())
        if port.get_name() not in deaf:
            senses.append((sense, value))
    ports = {
        name: controller.GetOutputPort(name)
        for name in ("joint_state_desired", "joint_torque_feedforward", "body_desired")
    }
    simulator.Initialize()
    logged = round(body.control.period / STEP)
    exchanged = round((exchange or body.control.period) / STEP)
    rows: list[list[float]] = []
    touched, others = set(body.contacts.touched), set(body.contacts.others)
    outcome = f"not at the goal after {limit:g} s"
    while body.time < limit:
        if body.steps % exchanged == 0:
            for sense, value in senses:
                value.GetMutableData().get_mutable_value().SetFromVector(sense())
            # Half a step on: rounding cannot decide on which side of a clock's tick this is.
            try:
                status = simulator.AdvanceTo(body.time + 0.5 * STEP)
            except DrakeQuadError as problem:  # no way back to the plan: a run in Drake stops, too
                outcome = f"stopped: {problem}"
                break
            body.command(
                ports["joint_state_desired"].Eval(context),
                ports["joint_torque_feedforward"].Eval(context),
            )
            if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                found = re.search(r'message: "(.*)"', status.FormatMessage(), re.DOTALL)
                outcome = found.group(1) if found else status.FormatMessage()
                break
        if body.steps % logged == 0:
            place, R = body.data.qpos[:3], body.R_WB
            yaw = float(np.arctan2(R[1, 0], R[0, 0]))
            error = float(np.linalg.norm(place - ports["body_desired"].Eval(context)[:3]))
            ratio = float(np.max(np.abs(body.data.actuator_force) / body.robot.effort))
            rows.append([body.time, *place, yaw, error, body.margin, *body.contacts.force, ratio])
            if not R[2, 2] > np.cos(TILT_LIMIT):  # nor if it is not a number
                outcome = "fell: the trunk is tilted"
                break
            if not place[2] - body.ground > HEIGHT_LIMIT:
                outcome = "fell: the trunk is down at its feet"
                break
        body.step()
        touched |= body.contacts.touched
        others |= body.contacts.others
    table = np.array(rows)
    phase = controller.GetOutputPort("gait_phase").Eval(context)
    return Drive(
        outcome,
        times=table[:, 0],
        place=table[:, 1:4],
        yaw=table[:, 4],
        base_error=table[:, 5],
        margin=table[:, 6],
        force=table[:, 7:11],
        torque_ratio=table[:, 11],
        touched=frozenset(touched),
        others=frozenset(others),
        waited=float(phase[GaitPhase.WAITED]),
        plan=controller.GetOutputPort("motion_plan").Eval(context),
    )
