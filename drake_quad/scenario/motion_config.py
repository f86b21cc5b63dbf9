"""A scenario's motion as YAML fills it: gait, spin, transition, body, and what is proven of it.

Plain dataclasses with unpostponed annotations, as those of `config.py`.
"""

from dataclasses import dataclass

from drake_quad.planning.foothold_pattern import GAITS, WAVE
from drake_quad.stability.margin_kinds import KINDS
from drake_quad.util.schema import FieldBound, choice, not_negative, number, part, positive, within

PREFER = ("margin", "balanced", "speed")  # what a gait is to be good at, see `GaitPreference`
LEAST_DUTY = 0.75  # with less, two legs are in the air at times
DUTY_REMEDY = "must be in [0.75, 1): with less, three feet do not always stand"


def _cycle_time(text: str) -> float:
    """A gait's T."""
    bound: float = number(8.0, "s", text, positive(), within(0.5, 120.0))
    return bound


def _leg_speed(leg: str) -> float:
    text = (
        f"Speed that the {leg} foot does not exceed in swings that end higher (`_up`) or lower "
        "(`_down`) than they begin; 0: `gait.swing_speed`"
    )
    speed: float = number(0.0, "m/s", text, not_negative(), within(0.0, 20.0))
    return speed


@dataclass
class LegSpeedsConfig:
    """Speeds that swing feet do not exceed, leg by leg."""

    FL: float = _leg_speed("front left")
    FR: float = _leg_speed("front right")
    RL: float = _leg_speed("rear left")
    RR: float = _leg_speed("rear right")


@dataclass
class GaitConfig:
    """The gait that walks."""

    pattern: str = choice(
        WAVE,
        GAITS,
        "`wave`: one leg swings at a time; `trot`: the diagonal pairs swing in turn, with time on "
        "four feet between. While two feet stand there is no static margin: the zero-moment point "
        "is kept on the line between them ([how](speed.md#two-feet-at-a-time))",
    )
    duty_factor: float = number(
        0.85,
        "",
        "β, the part of a cycle that each foot stands; in a wave gait 0.75 or more, and at 0.75 "
        "the static margin is 0 at two instants of every cycle; in a trot (β - ½) T is the time on "
        "four feet between two swings",
        FieldBound("must be in [0.75, 1), in a trot in (0.5, 1)", above=0.5, below=1.0),
    )
    cycle_time: float = _cycle_time("T")
    switch_wait: float = number(
        0.0,
        "s",
        "On four feet, the body moving, before each lift-off of the leg diagonal to the one that "
        "landed last; twice a cycle, which lasts so much longer than T",
        not_negative(),
        within(0.0, 60.0),
    )
    stride: float = number(
        1.0, "m", "λ, the longest stride on level ground", positive(), within(0.05, 5.0)
    )
    treads: int = number(2, "", "Treads that a cycle takes", within(1, 3))
    lag: int = number(
        1,
        "",
        "Treads that the right rear foot stands behind the left front one as a cycle begins: 1 for "
        "a robot as long as one or two treads, more for a longer one",
        within(1, 6),
    )
    places_per_tread: int = number(
        1,
        "",
        "Places to step that every tread has, one behind the other: more than 1 where runs are "
        "long against the legs. `treads`, `lag` and `body_ahead` then count places",
        within(1, 3),
    )
    places_together: float = number(
        0.0,
        "",
        "How much nearer to their tread's middle feet are set down than its places are, of that "
        "distance: farther from nosings and risers, which may not be where they are mapped",
        within(0.0, 0.9),
    )
    deep_tread: float = number(
        100.0,
        "m",
        "A flight whose treads are all as deep as that is walked as floors with curbs between them "
        "are: one riser at a time, in the stride of level ground",
        within(0.05, 100.0),
    )
    body_ahead: float = number(
        0.0,
        "treads",
        "How far ahead of its even pace over the treads the body goes",
        within(-3.0, 3.0),
    )
    tread_phase_up: float = number(
        0.0,
        "treads",
        "How far ahead of the treads' middles the feet are set down going up",
        within(-0.45, 0.45),
    )
    tread_phase_down: float = number(
        0.0,
        "treads",
        "How far ahead of the treads' middles the feet are set down going down",
        within(-0.45, 0.45),
    )
    body_shift_up: float = number(
        0.0,
        "m",
        "How far ahead the body goes besides `body_ahead`, going up stairs",
        within(-2.0, 2.0),
    )
    body_shift_down: float = number(
        0.0,
        "m",
        "How far ahead the body goes besides `body_ahead`, going down stairs",
        within(-2.0, 2.0),
    )
    lift_down: float = number(
        0.0,
        "m",
        "How much higher the body goes, going down, than on level ground",
        within(-2.0, 2.0),
    )
    shank_room: float = number(
        0.0,
        "m",
        "Distance between shanks and stairs, and half of it between shanks and trunk, that the "
        "body's path keeps where it can; 0: it does not look",
        within(0.0, 1.0),
    )
    max_ahead: float = number(
        10.0,
        "m",
        "How far the body may go ahead of or behind its nominal place as it walks",
        within(0.0, 100.0),
    )
    stance_length: float = number(
        0.75, "m", "P_x, between the centres of the front and the rear workspaces", positive()
    )
    stance_width: float = number(
        0.54, "m", "P_y, between the centres of the left and the right workspaces", positive()
    )
    stance_stagger: float = number(
        0.12,
        "m",
        "Rear feet's \\|y\\| minus front feet's \\|y\\|: keeps the feet of a side apart where the "
        "wave puts one beside the other",
        not_negative(),
    )
    workspace_length: float = number(0.80, "m", "R_x of each leg's workspace", positive())
    workspace_width: float = number(0.5, "m", "R_y of each leg's workspace", positive())
    on_centre: bool = number(
        True,
        "",
        "Whether footprints on stairs are on the treads' centres; false: with the gait's own "
        "offset from them, as in the paper",
    )
    swing_speed: float = number(
        0.0,
        "m/s",
        "Speed that a swing foot does not exceed along the ground, up or down: of the wave gait's "
        "swings those that would last longer, and all peak where that is calmest; 0: all last as "
        "long, and are as low as can be",
        not_negative(),
        within(0.0, 20.0),
    )
    swing_speed_up: LegSpeedsConfig = part(
        LegSpeedsConfig, "Speeds of feet in swings up, leg by leg; only with `swing_speed`"
    )
    swing_speed_down: LegSpeedsConfig = part(
        LegSpeedsConfig, "Speeds of feet in swings down, leg by leg; only with `swing_speed`"
    )
    swing_clearance: float = number(
        0.02, "m", "Δh, by how much the foot's sphere clears what it passes", not_negative()
    )
    map_error_place: float = number(
        0.0,
        "m",
        "How far the map's risers may be from where they are: swing feet keep this distance from "
        "them, and footprints 2 mm more. With `design: auto` shanks keep 0.7 of it more than else, "
        "where such a gait exists; with a gait of your own set `gait.shank_room` for that",
        not_negative(),
    )
    map_error_height: float = number(
        0.0,
        "m",
        "How much higher the map's treads may be: swings keep this distance above them",
        not_negative(),
    )
    body_height: float = number(
        0.85,
        "m",
        "Height of the body's centre over the mean ground under the feet",
        positive(),
        within(0.05, 5.0),
    )
    pitch: str = choice("level", ("level", "slope"), "`slope` tilts the body with the stairs")
    pitch_share: float = number(
        1.0,
        "",
        "With `slope`: how much of the stairs' slope; the body is never tilted by more than 0.64 "
        "rad",
        within(0.0, 1.5),
    )
    margin: str = choice(
        "hull",
        KINDS,
        "Region in which the plan's static margin is measured, and in which the body's path keeps "
        "it: `hull` of the standing feet; `friction`, the region of balance on the map's ground "
        "within `controller.friction`; `feasible`, within the joints' torque limits too "
        "([how](margins.md#the-margin-that-a-plan-keeps)). Other than `hull` not with "
        "`body.balance: dynamic`; the monitor then measures that margin in any case",
    )


@dataclass
class SpinConfig:
    """The spinning gait."""

    duty_factor: float = number(
        0.85,
        "",
        "β of the spinning gait",
        FieldBound(DUTY_REMEDY, least=LEAST_DUTY, below=1.0),
    )
    cycle_time: float = _cycle_time("T of the spinning gait")
    workspace_length: float = number(
        0.0, "m", "R_x of each leg's workspace as it spins; 0: the wave gait's", not_negative()
    )
    workspace_width: float = number(
        0.0, "m", "R_y of each leg's workspace as it spins; 0: the wave gait's", not_negative()
    )
    swing_path: str = choice(
        "chord",
        ("chord", "arc"),
        "`chord`: swings go straight over the ground to the next footprint; `arc`: round the body, "
        "as in the paper, over level ground. Plans with arcs have no certificate",
    )


@dataclass
class TransitionConfig:
    """Steps from one stance to another, between gaits."""

    mode: str = choice(
        "shift",
        ("still", "shift"),
        "`still`: the body at rest through a transition, as in the paper; `shift`: it moves before "
        "each lift",
    )
    max_shift: float = number(
        0.3,
        "m",
        "How far the body may go from its nominal place: in x and y where that stands still, "
        "sideways where it walks",
        not_negative(),
    )
    swing_time: float = number(1.2, "s", "Time of each step", positive(), within(0.1, 60.0))
    shift_time: float = number(
        1.3, "s", "Time on four feet before each step", not_negative(), within(0.0, 60.0)
    )
    via_centres: bool = number(
        False,
        "",
        "Whether every transition passes through the workspaces' centres, as in the paper",
    )
    wave_order: list[int] = number(
        [],
        "",
        "Legs in the order in which they are lifted towards the wave gait, such as the paper's "
        "`[2, 3, 4, 1, 3]`: each leg's last lift takes it to its place, one before that to the "
        "place in between with the best margins. Each leg at least once, at most 6 lifts with mode "
        "`still`, 5 with `shift`. Empty: the fewest steps with the best margins",
    )
    spin_order: list[int] = number(
        [],
        "",
        "Legs in the order in which they are lifted towards the spinning gait, whichever way that "
        "turns",
    )


@dataclass
class BodyConfig:
    """The path of the body."""

    path: str = choice(
        "optimised",
        ("optimised", "uniform"),
        "`optimised` for margin, or `uniform`: constant speed without sway, as in the paper",
    )
    balance: str = choice(
        "static",
        ("static", "dynamic"),
        "`static`: the centre of mass is kept over the feet, and the zero-moment point; `dynamic`: "
        "the zero-moment point alone, with the legs' masses moving, for quick gaits",
    )
    margin_desired: float = number(
        0.10, "m", "Static margin beyond which the path is not asked for more", not_negative()
    )
    zmp_margin: float = number(
        0.08,
        "m",
        "Margin of the zero-moment point beyond which the path is not asked for more",
        not_negative(),
    )
    guard: float = number(
        0.15,
        "s",
        "For how long before a lift-off, and after a touchdown, the path is to keep its margin on "
        "the three other feet; not with `balance: dynamic`",
        not_negative(),
        within(0.0, 2.0),
    )


OF_LEG = {"body": 0.005, "foot": 0.004, "swing": 0.005}  # of a leg's length, if not given


def _of_leg(text: str, name: str) -> float | None:
    """A distance that grows with the legs if it is not given."""
    text += f"; {100.0 * OF_LEG[name]:g} % of the leg's length if not given"
    bound: float | None = number(None, "m", text, not_negative(), within(0.0, 1.0))
    return bound


@dataclass
class TolerancesConfig:
    """How far stairs, masses and the robot's motion may be from the plan."""

    rise: float = number(
        0.005,
        "m",
        "How much higher or lower than mapped each tread may be, beside a shift that all of the "
        "ground and the robot share",
        not_negative(),
        within(0.0, 0.1),
    )
    run: float = number(
        0.005, "m", "How far each riser may be from where it is mapped", not_negative(),
        within(0.0, 0.1),
    )  # fmt: skip
    mass: float = number(
        0.1, "", "Share by which all masses may be more, in one ratio", not_negative(),
        within(0.0, 1.0),
    )  # fmt: skip
    com: float = number(
        0.02, "m", "Horizontal distance of the robot's centre of mass from its model's",
        not_negative(), within(0.0, 1.0),
    )  # fmt: skip
    body: float | None = _of_leg("Distance of the body from its plan, along each axis of W", "body")
    tilt_deg: float = number(
        0.3, "deg", "Roll, and error of pitch", not_negative(), within(0.0, 30.0)
    )
    turn_deg: float = number(0.3, "deg", "Error of yaw", not_negative(), within(0.0, 30.0))
    foot: float | None = _of_leg("Distance of a standing foot from where it is planned", "foot")
    swing: float | None = _of_leg("Distance of a swing foot from where it is planned", "swing")
    late: float = number(
        0.05,
        "s",
        "How late a foot may come to bear after its touchdown, in the gait clock's time",
        not_negative(),
        within(0.0, 10.0),
    )


@dataclass
class CertifyConfig:
    """What a certificate of the plan is to prove at every time, beside that all is positive."""

    margin: float = number(
        0.0,
        "m",
        "Static margin that the plan's [certificate](certificates.md) is to prove at every time; "
        "whatever is asked for, all has to be positive",
        not_negative(),
    )
    clearance: float = number(
        0.0,
        "m",
        "Distance of swing feet from risers and nosings, and of knees and shanks from the course, "
        "that it is to prove",
        not_negative(),
    )
    tolerances: TolerancesConfig = part(
        TolerancesConfig, "[Tolerances](certificates.md#within-tolerances) within which it holds"
    )
