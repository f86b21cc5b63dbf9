"""A scenario's motion as YAML fills it: gait, spin, transition, body, controller, sensors."""

from dataclasses import dataclass, field

# ------------------------------------------------------------------------------------------------
# A scenario's fields of how the robot moves.
# ------------------------------------------------------------------------------------------------


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
        deep_tread: Depth of treads from which a flight is walked as floors with curbs between them
            are: its risers one at a time, in the stride of level ground [m].
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
        pitch_share: With `slope`: how much of the stairs' slope, up to 1.5.
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
    deep_tread: float = 100.0
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
        swing_path: `chord`, straight over the ground to the next footprint, or `arc`, round the
            body (the paper's).
    """

    duty_factor: float = 0.85
    cycle_time: float = 8.0
    workspace_length: float = 0.0
    workspace_width: float = 0.0
    swing_path: str = "chord"


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
        wave_order: Legs in the order in which they are lifted towards the wave gait; the paper has
            [2, 3, 4, 1, 3], where leg 3 goes by way of a place in between. Empty: the fewest steps
            with the best margins.
        spin_order: The same towards the spinning gait, whichever way that turns.
    """

    mode: str = "shift"
    max_shift: float = 0.3
    swing_time: float = 1.2
    shift_time: float = 1.3
    via_centres: bool = False
    wave_order: list[int] = field(default_factory=list)
    spin_order: list[int] = field(default_factory=list)


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


# ------------------------------------------------------------------------------------------------
# A scenario's fields of feedback and of what is measured.
# ------------------------------------------------------------------------------------------------


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
            robot all the same [N], but in a push; in any case up to twice that, where it would
            bear twice as much again with the robot brought to rest.
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
    foothold_time: float = 0.12
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
