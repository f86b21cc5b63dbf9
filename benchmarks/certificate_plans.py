"""Plans to certify: random ones, the paper's two transitions, and plans read from certificates."""

from dataclasses import replace
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import DrakeQuadError
from drake_quad.gait.swing import Swing, plan_swing
from drake_quad.gait.transition import Transition
from drake_quad.math.curves import BodySpline, knot_count
from drake_quad.planning.contact_plan import ContactPlan, FootRoll, Step, sample_times
from drake_quad.planning.mission import initial_stance, plan_mission
from drake_quad.planning.motion_plan import MotionPlan, Segment, roll_along
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import LegGeometry, RobotModel, ShankProfile
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import Element

START = 1.2  # [m]


def random_plan(
    robot: RobotModel, rng: np.random.Generator
) -> tuple[RobotModel, Course, tuple[MotionPlan, ...]] | None:
    """A plan of random gait, course and masses, one in three spoiled; None if there is none.

    Nothing is checked of it but what planning itself must have: most are good, some are not.
    """
    duty, stride = rng.uniform(0.78, 0.92), rng.uniform(0.5, 1.0)
    settings = PlanSettings(
        duty_factor=duty,
        cycle_time=rng.uniform(3.0, 7.0),
        stride=stride,
        swing_clearance=rng.uniform(0.01, 0.06),
        body_height=rng.uniform(0.78, 0.9),
        pitch_along_slope=float(rng.choice([0.0, 0.5])),
        swing_time=rng.uniform(0.5, 1.0),
        shift_time=rng.uniform(0.5, 1.0),
        margin_desired=rng.uniform(0.02, 0.12),
        spin_cycle_time=rng.uniform(3.0, 6.0),
    )
    kind = str(rng.choice(["stairs", "stairs", "stairs", "irregular", "floor", "slope", "turn"]))
    going = str(rng.choice(["up", "down"]))
    run, rise = stride / 2.0, float(rng.uniform(0.03, 0.2))
    middle = {
        "stairs": [Element("stairs", going=going, rise=rise, run=run, count=2)],
        "irregular": [
            Element(
                "stairs",
                going=going,
                rises=list(rng.uniform(0.5 * rise, rise, 2)),
                runs=list(run * rng.uniform(0.9, 1.1, 2)),
            )
        ],
        "floor": [],
        "slope": [Element("slope", length=1.0, height=float(rng.uniform(0.05, 0.15)), going=going)],
        "turn": [],
    }[kind]
    try:
        course = build_course(
            [Element("floor", length=2.2), *middle, Element("floor", length=2.2)],
            foot_radius=robot.foot_radius,
        )
        tasks = [Task(kind="walk", name="walk", lane=0, goal=course.lanes[0].length - 1.2)]
        if kind == "turn":
            angle = float(np.radians(rng.uniform(-90.0, 90.0)))
            tasks = [Task(kind="spin", name="spin", lane=0, angle=angle)]
        robot = replace(robot, link_mass=robot.link_mass * rng.uniform(0.0, 2.0, (1, 3)))
        robot = replace(robot, mass=float(robot.trunk_mass + robot.link_mass.sum()))
        stance = initial_stance(robot, course, settings, start=START)
        plans = plan_mission(robot, course, settings, tasks, stance).plans
    except (DrakeQuadError, ValueError, TypeError):
        return None
    if rng.random() < 1.0 / 3.0:
        plans = tuple(_spoiled(robot, plan, rng) for plan in plans)
    return robot, course, plans


def _spoiled(robot: RobotModel, plan: MotionPlan, rng: np.random.Generator) -> MotionPlan:
    """The plan with a bump in the body's path, and one apex lower."""
    control = np.array(plan.body.control)
    at, wide = rng.uniform(5, len(control) - 5), rng.uniform(1.0, 6.0)
    bump = np.exp(-(((np.arange(len(control)) - at) / wide) ** 2))
    bump[:3], bump[-3:] = 0.0, 0.0  # it begins where it stands, and ends at rest
    size = rng.uniform(-1.0, 1.0, 5) * np.array([0.05, 0.05, 0.05, 0.05, 0.05]) * rng.random()
    steps = list(plan.contacts.steps)
    if steps:
        k = int(rng.integers(len(steps)))
        lower = rng.uniform(0.0, 0.02)
        swing = replace(steps[k].swing, apex_z=steps[k].swing.apex_z - lower)
        steps[k] = replace(steps[k], swing=swing)
    body = BodySpline(plan.body.knot, control + bump[:, None] * size)
    contacts = ContactPlan(plan.contacts.feet, tuple(steps), plan.duration)
    return replace(plan, contacts=_rolling(robot, contacts, body), body=body)


def _rolling(robot: RobotModel, contacts: ContactPlan, body: BodySpline) -> ContactPlan:
    """The contacts with feet that roll as they do under that body, from rest."""
    begin = np.zeros((4, 2))
    return roll_along(robot, contacts, body, sample_times(contacts), begin)


def transition_plan(
    robot: RobotModel, transition: Transition, *, height: float, swing: float, shift: float
) -> MotionPlan:
    """A transition on level ground in W: the body moves on four feet, and is still else.

    Args:
        robot: Robot whose feet's radius counts.
        transition: Transition in the body frame, which begins at W's origin.
        height: Height of the body [m].
        swing: How long a leg is in the air [s].
        shift: How long the body moves before it is [s].
    """
    feet = np.column_stack([transition.start, np.full(4, robot.foot_radius)])
    knot = 0.05
    t, steps, at, moves = 0.0, [], np.zeros(2), [(0.0, np.zeros(2))]
    for step in transition.steps:
        moves += [(t + 3 * knot, at), (t + shift - 3 * knot, step.shift)]
        at, t = step.shift, t + shift
        start, end = feet[step.leg.row].copy(), np.array([*step.p_to, robot.foot_radius])
        flat = (np.array([0.0, 2.0]), np.zeros(2))
        path = plan_swing(start, end, duration=swing, profile=flat, clearance=0.06,
                          foot_radius=robot.foot_radius)  # fmt: skip
        steps.append(Step(step.leg, t, t + swing, path))
        feet[step.leg.row] = end
        t += swing
    moves += [(t + 3 * knot, at), (t + shift - 3 * knot, np.zeros(2))]
    t += shift
    moves.append((t, np.zeros(2)))
    knots = (np.arange(knot_count(t, knot)) - 1) * knot
    control = np.zeros((len(knots), 5))
    for axis in (0, 1):
        control[:, axis] = np.interp(knots, [m[0] for m in moves], [m[1][axis] for m in moves])
    control[:, 2] = height
    start_feet = np.column_stack([transition.start, np.full(4, robot.foot_radius)])
    body = BodySpline(knot, control)
    contacts = _rolling(robot, ContactPlan(start_feet, tuple(steps), t), body)
    segment = Segment("transition", "transition", 0.0, t)
    return MotionPlan(0, contacts, body, (segment,), float("nan"))


def massless_legs(robot: RobotModel) -> RobotModel:
    """The robot as the paper has it: all mass in the body's centre."""
    return replace(
        robot,
        trunk_mass=robot.mass,
        trunk_com=np.zeros(3),
        link_mass=np.zeros_like(robot.link_mass),
    )


def read_record(record: dict[str, Any]) -> tuple[RobotModel, ShankProfile, list[MotionPlan]]:
    """Robot, shanks and plans as a certificate holds them."""
    r = record["robot"]

    def array(name: str) -> FloatArray:
        return np.array(r[name], dtype=float)

    geometry = LegGeometry(
        array("hips"),
        array("offsets"),
        array("thighs"),
        array("shanks"),
        array("knee_signs"),
        array("raised"),
    )
    robot = RobotModel(
        name=r["name"], url="", trunk=r["trunk"], geometry=geometry,
        joint_names=tuple(r["joints"]), q_lower=array("q_lower"), q_upper=array("q_upper"),
        effort=array("efforts"), speed=np.ones(12),
        mass=float(r["trunk_mass"] + array("link_masses").sum()), trunk_mass=r["trunk_mass"],
        trunk_com=array("trunk_com"), link_mass=array("link_masses"), link_com=array("link_coms"),
        foot_radius=r["foot_radius"], foot_geometry=(),
    )  # fmt: skip
    shank = ShankProfile(array("shank_places"), array("shank_ahead"), array("shank_radii"))
    plans = []
    for k, task in enumerate(record["tasks"]):
        steps = tuple(
            Step(
                LEGS[s["leg"] - 1], s["lift_off"], s["touchdown"],
                Swing(np.array(s["from"]), np.array(s["to"]), s["lasts"], s["apex_time"],
                      s["apex_z"]),
            )
            for s in task["steps"]
        )  # fmt: skip
        segments = tuple(
            Segment(s["name"], s["kind"], s["start"], s["end"]) for s in task["segments"]
        )
        roll = FootRoll(np.array(task["roll"]["times"]), np.array(task["roll"]["offset"]))
        contacts = ContactPlan(np.array(task["feet"]), steps, task["duration"], roll)
        body = BodySpline(task["knot"], np.array(task["control"]))
        plans.append(MotionPlan(k, contacts, body, segments, float("nan")))
    return robot, shank, plans
