"""What the controllers are set to: one frozen value for all of them."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ControlSettings:
    """Feedback, loads and patience.

    Attributes:
        kind: `ik`, statics and stiff joints, or `whole_body`, inverse dynamics by a program.
        period: Of every controller and monitor [s].
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
        friction: Coefficient that the whole-body controller's forces stay within.
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
