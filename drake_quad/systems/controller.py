"""The controller: a Diagram of its own that could be put on a robot.

Its ports are what a robot has; it holds a model of the robot and never sees the simulated plant.
"""

import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, System

from drake_quad.control.ports import BALANCE_SIZE
from drake_quad.control.push_recovery import Reflex
from drake_quad.control.settings import ControlSettings, for_legs
from drake_quad.errors import InputError
from drake_quad.estimation.contact_from_torques import TouchSettings
from drake_quad.estimation.imu_units import MTI_300, ImuNoise, settings_for
from drake_quad.planning.known_mission import Growth
from drake_quad.planning.motion_plan import MotionPlan, Stance, pose_robot
from drake_quad.planning.plan_job import PlanMaker
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.recovery_step import StepTargetMap
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.systems.gait_scheduler import GaitScheduler
from drake_quad.systems.joint_contact_estimator import JointContactEstimator
from drake_quad.systems.state_estimator import StateEstimator
from drake_quad.systems.tracking_controller import (
    IkController,
    TrackingController,
    WholeBodyController,
)
from drake_quad.systems.transition_planner import TransitionPlanner
from drake_quad.terrain.course import Course

LEVEL_START = 0.002  # [m]: courses begin with a level floor or landing
FOOT_SINK = 0.0015  # [m]: a rubber foot, or ground, that gives by a millimetre or two
MAP_HEIGHT = 0.005  # [m]: treads of one flight differ by so much (IBC: 9.5 mm at most)
# What the filter takes a camera's errors to be, and those of the way between two flights.
LANDMARKS = {
    "step_drift": 0.0006, "camera_range": 0.01, "camera_yaw": math.radians(0.25),
    "camera_side": 0.006,
}  # fmt: skip
ESTIMATES = (
    "robot_state_estimated",
    "estimator_deviation",
    "foot_slip_estimated",
    "estimator_healthy",
)
KINDS: dict[str, type[TrackingController]] = {"ik": IkController, "whole_body": WholeBodyController}
MakeTracking = Callable[..., LeafSystem]
"""Makes a controller of one's own of the keywords `robot`, `layout`, `model`, `control` and
`course`, those of TrackingController's constructor, whose ports it has: all inputs and outputs by
these names."""

INPUTS = ("motion_plan", "gait_phase", "catch", "robot_state_estimated", "contact_state_measured")
OUTPUTS = {
    "joint_state_desired": 24,
    "joint_torque_feedforward": 12,
    "body_desired": 5,
    "feet_desired": 12,
    "balance_estimated": BALANCE_SIZE,
}
# Exported of one that has them.
OWN = ("qp_state", "carried_estimated", "friction_estimated", "tracking")


def MakeController(
    *,
    robot: RobotModel,
    course: Course,
    settings: PlanSettings,
    mission: Sequence[Task],
    control: ControlSettings,
    model: MultibodyPlant,
    start: Stance | None = None,
    tracking: str | MakeTracking | None = None,
    planned: Sequence[MotionPlan] = (),
    maker: PlanMaker | None = None,
    feel: TouchSettings | None = None,
    feel_normals: bool = False,
    foot_give: float = 0.0,
    growth: Growth | None = None,
    landmarks: bool = False,
    imu: ImuNoise = MTI_300,
) -> Diagram:
    """Returns the controller as a Diagram of its own.

    Args:
        robot: The robot.
        course: The map that it plans on.
        settings: Settings of the plans.
        mission: The tasks.
        control: Settings of the controllers.
        model: The robot without ground.
        start: Where the robot is put: then the controller estimates its state from there on,
            from its sensors. None: its state is an input.
        tracking: The controller that turns the plan into joint commands: one of KINDS by its name,
            or a function that makes one; `control.kind` if None.
        planned: The mission's plans, made beforehand, as TransitionPlanner takes them.
        maker: Who makes plans while the robot stands, as TransitionPlanner takes it.
        feel: How it feels by the joints' torques which feet bear; it is told that if None.
        feel_normals: Whether sensors in the feet tell it how the ground is tilted; else the map.
        foot_give: How much foot and ground give under load, as its estimator knows it [m].
        growth: How to plan on where the map grows; None: it does not.
        landmarks: Whether what a LandmarkFinder sees corrects the estimated state.
        imu: The IMU that its estimator is told that it has.

    Raises:
        InputError: No such name, or a system without the ports of a TrackingController.

    Input ports:
        contact_state_measured: (4,) 1 where a foot bears, unless it feels that.
        joint_torque_measured: (12,) of the TorqueSensor, if it feels which feet bear.
        ground_normal_measured: (12,) of the GroundNormalSensor, if `feel_normals`.
        imu_measured: (6,) of the Imu, if there is a `start`.
        joint_state_measured: (24,) of the JointSensor, if there is a `start`.
        robot_state_estimated: [q; v] in the order of `model`, if there is no `start`.
        map_known: MapRevision of a MapKeeper (abstract), if the map grows.
        landmark_sighted: LandmarkSighting of a LandmarkFinder (abstract), if there are landmarks.
    Output ports:
        joint_state_desired, joint_torque_feedforward: Commands, in `model`'s actuator order.
        gait_phase, contact_state_desired, catch, body_desired, feet_desired: For logs.
        motion_plan: The plan of the task under way (abstract).
        robot_state_estimated, estimator_deviation, foot_slip_estimated, estimator_healthy: Outputs
            of the StateEstimator, if there is a `start`.
        landmark_state: Output of the StateEstimator, if there are landmarks.
        qp_state, carried_estimated, friction_estimated: Outputs of the WholeBodyController, or of
            another that has them.
        tracking: Output of a TrackingController, for logs.
        contact_state_felt: Output of the JointContactEstimator, if there is one.
    """
    control = for_legs(control, leg_length(robot), robot.foot_radius)
    layout = make_layout(model, robot)
    builder = DiagramBuilder()
    ground = StepTargetMap(course, robot.foot_radius)
    reflex = Reflex(robot=robot, ground=ground, push_speed=control.push_speed)
    scheduler = builder.AddNamedSystem(
        "gait_scheduler",
        GaitScheduler(
            num_tasks=len(mission),
            control=control,
            reflex=reflex if control.catch_pushes else None,
            may_pause=control.catch_pushes and not settings.dynamic,
        ),
    )
    planner = builder.AddNamedSystem(
        "transition_planner",
        TransitionPlanner(
            robot=robot,
            layout=layout,
            course=course,
            settings=settings,
            mission=mission,
            planned=planned,
            maker=maker,
            growth=growth,
        ),
    )
    parts = {
        "robot": robot, "layout": layout, "model": model, "control": control, "course": course
    }  # fmt: skip
    make = _make_tracking(tracking or control.kind)
    _check_keywords(make, tuple(parts))
    follower = make(**parts)
    _check_ports(follower)
    builder.AddNamedSystem("tracking_controller", follower)
    _Wire(builder, scheduler, planner, follower)
    if feel_normals:
        _ExportNormals(builder, follower)
    contact_users: list[LeafSystem] = [scheduler, follower]
    state_users: list[LeafSystem] = [planner, follower]
    if feel is not None:
        touch = JointContactEstimator(
            robot=robot,
            layout=layout,
            model=model,
            control=control,
            settings=feel,
        )
        state_users.append(builder.AddSystem(touch))
    if start is None:
        _ExportInput(builder, "robot_state_estimated", state_users)
    else:
        estimator = builder.AddNamedSystem(
            "state_estimator",
            _MakeEstimator(
                robot, layout, start, control, course, foot_give, growth is not None, landmarks, imu
            ),
        )
        for system in state_users:
            builder.Connect(
                estimator.GetOutputPort("robot_state_estimated"),
                system.GetInputPort("robot_state_estimated"),
            )
        contact_users.append(estimator)
        if growth is not None:
            builder.Connect(
                planner.GetOutputPort("motion_plan"), estimator.GetInputPort("motion_plan")
            )
        for name in ("imu_measured", "joint_state_measured"):
            _ExportInput(builder, name, (estimator,))
        if landmarks:
            _ExportInput(builder, "landmark_sighted", (estimator,))
            builder.ExportOutput(estimator.GetOutputPort("landmark_state"), "landmark_state")
        for name in ESTIMATES:
            builder.ExportOutput(estimator.GetOutputPort(name), name)
    if growth is not None:
        builder.ExportInput(planner.GetInputPort("map_known"), "map_known")
    if feel is not None:
        felt = touch.GetOutputPort("contact_state_measured")
        for user in contact_users:
            builder.Connect(felt, user.GetInputPort("contact_state_measured"))
        _ExportInput(builder, "joint_torque_measured", (touch,))
        builder.ExportOutput(felt, "contact_state_felt")
    else:
        _ExportInput(builder, "contact_state_measured", contact_users)
    for system, names in (
        (
            follower,
            ("joint_state_desired", "joint_torque_feedforward", "body_desired", "feet_desired"),
        ),
        (scheduler, ("gait_phase", "contact_state_desired", "catch")),
        (planner, ("motion_plan",)),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    for name in OWN:
        if follower.HasOutputPort(name):
            builder.ExportOutput(follower.GetOutputPort(name), name)
    diagram = builder.Build()
    diagram.set_name("controller")
    return diagram


def _make_tracking(tracking: str | MakeTracking) -> MakeTracking:
    """What makes the controller.

    Raises:
        InputError: It is neither a controller's name nor can be called.
    """
    if not isinstance(tracking, str) and callable(tracking):
        return tracking
    if not isinstance(tracking, str) or tracking not in KINDS:
        remedy = f"no such controller; give {' or '.join(KINDS)}, or what makes one of your own"
        raise InputError(source="controller", field="tracking", value=tracking, remedy=remedy)
    return KINDS[tracking]


def _check_keywords(make: MakeTracking, names: Sequence[str]) -> None:
    """Sees that what makes a controller can be called with these keywords.

    Raises:
        InputError: It cannot; what it raises by itself is left as it is.
    """
    try:
        signature = inspect.signature(make)
    except (TypeError, ValueError):  # of what is not written in Python nothing is known before
        return
    try:
        signature.bind(**dict.fromkeys(names))
    except TypeError as problem:
        remedy = (
            f"it is called with the keywords {', '.join(names[:-1])} and {names[-1]}, and cannot "
            f"be: {problem}"
        )
        name = getattr(make, "__qualname__", type(make).__name__)
        raise InputError(source="controller", field="tracking", value=name, remedy=remedy) from None


def _check_ports(system: LeafSystem) -> None:
    """Sees that a system has the ports of a TrackingController.

    Raises:
        InputError: It is no system; or the first that it lacks, or whose size is another.
    """
    if not isinstance(system, System):
        remedy = "what makes a controller must return a system of Drake"
        value = type(system).__name__
        raise InputError(source="controller", field="tracking", value=value, remedy=remedy)

    def fail(port: str, remedy: str) -> InputError:
        name = type(system).__name__
        return InputError(source=name, field=port, value=name, remedy=remedy)

    for name in INPUTS:
        if not system.HasInputPort(name):
            raise fail(name, f"needs an input port of that name, as {', '.join(INPUTS)}")
    for name, size in OUTPUTS.items():
        if not system.HasOutputPort(name):
            raise fail(name, f"needs an output port of that name, as {', '.join(OUTPUTS)}")
        own = system.GetOutputPort(name).size()
        if own != size:
            raise fail(name, f"its output port must have {size} values, and has {own}")


def _Wire(
    builder: DiagramBuilder,
    scheduler: GaitScheduler,
    planner: TransitionPlanner,
    tracking: LeafSystem,
) -> None:
    """Connects the three with each other, and their other inputs with the controller's."""
    for name, source, sinks in (
        ("motion_plan", planner, (scheduler, tracking)),
        ("gait_phase", scheduler, (planner, tracking)),
        ("catch", scheduler, (tracking,)),
        ("balance_estimated", tracking, (scheduler,)),
    ):
        for sink in sinks:
            builder.Connect(source.GetOutputPort(name), sink.GetInputPort(name))


def _ExportNormals(builder: DiagramBuilder, follower: LeafSystem) -> None:
    """The controller's input for normals that the feet feel.

    Raises:
        InputError: A controller of one's own that has none.
    """
    port = "ground_normal_measured"
    if not follower.HasInputPort(port):
        raise InputError(
            source=type(follower).__name__,
            field=port,
            value=type(follower).__name__,
            remedy="needs an input port of that name (12,) with sensors.ground_normal: feet; "
            "or leave that at `map`",
        )
    _ExportInput(builder, port, (follower,))


def _ExportInput(builder: DiagramBuilder, name: str, systems: Sequence[LeafSystem]) -> None:
    """One input of the diagram for the inputs of that name of several systems."""
    index = builder.ExportInput(systems[0].GetInputPort(name), name)
    for system in systems[1:]:
        builder.ConnectInput(index, system.GetInputPort(name))


def _MakeEstimator(
    robot: RobotModel, layout: StateLayout, start: Stance, control: ControlSettings,
    course: Course, foot_give: float, map_grows: bool, landmarks: bool,
    imu: ImuNoise,
) -> StateEstimator:  # fmt: skip
    q, _, _ = pose_robot(robot, start.body[None], start.feet[None])
    return StateEstimator(
        robot=robot,
        layout=layout,
        p_WB=start.body[:3],
        yaw=float(start.body[4]),
        pitch=float(start.body[3]),
        q=q.reshape(12),
        settings=replace(
            settings_for(imu),
            level_start=LEVEL_START,
            foot_sink=FOOT_SINK,
            map_height=MAP_HEIGHT,
            **(LANDMARKS if landmarks else {}),
        ),
        period=control.period,
        course=course,
        foot_give=foot_give,
        map_grows=map_grows,
        landmarks=landmarks,
    )
