"""A scenario and its parts, as YAML fills them: one document says all that a run depends on.

Plain dataclasses, for Drake's yaml_load_typed takes neither frozen ones nor tuples, Literals or
Enums, nor a module with postponed annotations. Every field's default, unit, meaning and bounds are
here and nowhere else: `validate.py` checks them once, after that nobody writes to the values, and
the tables of docs/scenario.md are made from them.
"""

from dataclasses import dataclass, field
from typing import Any

from pydrake.common.yaml import yaml_dump_typed
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import GetIntegrationSchemes, SimulatorConfig

from drake_quad.control.settings import FRICTION_MOST, ControlSettings
from drake_quad.scenario.motion_config import (
    PREFER,
    BodyConfig,
    CertifyConfig,
    GaitConfig,
    SpinConfig,
    TransitionConfig,
)
from drake_quad.scenario.perception_config import PerceptionConfig
from drake_quad.scenario.sensing_config import EstimatorConfig, MonitorConfig, SensorsConfig
from drake_quad.terrain.elements import Element
from drake_quad.util.schema import (
    TEXT,
    FieldBound,
    choice,
    not_negative,
    number,
    part,
    positive,
    up_to,
    within,
)

MISSION_KINDS = ("walk", "spin", "stand")
FARTHEST = 2.0  # [m] of a payload, a centre of mass or a push's point from the trunk's middle
MOST_FORCE = 1e5  # [N] along each axis


@dataclass
class RobotConfig:
    """Which robot."""

    model: str = field(
        default="package://drake_quad_models/paper_quadruped.urdf",
        metadata={
            TEXT: "URDF, SDF or MJCF: a `package://` URL, or a path relative to the scenario's "
            "file (in an override, to the working directory); a `.robot.yaml`; or a "
            "[robot's name](robots.md)"
        },
    )
    point_feet: bool = number(
        False,
        "",
        "Whether the feet are points, the lowest ones of their balls: as in the paper they do not "
        "roll. In kinematic replays with a given gait alone",
    )


@dataclass
class MissionElement:
    """One thing to do."""

    kind: str = field(
        default="", metadata={"words": MISSION_KINDS, TEXT: "`walk`, `spin` or `stand`"}
    )
    distance: float | None = number(None, "m", "Length of a walk, along the lane")
    angle_deg: float | None = number(None, "deg", "Angle of a spin, left positive")
    duration: float | None = number(None, "s", "Duration of a stand")


@dataclass
class StartConfig:
    """Where the robot starts, standing, and where it heads."""

    distance: float = number(
        1.0, "m", "The body's centre at the start, along the first lane", not_negative()
    )
    heading_deg: float = number(
        0.0,
        "deg",
        "How far it is turned to the left of the first lane; with `perception.map: seen` alone, "
        "where it turns into the lane that it has seen",
        within(-30.0, 30.0),
    )


@dataclass
class PushConfig:
    """A push: a force for a while, given by `speed` and direction, or by `force`.

    Directions are those of the robot's heading as the push begins; see
    `drake_quad.systems.disturbances.Push`.
    """

    time: float | None = number(
        None, "s", "When it begins; rounded to the plant's steps", not_negative()
    )
    duration: float = number(
        0.1,
        "s",
        "How long it lasts, 0.1 by default; rounded to the plant's steps, one at least",
        up_to(10.0, "s"),
    )
    speed: float | None = number(
        None,
        "m/s",
        "Speed of the whole robot that it is worth: impulse = the mass that the robot's file has "
        "(without payload and `mass_factor`) × speed",
        up_to(10.0, "m/s"),
    )
    direction_deg: float | None = number(
        None, "deg", "Direction of `speed`: 0 ahead (the default), 90 to the left"
    )
    force: list[float] | None = number(
        None,
        "N",
        "Instead of `speed`: a list of three, ahead, to the left, up",
        FieldBound(
            f"must be within {MOST_FORCE:g} N along each axis", -MOST_FORCE, most=MOST_FORCE
        ),
    )
    body: str = number("", "", "Name of the body that it acts on; the trunk by default")
    point: list[float] | None = number(
        None,
        "m",
        "Where on that body it acts, in the body's own frame, a list x, y, z; its origin by "
        "default",
        FieldBound(f"must be within {FARTHEST:g} m along each axis", -FARTHEST, most=FARTHEST),
    )


@dataclass
class PayloadConfig:
    """A box fixed to the trunk, of which the controller knows nothing."""

    mass: float = number(
        0.0,
        "kg",
        "Mass of a cube as dense as water that is fixed to the trunk",
        within(0.0, 1000.0),
    )
    x: float = number(0.0, "m", "x of the cube's middle in B", within(-FARTHEST, FARTHEST))
    y: float = number(0.0, "m", "y of the cube's middle in B", within(-FARTHEST, FARTHEST))
    z: float = number(0.0, "m", "z of the cube's middle in B", within(-FARTHEST, FARTHEST))


def _offset(axis: str) -> float:
    """A coordinate of the trunk's centre of mass."""
    text = f"How far the trunk's centre of mass is along B's {axis} from where the file has it"
    bound: float = number(0.0, "m", text, within(-FARTHEST, FARTHEST))
    return bound


@dataclass
class OffsetConfig:
    """How far the trunk's centre of mass is from where the controller believes it to be."""

    x: float = _offset("x")
    y: float = _offset("y")
    z: float = _offset("z")


@dataclass
class MotorStrengthConfig:
    """A drive that delivers less than it is told."""

    joint: str = number("", "", "Name of the joint in the robot's file")
    factor: float | None = number(
        None,
        "",
        "The part of its drive's torque (PD and feed-forward), and of its effort limit, that is "
        "left",
        within(0.0, 1.0),
    )


@dataclass
class DisturbancesConfig:
    """What happens to the robot that its controller is not told."""

    pushes: list[PushConfig] = part(list, "A list, [below](#pushes-and-other-disturbances)")
    payload: PayloadConfig = part(PayloadConfig, "A box on the trunk")
    com_offset: OffsetConfig = part(OffsetConfig, "The trunk's centre of mass")
    mass_factor: float = number(
        1.0,
        "",
        "Factor by which every link's mass and inertia differs from the robot's file",
        within(0.2, 5.0),
    )
    motor_strength: list[MotorStrengthConfig] = part(
        list, "A list, [below](#pushes-and-other-disturbances)"
    )
    sensor_delay: float = number(
        0.0,
        "s",
        "How late all that the controller senses is, a whole multiple of the plant's `time_step`",
        within(0.0, 1.0),
    )
    command_delay: float = number(
        0.0,
        "s",
        "How late the controller's commands reach the drives, a whole multiple of the plant's "
        "`time_step`",
        within(0.0, 1.0),
    )


@dataclass
class WorldConfig:
    """How the real course differs from the map, `course`; see `drake_quad.terrain.as_built`."""

    rise_error: float = number(0.0, "m", "Added to every rise", within(-0.1, 0.1))
    run_error: float = number(
        0.0, "m", "Added to every run; the flight's middle stays where it is", within(-0.1, 0.1)
    )
    position_error: float = number(
        0.0, "m", "How much farther along its lane each flight is", within(-1.0, 1.0)
    )
    yaw_error_deg: float = number(
        0.0,
        "deg",
        "How far each flight is turned about its own middle, left positive",
        within(-20.0, 20.0),
    )
    tread_error: float = number(
        0.0, "m", "Each tread is higher or lower by up to this, by the seed", within(0.0, 0.1)
    )
    tread_tilt: float = number(
        0.0,
        "m/m",
        "How much each tread falls towards its nosing, as worn ones do; a flight's last is level",
        within(-0.5, 0.5),
    )
    random: bool = number(
        False,
        "",
        "Whether all but `tread_error` are drawn by the seed, evenly between minus and plus the "
        "value: rise and run once, place and yaw for each flight, tilt for each tread",
    )


def _plant() -> MultibodyPlantConfig:
    """Drake's defaults, but the contact that the numbers of this project are measured with."""
    return MultibodyPlantConfig(
        time_step=0.001, contact_model="point", discrete_contact_approximation="lagged"
    )


@dataclass
class SimulationConfig:
    """The physics, and what is logged of it."""

    mode: str = choice(
        "physics",
        ("physics", "kinematic"),
        "`kinematic`: the robot moves along its plan, without forces",
    )
    plant: MultibodyPlantConfig = part(
        _plant,
        "Drake's `MultibodyPlantConfig`; here `time_step: 0.001`, `contact_model: point` (or "
        "`hydroelastic_with_fallback`: compliant feet of 10⁸ Pa on rigid ground, contacts of all "
        "else as points; `hydroelastic` alone is refused, for only feet and ground have what it "
        "needs), `discrete_contact_approximation: lagged` (`tamsi` is refused: it ignores the "
        "joints' gains)",
        {
            # not hydroelastic alone: only feet and ground have what it needs, all else would end
            # the run
            "contact_model": lambda: ("point", "hydroelastic_with_fallback"),
            # not tamsi: it ignores the joints' gains without a word, and the robot collapses
            "discrete_contact_approximation": lambda: ("lagged", "similar", "sap"),
            "contact_surface_representation": lambda: ("polygon", "triangle"),
            "penetration_allowance": (positive(),),
            "stiction_tolerance": (positive(),),
            "time_step": (not_negative(), within(0.0, 0.01)),
            "sap_near_rigid_threshold": (not_negative(),),
        },
    )
    simulator: SimulatorConfig = part(
        SimulatorConfig,
        "Drake's `SimulatorConfig`; the pace is `simulation.realtime_rate`. With "
        "`integration_scheme: cenic`, Drake 1.51.1 takes the joints' desired speed with the wrong "
        "sign ([measured](contact_solvers.md))",
        {
            "integration_scheme": lambda: tuple(GetIntegrationSchemes()),
            "max_step_size": (positive(),),
            "accuracy": (positive(),),
        },
    )
    friction: float = number(
        0.8,
        "",
        "Coulomb's coefficient of contacts, static and dynamic, of the ground and of all of the "
        "robot; with that of a foot whose file states one of its own Drake combines it "
        "([robots](robots.md))",
        positive(),
        within(0.0, FRICTION_MOST),
    )
    log_period: float = number(
        0.005,
        "s",
        "Time between samples of the log, a whole multiple of the plant's `time_step`",
        positive(),
        within(1e-4, 1.0),
    )
    seed: int = number(0, "", "Seed of everything random", not_negative())
    realtime_rate: float = number(
        0.0, "", "Fastest pace against the wall clock; 0: as fast as it goes", not_negative()
    )

    def __eq__(self, other: object) -> bool:
        """By value: Drake's config structs compare by identity."""
        if not isinstance(other, SimulationConfig):
            return NotImplemented
        return bool(yaml_dump_typed(self) == yaml_dump_typed(other))

    def __getstate__(self) -> dict[str, Any]:
        """What a pickle holds: Drake's config structs, which have none, as their fields."""
        structs = (MultibodyPlantConfig, SimulatorConfig)
        return {
            name: (type(value), {f.name: getattr(value, f.name) for f in value.__fields__})
            if isinstance(value, structs) else value
            for name, value in self.__dict__.items()
        }  # fmt: skip

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            struct = isinstance(value, tuple)
            setattr(self, name, value[0](**value[1]) if struct else value)


@dataclass
class Scenario:
    """A run, in full."""

    description: str = number("", "", "What the scenario shows, in a line")
    robot: RobotConfig = part(RobotConfig, "Which robot")
    design: str = choice(
        "given",
        ("given", "auto"),
        "`auto`: gait, body and feedback are designed for robot and course. A file that has none "
        "of `gait`, `spin`, `transition`, `body`, `controller` is `auto` if the robot is named "
        "there or by an override",
    )
    prefer: str = choice(
        PREFER[0],
        PREFER,
        "What a gait is to be good at that is designed (`design: auto`), as for `check --prefer`. "
        "With `perception.map: seen` it is `margin`",
    )
    course: list[Element] = part(list, "What the robot walks on, [above](#the-course)")
    mission: list[MissionElement] = part(list, "What the robot does, [above](#the-mission)")
    start: StartConfig = part(StartConfig, "Where the robot starts")
    gait: GaitConfig = part(GaitConfig, "The wave gait")
    spin: SpinConfig = part(SpinConfig, "The spinning gait")
    transition: TransitionConfig = part(TransitionConfig, "Steps between the two gaits")
    body: BodyConfig = part(BodyConfig, "The body's path")
    controller: ControlSettings = part(ControlSettings, "Feedback")
    estimator: EstimatorConfig = part(EstimatorConfig, "Where the state comes from")
    sensors: SensorsConfig = part(SensorsConfig, "What an estimator reads")
    disturbances: DisturbancesConfig = part(DisturbancesConfig, "What the controller is not told")
    world: WorldConfig = part(WorldConfig, "How the real course differs from `course`")
    perception: PerceptionConfig = part(PerceptionConfig, "Where the map comes from")
    monitor: MonitorConfig = part(MonitorConfig, "Which margins are measured")
    certify: CertifyConfig = part(CertifyConfig, "What a certificate of the plan is to prove")
    simulation: SimulationConfig = part(SimulationConfig, "The physics")
