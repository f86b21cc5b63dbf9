"""What the tests of robot, planning and systems share: the robot, courses, plans, and a posture."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, LeafSystem, PortDataType

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.mission import initial_stance
from drake_quad.planning.motion_plan import MotionPlan, Stance, pose_robot
from drake_quad.planning.plan_job import PlanJob
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.task import plan_task
from drake_quad.robot.loader import MakeModelPlant, load_robot
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

URL = "package://drake_quad_models/paper_quadruped.urdf"


@cache
def paper_robot() -> RobotModel:
    """The shipped robot."""
    return load_robot(URL)


def with_raised(robot: RobotModel, raised: FloatArray) -> RobotModel:
    """A robot whose hip pitch axes pass so far above its abduction axes (4,) [m]."""
    return replace(robot, geometry=replace(robot.geometry, raised=raised))


@cache
def model_plant() -> MultibodyPlant:
    """The shipped robot as a plant without ground."""
    return MakeModelPlant(URL)


@cache
def model_layout() -> StateLayout:
    """Where the robot's coordinates are in `model_plant`."""
    return make_layout(model_plant(), paper_robot())


def course_of(*elements: Element) -> Course:
    """A course of these elements, for the shipped robot's feet."""
    return build_course(elements, foot_radius=paper_robot().foot_radius)


@cache
def flat_course(length: float = 6.0) -> Course:
    """Level ground."""
    return course_of(Element("floor", length=length))


@cache
def stairs_course(going: str = "up", *, rise: float = 0.13, run: float = 0.5) -> Course:
    """Floor, a flight of three steps, floor."""
    return course_of(
        Element("floor", length=3.0),
        Element("stairs", going=going, rise=rise, run=run, count=3),
        Element("floor", length=3.0),
    )


def stance_at(course: Course, settings: PlanSettings, start: float = 1.25) -> Stance:
    """The stance that a run begins in."""
    return initial_stance(paper_robot(), course, settings, start=start)


def walk_plan(
    course: Course,
    *,
    goal: float,
    start: float = 1.25,
    settings: PlanSettings | None = None,
    index: int = 0,
    robot: RobotModel | None = None,
) -> MotionPlan:
    """A walk along the first lane of `course`."""
    settings, robot = settings or PlanSettings(), robot or paper_robot()
    task = Task(kind="walk", name="walk", lane=0, goal=goal)
    stance = initial_stance(robot, course, settings, start=start)
    return plan_task(robot, course, settings, task, stance, index=index)


@cache
def flat_walk() -> MotionPlan:
    """Two metres of level ground: a transition and two cycles of the wave."""
    return walk_plan(flat_course(), goal=3.25)


@cache
def stairs_walk(going: str = "up") -> MotionPlan:
    """Over the three steps of `stairs_course`."""
    return walk_plan(stairs_course(going), goal=6.25)


def spin_plan(angle: float, *, settings: PlanSettings | None = None, index: int = 0) -> MotionPlan:
    """A spin by `angle` [rad] in the middle of level ground."""
    settings = settings or PlanSettings()
    course = flat_course()
    task = Task(kind="spin", name="spin", lane=0, angle=angle)
    stance = stance_at(course, settings, 3.0)
    return plan_task(paper_robot(), course, settings, task, stance, index=index)


def stand_plan(duration: float = 1.0, *, index: int = 0) -> MotionPlan:
    """A stand where a run begins."""
    course, settings = flat_course(), PlanSettings()
    task = Task(kind="stand", name="stand", lane=0, duration=duration)
    return plan_task(
        paper_robot(), course, settings, task, stance_at(course, settings), index=index
    )


def state_of(
    body: Sequence[float] | FloatArray,
    feet: FloatArray,
    *,
    layout: StateLayout | None = None,
    velocity: FloatArray | None = None,
) -> FloatArray:
    """[q; v] with the body at x, y, z, pitch, yaw and the feet (4, 3) in W, at rest or not."""
    layout = layout or model_layout()
    body = np.asarray(body, dtype=float)
    q, excess, _ = pose_robot(paper_robot(), body[None], np.asarray(feet)[None])
    assert excess.max() == 0.0
    return state_from_joints(body, q[0], layout=layout, velocity=velocity)


def state_from_joints(
    body: FloatArray,
    q: FloatArray,
    *,
    layout: StateLayout | None = None,
    velocity: FloatArray | None = None,
) -> FloatArray:
    """[q; v] with the body at x, y, z, pitch, yaw and joint angles (4, 3)."""
    layout = layout or model_layout()
    half_pitch, half_yaw = 0.5 * body[3], 0.5 * body[4]
    cp, sp, cy, sy = np.cos(half_pitch), np.sin(half_pitch), np.cos(half_yaw), np.sin(half_yaw)
    state = np.zeros(layout.size)
    state[layout.q_base : layout.q_base + 4] = [cy * cp, -sy * sp, cy * sp, sy * cp]
    state[layout.q_base + 4 : layout.q_base + 7] = body[:3]
    state[layout.q_joints] = np.ravel(q)
    if velocity is not None:
        state[layout.num_positions :] = velocity
    return state


def feet_of(state: FloatArray) -> FloatArray:
    """The feet (4, 3) in W that a state of `model_plant` has, by Drake's kinematics."""
    plant, robot = model_plant(), paper_robot()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    feet = []
    for name, shank in zip(robot.joint_names[2::3], robot.geometry.shank, strict=True):
        body = plant.GetJointByName(name).child_body()
        feet.append(body.EvalPoseInWorld(context) @ np.array([0.0, 0.0, -shank]))
    return np.array(feet)


def fix_inputs(system: LeafSystem, context: Context, **values: object) -> None:
    """Fixes input ports by name: abstract ones to any object, vector ones to numbers."""
    for name, value in values.items():
        port = system.GetInputPort(name)
        if port.get_data_type() == PortDataType.kAbstractValued:
            value = AbstractValue.Make(value)
        port.FixValue(context, value)


def contacts_of(bearing: FloatArray, places: FloatArray, forces: FloatArray) -> FloatArray:
    """What a ContactMonitor shows on `contacts`, with no slip and nothing but feet touching.

    Args:
        bearing: 1 where a foot bears (4,).
        places: Where the feet's forces act in W (4, 3) [m].
        forces: The forces in W (4, 3) [N].
    """
    return np.concatenate([bearing, forces.ravel(), places.ravel(), np.zeros(6)])


def read(system: LeafSystem, context: Context, name: str) -> FloatArray:
    """The vector that an output port has now."""
    return np.array(system.GetOutputPort(name).Eval(context))


__all__ = [
    "GRAVITY",
    "URL",
    "contacts_of",
    "course_of",
    "feet_of",
    "fix_inputs",
    "flat_course",
    "flat_walk",
    "model_layout",
    "model_plant",
    "paper_robot",
    "read",
    "rotations",
    "spin_plan",
    "stairs_course",
    "stairs_walk",
    "stance_at",
    "stand_plan",
    "state_from_joints",
    "state_of",
    "walk_plan",
]


class LatePlans:
    """Makes plans that are there when they are asked for the third time, of the first's job.

    Attributes:
        asked: How often plans were asked for.
    """

    def __init__(self) -> None:
        self.asked = 0
        self._job: PlanJob | None = None

    def ask(self, job: PlanJob) -> MotionPlan | None:
        """The plan of the first job of this key, or None."""
        self.asked += 1
        if self._job is None or self._job.key != job.key:
            self._job = job
        if self.asked % 3:
            return None
        first, self._job = self._job, None
        return first.make()
