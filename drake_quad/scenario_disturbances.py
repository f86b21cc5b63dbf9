"""From a scenario's disturbances and world to the frozen values that plant and course take."""

import difflib
import math
from typing import Any

import numpy as np

from drake_quad.errors import InputError
from drake_quad.estimation.imu_model import IDEAL_IMU, MTI_300
from drake_quad.estimation.joint_model import IDEAL_JOINTS, ODRI_DRIVE
from drake_quad.estimation.sensor_errors import SensorErrors
from drake_quad.robot.load_robot import MakeModelPlant
from drake_quad.robot.robot_model import RobotModel
from drake_quad.scenario_config import Scenario
from drake_quad.scenario_config_world import PushConfig
from drake_quad.systems.disturbances import Disturbances, Push, Vector
from drake_quad.terrain import Course
from drake_quad.world import WorldErrors, build_world

# Who draws from the seed. Each has a generator of its own, so that what one draws does not
# depend on another; a new one goes to the end, and the runs of old seeds stay as they are.
STREAMS = ("world", "imu", "joint_sensor")


def generator_of(scenario: Scenario, stream: str) -> np.random.Generator:
    """The random numbers of one of STREAMS, by the scenario's seed."""
    seed = np.random.SeedSequence(scenario.simulation.seed, spawn_key=(STREAMS.index(stream),))
    return np.random.default_rng(seed)


def sensor_errors(scenario: Scenario) -> SensorErrors | None:
    """What the sensors are like; None if the controller is told its state."""
    if scenario.estimator.kind == "truth":
        return None
    real = scenario.sensors.noise == "realistic"
    return SensorErrors(
        imu=MTI_300 if real else IDEAL_IMU,
        joints=ODRI_DRIVE if real else IDEAL_JOINTS,
        imu_generator=generator_of(scenario, "imu"),
        joint_generator=generator_of(scenario, "joint_sensor"),
    )


def world_of(scenario: Scenario, course: Course, *, source: str = "scenario") -> Course:
    """The course as it really is; `course` itself where the map has no errors.

    Args:
        scenario: Checked; its world and its seed are read.
        course: The map.
        source: What an error names as the holder of the field, the file.

    Raises:
        InputError: If no such course can be built.
    """
    world = scenario.world
    errors = WorldErrors(
        rise=world.rise_error,
        run=world.run_error,
        position=world.position_error,
        yaw=math.radians(world.yaw_error_deg),
        tread=world.tread_error,
        random=world.random,
    )
    return build_world(course, errors, generator=generator_of(scenario, "world"), source=source)


def disturbances_of(
    scenario: Scenario, robot: RobotModel, *, source: str = "scenario"
) -> Disturbances:
    """The disturbances of a checked scenario, for `robot`.

    Raises:
        InputError: If the robot has no such joint or body.
    """
    given = scenario.disturbances
    for i, motor in enumerate(given.motor_strength):
        field = f"disturbances.motor_strength[{i}].joint"
        _check_name(motor.joint, robot.joint_names, "joint", field, source)
    if any(push.body for push in given.pushes):
        plant = MakeModelPlant(robot.url)
        bodies = [
            plant.get_body(b).name()
            for b in plant.GetBodyIndices(plant.GetModelInstanceByName(robot.name))
        ]
        for i, push in enumerate(given.pushes):
            if push.body:
                _check_name(push.body, bodies, "body", f"disturbances.pushes[{i}].body", source)
    time_step = scenario.simulation.plant.time_step
    payload, offset = given.payload, given.com_offset
    return Disturbances(
        pushes=tuple(_push(push, robot, time_step) for push in given.pushes),
        payload_mass=payload.mass,
        p_BPayload=(payload.x, payload.y, payload.z),
        com_offset=(offset.x, offset.y, offset.z),
        mass_factor=given.mass_factor,
        motor_strength={m.joint: float(m.factor or 0.0) for m in given.motor_strength},
        sensor_delay=given.sensor_delay,
        command_delay=given.command_delay,
    )


def _push(given: PushConfig, robot: RobotModel, time_step: float) -> Push:
    """A checked push, its duration as the plant's steps have it."""
    duration = given.duration
    if time_step > 0.0:
        duration = max(1, round(duration / time_step)) * time_step
    if given.force is not None:
        force: Vector = (given.force[0], given.force[1], given.force[2])
        speed = math.hypot(*force) * duration / robot.mass
    else:
        speed = given.speed or 0.0
        size, way = robot.mass * speed / duration, math.radians(given.direction_deg or 0.0)
        force = (size * math.cos(way), size * math.sin(way), 0.0)
    x, y, z = given.point or (0.0, 0.0, 0.0)
    return Push(
        time=given.time or 0.0,
        duration=duration,
        force_H=force,
        body=given.body or robot.trunk,
        p_BP=(x, y, z),
        speed=speed,
    )


def _check_name(name: str, known: Any, what: str, field: str, source: str) -> None:
    """The robot must have it."""
    if name in known:
        return
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
    remedy = f"the robot has no such {what}; {hint}"
    raise InputError(source=source, field=field, value=name, remedy=remedy)
