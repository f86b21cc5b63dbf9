"""A scenario's fields, as YAML fills them: one document says all that a run depends on.

Plain dataclasses, for Drake's yaml_load_typed takes neither frozen ones nor tuples, Literals or
Enums, nor a module with postponed annotations. scenario_check checks the values once; after that
nobody writes to them. Every field's default is here and nowhere else; docs/scenario.md lists them.
"""

from dataclasses import dataclass, field

from pydrake.common.yaml import yaml_dump_typed
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from drake_quad.scenario_config_world import DisturbancesConfig, WorldConfig


@dataclass
class RobotConfig:
    """Which robot.

    Attributes:
        model: Its URDF, SDF or MJCF: `package://drake_quad_models/...`, or a path, relative to
            the scenario's file.
    """

    model: str = "package://drake_quad_models/paper_quadruped.urdf"


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

    kind: str = ""
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

    kind: str = ""
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


@dataclass
class GaitConfig:
    """The wave gait.

    Attributes:
        duty_factor: β, the part of a cycle that each foot stands, in [0.75, 1). At 0.75 the
            static margin is zero at two instants of every cycle.
        cycle_time: T [s].
        switch_wait: On four feet, the body moving, before each lift-off of the leg diagonal to
            the one that landed last [s]: at β = 0.75 the margin there is zero without it. Twice a
            cycle, which lasts so much longer than T.
        stride: Longest stride on level ground [m].
        treads: How many treads a cycle takes: 1, 2 or 3; or places, where a tread has several.
        lag: How many treads, or places, the right rear foot stands behind the left front one as
            a cycle begins: the longer the robot against the treads, the more.
        places_per_tread: How many places to step on every tread has, one behind the other: more
            than 1 where runs are long against the legs.
        body_ahead: How far the body goes ahead of the places it has on the treads [treads].
        tread_phase_up: How far ahead of the treads' middles the feet stand going up [treads].
        tread_phase_down: The same going down.
        body_shift_up: How far ahead of those places the body goes besides, going up [m].
        body_shift_down: The same going down.
        lift_down: How much higher the body goes, going down, than on level ground [m].
        shank_room: Between shanks and stairs, that the body keeps where it can [m]; 0: it does not
            look.
        max_ahead: How far the body may go ahead of or behind its nominal place as it walks [m].
        stance_length: P_x, between the centres of front and rear legs' workspaces [m].
        stance_width: P_y, between those of left and right legs [m].
        stance_stagger: Rear feet's |y| minus front feet's |y| [m]: keeps the feet of a side apart
            where the wave puts one down beside the other.
        workspace_length: R_x of each leg's workspace [m].
        workspace_width: R_y of each leg's workspace [m].
        on_centre: Whether footprints on stairs are on the treads' centres, or keep the gait's own
            offset from them (the paper's).
        swing_clearance: Δh: by how much the foot's sphere clears what it passes [m].
        map_error_place: By how much the map's risers may be off; swings leave so much room [m].
        map_error_height: By how much its treads may be higher [m].
        body_height: Of the body's centre over the mean ground under the feet [m].
        pitch: `level`, or `slope` to tilt the body with the stairs.
        pitch_share: With `slope`: how much of the stairs' slope, 0 to 1.
        margin: Over what the plan's static margin is measured: `hull`, of the feet; `friction`, the
            region of balance within controller.friction; `feasible`, within the torque limits too.
    """

    duty_factor: float = 0.85
    cycle_time: float = 8.0
    switch_wait: float = 0.0
    stride: float = 1.0
    treads: int = 2
    lag: int = 1
    places_per_tread: int = 1
    body_ahead: float = 0.0
    tread_phase_up: float = 0.0
    tread_phase_down: float = 0.0
    body_shift_up: float = 0.0
    body_shift_down: float = 0.0
    lift_down: float = 0.0
    shank_room: float = 0.0
    max_ahead: float = 10.0
    stance_length: float = 0.75
    stance_width: float = 0.54
    stance_stagger: float = 0.12
    workspace_length: float = 0.80
    workspace_width: float = 0.5
    on_centre: bool = True
    swing_clearance: float = 0.02
    map_error_place: float = 0.0
    map_error_height: float = 0.0
    body_height: float = 0.85
    pitch: str = "level"
    pitch_share: float = 1.0
    margin: str = "hull"


@dataclass
class SpinConfig:
    """The spinning gait.

    Attributes:
        duty_factor: β, in [0.75, 1).
        cycle_time: T [s].
        workspace_length: R_x of each leg's workspace as it spins [m]; 0: the wave gait's.
        workspace_width: R_y of the same [m]; 0: the wave gait's.
    """

    duty_factor: float = 0.85
    cycle_time: float = 8.0
    workspace_length: float = 0.0
    workspace_width: float = 0.0


@dataclass
class TransitionConfig:
    """Steps from one stance to another, between gaits.

    Attributes:
        mode: `still`, the body at rest throughout (the paper's), or `shift`, the body moving
            before each lift.
        max_shift: How far the body may go from its nominal place [m]: in x and y where that
            stands still, sideways where it walks.
        swing_time: Of each step [s].
        shift_time: On four feet before each step [s].
        via_centres: Whether every transition passes through the workspaces' centres (the paper's).
    """

    mode: str = "shift"
    max_shift: float = 0.3
    swing_time: float = 1.2
    shift_time: float = 1.3
    via_centres: bool = False


@dataclass
class BodyConfig:
    """The path of the body.

    Attributes:
        path: `uniform`, constant speed without sway (the paper's), or `optimised` for margin.
        balance: `static` keeps the centre of mass over the feet, and the zero-moment point;
            `dynamic` the zero-moment point alone, with the legs' masses moving: for quick gaits.
        margin_desired: Static margin beyond which the path is not asked for more [m].
        zmp_margin: The same for the zero-moment point [m].
    """

    path: str = "optimised"
    balance: str = "static"
    margin_desired: float = 0.10
    zmp_margin: float = 0.08


@dataclass
class ControllerConfig:
    """The joint and base feedback, as `drake_quad.control.settings.ControlSettings`.

    Attributes:
        kind: `ik`, statics and stiff joints, or `whole_body`, inverse dynamics by a program.
        period: Of every controller and monitor [s]: a whole number of the plant's time steps.
        kp: Joint stiffness [Nm/rad]; runs inside the plant, implicitly.
        kd: Joint damping [Nm s/rad].
        base_stiffness: Force per error of the base's place [N/m].
        base_damping: Force per error of its velocity [N s/m].
        base_rotation_stiffness: Moment per error of its orientation [Nm/rad].
        base_rotation_damping: Moment per error of its angular velocity [Nm s/rad].
        foothold_time: Time over which a standing foot's target follows where it really stands
            [s]: what it stands on decides, not where it was meant to stand.
        unload_time: Time over which a foot takes its load up or gives it away [s].
        least_force: What a foot under full load pushes with at least, if the others can hold the
            robot all the same [N].
        touchdown_press: How far below the ground a swing foot aims as it lands [m]: the joints'
            stiffness then makes it bear at once.
        search_speed: How fast a foot that found no ground goes on down while the clock waits for
            it [m/s].
        lift_off_margin: Static margin that the other three feet must give before a lift-off [m].
        margin_demanded: Static margin, speed counted in, that the gait clock slows down and stands
            for, before it is lost [m]; 0: it does not.
        stance_stiffness: Share of the joints' stiffness and damping that a loaded leg keeps under
            the whole-body controller, whose forces do the rest.
        friction: Coefficient that the whole-body controller's forces stay within, and that plans
            count on whose margin is not the hull's.
        pressure_margin: Of the centre of pressure from the support's sides that it keeps [m].
        load_time: Time over which the whole-body controller learns of an unknown load [s]; 0: it
            does not.
        height_time: Time over which the body follows the height of the ground as found [s].
        catch_pushes: Whether pushes are caught by putting feet down.
        push_speed: Error of the base's velocity below which nothing is called a push [m/s].
        patience: How long the gait clock waits at a switch before it stops the run [s].
    """

    kind: str = "ik"
    period: float = 0.005
    kp: float = 2000.0
    kd: float = 80.0
    base_stiffness: float = 3000.0
    base_damping: float = 900.0
    base_rotation_stiffness: float = 1000.0
    base_rotation_damping: float = 100.0
    foothold_time: float = 0.3
    unload_time: float = 0.25
    least_force: float = 20.0
    touchdown_press: float = 0.003
    search_speed: float = 0.05
    lift_off_margin: float = 0.02
    margin_demanded: float = 0.0
    stance_stiffness: float = 0.3
    friction: float = 0.5
    pressure_margin: float = 0.01
    load_time: float = 0.5
    height_time: float = 0.5
    catch_pushes: bool = True
    push_speed: float = 0.12
    patience: float = 2.0


@dataclass
class EstimatorConfig:
    """Where the controller has the robot's state from.

    Attributes:
        kind: `truth`, the simulated state itself, or `ekf`, estimated from the sensors.
    """

    kind: str = "truth"


@dataclass
class SensorsConfig:
    """The sensors that an estimator reads.

    Attributes:
        noise: `none`, or `realistic`: that of real units, drawn by the seed.
    """

    noise: str = "realistic"


@dataclass
class MonitorConfig:
    """What is measured beside the static margin over the hull of the feet.

    Attributes:
        margins: `hull`, nothing more; `friction`, the margins of the regions that friction leaves
            and the push budget; or `feasible`, those within the joints' torque limits too.
    """

    margins: str = "friction"


@dataclass
class CertifyConfig:
    """What a certificate of the plan is to prove at every time, beside that all is positive.

    Attributes:
        margin: Static margin of the whole robot [m].
        clearance: Room of swing feet to risers and nosings, and of shanks to the course [m].
    """

    margin: float = 0.0
    clearance: float = 0.0


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
        friction: Coulomb's coefficient between feet and ground, static and dynamic.
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
