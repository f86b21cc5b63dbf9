"""What the controllers are set to, which is also a scenario's section `controller`.

Not frozen, and without postponed annotations, for Drake's YAML reader fills it; nobody else writes.
"""

from dataclasses import dataclass, replace

from drake_quad.util.schema import choice, not_negative, number, positive, within

FRICTION_MOST = 10.0  # rubber on dry rock has 1 or so
LINE_DISTANCE = 0.025  # of a leg's length, if not given


@dataclass(kw_only=True)
class ControlSettings:
    """Joint and base feedback, loads and patience; unit and meaning stand beside each field."""

    kind: str = choice(
        "ik",
        ("ik", "whole_body"),
        "`ik`: statics and stiff joints; `whole_body`: inverse dynamics by a program",
    )
    period: float = number(
        0.005,
        "s",
        "Period of the controller, and of the monitors, which keep to its ticks; a whole multiple "
        "of the plant's `time_step`",
        positive(),
        within(1e-4, 0.05),
    )
    kp: float = number(2000.0, "Nm/rad", "Joint stiffness; the plant applies it", not_negative())
    kd: float = number(80.0, "Nm s/rad", "Joint damping", not_negative())
    base_stiffness: float = number(
        3000.0, "N/m", "Force per error of the base's place", not_negative()
    )
    base_damping: float = number(
        900.0, "N s/m", "Force per error of the base's velocity", not_negative()
    )
    base_rotation_stiffness: float = number(
        1000.0, "Nm/rad", "Moment per error of the base's orientation", not_negative()
    )
    base_rotation_damping: float = number(
        100.0, "Nm s/rad", "Moment per error of the base's angular velocity", not_negative()
    )
    foothold_time: float = number(
        0.12,
        "s",
        "Time constant with which a standing foot's target moves from where it was planned to "
        "stand to where it does stand, so that no joint goes on pulling it to the plan's place",
        not_negative(),
    )
    unload_time: float = number(
        0.25, "s", "Time over which a foot takes its load up or gives it away", not_negative()
    )
    least_force: float = number(
        20.0,
        "N",
        "What a foot under full load pushes with at least, if the others can hold the robot all "
        "the same, but in a push; in any case up to twice that, where it would bear twice as much "
        "again with the robot brought to rest",
        not_negative(),
    )
    touchdown_press: float = number(
        0.003,
        "m",
        "How far below the ground a swing foot aims as it lands: the joints' stiffness then makes "
        "it bear at once",
        not_negative(),
    )
    landing_speed: float = number(
        0.15,
        "m/s",
        "How fast a foot that found no ground at the end of its swing goes on down while the clock "
        "waits for it",
        not_negative(),
    )
    search_speed: float = number(
        0.05,
        "m/s",
        "How fast a standing foot that lost the ground goes down after it, and the body where a "
        "leg is too short to reach the ground; a foot that catches a push, four times as fast",
        not_negative(),
    )
    lift_off_margin: float = number(
        0.02,
        "m",
        "Static margin that the other three feet must give before a lift-off",
        not_negative(),
    )
    line_distance: float | None = number(
        None,
        "m",
        "With `gait.pattern: trot`: how far from the line of the feet that stay the capture point "
        "may be, less what is planned, for two legs to lift off; else the clock waits on four "
        f"feet; {100.0 * LINE_DISTANCE:g} % of the leg's length and half of a foot's radius if not "
        "given",
        positive(),
    )
    margin_demanded: float = number(
        0.0,
        "m",
        "Static margin, speed counted in, that the gait clock slows down and stands for, before "
        "it is lost; after `patience` it stops the run; 0: it does not",
        not_negative(),
    )
    stance_stiffness: float = number(
        0.3,
        "",
        "Share of the joints' stiffness and damping that a loaded leg keeps under the whole-body "
        "controller, whose forces do the rest",
        within(0.0, 1.0),
    )
    friction: float = number(
        0.5,
        "",
        "Coefficient that the whole-body controller's forces stay within, and that plans with a "
        "`gait.margin` beyond the hull's count on",
        positive(),
        within(0.0, FRICTION_MOST),
    )
    pressure_margin: float = number(
        0.01,
        "m",
        "Margin of the centre of pressure from the support's sides that the whole-body controller "
        "keeps",
        not_negative(),
    )
    load_time: float = number(
        0.5,
        "s",
        "Time over which the whole-body controller learns of a load that the model does not have; "
        "0: it does not",
        not_negative(),
    )
    height_time: float = number(
        0.5, "s", "Time over which the body follows the height of the ground as found", positive()
    )
    catch_pushes: bool = number(True, "", "Whether pushes are caught by putting feet down")
    push_speed: float = number(
        0.12, "m/s", "Error of the base's velocity below which nothing is called a push", positive()
    )
    patience: float = number(
        2.0,
        "s",
        "How long the gait clock waits at a switch before it stops the run",
        not_negative(),
    )


def for_legs(control: ControlSettings, leg: float, foot_radius: float) -> ControlSettings:
    """The settings, with what grows with the legs and was not given filled in.

    A plan's zero-moment point may itself be half of a foot's radius off the line.

    Args:
        control: The settings.
        leg: Length of the legs [m].
        foot_radius: Radius of the feet [m].
    """
    if control.line_distance is not None:
        return control
    return replace(control, line_distance=LINE_DISTANCE * leg + 0.5 * foot_radius)
