"""A scenario and its parts, as YAML fills them: robot, course, mission, disturbances, simulation.

Plain dataclasses, for Drake's yaml_load_typed takes neither frozen ones nor tuples, Literals or
Enums, nor a module with postponed annotations. `validate.py` checks the values once; after that
nobody writes to them. Every field's default is here and nowhere else; docs/scenario.md lists them.
"""

from dataclasses import dataclass, field

from pydrake.common.yaml import yaml_dump_typed
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from drake_quad.scenario.motion_config import (
    BodyConfig,
    CertifyConfig,
    ControllerConfig,
    EstimatorConfig,
    GaitConfig,
    MonitorConfig,
    SensorsConfig,
    SpinConfig,
    TransitionConfig,
)
from drake_quad.terrain.elements import FIELDS_OF_KIND

# ------------------------------------------------------------------------------------------------
# A scenario's fields of what the controller is not told.
# ------------------------------------------------------------------------------------------------


@dataclass
class PushConfig:
    """A push: a force for a while, given by `speed` and direction, or by `force`.

    Directions are those of the robot's heading as the push begins; see
    `drake_quad.systems.disturbances.Push`.

    Attributes:
        time: When it begins [s].
        duration: How long it lasts [s]: rounded to whole steps of the plant, one at least.
        speed: Of the whole robot that its impulse is worth [m/s]: impulse = mass times speed.
        direction_deg: Of `speed`, where it pushes to [deg]: 0 ahead, 90 to the left.
        force: Instead of `speed`: ahead, to the left, up [N].
        body: Name of the body it acts on; the trunk if none.
        point: Where on that body, in its own frame, x, y, z [m]; its origin if none.
    """

    time: float | None = None
    duration: float = 0.1
    speed: float | None = None
    direction_deg: float | None = None
    force: list[float] | None = None
    body: str = ""
    point: list[float] | None = None


@dataclass
class PayloadConfig:
    """A box fixed to the trunk, of which the controller knows nothing.

    Attributes:
        mass: Of the box [kg].
        x: Of its middle in B [m].
        y: Of its middle in B [m].
        z: Of its middle in B [m].
    """

    mass: float = 0.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class OffsetConfig:
    """By how much the trunk's centre of mass is elsewhere than the controller believes.

    Attributes:
        x: In B [m].
        y: In B [m].
        z: In B [m].
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class MotorStrengthConfig:
    """A drive that delivers less than it is told.

    Attributes:
        joint: The joint's name in the robot's file.
        factor: Part in [0, 1] of its torque, and of its effort limit, that is left.
    """

    joint: str = ""
    factor: float | None = None


@dataclass
class DisturbancesConfig:
    """What happens to the robot that its controller is not told.

    Attributes:
        pushes: Forces from outside.
        payload: A box on the trunk.
        com_offset: The trunk's centre of mass.
        mass_factor: By which every link's mass and inertia differs from the robot's file.
        motor_strength: Weak drives.
        sensor_delay: By which all that the controller senses is late [s]: whole plant steps.
        command_delay: By which its commands reach the drives late [s]: whole plant steps.
    """

    pushes: list[PushConfig] = field(default_factory=list)
    payload: PayloadConfig = field(default_factory=PayloadConfig)
    com_offset: OffsetConfig = field(default_factory=OffsetConfig)
    mass_factor: float = 1.0
    motor_strength: list[MotorStrengthConfig] = field(default_factory=list)
    sensor_delay: float = 0.0
    command_delay: float = 0.0


@dataclass
class WorldConfig:
    """How the real course differs from the map, `course`; see `drake_quad.terrain.as_built`.

    Attributes:
        rise_error: Added to every rise [m].
        run_error: Added to every run [m], the flight's middle staying where it is.
        position_error: By which each flight is farther along its lane [m].
        yaw_error_deg: By which each flight is turned about its own middle [deg], left positive.
        tread_error: Each tread is higher or lower by up to this [m], by the seed.
        random: Whether the first four are drawn by the seed, evenly between minus and plus the
            value, instead of taken as they are: rise and run once, place and yaw for each flight.
    """

    rise_error: float = 0.0
    run_error: float = 0.0
    position_error: float = 0.0
    yaw_error_deg: float = 0.0
    tread_error: float = 0.0
    random: bool = False


# ------------------------------------------------------------------------------------------------
# A scenario's fields, as YAML fills them: one document says all that a run depends on.
# ------------------------------------------------------------------------------------------------


COURSE_KINDS = tuple(FIELDS_OF_KIND)
MISSION_KINDS = ("walk", "spin", "stand")


@dataclass
class RobotConfig:
    """Which robot.

    Attributes:
        model: Its URDF, SDF or MJCF: `package://drake_quad_models/...`, or a path, relative to
            the scenario's file.
        point_feet: Whether the feet are points, the ends of the legs, as in the paper: they do
            not roll. In a kinematic replay alone.
    """

    model: str = "package://drake_quad_models/paper_quadruped.urdf"
    point_feet: bool = False


@dataclass
class CourseElement:
    """One stretch of the course; see `drake_quad.terrain.elements.Element`.

    Attributes:
        kind: `floor`, `stairs`, `landing`, `block`, `curb` or `slope`.
        length: Of a floor, a landing, a block or a slope, along the heading, from above [m].
        width: Across the heading [m]; 2 m unless told, a landing to turn on as wide as it can be.
        turn_deg: Of a landing: the turn on it [deg], left positive.
        going: Of stairs, a curb or a slope: `up` or `down`.
        rise: Of stairs: height of every step [m].
        run: Of stairs: depth of every tread [m].
        count: Of stairs: number of steps, which is the number of risers.
        rises: Of irregular stairs, instead of `rise`: the height of each step [m].
        runs: Of irregular stairs, instead of `run`: the depth of each tread [m].
        overhang: Of stairs: by how much each tread reaches beyond the riser under it [m].
        open: Of stairs: whether the risers are open, nothing between the treads.
        thickness: Of the treads of stairs with an overhang or open risers [m]; 0.04 unless told.
        height: Of a block, a curb or a slope [m].
    """

    kind: str = field(default="", metadata={"words": COURSE_KINDS})
    length: float | None = None
    width: float | None = None
    turn_deg: float | None = None
    going: str | None = None
    rise: float | None = None
    run: float | None = None
    count: int | None = None
    rises: list[float] | None = None
    runs: list[float] | None = None
    overhang: float | None = None
    open: bool | None = None
    thickness: float | None = None
    height: float | None = None


@dataclass
class MissionElement:
    """One thing to do.

    Attributes:
        kind: `walk`, `spin` or `stand`.
        distance: Of a walk, along the lane [m].
        angle_deg: Of a spin [deg], left positive.
        duration: Of a stand [s].
    """

    kind: str = field(default="", metadata={"words": MISSION_KINDS})
    distance: float | None = None
    angle_deg: float | None = None
    duration: float | None = None


@dataclass
class StartConfig:
    """Where the robot starts, standing, heading along the first lane.

    Attributes:
        distance: Of the body's centre from the course's start [m].
    """

    distance: float = 1.0


def _plant() -> MultibodyPlantConfig:
    """Drake's defaults, but the contact that the numbers of this project are measured with."""
    return MultibodyPlantConfig(
        time_step=0.001, contact_model="point", discrete_contact_approximation="lagged"
    )


@dataclass
class SimulationConfig:
    """The physics, and what is logged of it.

    Attributes:
        mode: `physics`, or `kinematic` to move the robot along its plan without forces.
        plant: Drake's own MultibodyPlantConfig.
        simulator: Drake's own SimulatorConfig.
        friction: Coulomb's coefficient of contacts, static and dynamic; a foot's own is combined.
        log_period: Between samples of the log [s]: a whole number of the plant's time steps.
        seed: Of everything random in the run.
        realtime_rate: Fastest pace against the wall clock; 0 is as fast as it goes.
    """

    mode: str = "physics"
    plant: MultibodyPlantConfig = field(default_factory=_plant)
    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    friction: float = 0.8
    log_period: float = 0.005
    seed: int = 0
    realtime_rate: float = 0.0

    def __eq__(self, other: object) -> bool:
        """By value: Drake's config structs compare by identity."""
        if not isinstance(other, SimulationConfig):
            return NotImplemented
        return bool(yaml_dump_typed(self) == yaml_dump_typed(other))


@dataclass
class Scenario:
    """A run, in full.

    Attributes:
        description: What it shows, in a line.
        robot: Which robot.
        design: `auto` to design gait, body and feedback for robot and course, or `given`. Of a file
            that names a robot and says nothing of the gait it is `auto`.
        course: What it walks on, in walking order.
        mission: What it does, in order; empty follows the course: along each lane, and at the
            end of each the turn there.
        start: Where it starts.
        gait: The wave gait.
        spin: The spinning gait.
        transition: Between the two.
        body: The body's path.
        controller: Feedback.
        estimator: Where the controller has the robot's state from.
        sensors: What an estimator reads.
        disturbances: What the controller is not told.
        world: How the real course differs from `course`.
        monitor: Which margins are measured.
        certify: What a certificate of the plan is to prove.
        simulation: The physics.
    """

    description: str = ""
    robot: RobotConfig = field(default_factory=RobotConfig)
    design: str = "given"
    course: list[CourseElement] = field(default_factory=list)
    mission: list[MissionElement] = field(default_factory=list)
    start: StartConfig = field(default_factory=StartConfig)
    gait: GaitConfig = field(default_factory=GaitConfig)
    spin: SpinConfig = field(default_factory=SpinConfig)
    transition: TransitionConfig = field(default_factory=TransitionConfig)
    body: BodyConfig = field(default_factory=BodyConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    sensors: SensorsConfig = field(default_factory=SensorsConfig)
    disturbances: DisturbancesConfig = field(default_factory=DisturbancesConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    monitor: MonitorConfig = field(default_factory=MonitorConfig)
    certify: CertifyConfig = field(default_factory=CertifyConfig)
    simulation: SimulationConfig = field(default_factory=SimulationConfig)
