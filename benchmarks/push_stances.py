"""Random stances with their push budgets, and whether a push topples the robot in one.

A push is survived if at the end, LASTS after the start, the robot stands on three feet at least,
within FARTHEST of its place and upright to 10°. It is toppled if it has fallen, or is not there or
not upright; that may be less than not to survive, for at the end light feet may patter.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.planning.problem import Task
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import plan_settings
from drake_quad.scenario.config import Scenario
from drake_quad.simulation.diagram import MakeStairClimb
from drake_quad.stability.capture_point import (
    SWING_BACK,
    Pendulum,
    find_pressure_area,
    pressure_reach,
    push_budget,
)
from drake_quad.stability.equilibrium_region import find_region, joint_limits, make_contacts
from drake_quad.stability.leg_stroke import leg_stroke_left
from drake_quad.systems.disturbances import Disturbances, Push
from drake_quad.terrain.course import Course

SCENARIO = """
course:
  - {kind: floor, length: 4.0}
  - {kind: stairs, going: up, rise: 0.13, run: 0.50, count: 6}
  - {kind: floor, length: 4.0}
controller: {catch_pushes: false}
monitor: {margins: hull}
"""
STAIRS = 5.5  # [m] where the body is among the stairs
PUSHED_AT, PUSH, LASTS = 0.4, 0.05, 3.0  # [s] when, how long, and when it is over
FARTHEST, UPRIGHT = 0.15, 0.985  # [m] of the base, and its z axis's z, of a push survived
LEAST = 0.05  # [m/s] a budget too small to ask about


@dataclass(frozen=True)
class End:
    """How a push ended.

    Attributes:
        stood: Whether three feet or more bore when the push began: else there was no stance.
        toppled: Whether the robot fell, or is off its place or tilted.
        feet: How many feet bear at the last instant.
        slid: How far a foot is from where it stood at first [m]; nan if it fell.
    """

    stood: bool
    toppled: bool
    feet: int
    slid: float

    @property
    def survived(self) -> bool:
        """What counts, see above."""
        return not self.toppled and self.feet >= 3


@dataclass(frozen=True)
class Trial:
    """A stance and the way in which it is pushed.

    Attributes:
        stance: Stance in which it stands.
        way: (2,) unit vector in W.
        p_BScm: Its centre of mass in B [m].
        budget: What the law says [m/s].
        pendulums: What the law says of a pendulum without legs that swing back [m/s].
        on_stairs: Where.
    """

    stance: Stance
    way: FloatArray
    p_BScm: FloatArray
    budget: float
    pendulums: float
    on_stairs: bool


def draw(random: np.random.Generator, robot: RobotModel, course: Course, mu: float) -> Trial:
    """A random stance that the legs can take, and its budget."""
    while True:
        on_stairs = bool(random.random() < 0.5)
        x = STAIRS if on_stairs else 2.0
        feet = np.empty((4, 3))
        feet[:, 0] = x + 0.375 * np.array([1, 1, -1, -1]) + random.uniform(-0.15, 0.15, 4)
        feet[:, 1] = 0.3 * np.array([1, -1, 1, -1]) + random.uniform(-0.08, 0.08, 4)
        if on_stairs:  # on a tread's middle, whole
            feet[:, 0] = 4.0 + 0.5 * (np.floor((feet[:, 0] - 4.0) / 0.5) + 0.5)
        ground = course.height(feet[:, 0], feet[:, 1])
        feet[:, 2] = ground + robot.foot_radius
        shift = random.uniform([-0.2, -0.12], [0.2, 0.12])
        body = np.array([x + shift[0], shift[1], ground.mean() + random.uniform(0.75, 0.88), 0, 0])
        q, excess, com = (part[0] for part in pose_robot(robot, body[None], feet[None]))
        inside = np.all((q.ravel() > robot.q_lower) & (q.ravel() < robot.q_upper))
        if excess.max() > 0.0 or not inside:
            continue
        turn = random.uniform(0.0, 2.0 * np.pi)
        way = np.array([np.cos(turn), np.sin(turn)])
        free, budget = budgets(robot, body, feet, q, com, way, mu)
        if budget > LEAST:
            p_BScm = rotations(body).T @ (com - body[:3])
            return Trial(Stance(body, feet), way, p_BScm, budget, free, on_stairs)


def budgets(
    robot: RobotModel,
    body: FloatArray,
    feet: FloatArray,
    q: FloatArray,
    com: FloatArray,
    way: FloatArray,
    mu: float,
) -> tuple[float, float]:
    """A stance's budget on level treads: the pendulum's alone, and with legs and way back [m/s]."""
    everyone, R = np.ones(4, dtype=bool), rotations(body)
    places = feet - [0.0, 0.0, robot.foot_radius]
    contacts = make_contacts(places, friction=mu)
    limits = joint_limits(robot, R, q, everyone)
    x, y, z = com.tolist()
    pendulum = Pendulum(x, y, z, ground=float(places[:, 2].mean()))
    region = find_region(contacts, limits=limits)
    area = find_pressure_area(contacts, pendulum, limits=limits)
    far = pressure_reach(region, area, pendulum, way[None])
    free = push_budget(region, far, pendulum, way[None])
    # The body goes farther than the centre of mass, whose feet stay: looked after so far.
    legs = leg_stroke_left(robot, R, q, everyone, way[None], 2.0 * free / pendulum.rate)
    held = push_budget(region, far, pendulum, way[None], legs, swing_back=SWING_BACK)
    return float(free[0]), float(held[0])


def push_in(scenario: Scenario, robot: RobotModel, course: Course, trial: Trial, v: float) -> End:
    """How a push worth `v` [m/s] ends."""
    force = robot.mass * v / PUSH * trial.way
    push = Push(
        time=PUSHED_AT,
        duration=PUSH,
        force_H=(float(force[0]), float(force[1]), 0.0),
        body=robot.trunk,
        p_BP=tuple(trial.p_BScm.tolist()),
        speed=v,
    )
    climb = MakeStairClimb(
        robot=robot,
        course=course,
        settings=plan_settings(scenario),
        mission=(Task(kind="stand", name="stand", lane=0, duration=2.0 * LASTS),),
        control=scenario.controller,
        stance=trial.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=0.02,
        disturbances=Disturbances(pushes=(push,)),
    )
    simulator = Simulator(climb.diagram)
    context = simulator.get_context()
    monitor = climb.diagram.GetSubsystemByName("contact_monitor")
    own = monitor.GetMyContextFromRoot(context)
    port = monitor.GetOutputPort("contact_state_measured")
    simulator.AdvanceTo(PUSHED_AT)
    stood = bool(np.sum(port.Eval(own) > 0.5) >= 3)
    status = simulator.AdvanceTo(LASTS)
    if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
        return End(stood, True, 0, float("nan"))
    bearing = port.Eval(own)
    places = monitor.GetOutputPort("foot_contact_position").Eval(own).reshape(4, 3)
    state = climb.plant.get_state_output_port().Eval(climb.plant.GetMyContextFromRoot(context))
    base = climb.layout.read(state)
    slid = np.linalg.norm((places - trial.stance.feet)[:, :2], axis=1).max()
    off = np.linalg.norm(base.p_WB - trial.stance.body[:3])
    toppled = off >= FARTHEST or base.R_WB[2, 2] <= UPRIGHT
    return End(stood, bool(toppled), int(np.sum(bearing > 0.5)), float(slid))
