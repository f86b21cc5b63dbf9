"""What happens to the robot that its controller is not told: frozen values of all of it."""

from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Push:
    """A force on a body of the robot for a while.

    Its direction is given in H, the robot's heading frame as the push begins: x ahead, y to the
    left, z up. From then on the force keeps its direction in W.

    Attributes:
        time: When it begins [s].
        duration: How long it lasts [s].
        force_H: Its force [N].
        body: Name of the body it acts on.
        p_BP: Where on that body, in the body's own frame [m].
        speed: Of the whole robot that its impulse is worth [m/s].
    """

    time: float
    duration: float
    force_H: Vector
    body: str
    p_BP: Vector = (0.0, 0.0, 0.0)
    speed: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """All of them; by default there are none.

    Attributes:
        pushes: Forces from outside.
        payload_mass: Of a box fixed to the trunk [kg].
        p_BPayload: Of its middle, in B [m].
        com_offset: Of the trunk's own centre of mass from where the model has it, in B [m].
        mass_factor: By which every link's mass and inertia is that of the model.
        motor_strength: By the joint's name the part in [0, 1] of the commanded torque, and of the
            effort limit, that its drive delivers.
        sensor_delay: By which all that the controller senses reaches it late [s].
        command_delay: By which its commands reach the drives late [s]. The drives' own PD runs on
            the joints as they are.
    """

    pushes: tuple[Push, ...] = ()
    payload_mass: float = 0.0
    p_BPayload: Vector = (0.0, 0.0, 0.0)
    com_offset: Vector = (0.0, 0.0, 0.0)
    mass_factor: float = 1.0
    motor_strength: dict[str, float] = field(default_factory=dict)
    sensor_delay: float = 0.0
    command_delay: float = 0.0
