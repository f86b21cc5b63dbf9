"""A scenario's fields of what the controller is not told; as scenario_config, which holds them."""

from dataclasses import dataclass, field


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
    """How the real course differs from the map, `course`; see `drake_quad.world`.

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
