"""Footsteps of a spin: a transition to the spinning gait, and its cycles (section II-B)."""

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import spin_schedule
from drake_quad.gait.workspace import spin_cycles, spin_desired_configuration, spin_phi_max
from drake_quad.planning.body_reference import (
    BodyReference,
    robot_stance,
)
from drake_quad.planning.contact_plan import ContactPlan
from drake_quad.planning.motion_plan import Segment, Stance
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.planning.transition_footsteps import plan_transition_footsteps
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course


def plan_spin_footsteps(
    robot: RobotModel, course: Course, settings: PlanSettings, task: Task, stance: Stance
) -> tuple[ContactPlan, BodyReference, tuple[Segment, ...]]:
    """Returns the steps, the body's nominal route and the segments of a spin."""
    lane = course.lanes[task.lane]
    builder = StepBuilder.of_settings(lane, stance.feet, robot.foot_radius, settings)
    pivot, yaw = np.array(stance.body[:2]), float(stance.body[4])
    sense = 1 if task.angle > 0 else -1
    beta = settings.spin_duty_factor
    boxes = settings.spin_workspace or settings.workspace
    cycles, phi = spin_cycles(abs(task.angle), beta, spin_phi_max(boxes))
    table = spin_schedule(duty_factor=beta, cycle_time=settings.spin_cycle_time, sense=sense)
    segments = []

    def to_world(p_B: FloatArray, angle: float) -> FloatArray:
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray(pivot + p_B @ np.array([[c, s], [-s, c]]))

    if settings.via_centres:
        centres = to_world(robot_stance(settings), yaw)
        segments.append(plan_transition_footsteps(builder, centres, settings, body=stance.body,
                                       name="transition to the centres"))  # fmt: skip
    desired = spin_desired_configuration(boxes, phi=phi, duty_factor=beta, sense=sense)
    segments.append(
        plan_transition_footsteps(
            builder,
            to_world(desired, yaw),
            settings,
            body=stance.body,
            name="transition to the spinning gait",
            gait="spin",
        )
    )
    moved = builder.time
    builder.wait(settings.shift_time)
    begin = builder.time
    turn = sense * phi / beta  # of the body, and of every footprint, in one cycle
    for cycle in range(cycles):
        for leg, lift_off, _ in table.swing_intervals():
            to = to_world(desired[leg.row], yaw + (cycle + 1) * turn)
            at = begin + cycle * table.cycle_time + lift_off
            round_it = pivot if settings.spin_arcs else None
            builder.step(leg, to, table.swing_time, lift_off=at, pivot=round_it)
    builder.time = begin + cycles * table.cycle_time
    details = {
        "phi_deg": float(np.degrees(phi)),
        "cycles": cycles,
        "duty_factor": beta,
        "cycle_time": table.cycle_time,
        "angle_deg": float(np.degrees(task.angle)),
    }
    segments.append(Segment(task.name, "spin", moved, builder.time, details))
    end = builder.time
    builder.wait(settings.shift_time)
    segments.append(Segment("settle", "stand", end, builder.time))

    ground = float(np.mean(builder.feet[:, 2])) - robot.foot_radius

    def level(p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.full(len(p_W), ground), np.zeros(len(p_W))

    times = np.array([0.0, begin, end, builder.time])
    yaws = yaw + np.array([0.0, 0.0, task.angle, task.angle])
    start = stance.body[:4]
    route = BodyReference(times, np.tile(pivot, (4, 1)), yaws, level, start=start, joined=begin)
    return builder.finish(), route, tuple(s for s in segments if s is not None)
