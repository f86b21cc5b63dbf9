"""When a push has to be caught, with which foot, and when it is over."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from drake_quad.common import GRAVITY, BoolArray, FloatArray
from drake_quad.control.base_tracking import LEAST_HEIGHT, pendulum_rate
from drake_quad.control.ports import CATCH_SIZE, Balance, Catch
from drake_quad.planning.contact_plan import Step
from drake_quad.planning.recovery_step import LIFT, StepTargetMap, choose_recovery_step
from drake_quad.robot.model import RobotModel
from drake_quad.stability.capture_point import FallingPendulum
from drake_quad.stability.support_polygon import stability_margin

SHARE = 0.8  # of the base's velocity error that the whole robot's centre of mass has
CALM_SPEED = 0.04  # [m/s] of the base's velocity error, below which the robot is calm
CALM_MARGIN = 0.03  # [m]


@dataclass(frozen=True, kw_only=True)
class Reflex:
    """What recovery from pushes needs to know, and its settings.

    Attributes:
        robot: The robot.
        ground: The ground as mapped.
        push_speed: Error of the base's velocity below which nothing is called a push [m/s].
    """

    robot: RobotModel
    ground: StepTargetMap
    push_speed: float = 0.12


def capture_point(balance: FloatArray, support: BoolArray) -> tuple[tuple[float, float], float]:
    """Where the pressure under the feet has to be able to get to, for the robot not to tip [m].

    The linear inverted pendulum's capture point, taken from the plan's own motion: the plan is
    balanced by itself, so only the error of the velocity counts, beside the acceleration planned
    (Pratt et al., "Capture point", Humanoids 2006).

    Returns:
        The point in W [m], and the pendulum's rate [1/s].
    """
    b = balance.tolist()
    heights = [b[Balance.FEET + 3 * k + 2] for k in range(4) if support[k]]
    height = max(b[2] - sum(heights) / len(heights), LEAST_HEIGHT)
    omega = pendulum_rate(height)
    per_speed = SHARE / omega
    x = b[0] - height / GRAVITY * b[Balance.ACCELERATION] + per_speed * b[Balance.VELOCITY_ERROR]
    y = (
        b[1]
        - height / GRAVITY * b[Balance.ACCELERATION + 1]
        + per_speed * b[Balance.VELOCITY_ERROR + 1]
    )
    return (x, y), omega


def needs_recovery(
    reflex: Reflex, balance: FloatArray, bearing: FloatArray, standing: BoolArray
) -> bool:
    """Whether the robot would tip over the feet that stand or bear."""
    if hypot(*balance[Balance.VELOCITY_ERROR : Balance.FEET].tolist()) < reflex.push_speed:
        return False
    return balance_margin(balance, np.asarray(standing, dtype=bool) | (bearing > 0.5)) < 0.0


def has_settled(balance: FloatArray, bearing: FloatArray) -> bool:
    """Whether the robot stands on four feet, nearly at rest."""
    support = bearing > 0.5
    speed = hypot(*balance[Balance.VELOCITY_ERROR : Balance.FEET].tolist())
    return bool(
        np.all(support) and speed < CALM_SPEED and balance_margin(balance, support) > CALM_MARGIN
    )


def choose_swing_foot(
    reflex: Reflex, balance: FloatArray, standing: BoolArray, steps: Sequence[Step]
) -> FloatArray:
    """Which foot to put down where: see Catch; leg 0 if standing still is all there is to do.

    Args:
        reflex: Robot, ground and settings.
        balance: The robot's balance, see Balance.
        standing: Which feet are to stand (4,).
        steps: The steps under way.
    """
    x, y, z, yaw = balance[Balance.BODY : Balance.BODY + 4].tolist()
    capture, omega = capture_point(balance, standing)
    body = FallingPendulum(
        feet=balance[Balance.FEET : Balance.BODY].reshape(4, 3),
        standing=standing,
        p_WB=np.array([x, y, z]),
        yaw=yaw,
        com=balance[:2],
        capture=np.array(capture),
        omega=omega,
    )
    found, lift = None, 0.0
    for step in steps:
        end = step.swing.p_end
        its = choose_recovery_step(
            reflex.robot, reflex.ground, body, swing=step.leg.row, touchdown=end
        )
        if its is not None and (found is None or its.margin > found.margin):
            found = its
    if found is None or found.margin < 0.0:
        # A foot that stands may be put where it helps more, the one in the air or not.
        other = choose_recovery_step(reflex.robot, reflex.ground, body)
        if other is not None and (found is None or other.margin > found.margin):
            found, lift = other, LIFT
    catch = np.zeros(CATCH_SIZE)
    if found is not None:
        catch[Catch.LEG], catch[Catch.DURATION] = int(found.leg), found.duration
        catch[Catch.X : Catch.DURATION] = found.p_W
        catch[Catch.LIFT] = lift
    return catch


def balance_margin(balance: FloatArray, support: BoolArray) -> float:
    """Distance of the capture point from the sides of the feet that support, inside positive [m].

    What a leg's lift-off needs of the other three, and what a push takes away. At rest it is the
    static margin.
    """
    if not np.any(support):
        return -1.0
    (x, y), _ = capture_point(balance, support)
    feet = balance[Balance.FEET : Balance.BODY].reshape(4, 3)[support, :2]
    return stability_margin((x, y), feet)
