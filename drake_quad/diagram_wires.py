"""The wires between the controller and the robot: what it senses, and what its drives are told."""

from collections.abc import Mapping

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import Gain

from drake_quad.gait.legs import FloatArray
from drake_quad.systems.delay import Delay

COMMANDS = ("joint_state_desired", "joint_torque_feedforward")


def ConnectSenses(
    builder: DiagramBuilder,
    controller: Diagram,
    senses: Mapping[str, OutputPort],
    *,
    initial: Mapping[str, FloatArray],
    delay: float,
    time_step: float,
) -> None:
    """Connects each of the controller's inputs to the sense of its name, all of them late.

    Args:
        builder: That holds the controller and the senses.
        controller: Of which every input is connected.
        senses: By name; those that the controller has no port for are left alone.
        initial: What comes before anything has come through, for senses whose is not 0.
        delay: A whole number of the plant's steps [s].
        time_step: The plant's [s].
    """
    names = [controller.get_input_port(k).get_name() for k in range(controller.num_input_ports())]
    zero = {name: np.zeros(senses[name].size()) for name in names}
    late = _late(
        builder,
        "sensor_delay",
        {name: senses[name] for name in names},
        initial=zero | {name: initial[name] for name in names if name in initial},
        delay=delay,
        time_step=time_step,
    )
    for name in names:
        builder.Connect(late[name], controller.GetInputPort(name))


def ConnectDrives(
    builder: DiagramBuilder,
    controller: Diagram,
    *,
    desired: InputPort,
    feedforward: InputPort,
    angles: FloatArray,
    strength: FloatArray,
    delay: float,
    time_step: float,
) -> None:
    """Connects the controller's commands to the plant's drives.

    Args:
        builder: That holds both.
        controller: With the ports joint_state_desired and joint_torque_feedforward.
        desired: Of the plant.
        feedforward: Of the plant.
        angles: (12,) that the drives hold until a command has come [rad], by actuator.
        strength: (12,) the part of each feed-forward torque that is delivered.
        delay: A whole number of the plant's steps [s].
        time_step: The plant's [s].
    """
    n = len(angles)
    late = _late(
        builder,
        "command_delay",
        {name: controller.GetOutputPort(name) for name in COMMANDS},
        initial={COMMANDS[0]: np.concatenate([angles, np.zeros(n)]), COMMANDS[1]: np.zeros(n)},
        delay=delay,
        time_step=time_step,
    )
    torque = late[COMMANDS[1]]
    if np.any(strength != 1.0):
        weak = builder.AddNamedSystem("motor_strength", Gain(strength))
        builder.Connect(torque, weak.get_input_port())
        torque = weak.get_output_port()
    builder.Connect(late[COMMANDS[0]], desired)
    builder.Connect(torque, feedforward)


def _late(
    builder: DiagramBuilder,
    name: str,
    signals: Mapping[str, OutputPort],
    *,
    initial: Mapping[str, FloatArray],
    delay: float,
    time_step: float,
) -> dict[str, OutputPort]:
    """The signals by name, behind a Delay called `name` if there is any delay."""
    if delay == 0.0:
        return dict(signals)
    system = builder.AddNamedSystem(
        name, Delay(initial=initial, period=time_step, steps=round(delay / time_step))
    )
    for key, port in signals.items():
        builder.Connect(port, system.GetInputPort(key))
    return {key: system.GetOutputPort(f"{key}_delayed") for key in signals}
