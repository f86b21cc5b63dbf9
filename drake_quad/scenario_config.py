"""A scenario's fields, as YAML fills them: one document says all that a run depends on.

Plain dataclasses, for Drake's yaml_load_typed takes neither frozen ones nor tuples, Literals or
Enums, nor a module with postponed annotations. scenario_check checks the values once; after that
nobody writes to them. Every field's default is here and nowhere else; docs/scenario.md lists them.
"""

from dataclasses import dataclass, field

from pydrake.common.yaml import yaml_dump_typed
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from drake_quad.scenario_config_control import (
    CertifyConfig,
    ControllerConfig,
    EstimatorConfig,
    MonitorConfig,
    SensorsConfig,
)
from drake_quad.scenario_config_motion import BodyConfig, GaitConfig, SpinConfig, TransitionConfig
from drake_quad.scenario_config_world import DisturbancesConfig, WorldConfig
from drake_quad.terrain_check import FIELDS_OF_KIND

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
    """One stretch of the course; see `drake_quad.terrain_elements.Element`.

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
