"""From a scenario to course, settings of planner and controller, disturbances."""

import difflib
import math
from typing import Any

import numpy as np

from drake_quad.errors import InputError
from drake_quad.estimation.contact_from_torques import TouchSettings
from drake_quad.estimation.imu_units import IDEAL_IMU, IMUS
from drake_quad.estimation.sensor_models import (
    IDEAL_JOINTS,
    ODRI_DRIVE,
    SensorErrors,
    TorqueErrors,
    draw_torque_errors,
)
from drake_quad.gait.workspace import Workspace
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.problem import PlanSettings, Task, derive_mission
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.variants import with_foot_radius
from drake_quad.scenario.config import PushConfig, Scenario
from drake_quad.scenario.motion_config import LegSpeedsConfig
from drake_quad.systems.disturbances import Disturbances, Push, Vector
from drake_quad.terrain.as_built import MapErrors, build_as_built
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import TURNING_SPACE

AT_PIVOT = 1e-6  # [m] a walk that ends this near to a lane's end ends there


def course_of(
    scenario: Scenario,
    *,
    source: str = "scenario",
    foot_radius: float = 0.035,
    turning_space: float = TURNING_SPACE,
) -> Course:
    """The scenario's course, laid out.

    Args:
        scenario: Scenario whose `course` is read, and nothing else.
        source: Name of the file, for errors.
        foot_radius: Radius of the robot's feet [m], for the shortest tread that can bear it.
        turning_space: Length and width of the smallest landing that it may turn on [m].

    Raises:
        InputError: A field that no course can have, or a course that runs into itself.
    """
    return build_course(
        scenario.course, source=source, foot_radius=foot_radius, turning_space=turning_space
    )


def plan_settings(scenario: Scenario) -> PlanSettings:
    """The planner's settings of a checked scenario."""
    gait, spin, transition, body = (
        scenario.gait,
        scenario.spin,
        scenario.transition,
        scenario.body,
    )
    return PlanSettings(
        duty_factor=gait.duty_factor,
        cycle_time=gait.cycle_time,
        switch_wait=gait.switch_wait,
        stride=gait.stride,
        pattern=FootholdPattern(
            treads=gait.treads,
            lag=gait.lag,
            per_tread=gait.places_per_tread,
            gait=gait.pattern,
        ),
        deep_tread=gait.deep_tread,
        body_ahead=gait.body_ahead,
        tread_phase_up=gait.tread_phase_up,
        tread_phase_down=gait.tread_phase_down,
        places_together=gait.places_together,
        body_shift_up=gait.body_shift_up,
        body_shift_down=gait.body_shift_down,
        lift_down=gait.lift_down,
        max_ahead=gait.max_ahead,
        shank_room=gait.shank_room,
        workspace=Workspace(
            R_x=gait.workspace_length,
            R_y=gait.workspace_width,
            P_x=gait.stance_length,
            P_y=gait.stance_width,
        ),
        stance_stagger=gait.stance_stagger,
        on_centre=gait.on_centre,
        swing_speed=gait.swing_speed,
        swing_speeds=(_leg_speeds(gait.swing_speed_up), _leg_speeds(gait.swing_speed_down)),
        swing_clearance=gait.swing_clearance,
        map_error_place=gait.map_error_place,
        map_error_height=gait.map_error_height,
        body_height=gait.body_height,
        pitch_along_slope=gait.pitch_share if gait.pitch == "slope" else 0.0,
        spin_workspace=_spin_workspace(scenario),
        spin_arcs=spin.swing_path == "arc",
        spin_duty_factor=spin.duty_factor,
        spin_cycle_time=spin.cycle_time,
        body_still=transition.mode == "still",
        max_shift=transition.max_shift,
        swing_time=transition.swing_time,
        shift_time=transition.shift_time,
        via_centres=transition.via_centres,
        wave_order=tuple(Leg(number) for number in transition.wave_order),
        spin_order=tuple(Leg(number) for number in transition.spin_order),
        uniform_body=body.path == "uniform",
        dynamic=body.balance == "dynamic",
        margin_desired=body.margin_desired,
        zmp_margin=body.zmp_margin,
        guard=body.guard,
        margin=gait.margin,
        friction=scenario.controller.friction,
    )


def _leg_speeds(speeds: LegSpeedsConfig) -> tuple[float, ...]:
    """Speeds of swing feet [m/s], one a leg."""
    return tuple(getattr(speeds, leg.short) for leg in LEGS)


def _spin_workspace(scenario: Scenario) -> Workspace | None:
    """The spinning gait's own boxes, if it has any."""
    gait, spin = scenario.gait, scenario.spin
    if not (spin.workspace_length or spin.workspace_width):
        return None
    return Workspace(
        R_x=spin.workspace_length or gait.workspace_length,
        R_y=spin.workspace_width or gait.workspace_width,
        P_x=gait.stance_length,
        P_y=gait.stance_width,
    )


def mission_of(scenario: Scenario, course: Course, *, source: str = "scenario") -> tuple[Task, ...]:
    """The tasks of a scenario: its own mission, or what the course asks for.

    A spin on a lane's end, by the turn there, leads onto the next lane. A walk needs the robot to
    head along its lane.

    Args:
        scenario: Scenario that is checked but for where its mission leads.
        course: The scenario's course.
        source: Name of the file, for errors.

    Raises:
        InputError: A walk across the lane, or beyond its ends.
    """
    if not scenario.mission:
        return derive_mission(course, plan_settings(scenario))
    tasks: list[Task] = []
    lane, s, heading = 0, scenario.start.distance, 0.0  # [m] along, [rad] from the lane's
    for i, element in enumerate(scenario.mission):
        name = f"{element.kind} {i + 1}"
        if element.kind == "stand":
            duration = element.duration or 0.0
            tasks.append(Task(kind="stand", name=name, lane=lane, duration=duration))
        elif element.kind == "spin":
            angle = math.radians(element.angle_deg or 0.0)
            tasks.append(Task(kind="spin", name=name, lane=lane, angle=angle))
            heading += angle
            at_end = lane < len(course.turns) and abs(s - course.lanes[lane].length) < AT_PIVOT
            if at_end and _same_heading(heading, course.turns[lane]):
                lane, s, heading = lane + 1, 0.0, 0.0
        else:
            distance = element.distance or 0.0
            remedy = ""
            if not _same_heading(heading, 0.0):
                remedy = "the robot does not head along the course here: spin first"
            elif not -AT_PIVOT <= s + distance <= course.lanes[lane].length + AT_PIVOT:
                length = course.lanes[lane].length
                remedy = f"leads off the lane, which is {length:g} m long; it starts at {s:g} m"
            if remedy:
                field = f"mission[{i}].distance"
                raise InputError(source=source, field=field, value=distance, remedy=remedy)
            s += distance
            tasks.append(Task(kind="walk", name=name, lane=lane, goal=s))
    return tuple(tasks)


def _same_heading(a: float, b: float) -> bool:
    """Whether two headings [rad] are the same direction."""
    return abs(math.remainder(a - b, math.tau)) < 1e-6


# Who draws from the seed. Each has a generator of its own, so that what one draws does not
# depend on another; a new one goes to the end, and the runs of old seeds stay as they are.
STREAMS = ("world", "imu", "joint_sensor", "depth_camera", "torque_sensor")


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
        imu=IMUS[scenario.sensors.imu] if real else IDEAL_IMU,
        joints=ODRI_DRIVE if real else IDEAL_JOINTS,
        imu_generator=generator_of(scenario, "imu"),
        joint_generator=generator_of(scenario, "joint_sensor"),
    )


def touch_settings(scenario: Scenario) -> TouchSettings | None:
    """How the joints feel which feet bear; None if the feet have sensors of their own."""
    load = scenario.sensors.touch_load
    felt = scenario.sensors.contacts == "joints"
    return TouchSettings(touch=load, leave=0.25 * load) if felt else None


def torque_errors(scenario: Scenario, robot: RobotModel) -> TorqueErrors | None:
    """What the torque sensors are like; None if the feet have sensors of their own."""
    if scenario.sensors.contacts == "feet":
        return None
    share = scenario.sensors.torque_noise if scenario.sensors.noise == "realistic" else 0.0
    return draw_torque_errors(share * robot.effort, generator_of(scenario, "torque_sensor"))


def world_of(scenario: Scenario, course: Course, *, source: str = "scenario") -> Course:
    """The course as it really is; `course` itself where the map has no errors.

    Args:
        scenario: Checked scenario; its world and its seed are read.
        course: The map.
        source: Name of the file, for errors.

    Raises:
        InputError: If no such course can be built.
    """
    world = scenario.world
    errors = MapErrors(
        rise=world.rise_error,
        run=world.run_error,
        position=world.position_error,
        yaw=math.radians(world.yaw_error_deg),
        tread=world.tread_error,
        tilt=world.tread_tilt,
        random=world.random,
    )
    return build_as_built(course, errors, generator=generator_of(scenario, "world"), source=source)


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


def robot_of(scenario: Scenario) -> RobotModel:
    """The scenario's robot, with points for feet if it asks for that.

    Raises:
        InputError: If there is no such robot, or it is no quadruped with abduction-hip-knee legs.
    """
    robot = load_robot(scenario.robot.model)
    return with_foot_radius(robot, 0.0) if scenario.robot.point_feet else robot
